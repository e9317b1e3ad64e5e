// The backends that the parity suites run on, and what two diagrams of the same seeds have in common.
//
// A suite needs a Vulkan device or skips what does; BISECTOR_TEST_DEVICE names one ("vulkan:0") that then must be
// there.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "check/parity.h"
#include "compute/compute.h"
#include "host/device/device.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"
#include "support/diagram.h"
#include "support/thread_ranks.h"

namespace bisector::test {

enum class Processor { cpu, ranks, single, double_ };

inline bool is_device(Processor processor) { return processor == Processor::single || processor == Processor::double_; }

struct Setup {
  Processor processor;
  NeighbourSource source;
};

inline constexpr std::array kProcessors{Processor::cpu, Processor::ranks, Processor::single, Processor::double_};
inline constexpr std::array kSources{NeighbourSource::nearest, NeighbourSource::delaunay};

inline std::string name_of(const Setup& setup) {
  constexpr std::array kNames{"cpu", "ranks", "single", "double"};
  return std::string(kNames[static_cast<std::size_t>(setup.processor)]) +
         (setup.source == NeighbourSource::nearest ? "_nearest" : "_delaunay");
}

inline void PrintTo(const Setup& setup, std::ostream* out) { *out << name_of(setup); }

inline std::vector<Setup> all_setups() {
  std::vector<Setup> all;
  for (Processor processor : kProcessors)
    for (NeighbourSource source : kSources) all.push_back({processor, source});
  return all;
}

// Those that suites with many cases try: where neighbours come from does not depend on the precision, so that the
// second source is tried in double only.
inline std::vector<Setup> setups() {
  std::vector<Setup> some = all_setups();
  std::erase_if(some, [](const Setup& setup) {
    return setup.processor == Processor::single && setup.source == NeighbourSource::delaunay;
  });
  return some;
}

// Those that compute diagrams of solids.
inline std::vector<Setup> solid_setups() {
  std::vector<Setup> some = setups();
  std::erase_if(some, [](const Setup& setup) { return setup.processor == Processor::ranks; });
  return some;
}

struct Tolerance {
  double cells, sum;
};

inline Tolerance tolerance_of(Processor processor) {
  return processor == Processor::single ? Tolerance{1e-5, 1e-6} : Tolerance{1e-12, 1e-12};
}

inline Precision precision_of(Processor processor) {
  return processor == Processor::single ? Precision::single : Precision::double_;
}

// A request for a device that can do it, preferably one that is no software; nothing where there is none.
inline std::optional<DeviceRequest> device_for(Processor processor) {
  if (!is_device(processor)) return DeviceRequest{.kind = DeviceRequest::Kind::cpu};
  if (const char* named = std::getenv("BISECTOR_TEST_DEVICE")) return parse_device(named);
  static const DeviceList list = list_devices();
  if (const auto gpu = best_gpu(list, precision_of(processor))) return gpu;
  for (const DeviceDescription& device : list.devices)
    if (device.rejected.empty() && (device.float64 || processor == Processor::single))
      return DeviceRequest{.kind = DeviceRequest::Kind::vulkan, .index = device.index};
  return {};
}

inline ComputeOptions options_of(const Setup& setup) {
  ComputeOptions options;
  options.device = device_for(setup.processor).value();
  options.precision = precision_of(setup.processor);
  options.neighbours = setup.source;
  return options;
}

// The process's device for a processor other than the CPU. Most kernels are the same for all tests, and to compile them
// takes longer than to run them.
class SharedDevice : public testing::Environment {
 public:
  static std::shared_ptr<host::Device> for_processor(Processor processor) {
    std::shared_ptr<host::Device>& device = devices_[static_cast<std::size_t>(processor)];
    if (!device) device = host::Device::open(device_for(processor).value());
    return device;
  }
  // Drivers may be gone when static objects are destroyed.
  void TearDown() override { devices_ = {}; }

 private:
  static inline std::array<std::shared_ptr<host::Device>, kProcessors.size()> devices_;
};
inline testing::Environment* const shared_device = testing::AddGlobalTestEnvironment(new SharedDevice);

// The process's ranks.
class SharedRanks : public testing::Environment {
 public:
  static Ranks& root() {
    if (!ranks_) ranks_ = std::make_unique<ThreadRanks>(3);
    return ranks_->root();
  }
  void TearDown() override { ranks_.reset(); }

