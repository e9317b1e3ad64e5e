#include "bisector/tetmesh.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "bisector/error.h"
#include "checkpoint/bytes.h"
#include "checkpoint/fingerprint.h"
#include "checkpoint/step_store.h"
#include "compute/compute.h"
#include "core/magnitude.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "mesh/locate.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "remesh/mend_input.h"
#include "remesh/prepare.h"
#include "remesh/sizing.h"
#include "tetmesh/boundary_phase.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/conform.h"
#include "tetmesh/free_phase.h"
#include "tetmesh/improve.h"
#include "tetmesh/inner_phase.h"
#include "tetmesh/regions.h"
#include "tetmesh/solid_plan.h"
#include "tetmesh/solids_apart.h"
#include "tetmesh/stand_ins.h"
#include "tetmesh/tetgen.h"
#include "tetmesh/walls.h"
#include "voronoi/clipped.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

constexpr double kEnough = 0.97;   // of the sites wanted; with fewer the boundary takes more
constexpr double kGoalBeyond = 5;  // degrees: aiming a little higher than asked for raises the mean as well
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

void write_improved(const TetImproveResult& improved, ByteWriter& out) {
  const TetMesh& mesh = improved.mesh;
  out.put_all(mesh.vertices).put_all(mesh.tets).put_all(mesh.regions).put_all(mesh.boundary);
  out.put_all(mesh.boundary_labels).put_all(mesh.feature_edges).put(improved.report);
}

void read_improved(ByteReader in, TetImproveResult& improved) {
  TetMesh& mesh = improved.mesh;
  in.get_all(mesh.vertices);
  in.get_all(mesh.tets);
  in.get_all(mesh.regions);
  in.get_all(mesh.boundary);
  in.get_all(mesh.boundary_labels);
  in.get_all(mesh.feature_edges);
  in.get(improved.report);
  in.end();
}

// Or what a checkpoint knows of it.
TetImproveResult improved_tets(const TetMesh& mesh, const TetImproveOptions& options, const Context& context) {
  if (!context.checkpoint) return improve_tets(mesh, options, context);
  const Stopwatch watch;
  StepStore& store = context.checkpoint->steps();
  Fingerprint start;
  start.add_all(mesh.vertices).add_all(mesh.tets).add_all(mesh.regions).add_all(mesh.boundary).add(options.goal);
  const StepKey step = store.begin(start.value());
  TetImproveResult improved;
  if (const std::optional<std::string> known = store.result(step)) {
    read_improved(ByteReader(*known), improved);
    return improved;
  }
  improved = improve_tets(mesh, options, context);
  ByteWriter out;
  write_improved(improved, out);
  store.keep_result(step, out.take(), watch.seconds(), context);
  return improved;
}

