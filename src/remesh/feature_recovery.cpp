#include "remesh/feature_recovery.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "cvt/multilevel.h"
#include "cvt/optimise_around.h"
#include "voronoi/dual.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

// Rounds of mending, at most. The first keep to the number of seeds that a curve should have; all of kMovingRounds end
// with an optimisation, of kFirstSteps in the first to kLastSteps in the last; kInsertingRounds follow in which nothing
// moves. What comes next begins at once when a round leaves more than this share of the faults.
constexpr int kRelocatingRounds = 3, kMovingRounds = 8, kInsertingRounds = 20;
constexpr double kWorthARound = 0.75;
constexpr int kFirstSteps = 20, kLastSteps = 4;
// Steps after clearing curves at the end of a level.
constexpr int kClearingSteps = 20;
// Where links of a curve are divided so often in the rounds of inserting that it has so many times the faults, and no
// fewer than so many, its sheets are too near to each other for any.
constexpr std::size_t kDivided = 3, kLeastDivided = 8;
// Seeds that recovery may add, beside a quarter of those there are.
constexpr std::size_t kMostAdded = 100;
// Lengths of curve, in edges: what a cell must hold to be snapped to it; what is worth a seed, and in the last rounds;
// and links along a curve that are shorter are not divided.
constexpr double kRoomToSnap = 0.4, kSmallest = 0.05, kTiniest = 0.002, kShortLink = 0.5;
// Two curves from the same corner need protection where they are nearer than this, in edges; the shells of protecting
// seeds are at least kLeastStep edges apart, and so many at most.
constexpr double kAcute = 0.8, kLeastStep = 0.3;
constexpr std::size_t kMostShells = 1000;
// Of the stretch of a curve in a corner's cell: how near the curve passes the corner then.
constexpr double kPassing = 0.2;
// A cell that holds less is pushed away from the curve by this share of its seed's distance.
constexpr double kPush = 0.3;

// Triangles of the dual at each edge between seeds on features, as often as the diagram has them.
std::map<std::array<Index, 2>, Index> dual_edge_counts(const Dual& dual, const std::vector<SeedPlace>& places) {
  const auto placed = [&](Index seed) { return places[seed].kind != Kind::surface; };
  std::map<std::array<Index, 2>, Index> counts;
  for (std::size_t k = 0; k < dual.triangles.size(); ++k) {
    const Triangle& t = dual.triangles[k];
    for (int m = 0; m < 3; ++m) {
      const Index a = t[m], b = t[(m + 1) % 3];
      if (placed(a) && placed(b)) counts[{std::min(a, b), std::max(a, b)}] += dual.multiplicity[k];
    }
  }
  return counts;
}

// Whether a curve passes the corner of others so closely that the corner's seed may stand on it: two seeds as near to
// each other as that would make slivers.
bool passes_corner(const FeatureCurves& curves, const CurveInterval& interval, Index curve, const SeedPlace& place) {
  if (place.corner == kNone) return false;
  const Vec3 corner = curves.corner(place.corner);
  const double length = interval.to - interval.from, middle = curves.wrap(curve, 0.5 * (interval.from + interval.to));
  const Vec3 nearest = curves.point(curve, curves.nearest(curve, corner, middle, length));
  return norm(nearest - corner) <= kPassing * length;
}

// The first position, from the given end of an open curve, that lies `radius` away from the corner there.
double position_at_radius(const FeatureCurves& curves, Index curve, int end, double radius) {
  const Vec3 corner = curves.corner(curves.ends(curve)[end]);
  const std::size_t count = curves.segments(curve);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t s = end == 0 ? k : count - 1 - k;
    const Vec3 p = curves.point_of(curve, end == 0 ? s : s + 1), q = curves.point_of(curve, end == 0 ? s + 1 : s);
    if (norm(q - corner) < radius) continue;
    // |p + t (q - p) - corner| = radius
    const Vec3 d = q - p, e = p - corner;
    const double a = norm2(d), b = dot(d, e), c = norm2(e) - radius * radius;
    const double t = a > 0 ? std::clamp((-b + std::sqrt(std::max(0.0, b * b - a * c))) / a, 0.0, 1.0) : 0;
    const double from = curves.position_of(curve, s), to = curves.position_of(curve, s + 1);
    return end == 0 ? from + t * (to - from) : to - t * (to - from);
  }
  return end == 0 ? curves.length(curve) : 0;
}

