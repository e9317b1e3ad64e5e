// Sheets of a result that cross because its triangles are chords, pushed apart.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/context.h"
#include "bisector/mesh.h"

namespace bisector {

// Where a surface touches itself or all but does, as solids that lie on each other with curved faces do, the triangles
// of either sheet cut off what the surface is bent by, and cross those of the other one. There vertices move off the
// surface, by a tenth of the edges around them at most, until fewer pairs cross: each is pushed apart in the direction
// in which it overlaps the least. `pairs` are all that cross, as find_self_intersections has them. Only the vertices
// marked in `movable`, one mark for each, move; no angle below 30 degrees gets smaller, no other one less than that,
// and no triangle turns far. Pairs that overlap by more stay as they are, and all do where there is one for every two
// vertices. True if fewer cross then, and no more than `most_left`; else the mesh is as it was. Throws Cancelled.
bool push_apart(TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& pairs, const std::vector<char>& movable,
                std::size_t most_left, const Context& context = {});

}  // namespace bisector
