// Sections of a tree between levels of the distance from its root along the point graph: where clusters start.
// The levels' components are the bins of Xu, Gossett and Chen 2007; here they only tell how thick the tree is where.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct LevelSections {
  std::vector<double> distance;  // of each point from the root along the graph; infinite where no path leads
  std::vector<Index> section;    // of each point; kNone where no path leads
  std::size_t count = 0;
};

// `neighbours` is a symmetric graph. The root is what hangs together within `width` above each point of `lowest`.
// Components of slices `width` thick are joined along the tree, up to the next fork, until they are as long as thick.
LevelSections level_sections(const std::vector<Vec3>& points, const Csr<Index>& neighbours,
                             const std::vector<Index>& lowest, double width);

}  // namespace bisector
