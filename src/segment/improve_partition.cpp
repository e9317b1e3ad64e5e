#include "segment/improve_partition.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>

#include "core/grouping.h"
#include "core/parallel.h"
#include "segment/flood.h"

namespace bisector {
namespace {

// Division of a region in two.
constexpr int kFirstSteps = 2,
              kMoreSteps = 4;  // of Lloyd's iteration in the region: from each start, then from the best
constexpr double kFlatShare = 0.6, kRestShare = 0.1;  // of the triangles, that a plane is taken out of the region with
constexpr int kTrimSteps = 4, kAverages = 4;  // of trimmed least squares, and of averaging over neighbours in each

// Teleportation: a region is removed and another one divided.
constexpr int kTrialSteps = 8;                 // of Lloyd's iteration, before a teleportation is judged
constexpr std::size_t kMostEvaluations = 100;  // of distances for each triangle, in all teleportations: bounds the time
constexpr int kMostRefusals = 10;              // in a row that do not lower the energy: others would hardly do better
constexpr double kLeastShare = 0.1;   // of what the removal costs before iterating, that the division must gain
constexpr double kWorthwhile = 1e-3;  // part of the energy that a teleportation must gain

// Regions that are far from each other are divided, or removed, in one round where they gain so much of what the best
// does, or cost so many times what the cheapest does.
constexpr double kNearlyBest = 0.5, kNearlyCheapest = 2;

constexpr double kRedundant = 0.5;  // of the largest energy of a region: a merging that costs less is one to make

Index farthest_triangle(const Partition& partition, Index region) {
  return *std::max_element(partition.triangles.begin(region), partition.triangles.end(region),
                           [&](Index a, Index b) { return partition.distances[a] < partition.distances[b]; });
}

Index nearest_triangle(const SegmentDomain& domain, const std::vector<Index>& triangles, const Proxy& proxy) {
  Index best = triangles[0];
  double least = std::numeric_limits<double>::infinity();
  for (const Index t : triangles) {
    if (!(domain.areas[t] > 0)) continue;
    const double d = distance_to(domain, t, proxy) / domain.areas[t];
    if (d < least) {
      least = d;
      best = t;
    }
  }
  return best;
}

Proxy plane_of(const SegmentDomain& domain, Index triangle) {
  const Vec3& n = domain.normals[triangle];
  return Proxy::of(plane_quadric(n, dot(n, domain.barycentres[triangle])));
}

// In two across the longest direction.
std::array<std::vector<Index>, 2> halves(const SegmentDomain& domain, const Index* begin, const Index* end) {
  double area = 0;
  Vec3 centroid;
  for (const Index* t = begin; t != end; ++t) {
    area += domain.areas[*t];
    centroid += domain.areas[*t] * domain.barycentres[*t];
  }
  std::array<std::vector<Index>, 2> parts;
  if (!(area > 0)) return parts;
  centroid *= 1 / area;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Index* t = begin; t != end; ++t) {
    const Vec3 d = domain.barycentres[*t] - centroid;
    const Eigen::Vector3d e(d.x, d.y, d.z);
    covariance += domain.areas[*t] * e * e.transpose();
  }
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(2);
  for (const Index* t = begin; t != end; ++t)
    parts[dot(Vec3{axis(0), axis(1), axis(2)}, domain.barycentres[*t] - centroid) < 0 ? 0 : 1].push_back(*t);
  return parts;
}

// What is nearest to a plane, by trimmed least squares, and what is farthest from it: takes a plane out of a region
// that a curved proxy was bent around. Signed distances are averaged over neighbours, so that noise does not decide.
std::array<std::vector<Index>, 2> flat_and_rest(const SegmentDomain& domain, const Index* begin, const Index* end) {
  const auto n = static_cast<std::size_t>(end - begin);
  std::array<std::vector<Index>, 2> parts;
  const auto flat = static_cast<std::size_t>(kFlatShare * static_cast<double>(n));
  const auto rest = static_cast<std::size_t>(kRestShare * static_cast<double>(n));
  if (flat < 3 || rest < 3) return parts;
  std::vector<Index> order(begin, end);
  std::vector<double> off(n), averaged(n);
  for (int k = 0; k < kTrimSteps; ++k) {
    const auto count = static_cast<std::ptrdiff_t>(k == 0 ? n : flat);
    const PlaneFit plane = fit_plane(sum_of_moments(domain, order.data(), order.data() + count));
    for (std::size_t i = 0; i < n; ++i) off[i] = dot(plane.normal, domain.barycentres[begin[i]]) - plane.offset;
    for (int round = 0; round < kAverages; ++round) {
      for (std::size_t i = 0; i < n; ++i) {
        double sum = off[i], weight = 1;
        for (const Index* t = domain.graph.neighbours.begin(begin[i]); t != domain.graph.neighbours.end(begin[i]);
             ++t) {
          const Index* at = std::lower_bound(begin, end, *t);
          if (at == end || *at != *t) continue;
          sum += off[static_cast<std::size_t>(at - begin)];
          ++weight;
        }
        averaged[i] = sum / weight;
      }
      off.swap(averaged);
    }
    std::vector<std::size_t> by_distance(n);
    std::iota(by_distance.begin(), by_distance.end(), std::size_t{0});
    std::stable_sort(by_distance.begin(), by_distance.end(),
                     [&](std::size_t a, std::size_t b) { return std::abs(off[a]) < std::abs(off[b]); });
    for (std::size_t i = 0; i < n; ++i) order[i] = begin[by_distance[i]];
  }
  parts[0].assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(flat));
  parts[1].assign(order.end() - static_cast<std::ptrdiff_t>(rest), order.end());
  return parts;
}

