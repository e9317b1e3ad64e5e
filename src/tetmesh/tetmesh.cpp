#include "tetmesh/tetmesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "compute/compute.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "cvt/constrain.h"
#include "cvt/optimise.h"
#include "mesh/tet_topology.h"
#include "remesh/prepare.h"
#include "spatial/hilbert.h"
#include "spatial/nearest.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/locate.h"
#include "tetmesh/sample_solid.h"
#include "tetmesh/tet_levels.h"
#include "tetmesh/tetgen.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = SeedPlace::Kind;

// Of the steps allowed: sites free, on one level or the coarser ones, and on the finest of several, which starts near its minimum;
// then held on the boundary together with the others; then inside the finished boundary.
constexpr double kFreeShare = 0.35, kFinestShare = 0.2, kJointShare = 0.2, kInnerShare = 0.15;
// Of the surface's own optimisation: to spread the sites along features, and before the boundary is extracted.
constexpr int kLayoutSteps = 10, kBoundarySteps = 30;
constexpr int kJointRounds = 3;
constexpr double kGoalBeyond = 5;    // degrees: aiming a little higher raises the mean as well
constexpr double kOptimising = 0.8;  // of the whole run, about
// Cells that meet the boundary, over the sites that its edge lengths ask for, from which on the solid counts as thin.
constexpr double kThin = 1.25;
constexpr double kEnough = 0.97;     // of the sites asked for
constexpr int kPushRounds = 8;
// Heights over the boundary, in lengths of its edges, of sites inside that own none of it: a third layer's distance is 0.8.
constexpr double kClear = 0.75;
constexpr std::size_t kFewest = 8;
constexpr std::size_t kManyTets = 8;  // for each site, beyond which a stand-in pays
constexpr int kStandInSteps = 20;     // of its surface's optimisation, per level

// Vertices of an equilateral triangulation of the surface with the edge lengths aimed at.
double boundary_vertices(const Surface& surface, const SizedSolid& sized) {
  const TriangleMesh& mesh = surface.mesh;
  double count = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    double per_area = 0;
    for (const Index v : t) {
      const double h = sized.lengths.empty() ? sized.edge_length : sized.lengths[v];
      per_area += 2 / (3 * std::sqrt(3.0) * h * h);
    }
    count += 0.5 * norm(cross(b - a, c - a)) * per_area;
  }
  return count;
}

// So many of the points, evenly along their spatial order.
std::vector<Vec3> thinned(const std::vector<Vec3>& points, std::size_t count) {
  const std::vector<Index> order = hilbert_order(points);
  std::vector<Vec3> kept;
  for (std::size_t k = 0; k < count; ++k) kept.push_back(points[order[k * points.size() / count]]);
  return kept;
}

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

int share_of(int iterations, double share) { return static_cast<int>(std::ceil(iterations * share)); }

void check_options(const TetOptions& options) {
  if (!options.seeds.empty()) {
    if (options.seeds.size() < kFewest) throw Error(fmt::format("a tetrahedral mesh needs at least {} seeds; give more", kFewest));
    return;
  }
  if ((options.vertices > 0) == (options.edge_length > 0))
    throw Error("ask for a number of vertices or for an edge length, and not for both");
  if (options.edge_length == 0 && options.vertices < kFewest)
    throw Error(fmt::format("a tetrahedral mesh needs at least {} vertices; ask for more", kFewest));
}

// A solid and what computes its diagrams.
struct Domain {
  Domain(TetMesh mesh, std::vector<double> density, const ComputeOptions& compute, const Context& context)
      : solid(std::move(mesh), std::move(density)), backend(make_backend(solid, compute, context)) {}

  Solid solid;
  std::unique_ptr<SolidBackend> backend;
};

// Stand-ins with fewer tetrahedra for while sites are free, when neither the boundary's details nor a density between the sites
// matter yet.
class StandIns {
 public:
  StandIns(const TetMesh& mesh, const TriangleMesh& surface, Backend& boundary, const FeatureGraph& features,
           const TetOptions& options, const Context& context)
      : mesh_(mesh), surface_(surface), boundary_(boundary), features_(features), options_(options), context_(context) {}

  // For `count` of `final_count` sites; null if the solid itself will do.
  SolidBackend* choose(std::size_t count, std::size_t final_count, const SolidBackend& whole);

