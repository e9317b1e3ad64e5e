#include "bisector/voronoi/morton.h"


#include "bisector/core/parallel.h"

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

}  // namespace

std::vector<Index> morton_order(const std::vector<Vec3>& points) {
  const Box box = bounding_box(points);
  const Vec3 extent = box.hi - box.lo;
  const double side = std::max({extent.x, extent.y, extent.z});
  const double scale = side > 0 ? 2097151.0 / side : 0.0;
  std::vector<Key> keys(points.size());
  parallel_each(points.size(), [&](std::size_t i) {
    const Vec3 p = scale * (points[i] - box.lo);
    keys[i] = {spread(static_cast<std::uint64_t>(p.x)) | spread(static_cast<std::uint64_t>(p.y)) << 1 |
                   spread(static_cast<std::uint64_t>(p.z)) << 2,
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
  for (std::size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].index;
  return order;
}

}  // namespace bisector
