#include "support/solids.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/tet_topology.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TetMesh without_cubes(int nx, int ny, int nz, const std::vector<int>& cubes) {
  TetMesh mesh = tet_grid(nx, ny, nz);
  std::vector<Tetrahedron> kept;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    if (std::find(cubes.begin(), cubes.end(), static_cast<int>(t / 6)) == cubes.end()) kept.push_back(mesh.tets[t]);
  mesh.tets = kept;
  return mesh;
}

// Over and under a square whose corners are as high as `lift` says: tetrahedra with either diagonal, and one between.
TetMesh around_square(double lift) {
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, lift}, {1, 1, 0}, {0, 1, lift}, {0.5, 0.5, 1}, {0.5, 0.5, -1}};
  mesh.tets = {{0, 1, 3, 4}, {1, 2, 3, 4}, {0, 2, 1, 5}, {0, 3, 2, 5}, {0, 1, 2, 3}};
  return mesh;
}

}  // namespace

TetMesh single_tet() {
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}};
  mesh.tets = {{0, 1, 2, 3}};
  return mesh;
}

TetMesh tet_grid(int nx, int ny, int nz) {
  TetMesh mesh;
  const auto vertex = [&](int x, int y, int z) { return static_cast<Index>((z * (ny + 1) + y) * (nx + 1) + x); };
  for (int z = 0; z <= nz; ++z)
    for (int y = 0; y <= ny; ++y)
      for (int x = 0; x <= nx; ++x) mesh.vertices.push_back({double(x), double(y), double(z)});
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        std::array<int, 3> axes{0, 1, 2};
        do {
          std::array<int, 3> at{x, y, z};
          Tetrahedron tet{vertex(x, y, z), 0, 0, 0};
          for (std::size_t k = 0; k < 3; ++k) {
            ++at[static_cast<std::size_t>(axes[k])];
            tet[k + 1] = vertex(at[0], at[1], at[2]);
          }
          const bool even = (axes[1] - axes[0] + 3) % 3 == 1;
          if (!even) std::swap(tet[2], tet[3]);
          mesh.tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  return mesh;
}

TetMesh tet_box(int n) { return scaled(tet_grid(n, n, n), 1.0 / n); }

TetMesh marked_cube(int n) {
  TetMesh mesh = tet_grid(n, n, n);
  for (Vec3& p : mesh.vertices) p = {p.x / 3, p.y / 3, p.z / 3};
  const auto at = [n](int x, int y, int z) { return static_cast<Index>((z * (n + 1) + y) * (n + 1) + x); };
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    mesh.regions.push_back(7 - 3 * static_cast<std::int32_t>(t / static_cast<std::size_t>(6 * n * n)));
  mesh.boundary = boundary_facets(mesh.tets);
  for (const Triangle& t : mesh.boundary) {
    int label = 0;
    for (int k = 0; k < 3; ++k)
      for (const double side : {0.0, n / 3.0})
        if (std::all_of(t.begin(), t.end(), [&](Index v) { return mesh.vertices[v][k] == side; }))
          label = 2 * k + (side > 0) - 2;
    mesh.boundary_labels.push_back(label);
  }
  for (int i = 0; i < n; ++i)
    for (const int a : {0, n})
      for (const int b : {0, n}) {
        mesh.feature_edges.push_back({at(i, a, b), at(i + 1, a, b)});
        mesh.feature_edges.push_back({at(a, i, b), at(a, i + 1, b)});
        mesh.feature_edges.push_back({at(a, b, i), at(a, b, i + 1)});
      }
  std::sort(mesh.feature_edges.begin(), mesh.feature_edges.end());
  return mesh;
}

TetMesh five_tets() {
  TetMesh mesh;
  for (int k = 0; k < 8; ++k) mesh.vertices.push_back({double(k & 1), double(k >> 1 & 1), double(k >> 2)});
  mesh.tets = {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 1, 4, 7}, {6, 4, 2, 7}};
  return mesh;
}

TetMesh step() { return without_cubes(2, 1, 2, {3}); }
TetMesh hollow() { return without_cubes(3, 3, 3, {13}); }

