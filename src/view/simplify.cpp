#include "view/simplify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/geometry.h"

namespace bisector::view {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

struct Clusters {
  std::vector<Index> of_vertex;
  std::size_t count = 0;
};

Clusters cluster(const std::vector<Vec3>& vertices, double cell) {
  const Vec3 lo = bounding_box(vertices).lo;
  const auto key = [&](const Vec3& p) {
    return std::array<std::int64_t, 3>{static_cast<std::int64_t>((p.x - lo.x) / cell),
                                       static_cast<std::int64_t>((p.y - lo.y) / cell),
                                       static_cast<std::int64_t>((p.z - lo.z) / cell)};
  };
  std::vector<std::pair<std::array<std::int64_t, 3>, Index>> cells(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) cells[v] = {key(vertices[v]), static_cast<Index>(v)};
  std::sort(cells.begin(), cells.end());
  Clusters clusters;
  clusters.of_vertex.resize(vertices.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (k == 0 || cells[k].first != cells[k - 1].first) ++clusters.count;
    clusters.of_vertex[cells[k].second] = static_cast<Index>(clusters.count - 1);
  }
  return clusters;
}

struct Kept {
  std::vector<Triangle> triangles;  // of clusters, the lowest first
  std::vector<Index> of_triangle;   // which one a triangle became; kNone: none
};

Kept keep_triangles(const std::vector<Triangle>& triangles, const std::vector<Index>& cluster_of) {
  std::vector<std::pair<Triangle, Index>> made;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Triangle t{cluster_of[triangles[i][0]], cluster_of[triangles[i][1]], cluster_of[triangles[i][2]]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    made.emplace_back(t, static_cast<Index>(i));
  }
  std::sort(made.begin(), made.end());
  Kept kept;
  kept.of_triangle.assign(triangles.size(), kNone);
  for (const auto& [t, source] : made) {
    if (kept.triangles.empty() || kept.triangles.back() != t) kept.triangles.push_back(t);
    kept.of_triangle[source] = static_cast<Index>(kept.triangles.size() - 1);
  }
  return kept;
}

double area_of(const Model& model) {
  double area = 0;
  for (const Triangle& t : model.triangles)
    area += 0.5 * norm(twice_area_normal(model.vertices[t[0]], model.vertices[t[1]], model.vertices[t[2]]));
  return area;
}

std::vector<Vec3> means(const std::vector<Vec3>& vertices, const Clusters& clusters) {
  std::vector<Vec3> sums(clusters.count);
  std::vector<double> counts(clusters.count, 0);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    sums[clusters.of_vertex[v]] += vertices[v];
    ++counts[clusters.of_vertex[v]];
  }
  for (std::size_t c = 0; c < clusters.count; ++c) sums[c] *= 1 / counts[c];
  return sums;
}

void take_worse(const Measure& measure, double& value, double other) {
  if (is_worse(measure, other, value)) value = other;
}

std::vector<double> vertex_values(const Measure& measure, const std::vector<double>& values, const Clusters& clusters) {
  std::vector<double> worst(clusters.count, kMissing);
  for (std::size_t v = 0; v < values.size(); ++v) take_worse(measure, worst[clusters.of_vertex[v]], values[v]);
  return worst;
}

// Triangles that are gone count at all those around the cluster of their first corner.
std::vector<double> triangle_values(const Measure& measure, const std::vector<double>& values, const Model& model,
                                    const Clusters& clusters, const Kept& kept) {
  std::vector<double> gone(clusters.count, kMissing), shown(kept.triangles.size(), kMissing);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (const Index k = kept.of_triangle[i]; k != kNone) take_worse(measure, shown[k], values[i]);
    else take_worse(measure, gone[clusters.of_vertex[model.triangles[i][0]]], values[i]);
  for (std::size_t k = 0; k < shown.size(); ++k)
    for (const Index c : kept.triangles[k]) take_worse(measure, shown[k], gone[c]);
  return shown;
}

const Measure* find_measure(const std::vector<Measure>& measures, const std::string& key) {
  const auto found = std::find_if(measures.begin(), measures.end(), [&](const Measure& m) { return m.key == key; });
  return found == measures.end() ? nullptr : &*found;
}

}  // namespace

Model simplified(const Model& model, const std::vector<Measure>& measures, std::size_t most_triangles) {
  const double diagonal = bounding_box(model.vertices).diagonal();
  // A grid's cells on a surface are about as many as its area has squares of them, and half again.
  double cell = std::max(std::sqrt(3 * area_of(model) / static_cast<double>(most_triangles)), 1e-6 * diagonal);
  Clusters clusters;
  Kept kept;
  for (;; cell *= 1.2) {
    clusters = cluster(model.vertices, cell);
    kept = keep_triangles(model.triangles, clusters.of_vertex);
    if (kept.triangles.size() <= most_triangles) break;
  }

  Model result{model.title, model.file, means(model.vertices, clusters)};
  result.edges = model.edges;
  result.triangles = kept.triangles;
  for (const auto& [a, b] : model.lines) {
    const Index u = clusters.of_vertex[a], v = clusters.of_vertex[b];
    if (u != v) result.lines.push_back({std::min(u, v), std::max(u, v)});
  }
  std::sort(result.lines.begin(), result.lines.end());
  result.lines.erase(std::unique(result.lines.begin(), result.lines.end()), result.lines.end());
  for (const Values& values : model.values) {
    const Measure* measure = find_measure(measures, values.key);
    if (!measure || measure->element == Element::tet) continue;
    result.values.push_back({values.key, measure->element == Element::vertex
                                             ? vertex_values(*measure, values.at, clusters)
                                             : triangle_values(*measure, values.at, model, clusters, kept)});
  }
  return result;
}

Model thinned(const Model& model, std::size_t most_points) {
  const std::size_t n = model.vertices.size(), m = std::min(n, most_points);
  Model result{model.title, model.file, {}};
  for (const Values& values : model.values) result.values.push_back({values.key, {}});
  for (std::size_t k = 0; k < m; ++k) {
    const std::size_t i = k * n / m;
    result.vertices.push_back(model.vertices[i]);
    for (std::size_t j = 0; j < model.values.size(); ++j) result.values[j].at.push_back(model.values[j].at[i]);
  }
  return result;
}

}  // namespace bisector::view
