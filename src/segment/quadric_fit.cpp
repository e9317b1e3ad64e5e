#include "segment/quadric_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bisector {
namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

// Exponents of the monomials of a quadric in the order of Eq. 2.2.
constexpr int kQuadric[10][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0},
                                 {1, 1, 0}, {1, 0, 1}, {0, 2, 0}, {0, 1, 1}, {0, 0, 2}};

struct Indices {
  std::size_t of[5][5][5]{};
  constexpr Indices() {
    std::size_t n = 0;
    for (int degree = 0; degree <= 4; ++degree)
      for (int i = degree; i >= 0; --i)
        for (int j = degree - i; j >= 0; --j) of[i][j][degree - i - j] = n++;
  }
};
constexpr Indices kIndices;

// Products of the monomials of Eq. 2.2, and the terms (factor, monomial) of the products of their gradients.
struct Products {
  std::size_t product[10][10]{};
  double factor[10][10][3]{};
  std::size_t slope[10][10][3]{};
  constexpr Products() {
    for (int a = 0; a < 10; ++a)
      for (int b = 0; b < 10; ++b) {
        int e[3]{};
        for (int k = 0; k < 3; ++k) e[k] = kQuadric[a][k] + kQuadric[b][k];
        product[a][b] = kIndices.of[e[0]][e[1]][e[2]];
        for (int k = 0; k < 3; ++k) {
          factor[a][b][k] = kQuadric[a][k] * kQuadric[b][k];
          if (kQuadric[a][k] == 0 || kQuadric[b][k] == 0) continue;
          int d[3]{e[0], e[1], e[2]};
          d[k] -= 2;
          slope[a][b][k] = kIndices.of[d[0]][d[1]][d[2]];
        }
      }
  }
};
constexpr Products kProducts;

// How each monomial comes from one of a degree less.
struct Steps {
  std::size_t from[SurfaceMoments::kCount]{};
  int axis[SurfaceMoments::kCount]{};
  constexpr Steps() {
    for (int i = 0; i <= 4; ++i)
      for (int j = 0; i + j <= 4; ++j)
        for (int k = 0; i + j + k <= 4; ++k) {
          if (i + j + k == 0) continue;
          const std::size_t n = kIndices.of[i][j][k];
          axis[n] = i > 0 ? 0 : j > 0 ? 1 : 2;
          from[n] = i > 0 ? kIndices.of[i - 1][j][k] : j > 0 ? kIndices.of[i][j - 1][k] : kIndices.of[i][j][k - 1];
        }
  }
};
constexpr Steps kSteps;

// A rule of six points that integrates polynomials of degree four exactly (Dunavant 1985); its numbers in closed form.
struct Cubature {
  static constexpr std::size_t kPoints = 6;
  double near[2], weight[2];
  Cubature() {
    const double r = std::sqrt(38 - 44 * std::sqrt(0.4)), s = std::sqrt(213125 - 53320 * std::sqrt(10.0));
    for (int k = 0; k < 2; ++k) {
      near[k] = (8 - std::sqrt(10.0) + (k == 0 ? r : -r)) / 18;
      weight[k] = (620 + (k == 0 ? s : -s)) / 3720;
    }
  }
};
const Cubature kCubature;

// Moments per area about the centroid, in units of the root mean square radius.
struct Local {
  std::array<double, SurfaceMoments::kCount> m{};
  std::array<Vec3, 4> flux{};
  Vec3 origin;
  double scale = 0;  // 0: no extent

  explicit Local(const SurfaceMoments& moments) {
    if (!(moments.area() > 0)) return;
    const SurfaceMoments c = moved(moments, moments.centroid());
    origin = c.origin;
    const auto& of = kIndices.of;
    scale = std::sqrt(std::max(0.0, (c.m[of[2][0][0]] + c.m[of[0][2][0]] + c.m[of[0][0][2]]) / c.area()));
    if (!(scale > 0)) return;
    double power = 1 / c.area();
    std::size_t n = 0;
    for (int degree = 0; degree <= 4; ++degree, power /= scale)
      for (int k = 0; k < (degree + 1) * (degree + 2) / 2; ++k, ++n) m[n] = power * c.m[n];
    flux[0] = (1 / c.area()) * c.flux[0];
    for (std::size_t k = 1; k < 4; ++k) flux[k] = (1 / (c.area() * scale)) * c.flux[k];
  }
};

