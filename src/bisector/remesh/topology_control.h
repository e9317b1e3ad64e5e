// Seeds for the places where the dual is not a manifold like the input (thesis 4.4.4).
#pragma once

#include <vector>

#include "bisector/cvt/optimise.h"
#include "bisector/mesh/topology.h"

namespace bisector {

// The restricted Delaunay triangulation with the seeds that have triangles as vertices, in their order.
TriangleMesh dual_mesh(const std::vector<Vec3>& seeds, const RestrictedPolygons& polygons);

// Whether `dual` is manifold and oriented, and closed and of Euler characteristic and components as the input.
bool same_topology(const MeshTopology& dual, const MeshTopology& input);

// While the dual differs in topology from a manifold input: moves seeds from where they are densest to the cells that break
// it, and optimises again; where that does not do, adds seeds there (thesis 4.4.4). Gives up after a bounded number of rounds,
// and then goes back to the seeds with the fewest broken cells.
// `polygons` and state.moments are those of the final seeds.
void enforce_topology(Backend& backend, CvtState& state, RestrictedPolygons& polygons, const MeshTopology& input,
                      OptimiseOptions options, OptimiseTotals& totals, const Context& context);

}  // namespace bisector
