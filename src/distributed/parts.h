// A surface that no rank ever holds all of: each reads a range of the file, and they pass triangles to where these are.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "bisector/mesh.h"
#include "distributed/part_diagram.h"
#include "distributed/ranks.h"

namespace bisector {

struct DividedSurface {
  std::unique_ptr<PartDiagram> part;        // this rank's
  std::size_t vertices = 0, triangles = 0;  // of the file
  double area = 0;                          // the same for any number of ranks
  // On rank 0: a surface of far fewer triangles near this one, for seeds to find their places on. All vertices in a
  // cube of a grid are joined in the first of them (Rossignac and Borrel 1993), so that it has holes, fins and folds.
  TriangleMesh stand_in;
};

// All ranks read the PLY file, which each of them has to find under this name. The grid's cubes are two thirds of an
// edge of a mesh of `wanted` vertices. Throws Error for what PlyParts does not take, and for a surface without area.
DividedSurface read_divided(Ranks& ranks, const std::string& path, std::size_t wanted);

}  // namespace bisector
