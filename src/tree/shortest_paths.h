// Shortest paths in a graph with edge lengths (Dijkstra, by the Boost Graph Library).
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

struct ShortestPaths {
  std::vector<double> distance;  // of each vertex from the nearest source; infinite where no path leads
  std::vector<Index> previous;   // vertex on the path to it; a source's and an unreached vertex' is itself
};

// `lengths` has one for each value of `neighbours`, at least 0.
ShortestPaths shortest_paths(const Csr<Index>& neighbours, const std::vector<double>& lengths,
                             const std::vector<Index>& sources);

}  // namespace bisector
