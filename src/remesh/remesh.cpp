#include "remesh/remesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "compute/compute.h"
#include "core/parallel.h"
#include "cvt/multilevel.h"
#include "cvt/optimise.h"
#include "remesh/feature_recovery.h"
#include "remesh/prepare.h"
#include "remesh/sheets.h"
#include "voronoi/dual.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

using Clock = std::chrono::steady_clock;

// Of the steps allowed per level: the coarsest of several levels settles soon, the finest starts near its minimum, and seeds that
// are put on the surface move little.
constexpr double kCoarsestShare = 0.6, kFinestShare = 0.5, kConstrainedShare = 0.05;
constexpr int kSettlingRounds = 3;
constexpr int kFreedSteps = 20;
constexpr double kFitQuality = 0.7;  // what fitting may bring better triangles down to
constexpr double kMaxAngle = 91;  // degrees; goal of the final pass

double steps_share(std::size_t level, std::size_t levels) {
  if (levels == 1) return 1;
  return level + 1 == levels ? kFinestShare : level == 0 ? kCoarsestShare : 1;
}

int share_of(int iterations, double share) { return static_cast<int>(std::ceil(iterations * share)); }

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void check_options(const RemeshOptions& options) {
  if (!options.places.empty() && options.places.size() != options.seeds.size())
    throw Error(fmt::format("there are {} places for {} seeds; give one for each", options.places.size(), options.seeds.size()));
  if (!options.seeds.empty()) {
    if (options.seeds.size() < 4) throw Error("a remeshed surface needs at least 4 seeds; give more");
    return;
  }
  if ((options.vertices > 0) == (options.edge_length > 0))
    throw Error("ask for a number of vertices or for an edge length, and not for both");
  if (options.edge_length == 0 && options.vertices < 4)
    throw Error("a remeshed surface needs at least 4 vertices; ask for more");
}

// Seeds level by level, coarse to fine, those on features moving along them from the first; then what makes a good mesh of
// their dual.
class Pipeline {
 public:
  Pipeline(Backend& backend, const FeatureGraph& features, const RemeshOptions& options, const Context& context)
      : backend_(backend), surface_(backend.surface()), options_(options), context_(context),
        curves_(features, surface_.mesh.vertices), measure_(surface_, curves_), trace_(surface_, curves_),
        wanted_(options.seeds.empty() ? options.vertices : options.seeds.size()) {
    step_.tolerance = options.tolerance;
    step_.curves = &curves_;
    step_.share = 0;
  }

  RemeshResult run();

 private:
  struct Final {
    RestrictedPolygons polygons;
    std::vector<Vec3> vertices;  // the seeds, then the sheets of divided cells
    BallReport ball;
  };

  bool featured() const { return !curves_.graph().edges.empty() || !curves_.graph().corners.empty(); }
  double cost(std::size_t seeds) const { return static_cast<double>(surface_.facets.size() + 3 * seeds); }
  std::vector<std::size_t> choose_levels() const;
  void place_on_features(std::size_t count);
  void to_next_level(std::size_t count);
  void meet_count(std::size_t count);
  void optimise_levels();
  bool dual_suffices() const;
  bool free_tips();
  std::vector<Vec3> all_vertices() const;
  void settle();
  Final finish() const;
  void improve_quality();
  void extract();

  Backend& backend_;
  const Surface& surface_;
  const RemeshOptions& options_;
  const Context& context_;
  const FeatureCurves curves_;
  const CurveMeasure measure_;
  const FeatureTrace trace_;
  const std::size_t wanted_;
  bool constrained_ = true;
  OptimiseOptions step_;
  CvtState state_;
  OptimiseTotals totals_;
  RestrictedPolygons polygons_;
  FeatureReport features_;
  TopologyOutcome topology_;
  RemeshResult result_;
};

