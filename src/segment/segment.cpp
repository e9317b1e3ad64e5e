#include "bisector/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "bisector/error.h"
#include "core/grouping.h"
#include "core/magnitude.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/stopwatch.h"
#include "segment/border_weights.h"
#include "segment/coarsen.h"
#include "segment/flood.h"
#include "segment/improve_partition.h"
#include "segment/lloyd.h"
#include "segment/merge_regions.h"
#include "segment/primitive.h"
#include "segment/region_primitives.h"
#include "segment/regularize.h"
#include "segment/segment_domain.h"
#include "segment/smooth_borders.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Start by merging: so many planar pieces that none has to cover two surfaces, and yet few enough to fit quadrics to
// all pairs.
constexpr std::size_t kFewestPieces = 200, kMostPieces = 1000;
constexpr std::size_t kPiecesPerProxy = 10, kTrianglesPerPiece = 40;
// Clusters of triangles that regions are found on, where a mesh has so many times more triangles: at most so many, or
// twice so many for each region. Joining pairs leaves between half of that and all.
constexpr std::size_t kCoarse = 4'000, kClustersPerRegion = 50, kTrianglesPerCluster = 4;
// Distances that are taken for each of the mesh's triangles to move regions, on clusters as well: bounds the time. To
// know what every removal and division would cost takes a hundred, and later only what changes is asked for anew.
constexpr std::size_t kMostEvaluations = 150;
constexpr int kPlanarSteps = 4;  // of Lloyd's iteration, for the pieces
constexpr std::size_t kSpareShare =
    5;  // one region in so many is added: which can be spared shows after Lloyd's iteration

// Smoothing: the root mean square distance may grow by this ratio, and the weights tried first and least are that asked
// for, halved so many times.
constexpr double kMostGrowth = 1.05;
constexpr int kFirstHalvings = 3, kMostHalvings = 8;

// Types and smooth borders cost some of the error; where they take more than was left, a smaller error is aimed at.
constexpr int kAttempts = 2;
constexpr double kAim = 0.97;      // of the error that would just do if all grew in proportion
constexpr double kLeastAim = 0.9;  // where more would be needed, less simple surfaces do

constexpr double kFarFoot =
    2;  // a vertex is not projected farther than so many times the largest distance in its region

void check_options(const SegmentOptions& options) {
  if (options.proxies == 0 && !(options.error > 0 && std::isfinite(options.error)))
    throw Error(fmt::format("an error of {} percent is asked for; it must be positive", options.error));
  if (options.iterations < 0)
    throw Error(fmt::format("{} iterations are asked for; ask for 0 or more", options.iterations));
  if (!(options.smooth >= 0) || !std::isfinite(options.smooth))
    throw Error(fmt::format("the smoothing weight is {}; it must be 0 or positive", options.smooth));
  if (options.fuzzy_rings < 0)
    throw Error(fmt::format("{} fuzzy rings are asked for; ask for 0 or more", options.fuzzy_rings));
}

// How many regions there can be nearest to the number asked for: each component needs one, and each a triangle.
std::size_t possible_count(const SegmentDomain& domain, std::size_t proxies, const Context& context) {
  const std::size_t least = domain.component_count, most = domain.triangles.size();
  if (proxies == 0) return 0;
  if (proxies > most)
    context.warn(fmt::format(
        "{} proxies are asked for, but the mesh has {} triangles only; each is a region of its own", proxies, most));
  if (proxies < least)
    context.warn(fmt::format(
        "{} proxies are asked for, but the mesh has {} components, of which each needs one; there are as many regions",
        proxies, least));
  return std::clamp(proxies, least, most);
}

// The root mean square distance that SegmentOptions::error allows, in the unit-sized model.
double allowed_rms(const SegmentDomain& domain, double percent) {
  return percent / 100 * bounding_box(domain.vertices, domain.triangles).diagonal();
}

Partition fit_all(Lloyd& lloyd, std::vector<Index> labels) {
  const std::size_t count = 1 + *std::max_element(labels.begin(), labels.end());
  return lloyd.fit(std::move(labels), count);
}

