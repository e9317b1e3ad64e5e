// Each barrier between commands is needed: where one is left out, the synchronisation checks of the validation layers
// say so. Runs with them only: BISECTOR_VULKAN_VALIDATION=1 and VK_LAYER_ENABLES as tests/CMakeLists.txt sets it.
//
// BISECTOR_TEST_BARRIERS: every how many-th barrier is tried.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/device/faults.h"
#include "host/device/validation.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"
#include "support/models.h"
#include "support/setups.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

using host::Device;

bool synchronisation_is_checked() {
  const char *level = std::getenv("BISECTOR_VULKAN_VALIDATION"), *enables = std::getenv("VK_LAYER_ENABLES");
  return level && std::atoi(level) > 0 && enables &&
         std::string(enables).find("SYNCHRONIZATION_VALIDATION") != std::string::npos;
}

std::size_t stride() {
  const char* given = std::getenv("BISECTOR_TEST_BARRIERS");
  return given ? std::max(1ul, std::strtoul(given, nullptr, 10)) : 1;
}

class Barriers : public testing::TestWithParam<Processor> {
 protected:
  void TearDown() override { host::leave_out_barrier({}); }

  // Messages of an evaluation, and its barriers.
  struct Heard {
    std::size_t messages, barriers;
  };
  static Heard heard(Backend& backend, const std::vector<Vec3>& seeds, Want want, std::optional<std::size_t> left_out) {
    const std::size_t before = host::validation_messages();
    host::leave_out_barrier(left_out);
    evaluated(backend, seeds, want);
    return {host::validation_messages() - before, host::barriers()};
  }

  static void expect_all_needed(Backend& backend, const std::vector<Vec3>& seeds, Want want) {
    // The first evaluations learn how many rounds there are.
    for (int k = 0; k < 3; ++k) EXPECT_EQ(heard(backend, seeds, want, {}).messages, 0u);
    const std::size_t count = heard(backend, seeds, want, {}).barriers;
    EXPECT_GT(count, 20u);
    std::size_t noticed = 0;
    std::vector<std::size_t> silent;
    for (std::size_t k = 0; k < count; k += stride()) {
      const Heard mutant = heard(backend, seeds, want, k);
      EXPECT_EQ(mutant.barriers, count);
      if (mutant.messages > 0) {
        ++noticed;
        continue;
      }
      // The layer says nothing of two kernels that both update a buffer, though the second reads what the first wrote.
      EXPECT_TRUE(host::left_out_between_updates()) << "barrier " << k << " of " << count;
      silent.push_back(k);
    }
    EXPECT_GT(noticed, silent.size());
    for (const std::size_t k : silent) std::printf("barrier %zu of %zu: of kernels that both update\n", k, count);
  }
};

INSTANTIATE_TEST_SUITE_P(Devices, Barriers, testing::Values(Processor::single, Processor::double_),
                         [](const auto& instance) {
                           return instance.param == Processor::single ? "single" : "double";
                         });

TEST_P(Barriers, OfSurfacesAreNeeded) {
  if (!synchronisation_is_checked()) GTEST_SKIP() << "without the validation layers";
  SKIP_WITHOUT_DEVICE(GetParam());
  const TriangleMesh mesh = box(1);
  const Surface surface(mesh);
  host::VulkanOptions options;
  options.precision = precision_of(GetParam());
  const auto backend = host::make_vulkan_backend(surface, Device::open(device_for(GetParam()).value()), options);
  expect_all_needed(*backend, random_seeds(mesh, 60, 81), Want::polygons);
}

TEST_P(Barriers, OfSolidsAreNeeded) {
  if (!synchronisation_is_checked()) GTEST_SKIP() << "without the validation layers";
  SKIP_WITHOUT_DEVICE(GetParam());
  const TetMesh mesh = tet_grid(1, 1, 1);
  const Solid solid(mesh);
  host::VulkanOptions options;
  options.precision = precision_of(GetParam());
  for (const SolidCells how : {SolidCells::whole, SolidCells::clipped}) {
    SCOPED_TRACE(how == SolidCells::whole ? "whole" : "cut up");
    const auto backend =
        host::make_vulkan_solid_backend(solid, Device::open(device_for(GetParam()).value()), options, how);
    expect_all_needed(*backend, seeds_about(mesh, 40, 0, 82), Want::polygons | Want::polyhedra);
  }
}

}  // namespace
}  // namespace bisector::test
