// Which backend computes, what happens when a device fails, and how evaluations are compared.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "backend/fallback_backend.h"
#include "bisector/error.h"
#include "check/parity.h"
#include "compute/compute.h"
#include "core/random.h"
#include "cvt/optimise.h"
#include "remesh/remesh.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/run.h"

namespace bisector {
namespace {

// The CPU in a device's place, which fails from some evaluation on and leaves its results half done.
class FailingBackend : public CpuBackend {
 public:
  FailingBackend(const Surface& surface, int evaluations)
      : CpuBackend(surface, NeighbourSource::nearest), left_(evaluations) {}

  BackendDescription description() const override { return {"fake", "discrete", "single", ""}; }
  double mass_tolerance() const override { return 1e-6; }
  double energy_noise() const override { return 1e-7; }

 private:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override {
    const EvaluationReport report = CpuBackend::compute(seeds, want, diagram);
    if (left_ == 0) diagram.polygons.pairs.resize(diagram.polygons.pairs.size() / 2);
    fail(diagram.moments);
    return report;
  }
  void fail(CellMoments& moments) {
    if (left_-- > 0) return;
    moments.cells.resize(moments.cells.size() / 2);
    moments.mass = 0;
    throw DeviceError("the device was lost");
  }

  int left_;
};

Context collecting(std::vector<std::string>& warnings) {
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  return context;
}

Diagram evaluate(Backend& backend, const std::vector<Vec3>& seeds) {
  Diagram d;
  backend.evaluate(seeds, Want::polygons, d);
  return d;
}

class Compute : public testing::Test {
 protected:
  const TriangleMesh mesh_ = test::icosphere(3);
  const Surface surface_{mesh_};
  const std::vector<Vec3> seeds_ = test::random_seeds(mesh_, 200, 1);
};

TEST_F(Compute, CpuOnRequest) {
  for (const Precision precision : {Precision::automatic, Precision::double_}) {
    const auto backend =
        make_backend(surface_, {{.kind = DeviceRequest::Kind::cpu}, precision, NeighbourSource::nearest});
    EXPECT_EQ(backend->description().kind, "cpu");
    EXPECT_EQ(backend->description().precision, "double");
    EXPECT_EQ(backend->description().fallback, "");
    EXPECT_NE(backend->description().name, "");
    EXPECT_EQ(&backend->surface(), &surface_);
    const Certification counts = test::evaluated(*backend, seeds_, Want::moments).report.certification;
    EXPECT_EQ(counts.cpu, counts.uncertain);
  }
  EXPECT_THROW(
      make_backend(surface_, {{.kind = DeviceRequest::Kind::cpu}, Precision::single, NeighbourSource::nearest}), Error);
}

TEST(DeviceWords, AreRequests) {
  for (const char* word : {"auto", "cpu", "vulkan", "vulkan:0", "vulkan:12",
                           "vulkan:00000000-0000-0000-0000-00000000dEaD", "vulkan:0123456789abcdef0123456789abcdef"})
    EXPECT_EQ(word_of(parse_device(word)), word);
  EXPECT_EQ(parse_device("auto"), DeviceRequest{});
  EXPECT_EQ(parse_device("vulkan:12").index, 12u);
  EXPECT_EQ(word_of(parse_device("vulkan:007")), "vulkan:7");
}

TEST(DeviceWords, OthersAreErrors) {
  for (const char* word : {"", "gpu", "CPU", "cpu ", "vulkan:", "vulkan:x", "vulkan:-1", "vulkan:1e3", "vulkan:1 ",
                           "vulkan:1234567890", "vulkann", "vulkan:g0000000-0000-0000-0000-000000000000"}) {
    try {
      parse_device(word);
      ADD_FAILURE() << word;
    } catch (const Error& error) {
      EXPECT_EQ(error.reason(), Reason::other);
      EXPECT_NE(std::string(error.what()).find("vulkan:INDEX"), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
}

TEST_F(Compute, RequestsThatCannotBeMet) {
  for (const char* word : {"vulkan:99999", "vulkan:00000000-0000-0000-0000-00000000dead"}) {
    try {
      make_backend(surface_, {parse_device(word), Precision::automatic, NeighbourSource::nearest});
      ADD_FAILURE() << word;
    } catch (const DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
}

TEST_F(Compute, AutomaticWithoutAGpuIsTheCpu) {
  if (best_gpu(list_devices())) GTEST_SKIP() << "there is a GPU";
  std::vector<std::string> warnings;
  const auto backend = make_backend(surface_, {}, collecting(warnings));
  EXPECT_EQ(backend->description().kind, "cpu");
  EXPECT_TRUE(warnings.empty());
  EXPECT_THROW(make_backend(surface_, {{}, Precision::single, NeighbourSource::nearest}), Error);
}

TEST_F(Compute, ListIsPlausible) {
  const DeviceList list = list_devices();
  EXPECT_EQ(list.devices.empty(), !list.problem.empty());
  for (std::size_t k = 0; k < list.devices.size(); ++k) {
    EXPECT_EQ(list.devices[k].index, k);
    EXPECT_EQ(list.devices[k].uuid.size(), 36u);
  }
}

TEST_F(Compute, BestGpu) {
  const auto device = [](unsigned index, const char* kind, bool float64, const char* rejected = "") {
    DeviceDescription d;
    d.index = index;
    d.kind = kind;
    d.float64 = float64;
    d.rejected = rejected;
    return d;
  };
  EXPECT_EQ(best_gpu({}), std::nullopt);
  EXPECT_EQ(best_gpu({{device(0, "software", true)}, ""}), std::nullopt);
  EXPECT_EQ(best_gpu({{device(0, "discrete", true, "too old")}, ""}), std::nullopt);
  const DeviceList list{{device(0, "software", true), device(1, "integrated", true), device(2, "discrete", false)}, ""};
  EXPECT_EQ(best_gpu(list), parse_device("vulkan:2"));
  EXPECT_EQ(best_gpu(list, Precision::single), parse_device("vulkan:2"));
  EXPECT_EQ(best_gpu(list, Precision::double_), parse_device("vulkan:1"));
}

TEST_F(Compute, AFailedDeviceIsReplacedOnce) {
  CpuBackend cpu(surface_, NeighbourSource::nearest);
  const Diagram expected = evaluate(cpu, seeds_);
  std::vector<std::string> warnings;
  FallbackBackend backend(std::make_unique<FailingBackend>(surface_, 1), NeighbourSource::nearest,
                          collecting(warnings));
  EXPECT_EQ(&backend.surface(), &surface_);
  EXPECT_EQ(backend.mass_tolerance(), 1e-6);
  test::expect_same_diagram(evaluate(backend, seeds_), expected);
  EXPECT_EQ(backend.description().name, "fake");
  EXPECT_TRUE(warnings.empty());
  for (int k = 0; k < 3; ++k) test::expect_same_diagram(evaluate(backend, seeds_), expected);
  Diagram last;
  backend.evaluate(seeds_, Want::moments, last);
  test::expect_same_moments(last.moments, expected.moments);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("the device was lost"), std::string::npos) << warnings[0];
  EXPECT_EQ(backend.description().kind, "cpu");
  EXPECT_EQ(backend.description().precision, "double");
  EXPECT_EQ(backend.description().fallback, "the device was lost");
  EXPECT_EQ(backend.mass_tolerance(), cpu.mass_tolerance());
  EXPECT_EQ(backend.energy_noise(), 1e-7);
}

class BrokenBackend : public CpuBackend {
 public:
  using CpuBackend::CpuBackend;

 private:
  EvaluationReport compute(const std::vector<Vec3>&, Want, Diagram&) override { throw Error("bad input"); }
};

TEST_F(Compute, OtherErrorsAreNotTheDevices) {
  FallbackBackend backend(std::make_unique<BrokenBackend>(surface_, NeighbourSource::nearest), NeighbourSource::nearest,
                          {});
  Diagram diagram;
  EXPECT_THROW(backend.evaluate(seeds_, Want::moments, diagram), Error);
  EXPECT_EQ(backend.description().fallback, "");
}

// Wherever the device fails, an optimisation ends where the CPU's does.
TEST_F(Compute, OptimisationSurvivesAFailure) {
  OptimiseOptions options;
  options.iterations = 12;
  CpuBackend cpu(surface_, NeighbourSource::nearest);
  test::FreeRun expected(cpu, seeds_);
  optimise(expected.run, options);
  for (const int evaluations : {0, 1, 2, 7}) {
    FallbackBackend backend(std::make_unique<FailingBackend>(surface_, evaluations), NeighbourSource::nearest, {});
    test::FreeRun found(backend, seeds_);
    optimise(found.run, options);
    EXPECT_TRUE(test::same_bits(found.seeds(), expected.seeds())) << evaluations;
    test::expect_same_moments(found.moments(), expected.moments());
    EXPECT_EQ(backend.description().fallback, "the device was lost");
  }
}

// Energies as a device in single precision may sum them up.
class NoisyBackend : public CpuBackend {
 public:
  NoisyBackend(const Surface& surface, double noise) : CpuBackend(surface, NeighbourSource::nearest), noise_(noise) {}

  double energy_noise() const override { return noise_; }

 private:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override {
    const EvaluationReport report = CpuBackend::compute(seeds, want, diagram);
    diagram.moments.energy *= 1 + 5e-7 * (2 * Random(7, evaluations_++).uniform() - 1);
    return report;
  }

  double noise_;
  std::uint64_t evaluations_ = 0;
};

TEST_F(Compute, NoisyEnergiesDoNotEndTheDescent) {
  const auto last_norm = [&](double noise) {
    NoisyBackend backend(surface_, noise);
    test::FreeRun free(backend, seeds_);
    OptimiseOptions options;
    options.iterations = 400;
    options.tolerance = -1;  // a rise by noise must not end it
    optimise(free.run, options);
    return free.run.gradient_norm;
  };
  EXPECT_LT(last_norm(1e-6), 0.1 * last_norm(0));
}

// Every so often a diagram misses a part of the surface, which lowers its energy.
class LeakyBackend : public CpuBackend {
 public:
  using CpuBackend::CpuBackend;

 private:
  EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) override {
    const EvaluationReport report = CpuBackend::compute(seeds, want, diagram);
    if (++evaluations_ % 4 == 0) {
      diagram.moments.mass *= 0.9;
      diagram.moments.energy *= 0.9;
    }
    return report;
  }

  int evaluations_ = 0;
};

TEST_F(Compute, DiagramsThatMissAPartAreNoDescent) {
  LeakyBackend backend(surface_, NeighbourSource::nearest);
  test::FreeRun found(backend, seeds_);
  OptimiseOptions options;
  options.iterations = 40;
  optimise(found.run, options);
  EXPECT_GT(found.run.totals.iterations, 8);
  const Diagram honest = test::diagram_of(surface_, found.seeds(), NeighbourSource::nearest);
  EXPECT_EQ(found.moments().mass, honest.moments.mass);
  EXPECT_EQ(found.moments().energy, honest.moments.energy);
}

TEST_F(Compute, RemeshTellsItsDevice) {
  RemeshOptions options;
  options.vertices = 100;
  options.iterations = 5;
  options.compute.device.kind = DeviceRequest::Kind::cpu;
  const RemeshResult result = remesh(mesh_, options);
  EXPECT_EQ(result.device.kind, "cpu");
  EXPECT_EQ(result.seconds.diagrams.device.clip, 0);
  options.compute.precision = Precision::single;
  EXPECT_THROW(remesh(mesh_, options), Error);
}

TEST_F(Compute, ParityOfEqualDiagrams) {
  const Diagram a = test::diagram_of(surface_, seeds_, NeighbourSource::nearest);
  const Diagram b = test::diagram_of(surface_, seeds_, NeighbourSource::delaunay);
  const Parity parity = compare(a.moments, a.polygons, b.moments, b.polygons, surface_);
  EXPECT_TRUE(parity.same_pairs && parity.same_labels && parity.same_dual && parity.bitwise);
  EXPECT_EQ(parity.mass_error, 0);
  EXPECT_EQ(parity.centroid_error, 0);
  EXPECT_EQ(parity.energy_error, 0);
  EXPECT_LE(parity.sum_error, 1e-12);
}

TEST_F(Compute, ParitySeesEachDifference) {
  const Diagram a = test::diagram_of(surface_, seeds_, NeighbourSource::nearest);
  const auto parity = [&](const auto& change) {
    Diagram b = a;
    change(b);
    return compare(a.moments, a.polygons, b.moments, b.polygons, surface_);
  };
  const double mass = a.moments.cells[7].mass, length = std::sqrt(mass);
  const Parity by_mass = parity([](Diagram& d) { d.moments.cells[7].mass *= 1 + 1e-3; });
  EXPECT_NEAR(by_mass.mass_error, 1e-3, 1e-9);
  EXPECT_FALSE(by_mass.bitwise);
  EXPECT_TRUE(by_mass.same_labels && by_mass.same_dual);
  EXPECT_NEAR(parity([&](Diagram& d) { d.moments.cells[7].first.x += 1e-3 * mass * length; }).centroid_error, 1e-3,
              1e-9);
  EXPECT_NEAR(parity([&](Diagram& d) { d.moments.cells[7].second += 1e-3 * mass * mass; }).energy_error, 1e-3, 1e-9);
  EXPECT_NEAR(parity([&](Diagram& d) { d.moments.mass *= 1 + 1e-3; }).sum_error, 1e-3, 1e-9);
  EXPECT_EQ(parity([](Diagram& d) { d.moments.cells[7].mass = NAN; }).mass_error, INFINITY);
  EXPECT_EQ(parity([](Diagram& d) { d.moments.cells.pop_back(); }).mass_error, INFINITY);
  EXPECT_FALSE(parity([](Diagram& d) { ++d.polygons.pairs.back().cell; }).same_pairs);
  EXPECT_FALSE(parity([](Diagram& d) { std::swap(d.polygons.labels[0], d.polygons.labels[1]); }).same_labels);
  EXPECT_FALSE(parity([](Diagram& d) { d.polygons = {}; }).same_dual);
  EXPECT_FALSE(
      parity([](Diagram& d) { d.polygons.vertices[0].x = std::nextafter(d.polygons.vertices[0].x, 9.0); }).bitwise);
}

}  // namespace
}  // namespace bisector