// Where on the curve to meet a foreign seed: as far from the corner they share as that seed, else across from it; in
// the middle of the fault where that is elsewhere.
double meeting_position(const FeatureCurves& curves, const PlacedSeeds& seeds, const FeatureFault& fault) {
  const double middle = 0.5 * (fault.from + fault.to), length = fault.to - fault.from;
  if (fault.cell == kNone || seeds.place(fault.cell).curve == kNone) return middle;
  const Index foreign = seeds.place(fault.cell).curve;
  double position = middle, nearest = std::numeric_limits<double>::infinity();
  for (int end : {0, 1}) {
    const Index corner = curves.ends(fault.curve)[end];
    if (corner == kNone || (corner != curves.ends(foreign)[0] && corner != curves.ends(foreign)[1])) continue;
    const double radius = norm(seeds.position(fault.cell) - curves.corner(corner));
    if (radius > nearest) continue;
    nearest = radius;
    position = position_at_radius(curves, fault.curve, end, radius);
  }
  if (std::isinf(nearest))
    position = curves.nearest(fault.curve, seeds.position(fault.cell), curves.wrap(fault.curve, middle), 2 * length);
  return std::abs(position - middle) <= 2 * length ? position : middle;
}

// The seeds of each curve.
std::vector<std::vector<Index>> seeds_by_curve(const FeatureCurves& curves, const PlacedSeeds& seeds) {
  std::vector<std::vector<Index>> on(curves.size());
  for (Index i = 0; i < seeds.size(); ++i)
    if (seeds.place(i).curve != kNone) on[seeds.place(i).curve].push_back(i);
  return on;
}

// Puts the sliding ones of a curve's seeds at equal distances between those that are fixed.
void space_evenly(const FeatureCurves& curves, const CurveMeasure& measure, Index curve, const std::vector<Index>& on,
                  PlacedSeeds& seeds) {
  std::vector<std::pair<double, Index>> row;
  for (Index i : on) row.push_back({measure.at(curve, seeds.place(i).position), i});
  if (row.empty()) return;
  std::sort(row.begin(), row.end());
  const bool closed = curves.closed(curve);
  const double whole = measure.whole(curve);
  // Fixed points of the row: corners, protected seeds, and on a closed curve the first seed, before and after a lap.
  const auto fixed = [&](std::size_t k) { return seeds.kind(row[k].second) == Kind::fixed; };
  std::size_t first = 0;
  if (closed) {
    while (first < row.size() && !fixed(first)) ++first;
    if (first == row.size()) first = 0;
    std::rotate(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(first), row.end());
    for (auto& [at, seed] : row)
      if (at < row.front().first) at += whole;
    row.push_back({row.front().first + whole, kNone});
  } else {
    row.insert(row.begin(), {0.0, kNone});
    row.push_back({whole, kNone});
  }
  for (std::size_t a = 0; a + 1 < row.size();) {
    std::size_t b = a + 1;
    while (b + 1 < row.size() && !fixed(b)) ++b;
    for (std::size_t k = a + 1; k < b; ++k) {
      const double t = static_cast<double>(k - a) / static_cast<double>(b - a);
      const double at = row[a].first + t * (row[b].first - row[a].first);
      SeedPlace place = seeds.place(row[k].second);
      place.position = measure.position(curve, at >= whole ? at - whole : at);
      seeds.put(row[k].second, curves.point(curve, place.position), place);
    }
    a = b;
  }
}

