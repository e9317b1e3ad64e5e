#include "support/models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

namespace bisector::test {
namespace {

Index index_of(std::size_t n) { return static_cast<Index>(n); }

// The rectangle of nx x ny cells as two triangles each, seen counter-clockwise; corner(i, j) gives the vertex.
template <class Corner>
void add_quads(TriangleMesh& mesh, int nx, int ny, const Corner& corner) {
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const Index a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1), d = corner(i, j + 1);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
}

void append(TriangleMesh& mesh, const TriangleMesh& other, const Vec3& offset) {
  const Index base = index_of(mesh.vertices.size());
  for (const Vec3& v : other.vertices) mesh.vertices.push_back(v + offset);
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

}  // namespace

TriangleMesh single_triangle() { return {{{0, 0, 0}, {8, 0, 0}, {0, 8, 0}}, {{0, 1, 2}}, {}}; }

TriangleMesh icosphere(int levels) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  for (const Vec3& v :
       {Vec3{-1, g, 0}, Vec3{1, g, 0}, Vec3{-1, -g, 0}, Vec3{1, -g, 0}, Vec3{0, -1, g}, Vec3{0, 1, g}, Vec3{0, -1, -g},
        Vec3{0, 1, -g}, Vec3{g, 0, -1}, Vec3{g, 0, 1}, Vec3{-g, 0, -1}, Vec3{-g, 0, 1}})
    mesh.vertices.push_back(unit(v));
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::array<Index, 2>, Index> middles;
    const auto middle = [&](Index a, Index b) {
      const auto [at, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)}, index_of(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back(unit(mesh.vertices[a] + mesh.vertices[b]));
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const Triangle& t : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
        finer.push_back(t);
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

TriangleMesh torus(int nu, int nv) {
  TriangleMesh mesh;
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const double u = 2 * std::numbers::pi * i / nu, v = 2 * std::numbers::pi * j / nv;
      const double r = 1 + 0.375 * std::cos(v);
      mesh.vertices.push_back({r * std::cos(u), r * std::sin(u), 0.375 * std::sin(v)});
    }
  add_quads(mesh, nu, nv, [&](int i, int j) { return static_cast<Index>(j % nv * nu + i % nu); });
  return mesh;
}

TriangleMesh box(int n) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, Index> vertices;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      add_quads(mesh, n, n, [&](int i, int j) {
        // (axis + 1, axis + 2) runs counter-clockwise seen from the positive side of axis.
        std::array<int, 3> at{};
        at[static_cast<std::size_t>(axis)] = side * n;
        at[static_cast<std::size_t>((axis + 1) % 3)] = side ? i : j;
        at[static_cast<std::size_t>((axis + 2) % 3)] = side ? j : i;
        const auto [found, is_new] = vertices.try_emplace(at, index_of(mesh.vertices.size()));
        if (is_new)
          mesh.vertices.push_back(
              {static_cast<double>(at[0]) / n, static_cast<double>(at[1]) / n, static_cast<double>(at[2]) / n});
        return found->second;
      });
  return mesh;
}

TriangleMesh grid_patch(int nx, int ny) {
  TriangleMesh mesh;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) mesh.vertices.push_back({static_cast<double>(i), static_cast<double>(j), 0});
  add_quads(mesh, nx, ny, [&](int i, int j) { return static_cast<Index>(j * (nx + 1) + i); });
  return mesh;
}

TriangleMesh wavy_patch(int n) {
  TriangleMesh mesh = grid_patch(n, n);
  for (Vec3& v : mesh.vertices) {
    const double x = v.x / n, y = v.y / n;
    v = {x, y, 0.15 * std::sin(5 * x + 1) * std::cos(4 * y)};
  }
  return mesh;
}

TriangleMesh pages() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0},       {0, 0, 1},       {1, 0, 0},        {1, 0, 1},
                   {-0.5, 0.75, 0}, {-0.5, 0.75, 1}, {-0.5, -0.75, 0}, {-0.5, -0.75, 1}};
  for (Index p = 2; p < 8; p += 2) {
    mesh.triangles.push_back({0, p, p + 1});
    mesh.triangles.push_back({0, p + 1, 1});
  }
  return mesh;
}

TriangleMesh two_spheres() {
  TriangleMesh mesh = icosphere(1);
  append(mesh, icosphere(1), {3, 0.5, 0.25});
  return mesh;
}

