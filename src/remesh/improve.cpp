#include "remesh/improve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "core/grouping.h"
#include "core/parallel.h"
#include "cvt/saved_step.h"
#include "mesh/topology.h"
#include "remesh/feature_recovery.h"
#include "remesh/improve_patch.h"
#include "spatial/kd_tree.h"
#include "voronoi/dual.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

// Rounds of changes, in each of the two aims: better triangles, and the number of seeds that is wanted.
constexpr int kBatches = 10;
// Sweeps of relaxation over a patch for every trial, and again for the best trial.
constexpr int kSweeps = 3, kMoreSweeps = 6;
// Sweeps over all seeds, and the weight that then holds each seed near its place, which keeps cells of equal size.
constexpr int kSmoothingSweeps = 6;
constexpr double kTether = 20;
// A patch reaches so many edges from its middle.
constexpr std::size_t kRings = 2;
// A seed is poor if its triangles cost this many times the average. Of poor seeds that meet the goal kPoorTried are
// tried, and one in kPoorShare of all.
constexpr double kPoor = 1.5;
constexpr std::size_t kPoorTried = 30, kPoorShare = 30;
// In average costs of a triangle: the price of each triangle at a seed beyond or short of six; by how much a trial may
// be worse after the first sweeps; and what the right number of seeds may cost, per seed.
constexpr double kIrregular = 10, kTrialSlack = 4, kPrice = 20;
// Bad angles that are left are searched for: changes of up to so many steps, of which the best are gone on from after
// each.
constexpr int kSearchSteps = 3;
constexpr std::size_t kSearchWidth = 4;
constexpr double kSearchGain = 4;  // average costs of a triangle that a result must save
constexpr int kSearches = 4;       // of results that are tried in turn, where the diagram does not bear them out
// Searches are slow: there are at most so many, and one for so many seeds.
constexpr std::size_t kMostSearches = 60, kSeedsPerSearch = 100;
// Edge flips that are tried per patch.
constexpr std::size_t kFlips = 2;
// Patches that are tried for each seed that is missing or too many, and the share of the number of seeds by which it
// may be off on the way.
constexpr std::size_t kTriesToRestore = 8;
constexpr double kDrift = 0.005, kSearchDrift = 0.02;
// Diagrams that are computed to find out which changes hold together.
constexpr int kReverts = 4;
constexpr std::size_t kSeedsAtOnce = 4096, kCandidatesAtOnce = 8192;

enum class Star : unsigned char { disk, fan, other };

// All that is asked of a diagram, by seed.
struct Snapshot {
  PlacedSeeds seeds;
  DiagramOfSeeds known;
  bool covers = false;        // the diagram is one of the whole surface
  std::vector<double> costs;  // of the dual's triangles
  std::vector<ShapeExcess> excess;
  Csr<Index> stars;  // triangles at each seed
  Csr<Index> rings;  // neighbours of each seed
  std::vector<Star> kinds;
  FeatureReport features;
  long long euler = 0;  // of the dual
  double average = 0;   // cost
  ShapeExcess worst;

  const Dual& dual() const { return known.diagram.dual; }
  const CellMoments& moments() const { return known.diagram.moments; }
};

Csr<Index> stars_of(const Dual& dual, std::size_t seeds) {
  Csr<Index> stars = scatter_into_rows<Index>(
      seeds, 3 * dual.triangles.size(), [&](std::size_t h) { return dual.triangles[h / 3][h % 3]; },
      [](std::size_t h) { return static_cast<Index>(h / 3); });
  Index* const all = stars.values.data();
  parallel_each(seeds, [&](std::size_t v) { std::sort(all + stars.offsets[v], all + stars.offsets[v + 1]); });
  return stars;
}

// The neighbours of a seed, each once, and whether its triangles make a disk around it or a fan.
Star ring_and_kind(const Dual& dual, const Csr<Index>& stars, Index v, std::vector<Index>& ring) {
  ring.clear();
  std::vector<std::array<Index, 2>> links;
  bool simple = stars.size(v) > 0;
  for (const Index* t = stars.begin(v); t != stars.end(v); ++t) {
    if (dual.multiplicity[*t] > 1) simple = false;
    const Triangle& w = dual.triangles[*t];
    const int m = w[0] == v ? 0 : w[1] == v ? 1 : 2;
    links.push_back({w[(m + 1) % 3], w[(m + 2) % 3]});
    ring.insert(ring.end(), links.back().begin(), links.back().end());
  }
  std::sort(ring.begin(), ring.end());
  std::size_t single = 0;
  for (std::size_t k = 0; k < ring.size();) {
    std::size_t end = k;
    while (end < ring.size() && ring[end] == ring[k]) ++end;
    if (end - k > 2) simple = false;
    single += end - k == 1;
    k = end;
  }
  ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  if (!simple || single > 2) return Star::other;
  // One chain of links that reaches all.
  Index start = links[0][0];
  for (const auto& [from, to] : links) {
    if (single == 0) break;
    if (std::none_of(links.begin(), links.end(), [&](const auto& link) { return link[1] == from; })) start = from;
  }
  std::size_t reached = 0;
  Index at = start;
  do {
    const auto link = std::find_if(links.begin(), links.end(), [&](const auto& l) { return l[0] == at; });
    if (link == links.end()) break;
    ++reached;
    at = (*link)[1];
  } while (at != start);
  if (reached != links.size()) return Star::other;
  return single == 0 ? Star::disk : Star::fan;
}

