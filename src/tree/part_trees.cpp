#include "tree/part_trees.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include "core/disjoint_sets.h"
#include "tree/point_graph.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

// Lengths in the height of the highest point.
constexpr double kLink = 0.025;          // steps so long hang together, at most
constexpr double kLevel = 0.05;          // above a known ground, where stems are looked for: below there may be grass
constexpr double kLow = 0.15;            // height in which stems come up
constexpr double kHolding = 0.1;         // height over which a stem stands by itself
constexpr double kStoutest = 0.05;       // radius of a trunk, at most
constexpr double kLowPlant = 0.2;        // height of low plants, at most
constexpr double kFar = 0.15;            // a step to what belongs to no tree
constexpr double kLinkSpacings = 6;      // kLink in the median distance of neighbours, at least
constexpr double kSteepest = 0.2;        // slope of a ground that is not known
constexpr double kLean = 0.5;            // tangent of a stem's angle off the vertical, at most
constexpr double kBeside = 2;            // radii of a stem, off its middle
constexpr std::size_t kSteps = 5;        // of height, in which it shows
constexpr double kFlare = 3;             // radii of the stem that its base spreads to
constexpr std::size_t kLeastInStep = 4;  // points that tell where it is

struct Minimum {
  Index point = kNone;
  double held = 0;  // height up to which it stands by itself
};

struct Stem {
  Index lowest = kNone;
  Vec3 centre;
  double radius = 0;
  bool rises = false;         // steeply, at every height over which a stem stands by itself
  std::vector<Index> points;  // where it is narrowest
};

class Parting {
 public:
  Parting(const std::vector<Vec3>& points, const std::vector<double>& heights, bool ground_is_known)
      : points_(points), heights_(heights), ground_is_known_(ground_is_known), graph_(ways_graph(points)) {
    size_ = *std::max_element(heights.begin(), heights.end()) -
            (ground_is_known ? 0 : *std::min_element(heights.begin(), heights.end()));
    std::vector<double> shortest(points.size(), std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < graph_.rows(); ++i)
      for (const Index* j = graph_.begin(i); j != graph_.end(i); ++j)
        shortest[i] = std::min(shortest[i], norm(points_[*j] - points_[i]));
    link_ = std::max(kLink * size_, kLinkSpacings * quantile(std::move(shortest), 0.5));
  }

  PartedTrees part(const Context& context) {
    find_stems();
    context.check();
    PartedTrees result;
    result.tree.assign(points_.size(), kNone);
    result.low.assign(points_.size(), 0);
    if (stems_.empty()) return result;
    find_low_plants(result.low);
    context.check();
    walk(result.low, result.tree);
    result.base = find_bases(result.tree);
    return result;
  }

 private:
  bool linked(Index i, Index j) const { return norm2(points_[i] - points_[j]) <= link_ * link_; }

  // By the rising level, with the heights at which parts join.
  std::vector<Minimum> find_minima() const {
    std::vector<Index> order;
    const double level = ground_is_known_ ? kLevel * size_ : -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (heights_[i] >= level) order.push_back(static_cast<Index>(i));
    std::sort(order.begin(), order.end(),
              [&](Index a, Index b) { return std::pair(heights_[a], a) < std::pair(heights_[b], b); });
    std::vector<std::size_t> rank(points_.size(), std::numeric_limits<std::size_t>::max());
    for (std::size_t k = 0; k < order.size(); ++k) rank[order[k]] = k;
    // The root of a set is its first point, for sets are of ranks.
    DisjointSets<> parts(order.size());
    std::vector<double> top(order.size()), held(order.size(), -1);
    for (std::size_t k = 0; k < order.size(); ++k) {
      const Index i = order[k];
      top[k] = heights_[i];
      for (const Index* j = graph_.begin(i); j != graph_.end(i); ++j) {
        const std::size_t other = rank[*j];
        if (other >= k || !linked(i, *j)) continue;
        const std::size_t a = parts.root(k), b = parts.root(other);
        if (a == b) continue;
        held[std::max(a, b)] = heights_[i];
        parts.join(a, b);
        top[std::min(a, b)] = heights_[i];
      }
    }
    std::vector<Minimum> minima;
    for (std::size_t k = 0; k < order.size(); ++k)
      minima.push_back({order[k], held[k] >= 0 || !parts.is_root(k) ? held[k] : top[k]});
    return minima;
  }