Partition start_by_merging(Lloyd& lloyd, const SegmentOptions& options, double allowed) {
  const SegmentDomain& domain = lloyd.domain();
  const std::size_t n = domain.triangles.size();
  if (options.surfaces == SegmentSurfaces::planes && options.proxies > 0)
    return fit_all(lloyd, merge_into_planes(domain, options.proxies, kInfinity, lloyd.context()));
  const std::size_t enough =
      std::max(kPiecesPerProxy * options.proxies, std::clamp(n / kTrianglesPerPiece, kFewestPieces, kMostPieces));
  const std::size_t pieces = std::min(n, std::max(enough, domain.component_count));
  Lloyd planar(domain, SegmentSurfaces::planes, lloyd.context());
  Partition small =
      fit_all(planar, merge_into_planes(domain, pieces, options.proxies > 0 ? kInfinity : allowed, lloyd.context()));
  planar.iterate(small, std::min(kPlanarSteps, options.iterations));
  lloyd.counts.evaluations += planar.counts.evaluations;
  lloyd.counts.iterations += planar.counts.iterations;
  const std::size_t spare = options.proxies / kSpareShare + 1;
  const std::size_t count = options.proxies > 0 ? std::min(options.proxies + spare, small.count()) : 0;
  const RegionMerging merging{count, allowed, options.surfaces};
  return fit_all(lloyd, merge_regions(domain, std::move(small.labels), merging, lloyd.context()));
}

// Around random triangles, at least one of each component, the others all over the mesh.
Partition start_at_random(Lloyd& lloyd, std::size_t count, std::uint64_t random_seed) {
  const SegmentDomain& domain = lloyd.domain();
  const Csr<Index> parts = items_of_labels<Index>(domain.components, domain.component_count);
  std::vector<FloodSeed> seeds;
  std::vector<Proxy> proxies;
  std::vector<char> taken(domain.triangles.size(), 0);
  Random random(random_seed);
  const auto draw = [&](const Index* from, std::size_t n) {
    const Index t = from[static_cast<std::size_t>(random.uniform() * static_cast<double>(n))];
    if (std::exchange(taken[t], 1)) return;
    seeds.push_back({t, static_cast<Index>(seeds.size())});
    proxies.push_back(Proxy::of(plane_quadric(domain.normals[t], dot(domain.normals[t], domain.barycentres[t]))));
  };
  for (std::size_t c = 0; c < domain.component_count; ++c) draw(parts.begin(c), parts.size(c));
  while (seeds.size() < count) draw(parts.values.data(), parts.values.size());
  std::vector<Index> labels(domain.triangles.size(), kNone);
  std::vector<double> distances(labels.size());
  Flooding(domain).fill(proxies, seeds, labels, distances, lloyd.counts.evaluations);
  return lloyd.fit(std::move(labels), seeds.size());
}

void report(const Context& context, const char* phase, double fraction, double energy = 0) {
  Progress progress;
  progress.phase = phase;
  progress.fraction = fraction;
  progress.energy = energy;
  context.report(progress);
  context.check();
}

// The mean square distance that the options allow, integrated; 0 where they ask for a number of regions.
double allowed_energy(const SegmentDomain& domain, const SegmentOptions& options) {
  const double rms = options.proxies > 0 ? 0 : allowed_rms(domain, options.error);
  return rms * rms * domain.area;
}

Partition start_partition(Lloyd& lloyd, const SegmentOptions& options, SegmentSeconds& seconds) {
  report(lloyd.context(), "start", 0);
  Stopwatch clock;
  const std::size_t at_random = options.start == SegmentStart::random ? options.proxies : 1;
  Partition partition = options.start == SegmentStart::merging
                            ? start_by_merging(lloyd, options, allowed_energy(lloyd.domain(), options))
                            : start_at_random(lloyd, at_random, options.random_seed);
  seconds.start += clock.lap();
  return partition;
}

// Inserts regions until there are enough and takes away those that are not needed. `fresh`: of a partition that was
// not improved yet, regions are also flooded, and moved from where they are hardly missed.
void improve(Lloyd& lloyd, PartitionEditor& editor, const SegmentOptions& options, bool fresh, Partition& partition,
             SegmentSeconds& seconds) {
  const Context& context = lloyd.context();
  const bool merging = options.start == SegmentStart::merging;
  const std::size_t wanted = options.proxies;
  const double allowed = allowed_energy(lloyd.domain(), options);
  const auto enough = [&](const Partition& p) { return wanted > 0 ? p.count() >= wanted : p.energy() <= allowed; };
  Stopwatch clock;
  report(context, "Lloyd", 0.2, partition.energy());
  lloyd.iterate(partition, options.iterations, fresh);
  while (!enough(partition)) {
    report(context, "inserting regions", 0.3, partition.energy());
    const std::size_t most = wanted > 0 ? wanted - partition.count() : partition.labels.size();
    if (!(merging ? editor.divide_best(partition, most, allowed) : editor.insert_farthest(partition))) break;
    // What was inserted first may be redundant by now; its region is of more use where the error is largest.
    if (!merging && enough(partition) && editor.merge_redundant(partition)) editor.insert_farthest(partition);
  }
  seconds.lloyd += clock.lap();

  report(context, "moving regions", 0.6, partition.energy());
  while (wanted > 0 && partition.count() > wanted &&
         editor.remove_cheapest(partition, partition.count() - wanted, kInfinity))
    context.check();
  if (fresh) editor.teleport(partition);
  if (wanted == 0)
    while (editor.remove_cheapest(partition, partition.count(), allowed))
      report(context, "removing regions", 0.7, partition.energy());
  lloyd.iterate(partition, options.iterations, fresh);
  seconds.improve += clock.lap();
}

