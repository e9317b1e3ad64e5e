// Failing and poor devices under the backend of solids: a clear error or a counted fallback, never a wrong or partial
// result.
//
// Needs a Vulkan device or skips what does; BISECTOR_TEST_DEVICE names one ("vulkan:0") that then must be there.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "backend/fallback_backend.h"
#include "bisector/error.h"
#include "check/parity.h"
#include "host/device/faults.h"
#include "host/passes/vulkan_solid_backend.h"
#include "support/setups.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

using host::Device;
using host::Fault;
using host::VulkanOptions;

VulkanOptions with_precision(Precision precision) {
  VulkanOptions options;
  options.precision = precision;
  return options;
}

Processor processor_of(Precision precision) {
  return precision == Precision::single ? Processor::single : Processor::double_;
}

std::unique_ptr<SolidBackend> device_backend(const Solid& solid, const VulkanOptions& options,
                                             SolidCells how = SolidCells::whole) {
  return host::make_vulkan_solid_backend(solid, Device::open(device_for(processor_of(options.precision)).value()),
                                         options, how);
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string message_of(const std::function<void()>& action, Reason reason = Reason::device_failed) {
  try {
    action();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.reason(), reason) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

// Spread seeds, a cluster, whose cells need wide lists, and a grid, which only exact arithmetic tells from the
// tetrahedra.
std::vector<Vec3> hard_seeds(const TetMesh& mesh) {
  std::vector<Vec3> seeds = seeds_about(mesh, 60, 0, 61);
  SplitMix64 random(62);
  for (int k = 0; k < 120; ++k)
    seeds.push_back(Vec3{0.9, 0.9, 0.9} + 1e-3 * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
  for (const Vec3& x : seed_grid(mesh, 3, 3, 3)) seeds.push_back(x);
  return seeds;
}

Evaluated evaluated(Backend& backend, const std::vector<Vec3>& seeds) {
  return test::evaluated(backend, seeds, Want::polygons | Want::polyhedra);
}

void expect_same_polyhedra(const ClippedPolyhedra& a, const ClippedPolyhedra& b) {
  EXPECT_EQ(a.pairs.size(), b.pairs.size());
  EXPECT_TRUE(a.label_offsets == b.label_offsets && a.labels == b.labels);
  EXPECT_TRUE(a.vertex_offsets == b.vertex_offsets && a.triples == b.triples);
}

class SolidFaults : public testing::TestWithParam<Precision> {
 protected:
  void TearDown() override { host::inject_fault(Fault::none, 0); }

  TetMesh mesh_ = shaken(tet_grid(2, 2, 2), 0.2, 63);
  Solid solid_{mesh_};
  std::vector<Vec3> seeds_ = hard_seeds(mesh_);
};

INSTANTIATE_TEST_SUITE_P(Faults, SolidFaults, testing::Values(Precision::single, Precision::double_),
                         [](const auto& instance) {
                           return instance.param == Precision::single ? "single" : "double";
                         });

// At a spread of calls, of the making and of an evaluation, the failure leaves as a DeviceError, and behind a fallback
// the result is the CPU's.
TEST_P(SolidFaults, LeaveAsDeviceErrorOrFallBack) {
  SKIP_WITHOUT_DEVICE(processor_of(GetParam()));
  constexpr std::size_t kPoints = 4;
  CpuSolidBackend cpu(solid_, NeighbourSource::nearest);
  const Evaluated expected = evaluated(cpu, seeds_);
  host::inject_fault(Fault::none, 0);
  auto right = device_backend(solid_, with_precision(GetParam()));
  const std::size_t made = host::fallible_calls();
  const Evaluated results = evaluated(*right, seeds_);
  const std::size_t calls = host::fallible_calls();
  expect_same_polyhedra(results.polyhedra, expected.polyhedra);
  EXPECT_GT(results.report.certification.cpu, 0u);
  ASSERT_GT(calls, made + kPoints);
  for (std::size_t k = 0; k < kPoints; ++k) {
    const std::size_t call = made + (calls - made) * k / kPoints;
    SCOPED_TRACE(call);
    const Fault fault = k % 2 ? Fault::device_lost : Fault::out_of_memory;
    host::inject_fault(Fault::none, 0);
    auto device = device_backend(solid_, with_precision(GetParam()));
    host::inject_fault(fault, call - made);
    const std::string text = message_of([&] { evaluated(*device, seeds_); });
    EXPECT_FALSE(has(text, "\n")) << text;

    std::vector<std::string> warnings;
    Context context;
    context.warning = [&](const std::string& line) { warnings.push_back(line); };
    host::inject_fault(Fault::none, 0);
    FallbackSolidBackend backend(device_backend(solid_, with_precision(GetParam())), NeighbourSource::nearest, context);
    EXPECT_EQ(&backend.solid(), &solid_);
    host::inject_fault(fault, call - made);
    const Evaluated found = evaluated(backend, seeds_);
    expect_same_polyhedra(found.polyhedra, expected.polyhedra);
    EXPECT_TRUE(bisector::same_bits(found.moments, expected.moments));
    EXPECT_EQ(warnings.size(), 1u);
    EXPECT_EQ(backend.description().kind, "cpu");
    EXPECT_NE(backend.description().fallback, "");
  }
}

TEST_P(SolidFaults, BuffersGrow) {
  SKIP_WITHOUT_DEVICE(processor_of(GetParam()));
  const std::vector<host::Capacities> each{{.table = 64}, {.proposals = 64}, {.flagged = 1},
                                           {.pairs = 64}, {.at_once = 64},   {.wide = 1}},
      all{{.batch_pairs = 20, .table = 16, .proposals = 16, .flagged = 1, .pairs = 16, .at_once = 64, .wide = 1}};
  for (const SolidCells how : {SolidCells::whole, SolidCells::clipped}) {
    const Evaluated roomy = evaluated(*device_backend(solid_, with_precision(GetParam()), how), seeds_);
    for (const host::Capacities& capacities : how == SolidCells::whole ? each : all) {
      VulkanOptions options = with_precision(GetParam());
      options.capacities = capacities;
      const auto backend = device_backend(solid_, options, how);
      for (int round = 0; round < 2; ++round) {
        const Evaluated found = evaluated(*backend, seeds_);
        EXPECT_TRUE(bisector::same_bits(found.moments, roomy.moments));
        EXPECT_EQ(found.report.certification.pairs, roomy.report.certification.pairs);
        EXPECT_EQ(found.report.certification.cpu, roomy.report.certification.cpu);
        expect_same_polyhedra(found.polyhedra, roomy.polyhedra);
      }
    }
  }
}

TEST_P(SolidFaults, BuffersEndAtWhatTheDeviceBinds) {
  SKIP_WITHOUT_DEVICE(processor_of(GetParam()));
  for (const std::size_t range : {std::size_t{8} << 10, std::size_t{20} << 10}) {
    SCOPED_TRACE(range);
    const std::string text = message_of([&] {
      std::unique_ptr<Device> device = Device::open(device_for(processor_of(GetParam())).value());
      host::limit_storage_range(*device, range);
      VulkanOptions options = with_precision(GetParam());
      options.capacities = {.batch_pairs = 1000, .table = 64, .proposals = 64, .pairs = 64};
      test::evaluated(*host::make_vulkan_solid_backend(solid_, std::move(device), options), seeds_, Want::moments);
    });
    EXPECT_FALSE(has(text, "\n")) << text;
  }
}

TEST_P(SolidFaults, PolyhedraWithManyFacets) {
  SKIP_WITHOUT_DEVICE(processor_of(GetParam()));
  const TetMesh mesh = tet_grid(1, 1, 1);
  const Solid solid(mesh);
  for (const int facets : {30, 50, 120}) {
    SCOPED_TRACE(facets);
    const Vec3 centre{0.51, 0.52, 0.49};
    std::vector<Vec3> seeds{centre};
    SplitMix64 random(64);
    for (int k = 0; k < facets; ++k) {
      const double z = 1 - (2 * k + 1.0) / facets, r = std::sqrt(1 - z * z), angle = 2.399963229728653 * k;
      // A little off the sphere, or their bisectors would all meet in the centre.
      seeds.push_back(centre + random.range(0.4, 0.4004) * Vec3{r * std::cos(angle), r * std::sin(angle), z});
    }
    CpuSolidBackend cpu(solid, NeighbourSource::nearest);
    const Evaluated expected = evaluated(cpu, seeds);
    EXPECT_EQ(expected.polyhedra.pairs.front().cell, 0u);
    EXPECT_EQ(expected.polyhedra.label_offsets[1], static_cast<std::size_t>(facets));
    const Evaluated found = evaluated(*device_backend(solid, with_precision(GetParam())), seeds);
    expect_same_polyhedra(found.polyhedra, expected.polyhedra);
    EXPECT_EQ(found.report.certification.cpu > 0, facets > 60);
  }
}

TEST(SolidWithoutDouble, IsSingleAndUncertainPairsReachTheCpu) {
  SKIP_WITHOUT_DEVICE(Processor::single);
  const Solid solid(shaken(tet_grid(2, 2, 2), 0.2, 63));
  const std::vector<Vec3> seeds = hard_seeds(solid.mesh);
  const auto poor = [] {
    std::unique_ptr<Device> device = Device::open(device_for(Processor::single).value());
    host::hide_float64(*device);
    return device;
  };
  const std::string text =
      message_of([&] { host::make_vulkan_solid_backend(solid, poor(), with_precision(Precision::double_)); },
                 Reason::no_double_precision);
  EXPECT_TRUE(has(text, "double precision")) << text;
  const auto backend = host::make_vulkan_solid_backend(solid, poor(), {});
  EXPECT_EQ(backend->description().precision, "single");
  const Evaluated found = evaluated(*backend, seeds);
  CpuSolidBackend cpu(solid, NeighbourSource::nearest);
  expect_same_polyhedra(found.polyhedra, evaluated(cpu, seeds).polyhedra);
  EXPECT_EQ(found.report.certification.doubled, 0u);
  EXPECT_GT(found.report.certification.cpu, 0u);
  EXPECT_NEAR(found.moments.mass, solid.mass, 1e-6 * solid.mass);
}

}  // namespace
}  // namespace bisector::test
