#include "remesh/remesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include "bisector/distance_bound.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "compute/compute.h"
#include "core/magnitude.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "cvt/multilevel.h"
#include "cvt/optimise.h"
#include "cvt/optimise_around.h"
#include "mesh/topology.h"
#include "remesh/around_kept.h"
#include "remesh/coarse_surface.h"
#include "remesh/cut_sheets.h"
#include "remesh/deviation.h"
#include "remesh/feature_recovery.h"
#include "remesh/fit.h"
#include "remesh/flip_crossings.h"
#include "remesh/improve.h"
#include "remesh/mend.h"
#include "remesh/mend_input.h"
#include "remesh/prepare.h"
#include "remesh/push_apart.h"
#include "remesh/sheets.h"
#include "remesh/slivers.h"
#include "remesh/topology_control.h"
#include "voronoi/dual.h"
#include "voronoi/polygons.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

// Of the steps allowed per level: the coarsest of several levels settles soon, the finest starts near its minimum, and
// seeds that are put on the surface move little.
constexpr double kCoarsestShare = 0.6, kFinestShare = 0.5, kConstrainedShare = 0.05;
// Where more than one cell in so many has stray parts, diagrams are localised for so much of the finest level's steps.
// Where fewer have any, so much of the steps is added with them.
constexpr std::size_t kManyStrays = 20;
constexpr double kLocalisedShare = 0.5, kAddedShare = 0.2;
// Triangles for each seed, from which on a stand-in with fewer may pay.
constexpr std::size_t kManyFacets = 6;
constexpr int kMendingRounds = 3;  // of features and topology
// Edges along features and borders at most: so many, or so many times the vertices asked for.
constexpr double kMostOnFeatures = 1e6, kMostOnFeaturesPerVertex = 1000;
// A run starts again with edges shorter by this where cells are no disks, or along broken curves; not if more than one
// cell, or curve, in so many is such.
constexpr double kShorter = 0.6;
constexpr std::size_t kTooManyFailures = 4;
// Of triangles, more than one sliver in so many are too high a price for components that do not cross; with no more
// than one in so many another run in which they share intersections may have none.
constexpr std::size_t kFewSlivers = 50, kVeryFewSlivers = 500;
// Of the seeds wanted, by how many those of an earlier run may be off. Where topology took many more, it has to be
// found anew for other edge lengths.
constexpr double kMostOff = 0.01;
// Of a result, while that makes it much better, and while all took no more than so many times the work of placing
// seeds; less where the input is no manifold, whose curves and sheets cannot all be had. Where components share
// intersections there may have to be runs in which they do not.
constexpr int kRefinements = 3, kSharedRefinements = 1;
constexpr double kMostWork = 5, kMostWorkForSheets = 3;
// Runs for a distance to the input, how many times the vertices they may take, and the gap between bounds of it.
constexpr int kNearings = 8;
constexpr std::size_t kMostTimes = 10;
constexpr double kBoundsGap = 0.02;
// Of the distance, what edges aim at; less from run to run, for the farthest of many triangles is far from their mean.
constexpr double kFirstAim = 0.6, kNextAim = 0.9;
constexpr int kFreedSteps = 20;
constexpr double kFitQuality = 0.7;  // what fitting may bring better triangles down to
constexpr double kMaxAngle = 91;     // degrees; goal of the final pass

double steps_share(std::size_t level, std::size_t levels) {
  if (levels == 1) return 1;
  return level + 1 == levels ? kFinestShare : level == 0 ? kCoarsestShare : 1;
}

int share_of(int iterations, double share) { return static_cast<int>(std::ceil(iterations * share)); }

// Whether cells are to be disks. Those of free seeds and of rough surfaces seldom are, and the dual's topology
// suffices.
bool asks_for_disks(const RemeshPlan& plan) { return plan.constrained && !plan.noisy; }

bool asks_for_quality(const RemeshPlan& plan) { return plan.min_angle > 0 && plan.constrained; }

void check_plan(const RemeshPlan& plan) {
  if (!plan.places.empty() && plan.places.size() != plan.seeds.size())
    throw Error(
        fmt::format("there are {} places for {} seeds; give one for each", plan.places.size(), plan.seeds.size()));
  if (!plan.seeds.empty() && plan.seeds.size() < 4) throw Error("a remeshed surface needs at least 4 seeds; give more");
  if (plan.seeds.empty() && plan.vertices < 4)
    throw Error("a remeshed surface needs at least 4 vertices; ask for more");
}

void check_options(const RemeshOptions& options) {
  if (options.seeds.empty() && (options.vertices > 0) == (options.edge_length > 0))
    throw Error("ask for a number of vertices or for an edge length, and not for both");
  if (options.edge_length == 0 || !options.seeds.empty()) check_plan(plan_of(options));
  if (!(options.distance_max >= 0 && std::isfinite(options.distance_max)))
    throw Error(fmt::format("the largest distance {:g} is none; give a positive length", options.distance_max));
  if (options.distance_max > 0 && !options.seeds.empty())
    throw Error("a largest distance takes other seeds than those given; leave one of the two out");
}

// What runs took.
struct Spent {
  RunTotals totals;
  RemeshSeconds seconds;
};

// Seeds level by level, coarse to fine, those on features moving along them from the first; then what makes a good mesh
// of their dual.
class Pipeline {
 public:
  Pipeline(Backend& backend, const FeatureGraph& features, const RemeshPlan& plan, const Context& context,
           const MakeBackend& make_backend)
      : backend_(backend), make_backend_(make_backend), surface_(backend.surface()), plan_(plan),
        curves_(features, surface_.mesh.vertices), measure_(surface_, curves_), trace_(surface_, curves_),
        wanted_(plan.seeds.empty() ? plan.vertices : plan.seeds.size()),
        input_topology_(analyse_topology(surface_.mesh.triangles, surface_.mesh.vertices.size())),
        localises_(plan.topology != TopologyControl::off && (plan.seeds.empty() || !plan.places.empty())),
        run_(backend, curves_, context) {
    step_.tolerance = plan.tolerance;
    step_.share = 0;
    result_.wanted = wanted_;
    result_.input_topology = input_topology_;
  }

