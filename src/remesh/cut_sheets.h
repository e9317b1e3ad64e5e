// Surfaces that go through themselves, cut where they do.
//
// Triangles of a sheet cross those of another in the more pairs, the finer they are, and no density changes that. Where
// a surface is cut along these lines, each side of a sheet goes on along the next one: what a closed surface bounds
// becomes solids that only touch, the one around all of it and those that two sheets have between them. They are meshed
// as others that touch are (mesh/touching.h).
#pragma once

#include <cstddef>
#include <optional>

#include "bisector/context.h"
#include "bisector/repair.h"
#include "remesh/prepare.h"

namespace bisector {

struct CutSheets {
  OrderedInput input;             // the surface, welded and cut; vertex_of is of the mesh that was given first
  WeldResult welded;              // what welding did, without its mesh
  std::size_t edges = 0;          // along which parts touch
  std::size_t removed_parts = 0;  // with less area than a triangle of the result, that are left out
};

// Nothing if sheets of the surface do not cross, or if cutting leaves no manifold once what touches is separated; nor
// for surfaces with borders that meet in edges.
std::optional<CutSheets> cut_sheets(const OrderedInput& input);

}  // namespace bisector