// The coarsest level must have seeds left beside its features.
std::vector<std::size_t> Pipeline::choose_levels() const {
  if (!options_.seeds.empty()) return {wanted_};
  std::vector<std::size_t> counts =
      level_counts(wanted_, result_.input_topology.euler, result_.input_topology.components, options_.levels);
  const auto crowded = [&](std::size_t count) {
    return 2 * seeds_on_features(curves_, measure_, measure_.scale(count)).seeds.size() > count;
  };
  while (featured() && counts.size() > 1 && crowded(counts.front())) counts.erase(counts.begin());
  return counts;
}

void Pipeline::meet_count(std::size_t count) {
  for (std::size_t size = 0; state_.seeds.size() != count && state_.seeds.size() != size;) {
    context_.check();
    size = state_.seeds.size();
    backend_.evaluate(state_.seeds, state_.moments, polygons_);
    set_count(polygons_, state_.moments, count, state_.seeds, state_.places);
  }
}

// Seeds on features take the place of others nearby.
void Pipeline::place_on_features(std::size_t count) {
  if (!featured()) return;
  PlacedSeeds placed = seeds_on_features(curves_, measure_, measure_.scale(count));
  placed.seeds.insert(placed.seeds.end(), state_.seeds.begin(), state_.seeds.end());
  placed.places.resize(placed.seeds.size());
  state_.seeds = std::move(placed.seeds);
  state_.places = std::move(placed.places);
  meet_count(count);
}

void Pipeline::to_next_level(std::size_t count) {
  backend_.evaluate(state_.seeds, state_.moments, polygons_);
  if (featured()) {
    const PlacedSeeds features = seeds_on_features(curves_, measure_, measure_.scale(count), state_.places);
    PlacedSeeds finer = refine(polygons_, state_.moments, {state_.seeds, state_.places}, curves_, features, count);
    state_.seeds = std::move(finer.seeds);
    state_.places = std::move(finer.places);
  } else {
    state_.seeds = refine(polygons_, state_.moments, state_.seeds, count);
  }
  meet_count(count);
}

void Pipeline::optimise_levels() {
  const std::vector<std::size_t> counts = choose_levels();
  state_.seeds =
      options_.seeds.empty() ? initial_seeds(surface_, counts.front(), options_.random_seed) : options_.seeds;
  if (options_.places.empty()) place_on_features(counts.front());
  else state_.places = options_.places;

  // Shares of the work: an evaluation costs about as much as its facets and three times its seeds.
  double total = constrained_ ? kConstrainedShare * cost(counts.back()) : 0;
  for (std::size_t level = 0; level < counts.size(); ++level) total += steps_share(level, counts.size()) * cost(counts[level]);
  for (std::size_t level = 0; level < counts.size(); ++level) {
    step_.phase = counts.size() > 1 ? fmt::format("level {}/{}", level + 1, counts.size()) : "optimising";
    const double share = steps_share(level, counts.size());
    step_.iterations = share_of(options_.iterations, share);
    step_.done += std::exchange(step_.share, share * cost(counts[level]) / total);
    optimise(backend_, state_, step_, totals_, context_);
    if (featured()) clear_features(backend_, state_, polygons_, trace_, measure_, step_, totals_, context_);
    if (level + 1 < counts.size()) to_next_level(counts[level + 1]);
  }
  if (constrained_) {
    step_.constrained = true;
    step_.phase = "on the surface";
    step_.iterations = share_of(options_.iterations, kConstrainedShare);
    step_.done += std::exchange(step_.share, kConstrainedShare * cost(counts.back()) / total);
    optimise(backend_, state_, step_, totals_, context_);
  }
  step_.done = 1;
  step_.share = 0;
}

// Folds of a rough surface give cells pieces that leave no trace in the dual.
bool Pipeline::dual_suffices() const {
  if (constrained_) return false;
  std::vector<Triangle> dual = extract_dual(polygons_).triangles;
  orient(dual, state_.seeds.size());
  return same_topology(analyse_topology(dual, state_.seeds.size()), result_.input_topology);
}

