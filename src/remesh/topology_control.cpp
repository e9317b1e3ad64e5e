#include "remesh/topology_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <utility>

#include "backend/project.h"
#include "core/parallel.h"
#include "cvt/optimise_around.h"
#include "remesh/sheets.h"
#include "spatial/nearest.h"
#include "voronoi/dual.h"
#include "voronoi/polygons.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Rounds of inserting seeds: with an optimisation of so many steps after each (thesis 4.4.4), while more than one cell
// in kTooFew fails; then without. Every kFarRounds-th round of the latter inserts far points.
constexpr int kGrowingRounds = 12, kGrowingSteps = 30, kRefiningRounds = 80, kFarRounds = 3;
// Refining ends if so many rounds in a row have not led to fewer failures. Towards a hole of a hundredth of an edge the
// distances of seeds are halved seven times, in two or three rounds each, and more and more cells fail until the last.
constexpr int kPatience = 24;
constexpr std::size_t kTooFew = 8;
// Refining has no end if there are so many times the failures of the beginning, and kMostAdded more.
constexpr std::size_t kDivergence = 2;
// Trials of removing seeds elsewhere, and the share of the seeds (one in so many) beyond which that is not tried.
constexpr int kTrims = 8;
constexpr std::size_t kMostTrimmed = 8;
// Where a surface may have no such mesh at all, no more is inserted after so many steps of the whole run.
constexpr int kMostFutileSteps = 70;
// Steps of the optimiser once the property holds; rounds of Lloyd's steps, and steps of each; and how often seeds go
// back for the property.
constexpr int kPolishingSteps = 20, kSmoothingRounds = 5, kSmoothingSteps = 4, kRetreats = 12;
// Seeds that may be added: a quarter of them and kMostAdded. A surface may need more than were asked for: so many are
// allowed to grow to, and in the end.
constexpr std::size_t kMostAdded = 100, kGrown = 300, kAnyway = 5000;
// Of the seeds that there were, one in so many: how many more stay if the property cannot be had.
constexpr std::size_t kFewInVain = 100;
// Of a cell's radius: sheets nearer to each other get a vertex each. More of them if fewer do not help.
constexpr double kCrossing = 0.01, kTouching = 0.1;
// Squared distance of points inserted together, over that to the seeds there are.
constexpr double kApart = 2;
// Times that refining goes on once its seeds are on the surface, and that a seed is moved off the curves at a corner.
constexpr int kFinishingRounds = 3, kShells = 3;
// Cosine of the angle at which a surface faces away.
constexpr double kTurned = -0.2;

// A point, and the square of its distance to the nearest seed.
struct Place {
  Vec3 point;
  double squared;
};

// A place to insert a seed at. Where its cell would reach a feature curve there, the other point may be better, or a
// corner of what fails.
struct Candidate {
  Place place;
  Vec3 other;
  std::vector<Vec3> corners;

  const Vec3& farthest_from(const Vec3& p) const {
    return *std::max_element(corners.begin(), corners.end(),
                             [&](const Vec3& a, const Vec3& b) { return norm2(a - p) < norm2(b - p); });
  }
};

// Nearest and farthest points of some part of a cell from its seed, and the corners of that part.
struct Extremes {
  Place nearest{{}, kInfinity}, farthest{{}, -1};
  std::vector<Vec3> corners;

  void near(const Vec3& p, const Vec3& seed) {
    if (const double d = norm2(p - seed); d < nearest.squared) nearest = {p, d};
  }
  void far(const Vec3& p, const Vec3& seed) {
    if (const double d = norm2(p - seed); d > farthest.squared) farthest = {p, d};
    corners.push_back(p);
  }
  void add(const Extremes& x) {
    if (x.nearest.squared < nearest.squared) nearest = x.nearest;
    if (x.farthest.squared > farthest.squared) farthest = x.farthest;
    corners.insert(corners.end(), x.corners.begin(), x.corners.end());
  }
};