  // Places seeds and optimises them.
  void check_length_of_features() const;
  void place();
  // The same for seeds that a run for another density on the same surface has placed: on the finest level alone.
  void place_again(const PlacedSeeds& earlier);
  // The same for seeds that such a run has finished with: only where there is need of more seeds are they placed and
  // optimised. False, and nothing is placed, if that is nowhere, or if they are not about as many as they should be.
  bool place_around(const PlacedSeeds& earlier);
  const PlacedSeeds& seeds() const { return run_.seeds; }
  // Where cells are still no disks then, and how long edges should be there. Empty if topology is not enforced, or if
  // so many cells fail that the seeds are too few.
  SizeBounds crowded();
  // After finish(), the curves that are no chains of edges, and how long edges should be along them.
  SizeBounds broken_curves() const;
  Spent spent() const { return {run_.totals, result_.seconds}; }
  // Counts what earlier runs took.
  void count(const Spent& before) {
    run_.totals = before.totals;
    result_.seconds = before.seconds;
  }
  // Mends and improves what place() left.
  RemeshResult finish();

 private:
  // The final diagram, with the cells of several sheets divided as topology control found it necessary.
  struct Divided {
    std::optional<RestrictedPolygons> polygons;  // if any cell was divided
    std::vector<Vec3> vertices;                  // the seeds, then the sheets of divided cells
    BallReport ball;
  };

  double cost(std::size_t seeds) const { return static_cast<double>(surface_.facets.size() + 3 * seeds); }
  std::vector<std::size_t> choose_levels() const;
  void place_on_features(std::size_t count);
  void place_on_short_curves();
  void to_next_level(std::size_t count);
  void make_stand_ins(const std::vector<std::size_t>& counts);
  void open_stand_in(std::size_t level);
  void begin_on_stand_in();
  void return_to_input() { run_.change_backend(backend_); }
  void optimise_levels(const std::vector<std::size_t>& counts);
  bool is_held(const SeedPlace& place) const {
    return place.corner != kNone && !plan_.held.empty() && plan_.held[place.corner];
  }
  bool can_localise() const;
  bool dual_suffices();
  bool free_tips();
  std::vector<Vec3> all_vertices() const;
  void mend_features_and_topology();
  void mend_features();
  Divided divide_sheets();
  void improve_quality();
  void extract();
  void analyse_result();
  void extract_features(const std::vector<Index>& vertex_of);
  double mend(const Diagram& diagram, std::vector<Index>& vertex_of);
  void report_features();
  void fit();

  Backend& backend_;
  const MakeBackend& make_backend_;
  std::vector<CoarseSurface> stand_ins_;  // for the input's surface, by level
  std::unique_ptr<Backend> stand_in_;     // what computes the diagrams of that for the level, if there is one
  const Surface& surface_;
  const RemeshPlan& plan_;
  const FeatureCurves curves_;
  const CurveMeasure measure_;
  const FeatureTrace trace_;
  const std::size_t wanted_;
  const MeshTopology input_topology_;
  // Not where seeds were given without places: they are the start of as many as the surface needs.
  const bool localises_;
  bool placed_around_ = false;  // where there was need of more seeds; the others are those of a finished result
  CvtRun run_;
  OptimiseOptions step_;
  FeatureReport features_;
  TopologyOutcome topology_;
  RemeshResult result_;
};

// The coarsest level must have seeds left beside its features.
std::vector<std::size_t> Pipeline::choose_levels() const {
  if (!plan_.seeds.empty()) return {wanted_};
  std::vector<std::size_t> counts =
      level_counts(wanted_, input_topology_.euler, input_topology_.components, plan_.levels);
  const auto crowded = [&](std::size_t count) {
    return 2 * seeds_on_features(curves_, measure_, measure_.scale(count)).size() > count;
  };
  while (run_.has_features() && counts.size() > 1 && crowded(counts.front())) counts.erase(counts.begin());
  return counts;
}

// Seeds on features take the place of others nearby.
void Pipeline::place_on_features(std::size_t count) {
  if (!run_.has_features()) return;
  PlacedSeeds placed = seeds_on_features(curves_, measure_, measure_.scale(count));
  placed.add(run_.seeds);
  run_.seeds = std::move(placed);
  meet_count(run_, count);
}

void Pipeline::to_next_level(std::size_t count) {
  PlacedSeeds on_features;
  if (run_.has_features())
    on_features = seeds_on_features(curves_, measure_, measure_.scale(count), run_.seeds.places());
  run_.seeds = refine(run_.take_diagram(Want::polygons).diagram, run_.seeds, curves_, on_features, count);
  meet_count(run_, count);
}

// Each is made of that for the next finer level, the finest of the input.
void Pipeline::make_stand_ins(const std::vector<std::size_t>& counts) {
  stand_ins_.clear();
  stand_ins_.resize(counts.size());
  if (!make_backend_) return;
  const CoarseSurface* finer = nullptr;
  for (std::size_t level = counts.size(); level-- > 0;) {
    if (surface_.facets.size() < kManyFacets * counts[level]) continue;
    CoarseSurface& coarse = stand_ins_[level];
    coarse = coarse_surface(finer ? *finer->surface : surface_, finer ? finer->features : curves_.graph(),
                            measure_.scale(counts[level]));
    if (coarse.surface) finer = &coarse;
  }
}

void Pipeline::open_stand_in(std::size_t level) {
  if (stand_ins_[level].surface) stand_in_ = make_backend_(*stand_ins_[level].surface);
}

void Pipeline::begin_on_stand_in() {
  if (stand_in_) run_.change_backend(*stand_in_);
}

