#include "segment/lloyd.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "core/grouping.h"
#include "core/parallel.h"
#include "segment/flood.h"
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
bool is_one_sided(const SegmentDomain& domain, const Index* begin, const Index* end, const Proxy& proxy) {
  double along = 0, against = 0;
  for (const Index* t = begin; t != end; ++t)
    (dot(proxy.gradient(domain.barycentres[*t]), domain.normals[*t]) < 0 ? against : along) += domain.areas[*t];
  return std::max(along, against) >= kOneSided * (along + against);
}

// Moments of triangles that are not many more or others than those that `known` is of.
SurfaceMoments changed_moments(const SegmentDomain& domain, const SurfaceMoments& known, const Index* old_begin,
                               const Index* old_end, const Index* begin, const Index* end) {
  std::vector<Index> added, removed;
  std::set_difference(begin, end, old_begin, old_end, std::back_inserter(added));
  std::set_difference(old_begin, old_end, begin, end, std::back_inserter(removed));
  if (4 * (added.size() + removed.size()) > static_cast<std::size_t>(end - begin))
    return sum_of_moments(domain, begin, end);
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

double Partition::energy() const {
  double sum = 0;
  for (const RegionProxy& region : regions) sum += region.energy;
  return sum;
}

RegionProxy Lloyd::refit(const Index* begin, const Index* end, const SurfaceMoments& moments, const RegionProxy* old,
                         std::vector<double>& distances, std::size_t& evaluations, bool tori) const {
  const auto count = static_cast<std::size_t>(end - begin);
  RegionProxy best;
  best.energy = std::numeric_limits<double>::infinity();
  if (old) {
    best = *old;
    best.energy = 0;
    for (const Index* t = begin; t != end; ++t) best.energy += distances[*t];
  }
  std::vector<double> trial(count);
  const auto consider = [&](const Proxy& proxy) {
    double energy = 0;
    for (std::size_t k = 0; k < count; ++k) energy += trial[k] = distance_to(domain_, begin[k], proxy);
    evaluations += count;
    if (!(energy < best.energy)) return;
    best.proxy = proxy;
    best.energy = energy;
    for (std::size_t k = 0; k < count; ++k) distances[begin[k]] = trial[k];
  };
  const double enough = kExact * moments.area();
  // The samples' mean square is never below the integral for a plane.
  const PlaneFit plane = fit_plane(moments);
  if (plane.squared_distance < best.energy) consider(Proxy::of(plane_quadric(plane.normal, plane.offset)));
  best.invalid = false;
  if (best.energy > enough && surfaces_ != SegmentSurfaces::planes) {
    const ProxyFit fit = fit_proxy(moments, surfaces_);
    best.invalid = fit.invalid;
    if (!fit.plane && is_one_sided(domain_, begin, end, fit.proxy)) {
      consider(fit.proxy);
    } else if (!fit.plane) {
      best.invalid = true;
      const QuadricFit oriented = fit_oriented_quadric(moments);
      const Proxy proxy = Proxy::of(oriented.quadric);
      if (oriented.valid && !is_invalid(oriented.quadric, moments) && is_one_sided(domain_, begin, end, proxy))
        consider(proxy);
    }
    if (tori && best.energy > enough && surfaces_ == SegmentSurfaces::all && count >= kLeastForTorus) {
      const SurfaceSamples samples = sample_triangles(domain_, {begin, end}, kTorusSamples);
      const double weight = std::accumulate(samples.weights.begin(), samples.weights.end(), 0.0);
      const auto torus = fit_primitive(SurfaceType::torus, samples);
      // Not where the samples say that it will not do.
      if (torus && torus->squared_distance * moments.area() < 2 * best.energy * weight) {
        const Proxy proxy = Proxy::of(torus->primitive);
        if (is_one_sided(domain_, begin, end, proxy)) consider(proxy);
      }
    }
  }
  best.moments = moments;
  return best;
}

template <class Refit>
void Lloyd::refit_all(const std::vector<Index>& regions, Partition& partition, const Refit& refit_one) {
  std::vector<std::size_t> evaluations(regions.size(), 0);
  parallel_each(
      regions.size(), [&](std::size_t k) { partition.regions[regions[k]] = refit_one(regions[k], evaluations[k]); }, 1);
  for (std::size_t k = 0; k < regions.size(); ++k) {
    counts.evaluations += evaluations[k];
    partition.regions[regions[k]].version = ++counts.versions;
  }
}

Partition Lloyd::fit(std::vector<Index> labels, std::size_t count, const Partition* known) {
  Partition partition;
  partition.labels = std::move(labels);
  partition.triangles = items_of_labels<Index>(partition.labels, count);
  partition.distances = known ? known->distances : std::vector<double>(partition.labels.size());
  partition.regions.resize(count);
  partition.changed.assign(count, 1);
  std::vector<Index> fresh;
  for (std::size_t r = 0; r < count; ++r) {
    const Index *begin = partition.triangles.begin(r), *end = partition.triangles.end(r);
    const Index like = known ? known->labels[*begin] : kNone;
    if (known && std::equal(begin, end, known->triangles.begin(like), known->triangles.end(like))) {
      partition.regions[r] = known->regions[like];
      partition.changed[r] = known->changed[like];
    } else {
      fresh.push_back(static_cast<Index>(r));
    }
  }
  refit_all(fresh, partition, [&](Index r, std::size_t& evaluations) {
    const Index *begin = partition.triangles.begin(r), *end = partition.triangles.end(r);
    return refit(begin, end, sum_of_moments(domain_, begin, end), nullptr, partition.distances, evaluations);
  });
  return partition;
}

Index Lloyd::seed(const Partition& partition, Index region) const {
  Index best = *partition.triangles.begin(region);
  double least = std::numeric_limits<double>::infinity();
  for (const Index* t = partition.triangles.begin(region); t != partition.triangles.end(region); ++t) {
    if (!(domain_.areas[*t] > 0)) continue;
    // What differs by rounding only is as near.
    const double d = std::max(kExact, partition.distances[*t] / domain_.areas[*t]);
    if (d < least) {
      least = d;
      best = *t;
    }
  }
  return best;
}

std::vector<Proxy> Lloyd::proxies(const Partition& partition) const {
  std::vector<Proxy> proxies;
  proxies.reserve(partition.regions.size());
  for (const RegionProxy& region : partition.regions) proxies.push_back(region.proxy);
  return proxies;
}

bool Lloyd::step(Partition& partition, bool flooding) {
  const std::size_t count = partition.regions.size();
  std::vector<char> active = partition.changed;
  const auto& neighbours = domain_.graph.neighbours;
  for (std::size_t t = 0; t < partition.labels.size(); ++t)
    for (const Index* n = neighbours.begin(t); n != neighbours.end(t); ++n)
      if (partition.changed[partition.labels[*n]]) active[partition.labels[t]] = 1;
  std::vector<Index> triangles;
  std::vector<FloodSeed> seeds;
  for (Index r = 0; r < count; ++r) {
    if (!active[r]) continue;
    if (flooding) seeds.push_back({seed(partition, r), r});
    triangles.insert(triangles.end(), partition.triangles.begin(r), partition.triangles.end(r));
  }
  if (triangles.empty()) return false;
  std::sort(triangles.begin(), triangles.end());

  const std::vector<Proxy> all = proxies(partition);
  const double before = partition.energy();
  Partition next = partition;
  bool better = false;
  if (flooding) {
    for (const Index t : triangles) next.labels[t] = kNone;
    flood(domain_, all, seeds, next.labels, next.distances, counts.evaluations);
    relax_borders(domain_, all, triangles, next.labels, next.distances, counts.evaluations);
    const auto total = [](const std::vector<double>& d) {
      return fixed_sum(d.size(), [&](std::size_t t) { return d[t]; });
    };
    better = total(next.distances) <= total(partition.distances);
  }
  if (!better) {
    next.labels = partition.labels;
    next.distances = partition.distances;
    if (relax_borders(domain_, all, triangles, next.labels, next.distances, counts.evaluations) == 0) return false;
  }
  next.triangles = items_of_labels<Index>(next.labels, count);
  const bool tori = counts.iterations % kToriEvery == 0;
  std::vector<Index> changed;
  for (Index r = 0; r < count; ++r) {
    next.changed[r] = !std::equal(next.triangles.begin(r), next.triangles.end(r), partition.triangles.begin(r),
                                  partition.triangles.end(r));
    if (next.changed[r]) changed.push_back(r);
  }
  refit_all(changed, next, [&](Index r, std::size_t& evaluations) {
    const Index *begin = next.triangles.begin(r), *end = next.triangles.end(r);
    const RegionProxy& old = partition.regions[r];
    const SurfaceMoments moments =
        changed_moments(domain_, old.moments, partition.triangles.begin(r), partition.triangles.end(r), begin, end);
    return refit(begin, end, moments, &old, next.distances, evaluations, tori || old.proxy.torus.has_value());
  });
  const double after = next.energy();
  if (!(after < before)) return false;
  partition = std::move(next);
  ++counts.iterations;
  return after < (1 - kEnough) * before;
}

void Lloyd::iterate(Partition& partition, int iterations) {
  std::vector<double> energies{partition.energy()};
  for (int k = 0; k < iterations; ++k) {
    context_.check();
    const int steps = counts.iterations;
    // Once regions have found their places, only their borders move.
    const bool flooding = k < kFirstFloods || k % kFloodEvery == 0;
    const bool more = step(partition, flooding) || (!flooding && step(partition, true));
    if (counts.iterations > steps) energies.push_back(partition.energy());
    if (!more) break;
  }
  counts.energies.push_back(std::move(energies));
}

void Lloyd::try_out(Partition& partition, int iterations, double goal) {
  for (int k = 0; k < iterations; ++k) {
    context_.check();
    const double before = partition.energy();
    if (!step(partition, k == 0)) break;
    const double now = partition.energy();
    if (now - kStepsToCome * (before - now) > goal) break;
  }
}

}  // namespace bisector
