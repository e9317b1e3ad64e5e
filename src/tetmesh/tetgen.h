// Tetrahedra of a closed surface by TetGen (Si, TetGen, a Delaunay-based quality tetrahedral mesh generator, ACM TOMS
// 2015), which runs in a child process: it is AGPL, and it crashes on some inputs.
#pragma once

#include <string>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

struct TetgenOptions {
  double time_limit = 600;  // seconds; 0: none
  std::string program;      // path of bisector-tetgen; empty: find_tetgen
};

struct TetgenResult {
  // The surface's vertices, then TetGen's own, all inside; a region number from 1 for each part of the
  // solid if there are several; the surface's triangles, labels and feature edges as marks.
  TetMesh mesh;
  std::size_t steiner_points = 0;
  std::size_t zero_volume = 0;  // tetrahedra whose corners are exactly coplanar
};

// Where the child program is: $BISECTOR_TETGEN, else `bisector-tetgen` beside the library or the running executable or
// in the bin/ of either's prefix, else where the build installs it; empty if it is nowhere.
std::string find_tetgen();

// Tetrahedra inside a closed surface, as check_surface gives it, whose boundary facets are exactly the surface's
// triangles, with no point added on it (TetGen's -pY). Coordinates stay the same bits; vertices that no triangle uses
// are kept at their index without tetrahedra.
//
// Throws Cancelled, and Error if the program is missing, crashes, takes longer or more memory than there is, or gives
// what is not such a mesh; each tells what to do.
TetgenResult tetgen_tets(const TriangleMesh& surface, const TetgenOptions& options = {}, const Context& context = {});

// The same for walls, as check_walls gives them: tetrahedra in every part of space that they enclose, with a region for
// each, if there are several. Regions are numbered from 1 by the first triangles that bound them; of two at the same
// triangle the one that it faces away from comes first. Throws Error as well if both sides of a triangle are in one
// part.
TetgenResult tetgen_regions(const TriangleMesh& walls, const TetgenOptions& options = {}, const Context& context = {});

}  // namespace bisector