// With seeds for the first of these levels.
void Pipeline::optimise_levels(const std::vector<std::size_t>& counts) {
  make_stand_ins(counts);
  // Shares of the work: an evaluation costs about as much as its facets and three times its seeds.
  double total = plan_.constrained ? kConstrainedShare * cost(counts.back()) : 0;
  for (std::size_t level = 0; level < counts.size(); ++level)
    total += steps_share(level, counts.size()) * cost(counts[level]);
  for (std::size_t level = 0; level < counts.size(); ++level) {
    step_.phase = counts.size() > 1 ? fmt::format("level {}/{}", level + 1, counts.size()) : "optimising";
    const double share = steps_share(level, counts.size());
    step_.done += std::exchange(step_.share, share * cost(counts[level]) / total);
    const int steps = share_of(plan_.iterations, share);
    const bool finest = level + 1 == counts.size();
    const bool may_localise = finest && can_localise();
    const bool many = may_localise && run_.strays() > counts[level] / kManyStrays;
    open_stand_in(level);
    step_.iterations = many ? steps - share_of(steps, kLocalisedShare) : steps;
    optimise_with_stand_in(run_, stand_in_.get(), step_, finest && !many ? kOnSurfaceShare : 0);
    if (may_localise) run_.localise(true);
    if (may_localise && run_.strays() == 0) run_.localise(false);
    if (many || run_.localises()) {
      // What is around both sides of a bent wall is nearer to the inner one, so too many seeds are there.
      begin_on_stand_in();
      follow_density(run_);
      return_to_input();
      step_.iterations = many ? share_of(steps, kLocalisedShare) : share_of(plan_.iterations, kAddedShare);
      optimise_with_stand_in(run_, stand_in_.get(), step_);
    }
    if (run_.has_features()) clear_features(run_, trace_, measure_, step_, stand_in_.get());
    if (finest) break;
    begin_on_stand_in();
    to_next_level(counts[level + 1]);
    return_to_input();
    stand_in_.reset();
    stand_ins_[level] = {};
  }
  if (plan_.constrained) {
    step_.constrained = true;
    step_.phase = "on the surface";
    step_.iterations = share_of(plan_.iterations, kConstrainedShare);
    step_.done += std::exchange(step_.share, kConstrainedShare * cost(counts.back()) / total);
    optimise(run_, step_);
  }
  step_.done = 1;
  step_.share = 0;
}

// Whether diagrams may be localised while seeds move far. Where sheets touch or are joined to more than one, the seeds
// of each have to keep away from the curves of the others.
bool Pipeline::can_localise() const { return localises_ && plan_.constrained && input_topology_.manifold; }

// Folds of a rough surface give cells pieces that leave no trace in the dual.
bool Pipeline::dual_suffices() {
  if (asks_for_disks(plan_)) return false;
  std::vector<Triangle> dual = run_.diagram(Want::dual).dual.triangles;
  orient(dual, run_.seeds.size());
  return same_topology(analyse_topology(dual, run_.seeds.size()), input_topology_);
}

// Seeds at tips where topology fails are no longer held there: two cells may wrap around a tip that is thin. True if
// there are any.
bool Pipeline::free_tips() {
  std::vector<char> on_curve(curves_.graph().corners.size(), 0);
  for (Index c = 0; c < curves_.size(); ++c)
    for (Index end : curves_.ends(c))
      if (end != kNone) on_curve[end] = 1;
  const std::span<SeedPlace> places = run_.seeds.edit_places();
  bool freed = false;
  for (const TopologyFault& fault : topology_faults(topology_.ball, all_vertices()))
    for (Index seed : fault.seeds) {
      if (seed >= places.size() || places[seed].corner == kNone || on_curve[places[seed].corner] ||
          is_held(places[seed]))
        continue;
      places[seed] = {};
      freed = true;
    }
  return freed;
}

// The seeds, then the sheets of divided cells.
std::vector<Vec3> Pipeline::all_vertices() const {
  std::vector<Vec3> vertices = run_.seeds.positions();
  vertices.insert(vertices.end(), topology_.sheets.begin(), topology_.sheets.end());
  return vertices;
}

void Pipeline::mend_features() {
  const Stopwatch watch;
  features_ = recover_features(run_, trace_, measure_, measure_.scale(wanted_), step_, stand_in_.get());
  result_.seconds.features += watch.seconds();
}

// Mending one may break the other, so they take turns.
void Pipeline::mend_features_and_topology() {
  run_.localise(localises_);
  for (int round = 0; round < kMendingRounds; ++round) {
    if (run_.has_features()) mend_features();
    if (plan_.topology != TopologyControl::enforce || dual_suffices()) return;
    const Stopwatch watch;
    topology_ =
        enforce_topology(run_, trace_, input_topology_, step_, {plan_.branches, placed_around_, stand_in_.get()});
    if (!topology_.ball.holds && round + 1 < kMendingRounds && free_tips()) {
      step_.iterations = kFreedSteps;
      optimise(run_, step_);
      continue;
    }
    result_.seconds.topology += watch.seconds();
    // What could not be kept once will not be the next time.
    if (!run_.has_features() || !features_.broken.empty()) return;
    const Diagram& diagram = run_.diagram(run_.traced() | Want::dual);
    if (check_features(trace_, curves_, run_.seeds.places(), diagram).broken.empty()) return;
  }
}

Pipeline::Divided Pipeline::divide_sheets() {
  const RestrictedPolygons& undivided = run_.diagram(topology_.sheets.empty() ? Want::labels : Want::polygons).polygons;
  Divided result{{}, run_.seeds.positions(), check_ball_property(surface_, undivided)};
  if (topology_.sheets.empty() || result.ball.holds) return result;
  RestrictedPolygons polygons = undivided;
  if (!divide_cells(surface_, result.ball, topology_.gap, polygons, result.vertices)) return result;
  result.ball = check_ball_property(surface_, polygons);
  result.polygons = std::move(polygons);
  return result;
}

// The last pass, taken back if it spoils what divided cells had gained.
void Pipeline::improve_quality() {
  const Stopwatch watch;
  const bool held = !topology_.sheets.empty() && divide_sheets().ball.holds;
  const PlacedSeeds before = run_.seeds;
  result_.improved = improve(run_, trace_, {plan_.min_angle, kMaxAngle, wanted_});
  if (held && !divide_sheets().ball.holds) {
    run_.seeds = before;
    complete(run_, plan_.constrained);
    result_.improved = {};
  }
  result_.seconds.improve += watch.seconds();
}

