#include "segment/flood.h"

#include <algorithm>
#include <utility>

namespace bisector {
namespace {

constexpr std::size_t kMostSearched =
    40;                      // triangles about one that is to leave its region, to see that the rest hangs together
constexpr int kRounds = 20;  // of moves at borders
// What rounding alone could turn is left as it is: relative and absolute slack of squared distances in the unit-sized
// model.
constexpr double kRelativeSlack = 1e-9, kAbsoluteSlack = 1e-18;

}  // namespace

void Flooding::fill(const std::vector<Proxy>& proxies, const std::vector<FloodSeed>& seeds, std::vector<Index>& labels,
                    std::vector<double>& distances, std::size_t& evaluations) {
  const auto take = [&](Index t, Index region, double distance) {
    labels[t] = region;
    distances[t] = distance;
    filled_.push_back(t);
  };
  const auto offer_neighbours = [&](Index t, Index region) {
    for (const Index* n = domain_.graph.neighbours.begin(t); n != domain_.graph.neighbours.end(t); ++n) {
      // A region reaches a triangle from several sides, at the same distance.
      if (labels[*n] != kNone || offered_[*n] == region) continue;
      offered_[*n] = region;
      queue_.push_back({distance_to(domain_, *n, proxies[region]), *n, region});
      std::push_heap(queue_.begin(), queue_.end(), later);
      ++evaluations;
    }
  };
  for (const FloodSeed& seed : seeds)
    take(seed.triangle, seed.region, distance_to(domain_, seed.triangle, proxies[seed.region]));
  for (const FloodSeed& seed : seeds) offer_neighbours(seed.triangle, seed.region);
  evaluations += seeds.size();
  while (!queue_.empty()) {
    const Offer offer = queue_.front();
    std::pop_heap(queue_.begin(), queue_.end(), later);
    queue_.pop_back();
    if (labels[offer.triangle] != kNone) continue;
    take(offer.triangle, offer.region, offer.distance);
    offer_neighbours(offer.triangle, offer.region);
  }
  for (const Index t : filled_) offered_[t] = kNone;
  filled_.clear();
}

bool BorderMoves::removable(const std::vector<Index>& labels, Index triangle) {
  const auto& neighbours = domain_.graph.neighbours;
  const Index region = labels[triangle];
  own_.clear();
  for (const Index* n = neighbours.begin(triangle); n != neighbours.end(triangle); ++n)
    if (labels[*n] == region) own_.push_back(*n);
  if (own_.size() < 2) return own_.size() == 1;  // the last triangle of a region stays
  ++search_;
  seen_[triangle] = search_;
  queue_.assign(1, own_[0]);
  seen_[own_[0]] = search_;
  std::size_t missing = own_.size() - 1;
  for (std::size_t k = 0; k < queue_.size() && queue_.size() < kMostSearched; ++k)
    for (const Index* n = neighbours.begin(queue_[k]); n != neighbours.end(queue_[k]); ++n) {
      if (labels[*n] != region || seen_[*n] == search_) continue;
      seen_[*n] = search_;
      queue_.push_back(*n);
      if (std::find(own_.begin(), own_.end(), *n) != own_.end() && --missing == 0) return true;
    }
  return false;
}

std::size_t BorderMoves::relax(const std::vector<Proxy>& proxies, std::vector<Index> triangles,
                               std::vector<Index>& labels, std::vector<double>& distances, std::size_t& evaluations,
                               const std::function<void(Index, Index, double)>& before_move) {
  const auto& neighbours = domain_.graph.neighbours;
  std::vector<Index> next;
  std::size_t moved = 0;
  for (int round = 0; round < kRounds && !triangles.empty(); ++round) {
    next.clear();
    for (const Index t : triangles) {
      Index best = labels[t];
      double least = distances[t] * (1 - kRelativeSlack) - kAbsoluteSlack * domain_.areas[t];
      for (const Index* n = neighbours.begin(t); n != neighbours.end(t); ++n) {
        const Index other = labels[*n];
        if (other == labels[t] || other == best) continue;
        const double d = distance_to(domain_, t, proxies[other]);
        ++evaluations;
        if (d < least) {
          least = d;
          best = other;
        }
      }
      if (best == labels[t] || !removable(labels, t)) continue;
      before_move(t, best, least);
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
