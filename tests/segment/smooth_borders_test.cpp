#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "segment/region_topology.h"
#include "segment/smooth_borders.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Distances = std::vector<std::vector<double>>;  // of each triangle to each region

struct Problem {
  TriangleMesh mesh;
  DualGraph graph;
  std::vector<Index> labels;
  Distances distances;

  Problem(TriangleMesh m, std::vector<Index> l, Distances d)
      : mesh(std::move(m)), graph(dual_graph(mesh.triangles, mesh.vertices)), labels(std::move(l)),
        distances(std::move(d)) {}

  // With the same weight for all regions.
  SmoothBordersResult smooth(double weight, int rings = 0, int sweeps = 10) {
    const std::size_t regions = 1 + *std::max_element(labels.begin(), labels.end());
    return smooth(SmoothBordersOptions{std::vector<double>(regions, weight), rings, sweeps});
  }

  SmoothBordersResult smooth(const SmoothBordersOptions& options) {
    return smooth_borders(
        graph, mesh.triangles, [&](Index t, Index r) { return distances[t][r]; }, options, labels);
  }
};

Vec3 barycentre(const TriangleMesh& mesh, std::size_t t) {
  const Triangle& c = mesh.triangles[t];
  return (1.0 / 3) * (mesh.vertices[c[0]] + mesh.vertices[c[1]] + mesh.vertices[c[2]]);
}

// Squared distances and weighted lengths of borders, of the whole mesh.
double energy(const Problem& problem, const std::vector<Index>& labels, double weight) {
  double sum = 0;
  for (std::size_t t = 0; t < labels.size(); ++t) {
    sum += problem.distances[t][labels[t]];
    for (std::size_t k = problem.graph.neighbours.offsets[t]; k < problem.graph.neighbours.offsets[t + 1]; ++k) {
      const Index u = problem.graph.neighbours.values[k];
      if (t < u && labels[u] != labels[t]) sum += weight * problem.graph.edge_length[k];
    }
  }
  return sum;
}

// Euler characteristic, connected parts, border loops and neighbours of a region, taken as the surface that is glued
// from its triangles along their edges.
struct Topology {
  long long euler = 0;
  std::size_t parts = 0, loops = 0;
  std::set<Index> meets;
  bool operator==(const Topology&) const = default;
};

std::size_t find(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i];
  return i;
}

Topology topology(const TriangleMesh& mesh, const std::vector<Index>& labels, Index region) {
  using Edge = std::array<Index, 2>;
  std::map<Edge, std::set<std::size_t>> sides;
  const auto edge = [&](std::size_t t, std::size_t k) {
    const Index a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
    return Edge{std::min(a, b), std::max(a, b)};
  };
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) sides[edge(t, k)].insert(t);

  Topology result;
  std::vector<std::size_t> corner(3 * labels.size()), part(labels.size());
  std::iota(corner.begin(), corner.end(), std::size_t{0});
  std::iota(part.begin(), part.end(), std::size_t{0});
  const auto corner_of = [&](std::size_t t, Index v) {
    return 3 * t + static_cast<std::size_t>(std::find(mesh.triangles[t].begin(), mesh.triangles[t].end(), v) -
                                            mesh.triangles[t].begin());
  };
  std::map<Edge, std::size_t> border;  // the triangle at it
  for (const auto& [e, around] : sides) {
    std::vector<std::size_t> mine;
    for (const std::size_t t : around)
      if (labels[t] == region) mine.push_back(t);
    if (mine.empty()) continue;
    --result.euler;
    for (const std::size_t t : around)
      if (labels[t] != region) result.meets.insert(labels[t]);
    for (const std::size_t t : mine) {
      part[find(part, t)] = find(part, mine[0]);
      for (const Index v : e) corner[find(corner, corner_of(t, v))] = find(corner, corner_of(mine[0], v));
    }
    if (mine.size() == 1) border[e] = mine[0];
  }
  std::set<std::size_t> vertices, parts;
  for (std::size_t t = 0; t < labels.size(); ++t) {
    if (labels[t] != region) continue;
    ++result.euler;
    parts.insert(find(part, t));
    for (std::size_t k = 0; k < 3; ++k) vertices.insert(find(corner, corner_of(t, mesh.triangles[t][k])));
  }
  result.euler += static_cast<long long>(vertices.size());
  result.parts = parts.size();

  std::vector<std::size_t> loop(3 * labels.size());
  std::iota(loop.begin(), loop.end(), std::size_t{0});
  for (const auto& [e, t] : border) {
    const std::size_t p = find(corner, corner_of(t, e[0])), q = find(corner, corner_of(t, e[1]));
    loop[find(loop, p)] = find(loop, q);
  }
  std::set<std::size_t> loops;
  for (const auto& [e, t] : border) loops.insert(find(loop, find(corner, corner_of(t, e[0]))));
  result.loops = loops.size();
  return result;
}

