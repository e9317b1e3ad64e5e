// Small generated meshes and seed sets, with the degenerate ones that exact arithmetic is there for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"

namespace bisector::test {

// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every platform.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // in [0, 1)
  double range(double lo, double hi) { return lo + (hi - lo) * unit(); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(next() % n); }

 private:
  std::uint64_t state_;
};

// Meshes. Closed ones are oriented outward.
TriangleMesh single_triangle();                                   // (0,0,0), (8,0,0), (0,8,0)
TriangleMesh icosphere(int levels);                               // 20 * 4^levels triangles on the unit sphere
TriangleMesh torus(int nu, int nv);                               // about z, radii 1 and 0.375; 2 nu nv triangles
TriangleMesh box(int n);                                          // unit cube, 12 n^2 triangles; exact when n is 2^k
TriangleMesh grid_patch(int nx, int ny);                          // [0,nx] x [0,ny] in z = 0, unit squares
TriangleMesh wavy_patch(int n);                                   // open height field over the unit square
TriangleMesh pages();                                             // three sheets that share one edge
TriangleMesh two_spheres();                                       // disjoint
TriangleMesh soup(std::size_t count, std::uint64_t random_seed);  // triangles without common vertices, in the unit cube
// Every triangle with vertices of its own, each moved by up to `size` along each axis.
TriangleMesh torn(const TriangleMesh& mesh, double size = 0);
// Both, the second moved. Nothing but vertices and triangles of the second is kept.
TriangleMesh joined(TriangleMesh a, const TriangleMesh& b, const Vec3& offset = {});
MeshTopology topology_of(const TriangleMesh& mesh);
TriangleMesh duplicated_triangles();  // a square whose triangles occur twice and reversed
TriangleMesh needles();               // a fan of triangles with aspect ratios up to 2^40
TriangleMesh collinear_among_good();  // 1 is exactly collinear, 3 has a repeated corner

double enclosed_volume(const TriangleMesh& mesh);  // of a closed mesh; positive if it is oriented outward

// Path of a model in the shared data folder beside the sources, empty where there is none.
std::string shared_model(const char* name);
std::string shared_scan(const char* name);  // the same for the points of a tree

// Seeds.
std::vector<Vec3> random_seeds(const TriangleMesh& mesh, std::size_t count, std::uint64_t random_seed);
std::vector<Vec3> grid_seeds(const TriangleMesh& mesh, int nx, int ny, int nz);  // spans the box by powers of two
std::vector<Vec3> vertex_seeds(const TriangleMesh& mesh);
std::vector<Vec3> mirrored(const std::vector<Vec3>& seeds, int axis);            // seed, image, seed, image, ...
std::vector<Vec3> coplanar_seeds(std::size_t count, std::uint64_t random_seed);  // z = 0.5, dyadic, in the unit square
std::vector<Vec3> collinear_seeds(std::size_t count);                            // i / 8 times (1, 1, 1)
std::vector<Vec3> cocircular_seeds();   // 12 integer points at distance 5 from the origin in z = 0
std::vector<Vec3> cospherical_seeds();  // (+-1, +-2, +-2) and its rotations: distance 3 from the origin
std::vector<Vec3> repeated(const std::vector<Vec3>& seeds, int times);  // the whole list again and again

// Every degenerate family as a named problem small enough for the oracle.
struct SmallCase {
  std::string name;
  TriangleMesh mesh;
  std::vector<Vec3> seeds;
};
std::vector<SmallCase> small_cases();

// Random triangles (some collinear, some sharing edges) and seeds (some equal) at points of a 4 x 4 x 4 grid, where
// nearly every decision is a tie. Any number gives another one.
SmallCase integer_case(std::uint64_t random_seed);

// Seeds that are as far as each other, but for a few units of rounding or a tiny share of the distance, from corners of
// triangles, points on their sides and points inside: decisions that only exact arithmetic, or a bound of every error,
// gets right. Any number gives another case, at another scale and place.
SmallCase near_tie_case(std::uint64_t random_seed);
// The seeds of such a case about given points. Some bisectors are all but parallel.
std::vector<Vec3> near_tie_seeds(const std::vector<Vec3>& points, SplitMix64& random);

}  // namespace bisector::test