// The thesis' matrices without the constant term, which is best chosen for the others: Schur complements.
struct Pencil {
  Matrix9 m, n;
  Vector9 constant, flux;  // the best constant is -constant . C; mean of n . grad f is flux . C

  explicit Pencil(const Local& local) {
    for (int a = 0; a < 9; ++a) {
      constant(a) = local.m[kProducts.product[0][a + 1]];
      double f = 0;
      for (int k = 0; k < 3; ++k) {
        const int power = kQuadric[a + 1][k];
        if (power == 0) continue;
        // The other factor of the monomial's derivative: none, or one coordinate.
        int other = -1;
        for (int j = 0; j < 3; ++j)
          if (kQuadric[a + 1][j] - (j == k ? 1 : 0) == 1) other = j;
        f += power * (other < 0 ? local.flux[0][k] : local.flux[static_cast<std::size_t>(other) + 1][k]);
      }
      flux(a) = f;
    }
    for (int a = 0; a < 9; ++a)
      for (int b = 0; b < 9; ++b) {
        m(a, b) = local.m[kProducts.product[a + 1][b + 1]] - constant(a) * constant(b);
        double sum = 0;
        for (int k = 0; k < 3; ++k)
          if (kProducts.factor[a + 1][b + 1][k] != 0)
            sum += kProducts.factor[a + 1][b + 1][k] * local.m[kProducts.slope[a + 1][b + 1][k]];
        n(a, b) = sum;
      }
  }
};

QuadricFit make_fit(const SurfaceMoments& moments, const Local& local, const Pencil& pencil, const Vector9& direction) {
  QuadricFit fit;
  const double slope = direction.dot(pencil.n * direction);
  if (!(slope > 0) || !std::isfinite(slope)) return fit;
  const Vector9 c = direction / std::sqrt(slope);
  Quadric quadric;
  quadric.c[0] = -pencil.constant.dot(c);
  for (int a = 0; a < 9; ++a) quadric.c[static_cast<std::size_t>(a) + 1] = c(a);
  fit.quadric = from_local(quadric, local.origin, local.scale);
  // f grows by one per local unit of length.
  for (double& x : fit.quadric.c) x *= local.scale;
  fit.squared_distance = std::max(0.0, c.dot(pencil.m * c)) * local.scale * local.scale * moments.area();
  fit.alignment = pencil.flux.dot(c);
  fit.valid = true;
  return fit;
}

}  // namespace

std::size_t monomial_index(int i, int j, int k) { return kIndices.of[i][j][k]; }

Vec3 SurfaceMoments::centroid() const {
  const auto& of = kIndices.of;
  if (!(m[0] > 0)) return origin;
  return origin + (1 / m[0]) * Vec3{m[of[1][0][0]], m[of[0][1][0]], m[of[0][0][1]]};
}

SurfaceMoments triangle_moments(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& origin) {
  SurfaceMoments moments;
  moments.origin = origin;
  const Vec3 corners[3]{a - origin, b - origin, c - origin};
  const Vec3 normal = 0.5 * cross(b - a, c - a);
  const double area = norm(normal);
  if (!(area > 0)) return moments;
  const Vec3 sum = corners[0] + corners[1] + corners[2];
  // All six points at a time, monomial by monomial.
  double coordinate[3][Cubature::kPoints], monomial[SurfaceMoments::kCount][Cubature::kPoints];
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3 p = kCubature.near[k] * sum + (1 - 3 * kCubature.near[k]) * corners[corner];
      for (int axis = 0; axis < 3; ++axis) coordinate[axis][3 * k + corner] = p[axis];
      monomial[0][3 * k + corner] = area * kCubature.weight[k];
    }
  moments.m[0] = area;
#pragma GCC unroll 35
  for (std::size_t n = 1; n < SurfaceMoments::kCount; ++n) {
    double total = 0;
    for (std::size_t p = 0; p < Cubature::kPoints; ++p) {
      monomial[n][p] = monomial[kSteps.from[n]][p] * coordinate[kSteps.axis[n]][p];
      total += monomial[n][p];
    }
    moments.m[n] = total;
  }
  moments.flux[0] = normal;
  for (int k = 0; k < 3; ++k) moments.flux[static_cast<std::size_t>(k) + 1] = (sum[k] / 3) * normal;
  return moments;
}

