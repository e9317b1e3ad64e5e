// The walls of a solid: its boundary and the interfaces between its regions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// A part is a set of tetrahedra of one region that hang together through facets. Parts are numbered by their first
// tetrahedra.
struct Walls {
  // Triangles between the same two parts, with the same label.
  struct Patch {
    Index back, front;   // the part that the triangles face away from, and the one beyond, which is higher, or kNone
    std::int32_t label;  // of the solid's marked triangles; 0 of others
  };

  // The facets between parts and those of one tetrahedron, each once, on the solid's vertices, counter-clockwise seen
  // from in front if the tetrahedra are positive. Labels are indices of patches; feature edges are those of the solid
  // that are edges of the walls.
  TriangleMesh surface;
  std::vector<Patch> patches;
  std::vector<std::int32_t> regions;  // of each part; 0 where the solid has none
  std::vector<Index> part_of_tet;

  // Whether there are interfaces.
  bool divide() const;
};

Walls find_walls(const TetMesh& mesh);

// The facets of one tetrahedron, on the solid's vertices, with the labels of its marked triangles, or none if nothing
// is marked, and all feature edges of the solid.
TriangleMesh labelled_boundary(const TetMesh& mesh);

// Removes feature edges that are no edges of the surface.
void keep_own_edges(TriangleMesh& surface);

}  // namespace bisector