// Its triangles all face one way where the input's do.
void Pipeline::analyse_result() {
  std::vector<Triangle>& triangles = result_.mesh.triangles;
  const std::size_t vertices = result_.mesh.vertices.size();
  if (!triangles.empty()) {
    EdgeTable table = edge_table(triangles, vertices);
    if (input_topology_.oriented && orient(triangles, table)) table = edge_table(triangles, vertices);
    result_.topology = analyse_topology(triangles, vertices, table);
  }
  result_.topology_matches = same_topology(result_.topology, input_topology_);
}

// Broken curves have edges that no triangle has, and cells that were divided leave others without one.
void Pipeline::extract_features(const std::vector<Index>& vertex_of) {
  TriangleMesh& mesh = result_.mesh;
  if (features_.edges.empty()) return;
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  for (const auto& [a, b] : features_.edges) {
    if (vertex_of[a] == kNone || vertex_of[b] == kNone) continue;
    const std::array<Index, 2> edge = sorted_edge(vertex_of[a], vertex_of[b]);
    if (std::binary_search(table.edges.begin(), table.edges.end(), edge)) mesh.feature_edges.push_back(edge);
  }
  std::sort(mesh.feature_edges.begin(), mesh.feature_edges.end());
}

// `vertex_of` of the seeds and sheets follows. The seconds that it takes.
double Pipeline::mend(const Diagram& diagram, std::vector<Index>& vertex_of) {
  const Stopwatch watch;
  const Csr<Index> rings = vertex_neighbours(diagram.dual.triangles, run_.seeds.size());
  const CellMap map(surface_, run_.seeds.positions(), diagram.moments.triangles, rings);
  MendMesh mended{result_.mesh, result_.places, std::vector<Index>(result_.mesh.vertices.size(), kNone),
                  features_.broken};
  for (Index i = 0; i < run_.seeds.size(); ++i)
    if (vertex_of[i] != kNone) mended.owners[vertex_of[i]] = i;
  if (const std::size_t pairs = plan_.crossings ? count_self_intersections(result_.mesh) : 0; pairs > 0)
    if (const std::size_t before = plan_.crossings(); pairs > before) mended.may_cross = before;
  const ImproveOptions options{plan_.min_angle, kMaxAngle, wanted_};
  result_.mended = mend_angles(map, curves_, trace_, options, mended, run_.context());
  if (!mended.number.empty())
    for (Index& v : vertex_of)
      if (v != kNone) v = mended.number[v];
  return watch.seconds();
}

void Pipeline::report_features() {
  const TriangleMesh& mesh = result_.mesh;
  FeatureResult& result = result_.features;
  for (const SeedPlace& place : result_.places) result.seeds += place.kind != SeedPlace::Kind::surface;
  result.curves = curves_.size();
  result.corners = curves_.graph().corners.size();
  result.broken = features_.broken.size();
  result.distance = measure_feature_distance(mesh.vertices, mesh.feature_edges, surface_.mesh, curves_.graph().edges);
}

void Pipeline::extract() {
  const Stopwatch watch;
  const Want parts = topology_.sheets.empty() ? run_.traced() : Want::polygons;
  const Diagram& diagram = run_.diagram(parts | Want::dual);
  result_.untiled = count_untiled(surface_, diagram.polygons);
  if (run_.has_features()) features_ = check_features(trace_, curves_, run_.seeds.places(), diagram);
  const Divided divided = divide_sheets();
  const Dual dual = divided.polygons ? extract_dual(*divided.polygons) : diagram.dual;
  std::vector<Index> vertex_of = dual_vertices(dual, divided.vertices.size());
  result_.mesh = dual_mesh(divided.vertices, dual, vertex_of);
  result_.places.resize(result_.mesh.vertices.size());
  for (Index i = 0; i < run_.seeds.size(); ++i)
    if (vertex_of[i] != kNone) result_.places[vertex_of[i]] = run_.seeds.place(i);
  if (!surface_.mesh.labels.empty())
    for (Index t : dual.mesh_triangle) result_.mesh.labels.push_back(surface_.mesh.labels[t]);
  extract_features(vertex_of);
  const double mending = asks_for_quality(plan_) ? mend(diagram, vertex_of) : 0;
  analyse_result();
  report_features();
  result_.ball_property = divided.ball.holds;
  result_.divided = divided.vertices.size() - run_.seeds.size();
  result_.faults = topology_faults(divided.ball, divided.vertices);
  for (TopologyFault& fault : result_.faults)
    for (Index& seed : fault.seeds) seed = vertex_of[seed];
  result_.seconds.improve += mending;
  result_.seconds.extract += watch.seconds() - mending;
}

void Pipeline::fit() {
  const Stopwatch watch;
  FitOptions fit;
  fit.fixed.assign(result_.mesh.vertices.size(), 0);
  for (const auto& edge : result_.mesh.feature_edges)
    for (Index v : edge) fit.fixed[v] = 1;
  for (std::size_t v = 0; v < fit.fixed.size(); ++v)
    if (is_held(result_.places[v])) fit.fixed[v] = 1;
  // Without a quality pass any triangle may become like the worst.
  if (asks_for_quality(plan_)) {
    fit.min_angle = plan_.min_angle;
    fit.min_quality = kFitQuality;
  }
  result_.fitted = fit_to_surface(surface_.mesh, result_.mesh, fit, run_.context());
  result_.seconds.fit += watch.seconds();
}

// Slivers have borders that are long for their area, and with it for the edges.
void Pipeline::check_length_of_features() const {
  double length = 0;
  for (Index c = 0; c < curves_.size(); ++c) length += measure_.whole(c);
  const double edges = length / measure_.scale(wanted_);
  if (!(edges < std::max(kMostOnFeatures, kMostOnFeaturesPerVertex * static_cast<double>(wanted_))))
    throw Error(
        fmt::format("features and borders take about {:.3g} vertices where {} are asked for; ask for more, "
                    "or for fewer features (features)",
                    edges, wanted_));
}

