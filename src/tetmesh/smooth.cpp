#include "tetmesh/smooth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mesh/tet_adjacency.h"
#include "mesh/tet_quality.h"
#include "tetmesh/tet_shape.h"

namespace bisector {
namespace {

constexpr double kBand = 0.03;  // sines within so much of the least one are raised together

// The point of the convex hull of `points` nearest to the origin (Gilbert 1966, with steps away from the farthest
// point).
Vec3 nearest_to_origin(const std::vector<Vec3>& points) {
  std::vector<double> weights(points.size(), 0);
  std::size_t start = 0;
  for (std::size_t k = 1; k < points.size(); ++k)
    if (norm2(points[k]) < norm2(points[start])) start = k;
  weights[start] = 1;
  Vec3 x = points[start];
  for (int round = 0; round < 60; ++round) {
    std::size_t toward = 0, away = start;
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double height = dot(x, points[k]);
      if (height < least) least = height, toward = k;
      if (weights[k] > 0 && height > most) most = height, away = k;
    }
    const double here = norm2(x);
    if (here - least <= 1e-3 * here) break;
    const bool back = most - here > here - least && weights[away] < 1;
    const Vec3 d = back ? x - points[away] : points[toward] - x;
    const double length2 = norm2(d);
    if (!(length2 > 0)) break;
    const double limit = back ? weights[away] / (1 - weights[away]) : 1;
    const double t = std::clamp(-dot(x, d) / length2, 0.0, limit);
    for (double& w : weights) w *= back ? 1 + t : 1 - t;
    if (back) weights[away] = t == limit ? 0 : weights[away] - t;
    else weights[toward] += t;
    x += t * d;
  }
  return x;
}

// Solves (H + shift) s = -g for the symmetric H, with the least shift of a short list that makes it positive; false
// if none does.
bool newton_step(const double h[3][3], const Vec3& g, Vec3& s) {
  const double trace = std::abs(h[0][0]) + std::abs(h[1][1]) + std::abs(h[2][2]);
  for (const double shift : {0.0, 0.1 * trace, trace}) {
    const double a = h[0][0] + shift, b = h[0][1], c = h[0][2], d = h[1][1] + shift, e = h[1][2], f = h[2][2] + shift;
    if (!(a > 0)) continue;
    const double l1 = b / a, l2 = c / a, p = d - l1 * b, q = e - l1 * c;
    if (!(p > 0)) continue;
    const double l3 = q / p, r = f - l2 * c - l3 * q;
    if (!(r > 1e-12 * trace)) continue;
    const double y0 = -g.x, y1 = -g.y - l1 * y0, y2 = -g.z - l2 * y0 - l3 * y1;
    s.z = y2 / r;
    s.y = y1 / p - l3 * s.z;
    s.x = y0 / a - l1 * s.y - l2 * s.z;
    return true;
  }
  return false;
}

double smallest_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double area = norm(cross(b - a, c - a));
  return std::min(
      {std::atan2(area, dot(b - a, c - a)), std::atan2(area, dot(a - b, c - b)), std::atan2(area, dot(a - c, b - c))});
}

}  // namespace

TetSmoother::TetSmoother(TetEdit& mesh, const TetSlide& slide) : mesh_(mesh), slide_(slide) {
  if (slide.project)
    for (Index v = 0; v < mesh.points(); ++v) first_.push_back(mesh.point(v));
}

bool TetSmoother::movable(Index v) const {
  return mesh_.alive(v) && (!mesh_.held(v) || (slide_.project && mesh_.on_boundary(v)));
}

bool TetSmoother::gather(Index v) {
  star_.tets = mesh_.star(v);
  star_.facets.clear();
  double size = 0;
  const Vec3 x = mesh_.point(v);
  for (const Index t : star_.tets) {
    const Tetrahedron& corners = mesh_.tet(t).corners;
    const int k = static_cast<int>(std::find(corners.begin(), corners.end(), v) - corners.begin());
    const Triangle f = facet_of(corners, k);
    star_.facets.push_back({mesh_.point(f[0]), mesh_.point(f[1]), mesh_.point(f[2])});
    for (const Vec3& p : star_.facets.back()) size += norm(p - x);
  }
  star_.size = size / (3 * static_cast<double>(star_.facets.size()));
  return !star_.facets.empty();
}

double TetSmoother::minimum(const Vec3& x) const {
  double least = 1;
  for (const auto& [p, q, r] : star_.facets) {
    least = std::min(least, dihedral_shape(x, p, q, r));
    if (!(least > 0)) return 0;
  }
  return least;
}