// Seeds at tips where topology fails are no longer held there: two cells may wrap around a tip that is thin. True if there are any.
bool Pipeline::free_tips() {
  std::vector<char> on_curve(curves_.graph().corners.size(), 0);
  for (Index c = 0; c < curves_.size(); ++c)
    for (Index end : curves_.ends(c))
      if (end != kNone) on_curve[end] = 1;
  bool freed = false;
  for (const TopologyFault& fault : topology_faults(topology_.ball, all_vertices()))
    for (Index seed : fault.seeds) {
      if (seed >= state_.places.size() || state_.places[seed].corner == kNone || on_curve[state_.places[seed].corner]) continue;
      state_.places[seed] = {};
      freed = true;
    }
  return freed;
}

// The seeds, then the sheets of divided cells.
std::vector<Vec3> Pipeline::all_vertices() const {
  std::vector<Vec3> vertices = state_.seeds;
  vertices.insert(vertices.end(), topology_.sheets.begin(), topology_.sheets.end());
  return vertices;
}

// Features and topology: mending one may break the other.
void Pipeline::settle() {
  backend_.evaluate(state_.seeds, state_.moments, polygons_);
  for (int round = 0; round < kSettlingRounds; ++round) {
    if (featured()) {
      const auto begin = Clock::now();
      features_ = recover_features(backend_, state_, polygons_, trace_, measure_, measure_.scale(wanted_), step_, totals_,
                                   context_);
      result_.seconds.features += seconds_since(begin);
    }
    if (options_.topology != TopologyControl::enforce || dual_suffices()) return;
    const auto begin = Clock::now();
    topology_ = enforce_topology(backend_, state_, polygons_, result_.input_topology, step_, totals_, context_);
    if (!topology_.ball.holds && round + 1 < kSettlingRounds && free_tips()) {
      step_.iterations = kFreedSteps;
      optimise(backend_, state_, step_, totals_, context_);
      continue;
    }
    if (!topology_.sheets.empty()) backend_.evaluate(state_.seeds, state_.moments, polygons_);
    result_.seconds.topology += seconds_since(begin);
    // What could not be kept once will not be the next time.
    if (!featured() || !features_.broken.empty()) return;
    if (check_features(trace_, curves_, state_.places, polygons_).broken.empty()) return;
  }
}

// The ball property of the final diagram, cells of several sheets being divided as topology control found it necessary.
Pipeline::Final Pipeline::finish() const {
  Final final{polygons_, state_.seeds, check_ball_property(surface_, polygons_)};
  if (topology_.sheets.empty() || final.ball.holds) return final;
  if (divide_cells(surface_, final.ball, topology_.gap, final.polygons, final.vertices))
    final.ball = check_ball_property(surface_, final.polygons);
  return final;
}

// The last pass, taken back if it spoils what divided cells had gained.
void Pipeline::improve_quality() {
  const auto begin = Clock::now();
  const PlacedSeeds before{state_.seeds, state_.places};
  const bool held = !topology_.sheets.empty() && finish().ball.holds;
  result_.improved =
      improve(backend_, state_, polygons_, trace_, {options_.min_angle, kMaxAngle, wanted_}, step_, totals_, context_);
  if (held && !finish().ball.holds) {
    state_.seeds = before.seeds;
    state_.places = before.places;
    complete(backend_, state_, step_, totals_);
    backend_.evaluate(state_.seeds, state_.moments, polygons_);
    result_.improved = {};
  }
  result_.seconds.improve = seconds_since(begin);
}