// One change of a few seeds.
struct Change {
  struct Moved {
    Index seed;  // kNone: a new one
    Vec3 x;
    SeedPlace place;
  };
  Index middle = kNone;
  std::vector<Index> footprint;  // the free seeds of the patch, removed ones too
  std::vector<Moved> moved;
  std::vector<Index> removed;
  std::vector<Index> curves;  // that it could break
  double gain = 0;
  std::size_t added = 0;
  bool searched = false;  // for a bad angle
  int growth() const { return static_cast<int>(added) - static_cast<int>(removed.size()); }
};

class Improver {
 public:
  Improver(CvtRun& run, const FeatureTrace& trace, const ImproveOptions& options, SavedStep& saved);

  ImproveReport run();

 private:
  enum class Aim { better, no_bad_angles, fewer, more };
  // Of the pass, in order; each has rounds.
  enum class Part : int { better, no_bad_angles, count };

  // Whether the number of seeds is the aim.
  static bool counts(Aim aim) { return aim == Aim::fewer || aim == Aim::more; }
  bool has_curves() const { return run_.curves().size() > 0; }
  Want parts() const { return run_.traced() | Want::dual; }  // of a diagram
  double irregular_price() const { return kIrregular * now_.average; }
  std::size_t wanted() const { return options_.vertices ? options_.vertices : run_.seeds.size(); }
  void measure(Snapshot& s);
  // Takes the snapshot that was measured last.
  void accept(Snapshot next);
  ShapeExcess worst_excess(const Snapshot& s, Index seed) const;
  bool as_good(const Snapshot& next) const;
  bool newly_broken(const Snapshot& next, Index curve) const;
  Vec3 place_of(const FeatureFault& fault) const {
    const FeatureCurves& curves = run_.curves();
    return curves.point(fault.curve, curves.wrap(fault.curve, 0.5 * (fault.from + fault.to)));
  }
  // Where curves break that did not before, and whether it is a change that breaks them.
  std::vector<Vec3> new_faults(const Snapshot& next) const;
  bool breaks_curve(const Snapshot& next, const Change& change) const;
  // By how many degrees the smallest angle of a seed's triangles is less than it should be, where it is not imposed.
  double angle_missing(Index seed) const;
  // What a search may leave where the worst triangles were such.
  ShapeExcess allowed(ShapeExcess worst) const {
    worst.under = std::max(worst.under, bad_excess());
    return worst;
  }
  // A smaller angle is bad that misses the goal by more than so many degrees.
  double bad_excess() const { return std::max(0.0, options_.min_angle - kBadAngle); }
  // The seeds up to kRings edges away, nearest first.
  std::vector<Index> seeds_around(Index middle) const;
  PatchVertex vertex_of(Index seed, const CellMap& map) const;
  ImprovePatch patch_of(const std::vector<Index>& seeds, const CellMap& map) const;
  Change best_change(Index middle, const CellMap& map, Aim aim, std::size_t& trials) const;
  std::optional<ImprovePatch> try_one(const ImprovePatch& start, Aim aim, std::size_t& trials) const;
  std::optional<ImprovePatch> search(const ImprovePatch& start, std::size_t rank, std::size_t& trials) const;
  // A seed around which a change may be tried.
  struct Candidate {
    Index seed;
    double excess, cost;
  };
  std::optional<Candidate> candidate(Index seed, Aim aim) const;
  // All of them, the worst first.
  std::vector<Candidate> candidates(Aim aim) const;
  std::vector<Index> choose_middles(Aim aim);
  std::vector<char> choose_changes(const std::vector<Change>& changes, Aim aim) const;
  // Changes made around some seeds.
  struct Batch {
    std::size_t tried, made;
  };
  Batch batch(Aim aim);
  // The seeds after some changes; the new index of each, and the seeds there of each change.
  Snapshot assemble(const std::vector<Change>& changes, const std::vector<char>& on, std::vector<Index>& index,
                    std::vector<std::vector<Index>>& seeds_of) const;
  bool holds(const Snapshot& next, const Change& change, const std::vector<Index>& index,
             const std::vector<Index>& seeds) const;
  // What a change must save for that.
  double least_gain(const Change& change) const;
  void drop_nearest_to_damage(const Snapshot& next, const std::vector<Change>& changes, const std::vector<Index>& index,
                              std::vector<char>& on) const;
  // Makes those of the changes that hold; `on` tells which.
  void make(const std::vector<Change>& changes, std::vector<char>& on);
  void drop_idle();
  // Gives now_ to the run, with its polygons if they are still there.
  void hand_over();
  void smooth();
  std::vector<std::vector<Index>> colours(const std::vector<PatchVertex>& vertices) const;
  void take(PlacedSeeds seeds, DiagramOfSeeds known = {});
  void begin_part();
  bool round();
  void rounds();
  // What the next round hangs on, and from it.
  std::string state() const;
  bool go_on();

  CvtRun& run_;
  const FeatureTrace& trace_;
  const ImproveOptions& options_;
  SavedStep& saved_;
  ShapeGoal goal_;
  const CurvesBetween curves_between_;
  std::size_t poor_left_ = 0;  // poor seeds that may still be tried
  std::size_t searches_left_ = 0;
  std::vector<char> tried_;  // by seed: how often in vain since something near it has changed
  Snapshot now_;
  // Of what measure() was called for last: snapshots keep nothing of them but what it reads off.
  RestrictedPolygons polygons_;
  bool polygons_are_current_ = false;  // those of now_
  ImproveReport report_;
  Part part_ = Part::better;
  int round_ = 0;
  double first_average_ = 0;  // cost
};

