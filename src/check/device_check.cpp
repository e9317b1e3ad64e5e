#include "check/device_check.h"

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "backend/cpu_backend.h"
#include "compute/compute.h"
#include "core/random.h"
#include "core/stopwatch.h"
#include "cvt/optimise.h"
#include "mesh/sampling.h"

namespace bisector {
namespace {

struct Case {
  std::string model, seeds_name;
  TriangleMesh mesh;
  std::vector<Vec3> seeds;
};

// nu by nv quadrilaterals, each two triangles, over a map of [0, 1]^2; periodic in u and v as asked.
template <class Map>
TriangleMesh mapped_grid(Index nu, Index nv, bool periodic_u, bool periodic_v, const Map& map) {
  TriangleMesh mesh;
  const Index columns = nu + !periodic_u, rows = nv + !periodic_v;
  for (Index j = 0; j < rows; ++j)
    for (Index i = 0; i < columns; ++i) mesh.vertices.push_back(map(double(i) / nu, double(j) / nv));
  const auto vertex = [&](Index i, Index j) { return (j % rows) * columns + i % columns; };
  for (Index j = 0; j < nv; ++j)
    for (Index i = 0; i < nu; ++i) {
      const Index a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1), d = vertex(i, j + 1);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

constexpr double kTurn = 2 * std::numbers::pi;

TriangleMesh bumpy_torus(const Vec3& centre) {
  return mapped_grid(96, 48, true, true, [&](double u, double v) {
    const double tube = 0.35 + 0.06 * std::sin(5 * kTurn * u) * std::sin(3 * kTurn * v);
    const double r = 1 + tube * std::cos(kTurn * v);
    return centre + Vec3{r * std::cos(kTurn * u), r * std::sin(kTurn * u), tube * std::sin(kTurn * v)};
  });
}

// Needle triangles at the poles.
TriangleMesh globe() {
  return mapped_grid(96, 48, true, false, [](double u, double v) {
    const double t = std::numbers::pi * v;
    return Vec3{-std::sin(t) * std::cos(kTurn * u), std::sin(t) * std::sin(kTurn * u), std::cos(t)};
  });
}

// Six sides of n by n squares each, as separate sheets that share borders. Coordinates are exact for n a power of two.
TriangleMesh box(Index n, const Vec3& size) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {0.0, 1.0}) {
      const TriangleMesh sheet = mapped_grid(n, n, false, false, [&](double u, double v) {
        Vec3 p;
        p[axis] = side * size[axis];
        p[(axis + 1) % 3] = (side > 0 ? u : v) * size[(axis + 1) % 3];
        p[(axis + 2) % 3] = (side > 0 ? v : u) * size[(axis + 2) % 3];
        return p;
      });
      const auto first = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), sheet.vertices.begin(), sheet.vertices.end());
      for (const Triangle& t : sheet.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  return mesh;
}

std::vector<Vec3> random_seeds(const TriangleMesh& mesh, std::size_t count) {
  std::vector<Vec3> seeds;
  for (const SurfaceSample& sample : sample_surface(mesh, count, 1)) seeds.push_back(sample.point);
  return seeds;
}

std::vector<Vec3> optimised_seeds(const TriangleMesh& mesh, std::size_t count) {
  const Surface surface(mesh);
  CpuBackend cpu(surface, NeighbourSource::nearest);
  const FeatureCurves none;
  const Context context;
  CvtRun run(cpu, none, context);
  run.seeds = PlacedSeeds(random_seeds(mesh, count));
  OptimiseOptions options;
  options.iterations = 20;
  optimise(run, options);
  return run.seeds.positions();
}

// n + 1 layers in each direction through the bounding box: each vertex of their diagram belongs to many cells.
std::vector<Vec3> grid_seeds(const TriangleMesh& mesh, int n) {
  const Box bounds = bounding_box(mesh.vertices);
  std::vector<Vec3> seeds;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      for (int k = 0; k <= n; ++k) {
        Vec3 p = bounds.lo;
        const int at[3] = {i, j, k};
        for (int axis = 0; axis < 3; ++axis) p[axis] += (bounds.hi[axis] - bounds.lo[axis]) * at[axis] / n;
        seeds.push_back(p);
      }
  return seeds;
}

// Random ones drawn together towards one of them, by up to a thousandth of their distance, and some twice.
std::vector<Vec3> clustered_seeds(const TriangleMesh& mesh, std::size_t count) {
  std::vector<Vec3> seeds = random_seeds(mesh, count);
  const Vec3 centre = seeds[0];
  for (std::size_t i = 1; i < count; ++i)
    seeds[i] = centre + std::pow(10.0, -3 * Random(2, i).uniform()) * (seeds[i] - centre);
  for (std::size_t i = 0; i < count / 50; ++i) seeds[count - 1 - i] = seeds[i];
  return seeds;
}

std::vector<Case> make_cases() {
  const TriangleMesh torus = bumpy_torus({}), far_torus = bumpy_torus({1000, -2000, 500}), sphere = globe();
  const TriangleMesh crate = box(1, {1, 1, 1}), tiles = box(16, {1, 1, 1}), plate = box(16, {1, 1, 0x1p-10});
  return {{"torus", "random", torus, random_seeds(torus, 2000)},
          {"torus", "optimised", torus, optimised_seeds(torus, 1000)},
          {"torus", "clustered", torus, clustered_seeds(torus, 1000)},
          {"far torus", "random", far_torus, random_seeds(far_torus, 1000)},
          {"globe", "random", sphere, random_seeds(sphere, 300)},
          {"globe", "vertices", sphere, sphere.vertices},
          {"crate", "random", crate, random_seeds(crate, 3000)},
          {"crate", "grid", crate, grid_seeds(crate, 8)},
          {"tiles", "grid", tiles, grid_seeds(tiles, 8)},
          {"tiles", "vertices", tiles, tiles.vertices},
          {"plate", "random", plate, random_seeds(plate, 2000)},
          {"plate", "optimised", plate, optimised_seeds(plate, 500)}};
}

struct SolidCase {
  std::string model, seeds_name;
  TetMesh mesh;
  std::vector<Vec3> seeds;
};

// The cubes of an n x n x n grid over [0, 1]^3 but for those along its axis in z, where n > 2, in six tetrahedra each;
// inner vertices moved by up to `shake` of a cube's edge.
TetMesh block(Index n, double shake) {
  TetMesh mesh;
  for (Index k = 0; k <= n; ++k)
    for (Index j = 0; j <= n; ++j)
      for (Index i = 0; i <= n; ++i) {
        Vec3 p{double(i) / n, double(j) / n, double(k) / n};
        const bool inside = i > 0 && i < n && j > 0 && j < n && k > 0 && k < n;
        Random random(3, mesh.vertices.size());
        for (int axis = 0; inside && axis < 3; ++axis) p[axis] += shake / n * (2 * random.uniform() - 1);
        mesh.vertices.push_back(p);
      }
  const Index steps[3] = {1, n + 1, (n + 1) * (n + 1)};
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
  for (Index k = 0; k < n; ++k)
    for (Index j = 0; j < n; ++j)
      for (Index i = 0; i < n; ++i) {
        if (n > 2 && i == n / 2 && j == n / 2) continue;
        for (const auto& order : kOrders) {
          const Index a = i + j * steps[1] + k * steps[2], b = a + steps[order[0]], c = b + steps[order[1]];
          mesh.tets.push_back({a, b, c, c + steps[order[2]]});
        }
      }
  return mesh;
}

std::vector<Vec3> random_points(std::size_t count) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(4, i);
    const double x = random.uniform(), y = random.uniform(), z = random.uniform();
    points.push_back({x, y, z});
  }
  return points;
}

