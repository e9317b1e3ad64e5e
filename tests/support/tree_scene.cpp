#include "support/tree_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace bisector::test {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr std::size_t kPiecesPerNode = 4;

// The lower root of a t^2 + 2 b t + c that `allowed` accepts, or the upper one.
template <class Allowed>
double first_root(double a, double b, double c, const Allowed& allowed) {
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0) || a == 0) return kNothing;
  const double root = std::sqrt(discriminant);
  double near = (-b - root) / a, far = (-b + root) / a;
  if (near > far) std::swap(near, far);
  if (allowed(near)) return near;
  return allowed(far) ? far : kNothing;
}

// Whether a ray meets a box before `range`, and where it enters.
double enters(const Box& box, const Vec3& origin, const Vec3& inverse, double range) {
  double near = 0, far = range;
  for (int k = 0; k < 3; ++k) {
    const double a = (box.lo[k] - origin[k]) * inverse[k], b = (box.hi[k] - origin[k]) * inverse[k];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return near <= far ? near : kNothing;
}

}  // namespace

TreeScene::TreeScene(const std::vector<AxisBranch>& branches, const std::vector<LeafDisc>& leaves) {
  std::vector<Box> boxes;
  const auto add = [&](const Piece& piece, const Vec3& other, double reach) {
    Box box = bounding_box({piece.a, other});
    for (int k = 0; k < 3; ++k) box.lo[k] -= reach, box.hi[k] += reach;
    boxes.push_back(box);
    pieces_.push_back(piece);
  };
  for (std::size_t b = 0; b < branches.size(); ++b)
    for (std::size_t i = 0; i + 1 < branches[b].axis.size(); ++i) {
      const Piece piece{branches[b].axis[i], branches[b].axis[i + 1], branches[b].radii[i], branches[b].radii[i + 1],
                        static_cast<Index>(b)};
      add(piece, piece.b, std::max(piece.radius_a, piece.radius_b));
    }
  for (std::size_t l = 0; l < leaves.size(); ++l)
    add({leaves[l].centre, leaves[l].normal, leaves[l].radius, 0, kNone, static_cast<Index>(l)}, leaves[l].centre,
        leaves[l].radius);
  build(0, pieces_.size(), boxes);
}

Index TreeScene::build(std::size_t first, std::size_t last, std::vector<Box>& boxes) {
  const auto name = static_cast<Index>(nodes_.size());
  Box box = boxes[first];
  for (std::size_t i = first; i < last; ++i)
    for (int k = 0; k < 3; ++k) {
      box.lo[k] = std::min(box.lo[k], boxes[i].lo[k]);
      box.hi[k] = std::max(box.hi[k], boxes[i].hi[k]);
    }
  nodes_.push_back({box, static_cast<Index>(first), static_cast<Index>(last - first), 0});
  if (last - first <= kPiecesPerNode) return name;
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (box.hi[k] - box.lo[k] > box.hi[axis] - box.lo[axis]) axis = k;
  std::vector<std::size_t> order(last - first);
  std::iota(order.begin(), order.end(), first);
  const std::size_t half = order.size() / 2;
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](std::size_t i, std::size_t j) {
                     const double a = boxes[i].lo[axis] + boxes[i].hi[axis], b = boxes[j].lo[axis] + boxes[j].hi[axis];
                     return a != b ? a < b : i < j;
                   });
  std::vector<Piece> pieces;
  std::vector<Box> moved;
  for (const std::size_t i : order) {
    pieces.push_back(pieces_[i]);
    moved.push_back(boxes[i]);
  }
  std::copy(pieces.begin(), pieces.end(), pieces_.begin() + static_cast<std::ptrdiff_t>(first));
  std::copy(moved.begin(), moved.end(), boxes.begin() + static_cast<std::ptrdiff_t>(first));
  build(first, first + half, boxes);
  const Index second = build(first + half, last, boxes);
  nodes_[name].count = 0;
  nodes_[name].second = second;
  return name;
}

double TreeScene::hit(const Piece& piece, const Vec3& origin, const Vec3& direction) {
  // From the point of the ray that is nearest to the piece, for it is small and far.
  const double ahead = dot(piece.a - origin, direction);
  const Vec3 p = origin + ahead * direction - piece.a;
  const auto in_front = [&](double t) { return t + ahead > 0; };
  if (piece.leaf != kNone) {
    const double slope = dot(direction, piece.b);
    if (slope == 0) return kNothing;
    const double t = -dot(p, piece.b) / slope;
    return in_front(t) && norm2(p + t * direction) <= piece.radius_a * piece.radius_a ? ahead + t : kNothing;
  }
  // On the surface the distance from the point s of the axis, the nearest one, is the radius there. All but the
  // distance is linear in t.
  const Vec3 along = piece.b - piece.a;
  const double length = norm2(along);
  const double s0 = dot(p, along) / length, s1 = dot(direction, along) / length;
  const Vec3 q0 = p - s0 * along, q1 = direction - s1 * along;
  const double slope = piece.radius_b - piece.radius_a, r0 = piece.radius_a + s0 * slope, r1 = s1 * slope;
  double least = first_root(norm2(q1) - r1 * r1, dot(q0, q1) - r0 * r1, norm2(q0) - r0 * r0, [&](double t) {
    const double s = s0 + t * s1;
    return s >= 0 && s <= 1 && in_front(t);
  });
  least = std::min(least, first_root(1, dot(p, direction), norm2(p) - piece.radius_a * piece.radius_a,
                                     [&](double t) { return s0 + t * s1 <= 0 && in_front(t); }));
  const Vec3 end = p - along;
  least = std::min(least, first_root(1, dot(end, direction), norm2(end) - piece.radius_b * piece.radius_b,
                                     [&](double t) { return s0 + t * s1 >= 1 && in_front(t); }));
  return ahead + least;
}

template <class Visit>
void TreeScene::walk(const Vec3& origin, const Vec3& direction, double& range, const Visit& visit) const {
  const Vec3 inverse{1 / direction.x, 1 / direction.y, 1 / direction.z};
  std::array<Index, 64> waiting;
  std::size_t count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const Index name = waiting[--count];
    const Node& node = nodes_[name];
    if (enters(node.box, origin, inverse, range) == kNothing) continue;
    if (node.count > 0) {
      for (Index i = node.first; i < node.first + node.count; ++i) visit(pieces_[i]);
      continue;
    }
    const double left = enters(nodes_[name + 1].box, origin, inverse, range),
                 right = enters(nodes_[node.second].box, origin, inverse, range);
    waiting[count++] = left < right ? node.second : name + 1;
    waiting[count++] = left < right ? name + 1 : node.second;
  }
}

SceneHit TreeScene::first_hit(const Vec3& origin, const Vec3& direction) const {
  SceneHit first;
  walk(origin, direction, first.range, [&](const Piece& piece) {
    const double range = hit(piece, origin, direction);
    if (range < first.range) first = {range, piece.branch, piece.leaf};
  });
  return first;
}

Index TreeScene::first_leaf(const Vec3& origin, const Vec3& direction, double range) const {
  Index first = kNone;
  walk(origin, direction, range, [&](const Piece& piece) {
    if (piece.leaf < first && hit(piece, origin, direction) < range) first = piece.leaf;
  });
  return first;
}

}  // namespace bisector::test
