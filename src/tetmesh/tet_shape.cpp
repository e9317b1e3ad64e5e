#include "tetmesh/tet_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace bisector {
namespace {

// The two facets, each opposite a corner, that meet in edge k, and the edge's two ends.
constexpr int kFacets[6][2] = {{2, 3}, {1, 3}, {1, 2}, {0, 3}, {0, 2}, {0, 1}};
constexpr int kEnds[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

struct Frame {
  Vec3 corners[4];
  Vec3 normals[4];   // outward, twice the area long
  double areas2[4];  // their squared lengths
  double volume6;
};

Frame frame_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  Frame f{{a, b, c, d}, {}, {}, 0};
  const Vec3 u = b - a, v = c - a, w = d - a;
  f.normals[1] = cross(w, v);
  f.normals[2] = cross(u, w);
  f.normals[3] = cross(v, u);
  f.normals[0] = -(f.normals[1] + f.normals[2] + f.normals[3]);
  for (int k = 0; k < 4; ++k) f.areas2[k] = norm2(f.normals[k]);
  f.volume6 = -dot(f.normals[1], u);
  return f;
}

// Twelve times the volume times the circumscribed radius long: from one corner towards the centre.
Vec3 radius_vector(const Vec3& u, const Vec3& v, const Vec3& w) {
  return norm2(u) * cross(v, w) + norm2(v) * cross(w, u) + norm2(w) * cross(u, v);
}

// Of |N|^2 where N = (p - x) x (q - x), by x.
Vec3 area2_gradient(const Vec3& p, const Vec3& q, const Vec3& n) { return 2.0 * cross(p - q, n); }

}  // namespace

double dihedral_shape(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Frame f = frame_of(a, b, c, d);
  if (!(f.volume6 > 0)) return 0;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = kFacets[k];
    const double s2 = norm2(f.corners[kEnds[k][1]] - f.corners[kEnds[k][0]]) / (f.areas2[i] * f.areas2[j]);
    least = std::min(least, s2);
  }
  return f.volume6 * std::sqrt(least);
}

DihedralSines dihedral_sines(const Vec3& x, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Frame f = frame_of(x, b, c, d);
  const Vec3 volume = (-1 / f.volume6) * f.normals[0];  // logarithmic derivatives
  const Vec3 areas[4] = {{},
                         (0.5 / f.areas2[1]) * area2_gradient(d, c, f.normals[1]),
                         (0.5 / f.areas2[2]) * area2_gradient(b, d, f.normals[2]),
                         (0.5 / f.areas2[3]) * area2_gradient(c, b, f.normals[3])};
  DihedralSines sines;
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = kFacets[k];
    const Vec3 edge = f.corners[kEnds[k][1]] - f.corners[kEnds[k][0]];
    const double length2 = norm2(edge);
    const double value = f.volume6 * std::sqrt(length2 / (f.areas2[i] * f.areas2[j]));
    Vec3 gradient = volume - areas[i] - areas[j];
    if (kEnds[k][0] == 0) gradient -= (1 / length2) * edge;
    sines.value[k] = value;
    sines.gradient[k] = value * gradient;
  }
  return sines;
}

double radius_ratio(const Vec3& x, const Vec3& b, const Vec3& c, const Vec3& d, Vec3& gradient) {
  const Frame f = frame_of(x, b, c, d);
  const Vec3 u = x - b, v = c - b, w = d - b;
  const Vec3 n = cross(v, w), radius = radius_vector(u, v, w);
  const double length = norm(radius);
  const Vec3 unit = (1 / length) * radius;
  const Vec3 length_gradient = 2 * dot(unit, n) * u + cross(norm2(w) * v - norm2(v) * w, unit);
  double areas[4], area = 0;
  for (int k = 0; k < 4; ++k) area += areas[k] = std::sqrt(f.areas2[k]);
  const Vec3 area_gradient = (0.5 / areas[1]) * area2_gradient(d, c, f.normals[1]) +
                             (0.5 / areas[2]) * area2_gradient(b, d, f.normals[2]) +
                             (0.5 / areas[3]) * area2_gradient(c, b, f.normals[3]);
  const double ratio = 6 * f.volume6 * f.volume6 / (area * length);
  gradient = ratio * ((-2 / f.volume6) * f.normals[0] - (1 / area) * area_gradient - (1 / length) * length_gradient);
  return ratio;
}

DihedralRange dihedral_range(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Frame f = frame_of(a, b, c, d);
  DihedralRange range;
  for (int k = 0; k < 6; ++k) {
    const auto [i, j] = kFacets[k];
    const Vec3 edge = f.corners[kEnds[k][1]] - f.corners[kEnds[k][0]];
    // |N_i x N_j| is six times the volume times the edge's length, which atan2 takes without cancellation.
    const double angle = std::atan2(f.volume6 * norm(edge), -dot(f.normals[i], f.normals[j])) * 180 / std::numbers::pi;
    range.min = std::min(range.min, angle);
    range.max = std::max(range.max, angle);
  }
  return range;
}

}  // namespace bisector