void remove_slivers(double min_dihedral, const Context& context, TetResult& result) {
  const Stopwatch watch;
  if (min_dihedral > 0) {
    TetImproveOptions improve;
    improve.insert_below = min_dihedral;
    improve.goal = min_dihedral + kGoalBeyond;
    context.report({"improving", 0, 1, result.energy, result.gradient_norm, kExtracted});
    TetImproveResult improved = improved_tets(result.mesh, improve, context);
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

TetResult mesh_solid(const TetMesh& mesh, const TetOptions& options, const Context& context) {
  const Stopwatch watch;
  TriangleMesh surface = labelled_boundary(mesh);
  keep_own_edges(surface);
  const auto surface_of = [&](const TetMesh& refined) {
    return refined.tets.size() == mesh.tets.size() ? surface : labelled_boundary(refined);
  };
  const SolidPlan plan = plan_solid(mesh, surface, surface_of, options);
  const SizedSolid& sized = plan.sized;
  const FeatureGraph features = split_features(plan.features, sized.splits);
  const Solid solid(sized.mesh, sized.volume_density());
  const Surface boundary(surface_of(sized.mesh), sized.surface_density());
  const double preparing = watch.seconds();
  Compute compute(options.compute, context);
  const std::unique_ptr<SolidBackend> backend = compute.backend(solid);
  const std::unique_ptr<Backend> boundary_backend = compute.backend(boundary);
  StandIns stand_ins(mesh, surface, *boundary_backend, features, options, plan.bounds(), compute, context);
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
  result.background_tets = sized.mesh.tets.size();
  result.detail = plan.detail;
  result.seconds.prepare = preparing;
  return result;
}

std::vector<TetRegion> measure_regions(const TetMesh& input, const TetMesh& result) {
  std::map<std::int32_t, TetRegion> regions;
  const auto volume = [](const TetMesh& mesh, std::size_t t) {
    const auto& [a, b, c, d] = mesh.tets[t];
    return std::abs(rounded_six_volume(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], mesh.vertices[d])) / 6;
  };
  for (std::size_t t = 0; t < input.regions.size(); ++t) {
    TetRegion& region = regions[input.regions[t]];
    region.region = input.regions[t];
    region.input_volume += volume(input, t);
  }
  for (std::size_t t = 0; t < result.regions.size(); ++t) {
    TetRegion& region = regions[result.regions[t]];
    region.volume += volume(result, t);
    ++region.tets;
  }
  std::vector<TetRegion> measured;
  for (const auto& [number, region] : regions) measured.push_back(region);
  return measured;
}

// Regions that are nowhere next to each other are told by where tetrahedra lie; others are meshed with their
// interfaces.
TetResult mesh_any(const TetMesh& given, const TetOptions& options, const Context& context) {
  const Stopwatch watch;
  const SolidsApart apart(given, options);
  const TetMesh& mesh = apart.empty() ? given : apart.mesh();
  const Walls walls = find_walls(mesh);
  const bool divided = walls.divide();
  TetResult result = divided ? mesh_regions(mesh, walls, options, context) : mesh_solid(mesh, options, context);
  remove_slivers(options.min_dihedral, context, result);
  if (!divided) set_regions(mesh, result.mesh);
  result.regions = measure_regions(mesh, result.mesh);
  if (divided)
    for (const TetRegion& region : result.regions) result.volume += region.input_volume;
  apart.move_back(result);
  result.seconds.total = watch.seconds();
  return result;
}

void check_given(const TetOptions& options, std::size_t vertices) {
  for (const auto& edge : options.features.given)
    for (const Index v : edge)
      if (v >= vertices) throw Error(fmt::format("feature edge of vertex {}: the mesh has none; correct it", v));
}

// Densities and feature edges given for the vertices before welding, as those of the vertices after it.
TetOptions follow_vertices(const TetOptions& options, const WeldResult& welded) {
  TetOptions moved = options;
  std::vector<double>& attribute = moved.sizing.field.attribute;
  if (!attribute.empty()) {
    std::vector<double> values(welded.mesh.vertices.size());
    for (std::size_t v = welded.vertex_of.size(); v-- > 0;)
      if (welded.vertex_of[v] != kNone) values[welded.vertex_of[v]] = attribute[v];
    attribute = std::move(values);
  }
  rename_edges(welded.vertex_of, moved.features.given);
  return moved;
}

// Solids that touch, or lie on each other with faces.
void separate(TriangleMesh& mesh, TetOptions& options, const Context& context) {
  Separation separation(mesh);
  separation.separate(mesh, Touching::solids, context);
  options.features.given = separation.edges(mesh, options.features.given);
  std::vector<double>& attribute = options.sizing.field.attribute;
  if (!attribute.empty()) attribute = separation.values(std::move(attribute));
  // A surface that has borders is to be joined at its seams.
  part_equal_points(mesh, analyse_topology(mesh.triangles, mesh.vertices.size()).boundary_edges == 0, context);
  open_contacts(mesh, context);
}

}  // namespace

TetResult tetrahedralise(const TriangleMesh& input, const TetOptions& options, const Context& context) {
  const Stopwatch watch;
  check_options(options);
  require_moderate_model(input.vertices, "vertex");
  require_moderate(options.seeds, "seed");
  check_attribute(options, input.vertices.size());
  check_given(options, input.vertices.size());
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  WeldResult welded = join_borders(input, options.weld);
  // Walls may be as near to each other as they like, and touch.
  const bool mends = !options.enclosed_regions && !options.weld;
  if (mends) mend_rounding(welded, options.features.given, 0, context);
  TetOptions moved = follow_vertices(options, welded);
  if (mends) separate(welded.mesh, moved, context);
  const TriangleMesh surface = options.enclosed_regions ? check_walls(welded.mesh) : check_surface(welded.mesh);
  context.report({"background tetrahedra", 0, 1, 0, 0, 0});
  const TetMesh background = (options.enclosed_regions ? tetgen_regions : tetgen_tets)(surface, {}, context).mesh;
  const double seconds = watch.seconds();
  TetResult result = mesh_any(background, moved, context);
  result.mesh.label_names = input.label_names;
  result.seconds.background = seconds;
  result.seconds.total = watch.seconds();
  return result;
}

TetResult tetrahedralise(const TetMesh& solid, const TetOptions& options, const Context& context) {
  check_options(options);
  require_moderate_model(solid.vertices, "vertex");
  require_moderate(options.seeds, "seed");
  check_attribute(options, solid.vertices.size());
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  check_boundary(solid);
  TetResult result = mesh_any(solid, options, context);
  result.mesh.region_names = solid.region_names;
  result.mesh.label_names = solid.label_names;
  return result;
}

}  // namespace bisector
