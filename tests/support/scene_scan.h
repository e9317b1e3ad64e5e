// Scans of scenes as a car on a street makes them: trees with touching crowns on sloping and bumpy ground, a wall
// behind them and low plants below. What each point shows is known.
#pragma once

#include <cstdint>
#include <vector>

#include "support/tree_growth.h"
#include "support/tree_scan.h"

namespace bisector::test {

// Lengths in metres.
struct SceneScanOptions {
  std::size_t trees = 3;
  double apart = 4.5;           // trunks in a row along the street, 0.8 to 1.2 times so far from each other
  std::size_t points = 60'000;  // in all, about
  bool ground = true;           // is there; else trunks begin where it would be
  double slope = 0.1;           // rise of the ground over its length, in any direction
  double bumps = 0.08;          // height of its bumps, 2 to 6 m long
  bool wall = false;            // along the street, 2 to 3.5 m behind the trunks, 6 m high
  std::size_t leaves = 0;       // on each tree
  std::size_t bushes = 0;       // low plants of 0.4 to 1 m between the trunks
  double noise = 0.008;         // standard deviation of the range
  double divergence = 0.0003;   // of the beam
  std::uint64_t random_seed = 1;
};

enum class ScenePoint : char { tree, ground, wall, bush };

struct SceneScan {
  std::vector<Vec3> points;  // z is up
  std::vector<ScenePoint> kinds;
  std::vector<Index> trees;                       // of each point; kNone: of none
  std::vector<Index> point_branches;              // in its tree
  std::vector<std::vector<AxisBranch>> branches;  // of each tree
  double noise = 0, beam = 0;                     // as in TreeScan

  TreeScan tree_alone(Index tree) const;  // its points as if nothing else were there
};

// The same seed gives the same scan.
SceneScan scan_scene(const SceneScanOptions& options);

}  // namespace bisector::test
