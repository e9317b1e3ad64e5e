#include "bisector/tetmesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "bisector/error.h"
#include "compute/compute.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "features/size_field.h"
#include "mesh/locate.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "remesh/detail.h"
#include "remesh/prepare.h"
#include "remesh/sizing.h"
#include "tetmesh/boundary_phase.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/conform.h"
#include "tetmesh/free_phase.h"
#include "tetmesh/improve.h"
#include "tetmesh/inner_phase.h"
#include "tetmesh/stand_ins.h"
#include "tetmesh/tetgen.h"
#include "voronoi/clipped.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

constexpr std::size_t kFewest = 8;  // vertices or seeds that a result can be made of
constexpr double kEnough = 0.97;    // of the sites wanted; with fewer the boundary takes more
constexpr double kGoalBeyond = 5;   // degrees: aiming a little higher than asked for raises the mean as well
// Fractions of the whole run, about, for progress.
constexpr double kPlaced = 0.82, kExtracted = 0.85;

void check_options(const TetOptions& options) {
  if (!options.seeds.empty()) {
    if (options.seeds.size() < kFewest)
      throw Error(fmt::format("a tetrahedral mesh needs at least {} seeds; give more", kFewest));
    return;
  }
  if ((options.vertices > 0) == (options.edge_length > 0))
    throw Error("ask for a number of vertices or for an edge length, and not for both");
  if (options.edge_length == 0 && options.vertices < kFewest)
    throw Error(fmt::format("a tetrahedral mesh needs at least {} vertices; ask for more", kFewest));
}

// The finished boundary, whose vertices are the first of the run's sites.
struct FinishedBoundary {
  RemeshResult surface;
  JointReport joint;
};

// From free sites to those of the finished boundary and inside it.
FinishedBoundary place_sites(TetRun& run, const BoundaryShare& share, StandIns& stand_ins) {
  FinishedBoundary finished;
  finished.joint = joint_phase(run, share, stand_ins.coarse());
  finished.surface = finish_boundary(run);
  inner_phase(run, finished.surface, stand_ins.within(finished.surface.mesh, run.wanted, run.solid));
  return finished;
}

// If that leaves too few sites, there is no room inside for what the boundary did not take: it is done again from the
// free sites, and the boundary takes more.
FinishedBoundary place_enough_sites(TetRun& run, StandIns& stand_ins) {
  const PlacedSeeds free = run.sites.seeds;
  const double done = run.done;
  FinishedBoundary finished = place_sites(run, {}, stand_ins);
  const auto count = static_cast<double>(run.sites.seeds.size()), wanted = static_cast<double>(run.wanted);
  if (count >= kEnough * wanted || finished.joint.thin) return finished;
  run.sites.seeds = free;
  run.done = done;
  return place_sites(run, {wanted - count, true}, stand_ins);
}

void extract(const CvtRun& sites, const TriangleMesh& boundary, TetResult& result) {
  const Stopwatch watch;
  const std::size_t count = boundary.vertices.size();
  const std::vector<Vec3>& seeds = sites.seeds.positions();
  const std::vector<Vec3> inside(seeds.begin() + static_cast<std::ptrdiff_t>(count), seeds.end());
  sites.context().report({"extracting", 0, 1, sites.energy, sites.gradient_norm, kPlaced});
  ConformingTets tets = conforming_tets(boundary, inside, {}, sites.context());
  result.mesh = std::move(tets.mesh);
  result.delaunay = tets.delaunay;
  result.steiner_points = tets.steiner_points;
  result.refused_sites = tets.refused.size();
  result.boundary_vertices = count;
  result.seconds.extract = watch.seconds();
}

void remove_slivers(const CvtRun& sites, double min_dihedral, TetResult& result) {
  const Stopwatch watch;
  if (min_dihedral > 0) {
    TetImproveOptions improve;
    improve.insert_below = min_dihedral;
    improve.goal = min_dihedral + kGoalBeyond;
    sites.context().report({"improving", 0, 1, sites.energy, sites.gradient_norm, kExtracted});
    TetImproveResult improved = improve_tets(result.mesh, improve, sites.context());
    result.mesh = std::move(improved.mesh);
    result.improved = std::move(improved.report);
  }
  result.seconds.improve = watch.seconds();
}

std::size_t count_untiled(TetRun& run) {
  const Diagram& diagram = run.sites.diagram(Want::polygons | Want::polyhedra);
  return count_untiled(run.solid.solid(), diagram.polyhedra) + count_untiled(run.solid.surface(), diagram.polygons);
}

