// Places on feature curves: twins of FeatureCurves in src/features/curves.cpp.
//
// To include: `curves` and `segments`.
#include "layout/descent.h"

double segment_number(uint segment, uint at) { return segments[kSegmentWords * segment + at]; }
dvec3 segment_vector(uint segment, uint at) {
  return dvec3(segment_number(segment, at), segment_number(segment, at + 1), segment_number(segment, at + 2));
}

uint segment_at(uint curve, double position) {
  uint begin = curves[kCurveWords * curve] + 1, end = curves[kCurveWords * curve + 1];
  [[dont_unroll]] while (begin < end) {
    const uint middle = begin + (end - begin) / 2;
    if (position < segment_number(middle, kSegmentStartAt)) end = middle;
    else begin = middle + 1;
  }
  return begin - 1;
}

dvec3 curve_point(uint curve, double position) {
  const uint k = segment_at(curve, position);
  const double start = segment_number(k, kSegmentStartAt);
  precise double t = position - start;
  precise double length = segment_number(k, kSegmentEndAt) - start;
  if (!(t > 0.0LF)) return segment_vector(k, 0);
  if (t >= length) return segment_vector(k, kSegmentToAt);
  precise dvec3 point = segment_vector(k, 0) +
                        (t * segment_number(k, kSegmentPerLengthAt)) * segment_vector(k, kSegmentAlongAt);
  return point;
}

dvec3 curve_tangent(uint curve, double position) {
  return segment_vector(segment_at(curve, position), kSegmentTangentAt);
}

// A place that a nearer one is looked for to.
struct NearestPlace {
  double position, squared;
};

void try_segment(uint k, double shift, dvec3 p, double from, double reach, inout NearestPlace nearest) {
  const double start = segment_number(k, kSegmentStartAt);
  precise double length = segment_number(k, kSegmentEndAt) - start;
  if (!(length > 0.0LF)) return;
  const double per_length = segment_number(k, kSegmentPerLengthAt);
  precise double lo = max(0.0LF, from - reach - start - shift) * per_length;
  precise double hi = min(length, from + reach - start - shift) * per_length;
  if (lo > hi) return;
  const dvec3 origin = segment_vector(k, 0), along = segment_vector(k, kSegmentAlongAt);
  precise dvec3 towards = p - origin;
  precise double t = clamp(dot3(towards, along) * segment_number(k, kSegmentPerSquareAt), lo, hi);
  precise dvec3 away = origin + t * along - p;
  const double squared = norm2(away);
  if (squared < nearest.squared) {
    nearest.squared = squared;
    precise double position = start + t * length;
    nearest.position = position;
  }
}

double nearest_on_curve(uint curve, dvec3 p, double from, double reach) {
  const uint begin = curves[kCurveWords * curve], count = curves[kCurveWords * curve + 1] - begin;
  const bool loop = curves[kCurveWords * curve + 2] != 0;
  const double whole = segment_number(begin + count - 1, kSegmentEndAt);
  const uint first = segment_at(curve, from) - begin;
  precise dvec3 away = curve_point(curve, from) - p;
  NearestPlace nearest;
  nearest.position = from;
  nearest.squared = norm2(away);
  try_segment(begin + first, 0.0LF, p, from, reach, nearest);
  [[dont_unroll]] for (uint step = 1; step < count; ++step) {
    if (!loop && first + step >= count) break;
    const uint k = begin + (first + step) % count;
    const double shift = first + step >= count ? whole : 0.0LF;
    precise double start = segment_number(k, kSegmentStartAt) + shift;
    precise double farthest = from + reach;
    if (start > farthest) break;
    try_segment(k, shift, p, from, reach, nearest);
  }
  [[dont_unroll]] for (uint step = 1; step < count; ++step) {
    if (!loop && step > first) break;
    const uint k = begin + (step > first ? first + count - step : first - step);
    const double shift = step > first ? -whole : 0.0LF;
    precise double end = segment_number(k, kSegmentEndAt) + shift;
    precise double nearest_end = from - reach;
    if (end < nearest_end) break;
    try_segment(k, shift, p, from, reach, nearest);
  }
  return nearest.position;
}
