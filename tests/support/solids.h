// Small tetrahedral meshes, and sets of seeds in and about them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry.h"

namespace bisector::test {

TetMesh single_tet();  // (0,0,0), (4,0,0), (0,4,0), (0,0,4)
TetMesh tet_grid(int nx, int ny,
                 int nz);    // [0,nx] x [0,ny] x [0,nz], each unit cube in six tetrahedra around its diagonal
TetMesh tet_box(int n);      // the unit cube, n to a side
TetMesh marked_cube(int n);  // n^3 cubes of a third, with every mark: a region for each layer, a label for each
                             // side, the cube's edges as features
TetMesh five_tets();         // the unit cube in five
TetMesh step();              // an L: a grid of 2 x 1 x 2 cubes without one of them
TetMesh hollow();            // a grid of 3 x 3 x 3 cubes without the middle one
TetMesh two_cubes();         // disjoint
TetMesh pores();             // a cube with three cavities, each far smaller than their distances
TetMesh specks();            // two cubes as small, far from a large one
TetMesh shell_of_pores();    // a cube with 26 such cavities around its middle, in a lattice
std::vector<Vec3> lattice_of_pores();  // the lattice, with seven points along each edge of the cube, shaken a little
TetMesh slivers();                     // octahedron around a tetrahedron 2^-40 high
TetMesh flat_among_good();             // octahedron around one of exactly no volume
TetMesh inverted_among_good();         // grid of 2 x 1 x 1 cubes with every other tetrahedron inverted
TetMesh shaken(TetMesh mesh, double by, std::uint64_t random_seed);  // vertices moved at random by up to `by`
TetMesh scaled(TetMesh mesh, double by);

// In the mesh's bounding box, enlarged by `margin` on all sides.
std::vector<Vec3> seeds_about(const TetMesh& mesh, std::size_t count, double margin, std::uint64_t random_seed);
// The points of a grid of the given numbers that spans the bounding box.
std::vector<Vec3> seed_grid(const TetMesh& mesh, int nx, int ny, int nz);

struct SolidCase {
  std::string name;
  TetMesh mesh;
  std::vector<Vec3> seeds;
};
// Problems small enough for the oracle, in general and in special position.
std::vector<SolidCase> solid_cases();
// Random tetrahedra of a grid with seeds at half-integer points, where nearly every decision is a tie. Any number gives
// another.
SolidCase integer_solid_case(std::uint64_t random_seed);
// Two tetrahedra and seeds that all but tie, as in near_tie_case(), at corners, on edges and facets, and inside.
SolidCase near_tie_solid_case(std::uint64_t random_seed);

}  // namespace bisector::test
