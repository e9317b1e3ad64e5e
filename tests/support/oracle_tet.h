// A second opinion on the clipped Voronoi diagram, as oracle.h on the restricted: the vertices of every cell in every
// tetrahedron by trying all triples of planes, in integers, with weights that are real numbers, each so much smaller
// than the one before that plain signs are the infinitesimal ones. Nothing is shared with the library.
#pragma once

#include <gmpxx.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry.h"

namespace bisector::test {

// What seed `seed` owns of tetrahedron `tet`, non-empty once perturbed.
struct OraclePolyhedron {
  Index tet, seed;
  std::vector<std::int64_t> labels;  // a seed, or -1 - k for the facet opposite corner k; seeds first, ascending
  std::vector<std::array<std::int64_t, 3>>
      vertices;                              // labels, counter-clockwise seen from outside, first the first in `labels`
  std::vector<std::array<mpq_class, 3>> at;  // of each vertex, unperturbed, relative to the seed
  mpq_class volume, energy;                  // unperturbed; the energy about the seed
  std::array<mpq_class, 3> first;            // moment about the seed
};

// Sorted by tetrahedron, then seed. Tetrahedra have to be positively oriented; those without volume have none. `gap`
// multiplies the bits between consecutive weights; every value gives the same diagram.
std::vector<OraclePolyhedron> oracle_polyhedra(const TetMesh& mesh, const std::vector<Vec3>& seeds, unsigned gap = 1);

}  // namespace bisector::test