void Pipeline::extract() {
  const auto begin = Clock::now();
  result_.untiled = count_untiled(surface_, polygons_);
  if (featured()) features_ = check_features(trace_, curves_, state_.places, polygons_);
  const Final final = finish();
  const Dual dual = extract_dual(final.polygons);
  result_.mesh = dual_mesh(final.vertices, final.polygons);
  if (result_.input_topology.oriented) orient(result_.mesh.triangles, result_.mesh.vertices.size());
  const std::vector<Index> vertex_of = dual_vertices(dual, final.vertices.size());
  result_.places.resize(result_.mesh.vertices.size());
  for (Index i = 0; i < state_.places.size(); ++i)
    if (vertex_of[i] != kNone) result_.places[vertex_of[i]] = state_.places[i];
  if (!surface_.mesh.labels.empty())
    for (Index t : dual.mesh_triangle) result_.mesh.labels.push_back(surface_.mesh.labels[t]);
  for (const auto& [a, b] : features_.edges) {
    if (vertex_of[a] == kNone || vertex_of[b] == kNone) continue;
    result_.mesh.feature_edges.push_back({std::min(vertex_of[a], vertex_of[b]), std::max(vertex_of[a], vertex_of[b])});
  }
  std::sort(result_.mesh.feature_edges.begin(), result_.mesh.feature_edges.end());
  result_.features.seeds = static_cast<std::size_t>(
      std::count_if(state_.places.begin(), state_.places.end(),
                    [](const SeedPlace& place) { return place.kind != SeedPlace::Kind::surface; }));
  result_.features.curves = curves_.size();
  result_.features.corners = curves_.graph().corners.size();
  result_.features.broken = features_.broken.size();
  result_.features.distance = measure_feature_distance(result_.mesh.vertices, result_.mesh.feature_edges,
                                                       surface_.mesh.vertices, curves_.graph().edges);
  result_.topology = analyse_topology(result_.mesh.triangles, result_.mesh.vertices.size());
  result_.topology_matches = same_topology(result_.topology, result_.input_topology);
  result_.ball_property = final.ball.holds;
  result_.divided = final.vertices.size() - state_.seeds.size();
  result_.faults = topology_faults(final.ball, final.vertices);
  for (TopologyFault& fault : result_.faults)
    for (Index& seed : fault.seeds) seed = vertex_of[seed];
  result_.seconds.extract += seconds_since(begin);
}

RemeshResult Pipeline::run() {
  const auto begin = Clock::now();
  result_.wanted = wanted_;
  result_.input_topology = analyse_topology(surface_.mesh.triangles, surface_.mesh.vertices.size());
  constrained_ = options_.energy != Energy::restricted;
  optimise_levels();
  settle();
  if (featured()) complete(backend_, state_, step_, totals_);
  if (options_.min_angle > 0 && constrained_) improve_quality();
  extract();
  if (options_.fit) {
    const auto fitting = Clock::now();
    FitOptions fit;
    fit.fixed.assign(result_.mesh.vertices.size(), 0);
    for (const auto& edge : result_.mesh.feature_edges)
      for (Index v : edge) fit.fixed[v] = 1;
    const QualityReport quality = measure_quality(result_.mesh);
    fit.min_angle = std::min(quality.theta_min, options_.min_angle);
    fit.min_quality = std::min(quality.q_min, kFitQuality);
    result_.fitted = fit_to_surface(surface_.mesh, result_.mesh, fit, context_);
    result_.seconds.fit = seconds_since(fitting);
  }
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

}  // namespace

RemeshResult remesh(const TriangleMesh& input, const RemeshOptions& options, const Context& context) {
  const auto begin = Clock::now();
  check_options(options);
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  PreparedInput prepared = prepare(input, options, context);
  RemeshOptions counted = options;
  counted.vertices = prepared.vertices;
  counted.edge_length = 0;
  if (prepared.noisy) counted.energy = Energy::restricted;
  const Surface surface(std::move(prepared.mesh), std::move(prepared.density));
  const double preparing = seconds_since(begin);
  const std::unique_ptr<Backend> backend = make_backend(surface, options.compute, context);
  RemeshResult result = remesh(*backend, prepared.features, counted, context);
  result.welded = std::move(prepared.welded);
  result.edge_length = prepared.unit_edge;
  result.noisy = prepared.noisy;
  result.seconds.prepare = preparing;
  result.seconds.total = seconds_since(begin);
  return result;
}

RemeshResult remesh(Backend& backend, const FeatureGraph& features, const RemeshOptions& options, const Context& context) {
  check_options(options);
  std::optional<ThreadLimit> limit;
  if (options.threads) limit.emplace(options.threads);
  return Pipeline(backend, features, options, context).run();
}

}  // namespace bisector
