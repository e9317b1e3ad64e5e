// What every rank has of a diagram, together on rank 0, in the indices of the whole mesh and of all seeds. All ranks
// call these; on the others the result is left alone.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/cells.h"
#include "distributed/ranks.h"
#include "voronoi/diagram.h"

namespace bisector {

// Cells whose seeds are at home on a rank.
struct CellsOfRank {
  std::vector<Index> ids;
  std::vector<Moments> cells;
  std::vector<double> step_mass;
  Csr<Index> triangles;  // if they are wanted
};

// Of `count` seeds; those that no rank has own nothing.
void collect_cells(Ranks& ranks, const CellsOfRank& mine, std::size_t count, bool with_triangles, CellMoments& result);
// The polygons of a triangle have to be one rank's.
void collect_polygons(Ranks& ranks, RestrictedPolygons mine, RestrictedPolygons& result);
void collect_dual(Ranks& ranks, const Dual& mine, Dual& result);

}  // namespace bisector
