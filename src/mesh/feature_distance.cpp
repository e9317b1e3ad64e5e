#include "bisector/quality.h"

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry.h"

namespace bisector {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Segments = std::vector<Kernel::Segment_3>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_segment_primitive<Kernel, Segments::const_iterator>>>;

constexpr double kSpacing = 1.0 / 4000;  // of samples, of the diagonal
constexpr int kPerEdge = 4;              // at least

Kernel::Point_3 to_cgal(const Vec3& p) { return {p.x, p.y, p.z}; }

class Creases {
 public:
  Creases(const std::vector<Vec3>& vertices, const FeatureEdges& edges) {
    for (const auto& [a, b] : edges) segments_.emplace_back(to_cgal(vertices[a]), to_cgal(vertices[b]));
    tree_.rebuild(segments_.begin(), segments_.end());
    if (!segments_.empty()) tree_.accelerate_distance_queries();
  }

  double distance(const Vec3& p) const { return std::sqrt(tree_.squared_distance(to_cgal(p))); }

 private:
  Segments segments_;
  Tree tree_;
};

double farthest(const std::vector<Vec3>& vertices, const FeatureEdges& edges, const Creases& from, double spacing) {
  double most = 0;
  for (const auto& [a, b] : edges) {
    const Vec3 along = vertices[b] - vertices[a];
    const int parts = std::max(kPerEdge, static_cast<int>(norm(along) / spacing));
    for (int k = 0; k <= parts; ++k)
      most = std::max(most, from.distance(vertices[a] + (static_cast<double>(k) / parts) * along));
  }
  return most;
}

}  // namespace

FeatureDistance measure_feature_distance(const std::vector<Vec3>& vertices, const FeatureEdges& edges,
                                         const TriangleMesh& reference, const FeatureEdges& reference_edges) {
  FeatureDistance result;
  if (edges.empty() && reference_edges.empty()) return result;
  if (edges.empty() || reference_edges.empty()) {
    result.vertices = result.to_reference = result.from_reference = std::numeric_limits<double>::infinity();
    return result;
  }
  const double diagonal = bounding_box(reference).diagonal(), percent = 100 / diagonal;
  const Creases mine(vertices, edges), theirs(reference.vertices, reference_edges);
  for (const auto& edge : edges)
    for (Index v : edge) result.vertices = std::max(result.vertices, percent * theirs.distance(vertices[v]));
  result.to_reference = percent * farthest(vertices, edges, theirs, kSpacing * diagonal);
  result.from_reference = percent * farthest(reference.vertices, reference_edges, mine, kSpacing * diagonal);
  return result;
}

}  // namespace bisector
