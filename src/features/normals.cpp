#include "features/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/sampling.h"
#include "mesh/topology.h"

namespace bisector {

namespace {

constexpr std::size_t kSamples = 400;         // points at which the roughness is measured
constexpr std::size_t kMostTriangles = 1000;  // looked at around one point, which bounds the time on fine meshes
// A linear fit has three unknowns for each coordinate of the normal: so many triangles of equal area must be there to
// tell noise from what the surface bends.
constexpr double kFewestTriangles = 6;
constexpr double kNoisy = 12;     // degrees of roughness beyond which normals may be noise
constexpr double kAsRough = 0.7;  // part of the roughness at twice the length that counts as equally rough

// What the fit needs of a triangle.
struct Patch {
  Vec3 centre, normal;  // unit normal
  double weight;
};

// Solves a symmetric positive definite 3 x 3 system for three right-hand sides; false if it is close to singular.
bool solve(std::array<std::array<double, 3>, 3> a, std::array<Vec3, 3>& x) {
  const double scale = std::max({a[0][0], a[1][1], a[2][2]});
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(a[k][k] > 1e-9 * scale)) return false;
    for (std::size_t i = k + 1; i < 3; ++i) {
      const double f = a[i][k] / a[k][k];
      for (std::size_t j = k; j < 3; ++j) a[i][j] -= f * a[k][j];
      x[i] -= f * x[k];
    }
  }
  for (std::size_t k = 3; k-- > 0;) {
    for (std::size_t j = k + 1; j < 3; ++j) x[k] -= a[k][j] * x[j];
    x[k] *= 1 / a[k][k];
  }
  return true;
}

// Root mean square angle between normals and their linear fit around a point, radians.
double deviation(const std::vector<Patch>& patches, const Vec3& origin, double length) {
  Vec3 mean;
  double sum = 0, squares = 0;
  for (const Patch& p : patches) {
    mean += p.weight * p.normal;
    sum += p.weight;
    squares += p.weight * p.weight;
  }
  const double count = squares > 0 ? sum * sum / squares : 0;
  if (count < kFewestTriangles) return 0;
  const Vec3 axis = std::abs(mean.x) < std::abs(mean.y) ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  Vec3 u = cross(mean, axis);
  if (!(norm(u) > 0)) return std::numbers::pi / 2;  // the normals cancel each other out
  u *= 1 / norm(u);
  Vec3 v = cross(mean, u);
  v *= 1 / norm(v);
  const auto row = [&](const Patch& p) {
    const Vec3 d = (1 / length) * (p.centre - origin);
    return std::array<double, 3>{1, dot(d, u), dot(d, v)};
  };
  std::array<std::array<double, 3>, 3> a{};
  std::array<Vec3, 3> x{};
  for (const Patch& p : patches) {
    const auto r = row(p);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) a[i][j] += p.weight * r[i] * r[j];
      x[i] += p.weight * r[i] * p.normal;
    }
  }
  if (!solve(a, x)) return 0;
  double rest = 0;
  for (const Patch& p : patches) {
    const auto r = row(p);
    rest += p.weight * norm2(p.normal - (r[0] * x[0] + r[1] * x[1] + r[2] * x[2]));
  }
  const double freedom = count / (count - 3);
  return 2 * std::asin(std::min(1.0, std::sqrt(rest / sum * freedom) / 2));
}

}  // namespace

double normal_roughness(const TriangleMesh& mesh, double length) {
  double area = 0;
  std::vector<double> areas(mesh.triangles.size());
  for (std::size_t t = 0; t < areas.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    area += areas[t] = triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  }
  if (!(area > 0)) return 0;
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  std::vector<std::size_t> edge_of(3 * mesh.triangles.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h) edge_of[*h] = e;
  const auto start = [&](std::size_t h) { return mesh.triangles[h / 3][h % 3]; };

  const std::vector<SurfaceSample> samples = sample_surface(mesh, kSamples, 1);
  std::vector<double> deviations(samples.size());
  parallel_each(
      samples.size(),
      [&](std::size_t s) {
        const Vec3& origin = samples[s].point;
        std::vector<std::pair<std::size_t, bool>> reached{{samples[s].triangle, false}};  // whether it is turned round
        std::vector<std::size_t> seen{samples[s].triangle};                               // ascending
        std::vector<Patch> patches;
        for (std::size_t i = 0; i < reached.size() && i < kMostTriangles; ++i) {
          const auto [t, turned] = reached[i];
          const auto [a, b, c] = mesh.triangles[t];
          const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
          const Vec3 centre = (1.0 / 3) * (p + q + r), n = twice_area_normal(p, q, r);
          const double l = norm(n);
          if (i > 0 && norm(centre - origin) > length) continue;
          if (std::isnormal(l))
            patches.push_back({centre, ((turned ? -1 : 1) / l) * n, std::min(areas[t], length * length)});
          for (std::size_t h = 3 * t; h < 3 * t + 3; ++h) {
            if (table.half_edges.size(edge_of[h]) != 2) continue;
            const std::size_t* sides = table.half_edges.begin(edge_of[h]);
            const std::size_t other = sides[0] == h ? sides[1] : sides[0];
            const auto at = std::lower_bound(seen.begin(), seen.end(), other / 3);
            if (at != seen.end() && *at == other / 3) continue;
            seen.insert(at, other / 3);
            reached.emplace_back(other / 3, turned != (start(h) == start(other)));
          }
        }
        deviations[s] = deviation(patches, origin, length);
      },
      16);
  const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
  std::nth_element(deviations.begin(), middle, deviations.end());
  return *middle / kRadiansPerDegree;
}

bool has_noisy_normals(const TriangleMesh& mesh, std::size_t vertices) {
  const double area = fixed_sum(mesh.triangles.size(), [&](std::size_t t) {
    const auto [a, b, c] = mesh.triangles[t];
    return triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
  });
  if (!(area > 0) || vertices == 0) return false;
  const double length = std::sqrt(2 * area / (std::sqrt(3.0) * static_cast<double>(vertices)));
  const double rough = normal_roughness(mesh, length);
  if (rough <= kNoisy) return false;
  const double finer = normal_roughness(mesh, length / 2);
  return finer > 0 ? finer > kAsRough * rough : rough > kAsRough * normal_roughness(mesh, 2 * length);
}

}  // namespace bisector