double TetSmoother::cost(const Vec3& x, bool steep) const {
  double sum = 0;
  for (const auto& [p, q, r] : star_.facets) {
    const double ratio = radius_ratio(x, p, q, r);
    if (!(ratio > 0)) return std::numeric_limits<double>::infinity();
    sum += steep ? 1 / ratio : -ratio;
  }
  return sum;
}

double TetSmoother::cost(const Vec3& x, bool steep, Vec3& gradient) const {
  double sum = 0;
  gradient = {};
  for (const auto& [p, q, r] : star_.facets) {
    Vec3 g;
    const double ratio = radius_ratio(x, p, q, r, g);
    sum += steep ? 1 / ratio : -ratio;
    gradient -= steep ? (1 / (ratio * ratio)) * g : g;
  }
  return sum;
}

bool TetSmoother::admit(Index v, Vec3& x) const {
  if (!mesh_.held(v)) return true;
  x = slide_.project(v, x);
  for (int k = 0; k < 3; ++k)
    if (!std::isfinite(x[k])) return false;
  for (const Index t : star_.tets) {
    const TetEdit::Tet& tet = mesh_.tet(t);
    for (int k = 0; k < 4; ++k) {
      if (tet.across[k] != kNone || tet.corners[k] == v) continue;
      const Triangle f = facet_of(tet.corners, k);
      Vec3 before[3], after[3];
      for (int i = 0; i < 3; ++i) {
        before[i] = mesh_.point(f[i]);
        after[i] = f[i] == v ? x : before[i];
      }
      const double angle = smallest_angle(after[0], after[1], after[2]);
      if (angle < slide_.min_angle * kRadiansPerDegree && angle < smallest_angle(before[0], before[1], before[2]))
        return false;
      const Vec3 m = cross(first_[f[1]] - first_[f[0]], first_[f[2]] - first_[f[0]]);
      const Vec3 n = cross(after[1] - after[0], after[2] - after[0]);
      if (dot(m, n) < std::cos(slide_.max_turn * kRadiansPerDegree) * norm(m) * norm(n)) return false;
    }
  }
  return true;
}

bool TetSmoother::raise_minimum(Index v, double enough) {
  if (!movable(v) || !gather(v)) return false;
  Vec3 x = mesh_.point(v);
  double least = minimum(x);
  bool moved = false;
  double step = 0.2 * star_.size;
  std::vector<Vec3> active;
  for (int round = 0; round < 20 && least < enough; ++round) {
    active.clear();
    for (const auto& [p, q, r] : star_.facets) {
      if (dihedral_shape(x, p, q, r) > least + kBand) continue;
      const DihedralSines sines = dihedral_sines(x, p, q, r);
      for (int k = 0; k < 6; ++k)
        if (sines.value[k] <= least + kBand) active.push_back(sines.gradient[k]);
    }
    const Vec3 direction = nearest_to_origin(active);
    const double rate = norm(direction);
    if (!(rate * star_.size > 1e-3)) break;
    double best = least;
    Vec3 best_x;
    for (int halving = 0; halving < 8; ++halving, step /= 2) {
      Vec3 y = x + (step / rate) * direction;
      if (!admit(v, y)) continue;
      const double value = minimum(y);
      if (value > best) {
        best = value;
        best_x = y;
      } else if (best > least) {
        break;
      }
    }
    if (best < least + 1e-4) break;
    if (!mesh_.move(v, best_x)) break;
    moved = true;
    const bool slow = best < least + 2e-3;
    x = best_x;
    least = best;
    step *= 4;
    if (slow) break;
  }
  return moved;
}

bool TetSmoother::raise_ratios(Index v, double floor, bool steep) {
  if (mesh_.held(v) || !mesh_.alive(v) || !gather(v)) return false;
  const Vec3 x = mesh_.point(v);
  Vec3 g;
  const double before = cost(x, steep, g);
  const double delta = 1e-5 * star_.size;
  double h[3][3];
  for (int i = 0; i < 3; ++i) {
    Vec3 y = x, gy;
    y[i] += delta;
    cost(y, steep, gy);
    for (int j = 0; j < 3; ++j) h[i][j] = (gy[j] - g[j]) / delta;
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j) h[i][j] = h[j][i] = (h[i][j] + h[j][i]) / 2;
  Vec3 s;
  if (!newton_step(h, g, s)) s = (-0.1 * star_.size / std::max(norm(g), 1e-300)) * g;
  const double length = norm(s);
  if (!(length > 1e-4 * star_.size)) return false;
  double t = std::min(1.0, 0.3 * star_.size / length);
  const double least = std::min(floor, minimum(x));
  for (int halving = 0; halving < 4; ++halving, t /= 2) {
    const Vec3 y = x + t * s;
    if (cost(y, steep) < before && minimum(y) >= least) return mesh_.move(v, y);
  }
  return false;
}

}  // namespace bisector