// Pairs of regions that share an edge, the lower first.
std::set<std::pair<Index, Index>> neighbouring(const SegmentDomain& domain, const std::vector<Index>& labels) {
  std::set<std::pair<Index, Index>> pairs;
  const auto& neighbours = domain.graph.neighbours;
  for (Index t = 0; t < labels.size(); ++t)
    for (const Index* n = neighbours.begin(t); n != neighbours.end(t); ++n)
      if (labels[t] < labels[*n]) pairs.emplace(labels[t], labels[*n]);
  return pairs;
}

// Of each region those that share an edge with it.
Csr<Index> neighbours_of_regions(const SegmentDomain& domain, const Partition& partition) {
  const auto pairs = neighbouring(domain, partition.labels);
  return group_into_rows<Index>(partition.regions.size(), [&](const auto& add) {
    for (const auto& [a, b] : pairs) {
      add(a, b);
      add(b, a);
    }
  });
}

}  // namespace

void PartitionEditor::divide(const Partition& partition, Index region, int steps, Division& division,
                             Trial& trial) const {
  const SegmentDomain& domain = lloyd_.domain();
  const Index *begin = partition.triangles.begin(region), *end = partition.triangles.end(region);
  std::array<Proxy, 2> proxies = division.proxies;
  std::array<Index, 2> seeds = division.seeds;
  for (int k = 0; k < steps && seeds[0] != seeds[1]; ++k) {
    for (const Index* t = begin; t != end; ++t) trial.labels[*t] = kNone;
    flood(domain, {proxies[0], proxies[1]}, {{seeds[0], 0}, {seeds[1], 1}}, trial.labels, trial.distances,
          trial.evaluations);
    std::array<std::vector<Index>, 2> parts;
    for (const Index* t = begin; t != end; ++t) parts[trial.labels[*t]].push_back(*t);
    double energy = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const Index *first = parts[i].data(), *last = first + parts[i].size();
      const RegionProxy fit = lloyd_.refit(first, last, sum_of_moments(domain, first, last), nullptr, trial.distances,
                                           trial.evaluations, k % 2 == 1);
      energy += fit.energy;
      proxies[i] = fit.proxy;
      seeds[i] = nearest_triangle(domain, parts[i], fit.proxy);
    }
    const double gain = partition.regions[region].energy - energy;
    if (!(gain > division.gain)) break;
    division = {gain, std::move(parts[1]), proxies, seeds};
  }
}

