#include "features/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <queue>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/grouping.h"
#include "core/shortest_ways.h"
#include "features/curve_network.h"
#include "features/curves.h"
#include "mesh/topology.h"
#include "spatial/kd_tree.h"

namespace bisector {
namespace {

// Creases go if more than this part of them runs beside others.
constexpr double kBeside = 0.5;
// Edges that a closed curve has at least, so that it looks round.
constexpr double kLoopEdges = 4;
// A curve that comes back to its corner is one if it is longer than so many widths.
constexpr double kLoopWidths = 3;
// So long, in widths, are parts of curves that go by themselves: two curves that leave a corner at less than 30 degrees
// are nearer to each other than the width as far as that.
constexpr double kStretch = 2;
// Between points where curves are looked at, in widths.
constexpr double kStep = 0.5;
// A curve runs beside itself where it is nearer than this part of the way along it: where it turns back at less than
// 17 degrees.
constexpr double kHairpin = 0.15;
// What two curves may share at a corner, in widths: edges are at least twice as long.
constexpr double kShared = 0.25;
// Two curves at a corner where no other ends are one if they turn by less than this, in radians.
constexpr double kStraight = 50 * kRadiansPerDegree;

bool is_crease(const FeatureCurve& curve) { return curve.kind == FeatureKind::crease; }

// The corners as nodes of a graph, the open curves as its edges.
class CornerGraph {
 public:
  CornerGraph(const FeatureCurves& curves, const std::vector<double>& weights)
      : curves_(curves), weights_(weights), at_(group_into_rows<Arm>(curves.graph().corners.size(), [&](auto put) {
          for (Index c = 0; c < curves.size(); ++c) {
            if (curves.closed(c)) continue;
            const auto [first, last] = curves.ends(c);
            put(first, Arm{c, last});
            put(last, Arm{c, first});
          }
        })) {}

  // For each corner the curve by which the way to its representative leaves it; kNone of representatives.
  struct Forest {
    std::vector<Index> curve, next;  // and the corner at that curve's other end
  };
  Forest merge(double width) const {
    const std::size_t count = at_.rows();
    std::vector<Index> order(count);
    std::iota(order.begin(), order.end(), Index{0});
    std::vector<std::array<double, 2>> rank(count);
    for (Index v = 0; v < count; ++v) rank[v] = rank_of(v);
    std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return rank[a] > rank[b]; });
    std::vector<double> way(count, std::numeric_limits<double>::infinity());
    Forest forest{std::vector<Index>(count, kNone), std::vector<Index>(count, kNone)};
    const auto links = [&](Index at, const auto& visit) {
      for (const Arm* arm = at_.begin(at); arm != at_.end(at); ++arm)
        visit(arm->other, curves_.length(arm->curve), arm->curve);
    };
    for (const Index v : order) {
      if (way[v] < width && !is_branching_of_others(v)) continue;
      shortest_ways(v, width, links, [&](Index at, double length, Index before, Index curve) {
        if (before != kNone && (length >= width || length >= way[at])) return false;
        way[at] = length;
        forest.curve[at] = curve;
        forest.next[at] = before;
        return true;
      });
    }
    return forest;
  }

 private:
  struct Arm {
    Index curve, other;
  };

  // Branchings first, then ends, then turns; among these the corner of the most important curves.
  std::array<double, 2> rank_of(Index corner) const {
    double weight = 0;
    std::size_t arms = 0;  // but for links, which weigh nothing
    for (const Arm* arm = at_.begin(corner); arm != at_.end(corner); ++arm) {
      weight += weights_[arm->curve];
      arms += weights_[arm->curve] > 0;
    }
    return {arms > 2 ? 2.0 : arms == 2 ? 0.0 : 1.0, weight};
  }

  // Whether three or more curves meet that are not all creases.
  bool is_branching_of_others(Index corner) const {
    bool others = false;
    for (const Arm* arm = at_.begin(corner); arm != at_.end(corner); ++arm)
      others |= !is_crease(curves_.graph().curves[arm->curve]);
    return others && at_.size(corner) > 2;
  }

  const FeatureCurves& curves_;
  const std::vector<double>& weights_;
  Csr<Arm> at_;
};

// A curve between corners that remain.
struct Candidate {
  FeatureCurve curve;
  double weight = 0;
  double length = 0;
};

std::vector<Index> reversed_vertices(std::vector<Index> vertices) {
  std::reverse(vertices.begin(), vertices.end());
  return vertices;
}

