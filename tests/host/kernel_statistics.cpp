// Compiles all kernels for hardware that need not be there: for scripts/kernel_statistics, which reads what the driver
// says of each from stderr. The kernels and their variants are those that evaluations on a device that can run use.
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/device/device_impl.h"
#include "host/passes/vulkan_backend.h"
#include "host/passes/vulkan_solid_backend.h"
#include "support/models.h"
#include "support/solids.h"

namespace {

using namespace bisector;

bool is_absent(const host::Candidate& candidate) { return candidate.description.name.starts_with("Null hardware"); }

template <class Domain>
std::vector<double> density_of(const Domain& mesh) {
  return std::vector<double>(mesh.vertices.size(), 2);
}

void evaluate(Backend& backend, const std::vector<Vec3>& seeds, Want want) {
  Diagram diagram;
  backend.evaluate(seeds, want, diagram);
}

void use_all(const std::shared_ptr<host::Device>& device) {
  const TriangleMesh ball = test::icosphere(3);
  const TetMesh mesh = test::shaken(test::tet_grid(2, 2, 2), 0.2, 1);
  for (const Precision precision : {Precision::double_, Precision::single}) {
    host::VulkanOptions options;
    options.precision = precision;
    for (const bool uniform : {true, false}) {
      const Surface surface(ball, uniform ? std::vector<double>{} : density_of(ball));
      const auto backend = host::make_vulkan_backend(surface, device, options);
      // Few cells have so many pairs that these are sorted in another way.
      for (const std::size_t seeds : {300u, 5u}) evaluate(*backend, test::random_seeds(ball, seeds, 2), Want::polygons);
      const Solid solid(mesh, uniform ? std::vector<double>{} : density_of(mesh));
      for (const SolidCells how : {SolidCells::whole, SolidCells::clipped})
        evaluate(*host::make_vulkan_solid_backend(solid, device, options, how), test::seeds_about(mesh, 200, 0, 3),
                 Want::polygons | Want::polyhedra);
    }
  }
}

std::string text_of(const host::Kernel& kernel) {
  std::string text = kernel.name;
  for (const std::uint32_t constant : kernel.constants) text += ' ' + std::to_string(constant);
  return text;
}

int run() {
  const auto instance = host::Instance::shared();
  std::shared_ptr<host::Device> able;
  const host::Candidate* absent = nullptr;
  const std::vector<host::Candidate> candidates = host::enumerate_candidates(*instance);
  for (const host::Candidate& candidate : candidates) {
    if (is_absent(candidate)) absent = &candidate;
    else if (!able && candidate.description.float64)
      able = host::Device::open({.kind = DeviceRequest::Kind::vulkan, .index = candidate.description.index});
  }
  if (!able || !absent) {
    std::fprintf(stderr, "kernel_statistics: a device with double precision and one of no hardware are needed\n");
    return 1;
  }
  use_all(able);
  host::Device::Impl impl(instance, *absent);
  for (const auto& [kernel, bindings, push_bytes] : able->impl().pipelines->used()) {
    std::fprintf(stderr, "KERNEL %s\n", text_of(kernel).c_str());
    impl.pipelines->get(kernel, bindings, push_bytes);
  }
  return 0;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kernel_statistics: %s\n", error.what());
    return 1;
  }
}