PartitionEditor::Division PartitionEditor::find_division(const Partition& partition, Index region, Trial& trial) const {
  Division best;
  if (partition.triangles.size(region) < 2) return best;
  const SegmentDomain& domain = lloyd_.domain();
  const Index *begin = partition.triangles.begin(region), *end = partition.triangles.end(region);
  // A few steps from each start, and more from where the best has come to.
  const auto start = [&](const std::array<Proxy, 2>& proxies, const std::array<Index, 2>& seeds) {
    Division division{0, {}, proxies, seeds};
    divide(partition, region, kFirstSteps, division, trial);
    if (division.gain > best.gain) best = std::move(division);
  };
  const Index worst = farthest_triangle(partition, region);
  start({partition.regions[region].proxy, plane_of(domain, worst)}, {lloyd_.seed(partition, region), worst});
  for (const auto& parts : {halves(domain, begin, end), flat_and_rest(domain, begin, end)}) {
    if (parts[0].empty() || parts[1].empty()) continue;
    std::array<Proxy, 2> proxies;
    std::array<Index, 2> seeds;
    for (std::size_t i = 0; i < 2; ++i) {
      const Index *first = parts[i].data(), *last = first + parts[i].size();
      proxies[i] = lloyd_
                       .refit(first, last, sum_of_moments(domain, first, last), nullptr, trial.distances,
                              trial.evaluations, false)
                       .proxy;
      seeds[i] = nearest_triangle(domain, parts[i], proxies[i]);
    }
    start(proxies, seeds);
  }
  if (best.gain > 0) divide(partition, region, kMoreSteps, best, trial);
  return best;
}

void PartitionEditor::find_divisions(const Partition& partition) {
  std::vector<Index> missing;
  for (Index r = 0; r < partition.regions.size(); ++r)
    if (!divisions_.count(partition.regions[r].version)) missing.push_back(r);
  std::vector<Division> found(missing.size());
  std::vector<std::size_t> evaluations(missing.size(), 0);
  const std::size_t n = partition.labels.size();
  constexpr Index kBlocked = 2;
  constexpr std::size_t kAtOnce = 8;  // regions that share a trial's arrays
  parallel_chunks(missing.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t last) {
    Trial trial{std::vector<Index>(n, kBlocked), std::vector<double>(n), 0};
    for (std::size_t k = first; k < last; ++k) {
      trial.evaluations = 0;
      found[k] = find_division(partition, missing[k], trial);
      evaluations[k] = trial.evaluations;
      for (const Index* t = partition.triangles.begin(missing[k]); t != partition.triangles.end(missing[k]); ++t)
        trial.labels[*t] = kBlocked;
    }
  });
  for (std::size_t k = 0; k < missing.size(); ++k) {
    lloyd_.counts.evaluations += evaluations[k];
    divisions_.emplace(partition.regions[missing[k]].version, std::move(found[k]));
  }
}

const PartitionEditor::Division& PartitionEditor::division(const Partition& partition, Index region) const {
  return divisions_.at(partition.regions[region].version);
}

Partition PartitionEditor::divided(const Partition& partition, const std::vector<Index>& regions) {
  std::vector<Index> labels = partition.labels;
  auto count = static_cast<Index>(partition.regions.size());
  for (const Index region : regions) {
    for (const Index t : division(partition, region).part) labels[t] = count;
    ++count;
  }
  return lloyd_.fit(std::move(labels), count, &partition);
}