// The vertices of the way from a corner to its representative, both included.
std::vector<Index> way_of(const FeatureGraph& graph, const CornerGraph::Forest& forest, Index corner) {
  std::vector<Index> way{graph.corners[corner]};
  while (forest.curve[corner] != kNone) {
    std::vector<Index> part = graph.curves[forest.curve[corner]].vertices;
    if (part.front() != way.back()) part = reversed_vertices(std::move(part));
    way.insert(way.end(), part.begin() + 1, part.end());
    corner = forest.next[corner];
  }
  return way;
}

double length_of(const std::vector<Index>& chain, bool closed, const std::vector<Vec3>& vertices) {
  double length = 0;
  for (std::size_t k = 1; k < chain.size(); ++k) length += norm(vertices[chain[k]] - vertices[chain[k - 1]]);
  return closed ? length + norm(vertices[chain.front()] - vertices[chain.back()]) : length;
}

// Of the first `count` curves; the others are links.
std::vector<Candidate> led_to_representatives(const FeatureCurves& curves, std::size_t count,
                                              const std::vector<Vec3>& vertices, const std::vector<double>& weights,
                                              const CornerGraph::Forest& forest, double width,
                                              SimplifiedFeatures& result) {
  const FeatureGraph& graph = curves.graph();
  std::vector<char> between(curves.size(), 0);
  for (const Index c : forest.curve)
    if (c != kNone) between[c] = 1;
  std::vector<Candidate> candidates;
  for (Index c = 0; c < count; ++c) {
    Candidate candidate{graph.curves[c], weights[c], curves.length(c)};
    if (curves.closed(c)) {
      if (is_crease(candidate.curve) && candidate.length < kLoopEdges * width) ++result.let_go;
      else candidates.push_back(std::move(candidate));
      continue;
    }
    if (between[c]) {
      ++result.merged;
      continue;
    }
    const auto [first, last] = curves.ends(c);
    std::vector<Index> chain = reversed_vertices(way_of(graph, forest, first));
    chain.insert(chain.end(), candidate.curve.vertices.begin() + 1, candidate.curve.vertices.end());
    const std::vector<Index> onwards = way_of(graph, forest, last);
    chain.insert(chain.end(), onwards.begin() + 1, onwards.end());
    candidate.curve.vertices = std::move(chain);
    candidate.length = length_of(candidate.curve.vertices, false, vertices);
    const bool loop = candidate.curve.vertices.front() == candidate.curve.vertices.back();
    if (loop && is_crease(candidate.curve) && candidate.length < kLoopWidths * width) {
      ++result.merged;
      continue;
    }
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

// A point of a candidate.
struct Sample {
  Vec3 point;
  double position = 0;  // arc length
};

// Half the width apart, so that no other curve slips through.
std::vector<Sample> samples_of(const Candidate& candidate, const std::vector<Vec3>& vertices, double width) {
  const std::vector<Index>& chain = candidate.curve.vertices;
  const std::size_t segments = chain.size() - (candidate.curve.closed ? 0 : 1);
  const double step = kStep * width;
  std::vector<Sample> samples;
  double at = 0, next = 0.5 * step;
  for (std::size_t k = 0; k < segments; ++k) {
    const Vec3 &a = vertices[chain[k]], &b = vertices[chain[(k + 1) % chain.size()]];
    const double length = norm(b - a);
    for (; next < at + length; next += step) samples.push_back({a + ((next - at) / length) * (b - a), next});
    at += length;
  }
  if (samples.empty()) samples.push_back({0.5 * (vertices[chain.front()] + vertices[chain.back()]), 0.5 * at});
  return samples;
}

// The candidates that stay, as points at small distances, and how far it is along them.
class Kept {
 public:
  Kept(const std::vector<Vec3>& vertices, double width) : vertices_(vertices), width_(width) {}

  void keep(const Candidate& candidate) {
    const auto c = static_cast<Index>(candidates_.size());
    for (const Sample& sample : samples_of(candidate, vertices_, width_))
      points_[box_of(sample.point)].push_back({sample, c});
    candidates_.push_back(candidate);
    if (candidate.curve.closed) return;
    at_[candidate.curve.vertices.front()].push_back(c);
    at_[candidate.curve.vertices.back()].push_back(c);
  }

  // Whether each of the samples of a candidate runs within the width of what stays, though it is far along the curves.
  std::vector<char> beside(const Candidate& candidate, const std::vector<Sample>& samples) const {
    const std::vector<Index>& chain = candidate.curve.vertices;
    const bool closed = candidate.curve.closed;
    const Ways from_start = closed ? Ways{} : ways(chain.front()), from_end = closed ? Ways{} : ways(chain.back());
    std::vector<char> is_beside;
    for (const auto& [point, at] : samples) {
      char beside = 0;
      each_near(point, [&, at = at](const Point& other, double distance) {
        const double way = std::min(at + way_to(other, from_start), candidate.length - at + way_to(other, from_end));
        beside |= way > kDetour * distance;
      });
      is_beside.push_back(beside);
    }
    return is_beside;
  }

  bool is_near(const Vec3& p) const {
    bool near = false;
    each_near(p, [&](const Point&, double) { near = true; });
    return near;
  }

 private:
  using Ways = std::unordered_map<Index, double>;  // lengths of ways to corners
  using Box = std::array<std::int64_t, 3>;         // of a grid as wide as the width

  struct Point {
    Sample sample;
    Index curve;
  };

  Box box_of(const Vec3& p) const {
    const auto along = [&](double x) { return static_cast<std::int64_t>(std::floor(x / width_)); };
    return {along(p.x), along(p.y), along(p.z)};
  }

  // Calls body(point, distance) for the points within the width.
  template <class Body>
  void each_near(const Vec3& p, const Body& body) const {
    const Box middle = box_of(p);
    for (std::int64_t x = -1; x <= 1; ++x)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto box = points_.find({middle[0] + x, middle[1] + y, middle[2] + z});
          if (box == points_.end()) continue;
          for (const Point& point : box->second)
            if (const double distance = norm(point.sample.point - p); distance < width_) body(point, distance);
        }
  }

  // From a corner to others along what stays, as far as a detour matters.
  Ways ways(Index corner) const {
    Ways shortest;
    const auto links = [&](Index v, const auto& visit) {
      const auto arms = at_.find(v);
      if (arms == at_.end()) return;
      for (const Index c : arms->second) {
        const std::vector<Index>& chain = candidates_[c].curve.vertices;
        visit(chain.front() == v ? chain.back() : chain.front(), candidates_[c].length, c);
      }
    };
    shortest_ways(corner, kDetour * width_, links,
                  [&](Index v, double length, Index, Index) { return shortest.try_emplace(v, length).second; });
    return shortest;
  }

  double way_to(const Point& point, const Ways& ways) const {
    double least = std::numeric_limits<double>::infinity();
    const Candidate& candidate = candidates_[point.curve];
    if (candidate.curve.closed) return least;
    if (const auto first = ways.find(candidate.curve.vertices.front()); first != ways.end())
      least = first->second + point.sample.position;
    if (const auto last = ways.find(candidate.curve.vertices.back()); last != ways.end())
      least = std::min(least, last->second + candidate.length - point.sample.position);
    return least;
  }

  const std::vector<Vec3>& vertices_;
  double width_;
  std::vector<Candidate> candidates_;
  std::map<Box, std::vector<Point>> points_;
  std::map<Index, std::vector<Index>> at_;  // candidates that end at a corner
};

// Arc lengths from the start of a chain to each of its vertices.
std::vector<double> arc_lengths(const std::vector<Index>& chain, const std::vector<Vec3>& vertices) {
  std::vector<double> at(chain.size(), 0);
  for (std::size_t k = 1; k < chain.size(); ++k) at[k] = at[k - 1] + norm(vertices[chain[k]] - vertices[chain[k - 1]]);
  return at;
}

// Divides a chain at some of its vertices.
std::vector<std::vector<Index>> divided(const std::vector<Index>& chain, const std::vector<std::size_t>& at) {
  std::vector<std::vector<Index>> parts;
  std::size_t begin = 0;
  const auto end_at = [&](std::size_t k) {
    parts.emplace_back(chain.begin() + static_cast<std::ptrdiff_t>(begin),
                       chain.begin() + static_cast<std::ptrdiff_t>(k + 1));
    begin = k;
  };
  for (const std::size_t k : at) end_at(k);
  end_at(chain.size() - 1);
  return parts;
}

// A run of samples that are all beside something, or all not.
struct Stretch {
  std::size_t begin, end;
  bool beside;
};

// Those shorter than kStretch become like what is around them, the shortest first.
std::vector<Stretch> stretches_of(const std::vector<char>& beside) {
  std::vector<Stretch> stretches;
  for (std::size_t k = 0; k < beside.size(); ++k) {
    if (stretches.empty() || stretches.back().beside != (beside[k] != 0)) stretches.push_back({k, k, beside[k] != 0});
    ++stretches.back().end;
  }
  const auto size = [](const Stretch& s) { return s.end - s.begin; };
  while (stretches.size() > 1) {
    const auto shortest = std::min_element(stretches.begin(), stretches.end(),
                                           [&](const Stretch& a, const Stretch& b) { return size(a) < size(b); });
    if (kStep * static_cast<double>(size(*shortest)) >= kStretch) break;
    shortest->beside = !shortest->beside;
    std::vector<Stretch> merged;
    for (const Stretch& s : stretches) {
      if (!merged.empty() && merged.back().beside == s.beside) merged.back().end = s.end;
      else merged.push_back(s);
    }
    stretches = std::move(merged);
  }
  return stretches;
}

// An arc length, and how far from it a vertex may be.
struct Cut {
  double position, reach;
};

// Divides a candidate at its vertices that are nearest to these places, but not into parts shorter than `least`. A
// closed one then begins at the first of them.
std::vector<Candidate> parts_of(const Candidate& whole, const std::vector<Cut>& places,
                                const std::vector<Vec3>& vertices, double least) {
  std::vector<Index> chain = whole.curve.vertices;
  if (whole.curve.closed) chain.push_back(chain.front());
  const std::vector<double> at = arc_lengths(chain, vertices);
  const std::size_t last = chain.size() - 1;
  std::set<std::size_t> nearest;
  for (const auto& [position, reach] : places) {
    auto k = static_cast<std::size_t>(std::lower_bound(at.begin(), at.end(), position) - at.begin());
    k = std::min(k, last);
    if (k > 0 && position - at[k - 1] < at[k] - position) --k;
    if (std::abs(at[k] - position) > reach) continue;
    if (whole.curve.closed) nearest.insert(k % last);
    else if (at[k] >= least && at[last] - at[k] >= least) nearest.insert(k);
  }
  for (auto k = nearest.begin(); k != nearest.end();) {
    const auto next = std::next(k);
    if (next != nearest.end() && at[*next] - at[*k] < least) nearest.erase(next);
    else k = next;
  }
  if (nearest.empty()) return {whole};
  std::vector<std::size_t> cuts(nearest.begin(), nearest.end());
  if (whole.curve.closed) {
    const std::size_t first = cuts.front();
    chain.pop_back();
    std::rotate(chain.begin(), chain.begin() + static_cast<std::ptrdiff_t>(first), chain.end());
    chain.push_back(chain.front());
    cuts.erase(cuts.begin());
    for (std::size_t& k : cuts) k -= first;
  }
  std::vector<Candidate> parts;
  for (std::vector<Index>& part : divided(chain, cuts)) {
    const double length = length_of(part, false, vertices);
    parts.push_back({{std::move(part), false, whole.curve.kind}, whole.weight * length / whole.length, length});
  }
  return parts;
}

// Which candidates, or parts of them, stay: the heavier first, each but for stretches beside what stays already.
class Selection {
 public:
  Selection(const std::vector<Vec3>& vertices, double width, const Csr<Index>& neighbours)
      : vertices_(vertices), width_(width), neighbours_(neighbours), kept_(vertices, width) {}
  Selection(const Selection&) = delete;

  void choose(std::vector<Candidate> candidates) {
    const auto later = [](const Item& a, const Item& b) {
      const bool crease_a = is_crease(a.candidate.curve), crease_b = is_crease(b.candidate.curve);
      if (crease_a != crease_b) return crease_a;
      if (a.candidate.weight != b.candidate.weight) return a.candidate.weight < b.candidate.weight;
      return a.order > b.order;
    };
    std::priority_queue<Item, std::vector<Item>, decltype(later)> queue(later);
    std::size_t order = 0;
    stays_.assign(candidates.size(), 0);
    for (std::size_t c = 0; c < candidates.size(); ++c) queue.push({std::move(candidates[c]), c, order++, false});
    while (!queue.empty()) {
      const Item item = queue.top();
      queue.pop();
      if (!is_crease(item.candidate.curve)) {
        keep(item.candidate, item.origin);
        continue;
      }
      if (!item.divided) {
        bool winds = false;
        std::vector<Candidate> parts = apart_from_itself(item.candidate, winds);
        if (parts.size() > 1) {
          for (Candidate& part : parts) queue.push({std::move(part), item.origin, order++, !winds});
          continue;
        }
      }
      for (Candidate& part : apart_from_kept(item.candidate)) {
        if (share_beside(part) > kBeside) dropped_.push_back({std::move(part), item.origin});
        else keep(part, item.origin);
      }
    }
    attach_ends();
  }

  const std::vector<Candidate>& kept() const { return chosen_; }
  const Kept& points() const { return kept_; }
  // Of the candidates.
  std::size_t gone() const { return static_cast<std::size_t>(std::count(stays_.begin(), stays_.end(), 0)); }

 private:
  struct Item {
    Candidate candidate;
    std::size_t origin;  // the candidate that it is part of
    std::size_t order;
    bool divided;  // where it runs beside itself
  };
  struct Dropped {
    Candidate candidate;
    std::size_t origin;
  };

  void keep(const Candidate& candidate, std::size_t origin) {
    stays_[origin] = 1;
    kept_.keep(candidate);
    chosen_.push_back(candidate);
  }

  double share_beside(const Candidate& candidate) const {
    const std::vector<char> beside = kept_.beside(candidate, samples_of(candidate, vertices_, width_));
    return static_cast<double>(std::count(beside.begin(), beside.end(), 1)) / static_cast<double>(beside.size());
  }

  std::vector<Candidate> divided_at(const Candidate& whole, const std::vector<Cut>& places) {
    std::vector<Candidate> parts = parts_of(whole, places, vertices_, kStretch * width_);
    for (std::size_t k = 0; k < parts.size() && !parts[k].curve.closed; ++k) {
      if (k > 0 || whole.curve.closed) cuts_.insert(parts[k].curve.vertices.front());
      if (k + 1 < parts.size() || whole.curve.closed) cuts_.insert(parts[k].curve.vertices.back());
    }
    return parts;
  }

  std::vector<Candidate> divided_between(const Candidate& whole, const std::vector<Stretch>& stretches) {
    // A vertex may be as far beyond the end of a stretch that goes as that is long.
    const double step = kStep * width_;
    std::vector<Cut> places;
    for (std::size_t k = 0; k < stretches.size(); ++k) {
      const std::size_t before = k == 0 ? stretches.size() - 1 : k - 1;
      if (k == 0 && (!whole.curve.closed || stretches[k].beside == stretches[before].beside)) continue;
      const Stretch& goes = stretches[stretches[k].beside ? k : before];
      places.push_back(
          {step * static_cast<double>(stretches[k].begin), step * static_cast<double>(goes.end - goes.begin)});
    }
    return divided_at(whole, places);
  }

  // Divides a curve where it comes beside itself and leaves itself. One that is beside itself all along winds, like a
  // thread, and is halved.
  std::vector<Candidate> apart_from_itself(const Candidate& whole, bool& winds) {
    const std::vector<Sample> samples = samples_of(whole, vertices_, width_);
    if (whole.length < 2 * kStretch * width_) return {whole};
    const bool loop = whole.curve.closed || whole.curve.vertices.front() == whole.curve.vertices.back();
    std::vector<Vec3> points;
    for (const Sample& sample : samples) points.push_back(sample.point);
    const PointSet set{points};
    const KdTree tree(3, set);
    std::vector<char> beside(samples.size(), 0);
    std::vector<std::pair<Index, double>> near;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const double q[3] = {points[k].x, points[k].y, points[k].z};
      tree.radiusSearch(q, width_ * width_, near, nanoflann::SearchParams(32, 0, false));
      for (const auto& [other, squared] : near) {
        double way = std::abs(samples[k].position - samples[other].position);
        if (loop) way = std::min(way, whole.length - way);
        if (std::sqrt(squared) < kHairpin * way) beside[k] = 1;
      }
    }
    const std::vector<Stretch> stretches = stretches_of(beside);
    winds = stretches.size() == 1 && stretches[0].beside;
    if (winds) return divided_at(whole, {{0, whole.length}, {0.5 * whole.length, whole.length}});
    return divided_between(whole, stretches);
  }

  std::vector<Candidate> apart_from_kept(const Candidate& whole) {
    return divided_between(whole, stretches_of(kept_.beside(whole, samples_of(whole, vertices_, width_))));
  }

  struct Where {
    std::size_t curve, vertex;
  };

  void put(std::size_t c) {
    const std::vector<Index>& chain = chosen_[c].curve.vertices;
    for (std::size_t k = 0; k < chain.size(); ++k) at_[chain[k]].push_back({c, k});
  }

  // Leads what ends where its continuation went to what stays.
  void attach_ends() {
    for (std::size_t c = 0; c < chosen_.size(); ++c) put(c);
    std::vector<Index> open(cuts_.begin(), cuts_.end());
    while (!open.empty()) {
      const Index v = open.back();
      open.pop_back();
      const auto uses = at_.find(v);
      if (uses == at_.end() || uses->second.size() != 1) continue;
      const std::size_t c = uses->second[0].curve;
      const bool from_start = chosen_[c].curve.vertices.front() == v;
      if (chosen_[c].curve.closed || (!from_start && chosen_[c].curve.vertices.back() != v)) continue;
      const std::vector<Index> way = way_to_kept(v, c, from_start);
      if (!way.empty()) {
        extend(c, from_start, way);
        continue;
      }
      for (Dropped& dropped : dropped_) {
        const std::vector<Index>& chain = dropped.candidate.curve.vertices;
        if (chain.empty() || (chain.front() != v && chain.back() != v)) continue;
        const Index other = chain.front() == v ? chain.back() : chain.front();
        keep(dropped.candidate, dropped.origin);
        put(chosen_.size() - 1);
        dropped.candidate.curve.vertices.clear();
        if (cuts_.contains(other)) open.push_back(other);
      }
    }
  }

  void extend(std::size_t c, bool from_start, const std::vector<Index>& way) {
    std::vector<Index>& chain = chosen_[c].curve.vertices;
    for (const Index v : chain) std::erase_if(at_.at(v), [&](const Where& where) { return where.curve == c; });
    if (from_start) std::reverse(chain.begin(), chain.end());
    for (std::size_t k = 1; k < way.size(); ++k) chain.push_back(way[k]);
    chosen_[c].length = length_of(chain, false, vertices_);
    put(c);
  }

  // From an end of a curve along edges to a vertex of another, or to a far one of its own; empty if there is none near.
  std::vector<Index> way_to_kept(Index from, std::size_t curve, bool from_start) const {
    if (neighbours_.rows() == 0) return {};
    std::map<Index, Index> before;
    std::vector<Index> found;
    const auto links = [&](Index v, const auto& visit) {
      for (const Index* other = neighbours_.begin(v); other != neighbours_.end(v); ++other)
        visit(*other, norm(vertices_[*other] - vertices_[v]), kNone);
    };
    const auto way_back = [&](Index v) {
      std::vector<Index> way;
      for (; v != kNone; v = before.at(v)) way.push_back(v);
      return reversed_vertices(std::move(way));
    };
    shortest_ways(from, kLoopWidths * width_, links, [&](Index v, double length, Index previous, Index) {
      if (!found.empty() || !before.try_emplace(v, previous).second) return false;
      if (v == from) return true;
      const auto uses = at_.find(v);
      if (uses == at_.end() || uses->second.empty()) return true;
      for (const Where& where : uses->second)
        if (is_target(where, curve, from_start, length)) {
          found = way_back(v);
          break;
        }
      return false;
    });
    return found;
  }

  // Not so near to a corner that what is left in between is shorter than the width.
  bool is_target(const Where& where, std::size_t curve, bool from_start, double way) const {
    const Candidate& candidate = chosen_[where.curve];
    const std::vector<double> at = arc_lengths(candidate.curve.vertices, vertices_);
    const double position = at[where.vertex];
    if (where.curve == curve && std::abs(position - (from_start ? 0 : at.back())) < kDetour * way) return false;
    if (candidate.curve.closed || where.vertex == 0 || where.vertex + 1 == at.size()) return true;
    return position >= width_ && at.back() - position >= width_;
  }

  const std::vector<Vec3>& vertices_;
  double width_;
  const Csr<Index>& neighbours_;  // along edges of the mesh, for each vertex
  Kept kept_;
  std::vector<Candidate> chosen_;
  std::vector<Dropped> dropped_;
  std::vector<char> stays_;                 // of each candidate, whether any of it does
  std::set<Index> cuts_;                    // vertices where candidates were divided
  std::map<Index, std::vector<Where>> at_;  // of what was chosen
};

