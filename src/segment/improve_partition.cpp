#include "segment/improve_partition.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <unordered_set>

namespace bisector {
namespace {

// Division of a region in two.
constexpr int kFirstSteps = 2,
              kMoreSteps = 4;  // of Lloyd's iteration in the region: from each start, then from the best
constexpr double kFlatShare = 0.6, kRestShare = 0.1;  // of the triangles, that a plane is taken out of the region with
constexpr int kTrimSteps = 4, kAverages = 4;  // of trimmed least squares, and of averaging over neighbours in each

// Teleportation: a region is removed and another one divided.
constexpr int kTrialSteps = 8;        // of Lloyd's iteration, before a teleportation is judged
constexpr int kMostRefusals = 10;     // in a row that do not lower the energy: others would hardly do better
constexpr double kLeastShare = 0.1;   // of what the removal costs before iterating, that the division must gain
constexpr double kWorthwhile = 1e-3;  // part of the energy that a teleportation must gain

// Regions that are far from each other are divided, or removed, in one round where they gain so much of what the best
// does, or cost so many times what the cheapest does.
constexpr double kNearlyBest = 0.5, kNearlyCheapest = 2;
constexpr double kSlackShare = 0.05;  // of what the energy may grow by: a removal that costs less may always be made
constexpr std::size_t kAtOnce = 32;   // divisions that are found at once

constexpr std::size_t kMostKept = 8;  // costs for each region, from which on those of others are forgotten

constexpr double kRedundant = 0.5;  // of the largest energy of a region: a merging that costs less is one to make

std::vector<Index> union_of(const std::vector<Index>& a, const std::vector<Index>& b) {
  std::vector<Index> both;
  both.reserve(a.size() + b.size());
  std::merge(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  return both;
}

Index farthest_triangle(const Partition& partition, Index region) {
  const std::vector<Index>& triangles = partition.triangles[region];
  return *std::max_element(triangles.begin(), triangles.end(),
                           [&](Index a, Index b) { return partition.distances[a] < partition.distances[b]; });
}

Proxy plane_of(const SegmentDomain& domain, Index triangle) {
  const Vec3& n = domain.normals[triangle];
  return Proxy::of(plane_quadric(n, dot(n, domain.barycentres[triangle])));
}

// In two across the longest direction.
std::array<std::vector<Index>, 2> halves(const SegmentDomain& domain, const std::vector<Index>& triangles) {
  double area = 0;
  Vec3 centroid;
  for (const Index t : triangles) {
    area += domain.areas[t];
    centroid += domain.areas[t] * domain.barycentres[t];
  }
  std::array<std::vector<Index>, 2> parts;
  if (!(area > 0)) return parts;
  centroid *= 1 / area;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Index t : triangles) {
    const Vec3 d = domain.barycentres[t] - centroid;
    const Eigen::Vector3d e(d.x, d.y, d.z);
    covariance += domain.areas[t] * e * e.transpose();
  }
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(2);
  for (const Index t : triangles)
    parts[dot(Vec3{axis(0), axis(1), axis(2)}, domain.barycentres[t] - centroid) < 0 ? 0 : 1].push_back(t);
  return parts;
}

// What is nearest to a plane, by trimmed least squares, and what is farthest from it: takes a plane out of a region
// that a curved proxy was bent around. Signed distances are averaged over neighbours, so that noise does not decide.
std::array<std::vector<Index>, 2> flat_and_rest(const SegmentDomain& domain, const std::vector<Index>& triangles) {
  const std::size_t n = triangles.size();
  std::array<std::vector<Index>, 2> parts;
  const auto flat = static_cast<std::size_t>(kFlatShare * static_cast<double>(n));
  const auto rest = static_cast<std::size_t>(kRestShare * static_cast<double>(n));
  if (flat < 3 || rest < 3) return parts;
  std::vector<Index> order = triangles;
  std::vector<double> off(n), averaged(n);
  std::vector<std::vector<Index>> around(n);
  for (std::size_t i = 0; i < n; ++i)
    for (const Index* t = domain.graph.neighbours.begin(triangles[i]); t != domain.graph.neighbours.end(triangles[i]);
         ++t) {
      const auto at = std::lower_bound(triangles.begin(), triangles.end(), *t);
      if (at != triangles.end() && *at == *t) around[i].push_back(static_cast<Index>(at - triangles.begin()));
    }
  for (int k = 0; k < kTrimSteps; ++k) {
    const std::size_t count = k == 0 ? n : flat;
    const PlaneFit plane = fit_plane(sum_of_moments(domain, {order.data(), count}));
    for (std::size_t i = 0; i < n; ++i) off[i] = dot(plane.normal, domain.barycentres[triangles[i]]) - plane.offset;
    for (int round = 0; round < kAverages; ++round) {
      for (std::size_t i = 0; i < n; ++i) {
        double sum = off[i], weight = 1;
        for (const Index other : around[i]) {
          sum += off[other];
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
    for (std::size_t i = 0; i < n; ++i) order[i] = triangles[by_distance[i]];
  }
  parts[0].assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(flat));
  parts[1].assign(order.end() - static_cast<std::ptrdiff_t>(rest), order.end());
  return parts;
}

}  // namespace

PartitionEditor::PartitionEditor(Lloyd& lloyd, int iterations, std::size_t most_evaluations)
    : lloyd_(lloyd), iterations_(iterations), most_evaluations_(most_evaluations),
      trials_([&lloyd] { return Trial(lloyd.domain()); }) {}

void PartitionEditor::improve_division(const Partition& partition, Index region, int steps, Division& division,
                                       Trial& trial) const {
  const SegmentDomain& domain = lloyd_.domain();
  std::vector<Proxy> proxies(division.proxies.begin(), division.proxies.end());
  std::array<Index, 2> seeds = division.seeds;
  for (int k = 0; k < steps && seeds[0] != seeds[1]; ++k) {
    lloyd_.context().check();
    for (const Index t : partition.triangles[region]) trial.labels[t] = kNone;
    trial.flooding.fill(proxies, {{seeds[0], 0}, {seeds[1], 1}}, trial.labels, trial.distances, trial.evaluations);
    std::array<std::vector<Index>, 2> parts;
    for (const Index t : partition.triangles[region]) parts[trial.labels[t]].push_back(t);
    double energy = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      const FittedProxy fitted = lloyd_.refit(parts[i], sum_of_moments(domain, parts[i]), nullptr, trial.distances,
                                              trial.evaluations, k % 2 == 1);
      energy += fitted.fit.energy;
      proxies[i] = fitted.proxy;
      seeds[i] = lloyd_.seed(parts[i], trial.distances);
    }
    const double gain = partition.fits[region].energy - energy;
    if (!(gain > division.gain)) break;
    division = {gain, std::move(parts[1]), {proxies[0], proxies[1]}, seeds};
  }
}

PartitionEditor::Division PartitionEditor::find_division(const Partition& partition, Index region, Trial& trial) const {
  Division best;
  best.gain = -std::numeric_limits<double>::infinity();
  const std::vector<Index>& triangles = partition.triangles[region];
  if (triangles.size() < 2) return best;
  const SegmentDomain& domain = lloyd_.domain();
  // A few steps from each start, and more from where the best has come to.
  const auto start = [&](const std::array<Proxy, 2>& proxies, const std::array<Index, 2>& seeds) {
    Division division{-std::numeric_limits<double>::infinity(), {}, proxies, seeds};
    improve_division(partition, region, kFirstSteps, division, trial);
    if (division.gain > best.gain) best = std::move(division);
  };
  const Index worst = farthest_triangle(partition, region);
  start({partition.proxies[region], plane_of(domain, worst)},
        {lloyd_.seed(partition.triangles[region], partition.distances), worst});
  for (const auto& parts : {halves(domain, triangles), flat_and_rest(domain, triangles)}) {
    if (parts[0].empty() || parts[1].empty()) continue;
    std::array<Proxy, 2> proxies;
    std::array<Index, 2> seeds;
    for (std::size_t i = 0; i < 2; ++i) {
      proxies[i] =
          lloyd_.refit(parts[i], sum_of_moments(domain, parts[i]), nullptr, trial.distances, trial.evaluations, false)
              .proxy;
      seeds[i] = lloyd_.seed(parts[i], trial.distances);
    }
    start(proxies, seeds);
  }
  if (!best.part.empty()) improve_division(partition, region, kMoreSteps, best, trial);
  for (const Index t : triangles) trial.labels[t] = Trial::kBlocked;
  return best;
}

void PartitionEditor::forget_others(const Partition& partition) {
  if (divisions_.size() + deletions_.size() < kMostKept * (partition.count() + kMostKept)) return;
  std::unordered_set<std::uint64_t> versions;
  for (const RegionFit& fit : partition.fits) versions.insert(fit.version);
  std::erase_if(divisions_, [&](const auto& entry) { return !versions.count(entry.first); });
  std::erase_if(deletions_, [&](const auto& entry) { return !versions.count(entry.first); });
  std::erase_if(mergings_, [&](const auto& entry) {
    return !versions.count(entry.first.first) || !versions.count(entry.first.second);
  });
}

std::vector<std::pair<double, Index>> PartitionEditor::best_divisions(const Partition& partition, double least) {
  forget_others(partition);
  // A region gains no more by a division than its energy.
  const auto energy = [&](Index r) { return partition.fits[r].energy; };
  std::vector<Index> order;
  for (Index r = 0; r < partition.count(); ++r)
    if (energy(r) > 0 && energy(r) >= least) order.push_back(r);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return energy(a) > energy(b); });
  std::vector<std::pair<double, Index>> gains;
  double best = 0;
  for (std::size_t first = 0; first < order.size(); first += kAtOnce) {
    if (least == 0 && energy(order[first]) < kNearlyBest * best) break;
    const auto begin = order.begin() + static_cast<std::ptrdiff_t>(first);
    const std::vector<Index> batch(begin, begin + static_cast<std::ptrdiff_t>(std::min(kAtOnce, order.size() - first)));
    find_divisions(partition, batch);
    for (const Index r : batch)
      if (const double gain = division(partition, r).gain; gain > 0 && gain >= least) {
        gains.emplace_back(gain, r);
        best = std::max(best, gain);
      }
  }
  std::stable_sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  return gains;
}