 private:
  void make_coarse(std::size_t vertices);

  const TetMesh& mesh_;
  const TriangleMesh& surface_;
  Backend& boundary_;
  const FeatureGraph& features_;
  const TetOptions& options_;
  const Context& context_;
  std::unique_ptr<Domain> domain_;
  bool tried_ = false;
};

SolidBackend* StandIns::choose(std::size_t count, std::size_t final_count, const SolidBackend& whole) {
  if (!whole.solid().density.empty()) {
    if (count == final_count) return nullptr;
    SizingTarget target;
    target.vertices = count;
    SizedSolid sized = refine_for_sizes(mesh_, surface_, options_.sizing, target);
    std::vector<double> density = sized.volume_density();
    domain_ = std::make_unique<Domain>(std::move(sized.mesh), std::move(density), options_.compute, context_);
    return domain_->backend.get();
  }
  if (whole.solid().mesh.tets.size() < kManyTets * final_count) return nullptr;
  if (!std::exchange(tried_, true)) {
    // Twice as many vertices as the result will have on its boundary, which has edges of the same length.
    const double h = std::cbrt(whole.solid().volume / static_cast<double>(final_count));
    make_coarse(static_cast<std::size_t>(2 * boundary_.surface().area / (h * h)));
  }
  return domain_ ? domain_->backend.get() : nullptr;
}

// Of a remeshed boundary. Where that does not bound a solid, or there is no TetGen, there is no stand-in.
void StandIns::make_coarse(std::size_t vertices) {
  if (find_tetgen().empty() || 4 * vertices > surface_.triangles.size()) return;
  RemeshOptions remeshing;
  remeshing.vertices = std::max<std::size_t>(vertices, 100);
  remeshing.iterations = kStandInSteps;
  remeshing.topology = TopologyControl::check;
  remeshing.min_angle = 0;
  Context quiet = context_;
  quiet.progress = nullptr;
  quiet.warning = nullptr;
  const RemeshResult coarse = remesh(boundary_, features_, remeshing, quiet);
  try {
    domain_ = std::make_unique<Domain>(tetgen_tets(check_surface(coarse.mesh), {}, quiet).mesh, std::vector<double>{},
                                       options_.compute, context_);
  } catch (const DeviceError&) {
    throw;
  } catch (const Error&) {
    domain_.reset();
  }
}

// Sites in a solid, first free, then with the boundary's on it; in the end the tetrahedra between them.
class Pipeline {
 public:
  Pipeline(SolidBackend& backend, Backend& boundary, StandIns& stand_ins, const FeatureGraph& features, const SizedSolid& sized,
           const TetOptions& options, const Context& context)
      : backend_(backend), boundary_(boundary), stand_ins_(stand_ins), features_(features), sized_(sized), options_(options),
        context_(context),
        curves_(features, backend.solid().mesh.vertices) {
    step_.tolerance = options.tolerance;
    step_.curves = &curves_;
  }

  TetResult run();

 private:
  void free_phase();
  void joint_phase();
  void finish_boundary();
  void inner_phase();
  void extract();

  RemeshResult remesh_boundary(std::vector<Vec3> seeds, std::vector<SeedPlace> places, bool final_pass);
  void set_boundary(const RemeshResult& surface, std::vector<Vec3> interior);
  bool promote();
  std::vector<Vec3> interior_seeds() const;
  std::vector<Index> pokers() const;
  void push_inside();
  void remove(const std::vector<char>& removed);
  void match_count();
  void run_steps(SolidBackend& backend, const std::string& phase, double share, bool constrained);

  SolidBackend& backend_;
  Backend& boundary_;
  StandIns& stand_ins_;
  const FeatureGraph& features_;
  const SizedSolid& sized_;
  const TetOptions& options_;
  const Context& context_;
  const FeatureCurves curves_;
  OptimiseOptions step_;
  CvtState state_;
  OptimiseTotals totals_;
  RemeshResult surface_;
  TetResult result_;
  bool thin_ = false;   // the solid, beside the cells
  double surplus_ = 0;  // sites that the boundary takes beyond those that its edge lengths ask for
};