// Leaves each edge to the first curve that has it, but for stretches of at most `limit` at the ends of others.
std::vector<FeatureCurve> without_shared_edges(const std::vector<FeatureCurve>& curves,
                                               const std::vector<Vec3>& vertices, double limit) {
  std::set<std::array<Index, 2>> taken;
  std::vector<FeatureCurve> own;
  for (const FeatureCurve& curve : curves) {
    std::vector<Index> chain = curve.vertices;
    if (curve.closed) chain.push_back(chain.front());
    const std::vector<double> at = arc_lengths(chain, vertices);
    std::vector<std::size_t> cuts;  // where stretches that others have begin and end
    std::vector<char> is_others;    // of each stretch
    for (std::size_t k = 1; k < chain.size(); ++k) {
      const auto [a, b] = std::minmax(chain[k - 1], chain[k]);
      const char others = !taken.insert({a, b}).second;
      if (!is_others.empty() && others == is_others.back()) continue;
      if (k > 1) cuts.push_back(k - 1);
      is_others.push_back(others);
    }
    if (!curve.closed && !cuts.empty() && is_others.back() && at.back() - at[cuts.back()] <= limit) {
      cuts.pop_back();
      is_others.pop_back();
    }
    if (!curve.closed && !cuts.empty() && is_others.front() && at[cuts.front()] <= limit) {
      cuts.erase(cuts.begin());
      is_others.erase(is_others.begin());
    }
    if (cuts.empty()) {
      if (!is_others[0]) own.push_back(curve);
      continue;
    }
    const std::vector<std::vector<Index>> parts = divided(chain, cuts);
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (!is_others[k]) own.push_back({parts[k], false, curve.kind});
  }
  return own;
}

