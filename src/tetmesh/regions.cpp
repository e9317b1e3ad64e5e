#include "tetmesh/regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <utility>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "compute/compute.h"
#include "core/stopwatch.h"
#include "mesh/locate.h"
#include "mesh/tet_topology.h"
#include "remesh/remesh.h"
#include "remesh/sizing.h"
#include "tetmesh/conform.h"
#include "tetmesh/free_phase.h"
#include "tetmesh/inner_phase.h"
#include "tetmesh/solid_plan.h"
#include "tetmesh/stand_ins.h"
#include "tetmesh/tet_run.h"
#include "voronoi/clipped.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

// Fractions of the whole run, about, for progress.
constexpr double kWalls = 0.3, kFilled = 0.85;
// Where walls come too near to each other for their edges, they get so many more vertices, so often.
constexpr double kMoreVertices = 1.5;
constexpr int kTries = 3;
constexpr std::size_t kFewestOnWalls = 8;

// What reports the progress of a step as that of the whole run from one fraction to another.
Context step_of(const Context& context, double from, double to, std::string name) {
  Context step = context;
  if (context.progress)
    step.progress = [from, to, name = std::move(name), tell = context.progress](Progress p) {
      p.phase = name + p.phase;
      p.fraction = from + (to - from) * std::clamp(p.fraction, 0.0, 1.0);
      tell(p);
    };
  return step;
}

// The closed surface around a part, which may touch itself.
struct PartBoundary {
  TriangleMesh surface;         // counter-clockwise seen from outside the part
  std::vector<Index> vertices;  // the walls' vertex of each
};

// `patch_of` is of each triangle of the walls.
PartBoundary boundary_of_part(const TriangleMesh& walls, const std::vector<std::int32_t>& patch_of,
                              const std::vector<Walls::Patch>& patches, Index part) {
  PartBoundary boundary;
  std::vector<Index> place(walls.vertices.size(), kNone);
  for (std::size_t t = 0; t < walls.triangles.size(); ++t) {
    const Walls::Patch& patch = patches[static_cast<std::size_t>(patch_of[t])];
    if (patch.back != part && patch.front != part) continue;
    Triangle triangle = walls.triangles[t];
    if (patch.front == part) std::swap(triangle[1], triangle[2]);
    for (Index& v : triangle) {
      if (place[v] == kNone) {
        place[v] = static_cast<Index>(boundary.surface.vertices.size());
        boundary.surface.vertices.push_back(walls.vertices[v]);
        boundary.vertices.push_back(v);
      }
      v = place[v];
    }
    boundary.surface.triangles.push_back(triangle);
  }
  return boundary;
}

// Whether as many triangles run along each edge one way as the other.
bool is_closed(const TriangleMesh& surface) {
  std::vector<std::array<Index, 2>> forth, back;
  for (const Triangle& t : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      forth.push_back({t[k], t[(k + 1) % 3]});
      back.push_back({t[(k + 1) % 3], t[k]});
    }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  return !forth.empty() && forth == back;
}

// The tetrahedra of a part with the edge lengths there; where they are all the same, that is the uniform one.
SizedSolid sized_part(const SizedSolid& sized, const Walls& walls, Index part) {
  SizedSolid own;
  own.edge_length = sized.edge_length;
  std::vector<Index> place(sized.mesh.vertices.size(), kNone);
  for (std::size_t t = 0; t < sized.mesh.tets.size(); ++t) {
    if (walls.part_of_tet[t] != part) continue;
    Tetrahedron tet = sized.mesh.tets[t];
    for (Index& v : tet) {
      if (place[v] == kNone) {
        place[v] = static_cast<Index>(own.mesh.vertices.size());
        own.mesh.vertices.push_back(sized.mesh.vertices[v]);
        if (!sized.lengths.empty()) own.lengths.push_back(sized.lengths[v]);
      }
      v = place[v];
    }
    own.mesh.tets.push_back(tet);
  }
  if (own.lengths.empty()) return own;
  const auto [least, most] = std::minmax_element(own.lengths.begin(), own.lengths.end());
  if (*least == *most) {
    own.edge_length = *least;
    own.lengths.clear();
  }
  return own;
}