// Points of the diagram where another seed would mend a failure: the nearest to the seed of what is to be split off,
// which on a thin part is opposite to it, so that the bisector runs between the sides; or, on demand, the farthest from
// the seeds there are, as in Delaunay refinement, which spreads seeds evenly and so ends.
class Repair {
 public:
  Repair(const Surface& surface, const RestrictedPolygons& polygons, const std::vector<Vec3>& seeds, bool far)
      : surface_(surface), polygons_(polygons), seeds_(seeds), far_(far) {}

  std::vector<Candidate> points(const BallReport& report) {
    for (const BallReport::Cell& c : report.cells) split_parts(c);
    for (const BallReport::Cell& c : report.cells) open_up(c);
    for (const BallReport::Edge& e : report.edges) cut(e);
    for (const BallReport::Vertex& v : report.vertices) separate(v);
    return thinned();
  }

 private:
  std::size_t next(std::size_t polygon, std::size_t entry) const {
    return entry + 1 == polygons_.offsets[polygon + 1] ? polygons_.offsets[polygon] : entry + 1;
  }
  std::size_t polygon_with(std::size_t entry) const {
    const auto after = std::upper_bound(polygons_.offsets.begin(), polygons_.offsets.end(), entry);
    return static_cast<std::size_t>(after - polygons_.offsets.begin()) - 1;
  }
  const Vec3& normal(std::size_t polygon) const {
    return surface_.facets[surface_.facet_of[polygons_.pairs[polygon].triangle]].normal;
  }

  Extremes extremes_of_polygon(std::size_t p, const Vec3& seed) const {
    Extremes x;
    const std::size_t first = polygons_.offsets[p], end = polygons_.offsets[p + 1];
    for (std::size_t e = first; e < end; ++e) x.far(polygons_.vertices[e], seed);
    x.near(nearest_on_polygon(polygons_, p, seed), seed);
    return x;
  }

  Extremes extremes(const std::vector<std::size_t>& polygons, const Vec3& seed) const {
    Extremes all;
    for (const std::size_t p : polygons) all.add(extremes_of_polygon(p, seed));
    return all;
  }

  // Of entries: their edges.
  Extremes extremes_of_edges(const std::vector<std::size_t>& entries, const Vec3& seed) const {
    Extremes x;
    for (const std::size_t e : entries) {
      const Vec3 &a = polygons_.vertices[e], &b = polygons_.vertices[next(polygon_with(e), e)];
      x.near(nearest_on_triangle(seed, a, b, b), seed);
      x.far(a, seed);
      x.far(b, seed);
    }
    return x;
  }

  void add(const Place& place, const Place& other, std::vector<Vec3> corners) {
    if (place.squared > 0 && place.squared < kInfinity) candidates_.push_back({place, other.point, std::move(corners)});
  }
  void add(const Place& place) { add(place, place, {place.point}); }
  void add(const Extremes& x) { far_ ? add(x.farthest, x.nearest, x.corners) : add(x.nearest, x.farthest, x.corners); }

  // All of the groups but that nearest to the seed.
  void add_others(const std::vector<Extremes>& groups) {
    const auto own = std::min_element(groups.begin(), groups.end(), [](const Extremes& a, const Extremes& b) {
      return a.nearest.squared < b.nearest.squared;
    });
    for (auto group = groups.begin(); group != groups.end(); ++group)
      if (group != own) add(*group);
  }

  void split_parts(const BallReport::Cell& c) {
    std::vector<Extremes> parts;
    for (const auto& part : c.parts) parts.push_back(extremes(part, seeds_[c.seed]));
    add_others(parts);
  }

