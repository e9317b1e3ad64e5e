// Keeping seeds on the surface: projection to the triangles of a seed's own cell, gradients in the tangent plane
// (thesis 4.4.2, equation 4.7).
#pragma once

#include <span>
#include <vector>

#include "core/geometry.h"
#include "features/curves.h"
#include "voronoi/surface.h"

namespace bisector {

// The point of some triangles of the surface that is nearest to p, of equally near ones that of the first triangle, and
// the facet it lies on; null if there are no triangles.
struct SurfacePoint {
  Vec3 at;
  const Facet* facet = nullptr;
};
SurfacePoint nearest_on_triangles(const Surface& surface, std::span<const Index> triangles, const Vec3& p);

// Moves every seed to the nearest point of the triangles of its cell, and not to the globally nearest triangle, which
// may lie on another sheet of a thin part. `normals` receives the unit normal there. A seed without triangles stays,
// and has the normal it had; and so do the seeds inside a solid. `places`: of each seed, or empty.
void project_to_cells(const Surface& surface, const Csr<Index>& cells, std::span<const SeedPlace> places,
                      std::span<Vec3> seeds, std::vector<Vec3>& normals);

}  // namespace bisector
