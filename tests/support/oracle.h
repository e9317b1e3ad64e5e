// A second opinion on the restricted Voronoi diagram: the definition of docs/design.md by brute force, sharing nothing
// with the library. Every triangle is clipped by every seed, in integers, and the infinitesimal weights are real
// numbers: so small, each so much smaller than the one before, that a bound on the coordinates proves every sign to be
// the infinitesimal one. What is computed is thus an ordinary power diagram in general position.
#pragma once

#include <gmpxx.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry.h"

namespace bisector::test {

struct OracleOptions {
  std::vector<Index> rank;  // seed i carries the weight w_rank[i]; empty: w_i
  unsigned gap = 1;         // multiplies the bits between consecutive weights; every value gives the same diagram
};

// What seed `seed` owns of triangle `triangle`, non-empty once perturbed.
struct OraclePolygon {
  Index triangle, seed;
  std::vector<std::int64_t> edges;  // in the triangle's sense: a seed, or -1 - k for the side from corner k to k + 1
  mpq_class share;                  // unperturbed area over the triangle's; may be zero
};

// Sorted by triangle, then seed. Exactly collinear triangles have none.
std::vector<OraclePolygon> oracle_polygons(const TriangleMesh& mesh, const std::vector<Vec3>& seeds,
                                           const OracleOptions& options = {});

struct OracleDiagram {
  std::vector<std::array<Index, 2>> pairs;  // (triangle, seed), sorted
  std::vector<Triangle> rdt;                // each ascending, sorted, no repeats
  // Per seed, for density 1, of the unperturbed polygons; the centroid of a cell without mass is zero.
  std::vector<double> mass, energy;
  std::vector<Vec3> centroid;
};

OracleDiagram oracle_diagram(const TriangleMesh& mesh, const std::vector<Vec3>& seeds,
                             const OracleOptions& options = {});

}  // namespace bisector::test
