// Curves of border chains for OpenCASCADE.
#pragma once

#include <TopoDS_Edge.hxx>
#include <vector>

#include "step/trims.h"

namespace bisector::step {

// An edge for each chain, with common vertices where chains meet: a line or an arc of a circle where that is within the
// tolerance of both surfaces and near the chain, else a B-spline, at worst a polyline. It runs where the surfaces
// beside the chain meet. The tolerance 0 stands for the larger root mean square distance of the two regions, at least
// 1e-5 of the diagonal.
// Chains that are `along_mesh` keep to the mesh's border instead, whatever the surfaces say.
std::vector<TopoDS_Edge> make_edges(const Trims& trims, double tolerance, const std::vector<char>& along_mesh);

}  // namespace bisector::step
