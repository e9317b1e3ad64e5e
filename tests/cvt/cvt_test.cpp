// The optimiser: gradients against finite differences, L-BFGS on a quadratic, and the guards of the loop.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "backend/project.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "cvt/host_descent.h"
#include "cvt/lbfgs.h"
#include "cvt/multilevel.h"
#include "cvt/optimise.h"
#include "mesh/topology.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/run.h"

namespace bisector::test {
namespace {

std::vector<double> varied_density(const TriangleMesh& mesh) {
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(0.25 + std::exp(v.x) + v.y * v.y);
  return density;
}

double energy_at(Backend& backend, const std::vector<Vec3>& seeds) {
  return evaluated(backend, seeds, Want::moments).moments.energy;
}

double distance_to_surface(const Surface& surface, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const Facet& f : surface.facets)
    best = std::min(best, norm2(nearest_on_triangle(p, f.corners[0], f.corners[1], f.corners[2]) - p));
  return std::sqrt(best);
}

// --- Gradient ---

// Along a direction, central differences converge to the slope with the square of the step.
void expect_gradient(const Surface& surface, const std::vector<Vec3>& seeds, std::uint64_t random_seed) {
  CpuBackend backend(surface, NeighbourSource::nearest);
  const CellMoments moments = evaluated(backend, seeds, Want::moments).moments;
  SplitMix64 random(random_seed);
  for (int trial = 0; trial < 4; ++trial) {
    std::vector<Vec3> direction(seeds.size());
    double slope = 0, size = 0;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      direction[i] = {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
      const Moments& m = moments.cells[i];
      // 2 m (x - c), with positions relative to the seed.
      const Vec3 gradient = m.mass > 0 ? -2.0 * m.mass * ((1 / m.mass) * m.first) : Vec3{};
      slope += dot(gradient, direction[i]);
      size += norm(gradient);
    }
    double errors[3];
    const double steps[3] = {1e-4, 2.5e-5, 6.25e-6};
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec3> plus = seeds, minus = seeds;
      for (std::size_t i = 0; i < seeds.size(); ++i) {
        plus[i] += steps[k] * direction[i];
        minus[i] -= steps[k] * direction[i];
      }
      const double difference = (energy_at(backend, plus) - energy_at(backend, minus)) / (2 * steps[k]);
      errors[k] = std::abs(difference - slope);
    }
    EXPECT_LE(errors[2], 1e-7 * size);
    // The energy's third derivative jumps where the combinatorics change, so 16 per step is not to be had everywhere.
    EXPECT_LE(errors[1], errors[0] / 4 + 1e-9 * size);
    EXPECT_LE(errors[2], errors[1] / 4 + 1e-9 * size);
  }
}

TEST(Gradient, IsThatOfTheEnergy) {
  for (const TriangleMesh& mesh : {icosphere(3), torus(24, 16), wavy_patch(12), box(2), pages()})
    for (std::size_t count : {12u, 60u}) {
      const std::vector<Vec3> seeds = random_seeds(mesh, count, 1);
      expect_gradient(Surface(mesh), seeds, 2);
      expect_gradient(Surface(mesh, varied_density(mesh)), seeds, 3);
    }
}

TEST(Gradient, OfTheStateIsTangentialIfConstrained) {
  const TriangleMesh mesh = icosphere(3);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  for (bool constrained : {false, true}) {
    FreeRun free(backend, random_seeds(mesh, 80, 4));
    OptimiseOptions options;
    options.iterations = 7;
    options.constrained = constrained;
    optimise(free.run, options);
    const Diagram diagram = diagram_of(backend, free.seeds());
    expect_same_moments(free.moments(), diagram.moments);
    EXPECT_EQ(free.run.energy, diagram.moments.energy);
    const CvtGradient gradient = complete(free.run, constrained);
    EXPECT_EQ(gradient.normals.size(), constrained ? free.seeds().size() : 0);
    double squared = 0;
    for (std::size_t i = 0; i < free.seeds().size(); ++i) {
      Vec3 g = -2.0 * diagram.moments.cells[i].first;
      if (constrained) {
        EXPECT_NEAR(norm(gradient.normals[i]), 1, 1e-12);
        g -= dot(g, gradient.normals[i]) * gradient.normals[i];
      }
      EXPECT_LE(norm(gradient.vectors[i] - g), 1e-14);
      squared += norm2(g);
    }
    EXPECT_NEAR(free.run.gradient_norm, std::sqrt(squared), 1e-12);
  }
}

// --- L-BFGS ---

