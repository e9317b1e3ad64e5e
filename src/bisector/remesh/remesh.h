// Isotropic surface remeshing by centroidal Voronoi tessellation (thesis, chapter 4).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bisector/core/context.h"
#include "bisector/core/types.h"
#include "bisector/cvt/compute.h"
#include "bisector/mesh/topology.h"
#include "bisector/voronoi/restricted.h"

namespace bisector {

enum class TopologyControl {
  enforce,  // move seeds to where the dual is not a manifold like the input, or add some, and optimise again
  check,    // report only
  off,
};

enum class Energy {
  constrained,  // seeds end on the surface (CCVT)
  restricted,   // seeds may leave the surface (RCVT)
};

struct RemeshOptions {
  std::size_t vertices = 0;                // wanted; at least 4
  std::vector<Vec3> seeds;                 // start from these instead of random ones, in one level; empty: random
  std::uint64_t random_seed = 1;
  int iterations = 100;                    // at most, per level; fewer on the coarsest and the finest of several
  double tolerance = 1e-6;                 // a level ends when the energy falls by less than this share per step
  int levels = 0;                          // of the multilevel start; 0: as many as the count allows, at most 3
  Energy energy = Energy::constrained;
  TopologyControl topology = TopologyControl::enforce;
  ComputeOptions compute;
  unsigned threads = 0;                    // 0: all cores
};

struct RemeshSeconds {
  double total = 0, lbfgs = 0, extract = 0;
  DiagramSeconds diagrams;        // of the optimiser, summed over its evaluations
};

struct RemeshResult {
  TriangleMesh mesh;              // the restricted Delaunay triangulation of the seeds that own a cell
  MeshTopology topology;          // of mesh
  MeshTopology input_topology;
  bool topology_matches = false;  // manifold, and closed and of Euler characteristic and components as the input
  int iterations = 0;             // accepted steps, all levels
  int evaluations = 0;
  double energy = 0;              // CVT energy of the final seeds
  double gradient_norm = 0;       // Euclidean norm over all seeds (tangential where constrained)
  Certification certification;    // of the final diagram
  std::size_t untiled = 0;        // triangles that fail the tiling check of the final diagram: 0, or the run is wrong
  BackendDescription device;      // that computed the final diagram
  RemeshSeconds seconds;
};

// Remeshes a surface with `options.vertices` vertices. Throws Error on input without area or fewer than 4 vertices, DeviceError
// if the device asked for is missing or fails, and Cancelled.
RemeshResult remesh(const TriangleMesh& input, const RemeshOptions& options, const Context& context = {});

// The same of a backend's surface, with no heed to `options.compute`.
RemeshResult remesh(Backend& backend, const RemeshOptions& options, const Context& context = {});

}  // namespace bisector