  // A cell with a part that is not a disk: where it faces away from the seed's side, as on the back of a limb, else the
  // far points of its loops, else its farthest point.
  void open_up(const BallReport::Cell& c) {
    const bool disks = c.euler == static_cast<long long>(c.components) && c.loops == c.components;
    if (disks && c.components > 1) return;
    const Vec3& seed = seeds_[c.seed];
    double best = kInfinity;
    Vec3 facing;
    for (const auto& part : c.parts)
      for (const std::size_t p : part)
        if (const double d = extremes_of_polygon(p, seed).nearest.squared; d < best) {
          best = d;
          facing = normal(p);
        }
    Extremes away, all;
    for (const auto& part : c.parts)
      for (const std::size_t p : part) {
        const Extremes x = extremes_of_polygon(p, seed);
        if (x.farthest.squared > all.farthest.squared) all.farthest = x.farthest;
        if (dot(normal(p), facing) < kTurned) away.add(x);
      }
    if (away.farthest.squared >= 0) return add(away);
    if (c.loops > 1)
      for (const auto& loop : c.loop_parts) add(extremes_of_edges(loop, seed).farthest);
    add(all.farthest);
  }

  void cut(const BallReport::Edge& e) {
    std::vector<Extremes> parts;
    for (const auto& part : e.parts) parts.push_back(extremes_of_edges(part, seeds_[e.a]));
    if (parts.size() == 1) add(parts[0].farthest);
    add_others(parts);
  }

  void separate(const BallReport::Vertex& v) {
    std::vector<Extremes> places;
    for (const std::size_t e : v.places) {
      places.emplace_back();
      places.back().near(polygons_.vertices[e], seeds_[v.seeds[0]]);
      places.back().far(polygons_.vertices[e], seeds_[v.seeds[0]]);
    }
    add_others(places);
  }

  // No two nearer to each other than to the seeds there are, as if each were inserted before the next is looked for.
  std::vector<Candidate> thinned() const {
    std::vector<Candidate> kept;
    for (const Candidate& c : candidates_)
      if (std::all_of(kept.begin(), kept.end(), [&, p = c.place](const Candidate& k) {
            return norm2(k.place.point - p.point) >= kApart * p.squared;
          }))
        kept.push_back(c);
    return kept;
  }

  const Surface& surface_;
  const RestrictedPolygons& polygons_;
  const std::vector<Vec3>& seeds_;
  bool far_;
  std::vector<Candidate> candidates_;
};

// Seeds of the failing cells, edges and vertices.
std::vector<char> failing_seeds(const BallReport& report, std::size_t count) {
  std::vector<char> failing(count, 0);
  for (const auto& c : report.cells) failing[c.seed] = 1;
  for (const auto& e : report.edges) failing[e.a] = failing[e.b] = 1;
  for (const auto& v : report.vertices)
    for (Index i : v.seeds) failing[i] = 1;
  return failing;
}

class Control {
 public:
  Control(CvtRun& run, const FeatureTrace& trace, bool is_sound, const TopologyControlOptions& control,
          OptimiseOptions options)
      : run_(run), trace_(trace), is_sound_(is_sound), control_(control),
        most_work_(is_sound ? kInfinity : run.totals.work + kMostFutileSteps * run.step_work()),
        options_(std::move(options)), wanted_(run.seeds.size()), given_(wanted_), most_(std::max(budget(), kGrown)),
        lost_(run.curves().size(), 0) {
    options_.done = 1;
    options_.share = 0;
  }

  TopologyOutcome run() {
    check();
    for (const Cut& cut : cuts_) lost_[cut.curve] = 1;
    cuts_.clear();
    keep_best();
    if (!holds()) {
      const SavedSeeds given = best_;
      const SeedsBefore before = seeds_before(run_);
      grow();
      const SavedSeeds start = best_;
      most_ = budget();
      for (const double gap : {kCrossing, kTouching, kInfinity}) {
        restore(start);
        gap_ = gap;
        if (gap == kInfinity) most_ = std::max(budget(), kAnyway);
        has_most_ = false;
        check();
        keep_best();
        if (refine() || has_worked_enough() || !is_sound_) break;
        if (!best_.has_parts && !has_most_) break;  // there is nothing to divide, whatever the gap
      }
      if (holds()) {
        trim();
        polish(before);
        smooth(before);
      } else {
        // More seeds are worth nothing where too many cells fail in any case, or sheets are joined as none can show.
        const bool in_vain = best_has_too_few_ || !is_sound_;
        restore(in_vain || is_surplus(best_.seeds.size(), given.seeds.size()) ? given : best_);
        if (!in_vain && !spans_surface()) restore(best_);
      }
      finish();
    }
    return std::move(outcome_);
  }

