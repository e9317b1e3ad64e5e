// Tetrahedral meshing on every backend: in double the whole run is the CPU's bit for bit; in single, where rounding
// leads to other sites, the mesh is as valid.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "bisector/quality.h"
#include "bisector/tetmesh.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "support/setups.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

struct RunCase {
  const char* name;
  TetMesh mesh;
  bool graded;
};

TetMesh two_regions() {
  TetMesh mesh = tet_grid(2, 1, 1);
  mesh.regions = {1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2};
  return mesh;
}

// Features, a reentrant edge, a density, and an interface.
std::vector<RunCase> run_cases() {
  return {{"box", tet_box(1), false},
          {"step", step(), false},
          {"graded", tet_box(2), true},
          {"regions", two_regions(), false}};
}

struct Instance {
  Setup setup;
  RunCase problem;
};

void PrintTo(const Instance& instance, std::ostream* out) {
  *out << name_of(instance.setup) << " " << instance.problem.name;
}

TetResult run_on(const RunCase& problem, const ComputeOptions& compute) {
  TetOptions options;
  options.vertices = 80;
  options.iterations = 8;
  if (problem.graded) options.sizing.sizes = {{{0, 0, 0}}, {0.15}};
  options.compute = compute;
  return tetrahedralise(problem.mesh, options);
}

class TetRuns : public testing::TestWithParam<Instance> {};

TEST_P(TetRuns, AreTheCpus) {
  const auto& [setup, problem] = GetParam();
  SKIP_WITHOUT_DEVICE(setup.processor);
  const TetResult found = run_on(problem, options_of(setup));
  ComputeOptions cpu;
  cpu.device.kind = DeviceRequest::Kind::cpu;
  const TetResult expected = run_on(problem, cpu);
  const TetTopology topology = analyse_tet_topology(found.mesh);
  EXPECT_TRUE(topology.conforming);
  EXPECT_EQ(topology.boundary.euler, 2);
  EXPECT_EQ(measure_tet_quality(found.mesh).inverted, 0u);
  EXPECT_EQ(found.untiled, 0u);
  EXPECT_EQ(found.boundary.features.broken, 0u);
  EXPECT_NEAR(measure_tet_quality(found.mesh).volume, expected.volume, 1e-9 * expected.volume);
  if (setup.processor == Processor::single) return;
  EXPECT_EQ(found.mesh.tets, expected.mesh.tets);
  EXPECT_EQ(found.mesh.boundary, expected.mesh.boundary);
  EXPECT_TRUE(same_bits(found.mesh.vertices, expected.mesh.vertices));
  EXPECT_EQ(found.evaluations, expected.evaluations);
  EXPECT_EQ(found.energy, expected.energy);
  EXPECT_EQ(found.certification.pairs, expected.certification.pairs);
}

std::vector<Instance> instances() {
  std::vector<Instance> all;
  for (const RunCase& problem : run_cases())
    for (const Setup& setup : solid_setups()) all.push_back({setup, problem});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Parity, TetRuns, testing::ValuesIn(instances()),
                         [](const auto& c) { return name_of(c.param.setup) + "_" + c.param.problem.name; });

}  // namespace
}  // namespace bisector::test
