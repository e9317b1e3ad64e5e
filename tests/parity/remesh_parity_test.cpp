// Remeshing with densities and features on every backend: in double the whole run is the CPU's bit for bit; in single,
// where rounding leads to other seeds, their diagrams are the same combinatorially, and features and topology are kept.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "remesh/prepare.h"
#include "remesh/remesh.h"
#include "remesh/topology_control.h"
#include "support/featured.h"
#include "support/models.h"
#include "support/setups.h"
#include "voronoi/ball_property.h"
#include "voronoi/dual.h"
#include "voronoi/localise.h"

namespace bisector::test {
namespace {

// --- What is remeshed ---

struct RemeshCase {
  const char* name;
  TriangleMesh mesh;
  DensityKind density;
  std::size_t vertices;
  bool stands_in = false;  // whether it has so many triangles that others stand in for them
};

// Moved along x in proportion to z.
TriangleMesh leaning(TriangleMesh mesh, double slope) {
  for (Vec3& v : mesh.vertices) v.x += slope * v.z;
  return mesh;
}

TriangleMesh flattened(TriangleMesh mesh, double factor) {
  for (Vec3& v : mesh.vertices) v.z *= factor;
  return mesh;
}

// Creases with acute and obtuse angles, closed creases, local feature size without features, a border, and sheets that
// share an edge.
std::vector<RemeshCase> remesh_cases() {
  return {{"leaning_box", leaning(box(4), 0.8), DensityKind::attribute, 200},
          {"drum", cylinder(32), DensityKind::lfs, 150},
          {"torus", flattened(torus(60, 36), 0.5), DensityKind::lfs, 200, true},
          {"patch", wavy_patch(16), DensityKind::curvature, 150},
          {"pages", pages(), DensityKind::attribute, 120}};
}

// Edges three times as long at one end of the box's diagonal as at the other.
std::vector<double> graded_density(const TriangleMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  const Vec3 d = box.hi - box.lo;
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(std::pow(1 + 2 * dot(v - box.lo, d) / norm2(d), -4));
  return density;
}

struct PreparedCase {
  explicit PreparedCase(const RemeshCase& problem) : PreparedCase(prepared(problem), problem.vertices) {}

  // Stand-ins for the surface get backends like the one given.
  RemeshResult run_on(Backend& backend, const MakeBackend& make_backend) const {
    return remesh(backend, features, plan_of(options), {}, make_backend);
  }

  Surface surface;
  FeatureGraph features;
  RemeshOptions options;

 private:
  PreparedCase(PreparedInput input, std::size_t vertices)
      : surface(std::move(input.mesh), std::move(input.density)), features(std::move(input.features)) {
    options.vertices = vertices;
    options.iterations = 30;
  }