double PartitionEditor::merging_cost(const Partition& partition, Index a, Index b, std::vector<double>& distances,
                                     std::size_t& evaluations) const {
  const RegionProxy &x = partition.regions[a], &y = partition.regions[b];
  std::vector<Index> both(partition.triangles.begin(a), partition.triangles.end(a));
  both.insert(both.end(), partition.triangles.begin(b), partition.triangles.end(b));
  std::sort(both.begin(), both.end());
  const SurfaceMoments moments = merged(x.moments, y.moments);
  const RegionProxy fit =
      lloyd_.refit(both.data(), both.data() + both.size(), moments, nullptr, distances, evaluations);
  return fit.energy - x.energy - y.energy;
}

double PartitionEditor::deletion_cost(const Partition& partition, Index region, std::size_t& evaluations) const {
  const SegmentDomain& domain = lloyd_.domain();
  const auto& neighbours = domain.graph.neighbours;
  std::set<Index> around;
  for (const Index* t = partition.triangles.begin(region); t != partition.triangles.end(region); ++t)
    for (const Index* n = neighbours.begin(*t); n != neighbours.end(*t); ++n)
      if (partition.labels[*n] != region) around.insert(partition.labels[*n]);
  if (around.empty()) return std::numeric_limits<double>::infinity();
  double sum = -partition.regions[region].energy;
  for (const Index* t = partition.triangles.begin(region); t != partition.triangles.end(region); ++t) {
    double least = std::numeric_limits<double>::infinity();
    for (const Index r : around) least = std::min(least, distance_to(domain, *t, partition.regions[r].proxy));
    evaluations += around.size();
    sum += least;
  }
  return sum;
}

std::vector<PartitionEditor::Removal> PartitionEditor::removals(const Partition& partition) {
  const auto versions = [&](Index a, Index b) {
    return std::minmax(partition.regions[a].version, partition.regions[b].version);
  };
  const auto pairs = neighbouring(lloyd_.domain(), partition.labels);
  std::vector<std::pair<Index, Index>> unknown;
  for (const auto& [a, b] : pairs)
    if (!merging_.count(versions(a, b))) unknown.emplace_back(a, b);
  std::vector<double> merging(unknown.size()), deletion(partition.regions.size());
  std::vector<std::size_t> evaluations(unknown.size() + deletion.size(), 0);
  constexpr std::size_t kAtOnce = 8;  // pairs that share an array
  parallel_chunks(evaluations.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t last) {
    std::vector<double> distances(first < unknown.size() ? partition.labels.size() : 0);
    for (std::size_t k = first; k < last; ++k)
      if (k < unknown.size())
        merging[k] = merging_cost(partition, unknown[k].first, unknown[k].second, distances, evaluations[k]);
      else
        deletion[k - unknown.size()] = deletion_cost(partition, static_cast<Index>(k - unknown.size()), evaluations[k]);
  });
  for (std::size_t k = 0; k < unknown.size(); ++k)
    merging_.emplace(versions(unknown[k].first, unknown[k].second), merging[k]);
  lloyd_.counts.evaluations += std::accumulate(evaluations.begin(), evaluations.end(), std::size_t{0});

  std::vector<Removal> all;
  for (const auto& [a, b] : pairs) {
    // The smaller one is what goes.
    const bool first = partition.triangles.size(a) < partition.triangles.size(b);
    all.push_back({merging_.at(versions(a, b)), first ? a : b, first ? b : a});
  }
  for (Index r = 0; r < partition.regions.size(); ++r)
    if (deletion[r] < std::numeric_limits<double>::infinity()) all.push_back({deletion[r], r, kNone});
  std::sort(all.begin(), all.end(), [](const Removal& x, const Removal& y) {
    return std::tuple(x.cost, x.region, x.into) < std::tuple(y.cost, y.region, y.into);
  });
  return all;
}

