#include "segment/surface_normal.h"

#include <cmath>
#include <variant>

#include "segment/quadric.h"

namespace bisector {
namespace {

Vec3 across(const Vec3& v, const Vec3& axis) { return v - dot(v, axis) * axis; }

Vec3 normal_of(const Plane& s, const Vec3&) { return s.normal; }

Vec3 normal_of(const Sphere& s, const Vec3& p) { return unit(p - s.centre); }

Vec3 normal_of(const Cylinder& s, const Vec3& p) { return unit(across(p - s.point, s.axis)); }

Vec3 normal_of(const Cone& s, const Vec3& p) {
  const Vec3 v = p - s.apex, out = unit(across(v, s.axis));
  if (norm2(out) == 0) return {};
  return std::cos(s.angle) * out - std::copysign(std::sin(s.angle), dot(v, s.axis)) * s.axis;
}

Vec3 normal_of(const Torus& s, const Vec3& p) {
  const Vec3 v = p - s.centre;
  return unit(v - s.radius * unit(across(v, s.axis)));
}

Vec3 normal_of(const GeneralQuadric& s, const Vec3& p) { return unit(gradient_of(s.polynomial, p)); }

}  // namespace

Vec3 surface_normal(const Primitive& surface, const Vec3& p) {
  return std::visit([&](const auto& s) { return normal_of(s, p); }, surface);
}

}  // namespace bisector