  static PreparedInput prepared(const RemeshCase& problem) {
    RemeshOptions options;
    options.vertices = problem.vertices;
    options.sizing.kind = problem.density;
    if (problem.density == DensityKind::attribute) options.sizing.attribute = graded_density(problem.mesh);
    return Preparation(OrderedInput(problem.mesh, options), {}).lay_down();
  }
};

// --- What must be the same ---

void expect_same_run(const RemeshResult& a, const RemeshResult& b) {
  EXPECT_TRUE(same_bits(a.mesh.vertices, b.mesh.vertices));
  EXPECT_TRUE(a.mesh.triangles == b.mesh.triangles);
  EXPECT_TRUE(a.mesh.feature_edges == b.mesh.feature_edges);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.evaluations, b.evaluations);
  EXPECT_TRUE(same_bits(a.energy, b.energy));
  EXPECT_TRUE(same_bits(a.gradient_norm, b.gradient_norm));
  EXPECT_EQ(a.ball_property, b.ball_property);
  EXPECT_EQ(a.features.broken, b.features.broken);
  EXPECT_EQ(a.improved.trials, b.improved.trials);
  EXPECT_EQ(a.improved.made, b.improved.made);
}

// The seeds' diagram is the CPU's, with the same dual and the same faults of topology.
Diagram expect_same_diagram_of(const PreparedCase& problem, const Setup& setup, Backend& backend,
                               const std::vector<Vec3>& seeds) {
  const Diagram reference = test::diagram_of(problem.surface, seeds, NeighbourSource::nearest);
  const Evaluated found = diagram_of(backend, seeds);
  expect_parity(problem.surface, reference, found, setup.processor);
  const BallReport want = check_ball_property(problem.surface, reference.polygons);
  const BallReport got = check_ball_property(problem.surface, found.polygons);
  EXPECT_EQ(got.holds, want.holds);
  EXPECT_EQ(got.euler, want.euler);
  EXPECT_EQ(got.cells.size(), want.cells.size());
  EXPECT_EQ(got.edges.size(), want.edges.size());
  EXPECT_EQ(got.vertices.size(), want.vertices.size());
  return reference;
}

// Feature edges at each vertex that has some.
std::map<Index, std::size_t> degrees(const FeatureEdges& edges) {
  std::map<Index, std::size_t> count;
  for (const auto& edge : edges)
    for (Index v : edge) ++count[v];
  return count;
}

double length_of(const FeatureEdges& edges, const std::vector<Vec3>& vertices) {
  double sum = 0;
  for (const auto& [a, b] : edges) sum += norm(vertices[a] - vertices[b]);
  return sum;
}

// The graph of the result's feature edges is the input's, drawn with chords: each corner is there with as many edges,
// every other vertex has two, and no more length is missing than chords cut off.
void expect_features_kept(const PreparedCase& problem, const RemeshResult& result) {
  const TriangleMesh& mesh = result.mesh;
  EXPECT_EQ(result.features.broken, 0u);
  std::set<std::array<Index, 2>> edges;
  for (const Triangle& t : mesh.triangles)
    for (int m = 0; m < 3; ++m) edges.insert({std::min(t[m], t[(m + 1) % 3]), std::max(t[m], t[(m + 1) % 3])});
  for (const auto& edge : mesh.feature_edges) EXPECT_TRUE(edges.contains(edge));
  std::map<Index, std::size_t> got = degrees(mesh.feature_edges);
  const std::map<Index, std::size_t> input = degrees(problem.features.edges);
  const auto euler = [](const std::map<Index, std::size_t>& vertices, const FeatureEdges& e) {
    return static_cast<long long>(vertices.size()) - static_cast<long long>(e.size());
  };
  EXPECT_EQ(euler(got, mesh.feature_edges), euler(input, problem.features.edges));
  for (Index corner : problem.features.corners) {
    const Vec3& at = problem.surface.mesh.vertices[corner];
    const auto vertex = std::find(mesh.vertices.begin(), mesh.vertices.end(), at);
    ASSERT_NE(vertex, mesh.vertices.end()) << "corner " << corner;
    const auto v = static_cast<Index>(vertex - mesh.vertices.begin());
    const auto want = input.find(corner);
    EXPECT_EQ(got[v], want == input.end() ? 0 : want->second);
    got.erase(v);
  }
  for (const auto& [v, degree] : got) EXPECT_EQ(degree, 2u) << "vertex " << v;
  const double whole = length_of(problem.features.edges, problem.surface.mesh.vertices);
  const double length = length_of(mesh.feature_edges, mesh.vertices);
  EXPECT_LE(length, whole * (1 + 1e-12));
  EXPECT_GE(length, 0.97 * whole);
}

// --- Whole runs ---

struct RunCase {
  Setup setup;
  RemeshCase problem;
};

void PrintTo(const RunCase& instance, std::ostream* out) {
  *out << name_of(instance.setup) << " " << instance.problem.name;
}

class RemeshRuns : public testing::TestWithParam<RunCase> {};

TEST_P(RemeshRuns, AreTheCpus) {
  const auto& [setup, model] = GetParam();
  SKIP_WITHOUT_DEVICE(setup.processor);
  const PreparedCase problem(model);
  CpuBackend cpu(problem.surface, NeighbourSource::nearest);
  std::size_t stand_ins = 0;
  const RemeshResult reference = problem.run_on(cpu, [&](const Surface& surface) {
    ++stand_ins;
    return std::make_unique<CpuBackend>(surface, NeighbourSource::nearest);
  });
  EXPECT_EQ(stand_ins > 0, model.stands_in);
  const std::unique_ptr<Backend> backend = backend_for(problem.surface, setup);
  const RemeshResult found =
      problem.run_on(*backend, [&](const Surface& surface) { return backend_for(surface, setup); });
  EXPECT_EQ(found.device.fallback, "");
  EXPECT_EQ(found.untiled, 0u);
  EXPECT_EQ(found.divided, 0u);
  expect_features_kept(problem, found);
  EXPECT_EQ(found.ball_property, reference.ball_property);
  EXPECT_EQ(found.topology_matches, reference.topology_matches);
  if (setup.processor != Processor::single) expect_same_run(found, reference);
  {
    SCOPED_TRACE("the CPU's seeds");
    expect_same_diagram_of(problem, setup, *backend, reference.mesh.vertices);
  }
  SCOPED_TRACE("the backend's own seeds");
  Diagram diagram = expect_same_diagram_of(problem, setup, *backend, found.mesh.vertices);
  Localiser localiser(problem.surface);
  Diagram on_cpu = diagram_of(cpu, found.mesh.vertices);
  EXPECT_EQ(localiser.localise(found.mesh.vertices, on_cpu), localiser.localise(found.mesh.vertices, diagram));
  EXPECT_EQ(on_cpu.polygons.labels, diagram.polygons.labels);
  const TriangleMesh dual = dual_mesh(found.mesh.vertices, extract_dual(diagram.polygons));
  EXPECT_TRUE(dual.triangles == found.mesh.triangles) << "not the dual of its vertices";
}

// Runs on software devices take seconds; with the other source of neighbours only diagrams and gradients are tried
// there.
std::vector<RunCase> run_cases() {
  std::vector<RunCase> cases;
  for (const RemeshCase& problem : remesh_cases())
    for (const Setup& setup : setups())
      if (setup.source == NeighbourSource::nearest || setup.processor == Processor::cpu)
        cases.push_back({setup, problem});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Parity, RemeshRuns, testing::ValuesIn(run_cases()), [](const auto& instance) {
  return name_of(instance.param.setup) + "_" + instance.param.problem.name;
});

// --- Gradients ---

class PlacedGradients : public testing::TestWithParam<Setup> {};

INSTANTIATE_TEST_SUITE_P(Parity, PlacedGradients, testing::ValuesIn(setups()),
                         [](const auto& instance) { return name_of(instance.param); });

// A gradient is twice a first moment, of which projection takes something away.
TEST_P(PlacedGradients, AreTheCpusAndTheSlopeOfTheEnergy) {
  const auto& setup = GetParam();
  SKIP_WITHOUT_DEVICE(setup.processor);
  for (const FeaturedModel& model : featured_models()) {
    SCOPED_TRACE(model.name);
    const PlacedProblem problem(model.mesh, 150);
    CpuBackend cpu(problem.surface, NeighbourSource::nearest);
    const std::unique_ptr<Backend> backend = backend_for(problem.surface, setup);
    const CompletedProblem reference = problem.completed_on(cpu), found = problem.completed_on(*backend);
    EXPECT_TRUE(same_bits(found.gradient.normals, reference.gradient.normals));
    if (setup.processor == Processor::single) {
      const Surface& surface = problem.surface;
      for (std::size_t i = 0; i < found.gradient.vectors.size(); ++i) {
        const double mass = reference.moments.step_mass[i];
        const double length2 = std::max(mass * surface.area / surface.mass, reference.moments.cells[i].second / mass);
        EXPECT_LE(norm(found.gradient.vectors[i] - reference.gradient.vectors[i]),
                  2 * tolerance_of(setup.processor).cells * mass * std::sqrt(length2))
            << "seed " << i;
      }
      expect_slopes(*backend, problem, found, {5e-4, 2e-3, 20});
    } else {
      EXPECT_TRUE(same_bits(found.gradient.vectors, reference.gradient.vectors));
      EXPECT_TRUE(same_bits(found.energy, reference.energy));
      EXPECT_TRUE(same_bits(found.gradient_norm, reference.gradient_norm));
      expect_slopes(*backend, problem, found, {1e-4, 1e-4, 20});
    }
  }
}

}  // namespace
}  // namespace bisector::test