// The regions of a large mesh are found on clusters of its triangles; what is left to do is to move borders by single
// triangles. Empty where the mesh is small, or the regions would be of too few clusters.
Partition coarse_partition(Lloyd& lloyd, const SegmentOptions& options, SegmentSeconds& seconds) {
  const SegmentDomain& domain = lloyd.domain();
  for (std::size_t most = std::max(kCoarse, 2 * kClustersPerRegion * options.proxies);;) {
    if (domain.triangles.size() < kTrianglesPerCluster * most) return {};
    const CoarseDomain coarse = coarsened(domain, most);
    const std::size_t clusters = coarse.domain.triangles.size();
    if (domain.triangles.size() < kTrianglesPerCluster * clusters) return {};  // creases kept them apart
    Lloyd on_clusters(coarse.domain, options.surfaces, lloyd.context());
    Partition partition = start_partition(on_clusters, options, seconds);
    // How many regions an error takes shows only now.
    const bool fine_enough = options.proxies > 0 || partition.count() * kClustersPerRegion <= clusters ||
                             partition.count() == domain.component_count;
    if (fine_enough) {
      PartitionEditor editor(on_clusters, options.iterations, kMostEvaluations * domain.triangles.size());
      improve(on_clusters, editor, options, true, partition, seconds);
    }
    lloyd.counts.add(on_clusters.counts);
    most = std::max(2 * most, 2 * kClustersPerRegion * partition.count());
    if (!fine_enough) continue;
    Stopwatch clock;
    std::vector<Index> labels(coarse.cluster_of.size());
    for (std::size_t t = 0; t < labels.size(); ++t) labels[t] = partition.labels[coarse.cluster_of[t]];
    partition = lloyd.fit(std::move(labels), partition.count());
    seconds.lloyd += clock.lap();
    return partition;
  }
}

// Numbers the regions in descending order of area.
void sort_regions(const SegmentDomain& domain, std::vector<Index>& labels, std::vector<Primitive>& primitives) {
  const std::size_t count = primitives.size();
  std::vector<double> area(count, 0);
  for (std::size_t t = 0; t < labels.size(); ++t) area[labels[t]] += domain.areas[t];
  std::vector<Index> order(count), number(count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return area[a] > area[b]; });
  std::vector<Primitive> sorted;
  for (std::size_t k = 0; k < count; ++k) {
    number[order[k]] = static_cast<Index>(k);
    sorted.push_back(primitives[order[k]]);
  }
  primitives = std::move(sorted);
  for (Index& l : labels) l = number[l];
}

double mean_square(const SegmentDomain& domain, const std::vector<Index>& labels, const std::vector<Proxy>& proxies) {
  return fixed_sum(labels.size(),
                   [&](std::size_t t) { return distance_to(domain, static_cast<Index>(t), proxies[labels[t]]); }) /
         domain.area;
}

std::vector<Proxy> proxies_of(const std::vector<Primitive>& primitives) {
  std::vector<Proxy> proxies;
  for (const Primitive& p : primitives) proxies.push_back(Proxy::of(p));
  return proxies;
}

// Moves triangles at borders to the region whose final surface is nearer.
void polish_borders(const SegmentDomain& domain, const std::vector<Proxy>& proxies, std::vector<Index>& labels,
                    std::size_t& evaluations) {
  std::vector<Index> all(labels.size());
  std::iota(all.begin(), all.end(), 0u);
  std::vector<double> distances(labels.size());
  for (const Index t : all) distances[t] = distance_to(domain, t, proxies[labels[t]]);
  BorderMoves(domain).relax(proxies, std::move(all), labels, distances, evaluations);
}

