// One test body for every backend of solids, precision and source of neighbours: pairs, polyhedra and dual are those of
// the CPU, moments agree to rounding (in double to the bit), and runs repeat bit for bit. The reference is always the
// CPU with the nearest seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "compute/compute.h"
#include "host/passes/vulkan_solid_backend.h"
#include "support/models.h"
#include "support/setups.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

// --- Solids ---

// Cells of an n x n x n grid over the unit cube for which keep(i, j, k) holds, in six tetrahedra each about its
// diagonal.
TetMesh crate(
    Index n, const std::function<bool(Index, Index, Index)>& keep = [](Index, Index, Index) { return true; }) {
  TetMesh mesh;
  for (Index k = 0; k <= n; ++k)
    for (Index j = 0; j <= n; ++j)
      for (Index i = 0; i <= n; ++i) mesh.vertices.push_back({1.0 * i / n, 1.0 * j / n, 1.0 * k / n});
  const Index steps[3] = {1, n + 1, (n + 1) * (n + 1)};
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
  for (Index k = 0; k < n; ++k)
    for (Index j = 0; j < n; ++j)
      for (Index i = 0; i < n; ++i) {
        if (!keep(i, j, k)) continue;
        for (const auto& order : kOrders) {
          const Index a = i + j * steps[1] + k * steps[2], b = a + steps[order[0]], c = b + steps[order[1]];
          mesh.tets.push_back({a, b, c, c + steps[order[2]]});
        }
      }
  return mesh;
}

// A ball: cones from the centre over the triangles of a sphere.
TetMesh ball(int levels) {
  const TriangleMesh sphere = icosphere(levels);
  TetMesh mesh;
  mesh.vertices = sphere.vertices;
  mesh.vertices.push_back({});
  for (const Triangle& t : sphere.triangles)
    mesh.tets.push_back({static_cast<Index>(sphere.vertices.size()), t[0], t[1], t[2]});
  return mesh;
}

TetMesh transformed(TetMesh mesh, const Vec3& scale, const Vec3& offset) {
  for (Vec3& v : mesh.vertices) v = Vec3{scale.x * v.x, scale.y * v.y, scale.z * v.z} + offset;
  return mesh;
}

TetMesh shaken_crate(Index n) { return shaken(crate(n), 0.2 / n, 41); }

struct Model {
  std::string name;
  std::function<TetMesh()> make;
  std::size_t seeds;
};

std::vector<Model> models() {
  return {
      {"tet", [] { return single_tet(); }, 60},
      {"shaken", [] { return shaken_crate(4); }, 60},
      {"ball", [] { return ball(2); }, 120},
      {"frame", [] { return crate(3, [](Index i, Index j, Index k) { return (i != 1) + (j != 1) + (k != 1) >= 2; }); },
       80},
      {"hollow", [] { return hollow(); }, 150},
      {"pores", [] { return pores(); }, 150},
      {"specks", [] { return specks(); }, 150},
      {"islands", [] { return crate(3, [](Index i, Index j, Index k) { return i != 1 && j != 1 && k != 1; }); }, 60},
      {"slivers", [] { return slivers(); }, 40},
      {"plate",
       [] {
         return transformed(crate(3), {1, 1, 0x1p-6}, {});
       },
       60},
      {"far",
       [] {
         return transformed(shaken_crate(2), {1, 1, 1}, {1e5, -2e5, 3e5});
       },
       60},
      {"tiny",
       [] {
         return transformed(shaken_crate(2), {1e-6, 1e-6, 1e-6}, {});
       },
       60},
      {"huge",
       [] {
         return transformed(shaken_crate(2), {1e6, 1e6, 1e6}, {});
       },
       60},
  };
}

std::vector<double> varied_density(const TetMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  const Vec3 d = box.hi - box.lo;
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(std::exp(3 * dot(v - box.lo, d) / norm2(d)));
  return density;
}

// --- Seeds ---

Vec3 barycentric(const TetMesh& mesh, std::size_t t, const std::array<double, 4>& weights) {
  Vec3 p;
  for (std::size_t m = 0; m < 4; ++m) p += weights[m] * mesh.vertices[mesh.tets[t][m]];
  return p;
}