// Regions that grow triangle by triangle from random ones, so that they are connected and their borders ragged.
std::vector<Index> random_regions(const TriangleMesh& mesh, Index count, std::uint64_t seed) {
  const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
  const std::vector<Index> part = connected_parts(graph);
  const std::size_t n = mesh.triangles.size();
  std::vector<Index> labels(n, kNone), front;
  SplitMix64 random(seed);
  Index next = 0;
  for (std::size_t t = 0; t < n; ++t)  // one in each component at least
    if (std::find(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(t), part[t]) ==
        part.begin() + static_cast<std::ptrdiff_t>(t))
      labels[t] = next++;
  while (next < count) {
    const std::size_t t = random.below(n);
    if (labels[t] == kNone) labels[t] = next++;
  }
  for (std::size_t t = 0; t < n; ++t)
    if (labels[t] != kNone) front.push_back(static_cast<Index>(t));
  while (!front.empty()) {
    const std::size_t i = random.below(front.size());
    const Index t = front[i];
    bool grown = false;
    for (const Index* u = graph.neighbours.begin(t); u != graph.neighbours.end(t) && !grown; ++u)
      if (labels[*u] == kNone) {
        labels[*u] = labels[t];
        front.push_back(*u);
        grown = true;
      }
    if (!grown) front.erase(front.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return labels;
}

Index region_count(const std::vector<Index>& labels) { return *std::max_element(labels.begin(), labels.end()) + 1; }

Distances random_distances(std::size_t triangles, Index regions, std::uint64_t seed) {
  SplitMix64 random(seed);
  Distances distances(triangles, std::vector<double>(regions));
  for (auto& row : distances)
    for (double& d : row) d = random.unit() * random.unit();
  return distances;
}

Distances equal_distances(std::size_t triangles, Index regions, double d) {
  return Distances(triangles, std::vector<double>(regions, d));
}

std::vector<std::size_t> strip(const Problem& problem, const std::vector<Index>& labels, Index a, Index b, int rings) {
  std::vector<int> steps(labels.size(), 0);
  const auto in = [&](Index label) { return label == a || label == b; };
  for (int ring = 1; ring <= rings; ++ring)
    for (std::size_t t = 0; t < labels.size(); ++t)
      for (const Index* u = problem.graph.neighbours.begin(t); u != problem.graph.neighbours.end(t); ++u)
        if (steps[t] == 0 && in(labels[t]) && in(labels[*u]) &&
            (ring == 1 ? labels[*u] != labels[t] : steps[*u] == ring - 1))
          steps[t] = ring;
  std::vector<std::size_t> found;
  for (std::size_t t = 0; t < labels.size(); ++t)
    if (steps[t] > 0) found.push_back(t);
  return found;
}

std::vector<TriangleMesh> all_kinds_of_meshes(std::uint64_t seed) {
  return {icosphere(2),           torus(16, 8), wavy_patch(10),         pages(),        two_spheres(),
          duplicated_triangles(), needles(),    collinear_among_good(), soup(30, seed), grid_patch(9, 7)};
}

TEST(RegionTopology, FollowsChanges) {
  std::size_t same_chains = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = all_kinds_of_meshes(seed)[seed % 10];
    const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
    SplitMix64 random(seed);
    std::vector<Index> labels(mesh.triangles.size());
    for (std::size_t t = 0; t < labels.size(); ++t) labels[t] = static_cast<Index>(t % 2 == 0 ? 0 : random.below(3));
    const Index regions = region_count(labels);
    RegionTopology tracked(graph, mesh.triangles, labels);
    for (int step = 0; step < 20; ++step) {
      std::set<Index> chosen;
      for (int k = 0; k < 5; ++k) chosen.insert(static_cast<Index>(random.below(labels.size())));
      const std::vector<Index> changed(chosen.begin(), chosen.end());
      std::vector<Topology> before;
      std::vector<long long> euler_before, loops_before;
      std::vector<std::vector<std::vector<std::size_t>>> chains_before;
      for (Index r = 0; r < regions; ++r) {
        before.push_back(topology(mesh, labels, r));
        euler_before.push_back(tracked.local_euler(r, changed));
        loops_before.push_back(static_cast<long long>(tracked.local_loops(r, changed)));
        chains_before.push_back(tracked.border_chains(r, changed));
      }
      for (const Index t : changed) tracked.relabel(t, static_cast<Index>(random.below(regions)));
      for (Index r = 0; r < regions; ++r) {
        const Topology after = topology(mesh, labels, r);
        EXPECT_EQ(tracked.local_euler(r, changed) - euler_before[r], after.euler - before[r].euler);
        const long long more_loops = static_cast<long long>(after.loops) - static_cast<long long>(before[r].loops);
        EXPECT_EQ(static_cast<long long>(tracked.local_loops(r, changed)) - loops_before[r], more_loops);
        if (tracked.border_chains(r, changed) == chains_before[r]) {
          ++same_chains;
          EXPECT_EQ(more_loops, 0);
        }
        EXPECT_EQ(tracked.triangle_count(r), static_cast<std::size_t>(std::count(labels.begin(), labels.end(), r)));
        std::set<Index> contacts;
        for (const auto& [other, count] : tracked.contacts(r)) contacts.insert(other);
        EXPECT_EQ(contacts, after.meets);
      }
    }
  }
  EXPECT_GT(same_chains, 0u);
}

TEST(RegionTopology, FindsCrumbs) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = seed % 2 ? icosphere(2) : grid_patch(12, 9);
    const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
    std::vector<Index> labels = random_regions(mesh, 2, seed);
    RegionTopology tracked(graph, mesh.triangles, labels);
    SplitMix64 random(seed);
    std::set<Index> chosen;
    for (int k = 0; k < 12; ++k) chosen.insert(static_cast<Index>(random.below(labels.size())));
    const std::vector<Index> changed(chosen.begin(), chosen.end());
    for (const Index t : changed) tracked.relabel(t, 1 - labels[t]);
    const std::vector<Index> part = connected_parts(graph, labels);
    for (const Index r : {0, 1}) {
      std::map<Index, std::size_t> parts;
      for (std::size_t t = 0; t < labels.size(); ++t)
        if (labels[t] == r) ++parts[part[t]];
      const std::vector<Index> crumbs = tracked.crumbs(r, changed);
      // Whole parts, all but one.
      std::set<Index> crumbled;
      std::size_t lost = 0;
      for (const Index t : crumbs) {
        EXPECT_EQ(labels[t], static_cast<Index>(r));
        crumbled.insert(part[t]);
        ++lost;
      }
      EXPECT_EQ(crumbled.size() + 1, parts.size()) << "region " << r;
      std::size_t expected = 0;
      for (const Index p : crumbled) expected += parts.at(p);
      EXPECT_EQ(lost, expected);
    }
  }
}

