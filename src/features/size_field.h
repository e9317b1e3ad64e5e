// Lengths given at points, extended to all of space with a bounded gradient.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// h(x) = min over k of h_k + gradation |x - p_k|, the largest field that is at most h_k at p_k and obeys |h(x) - h(y)|
// <= gradation |x - y| (Alliez et al. 2005, "Variational tetrahedral meshing", section 4), with Euclidean distances:
// the cells that meet this field are Euclidean, too, and one that is large beside a fine sheet reaches through to it,
// however far away it is along the surface or through the solid. It also needs no connectivity.
class SizeField {
 public:
  // One length per point, at least one, finite; gradation > 0.
  SizeField(const std::vector<Vec3>& points, const std::vector<double>& lengths, double gradation);

  double gradation() const { return gradation_; }
  double operator()(const Vec3& x) const;
  // The lesser of h and `most`, which is found sooner where h is more than that. `near` is the index of a sample that
  // limited h nearby, or 0; the search starts there, and leaves the one that limits h here.
  double at_most(const Vec3& x, double most, Index& near) const;
  // h at each point. `near`, if as long as the points, says for each a sample that limited it before, and is written
  // likewise: the search is quicker from there.
  std::vector<double> at(const std::vector<Vec3>& points, std::vector<Index>& near) const;

 private:
  static constexpr std::size_t kLeaf = 8, kArity = 4;
  struct Node {
    Box box;
    double least = 0;
  };

  void descend(std::size_t level, std::size_t i, const Vec3& q, double& best, Index& at) const;

  double gradation_;
  std::vector<Vec3> points_;  // in a spatial order
  std::vector<double> lengths_;
  std::vector<std::vector<Node>> levels_;  // boxes over the points, with the least length in each
};

// h(x) = max over k of h_k - gradation |x - p_k|, the smallest field that is at least h_k at p_k and obeys the same
// bound: 0 or less far from all points.
class SizeFloor {
 public:
  SizeFloor(const std::vector<Vec3>& points, const std::vector<double>& lengths, double gradation);

  double operator()(const Vec3& x) const { return longest_ - below_(x); }

 private:
  double longest_;
  SizeField below_;  // the longest length less h
};

// The field's values at its own points.
std::vector<double> limit_gradation(const std::vector<Vec3>& points, const std::vector<double>& lengths,
                                    double gradation);

}  // namespace bisector