TetMesh two_cubes() { return without_cubes(3, 1, 1, {1}); }

namespace {

constexpr double kThin = 0.02;

// Of a grid of cubes, every other layer thinner by far.
TetMesh with_thin_layers(TetMesh mesh) {
  for (Vec3& p : mesh.vertices)
    for (int k = 0; k < 3; ++k) {
      const double thick = std::ceil(0.5 * p[k]);
      p[k] = thick + kThin * (p[k] - thick);
    }
  return mesh;
}

constexpr int cube_of_five(int x, int y, int z) { return x + 5 * (y + 5 * z); }

}  // namespace

TetMesh pores() {
  return with_thin_layers(
      without_cubes(5, 5, 5, {cube_of_five(1, 1, 1), cube_of_five(3, 1, 3), cube_of_five(3, 3, 3)}));
}

TetMesh specks() {
  std::vector<int> removed;
  for (int k = 0; k < 125; ++k)
    if (k != cube_of_five(1, 1, 1) && k != cube_of_five(3, 1, 3) && k != cube_of_five(4, 4, 4)) removed.push_back(k);
  return with_thin_layers(without_cubes(5, 5, 5, removed));
}

TetMesh shell_of_pores() {
  std::vector<int> removed;
  for (int x : {5, 7, 9})
    for (int y : {5, 7, 9})
      for (int z : {5, 7, 9})
        if (x != 7 || y != 7 || z != 7) removed.push_back(x + 15 * (y + 15 * z));
  return with_thin_layers(without_cubes(15, 15, 15, removed));
}

std::vector<Vec3> lattice_of_pores() {
  SplitMix64 random(29);
  std::vector<Vec3> points;
  const auto at = [&](int k) { return (k + 1) + kThin * (k + 0.5) + random.range(-0.05, 0.05); };
  for (int x = 0; x < 7; ++x)
    for (int y = 0; y < 7; ++y)
      for (int z = 0; z < 7; ++z) points.push_back({at(x), at(y), at(z)});
  return points;
}

TetMesh slivers() { return around_square(0x1p-40); }
TetMesh flat_among_good() { return around_square(0); }

TetMesh inverted_among_good() {
  TetMesh mesh = tet_grid(2, 1, 1);
  for (std::size_t t = 0; t < mesh.tets.size(); t += 2) std::swap(mesh.tets[t][0], mesh.tets[t][1]);
  return mesh;
}

TetMesh shaken(TetMesh mesh, double by, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  for (Vec3& p : mesh.vertices) p += Vec3{random.range(-by, by), random.range(-by, by), random.range(-by, by)};
  return mesh;
}

TetMesh scaled(TetMesh mesh, double by) {
  for (Vec3& p : mesh.vertices) p *= by;
  return mesh;
}

std::vector<Vec3> seeds_about(const TetMesh& mesh, std::size_t count, double margin, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  const Box box = bounding_box(mesh.vertices);
  std::vector<Vec3> seeds(count);
  for (Vec3& x : seeds)
    for (int k = 0; k < 3; ++k) x[k] = random.range(box.lo[k] - margin, box.hi[k] + margin);
  return seeds;
}

std::vector<Vec3> seed_grid(const TetMesh& mesh, int nx, int ny, int nz) {
  const Box box = bounding_box(mesh.vertices);
  std::vector<Vec3> seeds;
  const auto at = [](double lo, double hi, int k, int n) {
    return n == 1 ? (lo + hi) / 2 : lo + (hi - lo) * k / (n - 1);
  };
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x)
        seeds.push_back({at(box.lo.x, box.hi.x, x, nx), at(box.lo.y, box.hi.y, y, ny), at(box.lo.z, box.hi.z, z, nz)});
  return seeds;
}

