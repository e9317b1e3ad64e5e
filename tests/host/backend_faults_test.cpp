// Failing and poor devices: a clear error or a counted fallback, never a wrong or partial result.
//
// Needs a Vulkan device or skips what does; BISECTOR_TEST_DEVICE names one ("vulkan:0") that then must be there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "backend/fallback_backend.h"
#include "bisector/error.h"
#include "check/parity.h"
#include "compute/compute.h"
#include "host/device/faults.h"
#include "host/passes/vulkan_backend.h"
#include "remesh/remesh.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/run.h"

namespace bisector::test {
namespace {

using host::Device;
using host::Fault;
using host::VulkanOptions;

// --- Devices ---

// A request for a device, preferably one with double precision and that is no software; nothing where there is none.
std::optional<DeviceRequest> device_request() {
  if (const char* named = std::getenv("BISECTOR_TEST_DEVICE")) return parse_device(named);
  static const DeviceList list = list_devices();
  for (const Precision precision : {Precision::double_, Precision::automatic})
    if (const auto gpu = best_gpu(list, precision)) return gpu;
  for (const bool float64 : {true, false})
    for (const DeviceDescription& device : list.devices)
      if (device.rejected.empty() && device.float64 >= float64) {
        return DeviceRequest{.kind = DeviceRequest::Kind::vulkan, .index = device.index};
      }
  return {};
}

bool has_double() {
  static const bool has = Device::open(device_request().value())->description().float64;
  return has;
}

std::string device_name() {
  static const std::string name = Device::open(device_request().value())->description().name;
  return name;
}

// Skips without a device, and without one that has the precision.
#define SKIP_WITHOUT_DEVICE(precision)                       \
  if (!device_request()) GTEST_SKIP() << "no Vulkan device"; \
  if ((precision) == Precision::double_ && !has_double()) GTEST_SKIP() << "no double precision"

std::unique_ptr<Backend> device_backend(const Surface& surface, const VulkanOptions& options) {
  return host::make_vulkan_backend(surface, Device::open(device_request().value()), options);
}

VulkanOptions with_precision(Precision precision) {
  VulkanOptions options;
  options.precision = precision;
  return options;
}

// No test leaves a fault behind.
class Faultless : public testing::Test {
 protected:
  void TearDown() override { host::inject_fault(Fault::none, 0); }
};

Context collecting(std::vector<std::string>& warnings) {
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  return context;
}

// --- Problems ---

Vec3 turned(double u, double v) { return {0.8 * u - 0.6 * v, 0.6 * u + 0.8 * v, 0}; }

// Seeds near the unit cube's bottom: few spread ones; a cluster, whose cells need wide lists; squares askew, the
// corners of which only exact arithmetic tells apart; and squares that are a little off, for double precision.
std::vector<Vec3> hard_seeds(const TriangleMesh& mesh, std::size_t spread) {
  SplitMix64 random(31);
  const auto shift = [&](double size) {
    return size * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
  };
  std::vector<Vec3> seeds = random_seeds(mesh, spread, 32);
  for (int k = 0; k < 60; ++k) seeds.push_back(Vec3{0.9, 0.1, 0} + shift(1e-3));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      seeds.push_back(Vec3{0.25, 0.25, 0} + turned(0.1 * i, 0.1 * j));
      seeds.push_back(Vec3{0.25, 0.75, 0} + turned(0.1 * i, 0.1 * j) + shift(1e-7));
    }
  return seeds;
}

std::vector<Vec3> moved(std::vector<Vec3> seeds) {
  for (Vec3& x : seeds) x += Vec3{0.01, 0.02, 0.001};
  return seeds;
}

Diagram cpu_diagram(const Surface& surface, const std::vector<Vec3>& seeds) {
  return test::diagram_of(surface, seeds, NeighbourSource::nearest);
}

// Combinatorics that are the CPU's, and moments that are so to rounding, or to the bit in double precision.
void expect_parity(const Surface& surface, const Diagram& reference, const Evaluated& found, Precision precision) {
  const Parity parity = compare(reference.moments, reference.polygons, found.moments, found.polygons, surface);
  EXPECT_TRUE(parity.same_pairs && parity.same_labels && parity.same_dual);
  EXPECT_EQ(found.moments.triangles.offsets, reference.moments.triangles.offsets);
  EXPECT_EQ(found.moments.triangles.values, reference.moments.triangles.values);
  EXPECT_EQ(found.report.certification.pairs, reference.polygons.pairs.size());
  const double cells = precision == Precision::double_ ? 1e-12 : 1e-5;
  EXPECT_LE(parity.mass_error, cells);
  EXPECT_LE(parity.centroid_error, cells);
  EXPECT_LE(parity.energy_error, cells);
  EXPECT_LE(parity.sum_error, 0.1 * cells);
  if (precision == Precision::double_) {
    EXPECT_TRUE(parity.bitwise);
  }
}

std::string message_of(const auto& action, Reason reason = Reason::device_failed) {
  try {
    action();
  } catch (const DeviceError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    EXPECT_EQ(error.reason(), reason) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// --- Failures at every call ---

// What a run of a backend gives: cold, then warm with moved seeds, then with polygons.
struct Results {
  Evaluated cold, warm, last;
  int evaluations = 0;  // that were done
};

struct FaultProblem {
  TriangleMesh mesh = box(1);
  Surface surface{mesh};
  std::vector<Vec3> first = hard_seeds(mesh, 60), second = moved(first);
  Diagram reference_first = cpu_diagram(surface, first), reference_second = cpu_diagram(surface, second);

  void run(Backend& backend, Results& results) const {
    results.cold.report = backend.evaluate(first, Want::triangles, results.cold);
    ++results.evaluations;
    results.warm.report = backend.evaluate(second, Want::triangles, results.warm);
    ++results.evaluations;
    results.last.report = backend.evaluate(first, Want::polygons, results.last);
    ++results.evaluations;
  }
};

struct Point {
  std::size_t call;
  std::string name;
};

// Where each name occurs first among the calls, and last if that is in another evaluation.
std::vector<Point> sites(const std::vector<std::string>& names, const std::vector<std::size_t>& ends) {
  std::map<std::string, std::pair<std::size_t, std::size_t>> calls;
  for (std::size_t call = 0; call < names.size(); ++call)
    calls.try_emplace(names[call], call, call).first->second.second = call;
  std::vector<Point> points;
  for (const auto& [name, range] : calls) {
    points.push_back({range.first, name});
    if (std::ranges::upper_bound(ends, range.first) != std::ranges::upper_bound(ends, range.second))
      points.push_back({range.second, name});
  }
  return points;
}

class EveryCall : public Faultless, public testing::WithParamInterface<Precision> {
 protected:
  // Where a run can fail.
  std::vector<Point> sites_of(const FaultProblem& problem, Results& results) {
    std::vector<std::string> names;
    host::log_fallible_calls(&names);
    const auto backend = make(problem);
    std::vector<std::size_t> ends{names.size()};
    results.cold = evaluated(*backend, problem.first, Want::triangles);
    ends.push_back(names.size());
    results.warm = evaluated(*backend, problem.second, Want::triangles);
    ends.push_back(names.size());
    results.last = evaluated(*backend, problem.first, Want::polygons);
    ends.push_back(names.size());
    host::log_fallible_calls(nullptr);
    made_ = ends.front();
    ends_ = ends;
    return sites(names, ends);
  }

  std::unique_ptr<Backend> make(const FaultProblem& problem) const {
    return make_backend(problem.surface, {device_request().value(), GetParam(), NeighbourSource::nearest});
  }

  void expect_right(const FaultProblem& problem, const Results& results) const {
    expect_parity(problem.surface, problem.reference_first, results.last, GetParam());
    EXPECT_TRUE(same_bits(results.cold.moments, results.last.moments));
    EXPECT_EQ(results.warm.moments.triangles.values, problem.reference_second.moments.triangles.values);
  }

  std::size_t made_ = 0;           // calls until the backend is made
  std::vector<std::size_t> ends_;  // and from then on, until each evaluation is done
};

TEST_P(EveryCall, LeavesAsDeviceError) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const FaultProblem problem;
  Results right;
  const std::vector<Point> points = sites_of(problem, right);
  expect_right(problem, right);
  const Certification& rungs = right.cold.report.certification;
  EXPECT_GT(rungs.wider, 0u);
  EXPECT_GT(rungs.cpu, 0u);
  if (GetParam() == Precision::single && has_double()) {
    EXPECT_GT(rungs.doubled, 0u);
  }
  EXPECT_GT(points.size(), 80u);
  // The precisions differ in the kernels but hardly in the calls, and the kinds of failure in nothing but the message:
  // all of them at each call would take six times as long.
  const std::size_t stride = GetParam() == Precision::single ? 1 : 3;
  for (std::size_t k = 0; k < points.size(); k += stride) {
    const Point& point = points[k];
    SCOPED_TRACE(point.name + ", call " + std::to_string(point.call));
    const bool lost = k % 2 == 0;
    host::inject_fault(lost ? Fault::device_lost : Fault::out_of_memory, point.call);
    Results results;
    try {
      const auto backend = make(problem);
      problem.run(*backend, results);
      ADD_FAILURE() << "it did not fail";
    } catch (const DeviceError& error) {
      const std::string text = error.what();
      EXPECT_FALSE(has(text, "\n")) << text;
      EXPECT_TRUE(has(text, point.name)) << text;
      EXPECT_TRUE(has(text, lost ? "lost" : "out of device memory")) << text;
      EXPECT_EQ(error.reason(), Reason::device_failed) << text;
      EXPECT_TRUE(point.call < made_ || has(text, device_name())) << text;
    } catch (const std::exception& error) {
      ADD_FAILURE() << "not a DeviceError: " << error.what();
    }
    // What came before it is right, and there are no polygons.
    EXPECT_TRUE(results.evaluations < 1 || same_bits(results.cold.moments, right.cold.moments));
    EXPECT_TRUE(results.evaluations < 2 || same_bits(results.warm.moments, right.warm.moments));
    EXPECT_EQ(results.evaluations,
              std::ranges::upper_bound(ends_.begin() + 1, ends_.end(), point.call) - ends_.begin() - 1);
    EXPECT_TRUE(results.last.polygons.pairs.empty() && results.last.polygons.labels.empty());
  }
  host::inject_fault(Fault::none, 0);
  Results again;
  problem.run(*make(problem), again);
  expect_right(problem, again);
}

// From the failure on all is the CPU's.
TEST_P(EveryCall, FallsBackOnce) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const FaultProblem problem;
  Results right;
  const std::vector<Point> points = sites_of(problem, right);
  constexpr std::size_t kStride = 7;
  for (std::size_t k = 0; k < points.size(); k += kStride) {
    if (points[k].call < made_) continue;
    SCOPED_TRACE(points[k].name + ", call " + std::to_string(points[k].call));
    std::vector<std::string> warnings;
    host::inject_fault(Fault::none, 0);
    auto device = make(problem);
    FallbackBackend backend(std::move(device), NeighbourSource::nearest, collecting(warnings));
    host::inject_fault(k % 2 ? Fault::device_lost : Fault::out_of_memory, points[k].call - made_);
    const auto expect_one = [&](const CellMoments& found, const CellMoments& device_has, const CellMoments& cpu_has) {
      const bool fell = !backend.description().fallback.empty();
      EXPECT_EQ(warnings.size(), fell ? 1u : 0u);
      EXPECT_TRUE(same_bits(found, fell ? cpu_has : device_has));
    };
    Results results;
    results.cold = evaluated(backend, problem.first, Want::triangles);
    expect_one(results.cold.moments, right.cold.moments, problem.reference_first.moments);
    results.warm = evaluated(backend, problem.second, Want::triangles);
    expect_one(results.warm.moments, right.warm.moments, problem.reference_second.moments);
    results.last = evaluated(backend, problem.first, Want::polygons);
    expect_same_diagram(results.last, problem.reference_first);
    EXPECT_EQ(results.last.report.seconds.device.clip, 0);
    EXPECT_EQ(backend.description().kind, "cpu");
    EXPECT_TRUE(has(backend.description().fallback, points[k].name)) << backend.description().fallback;
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(has(warnings[0], points[k].name) && !has(warnings[0], "\n")) << warnings[0];
  }
}

INSTANTIATE_TEST_SUITE_P(Faults, EveryCall, testing::Values(Precision::single, Precision::double_),
                         [](const auto& instance) {
                           return instance.param == Precision::single ? "single" : "double";
                         });

// --- A whole run ---

class LostInARun : public Faultless {};

TEST_F(LostInARun, GivesTheCpusMesh) {
  SKIP_WITHOUT_DEVICE(Precision::double_);
  const Surface surface(torus(24, 16));
  RemeshOptions options;
  options.vertices = 250;
  options.iterations = 8;
  CpuBackend cpu(surface, NeighbourSource::nearest);
  const RemeshResult expected = remesh(cpu, {}, plan_of(options));
  const auto run = [&](const Context& context) {
    FallbackBackend backend(device_backend(surface, with_precision(Precision::double_)), NeighbourSource::nearest,
                            context);
    return remesh(backend, {}, plan_of(options), context);
  };
  std::vector<std::string> warnings;
  host::inject_fault(Fault::none, 0);
  const RemeshResult whole = run(collecting(warnings));
  EXPECT_EQ(whole.device.fallback, "");
  EXPECT_TRUE(warnings.empty());
  const std::size_t calls = host::fallible_calls();
  for (const double share : {0.4, 0.99}) {
    warnings.clear();
    host::inject_fault(Fault::device_lost, static_cast<std::size_t>(share * static_cast<double>(calls)));
    const RemeshResult found = run(collecting(warnings));
    EXPECT_TRUE(has(found.device.fallback, "lost")) << found.device.fallback;
    EXPECT_EQ(found.device.kind, "cpu");
    EXPECT_EQ(warnings.size(), 1u);
    EXPECT_GT(found.seconds.diagrams.device.clip + found.seconds.diagrams.device.transfer, 0);
    // A descent on the device goes on from the seeds that were kept last, here those it started from.
    EXPECT_GE(found.evaluations, expected.evaluations);
    EXPECT_TRUE(found.mesh.triangles == expected.mesh.triangles);
    EXPECT_TRUE(same_bits(found.mesh.vertices, expected.mesh.vertices));
    EXPECT_TRUE(same_bits(found.energy, expected.energy));
  }
  EXPECT_TRUE(same_bits(whole.mesh.vertices, expected.mesh.vertices));
}

// Energies of a descent fall from step to step, and after the loss it goes on from one of its own iterates.
TEST_F(LostInARun, GoesOnFromTheSeedsThatWereKept) {
  SKIP_WITHOUT_DEVICE(Precision::double_);
  const TriangleMesh mesh = torus(24, 16);
  const Surface surface(mesh);
  OptimiseOptions options;
  options.iterations = 30;
  options.tolerance = 0;
  std::vector<Progress> steps;
  std::vector<std::string> warnings;
  Context context = collecting(warnings);
  context.progress = [&](const Progress& step) { steps.push_back(step); };
  const auto run = [&] {
    steps.clear();
    FallbackBackend backend(device_backend(surface, with_precision(Precision::double_)), NeighbourSource::nearest,
                            context);
    FreeRun free(backend, random_seeds(mesh, 250, 3), context);
    optimise(free.run, options);
    EXPECT_EQ(free.run.totals.iterations, 30);
    EXPECT_EQ(free.run.energy, steps.back().energy);
    return backend.description().kind;
  };
  host::inject_fault(Fault::none, 0);
  EXPECT_NE(run(), "cpu");
  EXPECT_EQ(steps.size(), 30u);
  const std::size_t calls = host::fallible_calls();
  host::inject_fault(Fault::device_lost, calls * 3 / 5);
  EXPECT_EQ(run(), "cpu");
  EXPECT_EQ(warnings.size(), 1u);
  // Where the loss was, steps count again from the first that is not kept.
  std::size_t resumed = 1;
  while (resumed < steps.size() && steps[resumed].iteration > steps[resumed - 1].iteration) ++resumed;
  ASSERT_LT(resumed, steps.size());
  EXPECT_EQ(steps[resumed].iteration % ResidentDescent::kKeepEvery, 1);
  EXPECT_GT(steps[resumed].iteration, 1);
  const std::size_t kept = static_cast<std::size_t>(steps[resumed].iteration) - 2;
  EXPECT_LE(steps[resumed].energy, steps[kept].energy);
}

TEST_F(LostInARun, VectorsThatFindNoMemoryAreOnTheHost) {
  SKIP_WITHOUT_DEVICE(Precision::double_);
  const TriangleMesh mesh = torus(24, 16);
  const Surface surface(mesh);
  const std::unique_ptr<Backend> backend = device_backend(surface, with_precision(Precision::double_));
  const PlacedSeeds seeds(random_seeds(mesh, 250, 3));
  Diagram diagram;
  backend->evaluate(seeds.positions(), Want::moments, diagram);
  const std::vector<Vec3> gradient(seeds.size());
  const FeatureCurves curves;
  const DescentStart start{seeds, curves, diagram.moments, gradient, nullptr, 8};
  host::inject_fault(Fault::out_of_memory, 2);
  EXPECT_EQ(backend->descend(start), nullptr);
  host::inject_fault(Fault::none, 0);
  EXPECT_NE(backend->descend(start), nullptr);
}

// --- Without double precision ---

std::unique_ptr<Device> device_without_double() {
  std::unique_ptr<Device> device = Device::open(device_request().value());
  host::hide_float64(*device);
  return device;
}

TEST(WithoutDouble, IsRefusedIfAskedForDouble) {
  SKIP_WITHOUT_DEVICE(Precision::single);
  const Surface surface(box(1));
  const std::string text = message_of(
      [&] { host::make_vulkan_backend(surface, device_without_double(), with_precision(Precision::double_)); },
      Reason::no_double_precision);
  EXPECT_TRUE(has(text, device_name()) && has(text, "double precision")) << text;
}

TEST(WithoutDouble, IsSingleAndUncertainPairsReachTheCpu) {
  SKIP_WITHOUT_DEVICE(Precision::single);
  const FaultProblem problem;
  for (const Precision precision : {Precision::automatic, Precision::single}) {
    const auto backend = host::make_vulkan_backend(problem.surface, device_without_double(), with_precision(precision));
    EXPECT_EQ(backend->description().precision, "single");
    const Evaluated found = diagram_of(*backend, problem.first);
    expect_parity(problem.surface, problem.reference_first, found, Precision::single);
    EXPECT_EQ(found.report.certification.doubled, 0u);
    EXPECT_GT(found.report.certification.cpu, 0u);
    if (!has_double()) continue;
    const auto better = device_backend(problem.surface, with_precision(Precision::single));
    const Certification rungs = diagram_of(*better, problem.first).report.certification;
    EXPECT_LT(rungs.cpu, found.report.certification.cpu);
    VulkanOptions options = with_precision(Precision::single);
    options.double_rung = false;
    const auto off = device_backend(problem.surface, options);
    EXPECT_TRUE(same_bits(diagram_of(*off, problem.first).moments, found.moments));
  }
}

// --- Too little room ---

class Buffers : public testing::TestWithParam<Precision> {};

TEST_P(Buffers, Grow) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const TriangleMesh mesh = torus(32, 20);
  const Surface surface(mesh);
  std::vector<Vec3> seeds = random_seeds(mesh, 500, 33);
  for (const Vec3& x : hard_seeds(mesh, 1)) seeds.push_back(x);
  const Diagram reference = cpu_diagram(surface, seeds);
  const Evaluated roomy = diagram_of(*device_backend(surface, with_precision(GetParam())), seeds);
  expect_parity(surface, reference, roomy, GetParam());
  const auto check = [&](const char* what, const host::Capacities& capacities) {
    SCOPED_TRACE(what);
    VulkanOptions options = with_precision(GetParam());
    options.capacities = capacities;
    const auto backend = device_backend(surface, options);
    for (const char* round : {"cold", "warm"}) {
      SCOPED_TRACE(round);
      const Evaluated found = diagram_of(*backend, seeds);
      EXPECT_TRUE(same_bits(found.moments, roomy.moments));
      expect_parity(surface, reference, found, GetParam());
      EXPECT_EQ(found.report.certification.cpu, roomy.report.certification.cpu);
    }
  };
  check("table", {.table = 64});
  check("proposals", {.proposals = 64});
  check("flagged", {.flagged = 1});
  check("pairs", {.pairs = 64});
  check("batches", {.batch_pairs = 100});
  check("dispatches", {.at_once = 64});
  check("wide lists", {.wide = 1});
  check("all", {.batch_pairs = 100, .table = 16, .proposals = 16, .flagged = 1, .pairs = 16, .at_once = 64, .wide = 1});
}

