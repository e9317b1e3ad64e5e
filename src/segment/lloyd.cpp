#include "segment/lloyd.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "segment/primitive_fit.h"

namespace bisector {
namespace {

constexpr std::size_t kTorusSamples = 160;  // points of a region that tori are fitted to
constexpr std::size_t kLeastForTorus = 12;  // triangles of a region that tori are tried on
constexpr int kToriEvery = 5;  // steps after which tori are tried anew on regions that are none; they are dear to fit
constexpr int kFirstFloods = 3, kFloodEvery = 4;  // the first steps flood, then one in so many: later only borders move
constexpr double kEnough = 1e-4;                  // a step that lowers the energy by a smaller part is the last
constexpr double kStepsToCome = 5;                // as large as the last one, that a trial may still hope for
constexpr double kExact = 1e-14;                  // squared distance that is as good as none, in the unit-sized model
constexpr double kOneSided = 0.99;                // share of the area with normals on one side of a surface, at least

// Whether the triangles' normals are on one side of a surface. Noise is fitted best by two sheets with the data
// between.
bool is_one_sided(const SegmentDomain& domain, const std::vector<Index>& triangles, const Proxy& proxy) {
  double along = 0, against = 0;
  for (const Index t : triangles)
    (dot(proxy.gradient(domain.barycentres[t]), domain.normals[t]) < 0 ? against : along) += domain.areas[t];
  return std::max(along, against) >= kOneSided * (along + against);
}

// Moments of triangles that are not many more or others than those that `known` is of.
SurfaceMoments changed_moments(const SegmentDomain& domain, const SurfaceMoments& known, const std::vector<Index>& old,
                               const std::vector<Index>& now) {
  std::vector<Index> added, removed;
  std::set_difference(now.begin(), now.end(), old.begin(), old.end(), std::back_inserter(added));
  std::set_difference(old.begin(), old.end(), now.begin(), now.end(), std::back_inserter(removed));
  if (4 * (added.size() + removed.size()) > now.size()) return sum_of_moments(domain, now);
  SurfaceMoments sum = known;
  const auto add = [&](const std::vector<Index>& triangles, double sign) {
    for (const Index t : triangles) {
      const SurfaceMoments one = domain.moments(t, known.origin);
      for (std::size_t k = 0; k < sum.m.size(); ++k) sum.m[k] += sign * one.m[k];
      for (std::size_t k = 0; k < sum.flux.size(); ++k) sum.flux[k] += sign * one.flux[k];
    }
  };
  add(added, 1);
  add(removed, -1);
  return sum;
}

}  // namespace

void SegmentCounts::add(const SegmentCounts& others) {
  iterations += others.iterations;
  evaluations += others.evaluations;
  insertions += others.insertions;
  merges += others.merges;
  deletions += others.deletions;
  teleportations += others.teleportations;
  energies.insert(energies.end(), others.energies.begin(), others.energies.end());
}

FittedProxy Lloyd::refit(const std::vector<Index>& triangles, const SurfaceMoments& moments, const Proxy* old,
                         std::vector<double>& distances, std::size_t& evaluations, bool tori) const {
  const std::size_t count = triangles.size();
  FittedProxy best;
  best.fit.moments = moments;
  double& least = best.fit.energy;
  least = std::numeric_limits<double>::infinity();
  if (old) {
    best.proxy = *old;
    least = 0;
    for (const Index t : triangles) least += distances[t];
  }
  std::vector<double> trial(count);
  const auto consider = [&](const Proxy& proxy) {
    double energy = 0;
    for (std::size_t k = 0; k < count; ++k) energy += trial[k] = distance_to(domain_, triangles[k], proxy);
    evaluations += count;
    if (!(energy < least)) return;
    best.proxy = proxy;
    least = energy;
    for (std::size_t k = 0; k < count; ++k) distances[triangles[k]] = trial[k];
  };
  const double enough = kExact * moments.area();
  // The samples' mean square is never below the integral for a plane.
  const PlaneFit plane = fit_plane(moments);
  if (plane.squared_distance < least) consider(Proxy::of(plane_quadric(plane.normal, plane.offset)));
  if (least <= enough || surfaces_ == SegmentSurfaces::planes || count < kLeastForQuadric) return best;
  const ProxyFit fit = fit_proxy(moments, surfaces_);
  best.fit.invalid = fit.invalid;
  if (!fit.plane && is_one_sided(domain_, triangles, fit.proxy)) {
    consider(fit.proxy);
  } else if (!fit.plane) {
    best.fit.invalid = true;
    const QuadricFit oriented = fit_oriented_quadric(moments);
    const Proxy proxy = Proxy::of(oriented.quadric);
    if (oriented.valid && !is_invalid(oriented.quadric, moments) && is_one_sided(domain_, triangles, proxy))
      consider(proxy);
  }
  if (tori && least > enough && surfaces_ == SegmentSurfaces::all && count >= kLeastForTorus) {
    const SurfaceSamples samples = sample_triangles(domain_, triangles, kTorusSamples);
    const double weight = std::accumulate(samples.weights.begin(), samples.weights.end(), 0.0);
    // Not where the samples say that it will not do.
    const double most = 2 * least * weight / moments.area();
    if (const auto torus = fit_primitive(SurfaceType::torus, samples, most)) {
      const Proxy proxy = Proxy::of(torus->primitive);
      if (is_one_sided(domain_, triangles, proxy)) consider(proxy);
    }
  }
  return best;
}

template <class Refit>
void Lloyd::refit_all(const std::vector<Index>& regions, Partition& partition, const Refit& refit_one) {
  std::vector<std::size_t> evaluations(regions.size(), 0);
  parallel_each(
      regions.size(),
      [&](std::size_t k) {
        FittedProxy fitted = refit_one(regions[k], evaluations[k]);
        partition.proxies[regions[k]] = fitted.proxy;
        partition.fits[regions[k]] = fitted.fit;
      },
      1);
  for (std::size_t k = 0; k < regions.size(); ++k) {
    counts.evaluations += evaluations[k];
    partition.fits[regions[k]].version = ++counts.versions;
    partition.changed[regions[k]] = 1;
  }
}

void Lloyd::fit(const std::vector<Index>& regions, Partition& partition) {
  refit_all(regions, partition, [&](Index r, std::size_t& evaluations) {
    const std::vector<Index>& triangles = partition.triangles[r];
    return refit(triangles, sum_of_moments(domain_, triangles), nullptr, partition.distances, evaluations);
  });
}

Partition Lloyd::fit(std::vector<Index> labels, std::size_t count) {
  Partition partition;
  partition.labels = std::move(labels);
  partition.distances.resize(partition.labels.size());
  partition.resize(count);
  for (Index t = 0; t < partition.labels.size(); ++t) partition.triangles[partition.labels[t]].push_back(t);
  std::vector<Index> all(count);
  std::iota(all.begin(), all.end(), 0u);
  partition.connect(domain_, all);
  fit(all, partition);
  return partition;
}

Index Lloyd::seed(const std::vector<Index>& triangles, const std::vector<double>& distances) const {
  Index best = triangles[0];
  double least = std::numeric_limits<double>::infinity();
  for (const Index t : triangles) {
    if (!(domain_.areas[t] > 0)) continue;
    // What differs by rounding only is as near.
    const double d = std::max(kExact, distances[t] / domain_.areas[t]);
    if (d < least) {
      least = d;
      best = t;
    }
  }
  return best;
}

void Lloyd::flood(const std::vector<Index>& regions, const std::vector<Index>& triangles, Partition& partition) {
  std::vector<FloodSeed> seeds;
  for (const Index r : regions) seeds.push_back({seed(partition.triangles[r], partition.distances), r});
  for (const Index t : triangles) partition.labels[t] = kNone;
  flooding_.fill(partition.proxies, seeds, partition.labels, partition.distances, counts.evaluations);
}

std::vector<Index> Lloyd::move_borders(Partition& partition, bool flooding, PartitionUndo& undo) {
  std::vector<char> active = partition.changed;
  for (Index r = 0; r < partition.count(); ++r)
    if (partition.changed[r])
      for (const Index n : partition.neighbours[r]) active[n] = 1;
  std::vector<Index> regions;
  for (Index r = 0; r < partition.count(); ++r)
    if (active[r]) regions.push_back(r);
  const std::vector<Index> triangles = partition.triangles_of(regions);

  std::vector<char> moved(partition.count(), 0);
  const auto relax = [&] {
    return moves_.relax(partition.proxies, triangles, partition.labels, partition.distances, counts.evaluations,
                        [&](Index t, Index to, double) {
                          for (const Index r : {partition.labels[t], to}) {
                            undo.keep(partition, r);
                            moved[r] = 1;
                          }
                        });
  };
  bool better = false;
  if (flooding) {
    undo.keep(partition, regions);
    flood(regions, triangles, partition);
    relax();
    better = undo.growth(partition) <= 0;
    if (better)
      for (const Index r : regions) moved[r] = 1;
    else undo.restore_labels(partition);
  }
  if (!better) {
    std::fill(moved.begin(), moved.end(), 0);
    if (relax() == 0) return {};
  }
  regions.clear();
  for (Index r = 0; r < partition.count(); ++r)
    if (moved[r]) regions.push_back(r);
  return regions;
}

bool Lloyd::step(Partition& partition, bool flooding, PartitionUndo* undo) {
  PartitionUndo own(partition);
  const double before = partition.energy();
  const std::vector<Index> regions = move_borders(partition, flooding, own);
  if (regions.empty()) return false;
  partition.relist(regions, partition.triangles_of(regions));
  std::vector<Index> changed;
  for (const Index r : regions)
    if (partition.triangles[r] != own.triangles(r)) changed.push_back(r);
  partition.disconnect(changed);
  partition.connect(domain_, changed);
  std::fill(partition.changed.begin(), partition.changed.end(), 0);
  const bool tori = counts.iterations % kToriEvery == 0;
  refit_all(changed, partition, [&](Index r, std::size_t& evaluations) {
    const std::vector<Index>& triangles = partition.triangles[r];
    const SurfaceMoments moments = changed_moments(domain_, partition.fits[r].moments, own.triangles(r), triangles);
    const Proxy old = partition.proxies[r];
    return refit(triangles, moments, &old, partition.distances, evaluations, tori || old.torus.has_value());
  });
  const double after = partition.energy();
  if (!(after < before)) {
    own.restore(domain_, partition);
    return false;
  }
  if (undo) undo->add(std::move(own));
  ++counts.iterations;
  return after < (1 - kEnough) * before;
}

void Lloyd::iterate(Partition& partition, int iterations, bool fresh) {
  std::vector<double> energies{partition.energy()};
  for (int k = 0; k < iterations; ++k) {
    context_.check();
    const int steps = counts.iterations;
    // Once regions have found their places, only their borders move.
    const bool flooding = fresh && (k < kFirstFloods || k % kFloodEvery == 0);
    const bool more = step(partition, flooding) || (!flooding && step(partition, true));
    if (counts.iterations > steps) energies.push_back(partition.energy());
    if (!more) break;
  }
  counts.energies.push_back(std::move(energies));
}

void Lloyd::try_out(Partition& partition, int iterations, double goal, PartitionUndo& undo) {
  for (int k = 0; k < iterations; ++k) {
    context_.check();
    const double before = partition.energy();
    if (!step(partition, k == 0, &undo)) break;
    const double now = partition.energy();
    if (now - kStepsToCome * (before - now) > goal) break;
  }
}

}  // namespace bisector
