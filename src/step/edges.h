// Curves of border chains for OpenCASCADE.
#pragma once

#include <TopoDS_Edge.hxx>
#include <vector>

#include "step/trims.h"

namespace bisector::step {

// An edge for each chain, with common vertices where chains meet: a line or an arc of a circle where that is within the
// tolerance of all points and of both surfaces, else a B-spline near the points, at worst their polyline. Points are
// moved to where the surfaces beside the chain meet.
std::vector<TopoDS_Edge> make_edges(const Trims& trims, double tolerance);

}  // namespace bisector::step