double quadratic(const std::vector<double>& curvature, const std::vector<Vec3>& x, std::vector<Vec3>& gradient) {
  gradient.resize(x.size());
  double value = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    gradient[i] = curvature[i] * x[i];
    value += 0.5 * dot(x[i], gradient[i]);
  }
  return value;
}

double inner(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += dot(a[i], b[i]);
  return sum;
}

// L-BFGS over vectors on the host.
class History {
 public:
  History(std::size_t memory, const std::vector<double>& diagonal) : lbfgs_(memory) {
    for (const double d : diagonal) weights_.push_back(1 / d);
  }

  std::vector<Vec3> direction(const std::vector<Vec3>& gradient) {
    gradient_ = gradient;
    lbfgs_.set_direction(vectors_);
    return vectors_.direction;
  }
  void push(const std::vector<Vec3>& s, const std::vector<Vec3>& y) {
    vectors_.pairs[lbfgs_.free_pair()] = {s, y};
    lbfgs_.push(inner(s, y), inner(s, s), inner(y, y));
  }
  void clear() { lbfgs_.clear(); }

 private:
  Lbfgs lbfgs_;
  std::vector<Vec3> gradient_;
  std::vector<double> weights_;
  HostVectors vectors_{gradient_, weights_};
};

// With exact line searches and full memory L-BFGS runs through conjugate directions (Nocedal and Wright, theorem 7.4
// and section 7.2): as many steps as there are distinct eigenvalues.
TEST(Lbfgs, MinimisesAQuadraticInAsManyStepsAsEigenvalues) {
  constexpr std::size_t n = 40;
  std::vector<double> curvature, diagonal;
  SplitMix64 random(5);
  for (std::size_t i = 0; i < n; ++i) {
    curvature.push_back(std::pow(2.0, static_cast<double>(i % 7)));
    diagonal.push_back(1);
  }
  std::vector<Vec3> x(n), gradient;
  for (Vec3& p : x) p = {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
  double value = quadratic(curvature, x, gradient);
  const double first = std::sqrt(inner(gradient, gradient));
  History history(10, diagonal);
  for (int step = 0; step < 7; ++step) {
    const std::vector<Vec3> direction = history.direction(gradient);
    const double slope = inner(gradient, direction);
    ASSERT_LT(slope, 0);
    double bend = 0;
    for (std::size_t i = 0; i < n; ++i) bend += curvature[i] * norm2(direction[i]);
    std::vector<Vec3> next = x, next_gradient, s(n), y(n);
    for (std::size_t i = 0; i < n; ++i) next[i] += (-slope / bend) * direction[i];
    const double next_value = quadratic(curvature, next, next_gradient);
    ASSERT_LE(next_value, value);
    for (std::size_t i = 0; i < n; ++i) {
      s[i] = next[i] - x[i];
      y[i] = next_gradient[i] - gradient[i];
    }
    history.push(s, y);
    x = next;
    gradient = next_gradient;
    value = next_value;
  }
  EXPECT_LE(std::sqrt(inner(gradient, gradient)), 1e-9 * first);
}

TEST(Lbfgs, TakesTheNewtonStepWhereTheDiagonalIsTheHessian) {
  const std::vector<double> curvature{1, 3, 10};
  std::vector<Vec3> x{{1, 2, 3}, {-1, 0, 1}, {0.5, 0.5, 0.5}}, gradient;
  quadratic(curvature, x, gradient);
  History history(7, curvature);
  for (int push = 0; push < 2; ++push) {
    const std::vector<Vec3> step = history.direction(gradient);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LE(norm(step[i] + x[i]), 1e-14);
    // A pair of the same quadratic: gamma is 1 whatever the scale of the diagonal.
    const std::vector<Vec3> s{{1, 0, 0}, {0, 1, 0}, {1, 1, 1}};
    std::vector<Vec3> y;
    quadratic(curvature, s, y);
    history.push(s, y);
  }
}

TEST(Lbfgs, SatisfiesTheSecantEquationAndForgetsOldPairs) {
  SplitMix64 random(6);
  const std::size_t n = 5;
  const std::vector<double> diagonal{1, 2, 3, 4, 5};
  const auto vector = [&] {
    std::vector<Vec3> v(n);
    for (Vec3& p : v) p = {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    return v;
  };
  History history(2, diagonal), fresh(2, diagonal);
  std::vector<std::vector<Vec3>> ss, ys;
  for (int k = 0; k < 6; ++k) {
    const std::vector<Vec3> s = vector();
    std::vector<Vec3> y = s;
    for (std::size_t i = 0; i < n; ++i) y[i] *= 1 + random.unit() * static_cast<double>(i);
    history.push(s, y);
    ss.push_back(s);
    ys.push_back(y);
    // H y = s.
    const std::vector<Vec3> got = history.direction(y);
    for (std::size_t i = 0; i < n; ++i) EXPECT_LE(norm(got[i] + s[i]), 1e-13);
  }
  for (std::size_t k = 4; k < 6; ++k) fresh.push(ss[k], ys[k]);
  const std::vector<Vec3> g = vector();
  EXPECT_TRUE(same_bits(history.direction(g), fresh.direction(g)));
  history.push(ss[0], {n, Vec3{}});  // no curvature: dropped
  std::vector<Vec3> opposite = ss[0];
  for (Vec3& p : opposite) p *= -1;
  history.push(ss[0], opposite);
  EXPECT_TRUE(same_bits(history.direction(g), fresh.direction(g)));
  history.clear();
  const std::vector<Vec3> plain = history.direction(g);
  for (std::size_t i = 0; i < n; ++i) EXPECT_LE(norm(plain[i] + (1 / diagonal[i]) * g[i]), 1e-15);
}

// --- The loop ---

// Every process lists all cases, so meshes are only made by the tests that run.
struct LoopCase {
  std::string name;
  std::function<TriangleMesh()> make;
  bool dense, constrained;
};

std::vector<LoopCase> loop_cases() {
  std::vector<LoopCase> cases;
  for (bool dense : {false, true})
    for (bool constrained : {false, true}) {
      const std::string suffix = std::string(dense ? "_dense" : "") + (constrained ? "_constrained" : "");
      cases.push_back({"sphere" + suffix, [] { return icosphere(4); }, dense, constrained});
      cases.push_back({"torus" + suffix, [] { return torus(40, 24); }, dense, constrained});
      cases.push_back({"patch" + suffix, [] { return wavy_patch(20); }, dense, constrained});
      cases.push_back({"box" + suffix, [] { return box(8); }, dense, constrained});
      cases.push_back({"pages" + suffix, [] { return pages(); }, dense, constrained});
      cases.push_back({"soup" + suffix, [] { return soup(30, 3); }, dense, constrained});
    }
  return cases;
}

void PrintTo(const LoopCase& problem, std::ostream* out) { *out << problem.name; }

class Loop : public testing::TestWithParam<LoopCase> {
 protected:
  const TriangleMesh mesh = GetParam().make();
  const Surface surface{mesh, GetParam().dense ? varied_density(mesh) : std::vector<double>{}};
};

TEST_P(Loop, NeverGoesUphillAndReducesTheGradient) {
  CpuBackend backend(surface, NeighbourSource::nearest);
  const std::vector<Vec3> start = random_seeds(mesh, 200, 7);
  const double before = energy_at(backend, start);
  OptimiseOptions options;
  options.iterations = 60;
  options.constrained = GetParam().constrained;
  options.tolerance = 0;
  options.phase = "phase";
  options.done = 0.25;
  options.share = 0.5;
  double fraction = 0.25;
  std::vector<double> energies{before}, gradients;
  Context context;
  context.progress = [&](const Progress& p) {
    EXPECT_EQ(p.phase, "phase");
    EXPECT_GE(p.fraction, fraction);
    EXPECT_LE(p.fraction, 0.75);
    fraction = p.fraction;
    EXPECT_EQ(p.iteration, static_cast<int>(energies.size()));
    EXPECT_EQ(p.iterations, 60);
    EXPECT_LT(p.energy, energies.back());
    energies.push_back(p.energy);
    gradients.push_back(p.gradient_norm);
  };
  FreeRun free(backend, start, context);
  optimise(free.run, options);
  ASSERT_GT(energies.size(), 5u);
  EXPECT_EQ(free.run.totals.iterations, static_cast<int>(energies.size()) - 1);
  EXPECT_GE(free.run.totals.evaluations, free.run.totals.iterations);
  EXPECT_EQ(free.run.energy, energies.back());
  EXPECT_EQ(free.run.gradient_norm, gradients.back());
  EXPECT_EQ(free.run.energy, energy_at(backend, free.seeds()));
  EXPECT_LT(free.run.energy, 0.95 * before);
  EXPECT_LT(free.run.gradient_norm, 0.25 * gradients.front());
  EXPECT_EQ(free.seeds().size(), 200u);
  for (const Moments& m : free.moments().cells) EXPECT_GT(m.mass, 0);
  if (!GetParam().constrained) return;
  for (const Vec3& x : free.seeds()) EXPECT_LE(distance_to_surface(surface, x), 1e-12 * surface.box.diagonal());
}

TEST_P(Loop, RepeatsBitForBitForAnyNumberOfThreadsAndBothSources) {
  std::vector<std::vector<Vec3>> results;
  for (NeighbourSource source : {NeighbourSource::nearest, NeighbourSource::delaunay})
    for (unsigned threads : {1u, 2u}) {
      const ThreadLimit limit(threads);
      CpuBackend backend(surface, source);
      OptimiseOptions options;
      options.iterations = 30;
      options.constrained = GetParam().constrained;
      results.push_back(optimised_seeds(backend, random_seeds(mesh, 150, 8), options));
    }
  EXPECT_TRUE(same_bits(results[0], results[1])) << "1 and 2 threads, nearest";
  EXPECT_TRUE(same_bits(results[2], results[3])) << "1 and 2 threads, delaunay";
  EXPECT_TRUE(same_bits(results[0], results[2])) << "nearest and delaunay";
}

// Cells emptied by equal seeds are filled again.
TEST_P(Loop, ReseedsEmptyCells) {
  CpuBackend backend(surface, NeighbourSource::nearest);
  const Vec3 spot = random_seeds(mesh, 1, 9)[0];
  SplitMix64 random(10);
  for (bool equal : {true, false}) {
    std::vector<Vec3> start;
    for (int i = 0; i < 100; ++i) {
      const Vec3 noise{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
      start.push_back(equal ? spot : spot + 1e-3 * noise);
    }
    OptimiseOptions options;
    options.iterations = 60;
    options.constrained = GetParam().constrained;
    FreeRun free(backend, start);
    optimise(free.run, options);
    EXPECT_EQ(free.seeds().size(), 100u);
    std::size_t empty = 0;
    for (const Moments& m : free.moments().cells) empty += !(m.mass > 0);
    EXPECT_EQ(empty, 0u) << (equal ? "equal" : "clustered");
    // A worse start than random seeds, but not another kind of result.
    FreeRun random_start(backend, random_seeds(mesh, 100, 11));
    optimise(random_start.run, options);
    EXPECT_LT(free.run.energy, 1.5 * random_start.run.energy) << (equal ? "equal" : "clustered");
  }
}

INSTANTIATE_TEST_SUITE_P(Optimise, Loop, testing::ValuesIn(loop_cases()),
                         [](const auto& instance) { return instance.param.name; });

TEST(Optimise, StopsWhenCancelled) {
  const TriangleMesh mesh = icosphere(3);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  std::atomic<bool> cancel{false};
  Context context;
  context.cancel = &cancel;
  int iterations = 0;
  context.progress = [&](const Progress&) { cancel = ++iterations == 3; };
  FreeRun free(backend, random_seeds(mesh, 50, 12), context);
  EXPECT_THROW(optimise(free.run, {}), Cancelled);
  EXPECT_EQ(iterations, 3);
}

TEST(Optimise, StopsAtTheToleranceAndTheIterations) {
  const TriangleMesh mesh = icosphere(3);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  std::vector<Vec3> seeds;
  const auto run = [&](const OptimiseOptions& options) {
    std::vector<double> energies;
    Context context;
    context.progress = [&](const Progress& p) { energies.push_back(p.energy); };
    FreeRun free(backend, random_seeds(mesh, 50, 13), context);
    optimise(free.run, options);
    EXPECT_EQ(energies.size(), static_cast<std::size_t>(free.run.totals.iterations));
    seeds = free.seeds();
    return energies;
  };
  OptimiseOptions options;
  options.iterations = 0;
  EXPECT_EQ(run(options).size(), 0u);
  EXPECT_TRUE(same_bits(seeds, random_seeds(mesh, 50, 13)));
  options.iterations = 4;
  EXPECT_EQ(run(options).size(), 4u);
  options.iterations = 2000;
  options.tolerance = 1e-3;
  const std::vector<double> loose = run(options);
  ASSERT_GT(loose.size(), 6u);
  ASSERT_LT(loose.size(), 2000u);
  // Below the tolerance over the last five steps, and over no five before.
  for (std::size_t k = 5; k < loose.size(); ++k)
    EXPECT_EQ(loose[k - 5] - loose[k] < 5 * 1e-3 * loose[k], k + 1 == loose.size()) << k;
  options.tolerance = 1e-7;
  const std::vector<double> tight = run(options);
  EXPECT_GT(tight.size(), loose.size());
  EXPECT_TRUE(std::equal(loose.begin(), loose.end(), tight.begin()));
}

// The minimum for one seed is the centroid of the surface, for the free energy.
TEST(Optimise, OneSeedFindsTheCentroid) {
  const TriangleMesh mesh = wavy_patch(8);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  FreeRun free(backend, {{0.1, 0.2, 0.7}});
  const Vec3 centroid = free.seeds()[0] + (1 / free.moments().mass) * free.moments().cells[0].first;
  optimise(free.run, {});
  EXPECT_LE(norm(free.seeds()[0] - centroid), 1e-12);
  EXPECT_LE(free.run.totals.iterations, 10);
}

// A diagram belongs to the seeds that it was computed for: as long as they stay it is not computed again, and never
// used for others.
TEST(CvtRunTest, EvaluatesTheSameSeedsOnce) {
  const TriangleMesh mesh = torus(24, 16);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  FreeRun free(backend, random_seeds(mesh, 60, 3));
  CvtRun& run = free.run;
  run.diagram(Want::polygons);
  run.diagram();
  EXPECT_EQ(run.totals.evaluations, 1);
  run.diagram(Want::polygons | Want::dual);
  EXPECT_EQ(run.totals.evaluations, 1) << "the dual is read off the polygons";
  const PlacedSeeds before = run.seeds;
  run.seeds.edit_places()[0].kind = SeedPlace::Kind::fixed;
  run.diagram(Want::polygons);
  EXPECT_EQ(run.totals.evaluations, 1) << "places are no part of a diagram";
  run.seeds.edit_positions()[0] += Vec3{0.01, 0, 0};
  expect_same_moments(run.diagram().moments, diagram_of(backend, run.seeds.positions()).moments);
  EXPECT_EQ(run.totals.evaluations, 2);
  const DiagramOfSeeds moved = run.take_diagram();
  run.adopt(run.seeds, moved);
  run.diagram();
  EXPECT_EQ(run.totals.evaluations, 2);
  run.adopt(before, moved);
  expect_same_moments(run.diagram().moments, diagram_of(backend, before.positions()).moments);
  EXPECT_EQ(run.totals.evaluations, 3) << "a diagram of other seeds is not taken for theirs";
  run.seeds.remove(std::vector<Index>{1, 5});
  EXPECT_EQ(run.diagram().moments.cells.size(), 58u);
  EXPECT_EQ(run.totals.evaluations, 4);
}

// --- Constraint ---

// They may lie off the surface, as corners do where a coarser one stands in.
TEST(Constrain, FixedSeedsStayToTheBit) {
  const TriangleMesh mesh = icosphere(2);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  FreeRun free(backend, random_seeds(mesh, 60, 4));
  PlacedSeeds& seeds = free.run.seeds;
  const auto corner = [&](Index i) { return 1.01 * mesh.vertices[7 * i]; };
  for (Index i = 0; i < 20; ++i) seeds.put(i, corner(i), {SeedPlace::Kind::fixed, kNone, i, 0});
  optimise_both(free.run, 5, 5);
  EXPECT_GT(free.run.totals.iterations, 8);
  for (Index i = 0; i < 20; ++i) EXPECT_EQ(seeds.position(i), corner(i)) << i;
}

TEST(Constrain, NearestOnTriangleIsTheNearest) {
  SplitMix64 random(14);
  const auto point = [&] { return Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; };
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 a = point(), b = point(), c = trial % 10 ? point() : a + 1e-4 * point(), p = 2.0 * point();
    const Vec3 q = nearest_on_triangle(p, a, b, c);
    // On the triangle.
    const Vec3 n = cross(b - a, c - a);
    const double n2 = norm2(n);
    EXPECT_LE(std::abs(dot(n, q - a)), 1e-13 * std::sqrt(n2));
    const double tolerance = 1e-10;
    EXPECT_GE(dot(n, cross(b - q, c - q)) / n2, -tolerance);
    EXPECT_GE(dot(n, cross(c - q, a - q)) / n2, -tolerance);
    EXPECT_GE(dot(n, cross(a - q, b - q)) / n2, -tolerance);
    // The plane through q across p - q has the whole triangle behind it: no point of it is nearer.
    for (const Vec3& corner : {a, b, c}) EXPECT_LE(dot(p - q, corner - q), 1e-11);
  }
}

TEST(Constrain, NearestOnTriangleOfCornersEdgesAndFaces) {
  const Vec3 a{0, 0, 0}, b{2, 0, 0}, c{0, 2, 0};
  EXPECT_EQ(nearest_on_triangle({-1, -1, 5}, a, b, c), a);
  EXPECT_EQ(nearest_on_triangle({4, -1, 5}, a, b, c), b);
  EXPECT_EQ(nearest_on_triangle({-1, 4, 5}, a, b, c), c);
  EXPECT_EQ(nearest_on_triangle({1, -3, 5}, a, b, c), (Vec3{1, 0, 0}));
  EXPECT_EQ(nearest_on_triangle({-3, 1, 5}, a, b, c), (Vec3{0, 1, 0}));
  EXPECT_EQ(nearest_on_triangle({2, 2, 5}, a, b, c), (Vec3{1, 1, 0}));
  EXPECT_EQ(nearest_on_triangle({0.5, 0.5, 5}, a, b, c), (Vec3{0.5, 0.5, 0}));
}

// Two parallel sheets: a seed between them goes to the sheet of its own cell, though the other one may be nearer.
TEST(Constrain, ProjectsToTheOwnCellAndNotThroughAThinPart) {
  const TriangleMesh mesh{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.1}, {1, 0, 0.1}, {0, 1, 0.1}}, {{0, 2, 1}, {3, 4, 5}}, {}};
  const Surface surface(mesh);
  Csr<Index> cells;
  cells.offsets = {0, 1, 2, 2};
  cells.values = {0, 1};
  std::vector<Vec3> seeds{{0.25, 0.25, 0.09}, {0.25, 0.25, 0.01}, {5, 5, 5}};
  std::vector<Vec3> normals(3, Vec3{1, 0, 0});
  project_to_cells(surface, cells, {}, seeds, normals);
  EXPECT_LE(norm(seeds[0] - Vec3{0.25, 0.25, 0}), 1e-15);
  EXPECT_LE(norm(seeds[1] - Vec3{0.25, 0.25, 0.1}), 1e-15);
  EXPECT_EQ(seeds[2], (Vec3{5, 5, 5}));
  EXPECT_EQ(normals[0], (Vec3{0, 0, -1}));
  EXPECT_EQ(normals[1], (Vec3{0, 0, 1}));
  EXPECT_EQ(normals[2], (Vec3{1, 0, 0}));
}