void PartitionEditor::find_divisions(const Partition& partition, const std::vector<Index>& regions) {
  std::vector<Index> missing;
  for (const Index r : regions)
    if (!divisions_.count(partition.fits[r].version)) missing.push_back(r);
  std::vector<Division> found(missing.size());
  std::vector<std::size_t> evaluations(missing.size(), 0);
  parallel_each(
      missing.size(),
      [&](std::size_t k) {
        Trial& trial = trials_.local();
        trial.evaluations = 0;
        found[k] = find_division(partition, missing[k], trial);
        evaluations[k] = trial.evaluations;
      },
      1);
  for (std::size_t k = 0; k < missing.size(); ++k) {
    lloyd_.counts.evaluations += evaluations[k];
    divisions_.emplace(partition.fits[missing[k]].version, std::move(found[k]));
  }
}

const PartitionEditor::Division& PartitionEditor::division(const Partition& partition, Index region) const {
  return divisions_.at(partition.fits[region].version);
}

double PartitionEditor::merging_cost(const Partition& partition, Index a, Index b, Trial& trial) const {
  const std::vector<Index> both = union_of(partition.triangles[a], partition.triangles[b]);
  const RegionFit &x = partition.fits[a], &y = partition.fits[b];
  const FittedProxy fitted =
      lloyd_.refit(both, merged(x.moments, y.moments), nullptr, trial.distances, trial.evaluations);
  return fitted.fit.energy - x.energy - y.energy;
}

