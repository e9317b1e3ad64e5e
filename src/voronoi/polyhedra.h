// What clipping reports of one pair.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "voronoi/clip_tet.h"
#include "voronoi/clipped.h"

namespace bisector {

// A vertex relative to the seed, with the positions of its planes among the labels, counter-clockwise seen from
// outside.
struct PolyhedronVertex {
  std::array<Index, 3> on;
  Vec3 at;
};

// Appends a polyhedron; slots become the caller's indices. Labels are in their order. Throws Error if there are too
// many of them to number.
void append_polyhedron(const std::vector<Index>& labels, const std::vector<PolyhedronVertex>& vertices,
                       const SortedSeeds& seeds, Index tet, Index slot, ClippedPolyhedra& polyhedra);

// Appends the clipper's polyhedron.
void append_polyhedron(TetClipper& clipper, const SortedSeeds& seeds, Index tet, Index slot,
                       ClippedPolyhedra& polyhedra);

// Brings the polyhedra of all parts for which `keep(pair)` holds into the order of tetrahedra, then cells.
void gather_polyhedra(const std::vector<const ClippedPolyhedra*>& parts,
                      const std::function<bool(const ClippedPolyhedra::Pair&)>& keep, ClippedPolyhedra& polyhedra);

}  // namespace bisector