std::vector<SolidCase> solid_cases() {
  std::vector<SolidCase> cases;
  const auto add = [&](const char* name, const TetMesh& mesh, std::vector<Vec3> seeds) {
    cases.push_back({name, mesh, std::move(seeds)});
  };
  const TetMesh cube = tet_grid(1, 1, 1), bar = tet_grid(2, 1, 1), big = scaled(tet_grid(1, 1, 1), 4);
  TetMesh centred = scaled(tet_grid(1, 1, 1), 4);
  for (Vec3& p : centred.vertices) p -= {2, 2, 2};
  // General position.
  add("random in a tetrahedron", single_tet(), seeds_about(single_tet(), 12, 0, 1));
  add("random in a shaken grid", shaken(bar, 0.2, 2), seeds_about(bar, 12, 0, 3));
  add("random about five tetrahedra", five_tets(), seeds_about(five_tets(), 12, 0.5, 4));
  add("random in a step", step(), seeds_about(step(), 12, 0, 5));
  add("random in a hollow cube", hollow(), seeds_about(hollow(), 5, 0, 6));
  add("random in two cubes", two_cubes(), seeds_about(two_cubes(), 10, 0, 7));
  add("random about slivers", slivers(), seeds_about(slivers(), 10, 0, 8));
  add("random with inverted tetrahedra", inverted_among_good(), seeds_about(bar, 10, 0, 9));
  // Few seeds.
  add("one seed", cube, {{0.25, 0.5, 1}});
  add("one seed at a vertex", bar, {{0, 0, 0}});
  add("one seed far away", bar, {{100, 50, 20}});
  add("two seeds", cube, {{0, 0, 0}, {1, 0.25, 0}});
  add("two seeds, bisector through edges", cube, {{0.25, 0.75, 0.5}, {0.75, 0.25, 0.5}});
  add("two seeds, bisector in a facet", bar, {{0.5, 0.5, 0.5}, {1.5, 0.5, 0.5}});
  add("two seeds the other way", bar, {{1.5, 0.5, 0.5}, {0.5, 0.5, 0.5}});
  add("two seeds, bisector in the boundary", bar, {{0.5, 0.5, 0.5}, {0.5, 0.5, 1.5}, {0.5, -0.5, 0.5}});
  add("three collinear seeds", bar, {{0, 0.5, 0.5}, {1, 0.5, 0.5}, {2, 0.5, 0.5}});
  add("three equal seeds", cube, {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}});
  // Grids: cospherical everywhere; facets, edges and vertices in bisectors.
  add("grid of two", cube, seed_grid(cube, 2, 2, 2));
  add("grid of three by three by two", cube, seed_grid(cube, 3, 3, 2));
  add("grid in a tetrahedron", single_tet(), seed_grid(single_tet(), 2, 3, 2));
  add("grid of cell centres", five_tets(), [] {
    std::vector<Vec3> seeds;
    for (int k = 0; k < 8; ++k) seeds.push_back({(k & 1 ? 0.75 : 0.25), (k & 2 ? 0.75 : 0.25), (k & 4 ? 0.75 : 0.25)});
    return seeds;
  }());
  add("grid over slivers", slivers(), seed_grid(slivers(), 2, 2, 2));
  add("grid over a flat tetrahedron", flat_among_good(), seed_grid(flat_among_good(), 2, 2, 3));
  // Special position.
  add("mirrored", centred, mirrored(mirrored(seeds_about(centred, 3, 0, 10), 0), 1));
  add("coplanar", big, [] {
    std::vector<Vec3> seeds = coplanar_seeds(8, 11);
    for (Vec3& x : seeds) x = {4 * x.x, 4 * x.y, 2};
    return seeds;
  }());
  add("collinear", cube, collinear_seeds(8));
  add("cocircular", centred, cocircular_seeds());
  add("cospherical", centred, [] {
    std::vector<Vec3> seeds = cospherical_seeds();
    seeds.resize(12);
    return seeds;
  }());
  add("cospherical cluster and others", centred, [] {
    std::vector<Vec3> seeds{{0, 0, 2}, {0, 2, 0}, {2, 0, 0}, {-2, 0, 0}, {0, -2, 0}, {0, 0, -2}};
    for (const Vec3& x : seeds_about(scaled(tet_grid(1, 1, 1), 2), 4, 0, 12)) seeds.push_back(x);
    return seeds;
  }());
  add("at the vertices", bar, bar.vertices);
  add("at the vertices twice", cube, repeated(cube.vertices, 2));
  add("on edges", cube, {{0.5, 0, 0}, {0, 0.5, 0}, {0.5, 0.5, 0.5}, {0.25, 0.25, 0}, {1, 0.5, 1}});
  add("on facets", five_tets(), {{0.25, 0.25, 0.5}, {0.5, 0.25, 0}, {0.5, 0.5, 1}, {0.75, 0.75, 0.5}});
  add("outside", cube, {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {-1, -1, -1}, {3, 3, 3}, {0.5, 0.5, 4}});
  add("clustered", cube, [] {
    std::vector<Vec3> seeds = seeds_about(tet_grid(1, 1, 1), 5, 0, 13);
    for (const Vec3& x : seeds_about(tet_grid(1, 1, 1), 6, 0, 14)) seeds.push_back(seeds[0] + 0x1p-30 * x);
    return seeds;
  }());
  add("one cell inside", scaled(tet_grid(1, 1, 1), 8), [] {
    std::vector<Vec3> seeds{{4, 4, 4}};
    for (const int axis : {0, 1, 2})
      for (const double at : {3.0, 5.5}) {
        Vec3 x{4, 4, 4};
        x[axis] = at;
        seeds.push_back(x);
      }
    return seeds;
  }());
  return cases;
}

