// The whole backend on devices that differ from the ones at hand in what no device promises: memory that starts with
// garbage, and the order in which invocations run. Not a bit of a diagram may show it.
//
// Needs a Vulkan device or skips what does; BISECTOR_TEST_DEVICE names one ("vulkan:0") that then must be there.
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "backend/cpu_backend.h"
#include "cvt/optimise.h"
#include "host/device/faults.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"
#include "support/models.h"
#include "support/run.h"
#include "support/setups.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

using host::Device;
using Seeds = std::vector<Vec3>;

Seeds moved(Seeds seeds, double by, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  for (Vec3& x : seeds) x += by * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
  return seeds;
}

// Beside each other sets that differ in how many there are and in the rungs that they climb, and one that keeps its
// slots: what the last one has left in memory is never right. `grid` is of exact ties.
std::vector<Seeds> sequence(const Seeds& spread, const Seeds& grid) {
  Seeds dense(spread.begin(), spread.begin() + 40);
  for (int k = 0; k < 120; ++k) dense.push_back(spread[0] + moved({{}}, 1e-3, static_cast<std::uint64_t>(k))[0]);
  return {spread, moved(spread, 1e-3, 71), dense, grid, spread};
}

// A domain, the backends that compute its diagrams, and seeds.
struct Problem {
  std::function<std::unique_ptr<Backend>(std::shared_ptr<Device>)> on_device;
  std::unique_ptr<Backend> cpu;
  Want want;
  std::vector<Seeds> sets;
};

host::VulkanOptions options_for(Processor processor, bool double_rung) {
  host::VulkanOptions options;
  options.precision = precision_of(processor);
  options.double_rung = double_rung;
  return options;
}

struct SurfaceProblem {
  TriangleMesh mesh = box(2);
  Surface surface{mesh};

  Problem problem(const host::VulkanOptions& options) const {
    return {[this, options](std::shared_ptr<Device> device) {
              return host::make_vulkan_backend(surface, std::move(device), options);
            },
            std::make_unique<CpuBackend>(surface, NeighbourSource::nearest), Want::polygons,
            sequence(random_seeds(mesh, 300, 72), grid_seeds(mesh, 4, 4, 4))};
  }
};

struct SolidProblem {
  TetMesh mesh = shaken(tet_grid(2, 2, 2), 0.2, 63);
  Solid solid{mesh};
  SolidCells how;

  Problem problem(const host::VulkanOptions& options) const {
    return {[this, options](std::shared_ptr<Device> device) {
              return host::make_vulkan_solid_backend(solid, std::move(device), options, how);
            },
            std::make_unique<CpuSolidBackend>(solid, NeighbourSource::nearest, how), Want::polygons | Want::polyhedra,
            sequence(seeds_about(mesh, 200, 0, 73), seed_grid(mesh, 3, 3, 3))};
  }
};

void expect_same_labels(const Diagram& a, const Diagram& b) {
  EXPECT_TRUE(pairs_of(a.polygons) == pairs_of(b.polygons));
  EXPECT_TRUE(a.polygons.offsets == b.polygons.offsets && a.polygons.labels == b.polygons.labels);
  EXPECT_TRUE(a.polyhedra.label_offsets == b.polyhedra.label_offsets && a.polyhedra.labels == b.polyhedra.labels);
  EXPECT_TRUE(a.polyhedra.vertex_offsets == b.polyhedra.vertex_offsets && a.polyhedra.triples == b.polyhedra.triples);
}

