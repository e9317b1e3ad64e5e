// What bisecting edges makes of them.
#pragma once

#include <array>
#include <vector>

#include "bisector/features.h"
#include "core/geometry.h"

namespace bisector {

// Lower end, upper end and middle of every bisected edge, halves of edges included; ascending.
using EdgeSplits = std::vector<std::array<Index, 3>>;

// The vertices along an original edge, from a to b.
std::vector<Index> edge_chain(const EdgeSplits& splits, Index a, Index b);

// The graph on the mesh after the splits.
FeatureGraph split_features(const FeatureGraph& graph, const EdgeSplits& splits);

}  // namespace bisector