SolidCase near_tie_solid_case(std::uint64_t random_seed) {
  SplitMix64 random(random_seed + 0x50115);
  SolidCase result{"near ties " + std::to_string(random_seed), single_tet(), {}};
  for (Vec3& p : result.mesh.vertices)
    p += Vec3{random.range(-0.3, 0.3), random.range(-0.3, 0.3), random.range(-0.3, 0.3)};
  const std::vector<Vec3> corners = result.mesh.vertices;
  std::vector<Vec3> points;
  const std::size_t count = 1 + random.below(2);
  for (std::size_t k = 0; k < count; ++k) {
    // Of up to four corners.
    const std::size_t among = 1 + random.below(4);
    Vec3 sum;
    double weights = 0;
    for (std::size_t c = 0; c < among; ++c) {
      const double weight = random.range(0.1, 1);
      sum += weight * corners[c];
      weights += weight;
    }
    points.push_back((1 / weights) * sum);
  }
  result.seeds = near_tie_seeds(points, random);
  constexpr std::array kExponents{0, 0, -66, -70, -74};
  const double scale = std::ldexp(1.0, kExponents[random.below(kExponents.size())]);
  for (std::vector<Vec3>* all : {&result.mesh.vertices, &result.seeds})
    for (Vec3& p : *all) p = scale * p;
  // Beside something large single precision no longer has the range for what is small.
  if (random.below(2)) {
    const Index first = static_cast<Index>(result.mesh.vertices.size());
    for (const Vec3& p : single_tet().vertices) result.mesh.vertices.push_back(p + Vec3{10, 0, 0});
    result.mesh.tets.push_back({first, first + 1, first + 2, first + 3});
    result.seeds.push_back({11, 1, 1});
  }
  return result;
}

SolidCase integer_solid_case(std::uint64_t random_seed) {
  SplitMix64 random(random_seed * 7919 + 1);
  SolidCase result{"integers " + std::to_string(random_seed), tet_grid(2, 1, 1), {}};
  if (random.below(2)) {
    std::vector<Tetrahedron> kept;
    for (const Tetrahedron& tet : result.mesh.tets)
      if (random.below(2)) kept.push_back(tet);
    if (!kept.empty()) result.mesh.tets = kept;
  }
  const std::size_t count = 2 + random.below(8);
  const auto at = [&](std::size_t n) { return 0.5 * static_cast<double>(random.below(n)); };
  for (std::size_t k = 0; k < count; ++k) {
    const double x = at(5), y = at(3), z = at(3);
    result.seeds.push_back({x, y, z});
  }
  return result;
}

}  // namespace bisector::test