std::vector<Vec3> grid_points(int n) {
  std::vector<Vec3> points;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) points.push_back({(i + 0.5) / n, (j + 0.5) / n, (k + 0.5) / n});
  return points;
}

// Lloyd's steps.
std::vector<Vec3> relaxed_points(const TetMesh& mesh, std::size_t count) {
  const Solid solid(mesh);
  CpuSolidBackend cpu(solid, NeighbourSource::nearest);
  std::vector<Vec3> points = random_points(count);
  Diagram diagram;
  for (int step = 0; step < 10; ++step) {
    cpu.evaluate(points, Want::moments, diagram);
    for (std::size_t i = 0; i < count; ++i)
      if (const Moments& cell = diagram.moments.cells[i]; cell.mass > 0) points[i] += (1 / cell.mass) * cell.first;
  }
  return points;
}

std::vector<SolidCase> make_solid_cases() {
  const TetMesh coarse = block(2, 0), ring = block(5, 0.2);
  return {{"block", "random", coarse, random_points(1000)}, {"block", "grid", coarse, grid_points(7)},
          {"ring", "random", ring, random_points(500)},     {"ring", "optimised", ring, relaxed_points(ring, 300)},
          {"ring", "grid", ring, grid_points(6)},           {"ring", "vertices", ring, ring.vertices}};
}

struct Measured {
  Diagram diagram;
  EvaluationReport report;
  bool repeats = false;
  double seconds = 0;
};

