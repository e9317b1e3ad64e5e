// One test body for every backend, precision and source of neighbours: the combinatorics are those of the CPU, moments
// agree to rounding, and runs repeat bit for bit. The reference is always the CPU with the nearest seeds. Errors are
// relative to cell size as cvt/parity.h defines it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "cvt/optimise.h"
#include "host/passes/vulkan_backend.h"
#include "remesh/remesh.h"
#include "remesh/topology_control.h"
#include "support/models.h"
#include "support/run.h"
#include "support/setups.h"
#include "voronoi/dual.h"

namespace bisector::test {
namespace {

// --- Seeds ---

// Nine tenths in the hundredth of the area that is nearest to a vertex.
std::vector<Vec3> clustered_seeds(const TriangleMesh& mesh, std::size_t count) {
  const Vec3 centre = mesh.vertices[mesh.triangles[0][0]];
  const std::size_t spread = count / 10, dense = count - spread;
  std::vector<Vec3> seeds = random_seeds(mesh, 100 * dense, 11);
  std::nth_element(seeds.begin(), seeds.begin() + static_cast<std::ptrdiff_t>(dense), seeds.end(),
                   [&](const Vec3& a, const Vec3& b) { return norm2(a - centre) < norm2(b - centre); });
  seeds.resize(dense);
  const std::vector<Vec3> others = random_seeds(mesh, spread, 12);
  seeds.insert(seeds.end(), others.begin(), others.end());
  return seeds;
}

// Nine tenths in balls of 1e-5 and 1e-12 of the box about a vertex.
std::vector<Vec3> packed_seeds(const TriangleMesh& mesh, std::size_t count) {
  SplitMix64 random(13);
  const Vec3 centre = mesh.vertices[mesh.triangles[0][0]];
  const double diagonal = bounding_box(mesh.vertices).diagonal();
  std::vector<Vec3> seeds = random_seeds(mesh, count / 10, 14);
  while (seeds.size() < count) {
    const double radius = (seeds.size() % 2 ? 1e-5 : 1e-12) * diagonal;
    seeds.push_back(centre + radius * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
  }
  return seeds;
}

std::vector<Vec3> optimised_seeds(const Surface& surface, std::vector<Vec3> seeds) {
  CpuBackend backend(surface, NeighbourSource::nearest);
  OptimiseOptions options;
  options.iterations = 15;
  return test::optimised_seeds(backend, std::move(seeds), options);
}

// Vertices, evenly spread over their order if there are too many.
std::vector<Vec3> some_vertices(const TriangleMesh& mesh, std::size_t most) {
  const std::vector<Vec3> all = vertex_seeds(mesh);
  const std::size_t step = (all.size() + most - 1) / most;
  std::vector<Vec3> seeds;
  for (std::size_t k = 0; k < all.size(); k += step) seeds.push_back(all[k]);
  return seeds;
}

std::vector<Vec3> flattened(std::vector<Vec3> seeds, const Box& box) {
  for (Vec3& x : seeds) x.z = 0.5 * (box.lo.z + box.hi.z);
  return seeds;
}

std::vector<Vec3> on_diagonal(std::size_t count, const Box& box) {
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i)
    seeds.push_back(box.lo + (static_cast<double>(i) / static_cast<double>(count)) * (box.hi - box.lo));
  return seeds;
}

// Away from the middle of the box, which the cells of most shapes still reach.
std::vector<Vec3> moved_out(std::vector<Vec3> seeds, double factor, const Box& box) {
  const Vec3 middle = 0.5 * (box.lo + box.hi);
  for (Vec3& x : seeds) x = middle + factor * (x - middle);
  return seeds;
}

std::vector<Vec3> first_of(const std::vector<Vec3>& seeds, std::ptrdiff_t count) {
  return {seeds.begin(), seeds.begin() + count};
}

struct SeedSet {
  std::string name;
  std::vector<Vec3> seeds;
  Diagram reference = {};
};

enum class Choice { basic, all, weighted };

std::vector<SeedSet> seed_sets(const Surface& surface, std::size_t count, Choice choice) {
  const TriangleMesh& mesh = surface.mesh;
  const std::vector<Vec3> random = random_seeds(mesh, count, 15);
  const int side = std::max(4, static_cast<int>(std::cbrt(count)));
  std::vector<SeedSet> sets{
      {"random", random}, {"clustered", clustered_seeds(mesh, count)}, {"grid", grid_seeds(mesh, side, side, side)}};
  if (choice == Choice::weighted) return sets;
  sets.push_back({"optimised", optimised_seeds(surface, random)});
  sets.push_back({"vertices", some_vertices(mesh, 2 * count)});
  if (choice == Choice::basic) return sets;
  const Box box = bounding_box(mesh.vertices);
  const std::vector<Vec3> few = random_seeds(mesh, count / 3, 16);
  sets.push_back({"packed", packed_seeds(mesh, std::min<std::size_t>(count, 600))});
  sets.push_back({"one", first_of(random, 1)});
  sets.push_back({"two", first_of(random, 2)});
  sets.push_back({"three", first_of(random, 3)});
  sets.push_back({"three equal", repeated(first_of(random, 1), 3)});
  sets.push_back({"duplicated", repeated(few, 3)});
  sets.push_back({"duplicated vertices", repeated(some_vertices(mesh, count / 2), 2)});
  sets.push_back({"mirrored", mirrored(few, 0)});
  sets.push_back({"coplanar", flattened(few, box)});
  sets.push_back({"collinear", on_diagonal(few.size(), box)});
  sets.push_back({"far away", moved_out(few, 100, box)});
  return sets;
}

// --- Surfaces ---

struct Model {
  std::string name;
  std::function<TriangleMesh()> make;  // a mesh without triangles where the model is absent
  std::size_t seeds;
  Choice choice;
};

TriangleMesh transformed(TriangleMesh mesh, const Vec3& scale, const Vec3& offset) {
  for (Vec3& v : mesh.vertices) v = Vec3{scale.x * v.x, scale.y * v.y, scale.z * v.z} + offset;
  return mesh;
}

// Two height fields, the one a thousandth above the other.
TriangleMesh thin_sheets() {
  TriangleMesh mesh = wavy_patch(16);
  const auto count = static_cast<Index>(mesh.vertices.size());
  const TriangleMesh upper = transformed(mesh, {1, 1, 1}, {0, 0, 0.001});
  mesh.vertices.insert(mesh.vertices.end(), upper.vertices.begin(), upper.vertices.end());
  for (const auto& [a, b, c] : upper.triangles) mesh.triangles.push_back({count + a, count + b, count + c});
  return mesh;
}

std::vector<Model> models() {
  std::vector<Model> all;
  const auto add = [&](const char* name, std::size_t seeds, std::function<TriangleMesh()> make) {
    all.push_back({name, std::move(make), seeds, Choice::all});
  };
  add("sphere", 600, [] { return icosphere(4); });
  add("torus", 600, [] { return torus(60, 40); });
  add("open_patch", 600, [] { return wavy_patch(32); });
  add("two_spheres", 400, [] { return two_spheres(); });
  add("non_manifold_pages", 600, [] { return pages(); });
  add("soup", 400, [] { return soup(300, 17); });
  add("thin_plate", 600, [] { return transformed(box(8), {1, 1, 0.01}, {}); });
  add("thin_sheets", 600, [] { return thin_sheets(); });
  add("one_triangle", 2000, [] { return single_triangle(); });  // thousands of cells per facet
  add("box_of_12", 1200, [] { return box(1); });
  add("fine_sphere", 50, [] { return icosphere(5); });  // hundreds of facets per cell
  add("needles", 300, [] { return needles(); });
  add("collinear", 300, [] { return collinear_among_good(); });
  add("duplicated_triangles", 300, [] { return duplicated_triangles(); });
  add("far_torus", 400, [] { return transformed(torus(32, 20), {1, 1, 1}, {1e6, -2e6, 3e6}); });
  add("tiny_torus", 400, [] { return transformed(torus(32, 20), {1e-6, 1e-6, 1e-6}, {}); });
  add("huge_torus", 400, [] { return transformed(torus(32, 20), {1e6, 1e6, 1e6}, {}); });
  for (const char* name : {"anchor.off", "beetle.obj", "bunny.off", "fandisk.off"})
    all.push_back({name,
                   [name] {
                     const std::string path = shared_model(name);
                     return path.empty() ? TriangleMesh{} : read_mesh(path);
                   },
                   1500, Choice::basic});
  return all;
}

// Varies by a factor of 20 along the box's diagonal.
std::vector<double> varied_density(const TriangleMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  const Vec3 d = box.hi - box.lo;
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(std::exp(3 * dot(v - box.lo, d) / norm2(d)));
  return density;
}

struct Problem {
  Problem(const TriangleMesh& mesh, const Model& model, bool weighted)
      : surface(mesh, weighted ? varied_density(mesh) : std::vector<double>{}),
        sets(seed_sets(surface, model.seeds, weighted ? Choice::weighted : model.choice)) {
    RestrictedVoronoi voronoi(surface);
    for (SeedSet& set : sets) {
      SCOPED_TRACE("reference for " + set.name);
      set.reference = test::diagram_of(voronoi, set.seeds, NeighbourSource::nearest);
      expect_sound(surface, set.reference);
    }
  }

