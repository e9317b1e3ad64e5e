#include "tree/frames.h"

#include <algorithm>
#include <cmath>

#include "bisector/error.h"

namespace bisector {
namespace {

constexpr double kTwist = 1e-7;      // radians per unit of the parameter between a step and two of half its length
constexpr double kRounding = 1e-13;  // radians
constexpr int kHalvings = 20;        // of a step
constexpr double kAligned = 0.5;     // cosine between a chord and its tangent, at least
constexpr int kStepsPerSpan = 4;     // so that no bend is between the parameters that are compared

struct Place {
  double t;
  Vec3 position, tangent;
};

// The curve's points, about its first so that chords of short steps are exact far from the origin, and directions.
class Path {
 public:
  explicit Path(const BSplineCurve& curve) : curve_(curve) {
    for (Vec3& c : curve_.control) c -= curve.control.front();
    for (std::size_t i = 1; i < curve_.control.size(); ++i) length_ += norm(curve_.control[i] - curve_.control[i - 1]);
    if (!(length_ > 0) || !std::isfinite(length_))
      throw Error("frames: the curve has no length, or an infinite one; give two distinct control points");
  }

  Place at(double t) const { return {t, curve_.point(t), tangent(t)}; }

 private:
  Vec3 tangent(double t) const {
    for (double nudge = 0; nudge<0.1; nudge = nudge> 0 ? 4 * nudge : 1e-9) {
      const Vec3 d = curve_.derivative(t >= nudge ? t - nudge : t + nudge);
      if (norm(d) > 1e-9 * length_) return unit(d);
    }
    return {0, 0, 1};
  }

  BSplineCurve curve_;
  double length_ = 0;
};

// Perpendicular to the tangent and to the coordinate axis that the tangent is farthest from.
Vec3 first_normal(const Vec3& tangent) {
  const Vec3 size{std::abs(tangent.x), std::abs(tangent.y), std::abs(tangent.z)};
  Vec3 axis;
  axis[size.x <= size.y && size.x <= size.z ? 0 : size.y <= size.z ? 1 : 2] = 1;
  return unit(cross(axis, tangent));
}

Vec3 reflected(const Vec3& a, const Vec3& mirror) {
  const double m = norm2(mirror);
  return m > 0 ? a - (2 * dot(a, mirror) / m) * mirror : a;
}

// `normal` carried from a to b (Wang et al., Table I), made perpendicular again after rounding. Where the chord does
// not run along the curve, being that of two parameters that are equal but for rounding or of a cusp, the normal is
// only made perpendicular.
Vec3 reflect_twice(const Place& a, const Vec3& normal, const Place& b) {
  const Vec3 chord = b.position - a.position;
  Vec3 carried = normal;
  if (dot(chord, a.tangent) > kAligned * norm(chord)) {
    const Vec3 half = reflected(normal, chord), tangent = reflected(a.tangent, chord);
    carried = reflected(half, b.tangent - tangent);
  }
  carried -= dot(carried, b.tangent) * b.tangent;
  return norm(carried) > 1e-6 ? unit(carried) : first_normal(b.tangent);
}

Vec3 carry(const Path& path, const Place& a, const Vec3& normal, const Place& b, int halvings) {
  const Place middle = path.at(0.5 * (a.t + b.t));
  const Vec3 at_once = reflect_twice(a, normal, b);
  const Vec3 half = reflect_twice(a, normal, middle), in_two = reflect_twice(middle, half, b);
  if (!(norm(at_once - in_two) > kTwist * (b.t - a.t) + kRounding) || halvings == 0) return in_two;
  return carry(path, middle, carry(path, a, normal, middle, halvings - 1), b, halvings - 1);
}

// The parameters that the frame is carried to in turn, beside those asked for.
std::vector<double> stations(const BSplineCurve& curve) {
  std::vector<double> result;
  for (std::size_t i = 1; i < curve.knots.size(); ++i)
    for (int k = 0; k < kStepsPerSpan && curve.knots[i - 1] < curve.knots[i]; ++k)
      result.push_back(curve.knots[i - 1] + (curve.knots[i] - curve.knots[i - 1]) * k / kStepsPerSpan);
  return result;
}

}  // namespace

std::vector<Frame> rotation_minimising_frames(const BSplineCurve& curve, const std::vector<double>& parameters) {
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (!(parameters[i] >= (i ? parameters[i - 1] : 0) && parameters[i] <= 1))
      throw Error("frames: parameters are not ascending from 0 to 1; sort them");
  const Path path(curve);
  const std::vector<double> between = stations(curve);

  std::vector<Frame> frames;
  Place place = path.at(0);
  Vec3 normal = first_normal(place.tangent);
  auto station = between.begin();
  for (const double t : parameters) {
    while (place.t < t) {
      while (station != between.end() && *station <= place.t) ++station;
      const Place next = path.at(station == between.end() ? t : std::min(*station, t));
      normal = carry(path, place, normal, next, kHalvings);
      place = next;
    }
    frames.push_back({curve.point(t), place.tangent, normal, cross(place.tangent, normal)});
  }
  return frames;
}

}  // namespace bisector