// Of two regions a cut finds the best, so far as that keeps the topology.
TEST(SmoothBorders, FindsTheBestOfAllLabellings) {
  int reached = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    TriangleMesh mesh = grid_patch(4, seed % 2 ? 1 : 2);
    std::vector<Index> labels(mesh.triangles.size());
    for (std::size_t t = 0; t < labels.size(); ++t) labels[t] = barycentre(mesh, t).x > 2;
    Problem problem(mesh, labels, random_distances(labels.size(), 2, seed));
    const double weight = 0.1 * static_cast<double>(seed % 5);
    const Topology before[] = {topology(mesh, labels, 0), topology(mesh, labels, 1)};
    const double start = energy(problem, labels, weight);
    double best = start, best_kept = start;  // of all labellings, and of those that keep the topology
    for (std::size_t bits = 0; bits < std::size_t{1} << labels.size(); ++bits) {
      std::vector<Index> x = labels;
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = bits >> i & 1;
      const double e = energy(problem, x, weight);
      if (e < best_kept && topology(mesh, x, 0) == before[0] && topology(mesh, x, 1) == before[1]) best_kept = e;
      best = std::min(best, e);
    }
    problem.smooth(weight);
    const double result = energy(problem, problem.labels, weight);
    EXPECT_LE(result, start + 1e-9);
    EXPECT_GE(result, best_kept - 1e-9);
    if (best_kept > best + 1e-9) continue;
    EXPECT_NEAR(result, best, 1e-9);
    reached += best < start - 1e-9;
  }
  EXPECT_GE(reached, 10);
}

