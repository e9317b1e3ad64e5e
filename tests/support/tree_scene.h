// What a laser meets: the surfaces of branches, leaves and the ground.
#pragma once

#include <limits>
#include <vector>

#include "support/tree_growth.h"

namespace bisector::test {

struct LeafDisc {
  Vec3 centre, normal;  // of length 1
  double radius = 0;
};

struct SceneHit {
  double range = std::numeric_limits<double>::infinity();  // from the ray's origin; infinite: nothing
  Index branch = kNone, leaf = kNone;                      // kNone both: the ground, or nothing
};

// A tree of boxes over the pieces of branches between points of their axes, with round ends, and over the leaves.
class TreeScene {
 public:
  TreeScene(const std::vector<AxisBranch>& branches, const std::vector<LeafDisc>& leaves);

  // The first surface that a ray meets from outside. `direction` has length 1.
  SceneHit first_hit(const Vec3& origin, const Vec3& direction) const;
  // The lowest number of a leaf that it meets before `range`, kNone if there is none.
  Index first_leaf(const Vec3& origin, const Vec3& direction, double range) const;

  const Box& box() const { return nodes_[0].box; }  // of all

 private:
  struct Piece {
    Vec3 a, b;
    double radius_a = 0, radius_b = 0;  // of a leaf: a its centre, b its normal
    Index branch = kNone, leaf = kNone;
  };
  struct Node {
    Box box;
    Index first = 0, count = 0;  // pieces; none: the children are the next node and `second`
    Index second = 0;
  };
  Index build(std::size_t first, std::size_t last, std::vector<Box>& boxes);
  static double hit(const Piece& piece, const Vec3& origin, const Vec3& direction);
  template <class Visit>
  void walk(const Vec3& origin, const Vec3& direction, double& range, const Visit& visit) const;

  std::vector<Piece> pieces_;
  std::vector<Node> nodes_;
};

}  // namespace bisector::test