  void find_stems() {
    for (const Minimum& minimum : find_minima()) {
      const Index low = minimum.point;
      if (minimum.held - heights_[low] < kHolding * size_ || !is_low(low)) continue;
      Stem stem = stem_from(low);
      if (!stem.rises || stem.radius > kStoutest * size_ || continues(stem)) continue;
      stems_.push_back(std::move(stem));
    }
  }

  bool is_low(Index i) const {
    if (ground_is_known_ || stems_.empty()) return heights_[i] < kLow * size_ + lowest();
    return std::any_of(stems_.begin(), stems_.end(), [&](const Stem& stem) {
      const Vec3 way = points_[i] - stem.centre;
      return heights_[i] - heights_[stem.lowest] <= kLevel * size_ + kSteepest * std::hypot(way.x, way.y);
    });
  }
  double lowest() const { return ground_is_known_ ? 0 : *std::min_element(heights_.begin(), heights_.end()); }

  // Whether another stem, hidden in between, leads to it.
  bool continues(const Stem& stem) const {
    return std::any_of(stems_.begin(), stems_.end(), [&](const Stem& other) {
      const Vec3 way = stem.centre - other.centre;
      return std::hypot(way.x, way.y) <= other.radius + stem.radius + kLean * std::max(way.z, 0.0);
    });
  }

  // What hangs together above a point up to the height over which a stem stands by itself.
  Stem stem_from(Index low) const {
    Stem stem;
    stem.lowest = low;
    std::vector<char> seen(points_.size(), 0);
    seen[low] = 1;
    stem.points.push_back(low);
    for (std::size_t k = 0; k < stem.points.size(); ++k) {
      const Index i = stem.points[k];
      for (const Index* j = graph_.begin(i); j != graph_.end(i); ++j) {
        const double up = heights_[*j] - heights_[low];
        if (seen[*j] || up < 0 || up > kHolding * size_ || !linked(i, *j)) continue;
        seen[*j] = 1;
        stem.points.push_back(*j);
      }
    }
    // Boughs, leaves and bushes may be around some of its height: the narrowest steps tell where it is and how thick.
    std::vector<std::vector<Index>> steps(kSteps);
    for (const Index i : stem.points) {
      const double up = (heights_[i] - heights_[low]) / (kHolding * size_);
      steps[std::min(kSteps - 1, static_cast<std::size_t>(up * kSteps))].push_back(i);
    }
    std::vector<Stem> sections;
    for (const std::vector<Index>& step : steps)
      if (step.size() >= kLeastInStep) sections.push_back(section_of(step));
    if (sections.size() < 2) return stem;
    std::stable_sort(sections.begin(), sections.end(),
                     [](const Stem& a, const Stem& b) { return a.radius < b.radius; });
    stem.centre = sections[0].centre;
    stem.radius = sections[1].radius;
    std::vector<char> occupied(kSteps, 0);
    for (std::size_t k = 0; k < kSteps; ++k)
      for (const Index i : steps[k]) {
        const Vec3 off = points_[i] - stem.centre;
        if (std::hypot(off.x, off.y) <= kBeside * stem.radius + kLean * std::abs(off.z)) occupied[k] = 1;
      }
    stem.points = sections[0].points;
    std::erase_if(stem.points, [&](Index i) {
      return std::hypot(points_[i].x - stem.centre.x, points_[i].y - stem.centre.y) > kBeside * stem.radius;
    });
    stem.rises = std::count(occupied.begin(), occupied.end(), 1) == static_cast<std::ptrdiff_t>(kSteps);
    return stem;
  }

  // Of points at about one height.
  Stem section_of(const std::vector<Index>& points) const {
    Stem section;
    section.points = points;
    std::vector<double> x, y, z, off;
    for (const Index i : points) {
      x.push_back(points_[i].x);
      y.push_back(points_[i].y);
      z.push_back(points_[i].z);
    }
    section.centre = {quantile(x, 0.5), quantile(y, 0.5), quantile(z, 0.5)};
    for (std::size_t k = 0; k < x.size(); ++k)
      off.push_back(std::hypot(x[k] - section.centre.x, y[k] - section.centre.y));
    section.radius = quantile(off, 0.75);
    return section;
  }