void Pipeline::run_steps(SolidBackend& backend, const std::string& phase, double share, bool constrained) {
  step_.phase = phase;
  step_.constrained = constrained;
  step_.iterations = share_of(options_.iterations, share);
  step_.share = kOptimising * share * std::min(1.0, static_cast<double>(state_.seeds.size()) / static_cast<double>(result_.wanted));
  optimise(backend, state_, step_, totals_, context_);
  step_.done += step_.share;
}

// Thesis 5.5.2: the sites find a well-spaced distribution without any constraint, here from coarse to fine.
void Pipeline::free_phase() {
  const std::vector<std::size_t> counts =
      options_.seeds.empty() ? tet_level_counts(sized_.vertices) : std::vector<std::size_t>{options_.seeds.size()};
  state_.seeds = options_.seeds;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    SolidBackend* const stand_in = stand_ins_.choose(counts[level], counts.back(), backend_);
    SolidBackend& backend = stand_in ? *stand_in : backend_;
    if (level > 0) {
      RestrictedPolygons polygons;
      ClippedPolyhedra polyhedra;
      backend.evaluate(state_.seeds, state_.moments, polygons, polyhedra);
      state_.seeds = refine_sites(polyhedra, state_.moments, state_.seeds, counts[level]);
    }
    if (state_.seeds.size() < counts[level]) {  // at first, and where the solid is thin: its cells have few neighbours
      std::vector<double> weight = backend.solid().density;
      for (double& rho : weight) rho = std::pow(rho, 0.6);
      const std::vector<Vec3> more = sample_solid(backend.solid().mesh, counts[level] - state_.seeds.size(),
                                                  options_.random_seed + level, weight);
      state_.seeds.insert(state_.seeds.end(), more.begin(), more.end());
    }
    state_.places.assign(state_.seeds.size(), {Kind::interior});
    const bool finest = level > 0 && level + 1 == counts.size();
    run_steps(backend, counts.size() > 1 ? fmt::format("free, level {}/{}", level + 1, counts.size()) : "free",
              finest ? kFinestShare : kFreeShare, false);
  }
}

RemeshResult Pipeline::remesh_boundary(std::vector<Vec3> seeds, std::vector<SeedPlace> places, bool final_pass) {
  const auto begin = Clock::now();
  RemeshOptions options;
  options.seeds = std::move(seeds);
  options.places = std::move(places);
  options.iterations = final_pass ? kBoundarySteps : kLayoutSteps;
  options.tolerance = options_.tolerance;
  options.topology = final_pass ? TopologyControl::enforce : TopologyControl::off;
  options.min_angle = final_pass ? options_.min_angle : 0;
  Context quiet = context_;
  quiet.progress = nullptr;
  RemeshResult result = remesh(boundary_, features_, options, quiet);
  result_.seconds.boundary += seconds_since(begin);
  return result;
}

std::vector<Vec3> Pipeline::interior_seeds() const {
  std::vector<Vec3> interior;
  for (std::size_t i = 0; i < state_.seeds.size(); ++i)
    if (state_.places[i].kind == Kind::interior) interior.push_back(state_.seeds[i]);
  return interior;
}

// The boundary's vertices, then the sites inside.
void Pipeline::set_boundary(const RemeshResult& surface, std::vector<Vec3> interior) {
  state_.seeds = surface.mesh.vertices;
  state_.places = surface.places;
  state_.seeds.insert(state_.seeds.end(), interior.begin(), interior.end());
  state_.places.resize(state_.seeds.size(), {Kind::interior});
}

// Sites inside whose cells have come to the boundary go there, as long as there is room, or where the solid is thin and there is no
// other place for them. True if there are any.
bool Pipeline::promote() {
  const auto held = std::count_if(state_.places.begin(), state_.places.end(),
                                  [](const SeedPlace& place) { return place.kind != Kind::interior; });
  double room = boundary_vertices(backend_.surface(), sized_) + surplus_ - static_cast<double>(held);
  bool any = false;
  for (const Index i : pokers()) {
    if (room-- < 1 && !thin_) break;
    state_.places[i] = {};
    any = true;
  }
  return any;
}

std::vector<Index> Pipeline::pokers() const {
  std::vector<Index> found;
  for (Index i = 0; i < state_.seeds.size(); ++i)
    if (state_.places[i].kind == Kind::interior && state_.moments.triangles.size(i) > 0) found.push_back(i);
  return found;
}