// Smooths the borders and fits the primitives anew, with weights that grow up to the one asked for, so long as the
// root mean square distance stays within `most`; borders go on from where the last weight left them. Returns the last
// weight, 0 if even the least raised the distance too far.
double smooth_within(const SegmentDomain& domain, const SegmentOptions& options, const std::vector<Proxy>& proxies,
                     double most, std::vector<Index>& labels, std::vector<Primitive>& primitives,
                     const Context& context) {
  const auto distance = [&](Index t, Index r) { return distance_to(domain, t, proxies[r]); };
  const std::vector<double> weights = border_weights(domain, region_noise(domain, labels, proxies));
  const std::vector<Primitive> unsmoothed = primitives;
  double used = 0;
  const auto advance = [&](double weight) {
    SmoothBordersOptions smoothing;
    smoothing.rings = options.fuzzy_rings;
    for (const double w : weights) smoothing.weights.push_back(weight * w);
    std::vector<Index> smoothed = labels;
    std::vector<Primitive> refined = unsmoothed;
    smooth_borders(domain.graph, domain.triangles, distance, smoothing, smoothed, context);
    refine_primitives(domain, smoothed, refined, context);
    if (std::sqrt(mean_square(domain, smoothed, proxies_of(refined))) > most + kNegligible) return false;
    labels = std::move(smoothed);
    primitives = std::move(refined);
    used = weight;
    return true;
  };
  int halvings = kFirstHalvings;
  while (!advance(std::ldexp(options.smooth, -halvings)) && halvings < kMostHalvings) ++halvings;
  if (used == 0) return 0;
  while (halvings > 0 && advance(std::ldexp(options.smooth, -(halvings - 1)))) --halvings;
  if (halvings > 0) advance(std::numbers::sqrt2 * used);
  return used;
}

SegmentRegion measure_region(const SegmentDomain& domain, const Primitive& primitive, const Index* begin,
                             const Index* end) {
  SegmentRegion region;
  region.triangles = static_cast<std::size_t>(end - begin);
  double sum = 0;
  for (const Index* t = begin; t != end; ++t) {
    if (!(domain.areas[*t] > 0)) continue;
    const Triangle& v = domain.triangles[*t];
    double squares = 0;
    for (const Vec3& p :
         {domain.vertices[v[0]], domain.vertices[v[1]], domain.vertices[v[2]], domain.barycentres[*t]}) {
      const double d = distance(primitive, p);
      squares += d * d;
      region.max = std::max(region.max, d);
    }
    sum += 0.25 * domain.areas[*t] * squares;
    region.area += domain.areas[*t];
  }
  region.rms = region.area > 0 ? std::sqrt(sum / region.area) : 0;
  region.proxy = from_local(primitive, domain.origin, domain.scale);
  region.area *= domain.scale * domain.scale;
  region.rms *= domain.scale;
  region.max *= domain.scale;
  return region;
}

std::vector<Vec3> projected_vertices(const TriangleMesh& mesh, const SegmentDomain& domain,
                                     const std::vector<Index>& labels, const std::vector<Primitive>& primitives,
                                     const std::vector<SegmentRegion>& measured) {
  std::vector<std::vector<Index>> regions(mesh.vertices.size());
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (const Index v : domain.triangles[t])
      if (std::find(regions[v].begin(), regions[v].end(), labels[t]) == regions[v].end())
        regions[v].push_back(labels[t]);
  std::vector<Vec3> result = mesh.vertices;
  parallel_each(result.size(), [&](std::size_t v) {
    if (regions[v].empty()) return;
    Vec3 sum;
    for (const Index r : regions[v]) {
      // A surface that ends before the region's rim has its foot points elsewhere.
      const Vec3& p = domain.vertices[v];
      const Vec3 foot = foot_point(primitives[r], p);
      sum += norm(foot - p) <= kFarFoot * measured[r].max / domain.scale ? foot : p;
    }
    result[v] = domain.origin + (domain.scale / static_cast<double>(regions[v].size())) * sum;
  });
  // Those that were joined with another vertex go with it.
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (const Index v : mesh.triangles[t])
      for (const Index w : domain.triangles[t])
        if (v != w && mesh.vertices[v] == mesh.vertices[w] && regions[v].empty()) result[v] = result[w];
  return result;
}

// The regions' primitives and borders, and how far they are.
struct Classified {
  std::vector<Index> labels;
  std::vector<Primitive> primitives;
  double rms_before = 0, rms = 0;  // before and after smoothing, in the unit-sized model
  double border_before = 0, border_after = 0, smooth = 0;
  std::vector<SegmentRelation> relations;
};