std::vector<Vec3> seeds_in(const TetMesh& mesh, std::size_t count, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  std::vector<Vec3> seeds;
  while (seeds.size() < count) {
    std::array<double, 3> cuts{random.unit(), random.unit(), random.unit()};
    std::sort(cuts.begin(), cuts.end());
    seeds.push_back(barycentric(mesh, random.below(mesh.tets.size()),
                                {cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1 - cuts[2]}));
  }
  return seeds;
}

// On vertices, and in the middle of edges, facets and tetrahedra.
std::vector<Vec3> seeds_on(const TetMesh& mesh, std::size_t most) {
  std::vector<Vec3> seeds;
  for (std::size_t k = 0; seeds.size() < most && k < 4 * mesh.tets.size(); ++k) {
    constexpr std::array<std::array<double, 4>, 4> kWeights{
        {{1, 0, 0, 0}, {0.5, 0.5, 0, 0}, {0.25, 0.25, 0.5, 0}, {0.25, 0.25, 0.25, 0.25}}};
    seeds.push_back(barycentric(mesh, (k * 7) % mesh.tets.size(), kWeights[k % 4]));
  }
  return seeds;
}

std::vector<Vec3> grid_in(const TetMesh& mesh, int n) {
  const Box box = bounding_box(mesh.vertices);
  const Vec3 d = box.hi - box.lo;
  std::vector<Vec3> seeds;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        seeds.push_back(box.lo + Vec3{(i + 0.5) / n * d.x, (j + 0.5) / n * d.y, (k + 0.5) / n * d.z});
  return seeds;
}

std::vector<Vec3> first_of(const std::vector<Vec3>& seeds, std::ptrdiff_t count) {
  return {seeds.begin(), seeds.begin() + count};
}

Evaluated solid_diagram_of(Backend& backend, const std::vector<Vec3>& seeds) {
  return evaluated(backend, seeds, Want::polygons | Want::polyhedra);
}

struct SeedSet {
  std::string name;
  std::vector<Vec3> seeds;
};

std::vector<SeedSet> seed_sets(const TetMesh& mesh, std::size_t count, bool all) {
  const std::vector<Vec3> random = seeds_in(mesh, count, 42);
  std::vector<SeedSet> sets{{"random", random}, {"grid", grid_in(mesh, 3)}};
  if (!all) return sets;
  const Box box = bounding_box(mesh.vertices);
  const Vec3 d = box.hi - box.lo;
  std::vector<Vec3> clustered = first_of(random, 10), flat = first_of(random, 12), line, outside = first_of(random, 12);
  SplitMix64 random_shift(43);
  while (clustered.size() < 40) {
    const double size = (clustered.size() % 2 ? 1e-4 : 1e-7) * norm(d);
    const auto shift = [&] { return size * random_shift.range(-1, 1); };
    clustered.push_back(random[0] + Vec3{shift(), shift(), shift()});
  }
  for (Vec3& x : flat) x.z = 0.5 * (box.lo.z + box.hi.z);
  for (int k = 0; k < 9; ++k) line.push_back(box.lo + (k / 8.0) * d);
  for (std::size_t k = 0; k < outside.size(); k += 2) outside[k] = box.lo + 3.0 * (outside[k] - box.lo);
  sets.push_back({"one", first_of(random, 1)});
  sets.push_back({"two", first_of(random, 2)});
  sets.push_back({"three", first_of(random, 3)});
  sets.push_back({"equal", repeated(first_of(random, 8), 2)});
  sets.push_back({"on", seeds_on(mesh, 24)});
  sets.push_back({"mirrored", mirrored(first_of(random, 10), 0)});
  sets.push_back({"coplanar", flat});
  sets.push_back({"collinear", line});
  sets.push_back({"clustered", clustered});
  sets.push_back({"outside", outside});
  return sets;
}

// --- Parity ---

std::vector<std::array<Index, 2>> pairs_of(const ClippedPolyhedra& polyhedra) {
  std::vector<std::array<Index, 2>> pairs;
  for (const auto& [tet, cell] : polyhedra.pairs) pairs.push_back({tet, cell});
  return pairs;
}

void expect_same_polyhedra(const ClippedPolyhedra& a, const ClippedPolyhedra& b) {
  EXPECT_TRUE(pairs_of(a) == pairs_of(b)) << "pairs differ: " << a.pairs.size() << " and " << b.pairs.size();
  EXPECT_TRUE(a.label_offsets == b.label_offsets && a.labels == b.labels) << "labels differ";
  EXPECT_TRUE(a.vertex_offsets == b.vertex_offsets && a.triples == b.triples) << "triples differ";
  EXPECT_TRUE(same_bits(a.vertices, b.vertices)) << "vertices differ";
  EXPECT_TRUE(dual_tets(a) == dual_tets(b)) << "duals differ";
}