void Pipeline::place() {
  check_length_of_features();
  const std::vector<std::size_t> counts = choose_levels();
  if (!plan_.places.empty()) {
    run_.seeds = PlacedSeeds(plan_.seeds, plan_.places);
  } else {
    run_.seeds =
        PlacedSeeds(plan_.seeds.empty() ? initial_seeds(surface_, counts.front(), plan_.random_seed) : plan_.seeds);
    place_on_features(counts.front());
  }
  optimise_levels(counts);
}

void Pipeline::place_again(const PlacedSeeds& earlier) {
  run_.seeds = seeds_on_features(curves_, measure_, measure_.scale(wanted_));
  for (std::size_t i = 0; i < earlier.size(); ++i)
    if (earlier.on_surface(i)) run_.seeds.add(earlier.position(i));
  meet_count(run_, wanted_);
  follow_density(run_);
  optimise_levels({wanted_});
}

bool Pipeline::place_around(const PlacedSeeds& earlier) {
  const double off = static_cast<double>(earlier.size()) - static_cast<double>(wanted_);
  if (std::abs(off) > kMostOff * static_cast<double>(wanted_)) return false;
  run_.localise(localises_);
  run_.seeds = earlier;
  const SeedsBefore before = seeds_before(run_);
  place_on_short_curves();
  meet_count(run_, std::max(wanted_, earlier.size()));
  follow_density(run_);
  if (run_.seeds.positions() == before.positions) {
    run_.localise(false);
    return false;
  }
  placed_around_ = true;
  make_stand_ins({wanted_});
  open_stand_in(0);
  step_.constrained = plan_.constrained;
  step_.phase = "around shorter edges";
  step_.iterations = share_of(plan_.iterations, kFinestShare);
  step_.done = 0;
  step_.share = 1;
  optimise_around(run_, before, step_, stand_in_.get());
  step_.done = 1;
  step_.share = 0;
  return true;
}

// Curves that have fewer seeds than they should get theirs anew.
void Pipeline::place_on_short_curves() {
  const double scale = measure_.scale(wanted_);
  std::vector<std::size_t> missing(curves_.size());
  for (Index c = 0; c < curves_.size(); ++c) missing[c] = measure_.edges(c, scale) - (curves_.closed(c) ? 0 : 1);
  for (const SeedPlace& place : run_.seeds.places())
    if (place.curve != kNone && missing[place.curve] > 0) --missing[place.curve];
  const PlacedSeeds fresh = seeds_on_features(curves_, measure_, scale, run_.seeds.places());
  const auto is_on_short = [&](const SeedPlace& place) { return place.curve != kNone && missing[place.curve] > 0; };
  std::vector<char> removed(run_.seeds.size());
  for (std::size_t i = 0; i < removed.size(); ++i) removed[i] = is_on_short(run_.seeds.place(i));
  run_.seeds.remove(removed);
  for (std::size_t i = 0; i < fresh.size(); ++i)
    if (is_on_short(fresh.place(i))) run_.seeds.add(fresh.position(i), fresh.place(i));
}

SizeBounds Pipeline::crowded() {
  SizeBounds found;
  // Else cells at edges of several sheets are no disks, whatever their size.
  const bool controlled = plan_.branches || (input_topology_.manifold && input_topology_.oriented);
  if (plan_.topology != TopologyControl::enforce || !asks_for_disks(plan_) || !controlled) return found;
  run_.localise(localises_);
  const BallReport report = check_ball_property(surface_, run_.diagram(Want::labels).polygons);
  if (report.cells.empty() || report.cells.size() * kTooManyFailures > run_.seeds.size()) return found;
  const RestrictedPolygons& polygons = run_.diagram(Want::polygons).polygons;
  for (const BallReport::Cell& cell : report.cells) {
    double area = 0;
    for (const auto& part : cell.parts)
      for (const std::size_t p : part) area += polygon_area(polygons, p);
    if (!(area > 0)) continue;
    // Cells of a regular mesh are hexagons.
    const double length = kShorter * std::sqrt(2 / std::numbers::sqrt3 * area);
    found.points.push_back(run_.seeds.position(cell.seed));
    found.lengths.push_back(length);
    for (const auto& part : cell.parts)
      for (const std::size_t p : part)
        for (std::size_t e = polygons.offsets[p]; e < polygons.offsets[p + 1]; ++e) {
          found.points.push_back(polygons.vertices[e]);
          found.lengths.push_back(length);
        }
  }
  return found;
}

SizeBounds Pipeline::broken_curves() const {
  SizeBounds found;
  if (features_.broken.size() * kTooManyFailures > curves_.size()) return found;
  const double scale = measure_.scale(wanted_);
  for (const Index c : features_.broken)
    for (double at = 0; at <= curves_.length(c);) {
      const double length = kShorter * measure_.edge_length(c, at, scale);
      found.points.push_back(curves_.point(c, at));
      found.lengths.push_back(length);
      at += length;
    }
  return found;
}

RemeshResult Pipeline::finish() {
  mend_features_and_topology();
  if (run_.has_features()) complete(run_, plan_.constrained);
  if (asks_for_quality(plan_)) improve_quality();
  extract();
  if (plan_.fit || plan_.noisy) fit();
  result_.iterations = run_.totals.iterations;
  result_.evaluations = run_.totals.evaluations;
  result_.device_work = run_.totals.device_work;
  result_.energy = run_.energy;
  result_.gradient_norm = run_.gradient_norm;
  result_.certification = run_.certification();
  result_.device = run_.backend().description();
  result_.seconds.lbfgs = run_.totals.seconds_lbfgs;
  result_.seconds.diagrams = run_.totals.seconds;
  return std::move(result_);
}

// A context for runs one after the other, whose progress never goes back.
class RunProgress {
 public:
  explicit RunProgress(const Context& context) : context_(context) {
    if (context.progress)
      context_.progress = [this, tell = context.progress](Progress p) {
        p.phase = run_ + p.phase;
        p.fraction = fraction_ = std::max(fraction_, p.fraction);
        tell(p);
      };
  }
  RunProgress(const RunProgress&) = delete;
  RunProgress& operator=(const RunProgress&) = delete;

