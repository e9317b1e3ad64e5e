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
    double start = 0;
    for (std::size_t k = 1; k < points.size(); ++k) {
      const Vec3 along = points[k] - points[k - 1];
      const double end = start + norm(along);
      segments_.push_back(
          {points[k - 1], points[k], along, unit(along), start, end, 1 / (end - start), 1 / norm2(along)});
      start = end;
    }
    first_.push_back(static_cast<Index>(segments_.size()));
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
  const CurveSegment *const begin = segments_.data() + first_[curve], *const end = segments_.data() + first_[curve + 1];
  const auto above = std::upper_bound(begin + 1, end, position,
                                      [](double at, const CurveSegment& segment) { return at < segment.start; });
  return static_cast<std::size_t>(above - begin) - 1;
}

Vec3 FeatureCurves::point(Index curve, double position) const {
  const CurveSegment& segment = segments_[first_[curve] + segment_at(curve, position)];
  const double t = position - segment.start;
  if (!(t > 0)) return segment.from;
  return t >= segment.end - segment.start ? segment.to : segment.from + (t * segment.per_length) * segment.along;
}

Vec3 FeatureCurves::tangent(Index curve, double position) const {
  return segments_[first_[curve] + segment_at(curve, position)].tangent;
}

double FeatureCurves::nearest(Index curve, const Vec3& p, double from, double reach) const {
  const CurveSegment* const all = segments_.data() + first_[curve];
  const double whole = length(curve);
  const std::size_t count = segments(curve), first = segment_at(curve, from);
  double best = norm2(point(curve, from) - p), position = from;
  // Looks for a nearer point on the part of segment k that is at most `reach` away from `from`; `shift` is the length
  // of the curve, or its negative, where the way there leads across the start of a closed curve.
  const auto try_segment = [&](std::size_t k, double shift) {
    const CurveSegment& segment = all[k];
    const double length_k = segment.end - segment.start;
    if (!(length_k > 0)) return;
    const double lo = std::max(0.0, from - reach - segment.start - shift) * segment.per_length;
    const double hi = std::min(length_k, from + reach - segment.start - shift) * segment.per_length;
    if (lo > hi) return;
    const double t = std::clamp(dot(p - segment.from, segment.along) * segment.per_square, lo, hi);
    const double squared = norm2(segment.from + t * segment.along - p);
    if (squared < best) {
      best = squared;
      position = segment.start + t * length_k;
    }
  };
  const bool loop = closed(curve);
  try_segment(first, 0);
  for (std::size_t step = 1; step < count; ++step) {
    if (!loop && first + step >= count) break;
    const std::size_t k = (first + step) % count;
    const double shift = first + step >= count ? whole : 0;
    if (all[k].start + shift > from + reach) break;
    try_segment(k, shift);
  }
  for (std::size_t step = 1; step < count; ++step) {
    if (!loop && step > first) break;
    const std::size_t k = step > first ? first + count - step : first - step;
    const double shift = step > first ? -whole : 0;
    if (all[k].end + shift < from - reach) break;
    try_segment(k, shift);
  }
  return position;
}

}  // namespace bisector
