// From one level of sites in a solid to the next finer one.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "voronoi/diagram.h"

namespace bisector {

// Pairs of cells that share a facet inside the solid, lower first, sorted.
std::vector<std::array<Index, 2>> dual_edges(const ClippedPolyhedra& polyhedra);

// Sites per level, coarse to fine, the last being `count`: the sites and the middles of all edges of a body-centred
// cubic lattice, 7 for each site, are such a lattice of half the size, so a level has an eighth of the next one's
// sites.
std::vector<std::size_t> tet_level_counts(std::size_t count);

// Of a diagram, what follows takes the polyhedra, and the polygons, where corners of cells may lie.
// The seeds and the middles of their dual edges, those of the longest edges if that is too many for `count`; if it is
// too few, also corners of cells that are far from their seeds, cells of the highest energy first.
std::vector<Vec3> refine_sites(const Diagram& diagram, const std::vector<Vec3>& seeds, std::size_t count);

// Up to `count` points to insert, as above, no two from neighbouring cells before every cell had its turn.
std::vector<Vec3> far_corners(const Diagram& diagram, const std::vector<Vec3>& seeds, std::size_t count);

}  // namespace bisector