  Surface surface;
  std::vector<SeedSet> sets;
};

// With and without density; empty where the model is absent. The last model's are kept for the next setup in the same
// process.
const std::vector<std::unique_ptr<Problem>>& problems_of(const Model& model) {
  static std::string last;
  static std::vector<std::unique_ptr<Problem>> problems;
  if (last == model.name) return problems;
  last = model.name;
  problems.clear();
  const TriangleMesh mesh = model.make();
  if (mesh.triangles.empty()) return problems;
  for (bool weighted : {false, true}) problems.push_back(std::make_unique<Problem>(mesh, model, weighted));
  return problems;
}

// --- Diagrams ---

void expect_parity(const Problem& problem, const Setup& setup) {
  const std::unique_ptr<Backend> backend = backend_for(problem.surface, setup);
  EXPECT_LE(backend->mass_tolerance(), tolerance_of(setup.processor).sum);
  EXPECT_EQ(backend->description().precision, setup.processor == Processor::single ? "single" : "double");
  const std::string kind = backend->description().kind;
  EXPECT_EQ(kind != "cpu" && kind != "ranks", is_device(setup.processor));
  std::vector<CellMoments> first_run;
  for (const SeedSet& set : problem.sets) {
    SCOPED_TRACE(set.name);
    Evaluated found = diagram_of(*backend, set.seeds);
    expect_parity(problem.surface, set.reference, found, setup.processor);
    // One density is enough: what makes a run repeat itself does not depend on it.
    if (&set == &problem.sets.front() && problem.surface.density.empty()) {
      SCOPED_TRACE("a fresh object and one thread");
      const ThreadLimit limit(1);
      const std::unique_ptr<Backend> fresh = backend_for(problem.surface, setup);
      expect_same_diagram(diagram_of(*fresh, set.seeds), found);
    }
    first_run.push_back(std::move(found.moments));
  }
  // Every other one once more in another order, so that what is kept from the last diagram is never the same.
  for (std::size_t k = problem.sets.size(); k-- > 0;) {
    if (k % 2 == 1) continue;
    SCOPED_TRACE(problem.sets[k].name + " again");
    expect_same_moments(evaluated(*backend, problem.sets[k].seeds, Want::triangles).moments, first_run[k]);
  }
  EXPECT_EQ(backend->description().fallback, "");
}

struct DiagramCase {
  Setup setup;
  Model model;
};

void PrintTo(const DiagramCase& instance, std::ostream* out) {
  *out << name_of(instance.setup) << " " << instance.model.name;
}

class Diagrams : public testing::TestWithParam<DiagramCase> {};

TEST_P(Diagrams, AreTheCpus) {
  const auto& [setup, model] = GetParam();
  SKIP_WITHOUT_DEVICE(setup.processor);
  const auto& problems = problems_of(model);
  if (problems.empty()) GTEST_SKIP() << "no shared data";
  for (const std::unique_ptr<Problem>& problem : problems) {
    SCOPED_TRACE(problem->surface.density.empty() ? "uniform" : "weighted");
    expect_parity(*problem, setup);
  }
}

Processor turn_of(std::size_t model) { return model % 2 == 0 ? Processor::single : Processor::double_; }

std::vector<DiagramCase> diagram_cases() {
  std::vector<DiagramCase> cases;
  const std::vector<Model> all = models();
  for (std::size_t k = 0; k < all.size(); ++k)
    for (const Setup& setup : all_setups()) {
      // Software devices take long: there, precisions and sources of neighbours take turns where there are many models
      // of a kind. Both precisions are tried on all that are small, and on two of the large ones.
      const bool device = is_device(setup.processor), my_turn = setup.processor == turn_of(k);
      const bool large = all[k].choice == Choice::basic && all[k].name != "anchor.off";
      if (device && setup.source == NeighbourSource::delaunay && (large || !my_turn)) continue;
      if (device && large && all[k].name != "bunny.off" && !my_turn) continue;
      cases.push_back({setup, all[k]});
    }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Parity, Diagrams, testing::ValuesIn(diagram_cases()), [](const auto& instance) {
  return test_name(name_of(instance.param.setup) + "_" + instance.param.model.name);
});

class Parities : public testing::TestWithParam<Setup> {};

INSTANTIATE_TEST_SUITE_P(Parity, Parities, testing::ValuesIn(setups()),
                         [](const auto& instance) { return name_of(instance.param); });

// Where nearly every decision is a tie.
TEST_P(Parities, DegenerateDiagramsAreTheCpus) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  constexpr std::uint64_t kIntegerCases = 20, kNearTieCases = 40;
  std::vector<SmallCase> cases = small_cases();
  for (std::uint64_t k = 0; k < kIntegerCases; ++k) cases.push_back(integer_case(k));
  for (std::uint64_t k = 0; k < kNearTieCases; ++k) cases.push_back(near_tie_case(k));
  for (const auto& [name, mesh, seeds] : cases) {
    SCOPED_TRACE(name);
    std::optional<Surface> surface;
    try {
      surface.emplace(mesh);
    } catch (const Error&) {
      continue;  // without area
    }
    const Diagram reference = test::diagram_of(*surface, seeds, NeighbourSource::nearest);
    const std::unique_ptr<Backend> backend = backend_for(*surface, GetParam());
    expect_parity(*surface, reference, diagram_of(*backend, seeds), GetParam().processor);
  }
}

// Seeds whose spacing varies by a factor of 30 over the surface.
std::vector<Vec3> graded_seeds(const TriangleMesh& mesh, std::size_t count) {
  const Box box = bounding_box(mesh.vertices);
  const Vec3 d = box.hi - box.lo;
  SplitMix64 random(18);
  std::vector<Vec3> seeds;
  for (std::uint64_t round = 19; seeds.size() < count; ++round)
    for (const Vec3& x : random_seeds(mesh, 20 * count, round)) {
      // The number of seeds per area goes with the square of the spacing.
      const double spacing = std::pow(30.0, dot(x - box.lo, d) / norm2(d));
      if (seeds.size() < count && random.range(0, 1) < 1 / (spacing * spacing)) seeds.push_back(x);
    }
  return seeds;
}

// Hardly any pair of theirs is left to the CPU.
TEST_P(Parities, GradedSeedsStayOnTheDevice) {
  if (!is_device(GetParam().processor) || GetParam().source != NeighbourSource::nearest) GTEST_SKIP();
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TriangleMesh mesh = torus(60, 40);
  const Surface surface(mesh);
  const std::unique_ptr<Backend> backend = backend_for(surface, GetParam());
  const std::vector<Vec3> seeds = graded_seeds(mesh, 10'000);
  const Evaluated found = diagram_of(*backend, seeds);
  expect_parity(surface, test::diagram_of(surface, seeds, NeighbourSource::nearest), found, GetParam().processor);
  const Certification& certification = found.report.certification;
  EXPECT_LE(certification.cpu, certification.pairs / 2000);
}

// One cell of thousands of triangles among many of few: its pairs are too many to be ranked, and all are sorted by
// radix then, at once the next time.
TEST_P(Parities, ACellMayOwnThousandsOfTriangles) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TriangleMesh mesh = icosphere(5);
  const Surface surface(mesh);
  std::vector<Vec3> seeds = random_seeds(mesh, 20'000, 23);
  std::erase_if(seeds, [](const Vec3& x) { return x.z < 0.7; });
  seeds.push_back({0, 0, -1});
  const Diagram reference = test::diagram_of(surface, seeds, NeighbourSource::nearest);
  ASSERT_GT(reference.moments.triangles.size(seeds.size() - 1), 4096u);
  ASSERT_LT(reference.moments.triangles.values.size(), 64 * seeds.size());
  const std::unique_ptr<Backend> backend = backend_for(surface, GetParam());
  for (int round = 0; round < 2; ++round)
    expect_parity(surface, reference, diagram_of(*backend, seeds), GetParam().processor);
}

// A device waits for the host and the host for it a few times only, and however many the seeds are.
TEST_P(Parities, AnEvaluationTakesFewSubmissions) {
  if (!is_device(GetParam().processor) || GetParam().source != NeighbourSource::nearest) GTEST_SKIP();
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TriangleMesh mesh = icosphere(6);
  const Surface surface(mesh);
  const std::unique_ptr<Backend> backend = backend_for(surface, GetParam());
  std::vector<std::size_t> counts{10'000, 100'000};
  if (GetParam().processor == Processor::double_) counts.push_back(1'000'000);
  for (const std::size_t count : counts) {
    SCOPED_TRACE(count);
    std::vector<Vec3> seeds = random_seeds(mesh, count, 22);
    Diagram diagram;
    backend->evaluate(seeds, Want::moments, diagram);
    for (Vec3& x : seeds) x *= 1.0001;
    const DeviceWork work = backend->evaluate(seeds, Want::moments, diagram).device_work;
    EXPECT_GE(work.submits, 1u);
    EXPECT_LE(work.submits, 8u);
    EXPECT_LE(work.dispatches, 120u);
    // Positions up, and of each cell its moments and a mass down, with what a few counters and lists take.
    EXPECT_LE(work.bytes_up, 24 * count + 100'000);
    EXPECT_LE(work.bytes_down, 48 * count + 100'000);
  }
}

// The vectors of a descent stay on the device: per step there come down a few numbers, and the seeds every tenth.
TEST_P(Parities, ADescentStaysOnTheDevice) {
  if (!is_device(GetParam().processor) || GetParam().source != NeighbourSource::nearest) GTEST_SKIP();
  SKIP_WITHOUT_DEVICE(Processor::double_);
  const TriangleMesh mesh = torus(40, 24);
  const Surface surface(mesh);
  const std::vector<Vec3> seeds = random_seeds(mesh, 3000, 23);
  for (const bool constrained : {false, true}) {
    SCOPED_TRACE(constrained);
    OptimiseOptions options;
    options.tolerance = 0;
    options.constrained = constrained;
    const auto bytes_of = [&](int iterations) {
      const std::unique_ptr<Backend> backend = backend_for(surface, GetParam());
      FreeRun free(*backend, seeds);
      options.iterations = iterations;
      optimise(free.run, options);
      const DeviceWork& work = free.run.totals.device_work;
      return std::pair(static_cast<double>(work.bytes_up + work.bytes_down), free.run.totals.evaluations);
    };
    // Nothing is kept yet after ten steps, and what the start and the end take is the same.
    const auto [few, few_evaluations] = bytes_of(2);
    const auto [more, more_evaluations] = bytes_of(10);
    EXPECT_LE(more - few, 1024.0 * (more_evaluations - few_evaluations));
  }
}

// Seeds that move as they do from step to step, then more and fewer of them.
TEST_P(Parities, WhatIsKeptBetweenDiagramsDoesNotShow) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TriangleMesh mesh = torus(40, 24);
  const Surface surface(mesh);
  const std::unique_ptr<Backend> backend = backend_for(surface, GetParam());
  SplitMix64 random(18);
  const auto check = [&](const std::vector<Vec3>& seeds, const char* what) {
    SCOPED_TRACE(what);
    const Diagram reference = test::diagram_of(surface, seeds, NeighbourSource::nearest);
    expect_parity(surface, reference, diagram_of(*backend, seeds), GetParam().processor);
  };
  std::vector<Vec3> seeds = random_seeds(mesh, 500, 19);
  check(seeds, "start");
  for (double step : {1e-9, 1e-3, 0.02, 0.3}) {
    for (Vec3& x : seeds) x += step * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    check(seeds, "moved");
  }
  std::reverse(seeds.begin(), seeds.end());
  check(seeds, "reversed");
  check(random_seeds(mesh, 3000, 20), "more");
  check(random_seeds(mesh, 5, 21), "fewer");
}

// --- Whole runs ---

struct Optimised {
  std::vector<Vec3> seeds;
  double energy;
};

Optimised optimised_on(Backend& backend, std::vector<Vec3> seeds) {
  FreeRun free(backend, std::move(seeds));
  optimise_both(free.run, 30, 5);
  return {free.seeds(), free.run.energy};
}

MeshTopology dual_topology(Backend& backend, const std::vector<Vec3>& seeds) {
  const TriangleMesh mesh = dual_mesh(seeds, extract_dual(diagram_of(backend, seeds).polygons));
  return analyse_topology(mesh.triangles, mesh.vertices.size());
}

TEST_P(Parities, AnOptimisationIsTheCpus) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TriangleMesh mesh = torus(48, 32);
  const Surface surface(mesh);
  const std::vector<Vec3> start = random_seeds(mesh, 800, 22);
  CpuBackend cpu(surface, NeighbourSource::nearest);
  const std::unique_ptr<Backend> backend = backend_for(surface, GetParam());
  const Optimised reference = optimised_on(cpu, start), found = optimised_on(*backend, start);
  EXPECT_NEAR(found.energy, reference.energy, 1e-4 * reference.energy);
  const MeshTopology want = analyse_topology(mesh.triangles, mesh.vertices.size());
  EXPECT_TRUE(same_topology(dual_topology(cpu, reference.seeds), want));
  EXPECT_TRUE(same_topology(dual_topology(*backend, found.seeds), want));
  EXPECT_TRUE(same_bits(optimised_on(*backend, start).seeds, found.seeds)) << "not repeated";
  if (GetParam().processor != Processor::single) {
    EXPECT_TRUE(same_bits(found.seeds, reference.seeds)) << "not the CPU's bits";
  }
}

void expect_good_mesh(const RemeshResult& result, const RemeshOptions& options) {
  EXPECT_EQ(result.mesh.vertices.size(), options.vertices);
  EXPECT_EQ(result.untiled, 0u);
  EXPECT_TRUE(result.topology.manifold);
  EXPECT_TRUE(result.topology.closed);
  EXPECT_EQ(result.topology.euler, result.input_topology.euler);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
  const QualityReport quality = measure_quality(result.mesh);
  EXPECT_GT(quality.theta_min, 25);
  EXPECT_GT(quality.q_ave, 0.9);
  EXPECT_GT(quality.theta_min_ave, 50);
  EXPECT_GT(quality.valence6, 0.7);
}

TEST_P(Parities, ARemeshedTorusIsAsGoodAsTheCpus) {
  SKIP_WITHOUT_DEVICE(GetParam().processor);
  const TriangleMesh mesh = torus(48, 32);
  RemeshOptions options;
  options.vertices = 1200;
  options.compute = options_of({Processor::cpu, NeighbourSource::nearest});
  const RemeshResult reference = remesh(mesh, options);
  options.compute = options_of(GetParam());
  const RemeshResult found = remesh(mesh, options);
  expect_good_mesh(reference, options);
  expect_good_mesh(found, options);
  if (GetParam().processor != Processor::single) {
    EXPECT_TRUE(found.mesh.triangles == reference.mesh.triangles);
    EXPECT_TRUE(same_bits(found.mesh.vertices, reference.mesh.vertices)) << "not the CPU's bits";
  }
}

// --- Certification ---

struct CertificationCase {
  Processor processor;
  const char* model;
  bool grid;
};

void PrintTo(const CertificationCase& instance, std::ostream* out) { *out << instance.model; }

class Certified : public testing::TestWithParam<CertificationCase> {};

// Ten times the share that random seeds may have is granted to grids.
TEST_P(Certified, FewPairsReachTheCpu) {
  const auto& [processor, model, grid] = GetParam();
  SKIP_WITHOUT_DEVICE(processor);
  const std::string path = shared_model(model);
  if (path.empty()) GTEST_SKIP() << "no shared data";
  const Surface surface(read_mesh(path));
  const std::vector<Vec3> seeds = grid ? grid_seeds(surface.mesh, 27, 27, 27) : random_seeds(surface.mesh, 20000, 23);
  host::VulkanOptions options;
  options.precision = precision_of(processor);
  options.double_rung = false;
  const std::unique_ptr<Backend> backend =
      host::make_vulkan_backend(surface, SharedDevice::for_processor(processor), options);
  const Evaluated found = diagram_of(*backend, seeds);
  expect_parity(surface, test::diagram_of(surface, seeds, NeighbourSource::nearest), found, processor);
  const Certification& counts = found.report.certification;
  EXPECT_EQ(counts.doubled, 0u);
  EXPECT_LE(counts.wider, counts.pairs);
  const double most = (processor == Processor::single ? 2e-3 : 1e-4) * (grid ? 10 : 1);
  EXPECT_LT(static_cast<double>(counts.cpu), most * static_cast<double>(counts.pairs));
  RecordProperty("pairs", std::to_string(counts.pairs));
  RecordProperty("uncertain", std::to_string(counts.uncertain));
  RecordProperty("wider", std::to_string(counts.wider));
  RecordProperty("cpu", std::to_string(counts.cpu));
}

std::vector<CertificationCase> certification_cases() {
  std::vector<CertificationCase> cases;
  for (const char* model : {"bunny.off", "anchor.off"})
    for (bool grid : {false, true})
      for (Processor processor : {Processor::single, Processor::double_}) cases.push_back({processor, model, grid});
  return cases;
}

std::string certification_case_name(const testing::TestParamInfo<CertificationCase>& instance) {
  const auto& [processor, model, grid] = instance.param;
  return test_name(std::string(processor == Processor::single ? "single_" : "double_") + model +
                   (grid ? "_grid" : "_random"));
}

INSTANTIATE_TEST_SUITE_P(Parity, Certified, testing::ValuesIn(certification_cases()), certification_case_name);

}  // namespace
}  // namespace bisector::test