 private:
  // Seeds to come back to.
  struct SavedSeeds {
    PlacedSeeds seeds;
    std::size_t given = 0;
    double gap = kCrossing;
    bool has_parts = false;  // a cell that fails has several components
  };

  // Where the cell of a seed on the surface cuts a curve.
  struct Cut {
    Index cell, curve;
    double position;
  };

  // The ball property, and no curve is cut that was not at the beginning.
  bool holds() const { return outcome_.ball.holds && cuts_.empty(); }
  std::size_t failures() const { return outcome_.ball.failures() + cuts_.size(); }

  // Seeds that may be added before sheets are taken for what keeps the property from holding.
  std::size_t budget() const { return wanted_ + std::max(wanted_ / 4 + kMostAdded, std::min(wanted_, kAnyway)); }

  // Checks the diagram of the seeds, with the cells of sheets that touch divided.
  void check() {
    run_.context().check();
    run_.add_work(1);
    cuts_ = find_cuts();
    outcome_.ball = check_ball_property(run_.surface(), run_.diagram(parts_).polygons);
    // Only what has to be mended is asked where it is.
    if (!holds()) parts_ = Want::polygons;
    polygons_ = &run_.diagram(parts_).polygons;
    vertices_ = run_.seeds.positions();
    if (!outcome_.ball.holds && (!too_few_seeds() || gap_ == kInfinity)) divide();
    outcome_.gap = gap_;
    outcome_.sheets.assign(vertices_.begin() + static_cast<std::ptrdiff_t>(run_.seeds.size()), vertices_.end());
  }

  void divide() {
    RestrictedPolygons divided = *polygons_;
    if (!divide_cells(run_.surface(), outcome_.ball, gap_, divided, vertices_)) return;
    divided_ = std::move(divided);
    polygons_ = &divided_;
    outcome_.ball = check_ball_property(run_.surface(), divided_);
  }

  bool has_worked_enough() const { return run_.totals.work > most_work_; }

  // Without the property the count is to be met, for what is inserted is not evened out. Walls of solids are finished
  // by others.
  bool is_surplus(std::size_t seeds, std::size_t given) const {
    return !control_.branches && seeds > given + given / kFewInVain;
  }

  // A strip has about as many triangles as vertices. Along a needle the cells of too few seeds are rings in a row,
  // which have none.
  bool spans_surface() { return run_.diagram(Want::dual).dual.triangles.size() >= run_.seeds.size(); }

  // Whether so many cells fail that they are not to be mended one by one.
  bool too_few_seeds() const { return kTooFew * outcome_.ball.cells.size() > run_.seeds.size(); }

  bool insert(bool far) {
    const std::vector<Candidate> points = Repair(run_.surface(), *polygons_, vertices_, far).points(outcome_.ball);
    if (points.empty() && cuts_.empty()) return false;
    if (run_.seeds.size() + points.size() + cuts_.size() > most_) {
      has_most_ = true;
      return false;
    }
    const std::size_t before = run_.seeds.size();
    for (const Candidate& c : points) run_.seeds.add(c.place.point);
    for (const Cut& cut : cuts_) {
      run_.seeds.add(Vec3{});
      put_on_curve(run_.seeds.size() - 1, cut);
    }
    if (run_.has_features()) keep_off_curves(before, points);
    outcome_.inserted += run_.seeds.size() - before;
    ++outcome_.rounds;
    return true;
  }