// A curve at one of the corners that it ends in.
struct Arm {
  Index curve;
  int end;
  double reach = 0;               // length of the curve, from the corner on, in which it is protected
  std::vector<double> positions;  // of the seeds that protect it
};

// From the corner to a position on the arm.
double length_along(const FeatureCurves& curves, const Arm& arm, double position) {
  return arm.end == 0 ? position : curves.length(arm.curve) - position;
}

// Gives the arms of a corner positions at the same distances from it, shell by shell, as far as they stay close to each
// other.
void protect_arms(const FeatureCurves& curves, const CurveMeasure& measure, double c, std::vector<Arm>& arms) {
  // The edge length near the corner, by the first arm; shells must be the same for all.
  const double edge = measure.edge_length(arms[0].curve, arms[0].end == 0 ? 0 : curves.length(arms[0].curve), c);
  double radius = edge;
  for (std::size_t shell = 0; shell < kMostShells; ++shell) {
    std::vector<double> at(arms.size(), -1);
    for (std::size_t a = 0; a < arms.size(); ++a) {
      const double position = position_at_radius(curves, arms[a].curve, arms[a].end, radius);
      // The other half of a curve belongs to its other end.
      if (length_along(curves, arms[a], position) < 0.5 * curves.length(arms[a].curve)) at[a] = position;
    }
    std::vector<char> close(arms.size(), 0);
    double narrowest = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < arms.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        if (at[a] < 0 || at[b] < 0) continue;
        const double gap = norm(curves.point(arms[a].curve, at[a]) - curves.point(arms[b].curve, at[b]));
        if (gap >= kAcute * edge) continue;
        close[a] = close[b] = true;
        narrowest = std::min(narrowest, gap);
      }
    if (std::isinf(narrowest)) return;
    for (std::size_t a = 0; a < arms.size(); ++a) {
      // An arm is protected from the corner on, without gaps.
      if (!close[a] || arms[a].positions.size() < shell) continue;
      arms[a].positions.push_back(at[a]);
      arms[a].reach = length_along(curves, arms[a], at[a]) + 0.5 * edge;
    }
    // Between close curves triangles are as large as the gap, if that is not too small.
    radius += std::clamp(narrowest, kLeastStep * edge, edge);
  }
}

// Where curves leave a corner close to each other, gives them fixed seeds at the same distances from it, as far as they
// stay close, in place of those that they have there.
void protect_acute_corners(const FeatureCurves& curves, const CurveMeasure& measure, double c, PlacedSeeds& seeds) {
  std::vector<std::vector<Arm>> corners(curves.graph().corners.size());
  for (Index k = 0; k < curves.size(); ++k)
    for (int end : {0, 1})
      if (!curves.closed(k)) corners[curves.ends(k)[end]].push_back({k, end, 0, {}});
  std::vector<std::pair<Index, double>> protected_places;
  std::vector<std::vector<std::array<double, 2>>> zones(curves.size());
  for (std::vector<Arm>& arms : corners) {
    if (arms.size() < 2) continue;
    protect_arms(curves, measure, c, arms);
    for (const Arm& arm : arms) {
      if (arm.positions.empty()) continue;
      const double length = curves.length(arm.curve);
      zones[arm.curve].push_back(arm.end == 0 ? std::array<double, 2>{0, arm.reach}
                                              : std::array<double, 2>{length - arm.reach, length});
      for (double position : arm.positions) protected_places.push_back({arm.curve, position});
    }
  }
  std::vector<char> replaced(seeds.size(), 0);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const SeedPlace& place = seeds.place(i);
    if (place.curve == kNone) continue;
    for (const auto& [from, to] : zones[place.curve])
      if (place.position >= from && place.position <= to) replaced[i] = 1;
  }
  seeds.remove(replaced);
  for (const auto& [curve, position] : protected_places)
    seeds.add(curves.point(curve, position), {Kind::fixed, curve, kNone, position});
  const std::vector<std::vector<Index>> on = seeds_by_curve(curves, seeds);
  for (Index k = 0; k < curves.size(); ++k)
    if (!zones[k].empty()) space_evenly(curves, measure, k, on[k], seeds);
}

