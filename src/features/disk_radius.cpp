#include "features/disk_radius.h"

#include <cmath>

#include "core/marks.h"
#include "core/parallel.h"
#include "mesh/half_edges.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

constexpr double kStep = 0.8;
// A ball that a corner or bump juts out of makes a hole in the surface, which is gone in a ball so much wider.
constexpr double kBump = 1.5;
constexpr std::size_t kPointsAtOnce = 16;  // of a parallel loop

class Balls {
 public:
  explicit Balls(const TriangleMesh& mesh) : mesh_(mesh), twin_(3 * mesh.triangles.size(), kNone) {
    const Csr<EdgeSide> sides = edge_sides(mesh.triangles, mesh.vertices.size());
    each_edge(sides, [&](std::span<const EdgeSide> edge) {
      if (edge.size() != 2) return;
      twin_[edge[0].half_edge] = edge[1].half_edge;
      twin_[edge[1].half_edge] = edge[0].half_edge;
    });
    on_border_.assign(mesh.vertices.size(), 0);
    for (std::size_t h = 0; h < twin_.size(); ++h)
      if (twin_[h] == kNone)
        for (const std::size_t end : {h, next_half_edge(h)}) on_border_[origin(mesh.triangles, end)] = 1;
  }

  struct Visit {
    Marks triangles, vertices;
    std::vector<Index> queue;
  };

  // Triangles, edges and vertices are convex, and so are their parts in the ball: the triangles' less those of the
  // edges between them plus the vertices' is the Euler characteristic (inclusion and exclusion).
  bool is_disk(const SurfaceSample& centre, double radius, Visit& visit) const {
    const double squared = radius * radius;
    visit.triangles.begin(mesh_.triangles.size());
    visit.vertices.begin(mesh_.vertices.size());
    visit.queue.assign(1, centre.triangle);
    visit.triangles.mark(centre.triangle);
    long long half_edges = 0, vertices = 0;
    for (std::size_t i = 0; i < visit.queue.size(); ++i) {
      const Index t = visit.queue[i];
      const Triangle& corners = mesh_.triangles[t];
      bool inside[3];
      for (int k = 0; k < 3; ++k) {
        const Index v = corners[k];
        inside[k] = norm2(mesh_.vertices[v] - centre.point) <= squared;
        if (inside[k] && !on_border_[v] && visit.vertices.mark(v)) ++vertices;
      }
      for (Index k = 0, next = 1; k < 3; ++k, next = next == 2 ? 0 : next + 1) {
        const Index twin = twin_[3 * t + k];
        if (twin == kNone) continue;
        if (!inside[k] && !inside[next]) {
          const Vec3 &a = mesh_.vertices[corners[k]], &b = mesh_.vertices[corners[next]];
          if (norm2(nearest_on_segment(centre.point, a, b) - centre.point) > squared) continue;
        }
        ++half_edges;
        if (visit.triangles.mark(twin / 3)) visit.queue.push_back(twin / 3);
      }
    }
    return static_cast<long long>(visit.queue.size()) - half_edges / 2 + vertices == 1;
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<Index> twin_;  // of each half-edge; kNone on the border
  std::vector<char> on_border_;
};

}  // namespace

std::vector<double> disk_radii(const TriangleMesh& mesh, const std::vector<SurfaceSample>& points,
                               const std::vector<double>& radii, double least) {
  const Balls balls(mesh);
  ThreadLocal<Balls::Visit> visits;
  std::vector<double> found(radii);
  parallel_each(
      points.size(),
      [&](std::size_t k) {
        Balls::Visit& visit = visits.local();
        const auto fits = [&](double radius) {
          return balls.is_disk(points[k], radius, visit) || balls.is_disk(points[k], kBump * radius, visit);
        };
        while (found[k] * kStep >= least * radii[k] && !fits(found[k])) found[k] *= kStep;
      },
      kPointsAtOnce);
  return found;
}

}  // namespace bisector