TriangleMesh soup(std::size_t count, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  TriangleMesh mesh;
  for (std::size_t t = 0; t < count; ++t) {
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back({random.unit(), random.unit(), random.unit()});
    mesh.triangles.push_back({index_of(3 * t), index_of(3 * t + 1), index_of(3 * t + 2)});
  }
  return mesh;
}

TriangleMesh duplicated_triangles() {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {}, {}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {2, 3, 0}, {2, 1, 0}, {3, 2, 0}};
  return mesh;
}

TriangleMesh needles() {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}}, {}, {}};
  double height = 0;
  for (int k = 40; k >= 0; k -= 10) {
    height += std::ldexp(1.0, -k);
    mesh.vertices.push_back({1, height, height / 2});
    const Index last = index_of(mesh.vertices.size() - 1);
    mesh.triangles.push_back({0, last - 1, last});
  }
  return mesh;
}

TriangleMesh collinear_among_good() {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, -1, 0.5}}, {}, {}};
  mesh.triangles = {{0, 1, 3}, {0, 1, 2}, {1, 2, 3}, {3, 3, 0}, {1, 0, 4}};
  return mesh;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double six = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    six += dot(mesh.vertices[a] - mesh.vertices[0],
               cross(mesh.vertices[b] - mesh.vertices[0], mesh.vertices[c] - mesh.vertices[0]));
  return six / 6;
}

std::string shared_model(const char* name) {
  const std::filesystem::path path =
      std::filesystem::path(BISECTOR_SOURCE_DIR) / ".." / "shared" / "data" / "surface" / name;
  std::error_code ignored;
  return std::filesystem::exists(path, ignored) ? path.string() : std::string();
}

std::string shared_scan(const char* name) {
  const std::filesystem::path path =
      std::filesystem::path(BISECTOR_SOURCE_DIR) / ".." / "shared" / "data" / "trees" / name;
  std::error_code ignored;
  return std::filesystem::exists(path, ignored) ? path.string() : std::string();
}

std::vector<Vec3> random_seeds(const TriangleMesh& mesh, std::size_t count, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  std::vector<double> area_below;
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    area += norm(cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a])) / 2;
    area_below.push_back(area);
  }
  std::vector<Vec3> seeds;
  while (seeds.size() < count) {
    const auto at = std::upper_bound(area_below.begin(), area_below.end(), random.range(0, area));
    if (at == area_below.end()) continue;
    const auto& [a, b, c] = mesh.triangles[static_cast<std::size_t>(at - area_below.begin())];
    double s = random.unit(), t = random.unit();
    if (s + t > 1) s = 1 - s, t = 1 - t;
    const Vec3& p = mesh.vertices[a];
    seeds.push_back(p + s * (mesh.vertices[b] - p) + t * (mesh.vertices[c] - p));
  }
  return seeds;
}

std::vector<Vec3> grid_seeds(const TriangleMesh& mesh, int nx, int ny, int nz) {
  const Box bounds = bounding_box(mesh.vertices);
  const std::array<int, 3> count{nx, ny, nz};
  Vec3 start, spacing;
  for (int k = 0; k < 3; ++k) {
    const int n = std::max(1, count[static_cast<std::size_t>(k)] - 1);
    const double extent = bounds.hi[k] - bounds.lo[k];
    spacing[k] = extent > 0 ? std::exp2(std::ceil(std::log2(extent / n))) : 1;
    const auto align = [&] { start[k] = spacing[k] * std::floor(bounds.lo[k] / spacing[k]); };
    for (align(); start[k] + n * spacing[k] < bounds.hi[k]; align()) spacing[k] *= 2;
  }
  std::vector<Vec3> seeds;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x)
        seeds.push_back({start.x + x * spacing.x, start.y + y * spacing.y, start.z + z * spacing.z});
  return seeds;
}

std::vector<Vec3> vertex_seeds(const TriangleMesh& mesh) { return mesh.vertices; }

std::vector<Vec3> mirrored(const std::vector<Vec3>& seeds, int axis) {
  std::vector<Vec3> out;
  for (const Vec3& seed : seeds) {
    Vec3 image = seed;
    image[axis] = -image[axis];
    out.push_back(seed);
    out.push_back(image);
  }
  return out;
}

std::vector<Vec3> coplanar_seeds(std::size_t count, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = static_cast<double>(random.below(17)) / 16, y = static_cast<double>(random.below(17)) / 16;
    seeds.push_back({x, y, 0.5});
  }
  return seeds;
}