void leave_out_sites_at_boundary(CvtRun& sites) {
  const Csr<Index>& triangles = sites.diagram(Want::triangles).moments.triangles;
  std::vector<Index> outside;
  for (Index i = 0; i < sites.seeds.size(); ++i)
    if (triangles.size(i) > 0) outside.push_back(i);
  sites.seeds.remove(outside);
}

class RegionMesher {
 public:
  RegionMesher(const TetMesh& mesh, const Walls& walls, const TetOptions& options, const Context& context)
      : mesh_(mesh), given_(walls), options_(options), context_(context), compute_(options.compute, context) {}

  TetResult run();

 private:
  std::string name_of(Index part) const;
  void plan();
  void remesh_walls();
  bool take_walls(RemeshResult remeshed, bool last);
  void share_out();
  std::vector<Vec3> sites_inside(Index part);
  void fill(Index part);
  void mark_walls();
  void count(const CvtRun& run);

  const TetMesh& mesh_;
  const Walls& given_;
  const TetOptions& options_;
  const Context& context_;
  Compute compute_;
  SolidPlan plan_;
  Walls walls_;                           // of the solid refined for its sizes
  std::vector<SizedSolid> parts_;         // the refined solid's
  std::vector<Index> part_of_seed_;       // of those given
  TriangleMesh remeshed_;                 // walls of the result
  std::vector<PartBoundary> boundaries_;  // of the parts of the result
  std::vector<std::size_t> inside_;       // sites of each part that are on no wall, as wanted
  TetResult result_;
};

std::string RegionMesher::name_of(Index part) const {
  const std::int32_t region = given_.regions[part];
  const auto name = mesh_.region_names.find(region);
  return name == mesh_.region_names.end() ? fmt::format("region {}", region) : fmt::format("region '{}'", name->second);
}

// Edges that are given are features of the walls as marked ones are.
void RegionMesher::plan() {
  TetMesh marked = mesh_;
  if (options_.features.mode == FeatureMode::none) marked.feature_edges.clear();
  const auto& edges = options_.features.given;
  marked.feature_edges.insert(marked.feature_edges.end(), edges.begin(), edges.end());
  TriangleMesh surface = given_.surface;
  surface.feature_edges = marked.feature_edges;
  keep_own_edges(surface);
  plan_ = plan_solid(
      marked, surface, [](const TetMesh& refined) { return find_walls(refined).surface; }, options_);
  walls_ = find_walls(plan_.sized.mesh);
  for (Index part = 0; part < walls_.regions.size(); ++part) parts_.push_back(sized_part(plan_.sized, walls_, part));
  if (!options_.seeds.empty()) {
    const TetLocator locator(plan_.sized.mesh);
    for (const Vec3& seed : options_.seeds) part_of_seed_.push_back(walls_.part_of_tet[locator.nearest(seed)]);
  }
  result_.wanted = options_.seeds.empty() ? plan_.sized.vertices : options_.seeds.size();
  result_.edge_length = plan_.sized.edge_length;
  result_.background_tets = plan_.sized.mesh.tets.size();
  result_.detail = plan_.detail;
  const std::vector<Triangle> outside = boundary_facets(mesh_.tets);
  result_.input_topology = analyse_topology(outside, mesh_.vertices.size());
}

void RegionMesher::remesh_walls() {
  const SizedSolid& sized = plan_.sized;
  const std::vector<double> density = sized.surface_density();
  const double estimated = estimate_mesh(walls_.surface, {density, sized.edge_length}).vertices;
  RemeshOptions remeshing;
  remeshing.vertices = std::max(kFewestOnWalls, static_cast<std::size_t>(std::llround(estimated)));
  if (!density.empty()) remeshing.sizing.kind = DensityKind::attribute;
  remeshing.sizing.attribute = density;
  remeshing.sizing.gradation = 0;
  remeshing.features = options_.features;
  remeshing.features.given = walls_.surface.feature_edges;
  remeshing.detail = options_.seeds.empty() ? options_.detail : DetailMode::off;
  remeshing.random_seed = options_.random_seed;
  remeshing.iterations = options_.iterations;
  remeshing.tolerance = options_.tolerance;
  remeshing.min_angle = options_.min_angle;
  remeshing.compute = options_.compute;
  Context step = step_of(context_, 0, kWalls, "walls, ");
  step.warning = nullptr;
  for (int left = kTries; left-- > 0;) {
    if (take_walls(bisector::remesh_walls(walls_.surface, remeshing, step), left == 0)) return;
    const double more = kMoreVertices * static_cast<double>(remeshing.vertices);
    remeshing.vertices = static_cast<std::size_t>(std::llround(more));
  }
}

