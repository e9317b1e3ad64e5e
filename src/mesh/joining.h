// What files write more than once, taken once: triangles, and vertices at the same point.
#pragma once

#include <vector>

#include "bisector/quality.h"
#include "bisector/repair.h"

namespace bisector {

// Of the diagonal: how far apart rounding leaves points that were one, in files of six digits.
inline constexpr double kRounding = 1e-5;

// Of triangles with the same three vertices, either way round, keeps the first of the lowest label, and none where the
// surface is folded onto itself: two of them, one each way round and of one label, one or two of whose edges are theirs
// alone and the others those of two more triangles, or which are lower than rounding. No vertices are merged. Faces
// that are to be seen from both sides are often written twice; seeds cannot tell the same sheet from itself.
WeldResult remove_double_triangles(const TriangleMesh& mesh);

// Whether vertices are to be one that were not: there are no more border edges then, and fewer border and non-manifold
// edges together.
bool joins_borders(const MeshTopology& now, const MeshTopology& before);

// For each point the first of those equal to it.
std::vector<Index> first_equal(const std::vector<Vec3>& points);

// The triangles, all of them and in their order, with the first of the vertices at a point in the place of each other
// one, if that joins borders: files give faces vertices of their own where normals or texture coordinates differ. A
// triangle with two corners at a point stays as it is.
std::vector<Triangle> join_equal_points(const TriangleMesh& mesh);

}  // namespace bisector