  // Seeds from `first` on are new, at these points. Those whose cells cut a curve go to their other points, or, if they
  // do so there as well, to the corners farthest from there, or at last on the curve. Else the edges of two curves at a
  // corner of a thin plate would be halved again and again, for the middle between their first seeds is nearer to the
  // curves than to these.
  void keep_off_curves(std::size_t first, const std::vector<Candidate>& points) {
    const auto cuts_of_new = [&] {
      std::vector<Cut> cuts = find_cuts();
      std::erase_if(cuts, [&](const Cut& cut) { return cut.cell < first; });
      return cuts;
    };
    const std::vector<Cut> cuts = cuts_of_new();
    if (cuts.empty()) return;
    const auto move_to = [&](const Cut& cut, const Vec3& p) { run_.seeds.edit_positions()[cut.cell] = p; };
    for (const Cut& cut : cuts) move_to(cut, points[cut.cell - first].other);
    for (const Cut& cut : cuts_of_new())
      move_to(cut, points[cut.cell - first].farthest_from(run_.curves().point(cut.curve, cut.position)));
    if (is_sound_) {
      for (const Cut& cut : cuts_of_new()) move_to(cut, points[cut.cell - first].place.point);
      for (int round = 0; round < kShells; ++round) {
        std::map<Index, Cut> left;  // the first of each cell
        for (const Cut& cut : cuts_of_new()) left.insert({cut.cell, cut});
        if (left.empty()) return;
        for (const auto& [cell, cut] : left) {
          const Place& place = points[cell - first].place;
          const Vec3 p = beside_next_on_curve(cut);
          // Too far away, it would not own the place for which it is.
          if (norm2(p - place.point) < place.squared) move_to(cut, p);
          else put_on_curve(cell, cut);
        }
      }
    }
    for (const Cut& cut : cuts_of_new()) put_on_curve(cut.cell, cut);
  }

  // For a seed whose cell cuts a curve between a corner and the curve's next seed: the point in its direction that is
  // as far from the corner as that seed. From there it leaves a straight curve alone at whatever angle; at the tip of a
  // needle no nearer point does. Elsewhere where the seed is.
  Vec3 beside_next_on_curve(const Cut& cut) {
    const Vec3 p = run_.seeds.position(cut.cell);
    const FeatureCurves& curves = run_.curves();
    if (curves.closed(cut.curve)) return p;
    const double length = curves.length(cut.curve);
    const bool at_start = cut.position < 0.5 * length;
    const auto from_end = [&](double position) { return at_start ? position : length - position; };
    const auto [start, end] = curves.ends(cut.curve);
    Vec3 next = curves.corner(at_start ? end : start);
    double least = length;
    for (std::size_t i = 0; i < run_.seeds.size(); ++i)
      if (const SeedPlace& place = run_.seeds.place(i);
          !run_.seeds.on_surface(i) && place.curve == cut.curve && from_end(place.position) < least) {
        least = from_end(place.position);
        next = run_.seeds.position(i);
      }
    if (from_end(cut.position) > least) return p;
    const Vec3 corner = curves.corner(at_start ? start : end), along = p - corner;
    if (!(norm2(along) > 0)) return p;
    if (!nearest_) nearest_ = std::make_unique<NearestOnMesh>(run_.surface().mesh);
    return nearest_->nearest(corner + (norm(next - corner) / norm(along)) * along).point;
  }

  void put_on_curve(std::size_t seed, const Cut& cut) {
    run_.seeds.put(seed, run_.curves().point(cut.curve, cut.position),
                   {SeedPlace::Kind::curve, cut.curve, kNone, cut.position});
  }

  // By curve; a cell once for each.
  std::vector<Cut> find_cuts() {
    std::vector<Cut> cuts;
    if (!run_.has_features()) return cuts;
    const FeatureCurves& curves = run_.curves();
    const std::vector<std::vector<CurveInterval>> traces = trace_.trace(run_.diagram(run_.traced()).polygons);
    for (Index c = 0; c < traces.size(); ++c) {
      if (lost_[c]) continue;
      std::map<Index, CurveInterval> longest;
      for (const CurveInterval& i : traces[c]) {
        if (!run_.seeds.on_surface(i.cell)) continue;
        const auto [at, fresh] = longest.insert({i.cell, i});
        if (!fresh && i.to - i.from > at->second.to - at->second.from) at->second = i;
      }
      for (const auto& [cell, i] : longest) cuts.push_back({cell, c, curves.wrap(c, 0.5 * (i.from + i.to))});
    }
    return cuts;
  }