Parity parity_of(const Diagram& a, const Diagram& b, const Surface& surface) {
  return compare(a.moments, a.polygons, b.moments, b.polygons, surface);
}
// The polygons of the boundary count too.
Parity parity_of(const Diagram& a, const Diagram& b, const Solid& solid) {
  Parity parity = compare(a.moments, a.polyhedra, b.moments, b.polyhedra, solid);
  parity.same_labels &= a.polygons.labels == b.polygons.labels;
  return parity;
}

Want all_parts(const Surface&) { return Want::polygons; }
Want all_parts(const Solid&) { return Want::polygons | Want::polyhedra; }

// The evaluation that is timed comes after one of fewer seeds, so that neither start-up nor the very same diagram helps
// it.
Measured measure(Backend& backend, const std::vector<Vec3>& seeds, Want parts) {
  Measured measured;
  measured.report = backend.evaluate(seeds, parts, measured.diagram);
  Diagram other;
  backend.evaluate({seeds.begin(), seeds.end() - 1}, Want::triangles, other);
  const Stopwatch watch;
  backend.evaluate(seeds, Want::triangles, other);
  measured.seconds = watch.seconds();
  measured.repeats = same_bits(measured.diagram.moments, other.moments);
  return measured;
}

bool agrees(const DeviceCheckRow& row) {
  const Parity& p = row.parity;
  const ParityLimits limits = parity_limits(row.device);
  return p.same_pairs && p.same_labels && p.same_dual && row.repeats && p.mass_error <= limits.cells &&
         p.centroid_error <= limits.cells && p.energy_error <= limits.cells && p.sum_error <= limits.sum;
}

template <class Domain>
std::vector<Precision> precisions_of(const Domain& domain, const DeviceRequest& device, Precision asked) {
  if (asked != Precision::automatic) return {asked};
  const BackendDescription best = make_backend(domain, {device, asked, NeighbourSource::nearest})->description();
  if (best.kind == "cpu") return {Precision::double_};
  if (best.precision == "single") return {Precision::single};
  return {Precision::single, Precision::double_};
}

// What a check has to tell and to whom.
struct Check {
  DeviceRequest device;
  Precision asked;
  const Context& context;
  const std::function<void(const DeviceCheckRow&)>& done;
  std::vector<Precision> precisions = {};                                  // known from the first domain on
  std::map<std::pair<Precision, NeighbourSource>, Compute> computes = {};  // kernels are compiled once for each
  std::vector<DeviceCheckRow> rows = {};

  template <class Cpu, class Domain, class Problem>
  void run(const Domain& domain, const Problem& problem, std::size_t triangles, std::size_t tets) {
    if (precisions.empty()) precisions = precisions_of(domain, device, asked);
    for (const NeighbourSource source : {NeighbourSource::nearest, NeighbourSource::delaunay}) {
      Cpu cpu(domain, source);
      const Measured expected = measure(cpu, problem.seeds, all_parts(domain));
      for (const Precision p : precisions) {
        context.check();
        Compute& compute = computes.try_emplace({p, source}, ComputeOptions{device, p, source}, context).first->second;
        const auto backend = compute.backend(domain);
        const Measured found = measure(*backend, problem.seeds, all_parts(domain));
        DeviceCheckRow row{problem.model,
                           problem.seeds_name,
                           source,
                           backend->description(),
                           triangles,
                           problem.seeds.size(),
                           tets,
                           parity_of(expected.diagram, found.diagram, domain),
                           found.report.certification,
                           found.repeats,
                           found.seconds,
                           expected.seconds};
        row.passed = agrees(row);
        done(row);
        rows.push_back(std::move(row));
      }
    }
  }
};

}  // namespace

ParityLimits parity_limits(const BackendDescription& device) {
  return device.precision == "single" ? ParityLimits{1e-5, 1e-6} : ParityLimits{1e-12, 1e-12};
}

std::vector<DeviceCheckRow> check_device(const DeviceRequest& device, Precision precision, const Context& context,
                                         const std::function<void(const DeviceCheckRow&)>& done) {
  Check check{device, precision, context, done};
  for (Case& test : make_cases()) {
    const Surface surface(std::move(test.mesh));
    check.run<CpuBackend>(surface, test, surface.facets.size(), 0);
  }
  for (SolidCase& test : make_solid_cases()) {
    const Solid solid(std::move(test.mesh));
    check.run<CpuSolidBackend>(solid, test, solid.boundary.facets.size(), solid.mesh.tets.size());
  }
  return std::move(check.rows);
}

}  // namespace bisector