  // From what is near the ground beside the stems, along short steps.
  void find_low_plants(std::vector<char>& low) const {
    std::vector<Index> label(points_.size(), kNone);
    std::vector<std::pair<Index, Index>> sources;
    const auto plants = static_cast<Index>(stems_.size());
    for (std::size_t s = 0; s < stems_.size(); ++s)
      for (const Index i : stems_[s].points) sources.emplace_back(i, static_cast<Index>(s));
    for (std::size_t i = 0; ground_is_known_ && i < points_.size(); ++i)
      if (heights_[i] < kLevel * size_ && !at_a_stem(points_[i])) sources.emplace_back(static_cast<Index>(i), plants);
    dijkstra(sources, link_, {}, label);
    // Parts apart that don't rise much.
    std::vector<Index> part(points_.size(), kNone);
    std::vector<Index> members;
    for (std::size_t start = 0; start < points_.size(); ++start) {
      if (label[start] != kNone || part[start] != kNone || !(heights_[start] < kLevel * size_ + lowest())) continue;
      members.assign(1, static_cast<Index>(start));
      part[start] = 0;
      double top = 0;
      for (std::size_t k = 0; k < members.size(); ++k) {
        top = std::max(top, heights_[members[k]] - lowest());
        for (const Index* j = graph_.begin(members[k]); j != graph_.end(members[k]); ++j)
          if (part[*j] == kNone && label[*j] == kNone && linked(members[k], *j)) {
            part[*j] = 0;
            members.push_back(*j);
          }
      }
      if (top < kLowPlant * size_)
        for (const Index i : members) low[i] = 1;
    }
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (label[i] == plants && heights_[i] < kLowPlant * size_) low[i] = 1;
  }

  bool at_a_stem(const Vec3& p) const {
    return std::any_of(stems_.begin(), stems_.end(), [&](const Stem& stem) { return is_at(stem, p); });
  }
  static bool is_at(const Stem& stem, const Vec3& p) {
    return std::hypot(p.x - stem.centre.x, p.y - stem.centre.y) <= kFlare * stem.radius;
  }

  void walk(const std::vector<char>& low, std::vector<Index>& tree) const {
    std::vector<std::pair<Index, Index>> sources;
    for (std::size_t s = 0; s < stems_.size(); ++s)
      for (const Index i : stems_[s].points) sources.emplace_back(i, static_cast<Index>(s));
    dijkstra(sources, kFar * size_, low, tree);
  }

  // The lowest points of the trees at their stems.
  std::vector<Index> find_bases(const std::vector<Index>& tree) const {
    std::vector<Index> base;
    for (const Stem& stem : stems_) base.push_back(stem.lowest);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (const Index t = tree[i]; t != kNone && is_at(stems_[t], points_[i]) && heights_[i] < heights_[base[t]])
        base[t] = static_cast<Index>(i);
    return base;
  }

  // Sums of squared steps from sources (point, label), of steps up to `longest`; `barred` points are not entered.
  void dijkstra(const std::vector<std::pair<Index, Index>>& sources, double longest, const std::vector<char>& barred,
                std::vector<Index>& label) const {
    using Entry = std::tuple<double, Index, Index>;  // cost, point, label
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (const auto& [i, name] : sources) queue.emplace(0.0, i, name);
    while (!queue.empty()) {
      const auto [cost, i, name] = queue.top();
      queue.pop();
      if (label[i] != kNone) continue;
      label[i] = name;
      for (const Index* j = graph_.begin(i); j != graph_.end(i); ++j) {
        if (label[*j] != kNone || (!barred.empty() && barred[*j])) continue;
        const double squared = norm2(points_[*j] - points_[i]);
        if (squared <= longest * longest) queue.emplace(cost + squared, *j, name);
      }
    }
  }

  const std::vector<Vec3>& points_;
  const std::vector<double>& heights_;
  bool ground_is_known_;
  Csr<Index> graph_;
  double size_ = 0, link_ = 0;
  std::vector<Stem> stems_;
};

}  // namespace

PartedTrees part_trees(const std::vector<Vec3>& points, const std::vector<double>& heights, bool ground_is_known,
                       const Context& context) {
  return Parting(points, heights, ground_is_known).part(context);
}

}  // namespace bisector