  void optimise_again(int steps) {
    options_.iterations = steps;
    options_.phase = fmt::format("topology, round {}", outcome_.rounds);
    optimise(run_, options_);
    check();
  }

  void grow() {
    for (int round = 0; round < kGrowingRounds && too_few_seeds() && !has_worked_enough() && insert(false); ++round) {
      given_ = wanted_ = run_.seeds.size();
      optimise_again(kGrowingSteps);
      keep_best();
    }
  }

  // Where sheets cross there is no end to refining: more and more cells fail.
  bool refine() {
    std::size_t least = failures();
    const std::size_t hopeless = kDivergence * least + kMostAdded;
    for (int round = 0, idle = 0; round < kRefiningRounds && idle < kPatience && !holds(); ++round, ++idle) {
      if (failures() > hopeless || has_worked_enough() || !insert(round % kFarRounds == kFarRounds - 1)) break;
      check();
      keep_best();
      if (failures() >= least) continue;
      least = failures();
      idle = 0;
    }
    return holds();
  }

  // Back to the number of seeds asked for, at the cost of places where the energy can spare them.
  void trim() {
    for (int trial = 0; trial < kTrims; ++trial) {
      const std::size_t surplus = vertices_.size() - std::min(vertices_.size(), wanted_);
      if (surplus == 0 || kMostTrimmed * surplus > wanted_) break;
      const std::vector<Index> spared = spared_seeds(surplus);
      given_ -= spared.size();
      outcome_.removed += spared.size();
      run_.seeds.remove(spared);
      check();
      keep_best();
      if (!refine()) break;
    }
    restore(best_);
  }

