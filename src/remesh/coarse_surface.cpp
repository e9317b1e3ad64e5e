#include "remesh/coarse_surface.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>
#include <vector>

#include "features/curves.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

constexpr double kSpacing = 0.6;         // of the vertices, in edges
constexpr double kReachAfter = 1.5;      // of fronts that start in the middle of a cluster, in spacings
constexpr double kNormals = 0.5;         // cosine of the angle between normals of vertices that become one, at least
constexpr double kPerComponent = 4;      // edges are no longer than those of so many cells on a component
constexpr double kPerCurve = 4;          // nor than such a part of a curve
constexpr double kFewer = 0.8;           // triangles must be fewer than this share
constexpr double kAreaTolerance = 0.05;  // relative

// The vertices that become one are those with the same label, which is the index of the one that stays.
class Clusters {
 public:
  Clusters(const Surface& surface, double edge_length);

  void take_curves(const FeatureGraph& features);
  void take_surface();
  void even_out();
  const std::vector<Index>& labels() const { return label_; }

 private:
  struct Front {
    double distance;
    Index vertex, label;
    friend auto operator<=>(const Front&, const Front&) = default;
  };

  void find_normals_and_spacing(double edge_length);
  void hold(Index vertex, Index label, double distance);
  void take_curve(const FeatureCurve& curve);
  void advance(Index vertex);
  void spread();

  const Surface& surface_;
  const TriangleMesh& mesh_;
  const Csr<Index> neighbours_;
  std::vector<Vec3> normals_;
  std::vector<double> spacing_, distance_;
  std::vector<Index> label_;
  double reach_ = 1;        // of fronts, in spacings
  std::vector<char> held_;  // on features, whose labels are theirs for good
  std::priority_queue<Front, std::vector<Front>, std::greater<>> fronts_;
};

Clusters::Clusters(const Surface& surface, double edge_length)
    : surface_(surface), mesh_(surface.mesh), neighbours_(vertex_neighbours(mesh_.triangles, mesh_.vertices.size())),
      distance_(mesh_.vertices.size(), std::numeric_limits<double>::infinity()), label_(mesh_.vertices.size(), kNone),
      held_(mesh_.vertices.size(), 0) {
  find_normals_and_spacing(edge_length);
}

void Clusters::find_normals_and_spacing(double edge_length) {
  const std::vector<Index> component = label_components(mesh_.triangles, mesh_.vertices.size());
  std::vector<double> area(mesh_.vertices.size(), 0);  // of components
  normals_.assign(mesh_.vertices.size(), {});
  for (std::size_t k = 0; k < surface_.facets.size(); ++k) {
    const Facet& f = surface_.facets[k];
    const Triangle& t = mesh_.triangles[surface_.summaries[k].triangle];
    const Vec3 normal = twice_area_normal(f.corners[0], f.corners[1], f.corners[2]);
    area[component[t[0]]] += 0.5 * norm(normal);
    for (const Index v : t) normals_[v] += normal;
  }
  for (Vec3& n : normals_) n = unit(n);
  spacing_.assign(mesh_.vertices.size(), 0);
  for (const Index v : surface_.used_vertices) {
    const double most = std::sqrt(2 / std::numbers::sqrt3 * area[component[v]] / kPerComponent);
    const double density = surface_.density.empty() ? 1 : surface_.density[v];
    spacing_[v] = kSpacing * std::min(most, edge_length / std::sqrt(std::sqrt(density)));
  }
}

void Clusters::hold(Index vertex, Index label, double distance) {
  held_[vertex] = 1;
  label_[vertex] = label;
  distance_[vertex] = distance;
  advance(vertex);
}

void Clusters::take_curve(const FeatureCurve& curve) {
  const std::size_t n = curve.vertices.size(), segments = curve.closed ? n : n - 1;
  std::vector<double> at(segments + 1, 0);
  const auto vertex = [&](std::size_t k) { return curve.vertices[k % n]; };
  for (std::size_t k = 0; k < segments; ++k)
    at[k + 1] = at[k] + norm(mesh_.vertices[vertex(k + 1)] - mesh_.vertices[vertex(k)]);
  const double most = at.back() / kPerCurve;
  std::size_t last = 0;
  for (std::size_t k = 1; k <= segments; ++k) {
    const double spacing = std::min(most, spacing_[vertex(k)]);
    const bool stays = k == segments || (at[k] - at[last] >= spacing && at.back() - at[k] >= 0.5 * spacing);
    if (!stays) continue;
    for (std::size_t m = last; m <= k; ++m) {
      if (held_[vertex(m)]) continue;
      const bool to_last = at[m] - at[last] <= at[k] - at[m];
      hold(vertex(m), vertex(to_last ? last : k), to_last ? at[m] - at[last] : at[k] - at[m]);
    }
    last = k;
  }
}

void Clusters::take_curves(const FeatureGraph& features) {
  for (const Index v : features.corners) hold(v, v, 0);
  for (const FeatureCurve& curve : features.curves) take_curve(curve);
  spread();
}