// --- Levels ---

TEST(Multilevel, LevelsFollowTheCountOfEdgeMidpoints) {
  for (long long euler : {2, 0, -4})
    for (std::size_t count : {400u, 1000u, 9973u, 100'000u}) {
      const std::vector<std::size_t> counts = level_counts(count, euler, 1, 0);
      ASSERT_FALSE(counts.empty());
      EXPECT_EQ(counts.back(), count);
      EXPECT_LE(counts.size(), 3u);
      for (std::size_t k = 1; k < counts.size(); ++k) {
        // 4 V - 3 chi, to the nearest V.
        const double refined = 4.0 * static_cast<double>(counts[k - 1]) - 3.0 * static_cast<double>(euler);
        EXPECT_LE(std::abs(refined - static_cast<double>(counts[k])), 2);
      }
      if (counts.size() == 3) {
        // DESIGN: a closed surface starts at round((N + 15 chi) / 16), here after two roundings.
        EXPECT_NEAR(static_cast<double>(counts[0]),
                    (static_cast<double>(count) + 15.0 * static_cast<double>(euler)) / 16, 1);
      }
    }
  EXPECT_EQ(level_counts(10'000, 2, 1, 1), (std::vector<std::size_t>{10'000}));
  EXPECT_EQ(level_counts(10'000, 2, 1, 2).size(), 2u);
  EXPECT_EQ(level_counts(4, 2, 1, 0), (std::vector<std::size_t>{4}));
  // Every closed component keeps enough seeds for a tetrahedron.
  for (std::size_t components : {1u, 10u, 300u})
    for (int levels : {0, 3, 5})
      for (std::size_t n : level_counts(3000, 2 * static_cast<long long>(components), components, levels))
        EXPECT_GE(n, 4 * components);
}

TEST(Multilevel, RefiningAClosedDualGivesTheCountOfTheFormula) {
  struct Named {
    TriangleMesh mesh;
    long long euler;
  };
  for (const auto& [mesh, euler] : std::vector<Named>{{icosphere(4), 2}, {torus(60, 40), 0}}) {
    const Surface surface(mesh);
    CpuBackend backend(surface, NeighbourSource::nearest);
    FreeRun free(backend, initial_seeds(surface, 400, 1));
    optimise(free.run, {});
    const Diagram& diagram = free.run.diagram(Want::polygons | Want::dual);
    ASSERT_EQ(analyse_topology(diagram.dual.triangles, 400).euler, euler);
    const auto all = static_cast<std::size_t>(4 * 400 - 3 * euler);
    EXPECT_EQ(extract_dual_edges(diagram.polygons, free.seeds()).size(), all - 400);
    const double spacing = std::sqrt(surface.area / 400);
    for (std::size_t count : {std::size_t{400}, std::size_t{401}, all / 2, all - 1, all, all + 1, all + 90}) {
      const std::vector<Vec3> finer = refine(diagram, free.run.seeds, free.curves, {}, count).positions();
      EXPECT_EQ(finer.size(), count);
      EXPECT_TRUE(std::equal(free.seeds().begin(), free.seeds().end(), finer.begin()));
      // Between neighbours: on the surface, or as far from it as the middle of two seeds on either side of a bulge.
      for (std::size_t i = 400; i < finer.size(); ++i) EXPECT_LE(distance_to_surface(surface, finer[i]), 0.2 * spacing);
    }
  }
}

TEST(Multilevel, SetCountComesAsNearAsOneSeedPerCellAllows) {
  for (const TriangleMesh& mesh : {icosphere(3), torus(24, 16), wavy_patch(12), pages(), soup(20, 4)}) {
    const Surface surface(mesh);
    CpuBackend backend(surface, NeighbourSource::nearest);
    const std::vector<Vec3> seeds = random_seeds(mesh, 300, 15);
    const Diagram diagram = diagram_of(backend, seeds);
    for (std::size_t count : {150u, 290u, 299u, 300u, 301u, 310u, 450u, 600u}) {
      PlacedSeeds changed(seeds);
      set_count(diagram, count, changed);
      if (count <= 310) {
        EXPECT_EQ(changed.size(), count);
      } else {
        // Cells share corners, and no corner is taken twice.
        EXPECT_LE(changed.size(), count);
        EXPECT_GT(changed.size(), 420u);
      }
      std::set<std::array<double, 3>> distinct;
      for (const Vec3& x : changed.positions()) distinct.insert({x.x, x.y, x.z});
      EXPECT_EQ(distinct.size(), changed.size()) << count;
    }
    PlacedSeeds doubled(seeds);
    set_count(diagram, 5000, doubled);
    EXPECT_GT(doubled.size(), 300u);
    EXPECT_LE(doubled.size(), 600u);
  }
}

// Seeds are removed where they are dense for the density, not where they are dense: both halves keep their shares.
TEST(Multilevel, SetCountKeepsToTheDensity) {
  const TriangleMesh mesh = grid_patch(16, 16);
  std::vector<double> density;
  for (const Vec3& p : mesh.vertices) density.push_back(std::pow(1 + 0.15 * p.x, -4));
  const Surface surface(mesh, density);
  CpuBackend backend(surface, NeighbourSource::nearest);
  OptimiseOptions options;
  options.iterations = 100;
  FreeRun free(backend, initial_seeds(surface, 500, 3));
  optimise(free.run, options);
  std::vector<double> x;
  for (const Vec3& p : free.seeds()) x.push_back(p.x);
  std::nth_element(x.begin(), x.begin() + 250, x.end());
  const double middle = x[250];
  EXPECT_LT(middle, 6);
  set_count(free.run.diagram(Want::polygons), 400, free.run.seeds);
  ASSERT_EQ(free.run.seeds.size(), 400u);
  const auto dense =
      std::count_if(free.seeds().begin(), free.seeds().end(), [&](const Vec3& p) { return p.x < middle; });
  EXPECT_NEAR(static_cast<double>(dense), 200, 20);
}

// One call removes what the dual edges allow; on a connected surface repeating it gets to any count.
TEST(Multilevel, SetCountGetsFarByRepetition) {
  const TriangleMesh mesh = torus(24, 16);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  for (std::size_t count : {4u, 50u, 2000u}) {
    FreeRun free(backend, random_seeds(mesh, 300, 15));
    meet_count(free.run, count);
    EXPECT_EQ(free.run.seeds.size(), count);
    EXPECT_LE(free.run.totals.evaluations, 8);
  }
}

// Seeds that were optimised for one length, with another near a corner: after following it, ten steps lead less than
// half as far from the energy of a start with seeds drawn for it as they do otherwise. More lead to about that energy,
// with as many seeds near the corner as its share of the integral of sqrt(rho).
TEST(Multilevel, SeedsFollowAnotherDensity) {
  const TriangleMesh mesh = grid_patch(16, 16);
  const Surface uniform(mesh);
  CpuBackend before(uniform, NeighbourSource::nearest);
  FreeRun start(before, initial_seeds(uniform, 500, 3));
  optimise(start.run, {});
  for (const double least : {0.3, 0.5}) {
    SCOPED_TRACE(least);
    const auto length = [&](const Vec3& p) { return std::min(1.0, least + 0.1 * norm(p)); };
    std::vector<double> density;
    for (const Vec3& p : mesh.vertices) density.push_back(std::pow(length(p), -4));
    double dense = 0, all = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3 middle = (1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
      const double h = length(middle), share = 1 / (h * h);
      all += share;
      if (norm(middle) < 4) dense += share;
    }
    const double wanted = 500 * dense / all;
    const Surface surface(mesh, density);
    CpuBackend backend(surface, NeighbourSource::nearest);
    const auto missing = [&](const std::vector<Vec3>& seeds) {
      const auto near = [](const Vec3& p) { return norm(p) < 4; };
      return wanted - static_cast<double>(std::count_if(seeds.begin(), seeds.end(), near));
    };
    const auto optimised = [&](const std::vector<Vec3>& seeds, int steps) {
      OptimiseOptions options;
      options.iterations = steps;
      return optimised_seeds(backend, seeds, options);
    };
    FreeRun led(backend, start.seeds());
    follow_density(led.run);
    ASSERT_EQ(led.seeds().size(), 500u);
    EXPECT_LT(missing(led.seeds()), 0.75 * missing(start.seeds()));
    const double fresh = energy_at(backend, optimised(initial_seeds(surface, 500, 3), 100));
    const double left = energy_at(backend, optimised(start.seeds(), 10));
    EXPECT_LT(energy_at(backend, optimised(led.seeds(), 10)) - fresh, 0.5 * (left - fresh));
    const std::vector<Vec3> end = optimised(led.seeds(), 50);
    EXPECT_NEAR(energy_at(backend, end), fresh, 0.005 * fresh);
    EXPECT_NEAR(missing(end), 0, 0.1 * wanted);
  }
  // Seeds that are spread as the density asks for stay where they are.
  const std::vector<Vec3> spread = start.seeds();
  follow_density(start.run);
  EXPECT_TRUE(same_bits(start.seeds(), spread));
}

TEST(Multilevel, InitialSeedsLieOnTheSurfaceAndOnEveryComponent) {
  TriangleMesh mesh = two_spheres();
  const std::size_t half = mesh.vertices.size() / 2;
  for (std::size_t v = half; v < mesh.vertices.size(); ++v) mesh.vertices[v] = 0.01 * mesh.vertices[v] + Vec3{3, 0, 0};
  const Surface surface(mesh);
  for (std::size_t count : {8u, 30u, 1000u}) {
    const std::vector<Vec3> seeds = initial_seeds(surface, count, 16);
    EXPECT_EQ(seeds.size(), count);
    std::size_t on_small = 0;
    for (const Vec3& x : seeds) {
      EXPECT_LE(distance_to_surface(surface, x), 1e-12 * surface.box.diagonal());
      on_small += x.x > 2;
    }
    EXPECT_GE(on_small, 4u);
    EXPECT_GE(count - on_small, 4u);
    EXPECT_TRUE(same_bits(initial_seeds(surface, count, 16), seeds));
    EXPECT_FALSE(same_bits(initial_seeds(surface, count, 17), seeds));
  }
  EXPECT_EQ(initial_seeds(surface, 4, 1).size(), 4u);
}

// Free optimal cells crowd where the density is high: with rho, spacing goes as rho^(-1/4), counts as rho^(1/2).
TEST(Multilevel, InitialSeedsFollowTheSquareRootOfTheDensity) {
  const TriangleMesh mesh = grid_patch(8, 8);
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(v.x <= 4 ? 16.0 : 1.0);
  const Surface surface(mesh, density);
  const std::vector<Vec3> seeds = initial_seeds(surface, 20'000, 18);
  std::size_t dense = 0, sparse = 0;
  for (const Vec3& x : seeds) {
    dense += x.x < 4;
    sparse += x.x > 5;  // beyond the column where the density falls
  }
  // 4 per unit area against 1, on areas of 32 and 24.
  EXPECT_NEAR(static_cast<double>(dense) / static_cast<double>(sparse), 4 * 32.0 / 24, 0.25);
}

}  // namespace
}  // namespace bisector::test
