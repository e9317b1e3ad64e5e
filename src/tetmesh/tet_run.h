// What the phases of a tetrahedral meshing run have in common: the solid, what is asked for, and the account of the
// run.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "bisector/tetmesh.h"
#include "cvt/optimise.h"
#include "features/curves.h"
#include "tetmesh/tet_sizing.h"

namespace bisector {

struct TetRun {
  SolidBackend& solid;
  Backend& boundary;  // of the solid, with a density of its own
  const FeatureGraph& features;
  const FeatureCurves& curves;  // of those
  const SizedSolid& sized;
  const TetOptions& options;
  const Context& context;
  std::size_t wanted = 0;  // vertices

  OptimiseTotals totals = {};
  double seconds_boundary = 0;  // spent on remeshing the boundary
  double done = 0;              // fraction of the whole run, for progress
};

// Moves the sites downhill, by at most this share of the steps that the whole run is allowed. `constrained`: those on
// the surface stay there. The state is then complete for `backend`.
void optimise_sites(TetRun& run, Backend& backend, CvtState& state, const std::string& phase, double share, bool constrained);

// A new state of sites that all are inside.
CvtState inner_sites(std::vector<Vec3> seeds);

// The sites inside, without those on the boundary.
std::vector<Vec3> inner_seeds(const CvtState& state);

// The boundary's vertices, then the sites inside.
CvtState with_boundary(const RemeshResult& surface, const std::vector<Vec3>& inner);

// Sites inside that own a part of the boundary, ascending. `state.moments` must be those of the sites.
std::vector<Index> inner_sites_at_boundary(const CvtState& state);

}  // namespace bisector
