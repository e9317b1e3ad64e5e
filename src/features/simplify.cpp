#include "features/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include "core/grouping.h"
#include "core/parallel.h"
#include "core/shortest_ways.h"
#include "features/candidates.h"
#include "features/curves.h"
#include "features/edge_ways.h"
#include "features/select_creases.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

// Edges that a closed curve has at least, so that it looks round.
constexpr double kLoopEdges = 4;
// What two curves may share at a corner, and how near to each other they may be, in widths: edges are at least twice as
// long.
constexpr double kShared = 0.25;
// Vertices that a search for links reaches at most, and searches at once.
constexpr std::size_t kMostOnWays = 256, kCornersAtOnce = 16;
// Two curves at a corner where no other ends are one if they turn by less than this, in radians.
constexpr double kStraight = 50 * kRadiansPerDegree;

// The corners as nodes of a graph, the open curves as its edges. Those from `links` on are links.
class CornerGraph {
 public:
  CornerGraph(const FeatureCurves& curves, const std::vector<double>& weights, std::size_t links)
      : curves_(curves), weights_(weights), links_(links),
        at_(group_into_rows<Arm>(curves.graph().corners.size(), [&](auto put) {
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
    std::size_t arms = 0;
    for (const Arm* arm = at_.begin(corner); arm != at_.end(corner); ++arm) {
      weight += weights_[arm->curve];
      arms += arm->curve < links_;
    }
    return {arms > 2 ? 2.0 : arms == 2 ? 0.0 : 1.0, weight};
  }

  // Whether three or more curves meet that are not all creases.
  bool is_branching_of_others(Index corner) const {
    bool others = false;
    std::size_t arms = 0;
    for (const Arm* arm = at_.begin(corner); arm != at_.end(corner); ++arm) {
      if (arm->curve >= links_) continue;
      others |= !is_crease(curves_.graph().curves[arm->curve]);
      ++arms;
    }
    return others && arms > 2;
  }

  const FeatureCurves& curves_;
  const std::vector<double>& weights_;
  std::size_t links_;
  Csr<Arm> at_;
};

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

// Cuts off tips where a chain turns back at less than 17 degrees along the edges of a needle, narrower than `limit`.
void cut_needle_tips(std::vector<Index>& chain, const std::vector<Vec3>& vertices, const Csr<Index>& neighbours,
                     double limit) {
  const auto is_tip = [&](Index a, Index m, Index b) {
    if (std::find(neighbours.begin(a), neighbours.end(a), b) == neighbours.end(a)) return false;
    const double to_a = norm(vertices[a] - vertices[m]), to_b = norm(vertices[b] - vertices[m]);
    const Vec3 &near = vertices[to_a < to_b ? a : b], &far = vertices[to_a < to_b ? b : a];
    const double width = norm(near - nearest_on_segment(near, vertices[m], far));
    return width < limit && width < 2 * kHairpin * std::min(to_a, to_b);
  };
  for (std::size_t k = 1; k + 1 < chain.size();) {
    if (!is_tip(chain[k - 1], chain[k], chain[k + 1])) {
      ++k;
      continue;
    }
    chain.erase(chain.begin() + static_cast<std::ptrdiff_t>(k));
    k = std::max<std::size_t>(k - 1, 1);
  }
}

// Of the first `count` curves; the others are links.
std::vector<Candidate> led_to_representatives(const FeatureCurves& curves, std::size_t count,
                                              const std::vector<Vec3>& vertices, const std::vector<double>& weights,
                                              const CornerGraph::Forest& forest, double width,
                                              const Csr<Index>& neighbours, SimplifiedFeatures& result) {
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
    if (is_crease(candidate.curve) && neighbours.rows() > 0)
      cut_needle_tips(chain, vertices, neighbours, kShared * width);
    candidate.curve.vertices = std::move(chain);
    candidate.length = length_of(candidate.curve.vertices, false, vertices);
    if (is_loop(candidate.curve) && is_crease(candidate.curve) && candidate.length < kLoopWidths * width) {
      ++result.merged;
      continue;
    }
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

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

// How many times curves run over each vertex.
std::map<Index, std::size_t> uses_of(const std::vector<FeatureCurve>& curves) {
  std::map<Index, std::size_t> uses;
  for (const FeatureCurve& curve : curves)
    for (const Index v : curve.vertices) ++uses[v];
  return uses;
}

// Divides curves where others meet them, more than `limit` from their ends.
std::vector<FeatureCurve> divided_where_they_meet(const std::vector<FeatureCurve>& curves,
                                                  const std::vector<Vec3>& vertices, double limit) {
  std::map<Index, std::size_t> uses = uses_of(curves);
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

// The vector from vertex `from` of a chain to the first one that is at least `width` away along the chain, onwards or
// backwards, or else to the chain's end.
Vec3 arm_of(const std::vector<Index>& chain, std::size_t from, bool onwards, const std::vector<Vec3>& vertices,
            double width) {
  const auto last = static_cast<std::ptrdiff_t>(onwards ? chain.size() - 1 : 0),
             step = std::ptrdiff_t{onwards ? 1 : -1};
  const auto at = [&](std::ptrdiff_t k) { return vertices[chain[static_cast<std::size_t>(k)]]; };
  auto k = static_cast<std::ptrdiff_t>(from);
  double length = 0;
  while (k != last && length < width) {
    length += norm(at(k + step) - at(k));
    k += step;
  }
  return at(k) - vertices[chain[from]];
}

// Curves that leave a corner run together as long as they are nearer to each other than this part of the way from it,
// at less than 9 degrees, and than kShared.
constexpr double kTogether = 0.15;
constexpr int kSamples = 8;  // of each edge

// Sets curves that leave the same corner apart: where one runs beside another from there on, it ends on that one where
// they part. Ways that led them to the corner run along edges of the mesh, which may be as near to each other as facets
// are narrow.
class Parting {
 public:
  Parting(std::vector<FeatureCurve>& curves, const std::vector<Vec3>& vertices, double limit,
          const Csr<Index>& neighbours)
      : curves_(curves), vertices_(vertices), limit_(limit), neighbours_(neighbours) {}

  // Returns whether there were any.
  bool part() {
    std::map<Index, std::vector<std::size_t>> at;
    for (std::size_t c = 0; c < curves_.size(); ++c)
      if (!is_loop(curves_[c]))
        for (const Index v : {curves_[c].vertices.front(), curves_[c].vertices.back()}) at[v].push_back(c);
    bool any = false;
    for (const auto& [corner, ends] : at)
      for (std::size_t i = 1; i < ends.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          if (part(corner, ends[i], ends[j]) || part(corner, ends[j], ends[i])) any = true;
    std::erase_if(curves_, [](const FeatureCurve& curve) { return curve.vertices.size() < 2; });
    return any;
  }

 private:
  // From the corner on; empty if the curve does not end there any more.
  std::vector<Index> chain_from(Index corner, std::size_t c) const {
    const std::vector<Index>& chain = curves_[c].vertices;
    if (chain.size() < 2) return {};
    if (chain.front() == corner) return chain;
    return chain.back() == corner ? reversed_vertices(chain) : std::vector<Index>{};
  }

  double distance_to(const std::vector<Index>& chain, const Vec3& p) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 1; k < chain.size(); ++k)
      least = std::min(least, norm(p - nearest_on_segment(p, vertices_[chain[k - 1]], vertices_[chain[k]])));
    return least;
  }

  // Lets `goes` end on `stays`, if it runs beside that one.
  bool part(Index corner, std::size_t goes, std::size_t stays) {
    if (!is_crease(curves_[goes])) return false;
    const std::vector<Index> chain = chain_from(corner, goes), other = chain_from(corner, stays);
    if (chain.empty() || other.empty()) return false;
    const auto is_beside = [&](const Vec3& q) {
      return distance_to(other, q) < std::min(limit_, kTogether * norm(q - vertices_[corner]));
    };
    // Both may end at the same corner, and be apart between.
    const auto edge_is_beside = [&](const Vec3& from, const Vec3& to) {
      for (int k = 1; k <= kSamples; ++k)
        if (!is_beside(from + (static_cast<double>(k) / kSamples) * (to - from))) return false;
      return true;
    };
    std::size_t last = 0;
    while (last + 1 < chain.size() && edge_is_beside(vertices_[chain[last]], vertices_[chain[last + 1]])) ++last;
    if (last == 0) return false;
    const double beside = arc_lengths(chain, vertices_)[last];
    if (beside < limit_) return false;
    const Vec3& p = vertices_[chain[last]];
    std::size_t nearest = 1;
    for (std::size_t k = 2; k < other.size(); ++k)
      if (norm2(vertices_[other[k]] - p) < norm2(vertices_[other[nearest]] - p)) nearest = k;
    const std::vector<double> at = arc_lengths(other, vertices_);
    if (at.back() - at[nearest] <= limit_) nearest = other.size() - 1;
    if (at[nearest] < limit_) return false;
    std::vector<Index> rest =
        shortest_edge_way(other[nearest], 2 * kTogether * beside, vertices_, neighbours_,
                          [&](Index v, double) { return v == chain[last] ? EdgeWay::arrives : EdgeWay::goes_on; });
    if (rest.empty() || std::find(rest.begin(), rest.end(), corner) != rest.end()) return false;
    rest.insert(rest.end(), chain.begin() + static_cast<std::ptrdiff_t>(last) + 1, chain.end());
    curves_[goes].vertices = std::move(rest);
    return true;
  }

  std::vector<FeatureCurve>& curves_;
  const std::vector<Vec3>& vertices_;
  double limit_;
  const Csr<Index>& neighbours_;  // along edges of the mesh, for each vertex
};

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
    const auto leaving = [&](std::size_t c, bool starts) {
      const std::vector<Index>& chain = curves[c].vertices;
      return arm_of(chain, starts ? 0 : chain.size() - 1, starts, vertices, width);
    };
    const Vec3 u = leaving(a, a_starts), v = leaving(b, b_starts);
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

// Divides curves where they turn back: what of its seeds is on one arm would own the other arm as well. A way that
// leads a curve to another corner may leave the way that it came. An end that is shorter than the width and that no
// other curve meets goes, for the corner where it turns would be nearer to its own end than edges are long.
void divide_where_they_turn_back(std::vector<FeatureCurve>& curves, const std::vector<Vec3>& vertices, double width) {
  const double limit = kShared * width;
  std::map<Index, std::size_t> uses = uses_of(curves);
  std::vector<FeatureCurve> parts;
  for (FeatureCurve& curve : curves) {
    if (curve.closed) {
      parts.push_back(std::move(curve));
      continue;
    }
    const std::vector<Index>& chain = curve.vertices;
    const std::vector<double> at = arc_lengths(chain, vertices);
    std::vector<std::pair<double, std::size_t>> turns;  // cosine of the angle between the arms, place in the chain
    for (std::size_t k = 1; k + 1 < chain.size(); ++k) {
      if (at[k] < limit || at.back() - at[k] < limit) continue;
      const Vec3 u = arm_of(chain, k, false, vertices, width), v = arm_of(chain, k, true, vertices, width);
      if (const double cosine = dot(u, v) / (norm(u) * norm(v)); cosine > 0) turns.push_back({cosine, k});
    }
    std::sort(turns.begin(), turns.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    std::vector<std::size_t> cuts;
    for (const auto& turn : turns)
      if (std::none_of(cuts.begin(), cuts.end(),
                       [&, k = turn.second](std::size_t cut) { return std::abs(at[cut] - at[k]) < width; }))
        cuts.push_back(turn.second);
    std::sort(cuts.begin(), cuts.end());
    const bool may_go = !cuts.empty() && is_crease(curve);
    const bool first_goes = may_go && at[cuts.front()] < width && uses[chain.front()] == 1;
    const bool last_goes = may_go && at.back() - at[cuts.back()] < width && uses[chain.back()] == 1;
    std::vector<std::vector<Index>> pieces = divided(chain, cuts);
    for (std::size_t k = 0; k < pieces.size(); ++k)
      if (!(k == 0 && first_goes) && !(k + 1 == pieces.size() && last_goes))
        parts.push_back({std::move(pieces[k]), false, curve.kind});
  }
  curves = std::move(parts);
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

std::vector<std::vector<Index>> corner_links(const FeatureGraph& graph, const std::vector<Vec3>& vertices,
                                             const Csr<Index>& neighbours, double reach) {
  enum : char { plain, on_curve, corner };
  std::vector<char> kinds(vertices.size(), plain);
  for (const FeatureCurve& curve : graph.curves)
    for (const Index v : curve.vertices) kinds[v] = on_curve;
  for (const Index v : graph.corners) kinds[v] = corner;
  std::vector<std::vector<std::vector<Index>>> from(graph.corners.size());
  parallel_each(
      from.size(),
      [&](std::size_t c) {
        const Index start = graph.corners[c];
        std::size_t reached = 0;
        from[c] = shortest_edge_ways(start, reach, vertices, neighbours, graph.corners.size(), [&](Index v, double) {
          if (v == start) return EdgeWay::goes_on;
          if (kinds[v] == corner) return start < v ? EdgeWay::arrives : EdgeWay::ends;
          return kinds[v] == plain && ++reached < kMostOnWays ? EdgeWay::goes_on : EdgeWay::ends;
        });
        // Single edges may be longer.
        std::erase_if(from[c], [](const std::vector<Index>& way) { return way.size() == 2; });
        for (const Index* other = neighbours.begin(start); other != neighbours.end(start); ++other)
          if (start < *other && kinds[*other] == corner &&
              !std::binary_search(graph.edges.begin(), graph.edges.end(), std::array{start, *other}))
            from[c].push_back({start, *other});
      },
      kCornersAtOnce);
  std::vector<std::vector<Index>> ways;
  for (std::vector<std::vector<Index>>& some : from)
    ways.insert(ways.end(), std::move_iterator(some.begin()), std::move_iterator(some.end()));
  return ways;
}

SimplifiedFeatures simplify_features(const FeatureGraph& graph, const std::vector<Vec3>& vertices,
                                     const std::vector<double>& given_weights, double width,
                                     const std::vector<std::vector<Index>>& links, const Csr<Index>& neighbours) {
  SimplifiedFeatures result;
  if (!(width > 0)) {
    result.graph = graph;
    return result;
  }
  FeatureGraph linked = graph;
  std::vector<double> weights = given_weights;
  for (const std::vector<Index>& way : links) {
    linked.curves.push_back({way, false, FeatureKind::crease});
    weights.push_back(0);
  }
  const FeatureCurves curves(linked, vertices);
  const CornerGraph::Forest forest = CornerGraph(curves, weights, graph.curves.size()).merge(width);
  std::vector<Candidate> candidates =
      led_to_representatives(curves, graph.curves.size(), vertices, weights, forest, width, neighbours, result);
  SelectedCreases apart = select_creases(std::move(candidates), vertices, width, neighbours);
  // What runs beside others for less than two widths is still there, however near it is; and the nearer it is, the
  // shorter is what goes.
  const SelectedCreases selected = select_creases(std::move(apart.curves), vertices, kShared * width, neighbours);
  result.merged += apart.gone + selected.gone;
  std::vector<FeatureCurve> left;
  for (const Candidate& candidate : selected.curves) left.push_back(candidate.curve);
  // Corners on no curve, such as the tips of cones.
  std::vector<char> on_curve(graph.corners.size(), 0);
  for (Index c = 0; c < graph.curves.size(); ++c)
    if (!curves.closed(c))
      for (const Index end : curves.ends(c)) on_curve[end] = 1;
  for (Index k = 0; k < graph.corners.size(); ++k)
    if (!on_curve[k] && !apart.points.is_near(vertices[graph.corners[k]]))
      result.graph.corners.push_back(graph.corners[k]);

  // Ways to the same corner may run along the same edges: more of them than the corner's cell can hold no seeds mend.
  const double limit = kShared * width;
  const auto separate = [&] {
    left = divided_where_they_meet(without_shared_edges(left, vertices, limit), vertices, limit);
  };
  separate();
  if (neighbours.rows() > 0 && Parting(left, vertices, limit, neighbours).part()) separate();
  join_straight(left, vertices, width);
  divide_where_they_turn_back(left, vertices, width);
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