// Divides curves where others meet them, more than `limit` from their ends.
std::vector<FeatureCurve> divided_where_they_meet(const std::vector<FeatureCurve>& curves,
                                                  const std::vector<Vec3>& vertices, double limit) {
  std::map<Index, std::size_t> uses;
  for (const FeatureCurve& curve : curves)
    for (const Index v : curve.vertices) ++uses[v];
  const auto meets = [&](Index v) { return uses[v] > 1; };
  std::vector<FeatureCurve> parts;
  for (const FeatureCurve& curve : curves) {
    std::vector<Index> chain = curve.vertices;
    if (curve.closed) {
      const auto first = std::find_if(chain.begin(), chain.end(), meets);
      if (first == chain.end()) {
        parts.push_back(curve);
        continue;
      }
      std::rotate(chain.begin(), first, chain.end());
      chain.push_back(chain.front());
    }
    const std::vector<double> at = arc_lengths(chain, vertices);
    std::vector<std::size_t> cuts;
    for (std::size_t k = 1; k + 1 < chain.size(); ++k)
      if (meets(chain[k]) && at[k] > limit && at.back() - at[k] > limit) cuts.push_back(k);
    for (std::vector<Index>& part : divided(chain, cuts)) parts.push_back({std::move(part), false, curve.kind});
  }
  return parts;
}