SurfaceMoments moved(const SurfaceMoments& moments, const Vec3& origin) {
  SurfaceMoments result = moments;
  result.origin = origin;
  const Vec3 d = origin - moments.origin;
  for (int k = 0; k < 3; ++k) result.flux[static_cast<std::size_t>(k) + 1] -= d[k] * moments.flux[0];
  // Along one axis after the other, (x - d)^i from the powers of x by Pascal's triangle.
  for (int axis = 0; axis < 3; ++axis)
    for (int a = 0; a <= 3; ++a)
      for (int b = 0; a + b <= 3; ++b) {
        const int n = 4 - a - b;
        double* power[5];
        for (int i = 0; i <= n; ++i)
          power[i] = &result.m[axis == 0   ? kIndices.of[i][a][b]
                               : axis == 1 ? kIndices.of[a][i][b]
                                           : kIndices.of[a][b][i]];
        for (int pass = 0; pass < n; ++pass)
          for (int i = n; i > pass; --i) *power[i] -= d[axis] * *power[i - 1];
      }
  return result;
}

SurfaceMoments merged(const SurfaceMoments& a, const SurfaceMoments& b) {
  const double area = a.area() + b.area();
  if (!(area > 0)) return a;
  const Vec3 ca = a.centroid(), cb = b.centroid();
  const Vec3 centroid = ca + (b.area() / area) * (cb - ca);
  SurfaceMoments sum = moved(a, centroid);
  const SurfaceMoments other = moved(b, centroid);
  for (std::size_t k = 0; k < sum.m.size(); ++k) sum.m[k] += other.m[k];
  for (std::size_t k = 0; k < sum.flux.size(); ++k) sum.flux[k] += other.flux[k];
  return sum;
}

PlaneFit fit_plane(const SurfaceMoments& moments) {
  PlaneFit fit;
  const Local local(moments);
  if (!(local.scale > 0)) {
    fit.offset = dot(fit.normal, moments.centroid());
    return fit;
  }
  const auto& of = kIndices.of;
  Eigen::Matrix3d covariance;
  covariance << local.m[of[2][0][0]], local.m[of[1][1][0]], local.m[of[1][0][1]],  //
      local.m[of[1][1][0]], local.m[of[0][2][0]], local.m[of[0][1][1]],            //
      local.m[of[1][0][1]], local.m[of[0][1][1]], local.m[of[0][0][2]];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  fit.normal = {n(0), n(1), n(2)};
  if (dot(fit.normal, moments.flux[0]) < 0) fit.normal = -fit.normal;
  fit.offset = dot(fit.normal, local.origin);
  fit.squared_distance = std::max(0.0, solver.eigenvalues()(0)) * local.scale * local.scale * moments.area();
  return fit;
}

QuadricFit fit_quadric(const SurfaceMoments& moments) {
  const Local local(moments);
  if (!(local.scale > 0)) return {};
  const Pencil pencil(local);
  const Eigen::SelfAdjointEigenSolver<Matrix9> slopes(pencil.n);
  if (slopes.info() != Eigen::Success) return {};
  // N's eigenvalues are about 1 but for directions in which polynomials are flat on the piece.
  const double least = 1e-10 * slopes.eigenvalues()(8);
  int first = 0;
  while (first < 9 && slopes.eigenvalues()(first) <= least) ++first;
  const int rank = 9 - first;
  if (rank == 0) return {};
  const Eigen::MatrixXd whitened =
      slopes.eigenvectors().rightCols(rank) * slopes.eigenvalues().tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(whitened.transpose() * pencil.m * whitened);
  if (solver.info() != Eigen::Success) return {};
  return make_fit(moments, local, pencil, whitened * solver.eigenvectors().col(0));
}

QuadricFit fit_oriented_quadric(const SurfaceMoments& moments) {
  const Local local(moments);
  if (!(local.scale > 0)) return {};
  const Pencil pencil(local);
  // Directions on which f all but vanishes are told apart by the flux alone; the shift keeps the solution finite there.
  const Matrix9 shifted = pencil.m + 1e-12 * pencil.m.trace() * Matrix9::Identity();
  const Vector9 direction = shifted.ldlt().solve(pencil.flux);
  if (!direction.allFinite()) return {};
  return make_fit(moments, local, pencil, direction);
}

}  // namespace bisector