std::vector<Vec3> collinear_seeds(std::size_t count) {
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = static_cast<double>(i) / 8;
    seeds.push_back({x, x, x});
  }
  return seeds;
}

std::vector<Vec3> cocircular_seeds() {
  return {{5, 0, 0},  {-3, 4, 0}, {0, -5, 0}, {4, 3, 0},  {-4, -3, 0}, {3, 4, 0},
          {-5, 0, 0}, {4, -3, 0}, {0, 5, 0},  {-4, 3, 0}, {3, -4, 0},  {-3, -4, 0}};
}

std::vector<Vec3> cospherical_seeds() {
  std::vector<Vec3> seeds;
  for (int axis = 0; axis < 3; ++axis)
    for (int signs = 0; signs < 8; ++signs) {
      Vec3 p;
      for (int k = 0; k < 3; ++k) p[k] = (signs >> k & 1 ? -1.0 : 1.0) * (k == axis ? 1 : 2);
      seeds.push_back(p);
    }
  return seeds;
}

std::vector<Vec3> repeated(const std::vector<Vec3>& seeds, int times) {
  std::vector<Vec3> out;
  for (int k = 0; k < times; ++k) out.insert(out.end(), seeds.begin(), seeds.end());
  return out;
}

std::vector<SmallCase> small_cases() {
  const TriangleMesh sphere = icosphere(0), cube = box(1), cube2 = box(2), patch = grid_patch(4, 4);
  TriangleMesh centred_cube = box(2);
  for (Vec3& v : centred_cube.vertices) v -= {0.5, 0.5, 0.5};
  TriangleMesh centred_patch = grid_patch(4, 4);
  for (Vec3& v : centred_patch.vertices) v -= {2, 2, 0};

  std::vector<SmallCase> cases;
  const auto add = [&](const char* name, const TriangleMesh& mesh, std::vector<Vec3> seeds) {
    cases.push_back({name, mesh, std::move(seeds)});
  };
  // General position.
  add("random seeds on a sphere", icosphere(1), random_seeds(icosphere(1), 12, 1));
  add("random seeds on a torus", torus(8, 5), random_seeds(torus(8, 5), 15, 2));
  add("random seeds on a wavy patch", wavy_patch(5), random_seeds(wavy_patch(5), 15, 3));
  add("random seeds on pages", pages(), random_seeds(pages(), 12, 4));
  add("random seeds on two spheres", two_spheres(), random_seeds(two_spheres(), 10, 5));
  add("random seeds on soup", soup(20, 6), random_seeds(soup(20, 6), 15, 7));
  add("random seeds on needles", needles(), random_seeds(needles(), 12, 8));
  // Few seeds.
  add("one seed", sphere, {{0.25, 0.5, 1}});
  add("one seed on a vertex", cube, {{0, 0, 0}});
  add("two seeds", sphere, {{1, 0, 0}, {-1, 0.25, 0}});
  add("two seeds, bisector through vertices", cube, {{0.25, 0.25, 0.25}, {0.75, 0.75, 0.25}});
  add("three seeds", sphere, {{1, 0, 0}, {-1, 0.25, 0}, {0, 0, 1}});
  add("three collinear seeds", cube2, {{0, 0.5, 0.5}, {0.5, 0.5, 0.5}, {1, 0.5, 0.5}});
  add("three equal seeds", cube, {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}});
  // Grids: cocircular and cospherical everywhere, faces, edges and vertices in bisectors.
  add("grid in the cube", cube2, grid_seeds(cube2, 3, 3, 3));
  add("grid of cell centres", cube2, [] {
    std::vector<Vec3> seeds;
    for (int k = 0; k < 8; ++k) seeds.push_back({(k & 1 ? 0.75 : 0.25), (k & 2 ? 0.75 : 0.25), (k & 4 ? 0.75 : 0.25)});
    return seeds;
  }());
  add("grid on the flat patch", patch, grid_seeds(patch, 5, 5, 1));
  add("two layers beside the flat patch", patch, grid_seeds(patch, 3, 3, 2));
  add("grid around the sphere", sphere, grid_seeds(sphere, 3, 3, 3));
  // Mirrored.
  add("mirrored in z about the flat patch", patch, [] {
    std::vector<Vec3> half;
    SplitMix64 random(9);
    for (int i = 0; i < 8; ++i) half.push_back({random.range(0, 4), random.range(0, 4), random.range(0.125, 1)});
    return mirrored(half, 2);
  }());
  add("mirrored in x about the cube", centred_cube, mirrored(random_seeds(centred_cube, 8, 10), 0));
  add("mirrored in x, y and z about the cube", centred_cube,
      mirrored(mirrored(mirrored(random_seeds(centred_cube, 3, 11), 0), 1), 2));
  // Special positions of the seeds.
  add("coplanar seeds in the cube", cube2, coplanar_seeds(15, 12));
  add("coplanar seeds above the flat patch", patch, coplanar_seeds(12, 13));
  add("collinear seeds in the cube", cube2, collinear_seeds(9));
  add("collinear seeds on the flat patch", patch, {{0, 2, 0}, {1, 2, 0}, {2, 2, 0}, {3, 2, 0}, {4, 2, 0}});
  add("cocircular seeds on the flat patch", centred_patch, cocircular_seeds());
  add("cocircular seeds, centre on an edge", grid_patch(4, 4), cocircular_seeds());
  add("cospherical seeds about the cube", centred_cube, cospherical_seeds());
  add("seeds at all vertices of the cube", cube2, vertex_seeds(cube2));
  add("seeds at all vertices of a sphere", icosphere(1), vertex_seeds(sphere));
  add("seeds at all vertices of the flat patch", patch, vertex_seeds(patch));
  add("seeds at all vertices of pages", pages(), vertex_seeds(pages()));
  // Equal seeds.
  add("equal seeds on the sphere", sphere, repeated(random_seeds(sphere, 5, 14), 3));
  add("equal seeds at vertices of the cube", cube, repeated(vertex_seeds(cube), 2));
  add("equal seeds on a grid", patch, repeated(grid_seeds(patch, 3, 3, 1), 2));
  // Parts of the mesh in a bisector.
  add("a vertex in a bisector", single_triangle(), {{-2, 1, 0}, {2, -1, 0}, {-1, -2, 1}});
  add("four cells at a vertex", centred_patch, {{1, 1, 1}, {-1, 1, 1}, {1, -1, 1}, {-1, -1, 1}});
  add("an edge in a bisector", single_triangle(), {{3, -1, 0}, {3, 1, 0}, {5, -1, 0}, {5, 1, 0}});
  add("an edge in a bisector, from below", single_triangle(), {{3, 1, 0}, {3, -1, 0}, {5, 1, 0}, {5, -1, 0}});
  add("a diagonal in a bisector", patch, {{3, 1, 0}, {1, 3, 0}, {4, 0, 0}, {0, 4, 0}, {2, 2, 2}});
  add("a face in a bisector", single_triangle(), {{1, 1, -1}, {1, 1, 1}, {4, 2, 1}, {4, 2, -1}});
  add("all faces in bisectors", cube,
      {{0.5, 0.5, -0.5},
       {0.5, 0.5, 0.5},
       {0.5, 0.5, 1.5},
       {-0.5, 0.5, 0.5},
       {1.5, 0.5, 0.5},
       {0.5, -0.5, 0.5},
       {0.5, 1.5, 0.5}});
  // Special triangles.
  add("duplicated triangles", duplicated_triangles(), random_seeds(duplicated_triangles(), 6, 15));
  add("duplicated triangles, seeds at vertices", duplicated_triangles(), vertex_seeds(duplicated_triangles()));
  add("collinear triangle among good ones", collinear_among_good(), random_seeds(collinear_among_good(), 6, 16));
  add("collinear triangle, grid seeds", collinear_among_good(), grid_seeds(collinear_among_good(), 3, 3, 2));
  add("needles, seeds at vertices", needles(), vertex_seeds(needles()));
  add("needles, mirrored seeds", needles(), {{0.5, 0, 0.25}, {0.5, 0, -0.25}, {0.25, 0.5, 0}, {0.25, -0.5, 0}});
  add("soup, grid seeds", soup(12, 17), grid_seeds(soup(12, 17), 3, 3, 3));
  return cases;
}

