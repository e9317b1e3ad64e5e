// A screen in single precision for the clippers of triangles and of tetrahedra: it passes over most bisectors that do
// not cut a polygon or polyhedron, and over none that does. Coordinates are relative to the cell's seed, scaled into
// the range of float.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/geometry.h"

namespace bisector {

typedef float FourFloats __attribute__((vector_size(4 * sizeof(float)), may_alias));
typedef std::int32_t FourMasks __attribute__((vector_size(4 * sizeof(float))));

// More than all that underflow takes from a product in single precision, or from half a square.
inline constexpr float kScreenUnderflow = 1e-36f;

// The power of two that scales the seeds' extent to about 1.
inline double screen_scale(double extent) { return extent > 0 ? std::ldexp(1.0, -std::ilogb(extent)) : 1; }

// The bisectors of four neighbours: the vectors to them, and half the squares of these.
struct alignas(16) ScreenBlock {
  float x[4], y[4], z[4], half[4];

  void set(std::size_t m, const Vec3& d, double half_square) {
    x[m] = static_cast<float>(d.x);
    y[m] = static_cast<float>(d.y);
    z[m] = static_cast<float>(d.z);
    half[m] = static_cast<float>(half_square);
  }
  // For a place without a neighbour.
  void set_none(std::size_t m) {
    x[m] = y[m] = z[m] = 0;
    half[m] = std::numeric_limits<float>::infinity();
  }
};

// How far a polygon or polyhedron reaches from the seed.
struct Reach {
  double squared = 0;  // upper bound of its squared distance
  float scaled = 0;    // the same, scaled
  float margin = 0;    // by how much a product of a vertex and the vector to a neighbour may be off, scaled

  Reach() = default;
  // From the largest squared distance of a vertex and the largest error of a vertex. (r + e)^2 <= r^2 (1 + a) + e^2 (1
  // + 1/a), and no point is farther than the domain's corners, at the squared distance `domain`.
  Reach(double vertices, double slack, double domain, double scale)
      : squared(std::min(domain, vertices * (1 + 1e-6) + 4e6 * (slack * slack))) {
    const double scaling = scale * scale;
    scaled = static_cast<float>(squared * scaling * (1 + 1e-6)) + kScreenUnderflow;
    margin =
        static_cast<float>((4e-6 * squared + 8 * std::sqrt(squared) * slack) * scaling * (1 + 1e-6)) + kScreenUnderflow;
  }

  // The security radius: whether every point is nearer to the seed than to any other at this distance or more.
  bool is_safe_from(double squared_distance) const { return 4 * squared < squared_distance * (1 - 1e-9); }
  // The same for the neighbours of the block and all after them, in ascending distance.
  bool is_safe_from(const ScreenBlock& block) const { return 2 * scaled < block.half[0]; }
};

// Bit m is set if bisector m of the block may cut. `each_vertex(test)` calls test(x, y, z) for all vertices.
//
// With |d| < 2 r, r the reach, a product as coded and the limit are off by less than 2e-6 |d| r < 4e-6 r^2 together,
// and by less than 4 r slack for the vertex's own error. Bisectors with |d| >= 2 r do not cut at all. Whatever
// overflows or is not a number counts as cutting.
template <class EachVertex>
inline unsigned may_cut(const ScreenBlock& block, float margin, const EachVertex& each_vertex) {
  const auto load = [](const float* p) { return *reinterpret_cast<const FourFloats*>(p); };
  const FourFloats x = load(block.x), y = load(block.y), z = load(block.z);
  const FourFloats limit = load(block.half) - margin;
  FourMasks before = ~FourMasks{};
  each_vertex([&](const auto& px, const auto& py, const auto& pz) { before &= x * px + y * py + z * pz < limit; });
  return (~static_cast<unsigned>(before[0]) & 1) | (~static_cast<unsigned>(before[1]) & 2) |
         (~static_cast<unsigned>(before[2]) & 4) | (~static_cast<unsigned>(before[3]) & 8);
}

}  // namespace bisector
