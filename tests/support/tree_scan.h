// Sparse scans of a tree as laser scanners make them: rays, the first surface that each of them meets, a beam that is
// not thin, and errors of its range.
#pragma once

#include <cstdint>
#include <vector>

#include "support/tree_growth.h"
#include "support/tree_scene.h"

namespace bisector::test {

enum class ScanPath {
  one_side,  // a tripod 0.8 to 1.3 tree's heights away, with equal steps in azimuth and elevation
  street,    // a car on a straight line 5 to 8 m away, 2 m above the ground, with vertical profiles across its way
  airborne   // three parallel lines 40 to 50 m above the ground, 12 m from each other, with profiles across them
};

// Lengths in metres.
struct TreeScanOptions {
  ScanPath path = ScanPath::one_side;
  std::size_t points = 20'000;  // of the tree, wood and leaves; there are 0.9 to 1.1 times as many
  double noise = 0.008;         // standard deviation of the range
  double beam = 0.005;          // diameter of the beam where it leaves the scanner
  double divergence = 0.0003;   // what it grows by for each metre
  double mixed = 0.3;           // share of the pulses whose range is that of two places of the beam, if they are near
  double leaves = 0;            // share of the tree's points
  bool ground = false;          // points of the ground within 3 m of the trunk
  bool neighbour = false;       // a second tree, whose points come on top
  std::uint64_t random_seed = 1;
};

enum class PointKind : char { wood, leaf, ground };

struct TreeScan {
  std::vector<Vec3> points;   // z is up
  std::vector<Vec3> origins;  // where the scanner was
  std::vector<PointKind> kinds;
  std::vector<Index> point_branches;  // kNone: no wood
  std::vector<AxisBranch> branches;   // parents before children; the first is the trunk, a neighbour's come last
  std::size_t tree_branches = 0;      // those that are not a neighbour's
  std::vector<LeafDisc> leaves;
  double height = 0;  // of the first tree
  double noise = 0;   // standard deviation of the range
  double beam = 0;    // largest radius of the beam where it met something
};

// A tree as varied_growth(random_seed) has it. A pulse's range is that from the scanner to the first surface along a
// ray that is drawn within the beam, with noise, and its point lies so far along the middle of the beam. Leaves are
// discs of 20 to 50 mm in radius up to 0.3 m off twigs thinner than a tenth of the trunk. The same seed gives the same
// scan.
TreeScan scan_tree(const TreeScanOptions& options);

// Leaves around thin twigs, in no order.
std::vector<LeafDisc> grow_leaves(const std::vector<AxisBranch>& branches, std::size_t count, SplitMix64& random);

}  // namespace bisector::test