TetResult mesh_sized(TetRun& run, StandIns& stand_ins) {
  TetResult result;
  result.wanted = run.wanted;
  result.edge_length = run.sized.edge_length;
  result.volume = run.solid.solid().volume;
  const TriangleMesh& surface = run.solid.surface().mesh;
  result.input_topology = analyse_topology(surface.triangles, surface.vertices.size());
  free_phase(run, stand_ins);
  FinishedBoundary finished = place_enough_sites(run, stand_ins);
  extract(run.sites, finished.surface.mesh, result);
  remove_slivers(run.sites, run.options.min_dihedral, result);
  result.certification = run.sites.certification();
  result.untiled = count_untiled(run);
  result.boundary = std::move(finished.surface);
  result.boundary.mesh = {};
  result.boundary_sites = finished.joint.met_boundary;
  const RunTotals& totals = run.sites.totals;
  result.iterations = totals.iterations;
  result.evaluations = totals.evaluations;
  result.device_work = totals.device_work;
  result.energy = run.sites.energy;
  result.gradient_norm = run.sites.gradient_norm;
  result.device = run.solid.description();
  result.seconds.boundary = run.seconds_boundary;
  result.seconds.lbfgs = totals.seconds_lbfgs;
  result.seconds.diagrams = totals.seconds;
  return result;
}

// The triangles of one tetrahedron each, on the solid's vertices, with the labels of its marked triangles.
TriangleMesh boundary_of(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  surface.triangles = boundary_facets(mesh.tets);
  surface.feature_edges = mesh.feature_edges;
  if (mesh.boundary_labels.empty()) return surface;
  std::vector<std::pair<Triangle, std::int32_t>> marks(mesh.boundary.size());
  for (std::size_t t = 0; t < marks.size(); ++t) {
    marks[t] = {mesh.boundary[t], mesh.boundary_labels[t]};
    std::sort(marks[t].first.begin(), marks[t].first.end());
  }
  std::sort(marks.begin(), marks.end());
  for (Triangle t : surface.triangles) {
    std::sort(t.begin(), t.end());
    const auto mark =
        std::lower_bound(marks.begin(), marks.end(), std::pair{t, std::numeric_limits<std::int32_t>::min()});
    surface.labels.push_back(mark != marks.end() && mark->first == t ? mark->second : 0);
  }
  return surface;
}

// The same of a solid refined from one whose boundary is known.
TriangleMesh boundary_of(const SizedSolid& sized, const TetMesh& given, const TriangleMesh& boundary) {
  return sized.mesh.tets.size() == given.tets.size() ? boundary : boundary_of(sized.mesh);
}

// Edges of a boundary that are shared by two triangles; marks inside the solid are none of its features.
void keep_boundary_edges(TriangleMesh& surface) {
  const EdgeTable table = edge_table(surface.triangles, surface.vertices.size());
  std::erase_if(surface.feature_edges, [&](std::array<Index, 2> e) {
    if (e[0] > e[1]) std::swap(e[0], e[1]);
    return !std::binary_search(table.edges.begin(), table.edges.end(), e);
  });
}

void set_regions(const TetMesh& from, TetMesh& mesh) {
  mesh.regions.clear();
  if (from.regions.empty()) return;
  const TetLocator locator(from);
  mesh.regions.resize(mesh.tets.size());
  parallel_each(mesh.tets.size(), [&](std::size_t t) {
    Vec3 centre;
    for (Index v : mesh.tets[t]) centre += 0.25 * mesh.vertices[v];
    mesh.regions[t] = from.regions[locator.nearest(centre)];
  });
}

// A boundary that no surface of the result could follow.
void check_boundary(const TetMesh& solid) {
  TriangleMesh surface;
  surface.vertices = solid.vertices;
  try {
    surface.triangles = boundary_facets(solid.tets);
    check_surface(surface);
  } catch (const Error& error) {
    throw Error(std::string("the tetrahedra's boundary: ") + error.what());
  }
}

void check_attribute(const TetOptions& options, std::size_t vertices) {
  const SizingOptions& field = options.sizing.field;
  if (field.kind == DensityKind::attribute && options.sizing.sizes.points.empty() && field.attribute.size() != vertices)
    throw Error(fmt::format("the density has {} values for {} vertices; give one per vertex", field.attribute.size(),
                            vertices));
}

// What becomes of the boundary's features and edge lengths where they are finer than the edges.
struct BoundaryDetail {
  FeatureGraph features;
  std::optional<SizeField> bound;
  DetailResult result;
};

// `plain` is the solid refined for sizes without details.
BoundaryDetail plan_boundary(const TetMesh& mesh, const TriangleMesh& surface, const SizedSolid& plain,
                             const TetOptions& options) {
  BoundaryDetail detail;
  detail.features = detect_features(surface, options.features);
  if (options.detail == DetailMode::off || !options.seeds.empty()) return detail;
  std::vector<double> lengths(surface.vertices.size(), plain.edge_length);
  std::copy_n(plain.lengths.begin(), std::min(plain.lengths.size(), lengths.size()), lengths.begin());
  const MeshEstimate without =
      estimate_mesh(boundary_of(plain, mesh, surface), {plain.surface_density(), plain.edge_length});
  DetailPlan plan = plan_details(surface, detail.features, lengths, static_cast<std::size_t>(without.vertices),
                                 options.detail == DetailMode::all);
  detail.features = std::move(plan.features);
  detail.result = plan.result;
  if (!plan.points.empty()) detail.bound.emplace(plan.points, plan.lengths, options.sizing.field.gradation);
  return detail;
}