Improver::Improver(CvtRun& run, const FeatureTrace& trace, const ImproveOptions& options, SavedStep& saved)
    : run_(run), trace_(trace), options_(options), saved_(saved),
      goal_(shape_goal(options.min_angle, options.max_angle)), curves_between_(run.curves()) {}

void Improver::measure(Snapshot& s) {
  run_.context().check();
  if (s.known.diagram.polygons.pairs.empty()) s.known.diagram.polygons = std::move(polygons_);
  run_.evaluate(s.seeds.positions(), parts(), s.known);
  s.covers = run_.covers(s.known.diagram.moments.mass);
  const Dual& dual = s.dual();
  const std::vector<Vec3>& seeds = s.seeds.positions();
  const std::size_t n = seeds.size();
  s.costs.resize(dual.triangles.size());
  s.excess.resize(s.costs.size());
  parallel_each(s.costs.size(), [&](std::size_t k) {
    const Triangle& t = dual.triangles[k];
    std::tie(s.costs[k], s.excess[k]) = shape_cost_and_excess(seeds[t[0]], seeds[t[1]], seeds[t[2]], goal_);
  });
  s.average = fixed_sum(s.costs.size(), [&](std::size_t k) { return s.costs[k]; });
  s.average /= static_cast<double>(s.costs.size());
  for (const ShapeExcess& excess : s.excess) s.worst.take(excess);
  s.stars = stars_of(dual, n);
  s.kinds.resize(n);
  std::vector<std::vector<Index>> rings(n);
  parallel_each(n, [&](std::size_t v) { s.kinds[v] = ring_and_kind(dual, s.stars, static_cast<Index>(v), rings[v]); });
  s.rings.offsets.assign(n + 1, 0);
  for (std::size_t v = 0; v < n; ++v) s.rings.offsets[v + 1] = s.rings.offsets[v] + rings[v].size();
  s.rings.values.resize(s.rings.offsets.back());
  parallel_each(n, [&](std::size_t v) {
    std::copy(rings[v].begin(), rings[v].end(),
              s.rings.values.begin() + static_cast<std::ptrdiff_t>(s.rings.offsets[v]));
  });
  const auto vertices = std::count_if(rings.begin(), rings.end(), [](const auto& ring) { return !ring.empty(); });
  const auto edges = static_cast<long long>(s.rings.values.size() / 2);
  s.euler = vertices - edges + static_cast<long long>(dual.triangles.size());
  if (has_curves()) s.features = check_features(trace_, run_.curves(), s.seeds.places(), s.known.diagram);
  polygons_ = std::move(s.known.diagram.polygons);
  s.known.diagram.polygons = {};
  s.known.diagram.has = Want::dual;
  polygons_are_current_ = false;
}

void Improver::accept(Snapshot next) {
  now_ = std::move(next);
  polygons_are_current_ = true;
}

ShapeExcess Improver::worst_excess(const Snapshot& s, Index seed) const {
  ShapeExcess worst;
  for (const Index* t = s.stars.begin(seed); t != s.stars.end(seed); ++t) worst.take(s.excess[*t]);
  return worst;
}

bool Improver::as_good(const Snapshot& next) const {
  return next.covers && next.euler == now_.euler && next.worst.within(now_.worst) &&
         next.features.broken.size() <= now_.features.broken.size();
}

bool Improver::newly_broken(const Snapshot& next, Index curve) const {
  const auto in = [&](const Snapshot& s) {
    return std::binary_search(s.features.broken.begin(), s.features.broken.end(), curve);
  };
  return in(next) && !in(now_);
}

std::vector<Vec3> Improver::new_faults(const Snapshot& next) const {
  std::vector<Vec3> places;
  for (const FeatureFault& fault : next.features.faults)
    if (newly_broken(next, fault.curve)) places.push_back(place_of(fault));
  return places;
}

bool Improver::breaks_curve(const Snapshot& next, const Change& change) const {
  const Vec3& middle = now_.seeds.position(change.middle);
  double squared_reach = 0;
  for (const Index v : change.footprint)
    squared_reach = std::max(squared_reach, norm2(now_.seeds.position(v) - middle));
  return std::any_of(next.features.faults.begin(), next.features.faults.end(), [&](const FeatureFault& fault) {
    return newly_broken(next, fault.curve) && norm2(place_of(fault) - middle) <= squared_reach &&
           std::find(change.curves.begin(), change.curves.end(), fault.curve) != change.curves.end();
  });
}

double Improver::angle_missing(Index seed) const {
  double missing = 0;
  for (const Index* t = now_.stars.begin(seed); t != now_.stars.end(seed); ++t) {
    if (now_.excess[*t].under <= missing) continue;
    const Triangle& v = now_.dual().triangles[*t];
    const std::array<Vec3, 3> x{now_.seeds.position(v[0]), now_.seeds.position(v[1]), now_.seeds.position(v[2])};
    if (!angle_is_imposed(x, edges_among(v, now_.features.edges))) missing = now_.excess[*t].under;
  }
  return missing;
}

std::vector<Index> Improver::seeds_around(Index middle) const {
  std::vector<Index> seeds{middle};
  for (std::size_t ring = 0, begin = 0; ring < kRings; ++ring) {
    const std::size_t end = seeds.size();
    for (std::size_t k = begin; k < end; ++k)
      for (const Index* j = now_.rings.begin(seeds[k]); j != now_.rings.end(seeds[k]); ++j)
        if (std::find(seeds.begin(), seeds.end(), *j) == seeds.end()) seeds.push_back(*j);
    begin = end;
  }
  return seeds;
}

