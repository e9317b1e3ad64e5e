// Faces on the surfaces of regions, trimmed by their borders and joined into a shell.
#pragma once

#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <cstddef>
#include <string>
#include <vector>

#include "step/trims.h"

namespace bisector::step {

struct Shell {
  TopoDS_Shape shape;               // a solid if the faces close, a shell if they hang together, or a compound
  std::vector<TopoDS_Shape> faces;  // of each region; null for a region without a face
  std::vector<std::string> flaws;   // of each region, what is wrong with its face; empty if nothing is
};

// The tolerance is that of make_edges.
Shell build_shell(const Trims& trims, double tolerance);

}  // namespace bisector::step