// The direction in which a curve leaves the corner at one of its ends, over a length of about `width`.
Vec3 leaving(const FeatureCurve& curve, bool from_start, const std::vector<Vec3>& vertices, double width) {
  const std::size_t count = curve.vertices.size();
  const auto at = [&](std::size_t k) { return vertices[curve.vertices[from_start ? k : count - 1 - k]]; };
  double length = 0;
  for (std::size_t k = 1; k < count; ++k) {
    length += norm(at(k) - at(k - 1));
    if (length >= width) return at(k) - at(0);
  }
  return at(count - 1) - at(0);
}

// Joins curves where just two end, and they run on or one of them is shorter than the width; a curve whose own ends run
// on there is closed.
void join_straight(std::vector<FeatureCurve>& curves, const std::vector<Vec3>& vertices, double width) {
  std::map<Index, std::vector<std::size_t>> at;
  for (std::size_t c = 0; c < curves.size(); ++c)
    if (!curves[c].closed)
      for (const Index v : {curves[c].vertices.front(), curves[c].vertices.back()}) at[v].push_back(c);
  std::vector<char> gone(curves.size(), 0);
  for (auto& [corner, ends] : at) {
    if (ends.size() != 2) continue;
    std::size_t a = ends[0], b = ends[1];
    if (curves[a].kind != curves[b].kind) continue;
    const bool a_starts = curves[a].vertices.front() == corner;
    const bool b_starts = a == b ? !a_starts : curves[b].vertices.front() == corner;
    const auto is_short = [&](std::size_t c) { return length_of(curves[c].vertices, false, vertices) < width; };
    const Vec3 u = leaving(curves[a], a_starts, vertices, width), v = leaving(curves[b], b_starts, vertices, width);
    const bool straight = -dot(u, v) >= std::cos(kStraight) * norm(u) * norm(v);
    if (!straight && !is_short(a) && !is_short(b)) continue;
    if (a == b) {
      curves[a].vertices.pop_back();
      curves[a].closed = true;
      continue;
    }
    std::vector<Index> first = curves[a].vertices, second = curves[b].vertices;
    if (a_starts) first = reversed_vertices(std::move(first));
    if (!b_starts) second = reversed_vertices(std::move(second));
    first.insert(first.end(), second.begin() + 1, second.end());
    curves[a].vertices = std::move(first);
    gone[b] = 1;
    for (std::size_t& c : at[curves[a].vertices.back()])
      if (c == b) c = a;
  }
  std::size_t kept = 0;
  for (std::size_t c = 0; c < curves.size(); ++c)
    if (!gone[c]) {
      if (kept != c) curves[kept] = std::move(curves[c]);
      ++kept;
    }
  curves.resize(kept);
}

}  // namespace