double PartitionEditor::deletion_cost(const Partition& partition, Index region, std::size_t& evaluations) const {
  const std::vector<Index>& around = partition.neighbours[region];
  if (around.empty()) return std::numeric_limits<double>::infinity();
  double sum = -partition.fits[region].energy;
  for (const Index t : partition.triangles[region]) {
    double least = std::numeric_limits<double>::infinity();
    for (const Index r : around) least = std::min(least, distance_to(lloyd_.domain(), t, partition.proxies[r]));
    sum += least;
  }
  evaluations += around.size() * partition.triangles[region].size();
  return sum;
}

std::vector<PartitionEditor::Removal> PartitionEditor::removals(const Partition& partition) {
  forget_others(partition);
  const auto version = [&](Index r) { return partition.fits[r].version; };
  const auto versions = [&](Index a, Index b) -> Versions { return std::minmax(version(a), version(b)); };
  const auto versions_around = [&](Index region) {
    std::vector<std::uint64_t> around;
    for (const Index n : partition.neighbours[region]) around.push_back(version(n));
    return around;
  };
  std::vector<std::pair<Index, Index>> unknown;  // mergings, and deletions, whose second region is kNone
  for (Index a = 0; a < partition.count(); ++a) {
    for (const Index b : partition.neighbours[a])
      if (a < b && !mergings_.count(versions(a, b))) unknown.emplace_back(a, b);
    const auto known = deletions_.find(version(a));
    if (known == deletions_.end() || known->second.around != versions_around(a)) unknown.emplace_back(a, kNone);
  }
  std::vector<double> costs(unknown.size());
  std::vector<std::size_t> evaluations(unknown.size(), 0);
  parallel_each(
      unknown.size(),
      [&](std::size_t k) {
        lloyd_.context().check();
        const auto [a, b] = unknown[k];
        Trial& trial = trials_.local();
        trial.evaluations = 0;
        costs[k] = b == kNone ? deletion_cost(partition, a, trial.evaluations) : merging_cost(partition, a, b, trial);
        evaluations[k] = trial.evaluations;
      },
      1);
  for (std::size_t k = 0; k < unknown.size(); ++k) {
    const auto [a, b] = unknown[k];
    lloyd_.counts.evaluations += evaluations[k];
    if (b == kNone) deletions_[version(a)] = {versions_around(a), costs[k]};
    else mergings_.emplace(versions(a, b), costs[k]);
  }

  std::vector<Removal> all;
  for (Index a = 0; a < partition.count(); ++a) {
    for (const Index b : partition.neighbours[a]) {
      if (b < a) continue;
      // The smaller one is what goes.
      const bool first = partition.triangles[a].size() < partition.triangles[b].size();
      all.push_back({mergings_.at(versions(a, b)), first ? a : b, first ? b : a});
    }
    const double cost = deletions_.at(version(a)).cost;
    if (cost < std::numeric_limits<double>::infinity()) all.push_back({cost, a, kNone});
  }
  std::sort(all.begin(), all.end(), [](const Removal& x, const Removal& y) {
    return std::tuple(x.cost, x.region, x.into) < std::tuple(y.cost, y.region, y.into);
  });
  return all;
}