// Labels that are the CPU's, and moments that are so too in double precision, or those of the device as it is.
// `disturb` is called before each diagram.
void expect_undisturbed(const Problem& problem, Processor processor, const std::shared_ptr<Device>& as_it_is,
                        const std::shared_ptr<Device>& disturbed, const std::function<void(Device&)>& disturb) {
  const std::unique_ptr<Backend> plain = problem.on_device(as_it_is), backend = problem.on_device(disturbed);
  std::size_t climbed = 0;
  for (std::size_t k = 0; k < problem.sets.size(); ++k) {
    SCOPED_TRACE("seeds " + std::to_string(k));
    disturb(*disturbed);
    const Evaluated expected = evaluated(*plain, problem.sets[k], problem.want),
                    found = evaluated(*backend, problem.sets[k], problem.want),
                    right = evaluated(*problem.cpu, problem.sets[k], problem.want);
    expect_same_labels(found, right);
    expect_same_moments(found.moments, expected.moments);
    if (processor == Processor::double_) expect_same_moments(found.moments, right.moments);
    climbed += found.report.certification.wider + found.report.certification.cpu;
  }
  EXPECT_GT(climbed, 0u);
}

class Hostile : public testing::TestWithParam<Processor> {
 protected:
  static std::shared_ptr<Device> open() { return Device::open(device_for(GetParam()).value()); }

  // `once` is done to the device before it is used, `each` before each diagram.
  static void expect_all_undisturbed(const host::VulkanOptions& options, const std::vector<SolidCells>& solids,
                                     const std::function<void(Device&)>& once,
                                     const std::function<void(Device&)>& each) {
    const std::shared_ptr<Device> plain = open(), disturbed = open();
    once(*disturbed);
    {
      SCOPED_TRACE("surface");
      const SurfaceProblem surface;
      expect_undisturbed(surface.problem(options), GetParam(), plain, disturbed, each);
    }
    for (const SolidCells how : solids) {
      SCOPED_TRACE(how == SolidCells::whole ? "solid" : "solid cut up");
      const SolidProblem solid{.how = how};
      expect_undisturbed(solid.problem(options), GetParam(), plain, disturbed, each);
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Devices, Hostile, testing::Values(Processor::single, Processor::double_),
                         [](const auto& instance) {
                           return instance.param == Processor::single ? "single" : "double";
                         });

// As numbers, none at all and as indices, no seed; and a small index, which is a valid one.
TEST_P(Hostile, GarbageInMemoryDoesNotShow) {
  SKIP_WITHOUT_DEVICE(GetParam());
  for (const std::uint32_t word : {0xffffffffu, 3u}) {
    SCOPED_TRACE(word);
    expect_all_undisturbed(
        options_for(GetParam(), true), {SolidCells::whole, SolidCells::clipped},
        [&](Device& device) { host::poison_new_memory(device, word); },
        [&](Device& device) { host::poison_computed(device, word); });
  }
}

// All kernels are compiled anew for it, which takes most of the time: no kernel twice.
TEST_P(Hostile, TheOrderOfInvocationsDoesNotShow) {
  SKIP_WITHOUT_DEVICE(GetParam());
  const bool is_double = GetParam() == Processor::double_;
  expect_all_undisturbed(
      options_for(GetParam(), false), {is_double ? SolidCells::whole : SolidCells::clipped},
      [](Device& device) { host::permute_invocations(device, 37); }, [](Device&) {});
}

// Its vectors stay on the device.
TEST_P(Hostile, ADescentIsUndisturbed) {
  SKIP_WITHOUT_DEVICE(GetParam());
  SKIP_WITHOUT_DEVICE(Processor::double_);
  const TriangleMesh mesh = box(2);
  const Surface surface(mesh);
  const auto optimised = [&](Backend& backend) {
    FreeRun free(backend, random_seeds(mesh, 200, 74));
    optimise_both(free.run, 8, 3);
    return free.seeds();
  };
  const auto on_device = [&](const std::shared_ptr<Device>& device) {
    return optimised(*host::make_vulkan_backend(surface, device, options_for(GetParam(), true)));
  };
  const std::shared_ptr<Device> disturbed = open();
  host::poison_new_memory(*disturbed, 0xffffffffu);
  host::permute_invocations(*disturbed, 37);
  const Seeds found = on_device(disturbed);
  EXPECT_EQ(found, on_device(open()));
  if (GetParam() != Processor::double_) return;
  CpuBackend cpu(surface, NeighbourSource::nearest);
  EXPECT_EQ(found, optimised(cpu));
}

}  // namespace
}  // namespace bisector::test
