#include "segment/border_weights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "segment/quadric.h"

namespace bisector {
namespace {

// Units that a length l of border costs. The likelihood leaves it open; on generated parts with noise 4 of 1/4, 1/2, 1
// to 16 leaves the most triangles with their surfaces.
constexpr double kBorderCost = 4;

// The approximate distance, negative where the polynomial is.
double signed_distance(const Proxy& proxy, const Vec3& p) {
  if (proxy.torus) return signed_distance(*proxy.torus, p);
  return std::copysign(approximate_distance(proxy.quadric, proxy.second_order, p), value_of(proxy.quadric, p));
}

// Sums over a region.
struct Sums {
  double distance = 0, area = 0;     // squared distance times area
  double ends = 0, differences = 0;  // over edges: mean of both ends' squares, half the squared difference
  double lengths = 0, edges = 0;     // squared lengths; number
};

}  // namespace

std::vector<RegionNoise> region_noise(const SegmentDomain& domain, const std::vector<Index>& labels,
                                      const std::vector<Proxy>& proxies) {
  std::vector<Sums> sums(proxies.size());
  for (Index t = 0; t < labels.size(); ++t) {
    const Proxy& proxy = proxies[labels[t]];
    Sums& s = sums[labels[t]];
    s.distance += distance_to(domain, t, proxy);
    s.area += domain.areas[t];
    const Triangle& v = domain.triangles[t];
    double d[3];
    for (std::size_t k = 0; k < 3; ++k) d[k] = signed_distance(proxy, domain.vertices[v[k]]);
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = d[k], b = d[(k + 1) % 3];
      s.ends += (a * a + b * b) / 2;
      s.differences += (a - b) * (a - b) / 2;
      s.lengths += norm2(domain.vertices[v[(k + 1) % 3]] - domain.vertices[v[k]]);
      ++s.edges;
    }
  }
  std::vector<RegionNoise> noise;
  for (const Sums& s : sums) {
    noise.push_back({s.area});
    if (!(s.area > 0)) continue;
    // For correlations exp(-h^2 / (2 l^2)) of distances h apart the area that counts once is their integral, 2 pi l^2.
    const double vertex_area = 2 * s.area / (s.edges / 3), square = s.lengths / s.edges;
    const double correlation = s.ends > 0 ? 1 - s.differences / s.ends : 0;
    const double correlated = correlation > 0 ? std::numbers::pi * square / -std::log(correlation) : 0;
    noise.back().mean_square = s.distance / s.area;
    noise.back().alike_area = std::min(std::max(vertex_area, correlated), s.area);
  }
  return noise;
}

std::vector<double> border_weights(const SegmentDomain& domain, const std::vector<RegionNoise>& noise) {
  std::vector<double> weights;
  for (const RegionNoise& n : noise) {
    const double mean_square = std::max(n.mean_square, kNegligible * kNegligible);
    weights.push_back(2 * kBorderCost * mean_square * std::sqrt(n.alike_area) / domain.scale);
  }
  return weights;
}

}  // namespace bisector