void PartitionEditor::divide(const std::vector<Index>& regions, Partition& partition, PartitionUndo& undo) {
  undo.keep(partition, regions);
  partition.disconnect(regions);
  std::vector<Index> halves = regions;
  for (const Index region : regions) {
    const std::vector<Index>& part = division(partition, region).part;
    const auto added = static_cast<Index>(partition.count());
    partition.resize(added + 1);
    for (const Index t : part) partition.labels[t] = added;
    partition.relist({region, added}, std::vector<Index>(partition.triangles[region]));
    halves.push_back(added);
  }
  partition.connect(lloyd_.domain(), halves);
  lloyd_.fit(halves, partition);
}

// What is deleted is flooded by its neighbours from their seeds. `grown` gets those whose triangles change.
void PartitionEditor::share_out(const std::vector<Index>& deleted, Partition& partition, std::vector<Index>& grown) {
  std::set<Index> neighbours;
  for (const Index r : deleted) neighbours.insert(partition.neighbours[r].begin(), partition.neighbours[r].end());
  const std::vector<Index> around(neighbours.begin(), neighbours.end());
  std::vector<Index> all = around;
  all.insert(all.end(), deleted.begin(), deleted.end());
  const std::vector<Index> triangles = partition.triangles_of(all);
  std::vector<std::vector<Index>> before;
  for (const Index r : around) before.push_back(partition.triangles[r]);
  partition.disconnect(all);
  lloyd_.flood(around, triangles, partition);
  partition.relist(all, triangles);
  partition.connect(lloyd_.domain(), around);
  for (std::size_t k = 0; k < around.size(); ++k)
    if (partition.triangles[around[k]] != before[k]) grown.push_back(around[k]);
}