std::vector<double> curve_weights(const FeatureGraph& graph, const std::vector<Triangle>& triangles,
                                  const std::vector<Vec3>& vertices) {
  const EdgeTable table = edge_table(triangles, vertices.size());
  std::vector<double> weights;
  for (const FeatureCurve& curve : graph.curves) {
    double weight = 0;
    const std::size_t count = curve.vertices.size(), segments = count - (curve.closed ? 0 : 1);
    for (std::size_t k = 0; k < segments; ++k) {
      const Index a = curve.vertices[k], b = curve.vertices[(k + 1) % count];
      const std::array<Index, 2> edge{std::min(a, b), std::max(a, b)};
      const auto found = std::lower_bound(table.edges.begin(), table.edges.end(), edge);
      if (found == table.edges.end() || *found != edge) continue;
      const auto e = static_cast<std::size_t>(found - table.edges.begin());
      double angle = std::numbers::pi;
      if (table.half_edges.size(e) == 2) {
        const auto normal = [&](std::size_t half_edge) {
          const Triangle& t = triangles[half_edge / 3];
          const Vec3 n = cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]]);
          const double length = norm(n);
          return length > 0 ? (1 / length) * n : Vec3{};
        };
        angle = std::acos(
            std::clamp(dot(normal(table.half_edges.begin(e)[0]), normal(table.half_edges.begin(e)[1])), -1.0, 1.0));
      }
      weight += norm(vertices[b] - vertices[a]) * angle;
    }
    weights.push_back(weight);
  }
  return weights;
}

