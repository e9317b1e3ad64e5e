// Triangles that share an edge.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct DualGraph {
  Csr<Index> neighbours;  // of each triangle, ascending; all pairs of triangles at an edge of more than two
  std::vector<double>
      edge_length;              // of the edge shared with each neighbour, as in `neighbours`; several shared ones added
  double mean_edge_length = 0;  // over the mesh's edges
};

DualGraph dual_graph(const std::vector<Triangle>& triangles, const std::vector<Vec3>& vertices);

// Components connected through the graph within equal labels (or at all, if there are none), numbered from 0 by lowest
// triangle.
std::vector<Index> connected_parts(const DualGraph& graph, const std::vector<Index>& labels = {});

// Length of the edges between triangles of different labels.
double border_length(const DualGraph& graph, const std::vector<Index>& labels);

}  // namespace bisector
