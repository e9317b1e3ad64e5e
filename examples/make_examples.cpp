// Generates the models that ship with Bisector: smooth.off, a closed organic surface of genus 1, part.off, a machined
// part of genus 4, and engraved.off, a cube with letters. They are triangulated the way such models arrive: the first
// by marching tetrahedra, the others as a CAD system exports faces. Usage: make_examples DIRECTORY
#include <bisector/error.h>
#include <bisector/io.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <numbers>
#include <string>
#include <vector>

namespace {

using bisector::Index;
using bisector::Triangle;
using bisector::TriangleMesh;
using bisector::Vec3;

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec3 operator*(double s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double norm2(const Vec3& a) { return dot(a, a); }
double norm(const Vec3& a) { return std::sqrt(norm2(a)); }

// Coordinates are multiples of a power of two: short in the file, and the same whatever the last bit of a cosine is.
double rounded(double x, double quantum) { return std::nearbyint(x / quantum) * quantum; }

// ---- smooth.off: a sitting cat whose tail closes a loop ----

// Round cone from a to b with radii ra and rb.
double limb(const Vec3& p, const Vec3& a, const Vec3& b, double ra, double rb) {
  const Vec3 ab = b - a;
  const double t = std::clamp(dot(p - a, ab) / norm2(ab), 0.0, 1.0);
  return norm(p - a - t * ab) - (ra + t * (rb - ra));
}

double ball(const Vec3& p, const Vec3& centre, const Vec3& radii) {
  const Vec3 d = p - centre, q{d.x / radii.x, d.y / radii.y, d.z / radii.z};
  const double k0 = norm(q), k1 = norm(Vec3{q.x / radii.x, q.y / radii.y, q.z / radii.z});
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -std::min({radii.x, radii.y, radii.z});
}

// Smooth union: the surfaces blend over a width k.
double blend(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * h * k / 6;
}

// The tail's axis: a Catmull-Rom curve that leaves at the back, swings out and comes up again to the shoulder.
std::vector<Vec3> tail_axis() {
  const std::array<Vec3, 9> control{{{6, 14, -14},
                                     {0, 10, -26},
                                     {-11, 7, -39},
                                     {-26, 11, -44},
                                     {-36, 25, -37},
                                     {-36, 42, -23},
                                     {-25, 53, -9},
                                     {-10, 53, 0},
                                     {4, 50, 4}}};
  constexpr int kSteps = 8;
  std::vector<Vec3> axis;
  for (std::size_t i = 1; i + 2 < control.size(); ++i)
    for (int step = 0; step < kSteps; ++step) {
      const double t = 1.0 * step / kSteps;
      const Vec3 &a = control[i - 1], &b = control[i], &c = control[i + 1], &d = control[i + 2];
      axis.push_back(b + 0.5 * t * ((c - a) + t * ((2 * a - 5 * b + 4 * c - d) + t * (3 * (b - c) + d - a))));
    }
  axis.push_back(control[control.size() - 2]);
  return axis;
}

// Below zero inside. y is up, the cat looks along +z; x is its left.
double cat(const Vec3& p) {
  static const std::vector<Vec3> tail = tail_axis();
  const Vec3 m{std::abs(p.x), p.y, p.z};                          // limbs in pairs
  double d = limb(p, {0, 22, -12}, {0, 48, 4}, 20, 13);           // body
  d = blend(d, ball(m, {14, 14, -11}, {11, 14, 16}), 8);          // haunches
  d = blend(d, limb(m, {7, 44, 11}, {8.7, 5, 22}, 6.5, 4.4), 7);  // fore legs
  d = blend(d, ball(m, {8.8, 4, 25.5}, {4.8, 4, 6.5}), 3);        // fore paws
  d = blend(d, ball(m, {16, 4, 0}, {5.4, 4, 9}), 4);              // hind paws
  double head = ball(p, {0, 69, 11}, {16, 13.5, 14});
  head = blend(head, ball(m, {4.2, 63.5, 22.5}, {5, 4.2, 4.6}), 4);         // muzzle
  head = blend(head, limb(m, {8.5, 78, 9}, {12.3, 88, 7.5}, 6.5, 2.8), 4);  // ears
  d = blend(d, head, 9);
  double t = limb(p, tail[0], tail[1], 6, 6);
  for (std::size_t i = 1; i + 1 < tail.size(); ++i) t = std::min(t, limb(p, tail[i], tail[i + 1], 6, 6));
  return blend(d, t, 7);
}

// A lattice that is finer towards the head and the middle, so that triangles differ in size as in a scan.
class Lattice {
 public:
  static constexpr int kX = 29, kY = 36, kZ = 29;

  static Vec3 point(int i, int j, int k) {
    const double u = 2.0 * i / kX - 1, v = 1.0 * j / kY, w = 2.0 * k / kZ - 1;
    return {-7 + 43 * u * (0.65 + 0.35 * u * u), -1.7 + 95.4 * v * (1.35 - 0.35 * v),
            -8 + 46 * w * (0.75 + 0.25 * w * w)};
  }
  static Index id(int i, int j, int k) { return static_cast<Index>((k * (kY + 1) + j) * (kX + 1) + i); }
};

// Marching tetrahedra (Doi and Koide 1991) over the six simplices of each cell around its main diagonal.
class Polygoniser {
 public:
  TriangleMesh run() {
    for (int k = 0; k <= Lattice::kZ; ++k)
      for (int j = 0; j <= Lattice::kY; ++j)
        for (int i = 0; i <= Lattice::kX; ++i) {
          points_.push_back(Lattice::point(i, j, k));
          values_.push_back(cat(points_.back()));
        }
    for (int k = 0; k < Lattice::kZ; ++k)
      for (int j = 0; j < Lattice::kY; ++j)
        for (int i = 0; i < Lattice::kX; ++i) add_cell(i, j, k);
    return std::move(mesh_);
  }

 private:
  void add_cell(int i, int j, int k) {
    static constexpr std::array<std::array<int, 3>, 6> kOrders{
        {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
    for (std::size_t s = 0; s < 6; ++s) {
      std::array<int, 3> at{i, j, k};
      std::array<Index, 4> simplex{Lattice::id(i, j, k)};
      for (std::size_t step = 0; step < 3; ++step) {
        ++at[static_cast<std::size_t>(kOrders[s][step])];
        simplex[step + 1] = Lattice::id(at[0], at[1], at[2]);
      }
      add_simplex(simplex, s < 3);
    }
  }

  void add_simplex(std::array<Index, 4> v, bool positive) {
    std::size_t inside = 0;  // vertices inside come first, in a positive simplex
    for (std::size_t n = 0; n < 4; ++n)
      if (values_[v[n]] < 0) {
        if (n != inside) std::swap(v[n], v[inside]), positive = !positive;
        ++inside;
      }
    if (inside == 0 || inside == 4) return;
    if (!positive) inside == 3 ? std::swap(v[0], v[1]) : std::swap(v[2], v[3]);
    if (inside == 1) {
      mesh_.triangles.push_back({crossing(v[0], v[1]), crossing(v[0], v[2]), crossing(v[0], v[3])});
    } else if (inside == 3) {
      mesh_.triangles.push_back({crossing(v[0], v[3]), crossing(v[1], v[3]), crossing(v[2], v[3])});
    } else {
      const Index a = crossing(v[0], v[2]), b = crossing(v[0], v[3]);
      const Index c = crossing(v[1], v[3]), d = crossing(v[1], v[2]);
      mesh_.triangles.push_back({a, b, c});
      mesh_.triangles.push_back({a, c, d});
    }
  }

  // The surface's vertex on a lattice edge, kept off its ends so that rounding can't fold the surface.
  Index crossing(Index inside, Index outside) {
    const auto [at, is_new] = vertices_.try_emplace({inside, outside}, static_cast<Index>(mesh_.vertices.size()));
    if (is_new) {
      double lo = 0, hi = 1;
      for (int step = 0; step < 30; ++step) {
        const double t = (lo + hi) / 2;
        (cat(points_[inside] + t * (points_[outside] - points_[inside])) < 0 ? lo : hi) = t;
      }
      const Vec3 p = points_[inside] + std::clamp(lo, 0.015, 0.985) * (points_[outside] - points_[inside]);
      constexpr double kQuantum = 1.0 / 512;
      mesh_.vertices.push_back({rounded(p.x, kQuantum), rounded(p.y, kQuantum), rounded(p.z, kQuantum)});
    }
    return at->second;
  }

  std::vector<Vec3> points_;
  std::vector<double> values_;
  std::map<std::array<Index, 2>, Index> vertices_;
  TriangleMesh mesh_;
};

// ---- part.off: a lever with two bosses, a stepped bore with keyway, bolt holes and a pocket ----

// Plane points in units of 2^-16 mm, so that every orientation is exact.
using Plane = std::array<std::int64_t, 2>;
using Loop = std::vector<Plane>;  // counter-clockwise
constexpr double kUnit = 1.0 / 65536;

Plane at(double x, double y) {
  return {static_cast<std::int64_t>(std::nearbyint(x / kUnit)), static_cast<std::int64_t>(std::nearbyint(y / kUnit))};
}

// Adds an arc of `segments` segments between two angles in degrees, both ends included.
void add_arc(Loop& loop, double x, double y, double radius, double from, double to, int segments) {
  for (int k = 0; k <= segments; ++k) {
    const double angle = (from + (to - from) * k / segments) * std::numbers::pi / 180;
    loop.push_back(at(x + radius * std::cos(angle), y + radius * std::sin(angle)));
  }
}

Loop circle(double x, double y, double radius, int segments) {
  Loop loop;
  add_arc(loop, x, y, radius, 0, 360.0 * (segments - 1) / segments, segments - 1);
  return loop;
}

std::int64_t turn(const Plane& a, const Plane& b, const Plane& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Whether the open segments ab and cd touch, or one passes through an end of the other.
bool segments_meet(const Plane& a, const Plane& b, const Plane& c, const Plane& d) {
  if (a == c || a == d || b == c || b == d) return false;
  const auto sign = [](std::int64_t v) { return (v > 0) - (v < 0); };
  return sign(turn(a, b, c)) * sign(turn(a, b, d)) <= 0 && sign(turn(c, d, a)) * sign(turn(c, d, b)) <= 0;
}

struct Corner {
  Plane at;
  Index vertex;
};
using Outline = std::vector<Corner>;

// Joins a clockwise hole to the outline by the shortest bridge that crosses nothing.
void join_hole(Outline& outline, const Outline& hole, const std::vector<Outline>& all) {
  std::size_t best_outer = 0, best_hole = 0;
  std::int64_t best = INT64_MAX;
  const auto crosses = [](const Outline& o, const Plane& a, const Plane& b) {
    for (std::size_t k = 0; k < o.size(); ++k)
      if (segments_meet(a, b, o[k].at, o[(k + 1) % o.size()].at)) return true;
    return false;
  };
  for (std::size_t i = 0; i < outline.size(); ++i)
    for (std::size_t j = 0; j < hole.size(); ++j) {
      const Plane &a = outline[i].at, &b = hole[j].at;
      const std::int64_t length2 = (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
      if (length2 >= best || crosses(outline, a, b)) continue;
      if (std::any_of(all.begin(), all.end(), [&](const Outline& o) { return crosses(o, a, b); })) continue;
      best = length2, best_outer = i, best_hole = j;
    }
  Outline joined(outline.begin(), outline.begin() + static_cast<std::ptrdiff_t>(best_outer) + 1);
  for (std::size_t k = 0; k <= hole.size(); ++k) joined.push_back(hole[(best_hole + k) % hole.size()]);
  joined.insert(joined.end(), outline.begin() + static_cast<std::ptrdiff_t>(best_outer), outline.end());
  outline = std::move(joined);
}

// Ear clipping that takes the first ear it finds: valid, and with the slivers and fans of a quick exporter.
std::vector<Triangle> clip_ears(Outline outline) {
  std::vector<Triangle> triangles;
  while (outline.size() > 2) {
    const std::size_t n = outline.size();
    std::size_t ear = 0;
    for (; ear < n; ++ear) {
      const Plane &a = outline[(ear + n - 1) % n].at, &b = outline[ear].at, &c = outline[(ear + 1) % n].at;
      if (turn(a, b, c) <= 0) continue;
      const bool blocked = std::any_of(outline.begin(), outline.end(), [&](const Corner& q) {
        if (q.at == a || q.at == b || q.at == c) return false;
        return turn(a, b, q.at) >= 0 && turn(b, c, q.at) >= 0 && turn(c, a, q.at) >= 0;
      });
      if (!blocked) break;
    }
    if (ear == n) throw bisector::Error("make_examples: no ear left; change the part's loops");
    triangles.push_back({outline[(ear + n - 1) % n].vertex, outline[ear].vertex, outline[(ear + 1) % n].vertex});
    outline.erase(outline.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  return triangles;
}

class Part {
 public:
  // The wall from a loop at z0 up to one with as many points at z1, around material or around a hole.
  void wall(const Loop& lower, double z0, const Loop& upper, double z1, bool material_inside) {
    const std::size_t n = lower.size();
    for (std::size_t k = 0; k < n; ++k) {
      const Index a = vertex(lower[k], z0), b = vertex(lower[(k + 1) % n], z0);
      const Index c = vertex(upper[(k + 1) % n], z1), d = vertex(upper[k], z1);
      add({a, b, c}, material_inside);
      add({a, c, d}, material_inside);
    }
  }

  void cap(const Loop& outer, const std::vector<Loop>& holes, double z, bool faces_up) {
    const auto outline_of = [&](const Loop& loop) {
      Outline outline;
      for (const Plane& p : loop) outline.push_back({p, vertex(p, z)});
      return outline;
    };
    Outline outline = outline_of(outer);
    std::vector<Outline> inner;
    for (const Loop& hole : holes) {
      inner.push_back(outline_of(hole));
      std::reverse(inner.back().begin(), inner.back().end());
    }
    for (const Outline& hole : inner) join_hole(outline, hole, inner);
    for (const Triangle& t : clip_ears(outline)) add(t, faces_up);
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  Index vertex(const Plane& p, double z) {
    const auto [found, is_new] = vertices_.try_emplace({p, z}, static_cast<Index>(mesh_.vertices.size()));
    // The drawing's z is the file's y: up, as for the cat.
    if (is_new) mesh_.vertices.push_back({static_cast<double>(p[0]) * kUnit, z, static_cast<double>(-p[1]) * kUnit});
    return found->second;
  }

  void add(const Triangle& t, bool as_is) { mesh_.triangles.push_back(as_is ? t : Triangle{t[0], t[2], t[1]}); }

  TriangleMesh mesh_;
  std::map<std::pair<Plane, double>, Index> vertices_;
};

TriangleMesh make_part() {
  constexpr double kFar = 92;  // mm between the axes of the two bosses
  const double tangent = std::acos((30.0 - 17.0) / kFar) * 180 / std::numbers::pi;
  Loop outline;
  add_arc(outline, 0, 0, 30, tangent, 360 - tangent, 26);
  add_arc(outline, kFar, 0, 17, -tangent, tangent, 12);

  const Loop boss = circle(0, 0, 20, 36), boss_top = circle(0, 0, 18.5, 36), counterbore = circle(0, 0, 15.5, 32);
  Loop bore;  // radius 12 with a keyway 6 wide towards +x
  const double key = std::asin(3.0 / 12) * 180 / std::numbers::pi;
  add_arc(bore, 0, 0, 12, key, 360 - key, 25);
  bore.push_back(at(14, -3));
  bore.push_back(at(14, 3));
  const Loop far_boss = circle(kFar, 0, 12, 24), far_bore = circle(kFar, 0, 7, 20);
  const Loop bolt = circle(-12.5, 21.65, 2.5, 12), other_bolt = circle(-12.5, -21.65, 2.5, 12);
  const Loop pocket{at(32, -9), at(68, -6), at(68, 6), at(32, 9)};

  Part part;
  part.cap(outline, {bore, far_bore, bolt, other_bolt}, 0, false);
  part.wall(outline, 0, outline, 12, true);
  part.cap(outline, {boss, far_boss, bolt, other_bolt, pocket}, 12, true);
  part.wall(pocket, 5, pocket, 12, false);
  part.cap(pocket, {}, 5, true);
  part.wall(bolt, 0, bolt, 12, false);
  part.wall(other_bolt, 0, other_bolt, 12, false);
  part.wall(boss, 12, boss, 30.5, true);
  part.wall(boss, 30.5, boss_top, 32, true);
  part.cap(boss_top, {counterbore}, 32, true);
  part.wall(counterbore, 24, counterbore, 32, false);
  part.cap(counterbore, {bore}, 24, true);
  part.wall(bore, 0, bore, 24, false);
  part.wall(far_boss, 12, far_boss, 22, true);
  part.cap(far_boss, {far_bore}, 22, true);
  part.wall(far_bore, 0, far_bore, 22, false);
  return part.take();
}

// ---- engraved.off: a cube of 20 mm with letters 0.5 mm deep ----

// Letters of strokes 1 wide in a box of 5 by 7.
using Letter = std::vector<std::array<double, 2>>;
const Letter kC{{0, 0}, {5, 0}, {5, 1}, {1, 1}, {1, 6}, {5, 6}, {5, 7}, {0, 7}};
const Letter kV{{2, 0}, {3, 0}, {5, 7}, {4, 7}, {2.5, 1.75}, {1, 7}, {0, 7}};
const Letter kT{{2, 0}, {3, 0}, {3, 6}, {5, 6}, {5, 7}, {0, 7}, {0, 6}, {2, 6}};
const Letter kM{{0, 0}, {1, 0}, {1, 5}, {2.5, 2}, {4, 5}, {4, 0}, {5, 0}, {5, 7}, {4, 7}, {2.5, 4}, {1, 7}, {0, 7}};
const Letter kE{{0, 0}, {5, 0}, {5, 1}, {1, 1}, {1, 3}, {4, 3}, {4, 4}, {1, 4}, {1, 6}, {5, 6}, {5, 7}, {0, 7}};
const Letter kS{{0, 0}, {5, 0}, {5, 4}, {1, 4}, {1, 6}, {5, 6}, {5, 7}, {0, 7}, {0, 3}, {4, 3}, {4, 1}, {0, 1}};
const Letter kH{{0, 0}, {1, 0}, {1, 3}, {4, 3}, {4, 0}, {5, 0}, {5, 7}, {4, 7}, {4, 4}, {1, 4}, {1, 7}, {0, 7}};

TriangleMesh make_engraved() {
  constexpr double kSide = 20, kDepth = 0.5;
  std::vector<Loop> letters;
  const auto engrave = [&](const std::vector<Letter>& row, double x, double y, double size, double space) {
    for (const Letter& letter : row) {
      Loop& loop = letters.emplace_back();
      for (const auto& [u, v] : letter) loop.push_back(at(x + size * u, y + size * v));
      x += 5 * size + space;
    }
  };
  engrave({kC, kV, kT}, 1.75, 11, 0.9, 1.5);
  engrave({kM, kE, kS, kH}, 1.25, 3, 0.75, 0.8);

  const Loop square{at(0, 0), at(kSide, 0), at(kSide, kSide), at(0, kSide)};
  Part part;
  part.cap(square, {}, 0, false);
  part.wall(square, 0, square, kSide, true);
  part.cap(square, letters, kSide, true);
  for (const Loop& letter : letters) {
    part.wall(letter, kSide - kDepth, letter, kSide, false);
    part.cap(letter, {}, kSide - kDepth, true);
  }
  return part.take();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_examples DIRECTORY\n");
    return 2;
  }
  try {
    const std::string directory = argv[1];
    bisector::write_mesh(directory + "/smooth.off", Polygoniser().run());
    bisector::write_mesh(directory + "/part.off", make_part());
    bisector::write_mesh(directory + "/engraved.off", make_engraved());
  } catch (const bisector::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