  // Free seeds of the lowest energy, no two of them neighbours, away from those that were inserted; ascending.
  std::vector<Index> spared_seeds(std::size_t count) {
    const std::vector<DualEdge> edges = extract_dual_edges(*polygons_, vertices_);
    std::vector<char> blocked(vertices_.size(), 0);
    std::fill(blocked.begin() + static_cast<std::ptrdiff_t>(given_), blocked.end(), char{1});
    for (int ring = 0; ring < 2; ++ring) mark_neighbours(edges, blocked);
    std::vector<std::vector<Index>> around(vertices_.size());
    for (const DualEdge& e : edges) {
      around[e.a].push_back(e.b);
      around[e.b].push_back(e.a);
    }
    const std::vector<Moments>& cells = run_.diagram().moments.cells;
    std::vector<Index> order(given_);
    std::iota(order.begin(), order.end(), Index{0});
    std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return cells[a].second < cells[b].second; });
    std::vector<Index> spared;
    for (Index i : order) {
      if (spared.size() == count) break;
      if (blocked[i] || !run_.seeds.on_surface(i)) continue;
      spared.push_back(i);
      for (Index j : around[i]) blocked[j] = 1;
    }
    std::sort(spared.begin(), spared.end());
    return spared;
  }

  // Of two states that hold, the one with fewer vertices is better; as long as too many cells fail, the later.
  void keep_best() {
    const std::size_t count = failures();
    const std::size_t surplus = vertices_.size() - std::min(vertices_.size(), wanted_);
    const bool better = count != fewest_ ? count < fewest_ : count == 0 && surplus < least_surplus_;
    if (!best_has_too_few_ && (too_few_seeds() || !better)) return;
    best_has_too_few_ = too_few_seeds();
    fewest_ = count;
    least_surplus_ = surplus;
    const bool has_parts = std::any_of(outcome_.ball.cells.begin(), outcome_.ball.cells.end(),
                                       [](const BallReport::Cell& cell) { return cell.components > 1; });
    best_ = {run_.seeds, given_, gap_, has_parts};
  }

  void restore(const SavedSeeds& saved) {
    run_.seeds = saved.seeds;
    given_ = saved.given;
    gap_ = saved.gap;
    check();
  }

  // Seeds of what fails, and their neighbours.
  std::vector<char> failing_neighbourhood() const {
    std::vector<char> failing = failing_seeds(outcome_.ball, vertices_.size());
    for (const Cut& cut : cuts_) failing[cut.cell] = 1;
    mark_neighbours(extract_dual_edges(*polygons_, vertices_), failing);
    failing.resize(run_.seeds.size());
    return failing;
  }

  // Moves the seeds that are not held as far as the property goes on holding: where it would not, seeds go back, and
  // are held from then on. False, and nothing is moved, if that does not help.
  bool move(const PlacedSeeds& before, const std::vector<Vec3>& next, std::vector<char>& held) {
    run_.seeds = before;
    for (int retreat = 0; retreat <= kRetreats; ++retreat) {
      const std::span<Vec3> positions = run_.seeds.edit_positions();
      for (std::size_t i = 0; i < next.size(); ++i) positions[i] = held[i] ? before.position(i) : next[i];
      check();
      if (holds()) return true;
      const std::vector<char> failing = failing_neighbourhood();
      bool holds_more = false;
      for (std::size_t i = 0; i < held.size(); ++i)
        if (failing[i] && !std::exchange(held[i], 1)) holds_more = true;
      if (!holds_more) break;
    }
    run_.seeds = before;
    check();
    return false;
  }

  std::vector<char> held_seeds() const {
    std::vector<char> held(run_.seeds.size());
    for (std::size_t i = 0; i < held.size(); ++i) held[i] = !run_.seeds.on_surface(i);
    return held;
  }

  // The optimiser's steps.
  void polish(const SeedsBefore& given) {
    const PlacedSeeds before = run_.seeds;
    options_.iterations = kPolishingSteps;
    options_.phase = "topology, polishing";
    if (control_.polish_around) optimise_around(run_, given, options_, control_.stand_in);
    else optimise_with_stand_in(run_, control_.stand_in, options_);
    const std::vector<Vec3> next = run_.seeds.positions();
    std::vector<char> held = held_seeds();
    move(before, next, held);
  }

  // Lloyd's steps around what has changed, for they move a seed by its own cell alone.
  void smooth(const SeedsBefore& given) {
    std::vector<char> held = held_seeds();
    for (int round = 0; round < kSmoothingRounds; ++round) {
      const PlacedSeeds before = run_.seeds;
      move_around(run_, given,
                  [&](CvtRun& part, const std::vector<Index>& seeds) { step_to_centroids(part, seeds, held); });
      const std::vector<Vec3> next = run_.seeds.positions();
      if (next == before.positions() || !move(before, next, held)) return;
    }
  }

  // Of the part's seeds, which are these of the run, those that are not held.
  void step_to_centroids(CvtRun& part, const std::vector<Index>& seeds, const std::vector<char>& held) {
    for (int step = 0; step < kSmoothingSteps; ++step) {
      part.context().check();
      part.add_work(1);
      const CellMoments& moments = part.diagram(options_.constrained ? Want::triangles : Want::moments).moments;
      std::vector<Vec3> next = part.seeds.positions(), normals(next.size());
      for (std::size_t i = 0; i < next.size(); ++i)
        if (const Moments& m = moments.cells[i]; m.mass > 0) next[i] += (1 / m.mass) * m.first;
      if (options_.constrained) project_to_cells(part.surface(), moments.triangles, {}, next, normals);
      const std::span<Vec3> positions = part.seeds.edit_positions();
      for (std::size_t i = 0; i < next.size(); ++i)
        if (part.seeds.on_surface(i) && !held[seeds[i]]) positions[i] = next[i];
    }
  }

  // Leaves the run as the optimiser does, with its energy and gradient, for seeds that the optimiser did not place. It
  // puts seeds on the surface again, which in a tie may fail by rounding what held.
  void finish() {
    const bool held = holds();
    put_on_surface();
    for (int round = 0; round < kFinishingRounds && held && !holds() && refine(); ++round) put_on_surface();
  }

  void put_on_surface() {
    options_.iterations = 0;
    optimise(run_, options_);
    check();
  }

  CvtRun& run_;
  const FeatureTrace& trace_;
  const bool is_sound_;  // the input is a manifold and oriented, or branches on purpose
  const TopologyControlOptions control_;
  const double most_work_;  // of the run
  OptimiseOptions options_;
  std::size_t wanted_;      // vertices
  std::size_t given_;       // seeds before those inserted by refining
  std::size_t most_;        // seeds
  double gap_ = kCrossing;  // see divide_cells
  bool has_most_ = false;   // as many seeds as may be were not enough
  TopologyOutcome outcome_;
  std::vector<Cut> cuts_;
  std::vector<char> lost_;                        // by curve: cut at the beginning, and so left as it is
  Want parts_ = Want::labels;                     // of a diagram
  std::unique_ptr<NearestOnMesh> nearest_;        // once asked for
  const RestrictedPolygons* polygons_ = nullptr;  // of the run's diagram, or divided_
  RestrictedPolygons divided_;
  std::vector<Vec3> vertices_;  // the seeds, and the points of sheets of divided cells
  SavedSeeds best_;
  std::size_t fewest_ = 0;  // failures of the best seeds
  std::size_t least_surplus_ = 0;
  bool best_has_too_few_ = true;  // too many cells of the best seeds fail
};

}  // namespace

