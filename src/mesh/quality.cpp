#include "bisector/quality.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"

namespace bisector {

namespace {

constexpr std::size_t kAtOnce = 4096;  // items of a chunk of a sum

std::vector<std::array<Index, 2>> sorted_features(const TriangleMesh& mesh) {
  std::vector<std::array<Index, 2>> edges = mesh.feature_edges;
  for (auto& [a, b] : edges)
    if (a > b) std::swap(a, b);
  std::sort(edges.begin(), edges.end());
  return edges;
}

// Of some of the triangles: sums where the report has means, counts where it has percents.
struct TriangleSums {
  QualityReport report;
  std::size_t below_30 = 0, free_below_30 = 0;

  TriangleSums() {
    report.q_min = report.q_min_free = std::numeric_limits<double>::infinity();
    report.theta_min = report.theta_min_free = 180;
  }

  void add(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& features, const Triangle& t) {
    const TriangleShape shape = measure_triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
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
    if (!(shape.area > 0)) {
      ++report.zero_area;
      return;
    }
    report.q_ave += shape.q;
    report.theta_min_ave += *smallest;
    report.area += shape.area;
  }

  void add(const TriangleSums& other) {
    const QualityReport& o = other.report;
    report.q_min = std::min(report.q_min, o.q_min);
    report.q_min_free = std::min(report.q_min_free, o.q_min_free);
    report.theta_min = std::min(report.theta_min, o.theta_min);
    report.theta_max = std::max(report.theta_max, o.theta_max);
    report.theta_min_free = std::min(report.theta_min_free, o.theta_min_free);
    report.theta_max_free = std::max(report.theta_max_free, o.theta_max_free);
    report.zero_area += o.zero_area;
    report.q_ave += o.q_ave;
    report.theta_min_ave += o.theta_min_ave;
    report.area += o.area;
    below_30 += other.below_30;
    free_below_30 += other.free_below_30;
  }
};

// Sums over chunks of fixed size, added in their order: the same for any number of threads.
template <class Sums, class Add>
Sums sum_chunks(std::size_t n, const Add& add) {
  std::vector<Sums> sums((n + kAtOnce - 1) / kAtOnce);
  parallel_chunks(n, kAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) add(sums[c], i);
  });
  Sums all;
  for (const Sums& s : sums) all.add(s);
  return all;
}

void measure_triangles(const TriangleMesh& mesh, QualityReport& report) {
  const std::vector<std::array<Index, 2>> features = sorted_features(mesh);
  const auto sums = sum_chunks<TriangleSums>(
      mesh.triangles.size(), [&](TriangleSums& s, std::size_t t) { s.add(mesh, features, mesh.triangles[t]); });
  report = sums.report;
  const auto count = static_cast<double>(mesh.triangles.size());
  const double measured = count - static_cast<double>(report.zero_area);
  if (std::isinf(report.q_min_free)) report.q_min_free = report.q_min;
  report.theta_below_30 = 100 * static_cast<double>(sums.below_30) / count;
  report.theta_below_30_free = 100 * static_cast<double>(sums.free_below_30) / count;
  if (measured > 0) {
    report.q_ave /= measured;
    report.theta_min_ave /= measured;
  }
}

struct LengthSums {
  double least = std::numeric_limits<double>::infinity(), most = 0, sum = 0;

  void add(const LengthSums& other) {
    least = std::min(least, other.least);
    most = std::max(most, other.most);
    sum += other.sum;
  }
};

void measure_edges(const TriangleMesh& mesh, const EdgeTable& table, QualityReport& report) {
  const auto lengths = sum_chunks<LengthSums>(table.edges.size(), [&](LengthSums& sums, std::size_t e) {
    const auto [a, b] = table.edges[e];
    const double length = norm(mesh.vertices[b] - mesh.vertices[a]);
    sums.add({length, length, length});
  });
  report.edge_min = lengths.least;
  report.edge_max = lengths.most;
  report.edge_ave = lengths.sum / static_cast<double>(table.edges.size());

  const auto [neighbours, border] = count_neighbours(table, mesh.vertices.size());
  std::size_t interior = 0, regular = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (neighbours[v] == 0 || border[v]) continue;
    ++interior;
    if (neighbours[v] == 6) ++regular;
  }
  if (interior > 0) report.valence6 = static_cast<double>(regular) / static_cast<double>(interior);
}

}  // namespace

TriangleShape measure_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const std::array<Vec3, 3> p{a, b, c};
  TriangleShape shape;
  shape.area = triangle_area(a, b, c);
  if (!(shape.area > 0)) return shape;
  double half_perimeter = 0, longest = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 u = p[(k + 1) % 3] - p[k], v = p[(k + 2) % 3] - p[k];
    shape.theta[k] = std::atan2(2 * shape.area, dot(u, v)) * kDegreesPerRadian;
    half_perimeter += 0.5 * norm(u);
    longest = std::max(longest, norm(u));
  }
  shape.q = 6 / std::numbers::sqrt3 * (shape.area / half_perimeter) / longest;
  return shape;
}

double least_angle(const TriangleMesh& mesh, const Triangle& t) {
  const auto theta = measure_triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]).theta;
  return *std::min_element(theta.begin(), theta.end());
}

Valences count_neighbours(const EdgeTable& table, std::size_t vertex_count) {
  Valences valences{std::vector<Index>(vertex_count, 0), std::vector<char>(vertex_count, 0)};
  auto& [neighbours, border] = valences;
  parallel_chunks(table.edges.size(), kAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e)
      for (const Index v : table.edges[e]) {
        std::atomic_ref(neighbours[v]).fetch_add(1, std::memory_order_relaxed);
        if (table.half_edges.size(e) == 1) std::atomic_ref(border[v]).store(1, std::memory_order_relaxed);
      }
  });
  return valences;
}

QualityReport measure_quality(const TriangleMesh& mesh) {
  QualityReport report;
  if (mesh.triangles.empty()) return report;
  measure_triangles(mesh, report);
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  measure_edges(mesh, table, report);
  report.topology = analyse_topology(mesh.triangles, mesh.vertices.size(), table);
  return report;
}

}  // namespace bisector
