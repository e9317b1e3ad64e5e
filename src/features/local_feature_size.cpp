#include "features/local_feature_size.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/random.h"
#include "spatial/hilbert.h"

namespace bisector {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<Index, Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>>;

constexpr double kSeparation = 0.5;  // cosine of the smallest angle between the normals where a pole's sphere touches
constexpr double kTangent = 0.5;     // cosine of the largest angle between normal and radius where a sphere touches
constexpr double kFar = 4;           // diagonals of the box; beyond it a Voronoi vertex counts as infinitely far
constexpr double kFlat = 1e-10;      // area by squared longest edge below which a triangle has no normal
// Steps of the sequence in the plane: powers of the reciprocal of the plastic number, which solves x^3 = x + 1.
constexpr double kStepX = 0.7548776662466927, kStepY = 0.5698402909980532;

struct Samples {
  std::vector<Vec3> points, normals;
  double spacing = 0;
};

// Equal steps of the sum of areas and triangles along a spatial order, and within each triangle the points of a plane
// sequence of low discrepancy (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
Samples sample(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles, std::size_t count) {
  std::vector<double> area(triangles.size());
  std::vector<Vec3> centres(triangles.size());
  parallel_each(triangles.size(), [&](std::size_t t) {
    const Vec3 &a = vertices[triangles[t][0]], &b = vertices[triangles[t][1]], &c = vertices[triangles[t][2]];
    area[t] = triangle_area(a, b, c);
    if (!(area[t] > kFlat * std::max({norm2(b - a), norm2(c - b), norm2(a - c)}))) area[t] = 0;
    centres[t] = a + b + c;
  });
  double total = 0, valid = 0;
  for (const double a : area)
    if (a > 0) {
      total += a;
      ++valid;
    }

  Samples samples;
  // The edge length of equilateral triangles whose vertices are the half of the points that is spread by area.
  samples.spacing = std::sqrt(4 / std::sqrt(3.0) * total / static_cast<double>(count));
  double share = 0;
  std::size_t next = 0;
  for (const Index t : hilbert_order(centres)) {
    if (!(area[t] > 0)) continue;
    share += 0.5 * (area[t] / total + 1 / valid);
    const auto end = static_cast<std::size_t>(share * static_cast<double>(count) + 0.5);
    if (end <= next) continue;
    const Vec3 a = vertices[triangles[t][0]], u = vertices[triangles[t][1]] - a, v = vertices[triangles[t][2]] - a;
    const Vec3 n = cross(u, v);
    const Vec3 normal = (1 / norm(n)) * n;
    Random random(1, t);
    double x = random.uniform(), y = random.uniform();
    for (; next < end; ++next) {
      const bool fold = x + y > 1;
      samples.points.push_back(a + (fold ? 1 - x : x) * u + (fold ? 1 - y : y) * v);
      samples.normals.push_back(normal);
      x += kStepX;
      y += kStepY;
      x -= std::floor(x);
      y -= std::floor(y);
    }
  }
  return samples;
}

// The Voronoi vertices whose spheres touch where the surface's normals differ.
std::vector<Vec3> find_poles(const Samples& samples, double far) {
  std::vector<std::pair<Kernel::Point_3, Index>> points;
  points.reserve(samples.points.size());
  for (const Vec3& p : samples.points)
    points.emplace_back(Kernel::Point_3(p.x, p.y, p.z), static_cast<Index>(points.size()));
  const Delaunay dt(points.begin(), points.end());
  std::vector<Vec3> found;
  if (dt.dimension() < 3) return found;
  for (const auto cell : dt.finite_cell_handles()) {
    std::array<Vec3, 4> p, normals;
    for (int k = 0; k < 4; ++k) {
      p[k] = samples.points[cell->vertex(k)->info()];
      normals[k] = samples.normals[cell->vertex(k)->info()];
    }
    const Vec3 u = p[1] - p[0], v = p[2] - p[0], w = p[3] - p[0];
    const Vec3 vw = cross(v, w);
    const Vec3 offset = (0.5 / dot(u, vw)) * (norm2(u) * vw + norm2(v) * cross(w, u) + norm2(w) * cross(u, v));
    const double radius = norm(offset);
    if (!(radius < far)) continue;
    const Vec3 centre = p[0] + offset;
    bool separated = false;
    int touching = 0;
    for (int k = 0; k < 4; ++k) {
      const double height = dot(normals[k], p[k] - centre);
      if (std::abs(height) < kTangent * radius) continue;
      normals[touching] = height < 0 ? -normals[k] : normals[k];
      for (int m = 0; m < touching; ++m) separated |= dot(normals[touching], normals[m]) < kSeparation;
      ++touching;
    }
    if (separated) found.push_back(centre);
  }
  return found;
}

}  // namespace

LocalFeatureSize::LocalFeatureSize(const TriangleMesh& mesh, std::size_t count) {
  diagonal_ = bounding_box(mesh).diagonal();
  if (!(diagonal_ > 0)) return;
  // Spheres through four points have terms of the fifth power of a length; powers of two are exact.
  int exponent = 0;
  std::frexp(diagonal_, &exponent);
  const double scale = std::ldexp(1.0, -exponent);
  std::vector<Vec3> vertices(mesh.vertices.size());
  parallel_each(vertices.size(), [&](std::size_t v) { vertices[v] = scale * mesh.vertices[v]; });
  const Samples samples = sample(vertices, mesh.triangles, count);
  spacing_ = samples.spacing / scale;
  const std::vector<Vec3> found = find_poles(samples, kFar * scale * diagonal_);
  if (found.empty()) return;
  for (const Index k : hilbert_order(found)) {
    const Vec3 pole = (1 / scale) * found[k];
    if (poles_.empty() || !(poles_.back() == pole)) poles_.push_back(pole);
  }
  tree_.build(poles_);
}

double LocalFeatureSize::operator()(const Vec3& p) const {
  return poles_.empty() ? diagonal_ : std::min(diagonal_, norm(p - poles_[tree_.nearest(p)]));
}

std::vector<double> local_feature_size(const TriangleMesh& mesh, std::size_t samples) {
  const LocalFeatureSize size(mesh, samples);
  std::vector<double> values(mesh.vertices.size());
  parallel_each(values.size(), [&](std::size_t v) { values[v] = size(mesh.vertices[v]); });
  return values;
}

}  // namespace bisector
