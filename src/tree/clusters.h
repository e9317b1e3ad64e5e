// K-means clusters of a point cloud that hang together and are cylinders where the tree has no fork (thesis 3.2).
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/cylinder.h"

namespace bisector {

struct ClusterOptions {
  std::size_t most = 0;        // clusters; 0: no bound
  double delta = 0.004;        // a tight cluster's points lie so near its cylinder, rms, in the points' unit
  std::size_t max_points = 0;  // tight clusters of more are split too; 0: no bound
  int iterations = 10;         // of Lloyd's in each round, at most
};

struct Clusters {
  std::vector<Index> label;  // of each point; kNone where `start` has none
  std::vector<BranchCylinder> cylinders;
  std::vector<char> fixed;  // of each cluster: tight
};

// From the clusters `start` (of each point; numbers from 0 on without gaps, kNone: left out) by distortion-minimising
// flooding over `neighbours` and Lloyd's iteration: each cluster floods from the point that suits it best. The energy
// of a point is its squared distance from the cluster's circle (about the axis, in the middle, of the cylinder's
// radius), which for thin clusters is the thesis' distance from the centre, and lets one cluster go all around a thick
// branch. `distance` rises from the root on: clusters' axes follow it. Tight clusters are fixed; others split at the
// point farthest from their seed, and all that are not fixed are flooded again, until none can be split.
Clusters cluster_points(const std::vector<Vec3>& points, const Csr<Index>& neighbours, const std::vector<Index>& start,
                        const std::vector<double>& distance, const ClusterOptions& options,
                        const Context& context = {});

}  // namespace bisector