void PartitionEditor::remove(const std::vector<Removal>& removals, Partition& partition, PartitionUndo& undo) {
  std::vector<Index> gone, deleted, grown;
  for (const auto& [cost, region, into] : removals) {
    undo.keep(partition, region);
    gone.push_back(region);
    if (into == kNone) {
      undo.keep(partition, partition.neighbours[region]);
      deleted.push_back(region);
      continue;
    }
    undo.keep(partition, into);
    partition.disconnect({region, into});
    for (const Index t : partition.triangles[region]) partition.labels[t] = into;
    partition.triangles[into] = union_of(partition.triangles[into], partition.triangles[region]);
    partition.triangles[region].clear();
    partition.connect(lloyd_.domain(), {into});
    grown.push_back(into);
  }
  if (!deleted.empty()) share_out(deleted, partition, grown);
  lloyd_.fit(grown, partition);
  // The last region takes the number of one that is gone.
  std::sort(gone.begin(), gone.end(), std::greater<>());
  for (const Index region : gone) {
    const auto last = static_cast<Index>(partition.count() - 1);
    if (region != last) {
      undo.keep(partition, last);
      partition.disconnect({last});
      for (const Index t : partition.triangles[last]) partition.labels[t] = region;
      partition.triangles[region] = std::move(partition.triangles[last]);
      partition.proxies[region] = partition.proxies[last];
      partition.fits[region] = partition.fits[last];
      partition.changed[region] = partition.changed[last];
      partition.connect(lloyd_.domain(), {region});
    }
    partition.resize(last);
  }
}

bool PartitionEditor::insert_farthest(Partition& partition) {
  const SegmentDomain& domain = lloyd_.domain();
  Index region = kNone;
  for (Index r = 0; r < partition.count(); ++r) {
    if (partition.triangles[r].size() < 2 || !(partition.fits[r].energy > 0)) continue;
    const auto rank = [&](Index q) { return std::pair(partition.fits[q].invalid, partition.fits[q].energy); };
    if (region == kNone || rank(r) > rank(region)) region = r;
  }
  if (region == kNone) return false;
  const Index worst = farthest_triangle(partition, region);
  const auto count = static_cast<Index>(partition.count());
  std::vector<FloodSeed> seeds;
  for (Index r = 0; r < count; ++r) seeds.push_back({lloyd_.seed(partition.triangles[r], partition.distances), r});
  if (seeds[region].triangle == worst) return false;
  seeds.push_back({worst, count});
  std::vector<Proxy> proxies = partition.proxies;
  proxies.push_back(plane_of(domain, worst));
  std::vector<Index> labels(partition.labels.size(), kNone);
  std::vector<double> distances(labels.size());
  Flooding(domain).fill(proxies, seeds, labels, distances, lloyd_.counts.evaluations);
  partition = lloyd_.fit(std::move(labels), proxies.size());
  lloyd_.iterate(partition, iterations_);
  ++lloyd_.counts.insertions;
  return true;
}

bool PartitionEditor::merge_redundant(Partition& partition) {
  double largest = 0;
  for (const RegionFit& fit : partition.fits) largest = std::max(largest, fit.energy);
  for (const Removal& removal : removals(partition)) {
    if (removal.into == kNone) continue;
    if (!(removal.cost < kRedundant * largest)) return false;
    PartitionUndo undo(partition);
    remove({removal}, partition, undo);
    lloyd_.iterate(partition, iterations_);
    ++lloyd_.counts.merges;
    return true;
  }
  return false;
}

