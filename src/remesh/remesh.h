// Remeshing the surface of a backend (bisector/remesh.h is what users call).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "backend/backend.h"
#include "bisector/remesh.h"

namespace bisector {

// What remeshing takes once the domain is made: surface, density and features are given beside it.
struct RemeshPlan {
  std::size_t vertices = 0;  // wanted; not heeded if there are seeds
  std::vector<Vec3> seeds;   // start from these, in one level; topology control may add as many as it takes
  // Of each seed; those on features are there already. Empty: features get seeds of their own.
  std::vector<SeedPlace> places = {};
  std::vector<char> held = {};  // of each corner of the features, whether its seed never leaves it; empty: none is
  std::uint64_t random_seed = 1;
  int iterations = 100;  // as in RemeshOptions, like those that follow
  double tolerance = 1e-6;
  int levels = 0;
  bool constrained = true;  // seeds end on the surface (CCVT)
  bool noisy = false;       // its normals say nothing: the result is fitted
  TopologyControl topology = TopologyControl::enforce;
  bool branches = false;  // sheets are meant to meet in edges: topology is controlled there, too
  double min_angle = 40;
  bool fit = false;
  // The pairs of the surface's triangles that cross, asked for where the result's do: more of these are mended. Empty:
  // none are.
  std::function<std::size_t()> crossings = {};
};

// What of the options is left then. Energy::automatic means constrained.
RemeshPlan plan_of(const RemeshOptions& options);

// Makes a backend like the run's own for another surface, which must outlive it.
using MakeBackend = std::function<std::unique_ptr<Backend>(const Surface&)>;

// With `make_backend` seeds that are far from their final places are optimised on surfaces of fewer triangles. Throws
// as the public remesh(): for fewer than 4 vertices, a number of places other than that of seeds, DeviceError,
// Cancelled.
RemeshResult remesh(Backend& backend, const FeatureGraph& features, const RemeshPlan& plan, const Context& context = {},
                    const MakeBackend& make_backend = {});

// Remeshes the walls of a solid of several parts, sheets that meet in edges, with seeds on the walls: as the public
// remesh(), but what touches stays joined, nothing is welded or taken for noise, and topology is enforced where sheets
// meet as elsewhere.
RemeshResult remesh_walls(const TriangleMesh& walls, const RemeshOptions& options, const Context& context = {});

}  // namespace bisector