  const Context& context() const { return context_; }
  void start_again(const char* why) { run_ = std::string(why) + ", "; }

 private:
  Context context_;
  std::string run_;
  double fraction_ = 0;
};

// Where triangles cross though the input's do not. Where those do, smaller ones cross in more pairs.
class NewCrossings {
 public:
  explicit NewCrossings(const Preparation& input) : input_(input) {}

  Crossings of(const TriangleMesh& mesh) {
    Crossings found = find_crossings(mesh);
    return found.pairs > 0 && (input_.lets_cross() || of_input() > 0) ? Crossings{} : found;
  }

  // Pairs of the input's triangles, but for those of components that are set apart.
  std::size_t of_input_set_apart() {
    if (input_.apart().empty()) return of_input();
    if (!of_input_set_apart_) {
      TriangleMesh moved = input_.mesh();
      input_.apart().move(moved);
      of_input_set_apart_ = count_self_intersections(moved);
    }
    return *of_input_set_apart_;
  }

  std::size_t of_input() {
    if (!of_input_) of_input_ = count_self_intersections(input_.mesh());
    return *of_input_;
  }

 private:
  const Preparation& input_;
  std::optional<std::size_t> of_input_, of_input_set_apart_;
};

// Seeds never leave the ends of curves that are to be edges.
void hold_ends(const PreparedInput& prepared, std::vector<char>& held) {
  held.resize(prepared.features.corners.size(), 0);
  for (std::size_t c = 0; c < prepared.whole.size(); ++c)
    if (prepared.whole[c])
      for (const std::size_t corner : ends_of(prepared.features, prepared.features.curves[c])) held[corner] = 1;
}

// Why a result is to be made once more, or null, and how long edges should be where it is not good.
struct AnotherRun {
  const char* why = nullptr;
  SizeBounds bounds;

  void add(const char* reason, const SizeBounds& more) {
    bounds.add(more);
    if (!more.points.empty()) why = reason;
  }
};

// `judged` is what the pipeline finished with.
AnotherRun another_run(Pipeline& pipeline, const JudgedResult& judged, const Crossings& crossings) {
  const RemeshResult& result = judged.result;
  AnotherRun next;
  if (judged.slivers.hopeless) return next;
  if (judged.slivers.worth_another_run) next.why = "shorter edges for angles";
  next.bounds = judged.slivers.bounds;
  if (crossings.pairs <= result.mesh.vertices.size() / kVerticesPerCrossing)
    next.add("shorter edges where it crosses", crossings.bounds);
  if (!result.topology_matches) next.add("shorter edges for topology", pipeline.crowded());
  if (result.features.broken > 0) next.add("shorter edges for curves", pipeline.broken_curves());
  return next;
}

bool has_faults(const JudgedResult& judged) {
  return !judged.result.topology_matches || judged.result.features.broken > 0 || judged.slivers.worth_another_run ||
         judged.slivers.hopeless;
}

// Not where most of what crosses does so by more than triangles are off the surface, unless the input does so as much.
// Whether anything crosses.
bool push_sheets_apart(RemeshResult& result, NewCrossings& input, const Context& context) {
  const std::vector<std::array<Index, 2>> pairs = find_self_intersections(result.mesh, context);
  if (pairs.empty()) return false;
  std::vector<char> movable(result.mesh.vertices.size());
  for (std::size_t v = 0; v < movable.size(); ++v) movable[v] = result.places[v].kind == SeedPlace::Kind::surface;
  push_apart(result.mesh, pairs, movable, std::max(pairs.size() / 2, input.of_input()), context);
  return true;
}

std::size_t slivers_of(const JudgedResult& judged) { return judged.slivers.bounds.points.size() / 3; }

bool has_slivers(const JudgedResult& judged, std::size_t one_in) {
  return slivers_of(judged) * one_in > judged.result.mesh.triangles.size();
}

// Whether a result in which components share vertices where they meet is to be preferred to one in which they do not:
// slivers are few, nothing crosses or no more than in the input, and then slivers are fewer.
bool shares_well(const JudgedResult& shared, const JudgedResult& apart, const TriangleMesh& input) {
  const std::size_t allowed = count_self_intersections(input);
  const auto rank = [&](const JudgedResult& j) {
    const std::size_t crossings = count_self_intersections(j.result.mesh);
    return std::tuple(!j.result.topology_matches, has_slivers(j, kFewSlivers), (crossings > 0) + (crossings > allowed),
                      slivers_of(j), crossings);
  };
  return rank(shared) < rank(apart);
}

}  // namespace

RemeshPlan plan_of(const RemeshOptions& options) {
  RemeshPlan plan;
  plan.vertices = options.vertices;
  plan.seeds = options.seeds;
  plan.random_seed = options.random_seed;
  plan.iterations = options.iterations;
  plan.tolerance = options.tolerance;
  plan.levels = options.levels;
  plan.constrained = options.energy != Energy::restricted;
  plan.topology = options.topology;
  plan.min_angle = options.min_angle;
  plan.fit = options.fit;
  return plan;
}

namespace {

// Runs on all of a surface, each with the edge lengths that the results of those before it asked for. Triangles are not
// kept.
class Runs {
 public:
  Runs(const TriangleMesh& input, const RemeshOptions& options, bool branches, const Context& context)
      : input_(input), options_(options), branches_(branches), context_(context), compute_(options.compute, context),
        progress_(context) {
    OrderedInput ordered(input, options);
    vertex_of_ = std::move(ordered.vertex_of);
    input_of_.resize(ordered.mesh.vertices.size());
    for (Index v = 0; v < vertex_of_.size(); ++v)
      if (vertex_of_[v] != kNone) input_of_[vertex_of_[v]] = v;
    preparation_.emplace(std::move(ordered), context, branches);
    new_crossings_.emplace(*preparation_);
    may_shorten_ = refines();
    preparing_ = watch_.seconds();
  }

