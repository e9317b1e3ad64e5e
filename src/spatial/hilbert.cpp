#include "spatial/hilbert.h"

#include "core/parallel.h"

namespace bisector {
namespace {

struct Key {
  std::uint64_t code;
  Index index;
};

// The lower 21 bits of x, two zeros before each.
std::uint64_t spread(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

// Place on the Hilbert curve of 21 bits per axis: the curve's orientation in each octant is undone from the highest bit
// down, then the Gray code (Skilling 2004, "Programming the Hilbert curve").
std::uint64_t hilbert_code(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  constexpr std::uint32_t kTop = 1u << 20;
  std::uint32_t axes[3] = {x, y, z};
  for (std::uint32_t bit = kTop; bit > 1; bit >>= 1) {
    const std::uint32_t lower = bit - 1;
    for (std::uint32_t& axis : axes) {
      const std::uint32_t swap = axis & bit ? 0 : (axes[0] ^ axis) & lower;
      const std::uint32_t invert = axis & bit ? lower : 0;
      axes[0] ^= swap ^ invert;
      axis ^= swap;
    }
  }
  axes[1] ^= axes[0];
  axes[2] ^= axes[1];
  std::uint32_t flip = 0;
  for (std::uint32_t bit = kTop; bit > 1; bit >>= 1)
    if (axes[2] & bit) flip ^= bit - 1;
  return spread(axes[0] ^ flip) << 2 | spread(axes[1] ^ flip) << 1 | spread(axes[2] ^ flip);
}

}  // namespace

std::vector<Index> hilbert_order(const std::vector<Vec3>& points) {
  const Box box = bounding_box(points);
  const Vec3 extent = box.hi - box.lo;
  const double side = std::max({extent.x, extent.y, extent.z});
  // Codes need not tell points apart; where the quotient would overflow they are all 0.
  const double scale = side > 1e-300 ? 2097151.0 / side : 0.0;
  std::vector<Key> keys(points.size());
  parallel_each(points.size(), [&](std::size_t i) {
    const Vec3 p = scale * (points[i] - box.lo);
    keys[i] = {
        hilbert_code(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y), static_cast<std::uint32_t>(p.z)),
        static_cast<Index>(i)};
  });
  // Points of one code are ordered by position first, so that equal points meet.
  sort_in_parallel(keys, [&](const Key& a, const Key& b) {
    if (a.code != b.code) return a.code < b.code;
    const Vec3 &p = points[a.index], &q = points[b.index];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    if (p.z != q.z) return p.z < q.z;
    return a.index < b.index;
  });
  std::vector<Index> order(points.size());
  parallel_each(keys.size(), [&](std::size_t k) { order[k] = keys[k].index; });
  return order;
}

}  // namespace bisector