// Seeds at a border that is no feature stay, or it would creep inwards.
PatchVertex Improver::vertex_of(Index seed, const CellMap& map) const {
  PatchVertex vertex;
  vertex.x = now_.seeds.position(seed);
  vertex.place = now_.seeds.place(seed);
  vertex.owner = vertex.seed = seed;
  vertex.free = vertex.place.kind != Kind::surface || now_.kinds[seed] == Star::disk;
  if (vertex.place.kind == Kind::surface && now_.moments().triangles.size(seed) > 0)
    map.project(vertex.x, vertex.owner, vertex.normal);
  return vertex;
}

// The seeds given and their triangles; the seeds come first and are free, as far as they may be.
ImprovePatch Improver::patch_of(const std::vector<Index>& seeds, const CellMap& map) const {
  std::vector<Index> triangles;
  for (const Index v : seeds) triangles.insert(triangles.end(), now_.stars.begin(v), now_.stars.end(v));
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  ImprovePatch patch(map, &run_.curves(), goal_);
  std::vector<Index> members = seeds;
  for (const Index v : seeds) patch.add_vertex(vertex_of(v, map));
  std::vector<LockedEdge> locked;
  for (const Index t : triangles) {
    const Triangle& corners = now_.dual().triangles[t];
    Triangle local;
    for (int m = 0; m < 3; ++m) {
      const auto member = std::find(members.begin(), members.end(), corners[m]);
      local[m] = static_cast<Index>(member - members.begin());
      if (member != members.end()) continue;
      members.push_back(corners[m]);
      PatchVertex vertex = vertex_of(corners[m], map);
      vertex.free = false;
      patch.add_vertex(vertex);
    }
    patch.add_triangle(local);
    const std::array<bool, 3> on_curve = edges_among(corners, now_.features.edges);
    for (int m = 0; m < 3; ++m) {
      const int next = (m + 1) % 3;
      if (on_curve[m])
        locked.push_back({std::min(local[m], local[next]), std::max(local[m], local[next]),
                          curves_between_(now_.seeds.place(corners[m]), now_.seeds.place(corners[next]))});
    }
  }
  for (std::size_t k = 0; k < members.size(); ++k)
    patch.set_outside(static_cast<Index>(k), now_.stars.size(members[k]));
  patch.lock(std::move(locked));
  return patch;
}

// The trial that costs least, if that is not much more than now. Where the count is the aim, it may cost more.
std::optional<ImprovePatch> Improver::try_one(const ImprovePatch& start, Aim aim, std::size_t& trials) const {
  double least = std::numeric_limits<double>::infinity();
  if (aim == Aim::better) least = start.cost(now_.average, irregular_price()) + kTrialSlack * now_.average;
  std::optional<ImprovePatch> best;
  const auto attempt = [&](const auto& operation) {
    ImprovePatch patch = start;
    if (!operation(patch)) return;
    ++trials;
    patch.relax_all(kSweeps);
    const double cost = patch.cost(now_.average, irregular_price());
    if (!(cost < least)) return;
    least = cost;
    best = std::move(patch);
  };
  const Index v = 0;
  if (aim == Aim::better) {
    attempt([](ImprovePatch&) { return true; });
    const std::vector<std::array<Index, 2>> flips = start.wanted_flips(v);
    for (std::size_t k = 0; k < std::min(kFlips, flips.size()); ++k)
      attempt([&](ImprovePatch& patch) { return patch.flip(flips[k][0], flips[k][1]); });
  }
  if (aim != Aim::more) attempt([&](ImprovePatch& patch) { return patch.remove(v); });
  if (aim != Aim::fewer) {
    attempt([&](ImprovePatch& patch) { return patch.split(v, patch.farthest_neighbour(v)); });
    attempt([&](ImprovePatch& patch) { return patch.insert(patch.largest_triangle(v)); });
  }
  return best;
}

// Of all results the one that costs least but for `rank` others, if it costs less than now.
std::optional<ImprovePatch> Improver::search(const ImprovePatch& start, std::size_t rank, std::size_t& trials) const {
  struct Result {
    ImprovePatch patch;
    double cost;
  };
  const double before = start.cost(now_.average, irregular_price());
  const std::size_t encroachments = start.encroachments();
  const ShapeExcess worst = allowed(start.worst());
  std::vector<Result> best;
  const auto cost_of = [&](const ImprovePatch& patch) {
    ++trials;
    return patch.cost(now_.average, irregular_price());
  };
  const auto alike = [&](const Result& a, const Result& b) { return std::abs(a.cost - b.cost) < now_.average; };
  search_changes(start, {kSearchSteps, kSearchWidth, kSweeps, now_.average}, cost_of,
                 [&](const ImprovePatch& patch, double cost, bool gone_on_from) {
                   if (!gone_on_from || !(cost < before - kSearchGain * now_.average) || !patch.worst().within(worst) ||
                       patch.encroachments() > encroachments)
                     return;
                   best.push_back({patch, cost});
                 });
  std::stable_sort(best.begin(), best.end(), [](const Result& a, const Result& b) { return a.cost < b.cost; });
  best.erase(std::unique(best.begin(), best.end(), alike), best.end());
  if (best.size() <= rank) return {};
  return std::move(best[rank].patch);
}