void Clusters::advance(Index vertex) {
  for (const Index* to = neighbours_.begin(vertex); to != neighbours_.end(vertex); ++to) {
    if (held_[*to]) continue;
    const double distance = distance_[vertex] + norm(mesh_.vertices[*to] - mesh_.vertices[vertex]);
    if (distance < distance_[*to] && distance <= reach_ * spacing_[*to]) fronts_.push({distance, *to, label_[vertex]});
  }
}

// Every front goes on as far as it is nearer than others. A vertex whose triangles' normals cancel is a cluster of its
// own.
void Clusters::spread() {
  while (!fronts_.empty()) {
    const Front front = fronts_.top();
    fronts_.pop();
    const Index v = front.vertex;
    if (held_[v] || front.distance >= distance_[v]) continue;
    if (v != front.label && !held_[front.label] && dot(normals_[v], normals_[front.label]) < kNormals) continue;
    distance_[v] = front.distance;
    label_[v] = front.label;
    advance(v);
  }
}

void Clusters::take_surface() {
  for (const Index v : surface_.used_vertices) {
    if (label_[v] != kNone) continue;
    fronts_.push({0, v, v});
    spread();
  }
}

// A step of Lloyd's: the vertex nearest to the middle of its cluster stays instead of the one that was first.
void Clusters::even_out() {
  struct Cluster {
    Vec3 sum;
    double count = 0;
    Index middle = kNone;
    double squared = 0;  // of the middle's distance from the mean, times the count
  };
  std::vector<Cluster> clusters(label_.size());
  for (const Index v : surface_.used_vertices) {
    Cluster& cluster = clusters[label_[v]];
    cluster.sum += mesh_.vertices[v];
    ++cluster.count;
  }
  for (const Index v : surface_.used_vertices) {
    if (held_[label_[v]]) continue;
    Cluster& cluster = clusters[label_[v]];
    const double squared = norm2(cluster.count * mesh_.vertices[v] - cluster.sum);
    if (cluster.middle != kNone && squared >= cluster.squared) continue;
    cluster.middle = v;
    cluster.squared = squared;
  }
  for (const Index v : surface_.used_vertices) {
    if (held_[v]) continue;
    label_[v] = kNone;
    distance_[v] = std::numeric_limits<double>::infinity();
  }
  for (const Index v : surface_.used_vertices)
    if (held_[v]) advance(v);
  for (const Cluster& cluster : clusters)
    if (cluster.middle != kNone) fronts_.push({0, cluster.middle, cluster.middle});
  reach_ = kReachAfter;
  spread();
  take_surface();
}

// The curves along the vertices that are left of theirs; `image` is the new vertex of each, kNone if it is on no
// triangle.
FeatureGraph images_of(const FeatureGraph& features, const std::vector<Index>& image) {
  FeatureGraph graph;
  for (const Index v : features.corners)
    if (image[v] != kNone) graph.corners.push_back(image[v]);
  std::sort(graph.corners.begin(), graph.corners.end());
  for (const FeatureCurve& curve : features.curves) {
    FeatureCurve left{{}, curve.closed, curve.kind};
    for (const Index v : curve.vertices)
      if (image[v] != kNone && (left.vertices.empty() || left.vertices.back() != image[v]))
        left.vertices.push_back(image[v]);
    if (left.closed && left.vertices.size() > 1 && left.vertices.front() == left.vertices.back())
      left.vertices.pop_back();
    if (left.vertices.size() > 1) graph.curves.push_back(std::move(left));
  }
  graph.edges = edges_of(graph.curves);
  return graph;
}

}  // namespace

CoarseSurface coarse_surface(const Surface& fine, const FeatureGraph& features, double edge_length) {
  Clusters clusters(fine, edge_length);
  clusters.take_curves(features);
  clusters.take_surface();
  clusters.even_out();
  const std::vector<Index>& label = clusters.labels();
  TriangleMesh mesh;
  std::vector<double> density;
  std::vector<Index> renamed(label.size(), kNone);
  const std::size_t most = static_cast<std::size_t>(kFewer * static_cast<double>(fine.facets.size()));
  for (const FacetSummary& facet : fine.summaries) {
    const Triangle& t = fine.mesh.triangles[facet.triangle];
    Triangle image{label[t[0]], label[t[1]], label[t[2]]};
    if (image[0] == image[1] || image[1] == image[2] || image[2] == image[0]) continue;
    if (mesh.triangles.size() == most) return {};
    for (Index& v : image) {
      if (renamed[v] == kNone) {
        renamed[v] = static_cast<Index>(mesh.vertices.size());
        mesh.vertices.push_back(fine.mesh.vertices[v]);
        if (!fine.density.empty()) density.push_back(fine.density[v]);
      }
      v = renamed[v];
    }
    mesh.triangles.push_back(image);
  }
  if (mesh.triangles.empty()) return {};
  CoarseSurface coarse;
  coarse.surface = std::make_unique<Surface>(std::move(mesh), std::move(density));
  if (std::abs(coarse.surface->area - fine.area) > kAreaTolerance * fine.area) return {};
  std::vector<Index> image(label.size(), kNone);
  for (std::size_t v = 0; v < label.size(); ++v)
    if (label[v] != kNone) image[v] = renamed[label[v]];
  coarse.features = images_of(features, image);
  return coarse;
}

}  // namespace bisector
