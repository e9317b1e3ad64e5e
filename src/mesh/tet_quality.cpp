#include "mesh/tet_quality.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/orientation.h"
#include "core/parallel.h"

namespace bisector {

namespace {

// Both ends of each edge of a tetrahedron, and the two other corners.
constexpr int kEdges[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};

void measure_edges(const TetMesh& mesh, TetQualityReport& report) {
  std::vector<std::array<Index, 2>> edges;
  edges.reserve(6 * mesh.tets.size());
  for (const Tetrahedron& t : mesh.tets)
    for (const auto& e : kEdges) edges.push_back({std::min(t[e[0]], t[e[1]]), std::max(t[e[0]], t[e[1]])});
  sort_in_parallel(edges, [](const auto& a, const auto& b) { return a < b; });
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  report.edge_min = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : edges) {
    const double length = norm(mesh.vertices[b] - mesh.vertices[a]);
    report.edge_min = std::min(report.edge_min, length);
    report.edge_max = std::max(report.edge_max, length);
    report.edge_ave += length;
  }
  report.edge_ave /= static_cast<double>(edges.size());
}

}  // namespace

std::array<double, 6> dihedral_angles(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const std::array<Vec3, 4> p{a, b, c, d};
  const double volume = std::abs(rounded_six_volume(a, b, c, d));
  std::array<double, 6> angles{};
  for (std::size_t e = 0; e < 6; ++e) {
    const Vec3 u = p[kEdges[e][1]] - p[kEdges[e][0]];
    // The normals of both sides: their cross product is the edge times the volume.
    const Vec3 m = cross(u, p[kEdges[e][2]] - p[kEdges[e][0]]), n = cross(u, p[kEdges[e][3]] - p[kEdges[e][0]]);
    angles[e] = std::atan2(norm(u) * volume, dot(m, n)) * kDegreesPerRadian;
  }
  return angles;
}

double radius_ratio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = c - a, w = d - a;
  const Vec3 uv = cross(u, v), vw = cross(v, w), wu = cross(w, u);
  const double volume = dot(u, vw);                                                   // six times
  const double surface = norm(uv) + norm(vw) + norm(wu) + norm(cross(v - u, w - u));  // twice
  const double centre = norm(norm2(u) * vw + norm2(v) * wu + norm2(w) * uv);  // twelve volumes times the circumradius
  // r = volume / surface, R = centre / (2 volume)
  return centre > 0 ? 6 * (volume / surface) * (std::abs(volume) / centre) : 0;
}

TetShape measure_tet(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  TetShape shape;
  shape.sign = orientation(a, b, c, d);
  shape.volume = rounded_six_volume(a, b, c, d) / 6;
  if (shape.sign <= 0) return shape;
  shape.dihedral = dihedral_angles(a, b, c, d);
  const auto [smallest, largest] = std::minmax_element(shape.dihedral.begin(), shape.dihedral.end());
  shape.smallest = *smallest;
  shape.largest = *largest;
  shape.radius_ratio = radius_ratio(a, b, c, d);
  return shape;
}

TetQualityReport measure_tet_quality(const TetMesh& mesh) {
  TetQualityReport report;
  const std::size_t n = mesh.tets.size();
  if (n == 0) return report;
  std::vector<TetShape> shapes(n);
  parallel_each(n, [&](std::size_t i) {
    const Tetrahedron& t = mesh.tets[i];
    shapes[i] = measure_tet(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]);
  });
  report.dihedral_min = 180;
  report.radius_ratio_min = report.volume_min = std::numeric_limits<double>::infinity();
  for (const TetShape& shape : shapes) {
    report.dihedral_min = std::min(report.dihedral_min, shape.smallest);
    report.dihedral_max = std::max(report.dihedral_max, shape.largest);
    report.radius_ratio_min = std::min(report.radius_ratio_min, shape.radius_ratio);
    report.volume_min = std::min(report.volume_min, shape.volume);
    if (shape.sign < 0) ++report.inverted;
    if (shape.sign == 0) ++report.zero_volume;
    if (shape.sign > 0)
      for (const double angle : shape.dihedral)
        ++report.dihedral_counts[std::min<std::size_t>(17, static_cast<std::size_t>(angle / 10))];
  }
  report.volume = fixed_sum(n, [&](std::size_t i) { return shapes[i].volume; });
  const double measured = static_cast<double>(n - report.inverted - report.zero_volume);
  if (measured > 0) {
    report.dihedral_min_mean = fixed_sum(n, [&](std::size_t i) { return shapes[i].smallest; }) / measured;
    report.radius_ratio_mean = fixed_sum(n, [&](std::size_t i) { return shapes[i].radius_ratio; }) / measured;
  }
  measure_edges(mesh, report);
  return report;
}

}  // namespace bisector