Partition PartitionEditor::without(const Partition& partition, const std::vector<Removal>& removals) {
  const std::size_t count = partition.regions.size();
  std::vector<Index> into(count), number(count, kNone);
  std::iota(into.begin(), into.end(), 0u);
  std::set<Index> deleted, around;
  for (const Removal& removal : removals)
    if (removal.into != kNone) into[removal.region] = removal.into;
    else deleted.insert(removal.region);
  if (!deleted.empty())
    for (const auto& [a, b] : neighbouring(lloyd_.domain(), partition.labels)) {
      if (deleted.count(a)) around.insert(b);
      if (deleted.count(b)) around.insert(a);
    }
  std::vector<Index> labels = partition.labels;
  for (Index& l : labels) l = deleted.count(l) || around.count(l) ? kNone : into[l];
  // What is deleted is flooded by its neighbours from their seeds.
  if (!around.empty()) {
    std::vector<FloodSeed> seeds;
    for (const Index r : around) seeds.push_back({lloyd_.seed(partition, r), r});
    std::vector<double> distances(labels.size());
    flood(lloyd_.domain(), lloyd_.proxies(partition), seeds, labels, distances, lloyd_.counts.evaluations);
  }
  Index left = 0;
  for (Index r = 0; r < count; ++r)
    if (into[r] == r && !deleted.count(r)) number[r] = left++;
  for (Index& l : labels) l = number[l];
  return lloyd_.fit(std::move(labels), left, &partition);
}

bool PartitionEditor::insert_farthest(Partition& partition) {
  const SegmentDomain& domain = lloyd_.domain();
  Index region = kNone;
  for (Index r = 0; r < partition.regions.size(); ++r) {
    if (partition.triangles.size(r) < 2 || !(partition.regions[r].energy > 0)) continue;
    const auto rank = [&](Index q) { return std::pair(partition.regions[q].invalid, partition.regions[q].energy); };
    if (region == kNone || rank(r) > rank(region)) region = r;
  }
  if (region == kNone) return false;
  const Index worst = farthest_triangle(partition, region);
  const auto count = static_cast<Index>(partition.regions.size());
  std::vector<FloodSeed> seeds;
  for (Index r = 0; r < count; ++r) seeds.push_back({lloyd_.seed(partition, r), r});
  if (seeds[region].triangle == worst) return false;
  seeds.push_back({worst, count});
  std::vector<Proxy> proxies = lloyd_.proxies(partition);
  proxies.push_back(plane_of(domain, worst));
  std::vector<Index> labels(partition.labels.size(), kNone);
  std::vector<double> distances(labels.size());
  flood(domain, proxies, seeds, labels, distances, lloyd_.counts.evaluations);
  partition = lloyd_.fit(std::move(labels), proxies.size());
  lloyd_.iterate(partition, iterations_);
  ++insertions;
  return true;
}

bool PartitionEditor::merge_redundant(Partition& partition) {
  double largest = 0;
  for (const RegionProxy& region : partition.regions) largest = std::max(largest, region.energy);
  for (const Removal& removal : removals(partition)) {
    if (removal.into == kNone) continue;
    if (!(removal.cost < kRedundant * largest)) return false;
    partition = without(partition, {removal});
    lloyd_.iterate(partition, iterations_);
    ++merges;
    return true;
  }
  return false;
}

bool PartitionEditor::divide_best(Partition& partition, std::size_t most, double enough) {
  find_divisions(partition);
  std::vector<std::pair<double, Index>> gains;
  for (Index r = 0; r < partition.regions.size(); ++r)
    if (const double gain = division(partition, r).gain; gain > 0) gains.emplace_back(gain, r);
  if (gains.empty()) return false;
  std::stable_sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const Csr<Index> around = neighbours_of_regions(lloyd_.domain(), partition);
  std::vector<char> taken(partition.regions.size(), 0);
  std::vector<Index> chosen;
  double energy = partition.energy();
  for (const auto& [gain, r] : gains) {
    if (!chosen.empty() && (gain < kNearlyBest * gains[0].first || chosen.size() == most || energy <= enough)) break;
    if (taken[r]) continue;
    for (const Index* n = around.begin(r); n != around.end(r); ++n) taken[*n] = 1;
    chosen.push_back(r);
    energy -= gain;
  }
  partition = divided(partition, chosen);
  lloyd_.iterate(partition, iterations_);
  insertions += chosen.size();
  return true;
}