Change Improver::best_change(Index middle, const CellMap& map, Aim aim, std::size_t& trials) const {
  Change change;
  change.middle = middle;
  change.searched = aim == Aim::no_bad_angles;
  change.footprint = seeds_around(middle);
  const ImprovePatch start = patch_of(change.footprint, map);
  const double before = start.cost(now_.average, irregular_price());
  std::optional<ImprovePatch> best =
      change.searched ? search(start, tried_[middle], trials) : try_one(start, aim, trials);
  if (!best) return change;
  best->relax_all(kMoreSweeps);
  change.gain = before - best->cost(now_.average, irregular_price());
  if (!(change.gain > (counts(aim) ? -kPrice * now_.average : 0))) return change;
  for (Index k = 0; k < best->vertices().size(); ++k) {
    const PatchVertex& vertex = best->vertices()[k];
    if (vertex.place.curve != kNone) change.curves.push_back(vertex.place.curve);
    if (const Index corner = vertex.place.corner; corner != kNone && has_curves()) {
      const std::vector<Index>& ending = curves_between_.at_corner(corner);
      change.curves.insert(change.curves.end(), ending.begin(), ending.end());
    }
    if (vertex.removed) {
      if (vertex.seed != kNone) change.removed.push_back(vertex.seed);
    } else if (vertex.seed == kNone || !(vertex.x == now_.seeds.position(vertex.seed))) {
      change.moved.push_back({vertex.seed, vertex.x, vertex.place});
      change.added += vertex.seed == kNone;
    }
  }
  return change;
}

std::optional<Improver::Candidate> Improver::candidate(Index v, Aim aim) const {
  if (tried_[v] >= (aim == Aim::no_bad_angles ? kSearches : 1) || now_.stars.size(v) == 0 ||
      now_.kinds[v] == Star::other)
    return {};
  double sum = 0, worst = 0;
  for (const Index* t = now_.stars.begin(v); t != now_.stars.end(v); ++t) {
    sum += now_.costs[*t];
    worst = std::max(worst, now_.costs[*t]);
  }
  double excess = 0;
  if (aim == Aim::no_bad_angles) {
    excess = angle_missing(v);
    if (!(excess > bad_excess())) return {};
  } else if (!counts(aim)) {
    excess = worst_excess(now_, v).most();
  }
  const double cost = sum / static_cast<double>(now_.stars.size(v)) + worst;
  if (!counts(aim) && !(excess > 0) && !(cost > 2 * kPoor * now_.average)) return {};
  return Candidate{v, excess, cost};
}

std::vector<Improver::Candidate> Improver::candidates(Aim aim) const {
  const std::size_t n = now_.seeds.size();
  std::vector<std::vector<Candidate>> chunks((n + kSeedsAtOnce - 1) / kSeedsAtOnce);
  parallel_chunks(n, kSeedsAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      if (const std::optional<Candidate> found = candidate(static_cast<Index>(v), aim)) chunks[c].push_back(*found);
  });
  std::vector<Candidate> all;
  for (const std::vector<Candidate>& chunk : chunks) all.insert(all.end(), chunk.begin(), chunk.end());
  sort_in_parallel(all, [](const Candidate& a, const Candidate& b) {
    return a.excess != b.excess ? a.excess > b.excess : a.cost != b.cost ? a.cost > b.cost : a.seed < b.seed;
  });
  return all;
}

// Seeds of triangles beyond the goal, then of poor ones, worst first; their patches share no triangle.
std::vector<Index> Improver::choose_middles(Aim aim) {
  const std::vector<Candidate> all = candidates(aim);
  const auto missing = static_cast<long long>(wanted()) - static_cast<long long>(now_.seeds.size());
  std::size_t most = now_.seeds.size();
  if (aim == Aim::no_bad_angles) most = searches_left_;
  if (counts(aim)) most = kTriesToRestore * static_cast<std::size_t>(std::abs(missing));
  std::vector<char> taken(now_.dual().triangles.size(), 0);
  const auto is_taken = [&](Index t) { return taken[t] != 0; };
  std::vector<std::vector<Index>> patches(std::min(all.size(), kCandidatesAtOnce));
  std::vector<Index> middles;
  for (std::size_t first = 0; first < all.size(); first += kCandidatesAtOnce) {
    // The triangles of the next patches; of those that overlap one that is chosen already, none.
    const std::size_t count = std::min(kCandidatesAtOnce, all.size() - first);
    parallel_each(
        count,
        [&](std::size_t k) {
          patches[k].clear();
          for (const Index v : seeds_around(all[first + k].seed))
            patches[k].insert(patches[k].end(), now_.stars.begin(v), now_.stars.end(v));
          if (std::any_of(patches[k].begin(), patches[k].end(), is_taken)) patches[k].clear();
        },
        64);
    for (std::size_t k = 0; k < count; ++k) {
      const Candidate& next = all[first + k];
      const bool poor = aim == Aim::better && next.excess == 0;
      if (middles.size() == most || (poor && poor_left_ == 0)) return middles;
      if (patches[k].empty() || std::any_of(patches[k].begin(), patches[k].end(), is_taken)) continue;
      for (const Index t : patches[k]) taken[t] = 1;
      middles.push_back(next.seed);
      if (poor) --poor_left_;
    }
  }
  return middles;
}