TEST(SmoothBorders, NeverRaisesTheEnergy) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = seed % 3 == 0 ? icosphere(3) : seed % 3 == 1 ? torus(24, 12) : wavy_patch(12);
    const Index regions = seed % 2 ? 2 : 7;
    const std::vector<Index> labels = random_regions(mesh, regions, seed);
    Problem problem(mesh, labels, random_distances(labels.size(), regions, seed));
    const double weight = static_cast<double>(seed % 4);
    double last = energy(problem, labels, weight);
    bool fell = false;
    for (int step = 0; step < 4; ++step) {
      problem.smooth(weight, static_cast<int>(seed % 3), 1);
      const double e = energy(problem, problem.labels, weight);
      EXPECT_LE(e, last * (1 + 1e-9));
      fell = fell || e < last;
      last = e;
    }
    EXPECT_TRUE(fell);
  }
}

// With equal distances only the borders count.
TEST(SmoothBorders, ShortensTheBordersOfManyRegions) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = seed % 2 ? icosphere(3) : torus(32, 16);
    const std::vector<Index> labels = random_regions(mesh, 12, seed);
    Problem problem(mesh, labels, equal_distances(labels.size(), 12, seed % 3 ? 1.0 : 0.0));
    const SmoothBordersResult result = problem.smooth(2);
    EXPECT_GT(result.cuts, 0u);
    EXPECT_LT(border_length(problem.graph, problem.labels), border_length(problem.graph, labels));
  }
}

// A tongue of one region between two others goes back at once, and the junction at its tip with it.
TEST(SmoothBorders, MovesJunctionsOfThreeRegions) {
  const int n = 20;
  const TriangleMesh mesh = grid_patch(n, n);
  std::vector<Index> labels(mesh.triangles.size());
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const Vec3 p = barycentre(mesh, t);
    labels[t] = p.y > 3 ? (p.x > n / 2 ? 1 : 0) : 2;
    if (p.y > 3 && p.y < 17 && std::abs(p.x - n / 2) < 3) labels[t] = 2;  // a tongue of the third region
  }
  Problem problem(mesh, labels, equal_distances(labels.size(), 3, 1));
  EXPECT_GT(border_length(problem.graph, labels), n + 2 * 14);
  problem.smooth(1);
  EXPECT_LE(border_length(problem.graph, problem.labels), n + (n - 3));  // straight borders
}