// Thesis 5.5.2: the sites whose cells meet the boundary are put there and held, and all are optimised together.
void Pipeline::joint_phase() {
  backend_.evaluate(state_.seeds, state_.moments);
  std::vector<Vec3> on_boundary, interior, normals;
  std::vector<Vec3> feet = state_.seeds;
  project_to_cells(backend_.surface(), state_.moments.triangles, {}, feet, normals);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const bool inner = state_.moments.triangles.size(i) == 0;
    (inner ? interior : on_boundary).push_back(inner ? state_.seeds[i] : feet[i]);
  }
  result_.boundary_sites = on_boundary.size();
  // Of a free CVT 0.9 to 1.2 times as many meet the boundary as its edge lengths ask for, and all where the solid is two cells
  // thick; with no more than that, tetrahedra inside and on the boundary are alike, and something is left inside.
  const double room = boundary_vertices(backend_.surface(), sized_) + surplus_, met = static_cast<double>(on_boundary.size());
  thin_ = thin_ || met > kThin * room;
  if (options_.seeds.empty() && met > room)
    on_boundary = thinned(on_boundary, std::max(kFewest, static_cast<std::size_t>(std::llround(room))));
  set_boundary(remesh_boundary(std::move(on_boundary), {}, false), std::move(interior));
  for (int round = 0; round < kJointRounds; ++round) {
    run_steps(backend_, "with the boundary", kJointShare / kJointRounds, true);
    if (round + 1 < kJointRounds && !promote() && round > 0) break;
  }
}

void Pipeline::finish_boundary() {
  std::vector<Vec3> seeds;
  std::vector<SeedPlace> places;
  for (std::size_t i = 0; i < state_.seeds.size(); ++i) {
    if (state_.places[i].kind == Kind::interior) continue;
    seeds.push_back(state_.seeds[i]);
    places.push_back(state_.places[i]);
  }
  std::vector<Vec3> interior = interior_seeds();
  surface_ = remesh_boundary(std::move(seeds), std::move(places), true);
  std::size_t crossings = count_self_intersections(surface_.mesh);
  // Where sheets meet at a small angle, another pass may mend what one leaves, with more vertices.
  if (crossings > 0 || !surface_.topology.closed || !surface_.topology.manifold) {
    surface_ = remesh_boundary(surface_.mesh.vertices, surface_.places, true);
    crossings = count_self_intersections(surface_.mesh);
  }
  if (crossings > 0)
    throw Error(fmt::format("the boundary of the result crosses itself at {} pairs of triangles: parts are thinner than its edges; "
                            "ask for more vertices", crossings));
  if (!surface_.topology.closed || !surface_.topology.manifold)
    throw Error("the boundary of the result is not a closed manifold: parts are thinner than its edges; ask for more vertices");
  set_boundary(surface_, std::move(interior));
  for (std::size_t i = 0; i < surface_.mesh.vertices.size(); ++i) state_.places[i].kind = Kind::fixed;
}

void Pipeline::remove(const std::vector<char>& removed) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < state_.seeds.size(); ++i) {
    if (removed[i]) continue;
    state_.seeds[n] = state_.seeds[i];
    state_.places[n++] = state_.places[i];
  }
  state_.seeds.resize(n);
  state_.places.resize(n);
}

// Removes the most crowded sites inside, or adds some where cells are large, to meet the count.
void Pipeline::match_count() {
  const std::size_t boundary = surface_.mesh.vertices.size(), wanted = result_.wanted;
  std::size_t surplus = state_.seeds.size() > wanted ? state_.seeds.size() - wanted : 0;
  if (surplus > 0) {
    backend_.evaluate(state_.seeds, state_.moments);
    // Crowded cells are those of least energy.
    std::vector<Index> order;
    for (auto i = static_cast<Index>(boundary); i < state_.seeds.size(); ++i) order.push_back(i);
    surplus = std::min(surplus, order.size());
    std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
      return state_.moments.cells[a].second < state_.moments.cells[b].second;
    });
    std::vector<char> removed(state_.seeds.size(), 0);
    for (std::size_t k = 0; k < surplus; ++k) removed[order[k]] = 1;
    remove(removed);
  } else if (state_.seeds.size() < wanted) {
    RestrictedPolygons polygons;
    ClippedPolyhedra polyhedra;
    backend_.evaluate(state_.seeds, state_.moments, polygons, polyhedra);
    for (const Vec3& p : far_corners(polyhedra, state_.moments, state_.seeds, wanted - state_.seeds.size())) {
      state_.seeds.push_back(p);
      state_.places.push_back({Kind::interior});
    }
  }
}

