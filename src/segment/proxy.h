// What a region is approximated by while the segmentation runs: a plane, a quadric or a torus.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "bisector/segment.h"
#include "core/geometry.h"
#include "segment/quadric.h"
#include "segment/segment_domain.h"

namespace bisector {

inline constexpr double kTiny = 1e-290;  // keeps 0 / 0 away

struct Proxy {
  std::optional<Torus> torus;
  Quadric quadric;          // where there is no torus
  double second_order = 0;  // second_order_of the quadric

  static Proxy of(const Quadric& quadric) { return {std::nullopt, quadric, second_order_of(quadric)}; }
  static Proxy of(const Primitive& primitive);

  // Normal to the level set at p, of any length; 0 on the axis of a torus.
  Vec3 gradient(const Vec3& p) const {
    if (!torus) return gradient_of(quadric, p);
    const Vec3 v = p - torus->centre, radial = v - dot(v, torus->axis) * torus->axis;
    const double r = norm(radial);
    return r > 0 ? v - (torus->radius / r) * radial : Vec3{};
  }
};

// Exact, negative inside.
inline double signed_distance(const Torus& torus, const Vec3& p) {
  const Vec3 v = p - torus.centre;
  const double z = dot(v, torus.axis), r = std::sqrt(std::max(0.0, norm2(v) - z * z)) - torus.radius;
  return std::sqrt(r * r + z * z) - torus.minor_radius;
}

// The thesis' d(t, P), Eq. 2.3: from squared approximate distances (2.2.2) of the corners and the barycentre, times the
// area; distances to a torus are exact.
inline double distance_to(const SegmentDomain& domain, Index triangle, const Proxy& proxy) {
  const TriangleSamples& s = domain.samples[triangle];
  double squares[4];
  if (proxy.torus) {
    for (std::size_t k = 0; k < 4; ++k) {
      const double d = signed_distance(*proxy.torus, {s.x[k], s.y[k], s.z[k]});
      squares[k] = d * d;
    }
  } else {
    // approximate_distance four times over, in a shape that compilers make vectors of.
    double value[4], slope[4];
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3 p{s.x[k], s.y[k], s.z[k]};
      value[k] = std::abs(value_of(proxy.quadric, p));
      slope[k] = norm2(gradient_of(proxy.quadric, p));
    }
    const double a = 4 * proxy.second_order;
    for (std::size_t k = 0; k < 4; ++k) {
      const double denominator = std::sqrt(slope[k]) + std::sqrt(slope[k] + a * value[k]) + kTiny;
      const double d = 2 * value[k] / denominator;
      squares[k] = d * d;
    }
  }
  return 0.25 * s.area * (squares[0] + squares[1] + squares[2] + squares[3]);
}

// Moments of several triangles, about their centroid.
SurfaceMoments sum_of_moments(const SegmentDomain& domain, std::span<const Index> triangles);

// Points and normals of at most `limit` of the triangles, spread evenly over the list, for fits of tori.
struct SurfaceSamples;
SurfaceSamples sample_triangles(const SegmentDomain& domain, const std::vector<Index>& triangles, std::size_t limit);

// A quadric that is no surface of its own for the piece it was fitted to: two planes, or two sheets with data on both
// (thesis 2.3.2, "Proxy insertion").
bool is_invalid(const Quadric& quadric, const SurfaceMoments& moments);

// A quadric passes through any nine points, and so many connected triangles less one have no more corners: they tell
// planes only.
inline constexpr std::size_t kLeastForQuadric = 8;

struct ProxyFit {
  Proxy proxy;
  double squared_distance = 0;  // integral of the first-order approximation
  bool plane = true;
  bool invalid = false;  // the best quadric was invalid, and the proxy is not it
};

// The best plane or quadric for a piece of surface, from its moments.
ProxyFit fit_proxy(const SurfaceMoments& moments, SegmentSurfaces surfaces);

}  // namespace bisector