// True if something was changed. Links of `hopeless` curves are not divided. `crowd`: curves may get more seeds than
// they should have; `last`: nothing is moved away.
bool mend(const FeatureCurves& curves, const CurveMeasure& measure, double c, const std::vector<FeatureFault>& faults,
          const std::vector<char>& hopeless, bool crowd, bool last, PlacedSeeds& seeds) {
  std::vector<std::size_t> wanted(curves.size());
  for (Index k = 0; k < curves.size(); ++k) wanted[k] = measure.edges(k, c) - (curves.closed(k) ? 0 : 1);
  for (const SeedPlace& place : seeds.places())
    if (place.curve != kNone && wanted[place.curve] > 0) --wanted[place.curve];
  std::vector<char> used(seeds.size(), 0), removed(seeds.size(), 0);
  std::set<Index> loosened;
  // Missing links wait until no foreign seed is left to meet: that may be all they need.
  const bool meeting = std::any_of(faults.begin(), faults.end(), [](const FeatureFault& f) { return f.cell != kNone; });
  bool changed = false;
  const auto put = [&](Index seed, Index curve, double position, Kind kind) {
    seeds.put(seed, curves.point(curve, position), {kind, curve, kNone, position});
  };
  for (const FeatureFault& fault : faults) {
    const double position = curves.wrap(fault.curve, meeting_position(curves, seeds, fault));
    const double length = fault.to - fault.from;
    if (fault.cell != kNone && seeds.on_surface(fault.cell)) {
      if (std::exchange(used[fault.cell], 1)) continue;
      changed = true;
      if (last || ((crowd || wanted[fault.curve] > 0) &&
                   length >= kRoomToSnap * measure.edge_length(fault.curve, position, c))) {
        put(fault.cell, fault.curve, position, Kind::curve);
        if (wanted[fault.curve] > 0) --wanted[fault.curve];
      } else if (length >= kRoomToSnap * measure.edge_length(fault.curve, position, c)) {
        removed[fault.cell] = 1;
        loosened.insert(fault.curve);
      } else {
        const Vec3 on = curves.point(fault.curve, curves.wrap(fault.curve, 0.5 * (fault.from + fault.to)));
        Vec3& pushed = seeds.edit_positions()[fault.cell];
        pushed += kPush * (pushed - on);
      }
      continue;
    }
    if (fault.cell == kNone && (hopeless[fault.curve] || (meeting && last))) continue;
    // Where curves cross another sheet no seed helps.
    const bool meets = fault.cell != kNone;
    const double least = last ? kTiniest : meets ? kSmallest : kShortLink;
    if (length < least * measure.edge_length(fault.curve, position, c)) continue;
    changed = true;
    if (meets) seeds.edit_places()[fault.cell].kind = Kind::fixed;
    seeds.add(Vec3{});
    removed.push_back(0);
    put(static_cast<Index>(seeds.size() - 1), fault.curve, position, meets ? Kind::fixed : Kind::curve);
  }
  seeds.remove(removed);
  if (!last && !loosened.empty()) {
    const std::vector<std::vector<Index>> on = seeds_by_curve(curves, seeds);
    for (Index k : loosened) space_evenly(curves, measure, k, on[k], seeds);
  }
  return changed;
}

std::vector<std::size_t> faults_by_curve(const std::vector<FeatureFault>& faults, std::size_t curves) {
  std::vector<std::size_t> counts(curves, 0);
  for (const FeatureFault& fault : faults) ++counts[fault.curve];
  return counts;
}

}  // namespace