std::vector<std::array<Index, 2>> corner_links(const FeatureGraph& graph, const std::vector<Triangle>& triangles,
                                               std::size_t vertex_count) {
  std::vector<char> is_corner(vertex_count, 0);
  for (const Index v : graph.corners) is_corner[v] = 1;
  std::vector<std::array<Index, 2>> links;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
      if (a != b && is_corner[a] && is_corner[b]) links.push_back({a, b});
    }
  std::sort(links.begin(), links.end());
  links.erase(std::unique(links.begin(), links.end()), links.end());
  std::erase_if(links, [&](const std::array<Index, 2>& link) {
    return std::binary_search(graph.edges.begin(), graph.edges.end(), link);
  });
  return links;
}

SimplifiedFeatures simplify_features(const FeatureGraph& graph, const std::vector<Vec3>& vertices,
                                     const std::vector<double>& given_weights, double width,
                                     const std::vector<std::array<Index, 2>>& links, const Csr<Index>& neighbours) {
  SimplifiedFeatures result;
  if (!(width > 0)) {
    result.graph = graph;
    return result;
  }
  FeatureGraph linked = graph;
  std::vector<double> weights = given_weights;
  for (const auto& [a, b] : links) {
    linked.curves.push_back({{a, b}, false, FeatureKind::crease});
    weights.push_back(0);
  }
  const FeatureCurves curves(linked, vertices);
  const CornerGraph::Forest forest = CornerGraph(curves, weights).merge(width);
  std::vector<Candidate> candidates =
      led_to_representatives(curves, graph.curves.size(), vertices, weights, forest, width, result);
  Selection selection(vertices, width, neighbours);
  selection.choose(std::move(candidates));
  result.merged += selection.gone();
  std::vector<FeatureCurve> left;
  for (const Candidate& candidate : selection.kept()) left.push_back(candidate.curve);
  // Corners on no curve, such as the tips of cones.
  std::vector<char> on_curve(graph.corners.size(), 0);
  for (Index c = 0; c < graph.curves.size(); ++c)
    if (!curves.closed(c))
      for (const Index end : curves.ends(c)) on_curve[end] = 1;
  for (Index k = 0; k < graph.corners.size(); ++k)
    if (!on_curve[k] && !selection.points().is_near(vertices[graph.corners[k]]))
      result.graph.corners.push_back(graph.corners[k]);

  // Ways to the same corner may run along the same edges: more of them than the corner's cell can hold no seeds mend.
  const double limit = kShared * width;
  left = divided_where_they_meet(without_shared_edges(left, vertices, limit), vertices, limit);
  join_straight(left, vertices, width);
  for (const FeatureCurve& curve : left)
    if (!curve.closed)
      for (const Index v : {curve.vertices.front(), curve.vertices.back()}) result.graph.corners.push_back(v);
  std::sort(result.graph.corners.begin(), result.graph.corners.end());
  result.graph.corners.erase(std::unique(result.graph.corners.begin(), result.graph.corners.end()),
                             result.graph.corners.end());
  result.graph.edges = edges_of(left);
  result.graph.curves = std::move(left);
  return result;
}

}  // namespace bisector