// The best ones first, as far as the count allows it.
std::vector<char> Improver::choose_changes(const std::vector<Change>& changes, Aim aim) const {
  std::vector<std::size_t> order(changes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return changes[a].gain > changes[b].gain; });
  const auto count = static_cast<long long>(wanted());
  const double share = aim == Aim::no_bad_angles ? kSearchDrift : counts(aim) ? 0 : kDrift;
  const auto drift = static_cast<long long>(share * static_cast<double>(count));
  long long off = static_cast<long long>(now_.seeds.size()) - count;
  std::vector<char> on(changes.size(), 0);
  for (const std::size_t k : order) {
    if (changes[k].moved.empty() && changes[k].removed.empty()) continue;
    const long long then = off + changes[k].growth();
    if (std::abs(then) > std::max(drift, std::abs(off)) || (counts(aim) && off == 0)) continue;
    on[k] = 1;
    off = then;
  }
  return on;
}

Improver::Batch Improver::batch(Aim aim) {
  const std::vector<Index> middles = choose_middles(aim);
  if (middles.empty()) return {0, 0};
  if (aim == Aim::no_bad_angles) searches_left_ -= middles.size();
  const CellMap map(run_.surface(), now_.seeds.positions(), now_.moments().triangles, now_.rings);
  std::vector<Change> changes(middles.size());
  std::vector<std::size_t> trials(middles.size(), 0);
  parallel_each(
      middles.size(), [&](std::size_t k) { changes[k] = best_change(middles[k], map, aim, trials[k]); }, 1);
  report_.trials += std::accumulate(trials.begin(), trials.end(), std::size_t{0});
  std::vector<char> on = choose_changes(changes, aim);
  const std::size_t before = now_.seeds.size();
  make(changes, on);

  // The marks follow the seeds.
  std::vector<char> removed(before, 0);
  std::size_t made = 0;
  for (const Index v : middles) ++tried_[v];
  for (std::size_t k = 0; k < changes.size(); ++k) {
    if (!on[k]) continue;
    ++made;
    report_.inserted += changes[k].added;
    report_.removed += changes[k].removed.size();
    for (const Index v : changes[k].footprint) tried_[v] = 0;
    for (const Index v : changes[k].removed) removed[v] = 1;
  }
  report_.made += made;
  std::size_t kept = 0;
  for (std::size_t v = 0; v < before; ++v)
    if (!removed[v]) tried_[kept++] = tried_[v];
  tried_.resize(kept);
  tried_.resize(now_.seeds.size(), 0);
  return {middles.size(), made};
}

Snapshot Improver::assemble(const std::vector<Change>& changes, const std::vector<char>& on, std::vector<Index>& index,
                            std::vector<std::vector<Index>>& seeds_of) const {
  Snapshot next;
  next.seeds = now_.seeds;
  std::vector<char> removed(next.seeds.size(), 0);
  for (std::size_t c = 0; c < changes.size(); ++c) {
    if (!on[c]) continue;
    for (const Index v : changes[c].removed) removed[v] = 1;
    for (const Change::Moved& m : changes[c].moved)
      if (m.seed != kNone) next.seeds.put(m.seed, m.x, m.place);
  }
  next.seeds.remove(removed);
  index.assign(removed.size(), kNone);
  Index kept = 0;
  for (std::size_t v = 0; v < removed.size(); ++v)
    if (!removed[v]) index[v] = kept++;
  seeds_of.assign(changes.size(), {});
  for (std::size_t c = 0; c < changes.size(); ++c) {
    if (!on[c]) continue;
    for (const Index v : changes[c].footprint)
      if (index[v] != kNone) seeds_of[c].push_back(index[v]);
    for (const Change::Moved& m : changes[c].moved)
      if (m.seed == kNone) {
        seeds_of[c].push_back(static_cast<Index>(next.seeds.size()));
        next.seeds.add(m.x, m.place);
      }
  }
  return next;
}

// What ImprovePatch::cost gives for the triangles at some seeds, without the price of encroachments.
double cost_at(const Snapshot& s, std::vector<Index> seeds, double average, double irregular) {
  std::vector<Index> triangles;
  for (std::size_t k = 0, count = seeds.size(); k < count; ++k) {
    const Index v = seeds[k];
    triangles.insert(triangles.end(), s.stars.begin(v), s.stars.end(v));
    seeds.insert(seeds.end(), s.rings.begin(v), s.rings.end(v));
  }
  for (std::vector<Index>* list : {&triangles, &seeds}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  double sum = 0;
  for (const Index t : triangles) sum += s.costs[t] - average;
  for (const Index v : seeds)
    if (s.seeds.on_surface(v)) sum += irregular * std::abs(static_cast<double>(s.stars.size(v)) - 6);
  return sum;
}

double Improver::least_gain(const Change& change) const {
  if (change.gain < 0) return 2 * change.gain;  // the price of the right count
  return change.searched ? kSearchGain * now_.average : 0;
}

bool Improver::holds(const Snapshot& next, const Change& change, const std::vector<Index>& index,
                     const std::vector<Index>& seeds) const {
  const double before = cost_at(now_, change.footprint, now_.average, irregular_price());
  const double after = cost_at(next, seeds, now_.average, irregular_price());
  if (!(after < before - least_gain(change))) return false;
  ShapeExcess worst_before, worst_after;
  for (const Index v : change.footprint) worst_before.take(worst_excess(now_, v));
  for (const Index v : seeds) {
    worst_after.take(worst_excess(next, v));
    if (next.kinds[v] == Star::other) return false;
  }
  if (!worst_after.within(change.searched ? allowed(worst_before) : worst_before)) return false;
  for (const Index v : change.footprint)
    for (const Index* j = now_.rings.begin(v); j != now_.rings.end(v); ++j)
      if (index[*j] != kNone && now_.kinds[*j] != next.kinds[index[*j]]) return false;
  return !breaks_curve(next, change);
}

// Of cells across a thin wall the seeds that moved are no neighbours: the change that spoils their stars, or a curve
// beside them, is taken to be the nearest.
void Improver::drop_nearest_to_damage(const Snapshot& next, const std::vector<Change>& changes,
                                      const std::vector<Index>& index, std::vector<char>& on) const {
  std::vector<Vec3> damage = new_faults(next);
  for (Index v = 0; v < index.size(); ++v) {
    if (index[v] == kNone) continue;
    if (next.kinds[index[v]] == now_.kinds[v] && worst_excess(next, index[v]).within(now_.worst)) continue;
    damage.push_back(now_.seeds.position(v));
  }
  for (const Vec3& x : damage) {
    std::size_t nearest = changes.size();
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < changes.size(); ++c) {
      if (!on[c]) continue;
      for (const Index w : changes[c].footprint)
        if (const double d = norm2(now_.seeds.position(w) - x); d < least) {
          least = d;
          nearest = c;
        }
    }
    if (nearest < changes.size()) on[nearest] = 0;
  }
}

