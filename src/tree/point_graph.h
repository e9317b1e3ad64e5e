// The graph of nearest neighbours of a point cloud (thesis 3.2.1).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct PointGraph {
  Csr<Index> neighbours;         // symmetric, ascending: each point's nearest ones and those it is a nearest one of
  std::vector<Index> component;  // of each point; numbered by the lowest point in it
  std::size_t components = 0;
  double spacing = 0;  // median distance of a point from its k-th nearest, in the points' unit
};

// Each point is joined to its `k` nearest. Throws Error for fewer than two points and for coordinates that are not
// finite. The same for any number of threads.
PointGraph build_point_graph(const std::vector<Vec3>& points, std::size_t k = 8);

// An edge between two components.
struct Bridge {
  Index from = 0, to = 0;  // points
  double length = 0;
};

// The minimum spanning tree of the components under their shortest gaps, as edges between points, shortest first
// (Boruvka 1926). The graph is left as it is.
std::vector<Bridge> shortest_bridges(const std::vector<Vec3>& points, const PointGraph& graph);

// The graph with edges added.
Csr<Index> add_edges(const Csr<Index>& neighbours, const std::vector<std::array<Index, 2>>& edges);

// A connected graph over distinct points that holds all shortest ways by the sum of squared steps: Delaunay's
// neighbours, or where there are none, as of points in a plane, the nearest ones with bridges.
Csr<Index> ways_graph(const std::vector<Vec3>& points);

}  // namespace bisector
