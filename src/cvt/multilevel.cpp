#include "cvt/multilevel.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "core/geometry.h"
#include "mesh/sampling.h"
#include "mesh/topology.h"
#include "voronoi/dual.h"
#include "voronoi/polygons.h"

namespace bisector {
namespace {

// Rounds of seeds that follow a density, at most; and what a cell should be divided into to get another one.
constexpr int kFollowingRounds = 6;
constexpr double kTooFew = 1.5;

constexpr std::size_t kPerComponent = 4;  // a tetrahedron
constexpr std::size_t kCoarsest = 100;    // seeds on the coarsest level, at least
constexpr int kLevels = 3;
constexpr double kNearMiddle = 0.25;  // of the distance of two seeds

}  // namespace

std::vector<Vec3> initial_seeds(const Surface& surface, std::size_t count, std::uint64_t random_seed) {
  std::vector<double> weight(surface.density.size());
  std::transform(surface.density.begin(), surface.density.end(), weight.begin(), [](double r) { return std::sqrt(r); });
  std::vector<SurfaceSample> samples = sample_surface(surface.mesh, count, random_seed, weight);

  // Components that chance left too few move seeds over from the others.
  const std::vector<Index> label = label_components(surface.mesh.triangles, surface.mesh.vertices.size());
  std::vector<std::vector<Triangle>> parts;
  for (const FacetSummary& facet : surface.summaries) {
    const Triangle& t = surface.mesh.triangles[facet.triangle];
    if (label[t[0]] >= parts.size()) parts.resize(label[t[0]] + 1);
    parts[label[t[0]]].push_back(t);
  }
  const auto component = [&](const SurfaceSample& s) { return label[surface.mesh.triangles[s.triangle][0]]; };
  std::vector<std::size_t> have(parts.size(), 0);
  if (parts.size() == 1) have[0] = samples.size();
  if (parts.size() > 1)
    for (const SurfaceSample& s : samples) ++have[component(s)];
  std::vector<Vec3> added;
  for (Index c = 0; c < parts.size() && count >= kPerComponent * parts.size(); ++c) {
    if (parts[c].empty() || have[c] >= kPerComponent) continue;
    const TriangleMesh part{surface.mesh.vertices, parts[c], {}};
    for (const SurfaceSample& s : sample_surface(part, kPerComponent - have[c], random_seed + c + 1, weight))
      added.push_back(s.point);
  }
  std::size_t surplus = added.size();
  std::vector<Vec3> seeds = std::move(added);
  seeds.reserve(seeds.size() + samples.size());
  for (const SurfaceSample& s : samples) {
    if (std::size_t* left = surplus > 0 ? &have[component(s)] : nullptr; left && *left > kPerComponent) {
      --surplus;
      --*left;
    } else {
      seeds.push_back(s.point);
    }
  }
  return seeds;
}

std::vector<std::size_t> level_counts(std::size_t count, long long euler, std::size_t components, int levels) {
  const std::size_t least = std::max(kCoarsest, kPerComponent * components);
  std::vector<std::size_t> counts{count};
  const int most = levels > 0 ? levels : kLevels;
  while (static_cast<int>(counts.size()) < most) {
    const long long coarser = (static_cast<long long>(counts.back()) + 3 * euler + 2) / 4;
    if (coarser < static_cast<long long>(levels > 0 ? kPerComponent * components : least)) break;
    counts.push_back(static_cast<std::size_t>(coarser));
  }
  std::reverse(counts.begin(), counts.end());
  return counts;
}

namespace {

// Of each edge the square of its length over the length that edges have there, but for a factor: rho^(-1/4), rho being
// the mean density of the two cells.
std::vector<double> relative_squared_lengths(const Diagram& diagram, const std::vector<Vec3>& seeds,
                                             const std::vector<DualEdge>& edges) {
  const RestrictedPolygons& polygons = diagram.polygons;
  std::vector<double> area(seeds.size(), 0), squared(edges.size());
  for (std::size_t p = 0; p < polygons.pairs.size(); ++p) area[polygons.pairs[p].cell] += polygon_area(polygons, p);
  const std::vector<Moments>& cells = diagram.moments.cells;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const Index a = edges[k].a, b = edges[k].b;
    const double areas = area[a] + area[b], density = areas > 0 ? (cells[a].mass + cells[b].mass) / areas : 1;
    squared[k] = norm2(seeds[a] - seeds[b]) * std::sqrt(density);
  }
  return squared;
}

// The midpoints of the dual edges, as many as there is room for; where edges are too few, also points of cells of high
// energy.
void add_midpoints(const Diagram& diagram, const PlacedSeeds& coarse, const std::vector<DualEdge>& edges,
                   std::size_t count, PlacedSeeds& finer) {
  const std::vector<Vec3>& seeds = coarse.positions();
  const std::size_t room = count > finer.size() ? count - finer.size() : 0;
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (edges.size() > room) {
    const std::vector<double> squared = relative_squared_lengths(diagram, seeds, edges);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return squared[a] > squared[b]; });
    order.resize(room);
  }
  for (const std::size_t k : order) {
    const DualEdge& edge = edges[k];
    const Vec3 a = seeds[edge.a], b = seeds[edge.b], middle = 0.5 * (a + b);
    // On a smooth surface the middle is the better start; where the edge crosses elsewhere, it may be off the sheet.
    const bool near = norm2(middle - edge.crossing) < kNearMiddle * kNearMiddle * norm2(b - a);
    finer.add(near ? middle : edge.crossing);
  }
  if (finer.size() < count) finer.add(insertion_points(diagram, coarse, count - finer.size()));
}

}  // namespace