  RemeshResult run() {
    settle();
    if (!preparation_->intersections().empty()) settle_intersections();
    settle_crossings();
    if (options_.distance_max > 0) come_near();
    return take_best();
  }

 private:
  // A result, and why another run would be better.
  struct Run {
    JudgedResult judged;
    AnotherRun next;
  };

  bool refines() const { return options_.seeds.empty() && options_.detail != DetailMode::off; }
  void shorten_edges(const SizeBounds& bounds);
  Run make_run(bool last);
  void settle();
  void settle_intersections();
  void settle_crossings();
  void come_near();
  RemeshResult take_best();

  const Stopwatch watch_;
  const TriangleMesh& input_;
  const RemeshOptions& options_;
  const bool branches_;
  const Context& context_;
  Compute compute_;
  RunProgress progress_;
  std::vector<Index> vertex_of_, input_of_;  // the vertex in spatial order of each of the input's, or kNone, and back
  std::optional<Preparation> preparation_;
  std::optional<NewCrossings> new_crossings_;
  bool may_shorten_ = false;  // once, where cells are no disks
  double preparing_ = 0;
  double placing_ = 0;  // work until seeds are placed for the first time, those of a run for sizes among them
  Spent spent_;
  std::optional<PlacedSeeds> earlier_;
  double work_before_ = 0;  // of runs in which components shared vertices
  std::optional<JudgedResult> best_;
  std::optional<CutSheets> cut_;  // whose parts the best result is of
};

// In the runs to come. Components that share intersections get other corners there, which seeds do not fit any more.
void Runs::shorten_edges(const SizeBounds& bounds) {
  preparation_->bound(bounds);
  if (preparation_->divide_intersections_again()) earlier_.reset();
}

Runs::Run Runs::make_run(bool last) {
  const MakeBackend make_backend = [&](const Surface& surface) { return compute_.backend(surface); };
  for (;;) {
    const Stopwatch laying_down;
    PreparedInput prepared = preparation_->lay_down();
    RemeshPlan plan = plan_of(options_);
    plan.vertices = prepared.vertices;
    plan.branches = branches_;
    plan.noisy = prepared.noisy;
    plan.crossings = [this] { return new_crossings_->of_input_set_apart(); };
    for (Index& v : prepared.kept.corners) {
      plan.held.push_back(v != kNone);
      if (v != kNone) v = input_of_[v];
    }
    if (!prepared.whole.empty()) hold_ends(prepared, plan.held);
    const Surface surface(std::move(prepared.mesh), prepared.density);
    preparing_ += laying_down.seconds();
    const std::unique_ptr<Backend> backend = compute_.backend(surface);
    Pipeline pipeline(*backend, prepared.features, plan, progress_.context(), make_backend);
    pipeline.count(spent_);
    if (!earlier_) pipeline.place();
    else if (!best_ || !pipeline.place_around(*earlier_)) pipeline.place_again(*earlier_);
    if (std::exchange(may_shorten_, false)) {
      const SizeBounds crowded = pipeline.crowded();
      if (!crowded.points.empty()) {
        earlier_ = pipeline.seeds();
        shorten_edges(crowded);
        spent_ = pipeline.spent();
        progress_.start_again("shorter edges for topology");
        continue;
      }
    }
    if (placing_ == 0) placing_ = pipeline.spent().totals.work;
    RemeshResult result = pipeline.finish();
    SizeBounds divided;
    if (!prepared.whole.empty()) divided = make_curves_whole(prepared.whole, prepared.features, surface.mesh, result);
    preparation_->apart().move_back(prepared.corners, result);
    if (!prepared.whole.empty()) flip_where_components_cross(result.mesh);
    if (!prepared.kept.empty()) restore_kept(prepared.kept, prepared.features, input_, result);
    const bool may_cross = !asks_for_quality(plan) || push_sheets_apart(result, *new_crossings_, context_);
    result.edge_length = prepared.unit_edge;
    result.noisy = prepared.noisy;
    result.detail = prepared.detail;
    spent_ = {pipeline.spent().totals, result.seconds};
    Run run{judge(std::move(result)), {}};
    last = last || !asks_for_disks(plan) || plan.min_angle == 0;
    const bool asks = may_cross && (best_ || !last);
    const Crossings crossings = asks ? new_crossings_->of(run.judged.result.mesh) : Crossings{};
    run.judged.crossings = crossings.pairs;
    if (!last && (!best_ || is_better(run.judged, *best_))) run.next = another_run(pipeline, run.judged, crossings);
    run.next.bounds.add(divided);
    earlier_ = pipeline.seeds();
    return run;
  }
}

// While results become better, with shorter edges for what is wrong with them.
void Runs::settle() {
  const bool shares = !preparation_->intersections().empty();
  for (int left = may_shorten_ ? (shares ? kSharedRefinements : kRefinements) : 0;; --left) {
    Run run = make_run(left == 0);
    if (best_ && !is_better(run.judged, *best_)) return;
    const bool goes_on = !best_ || is_much_better(run.judged, *best_);
    best_ = std::move(run.judged);
    if (left == 0 || !run.next.why || !goes_on) return;
    const double most = best_->result.input_topology.manifold ? kMostWork : kMostWorkForSheets;
    if (spent_.totals.work - work_before_ > most * placing_) return;
    if (shares && (best_->crossings > 0 || has_slivers(*best_, kVeryFewSlivers))) return;
    shorten_edges(run.next.bounds);
    progress_.start_again(run.next.why);
  }
}

// Where the curves in which components meet leave no good triangles, components are remeshed without them, too.
void Runs::settle_intersections() {
  if (options_.min_angle > 0 && has_faults(*best_)) {
    Preparation sharing = std::exchange(*preparation_, preparation_->without_intersections());
    new_crossings_.emplace(*preparation_);
    may_shorten_ = refines();
    std::optional<PlacedSeeds> seeds = std::exchange(earlier_, std::nullopt);
    std::optional<JudgedResult> shared = std::exchange(best_, std::nullopt);
    work_before_ = spent_.totals.work;
    progress_.start_again("components that cross");
    settle();
    if (!shares_well(*shared, *best_, preparation_->mesh())) return;
    preparation_ = std::move(sharing);
    new_crossings_.emplace(*preparation_);
    earlier_ = std::move(seeds);
    best_ = std::move(shared);
  }
  const std::size_t curves = preparation_->intersections().size();
  context_.warn(fmt::format(
      "components meet along {} curve{}, where they have the same vertices and edges{}", curves, curves == 1 ? "" : "s",
      preparation_->lets_cross() ? "; elsewhere they cross, since edges are too long for it" : ""));
}

// Where more triangles cross than in the input, a surface that goes through itself is remeshed as if its parts only
// touched where they cross, too.
void Runs::settle_crossings() {
  if (!refines() || options_.min_angle == 0 || branches_ || !options_.keep_vertices.empty() ||
      !options_.keep_edges.empty())
    return;
  const std::size_t allowed = new_crossings_->of_input();
  if (allowed == 0 || count_self_intersections(best_->result.mesh) <= allowed) return;
  std::optional<CutSheets> cut = cut_sheets(OrderedInput(input_, options_));
  if (!cut) return;
  std::vector<Index> vertex_of = std::exchange(cut->input.vertex_of, {});
  Context quiet = context_;
  quiet.warning = nullptr;
  Preparation whole = std::exchange(*preparation_, Preparation(std::move(cut->input), quiet));
  new_crossings_.emplace(*preparation_);
  may_shorten_ = true;
  std::optional<PlacedSeeds> seeds = std::exchange(earlier_, std::nullopt);
  std::optional<JudgedResult> crossing = std::exchange(best_, std::nullopt);
  work_before_ = spent_.totals.work;
  progress_.start_again("sheets that cross");
  settle();
  if ((best_->result.topology_matches || !crossing->result.topology_matches) && !has_slivers(*best_, kFewSlivers) &&
      count_self_intersections(best_->result.mesh) <= allowed) {
    vertex_of_ = std::move(vertex_of);
    cut_ = std::move(cut);
    context_.warn(
        fmt::format("the surface goes through itself along {}; its parts are meshed as if they only "
                    "touched there",
                    plural(cut_->edges, "edge")));
    return;
  }
  preparation_ = std::move(whole);
  new_crossings_.emplace(*preparation_);
  earlier_ = std::move(seeds);
  best_ = std::move(crossing);
}

// With shorter edges, and as many vertices as that takes, where the result is too far from the input.
void Runs::come_near() {
  const double most = options_.distance_max;
  DistanceOutcome outcome;
  std::size_t asked = best_->result.wanted;
  outcome.most_vertices = options_.most_vertices > 0 ? options_.most_vertices : kMostTimes * asked;
  double aim = kFirstAim;
  Deviation best = find_deviation(best_->result.mesh, input_, most, aim, context_), last = best;
  for (; best.upper > most && outcome.runs < kNearings; ++outcome.runs) {
    const auto next = static_cast<std::size_t>(std::ceil(last.growth * static_cast<double>(asked)));
    if (last.bounds.points.empty() || asked >= outcome.most_vertices) break;
    asked = std::min(std::max(next, asked + 1), outcome.most_vertices);
    preparation_->ask_for(asked);
    shorten_edges(last.bounds);
    progress_.start_again("shorter edges for the distance");
    Run run = make_run(true);
    run.judged.crossings = new_crossings_->of(run.judged.result.mesh).pairs;
    aim *= kNextAim;
    last = find_deviation(run.judged.result.mesh, input_, most, aim, context_);
    if (last.upper >= best.upper || is_worse(run.judged, *best_)) continue;
    best = last;
    best_ = std::move(run.judged);
  }
  const HausdorffBounds bounds = bound_hausdorff_distance(best_->result.mesh, input_, kBoundsGap * most, context_);
  outcome.lower = bounds.lower;
  outcome.upper = std::min(bounds.upper, best.upper);
  best_->result.distance = outcome;
}

RemeshResult Runs::take_best() {
  RemeshResult& chosen = best_->result;
  chosen.iterations = spent_.totals.iterations;
  chosen.evaluations = spent_.totals.evaluations;
  chosen.device_work = spent_.totals.device_work;
  chosen.seconds = spent_.seconds;
  chosen.seconds.prepare = preparing_;
  chosen.seconds.total = watch_.seconds();
  chosen.welded = cut_ ? cut_->welded : preparation_->welded();
  chosen.welded.vertex_of = std::move(vertex_of_);
  for (Index& v : chosen.welded.vertex_of)
    if (v != kNone) v = preparation_->welded().vertex_of[v];
  return std::move(chosen);
}

RemeshResult remesh_surface(const TriangleMesh& input, const RemeshOptions& options, const Context& context) {
  return Runs(input, options, false, context).run();
}

}  // namespace