void Improver::make(const std::vector<Change>& changes, std::vector<char>& on) {
  for (int round = 0; round < kReverts && std::find(on.begin(), on.end(), 1) != on.end(); ++round) {
    std::vector<Index> index;
    std::vector<std::vector<Index>> seeds_of;
    Snapshot next = assemble(changes, on, index, seeds_of);
    measure(next);
    std::vector<char> held = on;
    for (std::size_t c = 0; c < changes.size(); ++c)
      if (on[c] && !holds(next, changes[c], index, seeds_of[c])) held[c] = 0;
    if (held == on && !as_good(next)) drop_nearest_to_damage(next, changes, index, held);
    if (held != on) {
      on = std::move(held);
      continue;
    }
    if (!as_good(next)) break;
    accept(std::move(next));
    return;
  }
  std::fill(on.begin(), on.end(), 0);
}

// Seeds of a class share no triangle.
std::vector<std::vector<Index>> Improver::colours(const std::vector<PatchVertex>& vertices) const {
  std::vector<std::vector<Index>> classes;
  std::vector<std::size_t> colour(vertices.size(), vertices.size());
  std::vector<char> used;
  for (Index v = 0; v < vertices.size(); ++v) {
    if (!vertices[v].free || vertices[v].place.kind == Kind::fixed || now_.stars.size(v) == 0) continue;
    used.assign(classes.size() + 1, 0);
    for (const Index* j = now_.rings.begin(v); j != now_.rings.end(v); ++j)
      if (colour[*j] < used.size()) used[colour[*j]] = 1;
    colour[v] = static_cast<std::size_t>(std::find(used.begin(), used.end(), 0) - used.begin());
    if (colour[v] == classes.size()) classes.emplace_back();
    classes[colour[v]].push_back(v);
  }
  return classes;
}

// Relaxes all seeds; those where the dual does not take it well stay.
void Improver::smooth() {
  const CellMap map(run_.surface(), now_.seeds.positions(), now_.moments().triangles, now_.rings);
  const std::size_t n = now_.seeds.size();
  std::vector<PatchVertex> vertices(n);
  parallel_each(n, [&](std::size_t v) { vertices[v] = vertex_of(static_cast<Index>(v), map); });
  ImprovePatch all(map, &run_.curves(), goal_);
  all.set_mesh(vertices, now_.dual().triangles, now_.stars);
  const std::vector<std::vector<Index>> classes = colours(vertices);
  for (int sweep = 0; sweep < kSmoothingSweeps; ++sweep) {
    run_.context().check();
    for (const std::vector<Index>& seeds : classes)
      parallel_each(
          seeds.size(), [&](std::size_t k) { all.relax(seeds[k], kTether); }, 256);
  }

  const PointSet points{now_.seeds.positions()};
  std::optional<KdTree> tree;  // few meshes need it
  const auto seeds_within = [&](const Vec3& x, double squared) {
    std::vector<std::pair<Index, double>> found;
    const double q[3] = {x.x, x.y, x.z};
    if (!tree) tree.emplace(3, points);
    tree->radiusSearch(q, squared, found, nanoflann::SearchParams());
    std::vector<Index> seeds;
    for (const auto& [seed, distance] : found) seeds.push_back(seed);
    return seeds;
  };
  std::vector<char> back(n, 0);
  for (int round = 0; round < kReverts; ++round) {
    Snapshot next;
    next.seeds = now_.seeds;
    for (std::size_t v = 0; v < n; ++v)
      if (!back[v]) next.seeds.put(v, all.vertices()[v].x, all.vertices()[v].place);
    measure(next);
    std::vector<char> worse(n, 0);
    parallel_each(n, [&](std::size_t k) {
      const Index v = static_cast<Index>(k), curve = now_.seeds.place(v).curve;
      worse[v] = next.kinds[v] != now_.kinds[v] || !worst_excess(next, v).within(worst_excess(now_, v)) ||
                 (curve != kNone && newly_broken(next, curve));
      if (const Index corner = now_.seeds.place(v).corner; corner != kNone && has_curves())
        for (const Index c : curves_between_.at_corner(corner)) worse[v] |= newly_broken(next, c);
    });
    bool changed = false;
    for (Index v = 0; v < n; ++v) {
      if (!worse[v]) continue;
      const auto put_back = [&](Index w) {
        changed |= !back[w];
        back[w] = 1;
      };
      put_back(v);
      for (const Snapshot* s : {static_cast<const Snapshot*>(&now_), static_cast<const Snapshot*>(&next)})
        std::for_each(s->rings.begin(v), s->rings.end(v), put_back);
      // The seed that spoilt the star may be one across a thin wall, which is no neighbour.
      if (next.kinds[v] == now_.kinds[v]) continue;
      double reach = 0;
      for (const Index* j = now_.rings.begin(v); j != now_.rings.end(v); ++j)
        reach = std::max(reach, norm2(now_.seeds.position(*j) - now_.seeds.position(v)));
      for (const Index w : seeds_within(now_.seeds.position(v), reach)) put_back(w);
    }
    if (changed) continue;
    if (as_good(next) && next.average < now_.average) accept(std::move(next));
    return;
  }
}