// A weight of one region only makes its borders short, and leaves those of the others.
TEST(SmoothBorders, WeighsTheBordersOfEachRegion) {
  const int nx = 24, ny = 10;
  const TriangleMesh mesh = grid_patch(nx, ny);
  std::vector<Index> labels(mesh.triangles.size());
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const Vec3 p = barycentre(mesh, t);
    const double x = p.x - static_cast<int>(p.y) % 2;
    labels[t] = x > 18 ? 3 : x > 12 ? 2 : x > 6 ? 1 : 0;
  }
  Problem problem(mesh, labels, equal_distances(labels.size(), 4, 1));
  problem.smooth(SmoothBordersOptions{{1, 0, 0, 0}, 0, 10});
  for (std::size_t t = 0; t < labels.size(); ++t) {
    if (barycentre(mesh, t).x > 8) {
      EXPECT_EQ(problem.labels[t], labels[t]);
    }
  }
  double length = 0;
  for (std::size_t t = 0; t < labels.size(); ++t)
    for (std::size_t k = problem.graph.neighbours.offsets[t]; k < problem.graph.neighbours.offsets[t + 1]; ++k)
      if (problem.labels[t] == 0 && problem.labels[problem.graph.neighbours.values[k]] == 1)
        length += problem.graph.edge_length[k];
  EXPECT_DOUBLE_EQ(length, ny);
}

TEST(SmoothBorders, StraightensAZigzag) {
  const int nx = 12, ny = 10;
  const TriangleMesh mesh = grid_patch(nx, ny);
  std::vector<Index> labels(mesh.triangles.size());
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const Vec3 p = barycentre(mesh, t);
    labels[t] = p.x > nx / 2 + static_cast<int>(p.y) % 2;
  }
  Problem problem(mesh, labels, equal_distances(labels.size(), 2, 1));
  EXPECT_GT(border_length(problem.graph, labels), 1.5 * ny);
  const SmoothBordersResult result = problem.smooth(1);
  EXPECT_EQ(result.cuts, 1u);
  EXPECT_DOUBLE_EQ(border_length(problem.graph, problem.labels), ny);
}

TEST(SmoothBorders, KeepsTheTopologyOfRegions) {
  std::size_t cuts = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    const TriangleMesh mesh = all_kinds_of_meshes(seed)[seed % 10];
    const auto wanted = std::min<std::size_t>(2 + seed % 7, mesh.triangles.size());
    const std::vector<Index> labels = random_regions(mesh, static_cast<Index>(wanted), seed);
    const Index regions = region_count(labels);
    Problem problem(mesh, labels, random_distances(labels.size(), regions, seed));
    cuts += problem.smooth(0.5 * static_cast<double>(seed % 4), static_cast<int>(seed % 4), 3).cuts;
    for (Index r = 0; r < regions; ++r)
      EXPECT_EQ(topology(mesh, problem.labels, r), topology(mesh, labels, r)) << "region " << r;
  }
  EXPECT_GT(cuts, 20u);
}

// Every triangle is nearer to the large region's proxy, but the small one may not vanish.
TEST(SmoothBorders, LeavesRegionsThatEnergyWouldEmpty) {
  const TriangleMesh mesh = grid_patch(8, 8);
  std::vector<Index> labels(mesh.triangles.size(), 0);
  Distances distances = equal_distances(labels.size(), 2, 1);
  for (std::size_t t = 0; t < labels.size(); ++t) {
    labels[t] = norm(barycentre(mesh, t) - Vec3{4, 4, 0}) < 1;
    distances[t][0] = 0;
  }
  ASSERT_EQ(topology(mesh, labels, 1).parts, 1u);
  Problem problem(mesh, labels, distances);
  problem.smooth(1);
  EXPECT_GT(std::count(problem.labels.begin(), problem.labels.end(), Index{1}), 0);
  for (const Index r : {0, 1}) EXPECT_EQ(topology(mesh, problem.labels, r), topology(mesh, labels, r));
}

