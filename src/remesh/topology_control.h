// Seeds for the places where the dual is not homeomorphic to the surface (thesis 4.4.4).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "cvt/optimise.h"
#include "mesh/topology.h"
#include "remesh/feature_trace.h"
#include "voronoi/ball_property.h"

namespace bisector {

// A restricted Delaunay triangulation as a mesh: its vertices are the seeds that have triangles, in their order.
// `vertex_of` are dual_vertices of the two.
TriangleMesh dual_mesh(const std::vector<Vec3>& seeds, const Dual& dual, const std::vector<Index>& vertex_of);
TriangleMesh dual_mesh(const std::vector<Vec3>& seeds, const Dual& dual);

// Whether `dual` is manifold, oriented, closed and of Euler characteristic and components as the input.
bool same_topology(const MeshTopology& dual, const MeshTopology& input);

std::vector<TopologyFault> topology_faults(const BallReport& report, const std::vector<Vec3>& seeds);

struct TopologyOutcome {
  BallReport ball;           // of the final diagram
  int rounds = 0;            // of insertion
  std::size_t inserted = 0;  // seeds, where the property failed, over all rounds
  std::size_t removed = 0;   // seeds, elsewhere, so as to come back to the number asked for
  std::vector<Vec3> sheets;  // vertices of the dual beyond the seeds: see divide_cells
  double gap = 0;            // at which cells were divided: to do the same again for the diagram of changed seeds
};

struct TopologyControlOptions {
  bool branches = false;        // the surface branches on purpose
  bool polish_around = false;   // all but the seeds around what changes are as they should be
  Backend* stand_in = nullptr;  // of a surface on which most of the last optimisation's steps are made
};

// Inserts seeds until the topological ball property holds:
// - While an eighth of the cells fail there are too few seeds, and the optimisation runs again after each round (thesis
//   4.4.4).
// - Then without optimising, for a density that makes cells larger than the surface is thick would draw the new seeds
//   away; it ends if two dozen rounds in a row have not led to fewer failures.
// - When the property holds, seeds are removed elsewhere, as far as that gives the number asked for, and all, or those
//   around what has changed, are optimised as far as the property goes on holding.
// A curve that no cell of a seed on the surface cuts at the beginning stays so: such a cut counts as a failure, and the
// seed goes on the curve there, or another one does, as segments are split in Delaunay refinement when a point
// encroaches upon them (Ruppert 1995). `trace` is that of the run's curves.
// Cells of sheets that cross or nearly touch are divided (sheets.h): the report then names the sheets in
// TopologyOutcome::sheets by indices after those of the seeds.
//
// Seeds that are not free are never removed. Gives up after a bounded number of rounds and seeds, and then returns to
// the seeds with the fewest failures, which topology_faults lists, or to those given if an eighth of the cells fail
// with any. Where the input is not manifold and oriented, and does not branch on purpose, it may take the work of a few
// dozen steps, and seeds are as given if that does not do.
TopologyOutcome enforce_topology(CvtRun& run, const FeatureTrace& trace, const MeshTopology& input,
                                 OptimiseOptions options, const TopologyControlOptions& control = {});

}  // namespace bisector