TriangleMesh dual_mesh(const std::vector<Vec3>& seeds, const Dual& dual, const std::vector<Index>& vertex_of) {
  TriangleMesh mesh;
  for (std::size_t v = 0; v < seeds.size(); ++v)
    if (vertex_of[v] != kNone) mesh.vertices.push_back(seeds[v]);
  mesh.triangles.resize(dual.triangles.size());
  parallel_each(dual.triangles.size(), [&](std::size_t t) {
    for (std::size_t k = 0; k < 3; ++k) mesh.triangles[t][k] = vertex_of[dual.triangles[t][k]];
  });
  return mesh;
}

TriangleMesh dual_mesh(const std::vector<Vec3>& seeds, const Dual& dual) {
  return dual_mesh(seeds, dual, dual_vertices(dual, seeds.size()));
}

bool same_topology(const MeshTopology& dual, const MeshTopology& input) {
  return dual.manifold == input.manifold && dual.oriented == input.oriented && dual.closed == input.closed &&
         dual.euler == input.euler && dual.components == input.components;
}

std::vector<TopologyFault> topology_faults(const BallReport& report, const std::vector<Vec3>& seeds) {
  std::vector<TopologyFault> faults;
  for (const BallReport::Cell& c : report.cells)
    faults.push_back(
        {{c.seed},
         seeds[c.seed],
         fmt::format("cell of {} components and Euler characteristic {}, with {} loops and {} parts of the border",
                     c.components, c.euler, c.loops, c.border_parts)});
  for (const BallReport::Edge& e : report.edges)
    faults.push_back({{e.a, e.b},
                      seeds[e.a],
                      fmt::format("edge of {} components with {} ends, {} of them on the border", e.components, e.ends,
                                  e.border_points)});
  for (const BallReport::Vertex& v : report.vertices)
    faults.push_back({{v.seeds[0], v.seeds[1], v.seeds[2]},
                      seeds[v.seeds[0]],
                      fmt::format("three cells that meet in {} points", v.places.size())});
  return faults;
}

TopologyOutcome enforce_topology(CvtRun& run, const FeatureTrace& trace, const MeshTopology& input,
                                 OptimiseOptions options, const TopologyControlOptions& control) {
  const bool is_sound = control.branches || (input.manifold && input.oriented);
  return Control(run, trace, is_sound, control, std::move(options)).run();
}

}  // namespace bisector