// Seeds on the surface without a triangle are no vertices of the mesh.
void Improver::drop_idle() {
  std::vector<char> idle(now_.seeds.size(), 0);
  for (std::size_t v = 0; v < idle.size(); ++v) idle[v] = now_.seeds.on_surface(v) && now_.stars.size(v) == 0;
  if (std::find(idle.begin(), idle.end(), 1) == idle.end()) return;
  Snapshot next;
  next.seeds = now_.seeds;
  next.seeds.remove(idle);
  measure(next);
  if (as_good(next)) accept(std::move(next));
}

void Improver::hand_over() {
  if (polygons_are_current_) {
    now_.known.diagram.polygons = std::move(polygons_);
    now_.known.diagram.has = parts();
  }
  run_.adopt(std::move(now_.seeds), std::move(now_.known));
}

void Improver::take(PlacedSeeds seeds, DiagramOfSeeds known) {
  Snapshot taken;
  taken.seeds = std::move(seeds);
  taken.known = std::move(known);
  measure(taken);
  accept(std::move(taken));
}

void Improver::begin_part() {
  tried_.assign(now_.seeds.size(), 0);
  if (part_ == Part::no_bad_angles) searches_left_ = kMostSearches + now_.seeds.size() / kSeedsPerSearch;
  if (part_ != Part::better) return;
  poor_left_ = kPoorTried + now_.seeds.size() / kPoorShare;
  smooth();
}

// Whether another may help.
bool Improver::round() {
  const auto report = [&](const char* phase) {
    run_.context().report({phase, round_ + 1, kBatches, now_.moments().energy, 0, 1});
  };
  switch (part_) {
    case Part::better: report("improving"); return batch(Aim::better).made > 0;
    case Part::no_bad_angles: report("bad angles"); return batch(Aim::no_bad_angles).tried > 0;
    case Part::count: break;
  }
  if (now_.seeds.size() != wanted()) batch(now_.seeds.size() > wanted() ? Aim::fewer : Aim::more);
  return now_.seeds.size() != wanted();
}

std::string Improver::state() const {
  ByteWriter out;
  write_seeds(now_.seeds, out);
  out.put_all(tried_).put(poor_left_).put(searches_left_).put(report_);
  return out.put(part_).put(round_).put(first_average_).take();
}

bool Improver::go_on() {
  const std::optional<std::string> kept = saved_.state();
  if (!kept) return false;
  ByteReader in(*kept);
  PlacedSeeds seeds = read_seeds(run_.curves(), in);
  in.get_all(tried_);
  in.get(poor_left_);
  in.get(searches_left_);
  in.get(report_);
  in.get(part_);
  in.get(round_);
  in.get(first_average_);
  in.end();
  if (tried_.size() != seeds.size()) throw Error("the checkpoint's quality pass has other seeds than marks");
  take(std::move(seeds));
  return true;
}

// A run that is cancelled within a round can go on from before it.
void Improver::rounds() {
  for (;;) {
    for (; round_ < kBatches; ++round_) {
      const std::string before = saved_.is_kept() ? state() : std::string();
      if (saved_.state_is_due()) saved_.keep_state(before);
      try {
        if (!round()) break;
      } catch (const Cancelled&) {
        saved_.keep_state(before);
        throw;
      }
    }
    if (part_ == Part::count) return;
    part_ = static_cast<Part>(static_cast<int>(part_) + 1);
    round_ = 0;
    begin_part();
  }
}

ImproveReport Improver::run() {
  if (!go_on()) {
    take(run_.seeds, run_.take_diagram(parts()));
    if (now_.dual().triangles.empty()) {
      hand_over();
      return report_;
    }
    drop_idle();
    first_average_ = now_.average;
    begin_part();
  }
  rounds();
  if (report_.made > 0) smooth();
  if (now_.average > first_average_) {
    take(run_.seeds);
    report_ = {report_.trials, 0, 0, 0, 0};
  }

  for (const ShapeExcess& excess : now_.excess) report_.missed += excess.most() > 0;
  hand_over();
  complete(run_, true);
  return report_;
}

}  // namespace

ImproveReport improve(CvtRun& run, const FeatureTrace& trace, const ImproveOptions& options) {
  SavedStep saved(run, options.min_angle, options.max_angle, options.vertices);
  ImproveReport report;
  if (const std::optional<std::string> known = saved.restore()) {
    ByteReader(*known).get(report);
    return report;
  }
  report = Improver(run, trace, options, saved).run();
  saved.keep(ByteWriter().put(report).take());
  return report;
}

}  // namespace bisector