// Without the double rung all that single precision is unsure of goes to the CPU, and the lists grow while that is
// found.
TEST_P(Buffers, OfPairsForTheCpuGrow) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const TriangleMesh mesh = torus(32, 20);
  const Surface surface(mesh);
  std::vector<Vec3> seeds = random_seeds(mesh, 500, 36);
  for (const Vec3& x : hard_seeds(mesh, 60)) seeds.push_back(x);
  VulkanOptions options = with_precision(GetParam());
  options.double_rung = false;
  const Evaluated roomy = diagram_of(*device_backend(surface, options), seeds);
  options.capacities = {.flagged = 1};
  const Evaluated found = diagram_of(*device_backend(surface, options), seeds);
  EXPECT_TRUE(same_bits(found.moments, roomy.moments));
  EXPECT_EQ(found.report.certification.cpu, roomy.report.certification.cpu);
  expect_parity(surface, cpu_diagram(surface, seeds), found, GetParam());
}

TEST_P(Buffers, FacetsComeInChunks) {
  SKIP_WITHOUT_DEVICE(GetParam());
  constexpr std::size_t kRange = std::size_t{9} << 19, kFacets = kRange / 192;
  const TriangleMesh mesh = torus(180, 140);
  const Surface surface(mesh);
  ASSERT_GT(surface.facets.size(), 2 * kFacets);
  const std::vector<Vec3> seeds = random_seeds(mesh, 3000, 34);
  std::unique_ptr<Device> device = Device::open(device_request().value());
  host::limit_storage_range(*device, kRange);
  VulkanOptions options = with_precision(GetParam());
  options.capacities = {.batch_pairs = 10'000};
  const auto backend = host::make_vulkan_backend(surface, std::move(device), options);
  const Diagram reference = cpu_diagram(surface, seeds);
  for (int round = 0; round < 2; ++round) expect_parity(surface, reference, diagram_of(*backend, seeds), GetParam());
}

TEST_P(Buffers, EndAtWhatTheDeviceBinds) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const TriangleMesh mesh = torus(32, 20);
  const Surface surface(mesh);
  const std::vector<Vec3> seeds = random_seeds(mesh, 20'000, 35);
  for (const std::size_t range : {std::size_t{100} << 10, std::size_t{600} << 10}) {
    SCOPED_TRACE(range);
    const std::string text = message_of([&] {
      std::unique_ptr<Device> device = Device::open(device_request().value());
      host::limit_storage_range(*device, range);
      VulkanOptions options = with_precision(GetParam());
      options.capacities = {.batch_pairs = 10'000, .table = 64, .proposals = 64, .pairs = 64};
      const auto backend = host::make_vulkan_backend(surface, std::move(device), options);
      evaluated(*backend, seeds, Want::moments);
    });
    EXPECT_TRUE(has(text, device_name())) << text;
  }
}

// A cell with very many sides in one facet.
TEST_P(Buffers, PolygonsWithManyCorners) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const Surface surface(single_triangle());
  for (const int sides : {16, 17, 48, 49, 300}) {
    SCOPED_TRACE(sides);
    const Vec3 centre{2.3, 2.2, 0};
    std::vector<Vec3> seeds{centre};
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.1) / sides;
      seeds.push_back(centre + Vec3{std::cos(angle), std::sin(angle), 0});
    }
    const Diagram reference = cpu_diagram(surface, seeds);
    ASSERT_EQ(reference.polygons.offsets[1], static_cast<std::size_t>(sides));
    for (const NeighbourSource source : {NeighbourSource::nearest, NeighbourSource::delaunay}) {
      VulkanOptions options = with_precision(GetParam());
      options.neighbours = source;
      const Evaluated found = diagram_of(*device_backend(surface, options), seeds);
      expect_parity(surface, reference, found, GetParam());
      const Certification& rungs = found.report.certification;
      EXPECT_TRUE(sides <= 16 || rungs.wider > 0 || rungs.cpu > 0);
      EXPECT_TRUE(sides <= 48 || rungs.cpu > 0);
    }
  }
}