// An island that distances ask for far from the rest of its region is given up, and the rest of the cut is made.
TEST(SmoothBorders, GivesCrumbsBack) {
  const TriangleMesh mesh = grid_patch(10, 10);
  std::vector<Index> labels(mesh.triangles.size());
  Distances distances = equal_distances(labels.size(), 2, 1);
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const Vec3 p = barycentre(mesh, t);
    labels[t] = p.x > 5 + (p.y > 8);                                         // a tooth at the top, to be cut off
    if (p.x < 5) distances[t][1] = norm(p - Vec3{2.5, 3, 0}) < 0.8 ? 0 : 2;  // an island at the left
  }
  Problem problem(mesh, labels, distances);
  EXPECT_EQ(problem.smooth(1, 6, 1).cuts, 1u);
  for (std::size_t t = 0; t < labels.size(); ++t) EXPECT_EQ(problem.labels[t], barycentre(mesh, t).x > 5 ? 1u : 0u);
}

TEST(SmoothBorders, ChangesNothingOutsideTheStrip) {
  for (const int rings : {1, 2, 3}) {
    const TriangleMesh mesh = icosphere(3);
    const std::vector<Index> labels = random_regions(mesh, 2, 4);
    Problem problem(mesh, labels, random_distances(labels.size(), 2, 4));
    const std::vector<std::size_t> free = strip(problem, labels, 0, 1, 2 * rings);  // each region has its turn
    const SmoothBordersResult result = problem.smooth(0.5, rings, 1);
    EXPECT_GT(result.cuts, 0u);
    for (std::size_t t = 0; t < labels.size(); ++t)
      EXPECT_TRUE(problem.labels[t] == labels[t] || std::binary_search(free.begin(), free.end(), t));
  }
}

TEST(SmoothBorders, WithoutLengthsOnlyDistancesCount) {
  const TriangleMesh mesh = grid_patch(10, 6);
  std::vector<Index> labels(mesh.triangles.size()), ideal(labels.size());
  Distances distances(labels.size());
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const Vec3 p = barycentre(mesh, t);
    labels[t] = p.x > 5;
    ideal[t] = p.x > 5 + 0.4 * std::sin(p.y);
    distances[t] = {ideal[t] ? 1.0 : 0.25, ideal[t] ? 0.5 : 2.0};
  }
  Problem problem(mesh, labels, distances);
  problem.smooth(0, 2);
  EXPECT_EQ(problem.labels, ideal);
  EXPECT_NE(problem.labels, labels);

  Problem random(mesh, labels, random_distances(labels.size(), 2, 9));
  random.smooth(0, 2, 1);
  for (std::size_t t = 0; t < labels.size(); ++t)
    EXPECT_TRUE(random.labels[t] == labels[t] ||
                random.distances[t][random.labels[t]] < random.distances[t][labels[t]]);
}

TEST(SmoothBorders, IgnoresDistancesThatAreNoNumbers) {
  const TriangleMesh mesh = grid_patch(6, 6);
  const std::vector<Index> labels = random_regions(mesh, 2, 1);
  for (const double d : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN(), 1e308}) {
    Problem problem(mesh, labels, equal_distances(labels.size(), 2, d));
    Problem equal(mesh, labels, equal_distances(labels.size(), 2, 1));
    problem.smooth(1, 2);
    equal.smooth(1, 2);
    EXPECT_EQ(problem.labels, equal.labels);
  }
}

TEST(SmoothBorders, RefusesWeightsBelowZero) {
  const TriangleMesh mesh = grid_patch(2, 2);
  Problem problem(mesh, random_regions(mesh, 2, 1), equal_distances(mesh.triangles.size(), 2, 1));
  EXPECT_THROW(problem.smooth(-1), Error);
  EXPECT_THROW(problem.smooth(std::numeric_limits<double>::quiet_NaN()), Error);
  EXPECT_THROW(problem.smooth(std::numeric_limits<double>::infinity()), Error);
  EXPECT_THROW(problem.smooth(SmoothBordersOptions{{1}, 0, 1}), Error);  // two regions
}

}  // namespace
}  // namespace bisector::test
