// A hierarchy of bounding boxes over points in a spatial order, for range and nearest queries.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// Leaves hold runs of consecutive points, so a good order (hilbert.h) is all the building there is.
class SeedTree {
 public:
  static constexpr std::size_t kLeaf = 8;

  // The points must outlive the tree.
  void build(const std::vector<Vec3>& points);

  std::size_t leaves() const { return levels_.empty() ? 0 : levels_[0].size(); }
  const Box& leaf_box(std::size_t leaf) const { return levels_[0][leaf]; }
  // Appends the indices of all points within `radius` of the box, and some of the others.
  void near(const Box& box, double radius, std::vector<Index>& indices) const;
  // The index of a point whose distance to q is the least up to rounding. There must be a point.
  Index nearest(const Vec3& q) const;

  // Gives each point a value of at least 0.
  void set_values(std::vector<double> values);
  // The largest value of a point less what is between the point and the `radius` around the box, up to rounding; or 0.
  double largest_within(const Box& box, double radius) const;

 private:
  static constexpr std::size_t kArity = 4;

  void descend(std::size_t level, std::size_t node, const Box& box, double squared, std::vector<Index>& indices) const;
  void descend(std::size_t level, std::size_t node, const Vec3& q, double& squared, Index& best) const;
  void descend(std::size_t level, std::size_t node, const Box& box, double radius, double& largest) const;

  const std::vector<Vec3>* points_ = nullptr;
  std::vector<std::vector<Box>> levels_;  // from the leaves up to the root; node i has the children kArity i, ...
  std::vector<double> values_;
  std::vector<std::vector<double>> largest_;  // value below each node
};

}  // namespace bisector