// A cell with twenty thousand neighbours, all of which the clipping has to look at: more steps than some drivers' loops
// have.
TEST_P(Buffers, CellsWithManyNeighbours) {
  SKIP_WITHOUT_DEVICE(GetParam());
  constexpr int kCount = 20'000;
  SplitMix64 random(36);
  std::vector<Vec3> seeds{{0, 0, 0}};
  for (int k = 0; k < kCount; ++k) {
    const double z = 1 - (2 * k + 1.0) / kCount, r = std::sqrt(1 - z * z), angle = 2.399963229728653 * k;
    seeds.push_back(random.range(1, 1 + 1e-6) * Vec3{r * std::cos(angle), r * std::sin(angle), z});
  }
  // Thin, from the centre to a little beyond the cell.
  const Surface surface(TriangleMesh{
      {{-0.01, 0, 0.003}, {0.55, 0.001, 0.1}, {0.54, 0.004, 0.11}, {-0.2, 0.3, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}});
  const Diagram reference = cpu_diagram(surface, seeds);
  for (const NeighbourSource source : {NeighbourSource::nearest, NeighbourSource::delaunay}) {
    SCOPED_TRACE(source == NeighbourSource::nearest ? "nearest" : "delaunay");
    VulkanOptions options = with_precision(GetParam());
    options.neighbours = source;
    const Evaluated found = diagram_of(*device_backend(surface, options), seeds);
    expect_parity(surface, reference, found, GetParam());
    // llvmpipe's loops end early, which must be noticed.
    if (device_name().starts_with("llvmpipe")) {
      EXPECT_GT(found.report.certification.cpu, 0u);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Faults, Buffers, testing::Values(Precision::single, Precision::double_),
                         [](const auto& instance) {
                           return instance.param == Precision::single ? "single" : "double";
                         });

}  // namespace
}  // namespace bisector::test