// False if they do not bound the parts, and there is another try.
bool RegionMesher::take_walls(RemeshResult remeshed, bool last) {
  remeshed_ = std::exchange(remeshed.mesh, {});
  result_.iterations += remeshed.iterations;
  result_.evaluations += remeshed.evaluations;
  result_.seconds.boundary += remeshed.seconds.total;
  result_.untiled = remeshed.untiled;
  result_.device = remeshed.device;
  result_.boundary = std::move(remeshed);
  boundaries_.clear();
  const std::size_t crossings = count_self_intersections(remeshed_, context_);
  if (crossings > 0) {
    if (!last) return false;
    throw Error(fmt::format(
        "the walls of the result cross each other at {} pairs of triangles: parts are thinner than their edges; ask "
        "for more vertices",
        crossings));
  }
  for (Index part = 0; part < walls_.regions.size(); ++part) {
    boundaries_.push_back(boundary_of_part(remeshed_, remeshed_.labels, walls_.patches, part));
    if (is_closed(boundaries_.back().surface)) continue;
    if (!last) return false;
    throw Error(fmt::format(
        "the walls of {} are not closed in the result: parts of it are thinner than their edges; ask for more vertices",
        name_of(part)));
  }
  return true;
}

// Among the parts, by the cells that they hold.
void RegionMesher::share_out() {
  std::vector<double> room;
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    const auto on_boundary = static_cast<double>(boundaries_[part].vertices.size());
    room.push_back(std::max(0.0, estimate_cells(parts_[part]) - 0.5 * on_boundary));
  }
  const double all = std::accumulate(room.begin(), room.end(), 0.0);
  const double inside = static_cast<double>(result_.wanted) - static_cast<double>(remeshed_.vertices.size());
  const double share = all > 0 ? std::max(0.0, inside) / all : 0;
  for (const double sites : room) inside_.push_back(static_cast<std::size_t>(std::llround(share * sites)));
}

std::vector<Vec3> RegionMesher::sites_inside(Index part) {
  if (inside_[part] == 0) return {};
  const PartBoundary& boundary = boundaries_[part];
  const SizedSolid& sized = parts_[part];
  TetOptions options = options_;
  options.sizing.sizes = {};
  options.sizing.field = {};
  if (!sized.lengths.empty()) options.sizing.sizes = {sized.mesh.vertices, sized.lengths, sized.mesh.tets};
  options.seeds.clear();
  if (!options_.seeds.empty()) {
    for (std::size_t i = 0; i < options_.seeds.size(); ++i)
      if (part_of_seed_[i] == part) options.seeds.push_back(options_.seeds[i]);
    if (options.seeds.empty()) return {};
  }
  const Solid solid(sized.mesh, sized.volume_density());
  const TriangleMesh outside = labelled_boundary(sized.mesh);
  const Surface surface(outside, sized.surface_density());
  const std::unique_ptr<SolidBackend> backend = compute_.backend(solid);
  const std::unique_ptr<Backend> boundary_backend = compute_.backend(surface);
  const FeatureGraph no_features;
  const double from = kWalls + (kFilled - kWalls) * part / static_cast<double>(parts_.size());
  const double to = kWalls + (kFilled - kWalls) * (part + 1) / static_cast<double>(parts_.size());
  const Context step = step_of(context_, from, to, name_of(part) + ", ");
  StandIns stand_ins(sized.mesh, outside, *boundary_backend, no_features, options, nullptr, compute_, step);
  const FeatureCurves curves(no_features, solid.mesh.vertices);
  TetRun run{CvtRun(*backend, curves, step),
             *backend,
             *boundary_backend,
             no_features,
             sized,
             options,
             [&](const Surface& domain) { return compute_.backend(domain); },
             boundary.vertices.size() + inside_[part]};
  free_phase(run, stand_ins);
  leave_out_sites_at_boundary(run.sites);
  RemeshResult finished;
  finished.mesh = boundary.surface;
  finished.places.resize(boundary.vertices.size());
  inner_phase(run, finished, stand_ins.within(boundary.surface, run.wanted, run.solid));
  const Diagram& diagram = run.sites.diagram(Want::polygons | Want::polyhedra);
  result_.untiled +=
      count_untiled(run.solid.solid(), diagram.polyhedra) + count_untiled(run.solid.surface(), diagram.polygons);
  result_.device = run.solid.description();
  count(run.sites);
  const std::vector<Vec3>& seeds = run.sites.seeds.positions();
  return {seeds.begin() + static_cast<std::ptrdiff_t>(boundary.vertices.size()), seeds.end()};
}