void expect_parity(const Solid& solid, const Evaluated& reference, const Evaluated& found, Processor processor) {
  expect_same_polyhedra(reference.polyhedra, found.polyhedra);
  EXPECT_EQ(found.moments.triangles.offsets, reference.moments.triangles.offsets);
  EXPECT_EQ(found.moments.triangles.values, reference.moments.triangles.values);
  EXPECT_EQ(found.polygons.labels, reference.polygons.labels);
  EXPECT_EQ(found.report.certification.pairs, found.polyhedra.pairs.size());
  EXPECT_EQ(count_untiled(solid, found.polyhedra), 0u);
  const Tolerance tolerance = tolerance_of(processor);
  EXPECT_NEAR(found.moments.energy, reference.moments.energy, tolerance.cells * reference.moments.energy);
  const Parity parity = compare(reference.moments, reference.polyhedra, found.moments, found.polyhedra, solid);
  EXPECT_TRUE(parity.same_pairs && parity.same_labels && parity.same_dual);
  EXPECT_LE(parity.mass_error, tolerance.cells);
  EXPECT_LE(parity.centroid_error, tolerance.cells);
  EXPECT_LE(parity.energy_error, tolerance.cells);
  EXPECT_LE(parity.sum_error, tolerance.sum);
  if (processor != Processor::single) {
    EXPECT_TRUE(parity.bitwise) << "not the CPU's bits";
    EXPECT_EQ(found.report.certification.doubled, 0u);
  }
}

struct ModelCase {
  Setup setup;
  Model model;
};

void PrintTo(const ModelCase& instance, std::ostream* out) {
  *out << name_of(instance.setup) << " " << instance.model.name;
}

class Solids : public testing::TestWithParam<ModelCase> {};

TEST_P(Solids, AreTheCpus) {
  const auto& [setup, model] = GetParam();
  SKIP_WITHOUT_DEVICE(setup.processor);
  const TetMesh mesh = model.make();
  struct Mode {
    const char* name;
    bool uniform;
    SolidCells how;
  };
  for (const auto& [name, uniform, how] :
       {Mode{"whole", true, SolidCells::whole}, Mode{"clipped", true, SolidCells::clipped},
        Mode{"weighted", false, SolidCells::whole}}) {
    SCOPED_TRACE(name);
    const Solid solid(mesh, uniform ? std::vector<double>{} : varied_density(mesh));
    CpuSolidBackend cpu(solid, NeighbourSource::nearest, how);
    const std::unique_ptr<SolidBackend> backend = backend_for(solid, setup, how);
    EXPECT_EQ(backend->description().precision, setup.processor == Processor::single ? "single" : "double");
    std::vector<CellMoments> first_run;
    const std::vector<SeedSet> sets = seed_sets(mesh, model.seeds, uniform && how == SolidCells::whole);
    for (const SeedSet& set : sets) {
      SCOPED_TRACE(set.name);
      Evaluated found = solid_diagram_of(*backend, set.seeds);
      expect_parity(solid, solid_diagram_of(cpu, set.seeds), found, setup.processor);
      first_run.push_back(std::move(found.moments));
    }
    // Some once more in another order, so that what is kept from the last diagram is never the same.
    for (std::size_t k = std::min<std::size_t>(sets.size(), 4); k-- > 0;) {
      SCOPED_TRACE(sets[k].name + " again");
      const Evaluated again = evaluated(*backend, sets[k].seeds, Want::labels);
      EXPECT_TRUE(bisector::same_bits(again.moments, first_run[k]));
      EXPECT_EQ(again.polygons.labels, evaluated(cpu, sets[k].seeds, Want::labels).polygons.labels);
      EXPECT_TRUE(again.polygons.vertices.empty());
    }
  }
}

std::vector<ModelCase> model_cases() {
  std::vector<ModelCase> cases;
  for (const Model& model : models())
    for (const Setup& setup : solid_setups()) cases.push_back({setup, model});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Parity, Solids, testing::ValuesIn(model_cases()), [](const auto& instance) {
  return test_name(name_of(instance.param.setup) + "_" + instance.param.model.name);
});

class SolidParities : public testing::TestWithParam<Setup> {};