FeatureReport check_features(const FeatureTrace& trace, const FeatureCurves& curves,
                             const std::vector<SeedPlace>& places, const Diagram& diagram) {
  const std::vector<std::vector<CurveInterval>> traces = trace.trace(diagram.polygons);
  const std::map<std::array<Index, 2>, Index> dual_edges = dual_edge_counts(diagram.dual, places);
  FeatureReport found;
  std::map<std::array<Index, 2>, Index> taken;  // the curve that has an edge of the dual
  std::vector<Index> visits(places.size(), 0);
  const auto has_link = [&](Index a, Index b, Index curve) {
    const auto in_dual = dual_edges.find({std::min(a, b), std::max(a, b)});
    return in_dual != dual_edges.end() && in_dual->second >= trace.sheets(curve);
  };
  for (Index c = 0; c < traces.size(); ++c) {
    const std::vector<CurveInterval>& intervals = traces[c];
    const std::size_t before = found.faults.size(), count = intervals.size();
    const bool closed = curves.closed(c);
    std::vector<char> valid(count, 0);
    const bool around = closed && count > 1 && intervals.front().cell == intervals.back().cell;
    for (std::size_t k = 0; k < count; ++k) {
      const CurveInterval& i = intervals[k];
      const SeedPlace& place = places[i.cell];
      const bool own = place.curve == c;
      const bool corner =
          !closed && place.corner != kNone &&
          ((k == 0 && place.corner == curves.ends(c)[0]) || (k + 1 == count && place.corner == curves.ends(c)[1]));
      // The corner of another part of the surface is no vertex of this one.
      const bool joined = k > 0 && k + 1 < count && has_link(intervals[k - 1].cell, i.cell, c) &&
                          has_link(i.cell, intervals[k + 1].cell, c);
      valid[k] = own || corner || (joined && passes_corner(curves, i, c, place));
      if (!valid[k]) {
        found.faults.push_back({c, i.from, i.to, i.cell});
        continue;
      }
      const bool again = visits[i.cell]++ > 0 && !(around && k + 1 == count) && !corner;
      if (again && !(place.position >= i.from && place.position <= i.to))
        found.faults.push_back({c, i.from, i.to, kNone});
    }
    // A chain of edges that no other curve has, each with a triangle on every sheet.
    const std::size_t links = count - (closed && !around ? 0 : 1);
    for (std::size_t k = 0; k < links && count > 0; ++k) {
      const CurveInterval &i = intervals[k], &j = intervals[(k + 1) % count];
      if (i.cell == j.cell || !valid[k] || !valid[(k + 1) % count]) continue;
      const std::array<Index, 2> edge{std::min(i.cell, j.cell), std::max(i.cell, j.cell)};
      found.edges.push_back(edge);
      const bool missing = !has_link(i.cell, j.cell, c);
      const auto [other, fresh] = taken.insert({edge, c});
      if (!missing && fresh) continue;
      const auto middle = [](const CurveInterval& x) { return 0.5 * (x.from + x.to); };
      double from = middle(i), to = middle(j);
      if (places[i.cell].curve == c) from = places[i.cell].position;
      else if (k == 0 && !closed) from = 0;
      if (places[j.cell].curve == c) to = places[j.cell].position;
      else if (k + 2 == count && !closed) to = curves.length(c);
      if (to < from) to += curves.length(c);
      found.faults.push_back({c, from, to, kNone});
    }
    for (const CurveInterval& i : intervals) visits[i.cell] = 0;
    if (closed && count < 3 && found.faults.size() == before)
      for (int part = 0; part < 3; ++part)
        found.faults.push_back({c, curves.length(c) * part / 3, curves.length(c) * (part + 1) / 3, kNone});
    if (found.faults.size() > before) found.broken.push_back(c);
  }
  std::sort(found.edges.begin(), found.edges.end());
  found.edges.erase(std::unique(found.edges.begin(), found.edges.end()), found.edges.end());
  return found;
}

