// Trees whose branches are known: axes with radii.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/geometry.h"
#include "support/models.h"

namespace bisector::test {

// A branch as its axis from a point on its parent's axis (a trunk: from the ground) to the tip. Its surface is where
// the distance from the axis is the radius at the nearest point of the axis.
struct AxisBranch {
  std::vector<Vec3> axis;
  std::vector<double> radii;  // one for each point of the axis
  Index parent = kNone;       // branch; kNone: a trunk
};

// Lengths in metres, angles in radians.
struct TreeGrowth {
  Vec3 base{12, -7, 3};        // where the trunk leaves the ground
  double height = 10;          // of the trunk's axis, along it
  double trunk_radius = 0.25;  // at the base
  double pipe = 2.3;           // exponent of the pipe model
  // r^pipe of a branch without children, in units that the trunk's radius scales: at its tip, and what is added at its
  // base, for every branch and for each metre.
  double tip = 1, along = 1.5, along_metre = 0;
  double lean = 0;             // of the trunk off the vertical at its base
  double fork = 0;             // share of the trunk's length where it forks into two stems; 0: it does not
  double crown_base = 0.2;     // share of the trunk's length where the boughs begin
  double crown_radius = 0.42;  // length of the longest boughs, of the height
  double conical = 0;          // 0: the longest boughs are halfway up, 1: they are the lowest
  double low_angle = 75 * kRadiansPerDegree, high_angle = 45 * kRadiansPerDegree;  // boughs off the trunk
  std::size_t boughs = 16;                                                         // on the trunk
  std::size_t twigs = 4;                                                           // on each of them, at most
  std::size_t shoots = 0;                                                          // on each of these, at most
};

// Another height (5 to 15 m), stature, habit and number of branches for every seed; twigs end some millimetres thick.
TreeGrowth varied_growth(std::uint64_t random_seed);

// A trunk, boughs, twigs and shoots on curved axes, parents before children, the trunk first. Radii follow a pipe
// model, r^pipe adding up over the branches beyond (Leonardo's rule has the exponent 2), so children are thinner than
// their parents; at every fork the branch that goes on is also the longest path to a tip; branches that are not each
// other's parent keep a distance.
std::vector<AxisBranch> grow_tree(const TreeGrowth& growth, SplitMix64& random);

double tree_height(const std::vector<AxisBranch>& branches);  // of the first trunk's base below the highest tip

struct NearOnAxis {
  double distance = std::numeric_limits<double>::infinity();
  double place = 0;   // index of the point of the axis, with its share to the next
  double radius = 0;  // there
};
NearOnAxis nearest_on_axis(const AxisBranch& branch, const Vec3& p);

double axis_length(const std::vector<Vec3>& axis);

// In the plane across `a`, at an angle from an arbitrary direction in it.
Vec3 across(const Vec3& a, double angle);

double gaussian(SplitMix64& random);  // of deviation 1

}  // namespace bisector::test
