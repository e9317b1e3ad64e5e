#include "segment/proxy.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "segment/primitive_fit.h"

namespace bisector {
namespace {

// What is no surface of its own. Lengths are in root mean square radii of the piece.
constexpr double kSharp = 0.12;    // semi-axes of a hyperbola that is taken for two crossing planes, at most
constexpr double kCrossing = 1.5;  // distance from the piece's middle up to which planes cross within it
constexpr double kFlat = 0.05;     // ratio of curvatures (or slopes) below which the lesser is taken for 0
constexpr double kOneSided =
    1.13;  // data farther than so many standard deviations on one side of a centre are on one side
constexpr double kAligned = 0.5;  // QuadricFit::alignment of a surface, at least
// Mean squared distance, in the unit-sized model, of what is flat to a part in 1e7 of it: a plane.
constexpr double kExactPlane = 1e-14;

}  // namespace

Proxy Proxy::of(const Primitive& primitive) {
  if (const std::optional<Quadric> quadric = quadric_of(primitive)) return of(*quadric);
  return {std::get<Torus>(primitive), {}, 0};
}

SurfaceMoments sum_of_moments(const SegmentDomain& domain, std::span<const Index> triangles) {
  SurfaceMoments sum;
  Vec3 first;
  double area = 0;
  for (const Index t : triangles) {
    first += domain.areas[t] * domain.barycentres[t];
    area += domain.areas[t];
  }
  if (!(area > 0)) return sum;
  sum.origin = (1 / area) * first;
  for (const Index t : triangles) {
    const SurfaceMoments one = domain.moments(t, sum.origin);
    for (std::size_t k = 0; k < sum.m.size(); ++k) sum.m[k] += one.m[k];
    for (std::size_t k = 0; k < sum.flux.size(); ++k) sum.flux[k] += one.flux[k];
  }
  return sum;
}

SurfaceSamples sample_triangles(const SegmentDomain& domain, const std::vector<Index>& triangles, std::size_t limit) {
  SurfaceSamples samples;
  const std::size_t n = triangles.size(), count = std::min(n, limit);
  samples.points.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Index t = triangles[k * n / count];
    if (!(domain.areas[t] > 0)) continue;
    // Corners lie on the surface that was tessellated, barycentres below it.
    samples.points.push_back(domain.vertices[domain.triangles[t][k % 3]]);
    samples.normals.push_back(domain.normals[t]);
    samples.weights.push_back(domain.areas[t]);
  }
  return samples;
}

bool is_invalid(const Quadric& quadric, const SurfaceMoments& moments) {
  if (!(moments.area() > 0)) return false;
  const SurfaceMoments centred = moved(moments, moments.centroid());
  const auto second = [&](int i, int j, int k) { return centred.m[monomial_index(i, j, k)] / centred.area(); };
  Eigen::Matrix3d covariance;
  covariance << second(2, 0, 0), second(1, 1, 0), second(1, 0, 1),  //
      second(1, 1, 0), second(0, 2, 0), second(0, 1, 1),            //
      second(1, 0, 1), second(0, 1, 1), second(0, 0, 2);
  const double radius = std::sqrt(covariance.trace());
  if (!(radius > 0)) return false;
  covariance /= radius * radius;
  const Quadric local = to_local(quadric, centred.origin, radius);
  const auto& c = local.c;
  Eigen::Matrix3d a;
  a << c[4], c[5] / 2, c[6] / 2, c[5] / 2, c[7], c[8] / 2, c[6] / 2, c[8] / 2, c[9];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
  const Eigen::Vector3d lambda = solver.eigenvalues();
  const Eigen::Vector3d b = solver.eigenvectors().transpose() * Eigen::Vector3d(c[1], c[2], c[3]);
  const double largest = lambda.cwiseAbs().maxCoeff();
  if (largest <= 1e-9 * b.norm()) return false;

  // About the centre along the axes that have one: f = constant + sum of lambda u^2 (+ linear terms along the others).
  double constant = c[0];
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  bool centred_axis[3];
  for (int k = 0; k < 3; ++k) {
    centred_axis[k] = std::abs(lambda(k)) > kFlat * kFlat * largest;
    if (!centred_axis[k]) continue;
    centre(k) = -b(k) / (2 * lambda(k));
    constant -= lambda(k) * centre(k) * centre(k);
  }
  const auto both_sides = [&](int k) {
    const Eigen::Vector3d axis = solver.eigenvectors().col(k);
    return std::abs(centre(k)) < kOneSided * std::sqrt(std::max(0.0, axis.dot(covariance * axis)));
  };
  const auto gap = [&](int k) { return std::sqrt(std::abs(constant / lambda(k))); };

  // Along an axis without a centre a linear term makes one sheet, like a paraboloid's.
  const auto curved_along_rest = [&](double scale) {
    for (int k = 0; k < 3; ++k)
      if (!centred_axis[k] && std::abs(b(k)) > std::max(0.5 * std::abs(constant), kFlat * scale)) return true;
    return false;
  };

  // Ascending eigenvalues: the first or the last is alone in its sign where the surface has two sheets or is a cone.
  for (const int k : {0, 2}) {
    if (!centred_axis[k]) continue;
    bool alone = true;
    for (int j = 0; j < 3; ++j)
      if (j != k && centred_axis[j] && lambda(j) * lambda(k) > 0) alone = false;
    if (!alone || constant * lambda(k) > 0 || curved_along_rest(std::abs(lambda(k)))) continue;
    if (gap(k) < 1 && both_sides(k)) return true;
  }
  // Two planes that cross within the piece.
  if (lambda(0) < 0 && lambda(2) > 0) {
    const double smaller = std::min(-lambda(0), lambda(2));
    const bool straight = std::abs(lambda(1)) < kFlat * smaller && !curved_along_rest(smaller);
    if (straight && gap(0) < kSharp && gap(2) < kSharp && std::abs(centre(0)) < kCrossing &&
        std::abs(centre(2)) < kCrossing)
      return true;
  }
  return false;
}

ProxyFit fit_proxy(const SurfaceMoments& moments, SegmentSurfaces surfaces) {
  const PlaneFit plane = fit_plane(moments);
  ProxyFit best{Proxy::of(plane_quadric(plane.normal, plane.offset)), plane.squared_distance, true, false};
  if (surfaces == SegmentSurfaces::planes || plane.squared_distance <= kExactPlane * moments.area()) return best;
  QuadricFit fit = fit_quadric(moments);
  bool invalid = fit.valid && (std::abs(fit.alignment) < kAligned || is_invalid(fit.quadric, moments));
  if (invalid) {
    fit = fit_oriented_quadric(moments);
    if (fit.valid && (std::abs(fit.alignment) < kAligned || is_invalid(fit.quadric, moments))) fit.valid = false;
  }
  if (fit.valid && fit.squared_distance < best.squared_distance)
    best = {Proxy::of(fit.quadric), fit.squared_distance, false, invalid};
  best.invalid = invalid;
  return best;
}

}  // namespace bisector