// The dual contains the boundary only if no cell of a site inside meets it: such sites are pushed away from it, and those that
// nothing helps are removed.
void Pipeline::push_inside() {
  const Surface& surface = backend_.surface();
  for (int round = 0;; ++round) {
    backend_.evaluate(state_.seeds, state_.moments);
    const std::vector<Index> near = pokers();
    if (near.empty()) return;
    if (round == kPushRounds) {
      std::vector<char> removed(state_.seeds.size(), 0);
      for (Index i : near) removed[i] = 1;
      remove(removed);
      backend_.evaluate(state_.seeds, state_.moments);
      return;
    }
    std::vector<Vec3> feet = state_.seeds, normals;
    project_to_cells(surface, state_.moments.triangles, {}, feet, normals);
    for (const Index i : near) {
      const Moments& cell = state_.moments.cells[i];
      // The cell's radius stands for the edge length there.
      const double edge = cell.mass > 0 ? 2 * std::sqrt(cell.second / cell.mass) : sized_.edge_length;
      const double height = dot(feet[i] - state_.seeds[i], normals[i]);
      state_.seeds[i] -= std::max(0.1 * edge, kClear * edge - height) * normals[i];
    }
  }
}

void Pipeline::inner_phase() {
  match_count();
  run_steps(backend_, "inside", kInnerShare, false);
  push_inside();
  complete(backend_, state_, step_, totals_);
}

void Pipeline::extract() {
  auto begin = Clock::now();
  const std::size_t count = surface_.mesh.vertices.size();
  const std::vector<Vec3> interior(state_.seeds.begin() + static_cast<std::ptrdiff_t>(count), state_.seeds.end());
  context_.report({"extracting", 0, 1, state_.energy, state_.gradient_norm, 0.82});
  ConformingTets tets = conforming_tets(surface_.mesh, interior, {}, context_);
  result_.mesh = std::move(tets.mesh);
  result_.delaunay = tets.delaunay;
  result_.steiner_points = tets.steiner_points;
  result_.refused_sites = tets.refused.size();
  result_.boundary_vertices = count;
  result_.seconds.extract = seconds_since(begin);
  begin = Clock::now();
  if (options_.min_dihedral > 0) {
    TetImproveOptions improve;
    improve.insert_below = options_.min_dihedral;
    improve.goal = options_.min_dihedral + kGoalBeyond;
    context_.report({"improving", 0, 1, state_.energy, state_.gradient_norm, 0.85});
    TetImproveResult improved = improve_tets(result_.mesh, improve, context_);
    result_.mesh = std::move(improved.mesh);
    result_.improved = std::move(improved.report);
  }
  result_.seconds.improve = seconds_since(begin);
}

TetResult Pipeline::run() {
  const auto begin = Clock::now();
  result_.wanted = options_.seeds.empty() ? sized_.vertices : options_.seeds.size();
  result_.edge_length = sized_.edge_length;
  result_.volume = backend_.solid().volume;
  const TriangleMesh& surface = backend_.surface().mesh;
  result_.input_topology = analyse_topology(surface.triangles, surface.vertices.size());
  free_phase();
  const std::vector<Vec3> free = state_.seeds;
  joint_phase();
  finish_boundary();
  inner_phase();
  if (static_cast<double>(state_.seeds.size()) < kEnough * static_cast<double>(result_.wanted) && !thin_) {
    // There is no room inside for what the boundary did not take.
    thin_ = true;
    surplus_ = static_cast<double>(result_.wanted) - static_cast<double>(state_.seeds.size());
    state_.seeds = free;
    state_.places.assign(free.size(), {Kind::interior});
    step_.done -= kOptimising * (kJointShare + kInnerShare);
    joint_phase();
    finish_boundary();
    inner_phase();
  }
  extract();
  result_.boundary = std::move(surface_);
  result_.boundary.mesh = {};
  RestrictedPolygons polygons;
  ClippedPolyhedra polyhedra;
  CellMoments moments;
  backend_.evaluate(state_.seeds, moments, polygons, polyhedra);
  result_.untiled = count_untiled(backend_.solid(), polyhedra) + count_untiled(backend_.surface(), polygons);
  result_.iterations = totals_.iterations;
  result_.evaluations = totals_.evaluations;
  result_.energy = state_.energy;
  result_.gradient_norm = state_.gradient_norm;
  result_.certification = state_.moments.certification;
  result_.device = backend_.description();
  result_.seconds.total = seconds_since(begin);
  result_.seconds.lbfgs = totals_.seconds_lbfgs;
  result_.seconds.diagrams = totals_.seconds;
  return std::move(result_);
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
    const auto mark = std::lower_bound(marks.begin(), marks.end(), std::pair{t, std::numeric_limits<std::int32_t>::min()});
    surface.labels.push_back(mark != marks.end() && mark->first == t ? mark->second : 0);
  }
  return surface;
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
    throw Error(fmt::format("the density has {} values for {} vertices; give one per vertex", field.attribute.size(), vertices));
}