SmallCase integer_case(std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  const auto point = [&] {
    const std::uint64_t bits = random.next();
    return Vec3{static_cast<double>(bits & 3), static_cast<double>(bits >> 2 & 3), static_cast<double>(bits >> 4 & 3)};
  };
  SmallCase problem{"integers " + std::to_string(random_seed), {}, {}};
  const std::size_t vertices = 3 + random.below(6);
  for (std::size_t k = 0; k < vertices; ++k) problem.mesh.vertices.push_back(point());
  const std::size_t triangles = 1 + random.below(8);
  for (std::size_t k = 0; k < triangles; ++k) {
    const std::size_t a = random.below(vertices), b = (a + 1 + random.below(vertices - 1)) % vertices;
    std::size_t c = random.below(vertices);
    while (c == a || c == b) c = (c + 1) % vertices;
    problem.mesh.triangles.push_back({index_of(a), index_of(b), index_of(c)});
  }
  const std::size_t seeds = 1 + random.below(16);
  for (std::size_t k = 0; k < seeds; ++k) problem.seeds.push_back(point());
  return problem;
}

std::vector<Vec3> near_tie_seeds(const std::vector<Vec3>& points, SplitMix64& random) {
  constexpr std::array kShares{0.0, 0.0, 1e-15, 1e-13, 1e-9, 1e-7};
  std::vector<Vec3> seeds;
  for (const Vec3& p : points) {
    // Cells far smaller than what they lie on have vertices of large relative errors.
    const double decades = random.below(2) ? random.range(0, 6) : 0;
    const double radius = random.range(0.1, 1) * std::pow(10.0, -decades);
    const double share = kShares[random.below(kShares.size())];
    const double apart = random.below(3) == 0 ? std::pow(10.0, -random.range(4, 8)) : 1;
    Vec3 direction{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    const std::size_t count = 3 + random.below(3);
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3 other{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
      const Vec3 d = k == 0 ? direction : apart < 1 && k > 1 ? direction + apart * other : other;
      if (k == 1) direction = d;
      seeds.push_back(p + (radius * (1 + random.range(-share, share)) / norm(d)) * d);
    }
  }
  return seeds;
}

SmallCase near_tie_case(std::uint64_t random_seed) {
  SplitMix64 random(random_seed + 0x5eed);
  SmallCase problem{"near ties " + std::to_string(random_seed), {}, {}};
  std::vector<Vec3>& vertices = problem.mesh.vertices;
  for (int k = 0; k < 4; ++k) vertices.push_back({random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
  problem.mesh.triangles = {{0, 1, 2}};
  if (random.below(2)) problem.mesh.triangles.push_back({2, 1, 3});
  std::vector<Vec3> points;
  const std::size_t count = 1 + random.below(3);
  for (std::size_t k = 0; k < count; ++k) {
    const double u = random.range(0, 1), v = random.below(2) ? random.range(0, 1 - u) : 0;
    points.push_back(random.below(3) ? vertices[0] + u * (vertices[1] - vertices[0]) + v * (vertices[2] - vertices[0])
                                     : vertices[random.below(3)]);
  }
  problem.seeds = near_tie_seeds(points, random);
  constexpr std::array kExponents{0, 0, -66, -70, -74, -100, 60};
  const double scale = std::ldexp(1.0, kExponents[random.below(kExponents.size())]), away = random.below(2) ? 100 : 0;
  for (std::vector<Vec3>* all : {&vertices, &problem.seeds})
    for (Vec3& p : *all) p = scale * (p + Vec3{away, -away, away});
  // Beside something large single precision no longer has the range for what is small.
  if (random.below(2)) {
    const Index first = index_of(vertices.size());
    vertices.insert(vertices.end(), {{1, 0, 0}, {2, 0, 0}, {1, 1, 0}});
    problem.mesh.triangles.push_back({first, first + 1, first + 2});
    problem.seeds.push_back({2, 1, 1});
  }
  return problem;
}

TriangleMesh torn(const TriangleMesh& mesh, double size) {
  TriangleMesh soup;
  SplitMix64 random(11);
  for (const Triangle& t : mesh.triangles) {
    const Index first = static_cast<Index>(soup.vertices.size());
    for (const Index v : t) {
      Vec3 p = mesh.vertices[v];
      for (int k = 0; k < 3; ++k) p[k] += random.range(-size, size);
      soup.vertices.push_back(p);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.labels = mesh.labels;
  return soup;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b, const Vec3& offset) {
  const auto base = static_cast<Index>(a.vertices.size());
  for (const Vec3& v : b.vertices) a.vertices.push_back(v + offset);
  for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  return a;
}

MeshTopology topology_of(const TriangleMesh& mesh) { return analyse_topology(mesh.triangles, mesh.vertices.size()); }

}  // namespace bisector::test
