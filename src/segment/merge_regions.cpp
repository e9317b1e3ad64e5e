#include "segment/merge_regions.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <utility>

#include "core/grouping.h"
#include "segment/plane_moments.h"
#include "segment/primitive_fit.h"
#include "segment/proxy.h"

namespace bisector {
namespace {

constexpr int kPollEvery = 1024;            // mergings of triangles after which the context is asked whether to go on
constexpr std::size_t kTorusSamples = 96;   // points of a pair of regions that tori are fitted to
constexpr std::size_t kLeastForTorus = 12;  // triangles of a pair that tori are tried on
constexpr std::size_t kFewForTori =
    60;  // regions from which on tori are tried: they are dear, and on small regions quadrics do
constexpr double kPoorFit = 1.5;  // growth of the squared distance from which on a torus is worth trying

struct Pair {
  double cost;  // or no more than the cost
  Index a, b;
  std::uint32_t version_a, version_b;
  bool exact;
};

struct Dearer {
  bool operator()(const Pair& x, const Pair& y) const {
    if (x.cost != y.cost) return x.cost > y.cost;
    return x.a != y.a ? x.a > y.a : x.b > y.b;
  }
};

// Regions that are merged pairwise: who is left, who borders on whom, and a queue of pairs.
class Merger {
 public:
  Merger(const DualGraph& graph, const std::vector<Index>& labels, std::size_t regions)
      : parent_(regions), version_(regions, 0), neighbours_(regions), left_(regions) {
    for (Index r = 0; r < regions; ++r) parent_[r] = r;
    for (std::size_t t = 0; t < labels.size(); ++t)
      for (const Index* n = graph.neighbours.begin(t); n != graph.neighbours.end(t); ++n)
        if (labels[*n] != labels[t]) neighbours_[labels[t]].push_back(labels[*n]);
    for (auto& row : neighbours_) make_unique(row);
  }

  std::size_t left() const { return left_; }
  const std::vector<Index>& neighbours(Index r) const { return neighbours_[r]; }
  void offer(Index a, Index b, double cost, bool exact = true) {
    if (a > b) std::swap(a, b);
    if (cost < std::numeric_limits<double>::infinity()) queue_.push({cost, a, b, version_[a], version_[b], exact});
  }
  // Takes all offers back.
  void forget() { queue_ = {}; }
  // The cheapest pair that is up to date; false: there is none.
  bool next(Pair& pair) {
    while (!queue_.empty()) {
      pair = queue_.top();
      queue_.pop();
      if (parent_[pair.a] == pair.a && parent_[pair.b] == pair.b && version_[pair.a] == pair.version_a &&
          version_[pair.b] == pair.version_b)
        return true;
    }
    return false;
  }
  // b becomes part of a.
  void merge(Index a, Index b) {
    parent_[b] = a;
    ++version_[a];
    --left_;
    std::vector<Index> joined;
    for (const Index from : {a, b})
      for (const Index n : neighbours_[from])
        if (n != a && n != b) joined.push_back(n);
    make_unique(joined);
    for (const Index n : neighbours_[b]) {
      if (n == a) continue;
      auto& row = neighbours_[n];
      row.erase(std::lower_bound(row.begin(), row.end(), b));
      const auto at = std::lower_bound(row.begin(), row.end(), a);
      if (at == row.end() || *at != a) row.insert(at, a);
    }
    neighbours_[a] = std::move(joined);
    neighbours_[b].clear();
  }
  // The labels of what is left, numbered from 0.
  std::vector<Index> relabel(const std::vector<Index>& labels) {
    std::vector<Index> number(parent_.size(), kNone), result(labels.size());
    Index count = 0;
    for (std::size_t t = 0; t < labels.size(); ++t) {
      Index r = labels[t];
      while (parent_[r] != r) r = parent_[r] = parent_[parent_[r]];
      if (number[r] == kNone) number[r] = count++;
      result[t] = number[r];
    }
    return result;
  }

 private:
  static void make_unique(std::vector<Index>& row) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
  }

