// The part of space that each rank is at home in.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// Half-open boxes that fill space, one for each rank: the leaves of a k-d tree. Outer sides are infinitely far.
class Regions {
 public:
  // Divides the points so that each of `count` regions has about the same weight. A region may have none where many
  // points are the same.
  Regions(const std::vector<Vec3>& points, const std::vector<double>& weights, int count);
  // From the words of another.
  struct Node {
    int axis;
    int children[2];  // below `at`, and not; a node, or a region as its complement
    double at;
  };
  explicit Regions(std::vector<Node> nodes);

  const std::vector<Node>& nodes() const { return nodes_; }
  int at(const Vec3& p) const;
  const Box& box(int region) const { return boxes_[static_cast<std::size_t>(region)]; }

 private:
  void set_boxes();

  std::vector<Node> nodes_;  // the first is the root; there is none for a single region
  std::vector<Box> boxes_;
};

}  // namespace bisector
