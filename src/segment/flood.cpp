#include "segment/flood.h"

#include <algorithm>
#include <queue>

namespace bisector {
namespace {

constexpr std::size_t kMostSearched =
    40;                      // triangles about one that is to leave its region, to see that the rest hangs together
constexpr int kRounds = 20;  // of moves at borders
// What rounding alone could turn is left as it is: relative and absolute slack of squared distances in the unit-sized
// model.
constexpr double kRelativeSlack = 1e-9, kAbsoluteSlack = 1e-18;

struct Offer {
  double distance;
  Index triangle, region;
};

// The least distance first; ties by triangle, then region.
struct Later {
  bool operator()(const Offer& a, const Offer& b) const {
    if (a.distance != b.distance) return a.distance > b.distance;
    return a.triangle != b.triangle ? a.triangle > b.triangle : a.region > b.region;
  }
};

// Whether a region stays connected without one of its triangles; searched for among few triangles around it only, so a
// region may be said to come apart where it has a long way round.
class Bridges {
 public:
  explicit Bridges(const SegmentDomain& domain) : graph_(domain.graph), seen_(domain.triangles.size(), 0) {}

  bool removable(const std::vector<Index>& labels, Index triangle) {
    const Index region = labels[triangle];
    own_.clear();
    for (const Index* n = graph_.neighbours.begin(triangle); n != graph_.neighbours.end(triangle); ++n)
      if (labels[*n] == region) own_.push_back(*n);
    if (own_.size() < 2) return own_.size() == 1;  // the last triangle of a region stays
    ++stamp_;
    seen_[triangle] = stamp_;
    queue_.assign(1, own_[0]);
    seen_[own_[0]] = stamp_;
    std::size_t missing = own_.size() - 1;
    for (std::size_t k = 0; k < queue_.size() && queue_.size() < kMostSearched; ++k)
      for (const Index* n = graph_.neighbours.begin(queue_[k]); n != graph_.neighbours.end(queue_[k]); ++n) {
        if (labels[*n] != region || seen_[*n] == stamp_) continue;
        seen_[*n] = stamp_;
        queue_.push_back(*n);
        if (std::find(own_.begin(), own_.end(), *n) != own_.end() && --missing == 0) return true;
      }
    return false;
  }

 private:
  const DualGraph& graph_;
  std::vector<std::uint32_t> seen_;
  std::uint32_t stamp_ = 0;
  std::vector<Index> own_, queue_;
};

}  // namespace

void flood(const SegmentDomain& domain, const std::vector<Proxy>& proxies, const std::vector<FloodSeed>& seeds,
           std::vector<Index>& labels, std::vector<double>& distances, std::size_t& evaluations) {
  std::priority_queue<Offer, std::vector<Offer>, Later> queue;
  std::vector<Index> offered(labels.size(), kNone);
  const auto take = [&](Index t, Index region, double distance) {
    labels[t] = region;
    distances[t] = distance;
  };
  const auto offer_neighbours = [&](Index t, Index region) {
    for (const Index* n = domain.graph.neighbours.begin(t); n != domain.graph.neighbours.end(t); ++n) {
      // A region reaches a triangle from several sides, at the same distance.
      if (labels[*n] != kNone || offered[*n] == region) continue;
      offered[*n] = region;
      queue.push({distance_to(domain, *n, proxies[region]), *n, region});
      ++evaluations;
    }
  };
  for (const FloodSeed& seed : seeds)
    take(seed.triangle, seed.region, distance_to(domain, seed.triangle, proxies[seed.region]));
  for (const FloodSeed& seed : seeds) offer_neighbours(seed.triangle, seed.region);
  evaluations += seeds.size();
  while (!queue.empty()) {
    const Offer offer = queue.top();
    queue.pop();
    if (labels[offer.triangle] != kNone) continue;
    take(offer.triangle, offer.region, offer.distance);
    offer_neighbours(offer.triangle, offer.region);
  }
}

std::size_t relax_borders(const SegmentDomain& domain, const std::vector<Proxy>& proxies, std::vector<Index> triangles,
                          std::vector<Index>& labels, std::vector<double>& distances, std::size_t& evaluations) {
  const auto& neighbours = domain.graph.neighbours;
  Bridges bridges(domain);
  std::vector<Index> next;
  std::size_t moved = 0;
  for (int round = 0; round < kRounds && !triangles.empty(); ++round) {
    next.clear();
    for (const Index t : triangles) {
      Index best = labels[t];
      double least = distances[t] * (1 - kRelativeSlack) - kAbsoluteSlack * domain.areas[t];
      for (const Index* n = neighbours.begin(t); n != neighbours.end(t); ++n) {
        const Index other = labels[*n];
        if (other == labels[t] || other == best) continue;
        const double d = distance_to(domain, t, proxies[other]);
        ++evaluations;
        if (d < least) {
          least = d;
          best = other;
        }
      }
      if (best == labels[t] || !bridges.removable(labels, t)) continue;
      labels[t] = best;
      distances[t] = least;
      ++moved;
      next.push_back(t);
      next.insert(next.end(), neighbours.begin(t), neighbours.end(t));
    }
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    triangles.swap(next);
  }
  return moved;
}

}  // namespace bisector