void RegionMesher::count(const CvtRun& run) {
  const RunTotals& totals = run.totals;
  result_.iterations += totals.iterations;
  result_.evaluations += totals.evaluations;
  result_.device_work += totals.device_work;
  result_.seconds.lbfgs += totals.seconds_lbfgs;
  result_.seconds.diagrams += totals.seconds;
  result_.energy += run.energy;
  result_.gradient_norm = std::hypot(result_.gradient_norm, run.gradient_norm);
  const Certification& own = run.certification();
  Certification& all = result_.certification;
  all.pairs += own.pairs;
  all.uncertain += own.uncertain;
  all.wider += own.wider;
  all.doubled += own.doubled;
  all.cpu += own.cpu;
}

// The part's tetrahedra, with its region.
void RegionMesher::fill(Index part) {
  const PartBoundary& boundary = boundaries_[part];
  const std::vector<Vec3> inside = sites_inside(part);
  const Stopwatch watch;
  const ConformingTets tets = conforming_tets(boundary.surface, inside, {}, context_);
  TetMesh& mesh = result_.mesh;
  std::vector<Index> place = boundary.vertices;
  for (std::size_t v = place.size(); v < tets.mesh.vertices.size(); ++v) {
    place.push_back(static_cast<Index>(mesh.vertices.size()));
    mesh.vertices.push_back(tets.mesh.vertices[v]);
  }
  for (Tetrahedron tet : tets.mesh.tets) {
    for (Index& v : tet) v = place[v];
    mesh.tets.push_back(tet);
  }
  mesh.regions.resize(mesh.tets.size(), walls_.regions[part]);
  result_.delaunay = result_.delaunay && tets.delaunay;
  result_.steiner_points += tets.steiner_points;
  result_.refused_sites += tets.refused.size();
  result_.seconds.extract += watch.seconds();
}

// The walls as marked triangles, those between regions facing away from that of the lower number.
void RegionMesher::mark_walls() {
  TetMesh& mesh = result_.mesh;
  mesh.boundary = remeshed_.triangles;
  for (const std::int32_t patch : remeshed_.labels)
    mesh.boundary_labels.push_back(walls_.patches[static_cast<std::size_t>(patch)].label);
  const Walls walls = find_walls(mesh);
  mesh.boundary = walls.surface.triangles;
  mesh.boundary_labels.clear();
  bool labelled = false;
  for (std::size_t t = 0; t < mesh.boundary.size(); ++t) {
    const Walls::Patch& patch = walls.patches[static_cast<std::size_t>(walls.surface.labels[t])];
    mesh.boundary_labels.push_back(patch.label);
    labelled = labelled || patch.label != 0;
    if (patch.front == kNone) continue;
    ++result_.interface_triangles;
    if (walls.regions[patch.front] < walls.regions[patch.back]) std::swap(mesh.boundary[t][1], mesh.boundary[t][2]);
  }
  if (!labelled) mesh.boundary_labels.clear();
  mesh.feature_edges = remeshed_.feature_edges;
}

TetResult RegionMesher::run() {
  const Stopwatch watch;
  plan();
  result_.seconds.prepare = watch.seconds();
  remesh_walls();
  share_out();
  result_.mesh.vertices = remeshed_.vertices;
  result_.boundary_vertices = remeshed_.vertices.size();
  result_.delaunay = true;
  for (Index part = 0; part < parts_.size(); ++part) fill(part);
  mark_walls();
  result_.seconds.total = watch.seconds();
  return std::move(result_);
}

}  // namespace

TetResult mesh_regions(const TetMesh& mesh, const Walls& walls, const TetOptions& options, const Context& context) {
  return RegionMesher(mesh, walls, options, context).run();
}

}  // namespace bisector
