// What the phases of a tetrahedral meshing run have in common: the run of its sites, what is asked for, and the
// account.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "bisector/tetmesh.h"
#include "cvt/optimise.h"
#include "cvt/run.h"
#include "remesh/remesh.h"
#include "tetmesh/tet_sizing.h"

namespace bisector {

struct TetRun {
  CvtRun sites;  // in the solid, or in what stands in for it while they are free
  SolidBackend& solid;
  Backend& boundary;  // of the solid, with a density of its own
  const FeatureGraph& features;
  const SizedSolid& sized;
  const TetOptions& options;
  MakeBackend make_backend;     // for surfaces that stand in for the boundary at first
  std::size_t wanted = 0;       // vertices
  double seconds_boundary = 0;  // spent on remeshing the boundary
  double done = 0;              // fraction of the whole run, for progress
};

// Moves the sites downhill, by at most this share of the steps that the whole run is allowed. `constrained`: those on
// the surface stay there.
void optimise_sites(TetRun& run, const std::string& phase, double share, bool constrained);

// The boundary's vertices, then the sites inside.
PlacedSeeds with_boundary(const RemeshResult& surface, const std::vector<Vec3>& inside);

// Sites inside that own a part of the boundary, ascending; `triangles` are those that each cell meets.
std::vector<Index> inner_sites_at_boundary(const PlacedSeeds& seeds, const Csr<Index>& triangles);

}  // namespace bisector