bool PartitionEditor::remove_cheapest(Partition& partition, std::size_t most, double most_energy) {
  const std::vector<Removal> all = removals(partition);
  double energy = partition.energy();
  if (all.empty() || energy + all[0].cost > most_energy) return false;
  // Neither these nor, where one is shared out among its neighbours, those may be changed twice.
  const Csr<Index> around = neighbours_of_regions(lloyd_.domain(), partition);
  std::vector<char> taken(partition.regions.size(), 0);
  std::vector<Removal> chosen;
  for (const Removal& r : all) {
    if (!chosen.empty() &&
        (chosen.size() == most || r.cost > kNearlyCheapest * all[0].cost || energy + r.cost > most_energy))
      break;
    std::vector<Index> touched{r.region};
    if (r.into != kNone) touched.push_back(r.into);
    else touched.insert(touched.end(), around.begin(r.region), around.end(r.region));
    if (std::any_of(touched.begin(), touched.end(), [&](Index q) { return taken[q]; })) continue;
    for (const Index q : touched) taken[q] = 1;
    chosen.push_back(r);
    energy += r.cost;
  }
  for (;;) {
    Partition next = without(partition, chosen);
    lloyd_.try_out(next, std::min(kTrialSteps, iterations_), most_energy);
    if (next.energy() <= most_energy) {
      partition = std::move(next);
      for (const Removal& r : chosen) ++(r.into == kNone ? deletions : merges);
      return true;
    }
    if (chosen.size() == 1) return false;
    chosen.resize(1);
  }
}

void PartitionEditor::teleport(Partition& partition) {
  std::set<std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>> refused;
  const auto most = 4 * partition.regions.size();
  const std::size_t budget = lloyd_.counts.evaluations + kMostEvaluations * partition.labels.size();
  int refusals = 0;
  for (std::size_t k = 0; k < most && refusals < kMostRefusals && lloyd_.counts.evaluations < budget; ++k) {
    lloyd_.context().check();
    // The removal and the division that gain most together, unless they were tried. Divisions in descending order of
    // gain: the first that goes with a removal is the best for it.
    const std::vector<Removal> all = removals(partition);
    find_divisions(partition);
    const double energy = partition.energy();
    std::vector<std::pair<double, Index>> gains;
    for (Index d = 0; d < partition.regions.size(); ++d)
      if (const double gain = division(partition, d).gain; gain > 0 && gain >= kWorthwhile * energy)
        gains.emplace_back(gain, d);
    std::stable_sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    const auto version = [&](Index r) { return r == kNone ? 0 : partition.regions[r].version; };
    double best = -std::numeric_limits<double>::infinity();
    const Removal* removal = nullptr;
    Index region = kNone;
    for (const Removal& r : all)
      for (const auto& [gain, d] : gains) {
        if (gain - r.cost <= best || gain < kLeastShare * r.cost) break;
        if (d == r.region || d == r.into || refused.count({version(r.region), version(r.into), version(d)})) continue;
        best = gain - r.cost;
        removal = &r;
        region = d;
        break;
      }
    if (!removal) break;
    refused.insert({version(removal->region), version(removal->into), version(region)});
    Partition next = divided(partition, {region});
    next = without(next, {*removal});
    const double goal = (1 - kWorthwhile) * energy;
    lloyd_.try_out(next, std::min(kTrialSteps, iterations_), goal);
    if (next.energy() < goal) {
      partition = std::move(next);
      ++teleportations;
      refusals = 0;
    } else {
      ++refusals;
    }
  }
}

}  // namespace bisector