 private:
  static inline std::unique_ptr<ThreadRanks> ranks_;
};
inline testing::Environment* const shared_ranks = testing::AddGlobalTestEnvironment(new SharedRanks);

inline host::VulkanOptions vulkan_options_of(const Setup& setup) {
  host::VulkanOptions options;
  options.precision = precision_of(setup.processor);
  options.neighbours = setup.source;
  return options;
}

inline std::unique_ptr<Backend> backend_for(const Surface& surface, const Setup& setup) {
  if (setup.processor == Processor::cpu) return std::make_unique<CpuBackend>(surface, setup.source);
  if (setup.processor == Processor::ranks)
    return std::make_unique<DistributedBackend>(surface, setup.source, SharedRanks::root());
  return host::make_vulkan_backend(surface, SharedDevice::for_processor(setup.processor), vulkan_options_of(setup));
}

inline std::unique_ptr<SolidBackend> backend_for(const Solid& solid, const Setup& setup,
                                                 SolidCells how = SolidCells::whole) {
  if (setup.processor == Processor::cpu) return std::make_unique<CpuSolidBackend>(solid, setup.source, how);
  return host::make_vulkan_solid_backend(solid, SharedDevice::for_processor(setup.processor), vulkan_options_of(setup),
                                         how);
}

#define SKIP_WITHOUT_DEVICE(processor) \
  if (!device_for(processor)) GTEST_SKIP() << "no Vulkan device for this"

// What the reported vertices give, which the moments do not show. Vertices are rounded at the size of the coordinates.
inline void expect_same_areas(const Surface& surface, const Diagram& reference, const Diagram& found,
                              double tolerance) {
  const double rounding = 1e-15 * (norm(surface.box.lo) + norm(surface.box.hi));
  const std::vector<Vec3>&a = reference.polygons.vertices, &b = found.polygons.vertices;
  ASSERT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t k = 0; k < reference.polygons.pairs.size(); ++k) {
    const std::size_t begin = reference.polygons.offsets[k], end = reference.polygons.offsets[k + 1];
    Vec3 twice_a, twice_b;
    double perimeter = 0;
    for (std::size_t e = begin; e < end; ++e) {
      const std::size_t next = e + 1 == end ? begin : e + 1;
      twice_a += cross(a[e] - a[begin], a[next] - a[begin]);
      twice_b += cross(b[e] - b[begin], b[next] - b[begin]);
      perimeter += norm(a[next] - a[e]);
    }
    const double excess = 0.5 * norm(twice_b - twice_a) - rounding * perimeter;
    if (!(excess <= 0)) worst = std::max(worst, excess / reference.moments.step_mass[reference.polygons.pairs[k].cell]);
    ASSERT_FALSE(std::isnan(excess)) << "polygon " << k;
  }
  EXPECT_LE(worst, tolerance);
}

inline void expect_parity(const Surface& surface, const Diagram& reference, const Evaluated& found,
                          Processor processor) {
  const Parity parity = compare(reference.moments, reference.polygons, found.moments, found.polygons, surface);
  EXPECT_TRUE(parity.same_pairs);
  EXPECT_TRUE(parity.same_labels);
  EXPECT_TRUE(parity.same_dual);
  EXPECT_EQ(count_untiled(surface, found.polygons), 0u);
  EXPECT_TRUE(found.moments.triangles.offsets == reference.moments.triangles.offsets);
  EXPECT_TRUE(found.moments.triangles.values == reference.moments.triangles.values);
  const Tolerance tolerance = tolerance_of(processor);
  EXPECT_LE(parity.mass_error, tolerance.cells);
  EXPECT_LE(parity.centroid_error, tolerance.cells);
  EXPECT_LE(parity.energy_error, tolerance.cells);
  EXPECT_LE(parity.sum_error, tolerance.sum);
  EXPECT_NEAR(found.moments.energy, reference.moments.energy, tolerance.cells * reference.moments.energy);
  if (parity.same_labels && surface.density.empty()) expect_same_areas(surface, reference, found, tolerance.cells);
  if (processor != Processor::single) {
    EXPECT_TRUE(parity.bitwise) << "not the CPU's bits";
  }
  EXPECT_EQ(found.report.certification.pairs, reference.polygons.pairs.size());
  if (processor != Processor::single) {
    EXPECT_EQ(found.report.certification.doubled, 0u);
  }
}

}  // namespace bisector::test
