// The points of several trees, told from each other.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

struct PartedTrees {
  std::vector<Index> tree;  // of each point; kNone: of none
  std::vector<char> low;    // whether a point of no tree is one of a low plant; else it is far from all
  std::vector<Index> base;  // of each tree its stem's lowest point
};

// Stems are what holds out: as a level rises through the scan, parts that hang together grow and join, and a stem is a
// part that comes up near the ground, is narrow and joins another one only much higher (topological persistence;
// Edelsbrunner, Letscher and Zomorodian 2002). Each point then goes to the stem whose way to it is cheapest, as in Tao
// et al., Segmenting tree crowns from terrestrial and mobile LiDAR data by exploring ecological theories, ISPRS J. 110,
// 2015, but by the sum of squared steps (growth.h), and alike for thick and thin stems: crowns that touch are parted.
// What stands near the ground and is no stem takes part, as low plants.
//
// `points` are distinct. `heights` are those above the ground, if that is known, else above the lowest point. The same
// for any number of threads.
PartedTrees part_trees(const std::vector<Vec3>& points, const std::vector<double>& heights, bool ground_is_known,
                       const Context& context = {});

}  // namespace bisector
