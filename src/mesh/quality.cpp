#include "bisector/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "mesh/topology.h"

namespace bisector {

namespace {

struct TriangleShape {
  double q = 0;
  std::array<double, 3> theta{0, 0, 180};  // at each corner, degrees; these are those of triangles without area
};

TriangleShape measure_shape(const std::array<Vec3, 3>& p, double area) {
  TriangleShape shape;
  if (!(area > 0)) return shape;
  double half_perimeter = 0, longest = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 u = p[(k + 1) % 3] - p[k], v = p[(k + 2) % 3] - p[k];
    shape.theta[k] = std::atan2(2 * area, dot(u, v)) * kDegreesPerRadian;
    half_perimeter += 0.5 * norm(u);
    longest = std::max(longest, norm(u));
  }
  shape.q = 6 / std::numbers::sqrt3 * (area / half_perimeter) / longest;
  return shape;
}

std::vector<std::array<Index, 2>> sorted_features(const TriangleMesh& mesh) {
  std::vector<std::array<Index, 2>> edges = mesh.feature_edges;
  for (auto& [a, b] : edges)
    if (a > b) std::swap(a, b);
  std::sort(edges.begin(), edges.end());
  return edges;
}

void measure_triangles(const TriangleMesh& mesh, QualityReport& report) {
  report.q_min = report.q_min_free = std::numeric_limits<double>::infinity();
  report.theta_min = report.theta_min_free = 180;
  const std::vector<std::array<Index, 2>> features = sorted_features(mesh);
  std::size_t below_30 = 0, free_below_30 = 0;
  for (const Triangle& t : mesh.triangles) {
    const std::array<Vec3, 3> p{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    const double area = triangle_area(p[0], p[1], p[2]);
    const TriangleShape shape = measure_shape(p, area);
    const auto [smallest, largest] = std::minmax_element(shape.theta.begin(), shape.theta.end());
    report.q_min = std::min(report.q_min, shape.q);
    report.theta_min = std::min(report.theta_min, *smallest);
    report.theta_max = std::max(report.theta_max, *largest);
    if (*smallest < 30) ++below_30;
    const std::array<bool, 3> marked = edges_among(t, features);
    if (marked[0] + marked[1] + marked[2] < 2) report.q_min_free = std::min(report.q_min_free, shape.q);
    bool free_angle_below_30 = false;
    for (int k = 0; k < 3; ++k) {
      if (marked[k] && marked[(k + 2) % 3]) continue;
      free_angle_below_30 |= shape.theta[k] < 30;
      report.theta_min_free = std::min(report.theta_min_free, shape.theta[k]);
      report.theta_max_free = std::max(report.theta_max_free, shape.theta[k]);
    }
    free_below_30 += free_angle_below_30;
    if (!(area > 0)) {
      ++report.zero_area;
      continue;
    }
    report.q_ave += shape.q;
    report.theta_min_ave += *smallest;
    report.area += area;
  }
  const auto count = static_cast<double>(mesh.triangles.size());
  const double measured = count - static_cast<double>(report.zero_area);
  if (std::isinf(report.q_min_free)) report.q_min_free = report.q_min;
  report.theta_below_30 = 100 * static_cast<double>(below_30) / count;
  report.theta_below_30_free = 100 * static_cast<double>(free_below_30) / count;
  if (measured > 0) {
    report.q_ave /= measured;
    report.theta_min_ave /= measured;
  }
}

void measure_edges(const TriangleMesh& mesh, QualityReport& report) {
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  std::vector<Index> neighbours(mesh.vertices.size(), 0);
  std::vector<char> border(mesh.vertices.size(), 0);
  report.edge_min = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const auto [a, b] = table.edges[e];
    const double length = norm(mesh.vertices[b] - mesh.vertices[a]);
    report.edge_min = std::min(report.edge_min, length);
    report.edge_max = std::max(report.edge_max, length);
    report.edge_ave += length;
    for (const Index v : {a, b}) {
      ++neighbours[v];
      if (table.half_edges.size(e) == 1) border[v] = 1;
    }
  }
  report.edge_ave /= static_cast<double>(table.edges.size());

  std::size_t interior = 0, regular = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (neighbours[v] == 0 || border[v]) continue;
    ++interior;
    if (neighbours[v] == 6) ++regular;
  }
  if (interior > 0) report.valence6 = static_cast<double>(regular) / static_cast<double>(interior);
}

}  // namespace

QualityReport measure_quality(const TriangleMesh& mesh) {
  QualityReport report;
  if (mesh.triangles.empty()) return report;
  measure_triangles(mesh, report);
  measure_edges(mesh, report);
  report.topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  return report;
}

}  // namespace bisector