INSTANTIATE_TEST_SUITE_P(Parity, SolidParities, testing::ValuesIn(solid_setups()),
                         [](const auto& instance) { return name_of(instance.param); });

// Where nearly every decision is a tie.
TEST_P(SolidParities, DegenerateDiagramsAreTheCpus) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  constexpr std::uint64_t kIntegerCases = 4, kNearTieCases = 8;
  std::vector<SolidCase> cases = solid_cases();
  for (std::uint64_t k = 0; k < kIntegerCases; ++k) cases.push_back(integer_solid_case(k));
  for (std::uint64_t k = 0; k < kNearTieCases; ++k) cases.push_back(near_tie_solid_case(k));
  for (const auto& [name, mesh, seeds] : cases) {
    SCOPED_TRACE(name);
    const Solid solid(mesh);
    CpuSolidBackend cpu(solid, NeighbourSource::nearest);
    const std::unique_ptr<SolidBackend> backend = backend_for(solid, GetParam());
    expect_parity(solid, solid_diagram_of(cpu, seeds), solid_diagram_of(*backend, seeds), GetParam().processor);
  }
}

// Seeds that move as they do from step to step, then more and fewer of them.
TEST_P(SolidParities, WhatIsKeptBetweenDiagramsDoesNotShow) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TetMesh mesh = shaken_crate(3);
  const Solid solid(mesh);
  const std::unique_ptr<SolidBackend> backend = backend_for(solid, GetParam());
  EXPECT_EQ(&backend->surface(), &solid.boundary);
  SplitMix64 random(44);
  const auto check = [&](const std::vector<Vec3>& seeds, const char* what) {
    SCOPED_TRACE(what);
    CpuSolidBackend cpu(solid, NeighbourSource::nearest);
    expect_parity(solid, solid_diagram_of(cpu, seeds), solid_diagram_of(*backend, seeds), GetParam().processor);
  };
  std::vector<Vec3> seeds = seeds_in(mesh, 150, 45);
  check(seeds, "start");
  for (double step : {1e-9, 1e-3, 0.1}) {
    for (Vec3& x : seeds) x += step * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    check(seeds, "moved");
  }
  std::reverse(seeds.begin(), seeds.end());
  check(seeds, "reversed");
  check(seeds_in(mesh, 500, 46), "more");
  check(seeds_in(mesh, 5, 47), "fewer");
}

// A cell that only cells with cavities surround, of which nothing but their neighbours tells what is inside.
TEST_P(SolidParities, CellsBehindCavitiesAreFound) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const Solid solid(shell_of_pores());
  const std::unique_ptr<SolidBackend> backend = backend_for(solid, GetParam());
  CpuSolidBackend cpu(solid, NeighbourSource::nearest);
  const std::vector<Vec3> seeds = lattice_of_pores();
  const Evaluated found = solid_diagram_of(*backend, seeds);
  EXPECT_EQ(found.polyhedra.pairs.size(), seeds.size());
  expect_parity(solid, solid_diagram_of(cpu, seeds), found, GetParam().processor);
}

// Cells of a grid are settled by equal coordinates on the device, those apart that the tetrahedra tie with.
TEST_P(SolidParities, GridsStayOnTheDevice) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TetMesh mesh = shaken_crate(2);
  const Solid solid(mesh);
  const std::unique_ptr<SolidBackend> backend = backend_for(solid, GetParam());
  const Evaluated found = evaluated(*backend, grid_in(mesh, 7), Want::moments);
  EXPECT_NEAR(found.moments.mass, solid.mass, tolerance_of(GetParam().processor).sum * solid.mass);
  if (GetParam().processor != Processor::cpu) {
    EXPECT_LT(10 * found.report.certification.cpu, found.report.certification.pairs);
  }
}

TEST_P(SolidParities, SeedsOutOfReachAreTheCpus) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const Solid solid(crate(1));
  const std::unique_ptr<SolidBackend> backend = backend_for(solid, GetParam());
  const std::vector<Vec3> seeds{{0.3, 0.4, 0.5}, {1e15, 0, 0}, {0.7, 0.6, 0.4}};
  CpuSolidBackend cpu(solid, NeighbourSource::nearest);
  expect_same_polyhedra(solid_diagram_of(cpu, seeds).polyhedra, solid_diagram_of(*backend, seeds).polyhedra);
}

}  // namespace
}  // namespace bisector::test