PlacedSeeds refine(const Diagram& diagram, const PlacedSeeds& coarse, const FeatureCurves& curves,
                   const PlacedSeeds& on_features, std::size_t count) {
  PlacedSeeds finer = on_features;
  for (std::size_t i = 0; i < coarse.size(); ++i)
    if (coarse.on_surface(i)) finer.add(coarse.position(i));
  const std::vector<std::array<Index, 2>> along = curve_neighbours(curves, coarse.places());
  std::vector<DualEdge> edges = extract_dual_edges(diagram.polygons, coarse.positions());
  std::erase_if(edges, [&](const DualEdge& e) {
    return std::binary_search(along.begin(), along.end(), std::array<Index, 2>{e.a, e.b});
  });
  add_midpoints(diagram, coarse, edges, count, finer);
  return finer;
}

std::vector<std::array<Index, 2>> curve_neighbours(const FeatureCurves& curves, const std::vector<SeedPlace>& places) {
  std::vector<std::vector<std::pair<double, Index>>> on(curves.size());
  std::vector<Index> at_corner(curves.graph().corners.size(), kNone);
  for (Index i = 0; i < places.size(); ++i) {
    if (places[i].curve != kNone) on[places[i].curve].push_back({places[i].position, i});
    if (places[i].corner != kNone) at_corner[places[i].corner] = i;
  }
  std::vector<std::array<Index, 2>> pairs;
  for (Index c = 0; c < on.size(); ++c) {
    std::sort(on[c].begin(), on[c].end());
    std::vector<Index> row;
    for (const auto& [position, seed] : on[c]) row.push_back(seed);
    if (curves.closed(c)) {
      if (!row.empty()) row.push_back(row.front());
    } else {
      const auto [first, last] = curves.ends(c);
      if (at_corner[first] != kNone) row.insert(row.begin(), at_corner[first]);
      if (at_corner[last] != kNone) row.push_back(at_corner[last]);
    }
    for (std::size_t k = 1; k < row.size(); ++k)
      if (row[k - 1] != row[k]) pairs.push_back({std::min(row[k - 1], row[k]), std::max(row[k - 1], row[k])});
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

std::vector<Vec3> insertion_points(const Diagram& diagram, const PlacedSeeds& placed, std::size_t count) {
  const RestrictedPolygons& polygons = diagram.polygons;
  const std::vector<Moments>& cells = diagram.moments.cells;
  const std::vector<Vec3>& seeds = placed.positions();
  std::vector<double> squared(seeds.size(), -1);
  std::vector<Vec3> corner(seeds.size());
  for (std::size_t k = 0; k < polygons.pairs.size(); ++k) {
    const Index cell = polygons.pairs[k].cell;
    for (std::size_t e = polygons.offsets[k]; e < polygons.offsets[k + 1]; ++e) {
      const double d = norm2(polygons.vertices[e] - seeds[cell]);
      if (d > squared[cell]) {
        squared[cell] = d;
        corner[cell] = polygons.vertices[e];
      }
    }
  }
  std::vector<Index> order(seeds.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return cells[a].second > cells[b].second; });
  std::vector<std::vector<Index>> around(seeds.size());
  for (const DualEdge& e : extract_dual_edges(polygons, seeds)) {
    around[e.a].push_back(e.b);
    around[e.b].push_back(e.a);
  }
  std::vector<char> taken(seeds.size(), 0);
  std::set<std::array<double, 3>> distinct;
  std::vector<Vec3> points;
  for (bool spread : {true, false}) {
    std::vector<char> blocked(seeds.size(), 0);
    for (Index i : order) {
      if (points.size() == count) return points;
      if (!placed.on_surface(i) || squared[i] <= 0 || taken[i] || blocked[i]) continue;
      taken[i] = 1;
      // A corner belongs to several cells.
      if (!distinct.insert({corner[i].x, corner[i].y, corner[i].z}).second) continue;
      points.push_back(corner[i]);
      if (spread)
        for (Index j : around[i]) blocked[j] = 1;
    }
  }
  return points;
}

void set_count(const Diagram& diagram, std::size_t count, PlacedSeeds& seeds) {
  if (seeds.size() < count) seeds.add(insertion_points(diagram, seeds, count - seeds.size()));
  if (seeds.size() <= count) return;
  const std::vector<DualEdge> edges = extract_dual_edges(diagram.polygons, seeds.positions());
  const std::vector<double> squared = relative_squared_lengths(diagram, seeds.positions(), edges);
  std::vector<std::size_t> order(edges.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return squared[a] < squared[b]; });
  std::vector<char> removed(seeds.size(), 0);
  std::size_t left = seeds.size();
  const auto remove = [&](Index i) {
    if (left > count && !removed[i] && seeds.on_surface(i)) {
      removed[i] = 1;
      --left;
    }
  };
  for (Index i = 0; i < seeds.size(); ++i)
    if (diagram.moments.cells[i].mass <= 0) remove(i);
  for (bool spread : {true, false}) {
    std::vector<char> blocked(seeds.size(), 0);
    for (std::size_t k : order) {
      const DualEdge& e = edges[k];
      if (left == count) break;
      if (removed[e.a] || removed[e.b] || (spread && (blocked[e.a] || blocked[e.b]))) continue;
      const Index gone = seeds.on_surface(e.b) ? e.b : e.a;
      if (!seeds.on_surface(gone)) continue;
      remove(gone);
      blocked[e.a] = blocked[e.b] = 1;
    }
  }
  seeds.remove(removed);
}

void meet_count(CvtRun& run, std::size_t count) {
  for (std::size_t size = 0; run.seeds.size() != count && run.seeds.size() != size;) {
    run.context().check();
    size = run.seeds.size();
    set_count(run.take_diagram(Want::polygons).diagram, count, run.seeds);
  }
}

void follow_density(CvtRun& run) {
  const std::size_t count = run.seeds.size();
  for (int round = 0; round < kFollowingRounds; ++round) {
    run.context().check();
    const Diagram& diagram = run.diagram(Want::polygons);
    const double mean = diagram.moments.energy / static_cast<double>(count);
    // The energy of a cell falls with the square of the number that it is divided into. Each gets one more a round.
    std::size_t few = 0;
    for (std::size_t i = 0; i < count; ++i)
      few += run.seeds.on_surface(i) && diagram.moments.cells[i].second > kTooFew * kTooFew * mean;
    if (few == 0) return;
    run.seeds.add(insertion_points(diagram, run.seeds, few));
    set_count(run.diagram(Want::polygons), count, run.seeds);
  }
}

}  // namespace bisector