// `most`: the root mean square distance to be met, with `at_any_cost` by less simple surfaces than would do otherwise.
Classified classify(Lloyd& lloyd, const SegmentOptions& options, const Partition& partition, double most,
                    bool at_any_cost, SegmentSeconds& seconds) {
  const SegmentDomain& domain = lloyd.domain();
  const Context& context = lloyd.context();
  report(context, "classifying", 0.9, partition.energy());
  Stopwatch clock;
  Classified result;
  result.primitives =
      region_primitives(domain, partition.labels, partition.count(), partition.proxies, options.surfaces, context);
  result.labels = partition.labels;
  if (at_any_cost) take_proxies(domain, result.labels, partition.proxies, most * most * domain.area, result.primitives);
  polish_borders(domain, proxies_of(result.primitives), result.labels, lloyd.counts.evaluations);
  if (!at_any_cost) {
    simplify_primitives(domain, options.surfaces, result.labels, result.primitives, lloyd.counts.evaluations, context);
    refine_primitives(domain, result.labels, result.primitives, context);
  }
  const std::vector<Proxy> proxies = proxies_of(result.primitives);
  seconds.classify += clock.lap();
  result.border_before = result.border_after = border_length(domain.graph, result.labels);
  result.rms_before = std::sqrt(mean_square(domain, result.labels, proxies));
  if (options.smooth > 0) {
    report(context, "smoothing borders", 0.95);
    const double limit = std::max(result.rms_before, std::min(kMostGrowth * result.rms_before, most));
    result.smooth = smooth_within(domain, options, proxies, limit, result.labels, result.primitives, context);
    result.border_after = border_length(domain.graph, result.labels);
  }
  sort_regions(domain, result.labels, result.primitives);
  if (options.regularize) result.relations = regularize(domain, result.labels, result.primitives);
  result.rms = std::sqrt(mean_square(domain, result.labels, proxies_of(result.primitives)));
  seconds.smooth += clock.lap();
  return result;
}

}  // namespace

SegmentResult segment(const TriangleMesh& mesh, const SegmentOptions& options, const Context& context) {
  Stopwatch total;
  check_options(options);
  require_moderate_model(mesh.vertices, "vertex");
  const SegmentDomain domain = make_segment_domain(mesh);
  SegmentOptions aimed = options;
  aimed.proxies = possible_count(domain, options.proxies, context);
  SegmentResult result;
  Lloyd lloyd(domain, options.surfaces, context);
  PartitionEditor editor(lloyd, options.iterations, kMostEvaluations * domain.triangles.size());
  bool fresh = false;
  Partition partition = coarse_partition(lloyd, aimed, result.seconds);
  if (partition.count() == 0) {
    partition = start_partition(lloyd, aimed, result.seconds);
    fresh = true;
  }
  const double most = options.proxies > 0 ? kInfinity : allowed_rms(domain, options.error);
  Classified classified;
  for (int k = 0; k < kAttempts; ++k) {
    improve(lloyd, editor, aimed, k == 0 && fresh, partition, result.seconds);
    classified = classify(lloyd, aimed, partition, most, k + 1 == kAttempts, result.seconds);
    if (classified.rms <= most) break;
    aimed.error *= std::max(kLeastAim, kAim * most / classified.rms);
  }
  if (classified.rms > most)
    context.warn(
        fmt::format("the root mean square distance is {:.4g}, not {:.4g} as asked for; ask for a smaller error or for "
                    "a number of proxies",
                    domain.scale * classified.rms, domain.scale * most));

  Stopwatch clock;
  const std::vector<Index>& labels = classified.labels;
  const std::size_t count = partition.count();
  const Csr<Index> triangles = items_of_labels<Index>(labels, count);
  for (std::size_t r = 0; r < count; ++r)
    result.regions.push_back(measure_region(domain, classified.primitives[r], triangles.begin(r), triangles.end(r)));
  if (options.project)
    result.projected = projected_vertices(mesh, domain, labels, classified.primitives, result.regions);
  result.seconds.project = clock.lap();
  result.rms = domain.scale * classified.rms;
  result.rms_before = domain.scale * classified.rms_before;
  result.smooth = classified.smooth;
  result.relations = std::move(classified.relations);
  result.border_before = classified.border_before;
  result.border_after = classified.border_after;
  result.labels = std::move(classified.labels);
  result.iterations = lloyd.counts.iterations;
  result.evaluations = lloyd.counts.evaluations;
  result.energies = std::move(lloyd.counts.energies);
  result.insertions = lloyd.counts.insertions;
  result.merges = lloyd.counts.merges;
  result.deletions = lloyd.counts.deletions;
  result.teleportations = lloyd.counts.teleportations;
  result.seconds.total = total.seconds();
  return result;
}

}  // namespace bisector