  std::vector<Index> parent_;
  std::vector<std::uint32_t> version_;
  std::vector<std::vector<Index>> neighbours_;
  std::size_t left_;
  std::priority_queue<Pair, std::vector<Pair>, Dearer> queue_;
};

struct Region {
  SurfaceMoments moments;
  std::vector<Index> triangles;
  double squared_distance = 0;
};

class SurfaceMerging {
 public:
  // `measured`: costs are from distances of all triangles, not from moments alone, which see only the first order of
  // a quadric's distance.
  SurfaceMerging(const SegmentDomain& domain, const std::vector<Index>& labels, SegmentSurfaces surfaces, bool measured)
      : domain_(domain), surfaces_(surfaces), measured_(measured) {
    const std::size_t count = 1 + *std::max_element(labels.begin(), labels.end());
    const Csr<Index> rows = items_of_labels<Index>(labels, count);
    regions_.resize(count);
    for (std::size_t r = 0; r < count; ++r) {
      Region& region = regions_[r];
      region.triangles.assign(rows.begin(r), rows.end(r));
      region.moments = sum_of_moments(domain, {rows.begin(r), rows.end(r)});
      region.squared_distance = fitted(region.moments, region.triangles, {});
      total_ += region.squared_distance;
    }
  }

  double total() const { return total_; }
  void allow_tori() { tori_ = surfaces_ == SegmentSurfaces::all; }
  double cost(Index a, Index b) const {
    return union_distance(a, b) - regions_[a].squared_distance - regions_[b].squared_distance;
  }
  void merge(Index a, Index b, double cost) {
    Region &into = regions_[a], &from = regions_[b];
    into.squared_distance += from.squared_distance + cost;
    into.moments = merged(into.moments, from.moments);
    std::vector<Index> both;
    both.reserve(into.triangles.size() + from.triangles.size());
    std::merge(into.triangles.begin(), into.triangles.end(), from.triangles.begin(), from.triangles.end(),
               std::back_inserter(both));
    into.triangles = std::move(both);
    from.triangles = {};
    total_ += cost;
  }

 private:
  // Of the triangles of two lists.
  double fitted(const SurfaceMoments& moments, const std::vector<Index>& a, const std::vector<Index>& b) const {
    const bool few = a.size() + b.size() < kLeastForQuadric;
    const ProxyFit fit = fit_proxy(moments, few ? SegmentSurfaces::planes : surfaces_);
    if (!measured_ || fit.plane) return fit.squared_distance;
    double sum = 0;
    for (const auto* triangles : {&a, &b})
      for (const Index t : *triangles) sum += distance_to(domain_, t, fit.proxy);
    return std::min(std::max(sum, fit.squared_distance), fit_plane(moments).squared_distance);
  }
  double union_distance(Index a, Index b) const {
    const Region &first = regions_[a], &second = regions_[b];
    const SurfaceMoments both = merged(first.moments, second.moments);
    const std::size_t count = first.triangles.size() + second.triangles.size();
    double least = fitted(both, first.triangles, second.triangles);
    if (!tori_) return least;
    // Only where the pair does not fit otherwise.
    const double apart = first.squared_distance + second.squared_distance;
    if (least <= kPoorFit * apart + 1e-12 * both.area() || count < kLeastForTorus) return least;
    std::vector<Index> triangles;
    triangles.reserve(count);
    std::merge(first.triangles.begin(), first.triangles.end(), second.triangles.begin(), second.triangles.end(),
               std::back_inserter(triangles));
    const SurfaceSamples samples = sample_triangles(domain_, triangles, kTorusSamples);
    double weight = 0;
    for (const double w : samples.weights) weight += w;
    if (!(weight > 0)) return least;
    if (const auto torus = fit_primitive(SurfaceType::torus, samples, least / both.area() * weight))
      least = std::min(least, torus->squared_distance / weight * both.area());
    return least;
  }

  const SegmentDomain& domain_;
  SegmentSurfaces surfaces_;
  bool measured_;
  std::vector<Region> regions_;
  double total_ = 0;
  bool tori_ = false;
};

}  // namespace