TetResult mesh_solid(TetMesh mesh, const TetOptions& options, const Context& context) {
  const Stopwatch watch;
  TriangleMesh surface = boundary_of(mesh);
  keep_boundary_edges(surface);
  const SizingTarget target = options.seeds.empty() ? SizingTarget{options.vertices, options.edge_length}
                                                    : SizingTarget{options.seeds.size(), 0};
  SizedSolid sized = refine_for_sizes(mesh, surface, options.sizing, target);
  const BoundaryDetail detail = plan_boundary(mesh, surface, sized, options);
  const SizeField* bound = detail.bound ? &*detail.bound : nullptr;
  if (bound) sized = refine_for_sizes(mesh, surface, options.sizing, target, bound, options.detail == DetailMode::all);
  if (sized.vertices < kFewest)
    throw Error(fmt::format("edges of {:.6g} make {} vertices, fewer than {}; ask for shorter ones",
                            options.edge_length, sized.vertices, kFewest));
  const FeatureGraph features = split_features(detail.features, sized.splits);
  const Solid solid(sized.mesh, sized.volume_density());
  TriangleMesh outside = boundary_of(sized, mesh, surface);
  const Surface boundary(std::move(outside), sized.surface_density());
  const double preparing = watch.seconds();
  Compute compute(options.compute, context);
  const std::unique_ptr<SolidBackend> backend = compute.backend(solid);
  const std::unique_ptr<Backend> boundary_backend = compute.backend(boundary);
  StandIns stand_ins(mesh, surface, *boundary_backend, features, options, bound, compute, context);
  const FeatureCurves curves(features, solid.mesh.vertices);
  const std::size_t wanted = options.seeds.empty() ? sized.vertices : options.seeds.size();
  TetRun run{CvtRun(*backend, curves, context),
             *backend,
             *boundary_backend,
             features,
             sized,
             options,
             [&](const Surface& domain) { return compute.backend(domain); },
             wanted};
  TetResult result = mesh_sized(run, stand_ins);
  set_regions(sized.mesh, result.mesh);
  result.background_tets = sized.mesh.tets.size();
  result.detail = detail.result;
  result.seconds.prepare = preparing;
  result.seconds.total = watch.seconds();
  return result;
}

// Densities and feature edges given for the vertices before welding, as those of the vertices after it.
TetOptions follow_vertices(const TetOptions& options, const WeldResult& welded) {
  TetOptions moved = options;
  std::vector<double>& attribute = moved.sizing.field.attribute;
  if (!attribute.empty()) {
    std::vector<double> values(welded.mesh.vertices.size());
    for (std::size_t v = welded.vertex_of.size(); v-- > 0;) values[welded.vertex_of[v]] = attribute[v];
    attribute = std::move(values);
  }
  for (auto& edge : moved.features.given)
    for (Index& v : edge) {
      if (v >= welded.vertex_of.size())
        throw Error(fmt::format("feature edge of vertex {}: the mesh has none; correct it", v));
      v = welded.vertex_of[v];
    }
  std::erase_if(moved.features.given, [](const std::array<Index, 2>& e) { return e[0] == e[1]; });
  return moved;
}

}  // namespace

TetResult tetrahedralise(const TriangleMesh& input, const TetOptions& options, const Context& context) {
  const Stopwatch watch;
  check_options(options);
  check_attribute(options, input.vertices.size());
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  const WeldResult welded = join_borders(input, options.weld);
  const TriangleMesh surface = check_surface(welded.mesh);
  const TetOptions moved = follow_vertices(options, welded);
  context.report({"background tetrahedra", 0, 1, 0, 0, 0});
  TetMesh background = tetgen_tets(surface, {}, context).mesh;
  const double seconds = watch.seconds();
  TetResult result = mesh_solid(std::move(background), moved, context);
  result.mesh.label_names = input.label_names;
  result.seconds.background = seconds;
  result.seconds.total = watch.seconds();
  return result;
}

TetResult tetrahedralise(const TetMesh& solid, const TetOptions& options, const Context& context) {
  check_options(options);
  check_attribute(options, solid.vertices.size());
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  check_boundary(solid);
  TetResult result = mesh_solid(solid, options, context);
  result.mesh.region_names = solid.region_names;
  result.mesh.label_names = solid.label_names;
  return result;
}

}  // namespace bisector