void clear_features(CvtRun& run, const FeatureTrace& trace, const CurveMeasure& measure, OptimiseOptions options,
                    Backend* stand_in) {
  const FeatureCurves& curves = run.curves();
  PlacedSeeds& seeds = run.seeds;
  const std::size_t count = seeds.size();
  options.iterations = kClearingSteps;
  std::vector<char> removed(seeds.size(), 0), crossed(curves.size(), 0);
  const std::vector<std::vector<CurveInterval>> traced = trace.trace(run.diagram(run.traced()).polygons);
  for (Index c = 0; c < curves.size(); ++c)
    for (const CurveInterval& i : traced[c])
      if (seeds.on_surface(i.cell)) removed[i.cell] = crossed[c] = 1;
  if (std::find(crossed.begin(), crossed.end(), 1) == crossed.end()) return;
  const SeedsBefore before = seeds_before(run);
  seeds.remove(removed);
  const std::vector<std::vector<Index>> on = seeds_by_curve(curves, seeds);
  for (Index c = 0; c < on.size(); ++c)
    if (crossed[c]) space_evenly(curves, measure, c, on[c], seeds);
  set_count(run.diagram(Want::polygons), count, seeds);
  optimise_around(run, before, options, stand_in);
}

FeatureReport recover_features(CvtRun& run, const FeatureTrace& trace, const CurveMeasure& measure, double c,
                               OptimiseOptions options, Backend* stand_in) {
  const Want chains = run.traced() | Want::dual;
  const FeatureCurves& curves = run.curves();
  const std::size_t count = run.seeds.size(), most = count + count / 4 + kMostAdded;
  protect_acute_corners(curves, measure, c, run.seeds);
  PlacedSeeds best;
  std::size_t fewest = std::numeric_limits<std::size_t>::max(), previous = fewest;
  std::vector<std::size_t> first_faults;  // of the rounds of inserting, by curve
  std::vector<char> hopeless(curves.size(), 0);
  bool crowd = false;
  for (int round = 0;; ++round) {
    run.context().check();
    const FeatureReport found = check_features(trace, curves, run.seeds.places(), run.diagram(chains));
    if (found.faults.empty()) return found;
    if (found.faults.size() < fewest) {
      fewest = found.faults.size();
      best = run.seeds;
    }
    const bool stuck = static_cast<double>(found.faults.size()) > kWorthARound * static_cast<double>(previous);
    previous = found.faults.size();
    if (stuck && crowd) round = std::max(round, kMovingRounds);
    crowd = crowd || stuck || round >= kRelocatingRounds;
    const bool last = round >= kMovingRounds;
    if (round == kMovingRounds + kInsertingRounds || run.seeds.size() > most) break;
    if (last) {
      const std::vector<std::size_t> faults = faults_by_curve(found.faults, curves.size());
      if (first_faults.empty()) first_faults = faults;
      for (Index k = 0; k < faults.size(); ++k)
        hopeless[k] = faults[k] >= std::max(kDivided * first_faults[k], kLeastDivided);
    }
    const SeedsBefore before = last ? SeedsBefore{} : seeds_before(run);
    const bool changed = mend(curves, measure, c, found.faults, hopeless, crowd, last, run.seeds);
    if (last && !changed) break;
    if (last) continue;
    if (!changed) {
      // What is left is too small for all but the last rounds.
      round = kMovingRounds - 1;
      continue;
    }
    if (run.seeds.size() != count) set_count(run.diagram(Want::polygons), count, run.seeds);
    options.phase = "features, round " + std::to_string(round + 1);
    options.iterations = kFirstSteps + (kLastSteps - kFirstSteps) * round / (kMovingRounds - 1);
    optimise_around(run, before, options, stand_in);
  }
  // Sheets that intersect, or curves that cross another sheet, cannot all be had.
  run.seeds = std::move(best);
  return check_features(trace, curves, run.seeds.places(), run.diagram(chains));
}

}  // namespace bisector