std::vector<Index> merge_into_planes(const SegmentDomain& domain, std::size_t count, double most,
                                     const Context& context) {
  const std::size_t n = domain.triangles.size();
  std::vector<PlaneMoments> moments(n);
  std::vector<double> distance(n, 0);
  std::vector<Index> labels(n);
  for (std::size_t t = 0; t < n; ++t) {
    moments[t] = plane_moments(domain, static_cast<Index>(t));
    distance[t] = moments[t].squared_distance();
    labels[t] = static_cast<Index>(t);
  }
  Merger merger(domain.graph, labels, n);
  const auto union_distance = [&](Index a, Index b) {
    PlaneMoments both = moments[a];
    both.add(moments[b]);
    return both.squared_distance();
  };
  const auto offer = [&](Index a, Index b) { merger.offer(a, b, union_distance(a, b) - distance[a] - distance[b]); };
  for (Index t = 0; t < n; ++t)
    for (const Index other : merger.neighbours(t))
      if (t < other) offer(t, other);
  Pair pair;
  int poll = 0;
  double total = std::accumulate(distance.begin(), distance.end(), 0.0);
  while (merger.left() > count && merger.next(pair)) {
    if (++poll % kPollEvery == 0) context.check();
    total += pair.cost;
    if (total > most) break;
    distance[pair.a] += distance[pair.b] + pair.cost;
    moments[pair.a].add(moments[pair.b]);
    merger.merge(pair.a, pair.b);
    for (const Index other : merger.neighbours(pair.a)) offer(pair.a, other);
  }
  return merger.relabel(labels);
}

std::vector<Index> merge_regions(const SegmentDomain& domain, std::vector<Index> labels, const RegionMerging& options,
                                 const Context& context) {
  SurfaceMerging regions(domain, labels, options.surfaces, options.count == 0);
  const std::size_t count = 1 + *std::max_element(labels.begin(), labels.end());
  Merger merger(domain.graph, labels, count);
  // Of each pair of neighbours, the lower first: its cost, or a lower bound.
  std::vector<std::map<Index, double>> known(count);
  const auto known_cost = [&](Index a, Index b) -> double& { return known[std::min(a, b)][std::max(a, b)]; };
  const auto offer_all = [&] {
    for (Index r = 0; r < count; ++r)
      for (const Index other : merger.neighbours(r))
        if (r < other) merger.offer(r, other, known_cost(r, other) = regions.cost(r, other));
  };
  offer_all();
  // Tori are dear to fit, and while regions are small quadrics do as well.
  const std::size_t few = std::max<std::size_t>(kFewForTori, 3 * options.count);
  bool tori = false;
  Pair pair;
  while (merger.left() > std::max<std::size_t>(1, options.count) && merger.next(pair)) {
    context.check();
    if (!pair.exact) {
      merger.offer(pair.a, pair.b, known_cost(pair.a, pair.b) = regions.cost(pair.a, pair.b));
      continue;
    }
    const bool last = options.count == 0 && regions.total() + pair.cost > options.squared_distance;
    if (!tori && (last || merger.left() <= few)) {
      tori = true;
      regions.allow_tori();
      merger.forget();
      offer_all();
      continue;
    }
    if (last) break;
    // A surface for the union of a, b and c is no nearer to c and a than one for these two alone, and to b than b's
    // own. So the union with c costs at least what c and a, or c and b, cost without what a and b cost: pairs are
    // fitted once they are the cheapest by that.
    std::map<Index, double> costs;
    for (const Index from : {pair.a, pair.b})
      for (const Index other : merger.neighbours(from)) {
        if (other == pair.a || other == pair.b) continue;
        double& cost = costs.try_emplace(other, 0).first->second;
        cost = std::max(cost, known_cost(from, other) - pair.cost);
      }
    regions.merge(pair.a, pair.b, pair.cost);
    merger.merge(pair.a, pair.b);
    known[pair.b].clear();
    for (const Index other : merger.neighbours(pair.a)) {
      const double cost = costs.at(other);
      known[std::min(pair.b, other)].erase(std::max(pair.b, other));
      merger.offer(pair.a, other, known_cost(pair.a, other) = cost, false);
    }
  }
  return merger.relabel(labels);
}

}  // namespace bisector
