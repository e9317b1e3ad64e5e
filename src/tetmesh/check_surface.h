// Whether a surface bounds a solid.
#pragma once

#include <string>

#include "core/geometry.h"

namespace bisector {

// The surface with vertices at the same point merged and its shells oriented so that the solid is inside: shells within
// an even number of others outward, those within an odd number (walls of cavities) inward. Parts may lie side by side
// or nested.
//
// Throws Error, one line that counts what is wrong and names the first few by the vertices or triangles of `mesh`,
// counted from 0, for: no triangle, coordinates that are not finite, an index out of range, triangles without area,
// edges of one or of more than two triangles, vertices whose triangles fall apart into several fans, parts with no
// consistent orientation, and triangles that intersect other than in a shared vertex or edge. All is decided exactly.
TriangleMesh check_surface(const TriangleMesh& mesh);

// The same for the walls of a solid of several parts, which may meet in edges of more than two triangles and in
// vertices, and whose triangles may face either way: of those with the same corners one stays. Throws Error for no
// triangle, coordinates, indices, triangles without area, edges of one triangle, and intersections, as above.
TriangleMesh check_walls(const TriangleMesh& mesh);

}  // namespace bisector
