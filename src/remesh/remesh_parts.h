// Remeshing a surface that is too large for one process.
#pragma once

#include <cstddef>
#include <string>

#include "bisector/context.h"
#include "bisector/remesh.h"
#include "distributed/parts.h"

namespace bisector {

// Steps on the surface itself, at most; those before are as many as the options allow.
inline constexpr int kIterationsOnAll = 30;

struct PartsResult {
  TriangleMesh mesh;
  MeshTopology topology;
  std::size_t input_vertices = 0, input_triangles = 0;
  double area = 0;  // of the input
  std::size_t stand_in_triangles = 0;
  int iterations = 0;           // accepted steps, the last ones on the surface itself
  int iterations_on_all = 0;    // of these
  double energy = 0;            // CVT energy of the final seeds
  std::size_t untiled = 0;      // triangles that fail the tiling check of the final diagram: 0, or the run is wrong
  Certification certification;  // of the final diagram
  BackendDescription device;
  std::vector<PartFigures> ranks;
  double seconds_reading = 0, seconds_stand_in = 0, seconds_on_all = 0;
};

// Seeds find their places on a surface of fewer triangles (see DividedSurface::stand_in), then on the PLY file's own,
// of which each rank of the run has a part; the result is the dual of their diagram on that. Edges are of one length,
// features other than borders are not looked for, and topology is not compared. The bytes do not tell how many ranks
// there are. Of the options the number of vertices, the random seed, iterations, tolerance, levels, energy and the
// source of neighbours count. Throws Error and Cancelled.
PartsResult remesh_parts(const std::string& path, const RemeshOptions& options, const Context& context = {});

}  // namespace bisector