bool PartitionEditor::divide_best(Partition& partition, std::size_t most, double enough) {
  std::vector<std::pair<double, Index>> gains = best_divisions(partition, 0);
  if (gains.empty()) {
    // Halves that are too small for quadrics may be farther off than the whole, and their halves nearer again.
    for (Index r = 0; r < partition.count(); ++r)
      if (partition.fits[r].energy > 0 && !division(partition, r).part.empty())
        gains.emplace_back(partition.fits[r].energy, r);
    if (gains.empty()) return false;
    std::stable_sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  }
  std::vector<char> taken(partition.count(), 0);
  std::vector<Index> chosen;
  double energy = partition.energy();
  for (const auto& [gain, r] : gains) {
    if (!chosen.empty() && (gain < kNearlyBest * gains[0].first || chosen.size() == most || energy <= enough)) break;
    if (taken[r]) continue;
    for (const Index n : partition.neighbours[r]) taken[n] = 1;
    chosen.push_back(r);
    energy -= gain;
  }
  PartitionUndo undo(partition);
  divide(chosen, partition, undo);
  lloyd_.iterate(partition, iterations_);
  lloyd_.counts.insertions += chosen.size();
  return true;
}

bool PartitionEditor::remove_cheapest(Partition& partition, std::size_t most, double most_energy) {
  const std::vector<Removal> all = removals(partition);
  double energy = partition.energy();
  if (all.empty() || energy + all[0].cost > most_energy) return false;
  const double slack = std::isfinite(most_energy) ? kSlackShare * (most_energy - energy) : 0;
  const double dearest = std::max(kNearlyCheapest * all[0].cost, slack);
  // Neither these nor, where one is shared out among its neighbours, those may be changed twice.
  std::vector<char> taken(partition.count(), 0);
  std::vector<Removal> chosen;
  for (const Removal& r : all) {
    if (!chosen.empty() && (chosen.size() == most || r.cost > dearest || energy + r.cost > most_energy)) break;
    std::vector<Index> touched{r.region};
    if (r.into != kNone) touched.push_back(r.into);
    else touched.insert(touched.end(), partition.neighbours[r.region].begin(), partition.neighbours[r.region].end());
    if (std::any_of(touched.begin(), touched.end(), [&](Index q) { return taken[q]; })) continue;
    for (const Index q : touched) taken[q] = 1;
    chosen.push_back(r);
    energy += r.cost;
  }
  for (;;) {
    PartitionUndo undo(partition);
    remove(chosen, partition, undo);
    lloyd_.try_out(partition, std::min(kTrialSteps, iterations_), most_energy, undo);
    if (partition.energy() <= most_energy) {
      for (const Removal& r : chosen) ++(r.into == kNone ? lloyd_.counts.deletions : lloyd_.counts.merges);
      return true;
    }
    undo.restore(lloyd_.domain(), partition);
    if (chosen.size() == 1) return false;
    chosen.resize(chosen.size() / 2);
  }
}

void PartitionEditor::teleport(Partition& partition) {
  std::set<std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>> refused;
  const auto most = 4 * partition.count();
  const std::size_t budget = lloyd_.counts.evaluations + most_evaluations_;
  int refusals = 0;
  for (std::size_t k = 0; k < most && refusals < kMostRefusals && lloyd_.counts.evaluations < budget; ++k) {
    lloyd_.context().check();
    // The removal and the division that gain most together, unless they were tried. Divisions in descending order of
    // gain: the first that goes with a removal is the best for it.
    const std::vector<Removal> all = removals(partition);
    const double energy = partition.energy();
    const std::vector<std::pair<double, Index>> gains = best_divisions(partition, kWorthwhile * energy);
    const auto version = [&](Index r) { return r == kNone ? 0 : partition.fits[r].version; };
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
    PartitionUndo undo(partition);
    divide({region}, partition, undo);
    remove({*removal}, partition, undo);
    const double goal = (1 - kWorthwhile) * energy;
    lloyd_.try_out(partition, std::min(kTrialSteps, iterations_), goal, undo);
    if (partition.energy() < goal) {
      ++lloyd_.counts.teleportations;
      refusals = 0;
    } else {
      undo.restore(lloyd_.domain(), partition);
      ++refusals;
    }
  }
}

}  // namespace bisector