RemeshResult remesh_walls(const TriangleMesh& walls, const RemeshOptions& options, const Context& context) {
  check_options(options);
  RemeshOptions walled = options;
  walled.energy = Energy::constrained;
  walled.weld = 0;
  return Runs(walls, walled, true, context).run();
}

RemeshResult remesh(const TriangleMesh& input, const RemeshOptions& options, const Context& context) {
  check_options(options);
  require_moderate_model(input.vertices, "vertex");
  require_moderate(options.seeds, "seed");
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  const Stopwatch watch;
  RemeshResult result = options.keep_triangles.empty() ? remesh_surface(input, options, context)
                                                       : remesh_around_kept(input, options, context, remesh_surface);
  if (!result.mesh.labels.empty()) result.mesh.label_names = input.label_names;
  result.mesh.unit = input.unit;
  result.seconds.total = watch.seconds();
  return result;
}

RemeshResult remesh(Backend& backend, const FeatureGraph& features, const RemeshPlan& plan, const Context& context,
                    const MakeBackend& make_backend) {
  check_plan(plan);
  const Stopwatch watch;
  Pipeline pipeline(backend, features, plan, context, make_backend);
  pipeline.place();
  RemeshResult result = pipeline.finish();
  result.seconds.total = watch.seconds();
  return result;
}

}  // namespace bisector
