#include "features/curves.h"

#include <algorithm>
#include <cmath>

#include "core/geometry.h"

namespace bisector {

std::vector<std::array<Index, 2>> edges_of(const std::vector<FeatureCurve>& curves) {
  std::vector<std::array<Index, 2>> edges;
  for (const FeatureCurve& curve : curves) {
    const std::size_t count = curve.vertices.size();
    for (std::size_t k = 0; k + (curve.closed ? 0 : 1) < count; ++k) {
      const Index a = curve.vertices[k], b = curve.vertices[(k + 1) % count];
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

FeatureCurves::FeatureCurves(const FeatureGraph& graph, const std::vector<Vec3>& vertices) : graph_(graph) {
  for (const FeatureCurve& curve : graph_.curves) {
    std::vector<Vec3> points;
    for (Index v : curve.vertices) points.push_back(vertices[v]);
    if (curve.closed) points.push_back(points.front());
    std::vector<double> starts{0};
    for (std::size_t k = 1; k < points.size(); ++k) starts.push_back(starts.back() + norm(points[k] - points[k - 1]));
    points_.push_back(std::move(points));
    starts_.push_back(std::move(starts));
    const auto corner = [&](Index v) {
      const auto found = std::lower_bound(graph_.corners.begin(), graph_.corners.end(), v);
      return static_cast<Index>(found - graph_.corners.begin());
    };
    ends_.push_back(curve.closed ? std::array<Index, 2>{kNone, kNone}
                                 : std::array<Index, 2>{corner(curve.vertices.front()), corner(curve.vertices.back())});
  }
  for (Index v : graph_.corners) corners_.push_back(vertices[v]);
}

double FeatureCurves::wrap(Index curve, double position) const {
  const double whole = length(curve);
  if (!closed(curve)) return std::clamp(position, 0.0, whole);
  position = std::fmod(position, whole);
  return position < 0 ? std::min(position + whole, whole) : position;
}

std::size_t FeatureCurves::segment_at(Index curve, double position) const {
  const std::vector<double>& starts = starts_[curve];
  const auto above = std::upper_bound(starts.begin() + 1, starts.end() - 1, position);
  return static_cast<std::size_t>(above - starts.begin()) - 1;
}

Vec3 FeatureCurves::point(Index curve, double position) const {
  const std::size_t k = segment_at(curve, position);
  const double whole = starts_[curve][k + 1] - starts_[curve][k], t = position - starts_[curve][k];
  const Vec3 &a = points_[curve][k], &b = points_[curve][k + 1];
  if (!(t > 0)) return a;
  return t >= whole ? b : a + (t / whole) * (b - a);
}

Vec3 FeatureCurves::tangent(Index curve, double position) const {
  const std::size_t k = segment_at(curve, position);
  return unit(points_[curve][k + 1] - points_[curve][k]);
}

double FeatureCurves::nearest(Index curve, const Vec3& p, double from, double reach) const {
  const std::vector<double>& starts = starts_[curve];
  const std::vector<Vec3>& points = points_[curve];
  const double whole = length(curve);
  const std::size_t count = segments(curve), first = segment_at(curve, from);
  double best = norm2(point(curve, from) - p), position = from;
  // Looks for a nearer point on the part of segment k that is at most `reach` away from `from`; `shift` is the length
  // of the curve, or its negative, where the way there leads across the start of a closed curve.
  const auto try_segment = [&](std::size_t k, double shift) {
    const double length_k = starts[k + 1] - starts[k];
    if (!(length_k > 0)) return;
    const Vec3 along = points[k + 1] - points[k];
    const double lo = std::max(0.0, from - reach - starts[k] - shift) / length_k;
    const double hi = std::min(length_k, from + reach - starts[k] - shift) / length_k;
    if (lo > hi) return;
    const double t = std::clamp(dot(p - points[k], along) / norm2(along), lo, hi);
    const double squared = norm2(points[k] + t * along - p);
    if (squared < best) {
      best = squared;
      position = starts[k] + t * length_k;
    }
  };
  const bool loop = closed(curve);
  try_segment(first, 0);
  for (std::size_t step = 1; step < count; ++step) {
    if (!loop && first + step >= count) break;
    const std::size_t k = (first + step) % count;
    const double shift = first + step >= count ? whole : 0;
    if (starts[k] + shift > from + reach) break;
    try_segment(k, shift);
  }
  for (std::size_t step = 1; step < count; ++step) {
    if (!loop && step > first) break;
    const std::size_t k = step > first ? first + count - step : first - step;
    const double shift = step > first ? -whole : 0;
    if (starts[k + 1] + shift < from - reach) break;
    try_segment(k, shift);
  }
  return position;
}

}  // namespace bisector