TetResult mesh_solid(TetMesh mesh, const TetOptions& options, const Context& context) {
  const auto begin = Clock::now();
  TriangleMesh surface = boundary_of(mesh);
  keep_boundary_edges(surface);
  const FeatureGraph graph = detect_features(surface, options.features);
  const SizingTarget target = options.seeds.empty() ? SizingTarget{options.vertices, options.edge_length}
                                                    : SizingTarget{options.seeds.size(), 0};
  SizedSolid sized = refine_for_sizes(mesh, surface, options.sizing, target);
  if (sized.vertices < kFewest)
    throw Error(fmt::format("edges of {:.6g} make {} vertices, fewer than {}; ask for shorter ones", options.edge_length,
                            sized.vertices, kFewest));
  const FeatureGraph features = split_features(graph, sized.splits);
  const Solid solid(sized.mesh, sized.volume_density());
  TriangleMesh outside = boundary_of(sized.mesh);
  const Surface boundary(std::move(outside), sized.surface_density());
  const double preparing = seconds_since(begin);
  const std::unique_ptr<SolidBackend> backend = make_backend(solid, options.compute, context);
  const std::unique_ptr<Backend> boundary_backend = make_backend(boundary, options.compute, context);
  StandIns stand_ins(mesh, surface, *boundary_backend, features, options, context);
  TetResult result = Pipeline(*backend, *boundary_backend, stand_ins, features, sized, options, context).run();
  set_regions(sized.mesh, result.mesh);
  result.background_tets = sized.mesh.tets.size();
  result.seconds.prepare = preparing;
  result.seconds.total = seconds_since(begin);
  return result;
}

}  // namespace

TetResult tetrahedralise(const TriangleMesh& input, const TetOptions& options, const Context& context) {
  const auto begin = Clock::now();
  check_options(options);
  check_attribute(options, input.vertices.size());
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  const WeldResult welded = join_borders(input, options.weld);
  const TriangleMesh surface = check_surface(welded.mesh);
  TetOptions moved = options;
  std::vector<double>& attribute = moved.sizing.field.attribute;
  if (!attribute.empty()) {
    std::vector<double> values(welded.mesh.vertices.size());
    for (std::size_t v = input.vertices.size(); v-- > 0;) values[welded.vertex_of[v]] = attribute[v];
    attribute = std::move(values);
  }
  for (auto& edge : moved.features.given)
    for (Index& v : edge) {
      if (v >= welded.vertex_of.size()) throw Error(fmt::format("feature edge of vertex {}: the mesh has none; correct it", v));
      v = welded.vertex_of[v];
    }
  std::erase_if(moved.features.given, [](const std::array<Index, 2>& e) { return e[0] == e[1]; });
  context.report({"background tetrahedra", 0, 1, 0, 0, 0});
  TetMesh background = tetgen_tets(surface, {}, context).mesh;
  const double seconds = seconds_since(begin);
  TetResult result = mesh_solid(std::move(background), moved, context);
  result.seconds.background = seconds;
  result.seconds.total = seconds_since(begin);
  return result;
}

TetResult tetrahedralise(const TetMesh& solid, const TetOptions& options, const Context& context) {
  check_options(options);
  check_attribute(options, solid.vertices.size());
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  check_boundary(solid);
  return mesh_solid(solid, options, context);
}

}  // namespace bisector
