// Neighbour lists against brute force: order, certificates, growth; and the spatial order they rest on.
#include "voronoi/neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/parallel.h"
#include "spatial/hilbert.h"
#include "support/models.h"
#include "support/rational.h"
#include "voronoi/delaunay.h"
#include "voronoi/exact.h"
#include "voronoi/owner.h"

namespace bisector::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Squared distances within a list may be out of order by the rounding that its readers allow for.
constexpr double kOrder = 1 - 1e-9;

// Every process lists all cases, so seeds are only made by the tests that run.
struct SeedCase {
  std::string name;
  std::function<std::vector<Vec3>()> make;
};

std::vector<Vec3> ball(const Vec3& centre, double radius, std::size_t count, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  std::vector<Vec3> seeds;
  while (seeds.size() < count) {
    const Vec3 p{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    if (norm2(p) <= 1) seeds.push_back(centre + radius * p);
  }
  return seeds;
}

std::vector<Vec3> joined(std::vector<Vec3> a, const std::vector<Vec3>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<Vec3> on_a_line(std::size_t count, const Vec3& direction) {
  SplitMix64 random(3);
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i) seeds.push_back(random.range(-1, 1) * direction);
  return seeds;
}

std::vector<Vec3> geometric(std::size_t count) {
  std::vector<Vec3> seeds;
  for (std::size_t i = 0; i < count; ++i) seeds.push_back(std::ldexp(1.0, -static_cast<int>(i)) * Vec3{1, 0.5, 0.25});
  return seeds;
}

std::vector<SeedCase> seed_cases() {
  using Seeds = std::vector<Vec3>;
  return {
      {"one",
       [] {
         return Seeds{{1, 2, 3}};
       }},
      {"two",
       [] {
         return Seeds{{1, 2, 3}, {-1, 0, 0}};
       }},
      {"three",
       [] {
         return Seeds{{1, 2, 3}, {-1, 0, 0}, {0.5, 0, 0}};
       }},
      {"equal",
       [] {
         return repeated({{1, 2, 3}}, 5);
       }},
      {"four of them twice",
       [] {
         return repeated({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 2);
       }},
      {"ball 3000",
       [] {
         return ball({0, 0, 0}, 1, 3000, 1);
       }},
      {"sphere 3000", [] { return random_seeds(icosphere(2), 3000, 2); }},
      {"far from the origin",
       [] {
         return ball({1e6, -1e6, 1e6}, 1, 2000, 3);
       }},
      {"grid", [] { return grid_seeds(box(2), 12, 12, 12); }},
      {"flat grid", [] { return grid_seeds(grid_patch(4, 4), 40, 40, 1); }},
      {"coplanar", [] { return coplanar_seeds(2000, 4); }},
      {"collinear", [] { return collinear_seeds(500); }},
      {"collinear axis",
       [] {
         return on_a_line(1500, {1, 0, 0});
       }},
      {"collinear oblique",
       [] {
         return on_a_line(1500, {1, 2, -0.5});
       }},
      {"geometric", [] { return geometric(300); }},
      {"duplicates",
       [] {
         return repeated(ball({0, 0, 0}, 1, 700, 5), 3);
       }},
      {"two balls",
       [] {
         return joined(ball({0, 0, 0}, 1e-3, 1000, 6), ball({1, 0, 0}, 1e-4, 1000, 7));
       }},
      {"nested balls",
       [] {
         return joined(ball({0, 0, 0}, 1, 500, 8),
                       joined(ball({0, 0, 0}, 1e-3, 500, 9), ball({0, 0, 0}, 1e-7, 500, 10)));
       }},
      {"cluster and a few",
       [] {
         return joined(ball({0.5, 0.5, 0.5}, 1e-6, 3000, 11), ball({0, 0, 0}, 1, 100, 12));
       }},
      {"cospherical", [] { return cospherical_seeds(); }},
  };
}

class Lists : public testing::TestWithParam<SeedCase> {
 protected:
  const std::vector<Vec3> given = GetParam().make();
};

// Ascending, without the seed itself or repeats, and nothing left out within the radius. A Delaunay ring may leave out
// what bounds no cell.
void expect_certified(const SortedSeeds& seeds, Index slot, const NeighbourList& list, bool complete) {
  const std::size_t n = seeds.x.size();
  const Vec3 x = seeds.x[slot];
  std::vector<char> listed(n, 0);
  double last = 0;
  for (const Index* j = list.begin; j != list.end; ++j) {
    ASSERT_LT(*j, n);
    ASSERT_NE(*j, slot);
    ASSERT_FALSE(listed[*j]);
    listed[*j] = 1;
    const double squared = norm2(seeds.x[*j] - x);
    ASSERT_GE(squared, last * kOrder);
    last = std::max(last, squared);
  }
  if (!complete) return;
  for (Index j = 0; j < n; ++j)
    if (!listed[j] && j != slot) {
      ASSERT_GE(norm(seeds.x[j] - x), list.radius) << "slot " << slot << " leaves out " << j;
    }
}

TEST_P(Lists, NearestAreSortedAndCertified) {
  const SortedSeeds seeds = sort_seeds(given);
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  for (Index slot = 0; slot < seeds.x.size(); ++slot) {
    expect_certified(seeds, slot, neighbours.list(slot), true);
    if (HasFatalFailure()) return;
  }
}

TEST_P(Lists, WiderOnesReachFartherUntilTheyAreComplete) {
  const SortedSeeds seeds = sort_seeds(given);
  const bool planar = !delaunay_neighbours(seeds.x).has_value();
  for (NeighbourSource source : {NeighbourSource::nearest, NeighbourSource::delaunay}) {
    Neighbours neighbours;
    neighbours.build(seeds, source);
    const Index step = std::max<Index>(1, static_cast<Index>(seeds.x.size() / 40));
    for (Index slot = 0; slot < seeds.x.size(); slot += step) {
      NeighbourList list = neighbours.list(slot);
      int rungs = 0;
      for (; list.radius < kInfinity; ++rungs) {
        ASSERT_LT(rungs, 1000);
        const NeighbourList wider = neighbours.wider(slot, list);
        ASSERT_GT(wider.radius, list.radius);
        ASSERT_GT(wider.level, list.level);
        expect_certified(seeds, slot, wider, planar || wider.radius < kInfinity);
        if (HasFatalFailure()) return;
        // What was asked for before is still there.
        expect_certified(seeds, slot, list, true);
        list = wider;
      }
      if (planar) {
        ASSERT_EQ(static_cast<std::size_t>(list.end - list.begin), seeds.x.size() - 1);
      }
    }
  }
}

TEST_P(Lists, DependOnTheSeedsAlone) {
  const SortedSeeds seeds = sort_seeds(given);
  const auto values = [&](const Neighbours& neighbours) {
    std::vector<double> out;
    for (Index slot = 0; slot < seeds.x.size(); ++slot) {
      const NeighbourList list = neighbours.list(slot);
      out.push_back(list.radius);
      for (const Index* j = list.begin; j != list.end; ++j) out.push_back(*j);
    }
    return out;
  };
  for (NeighbourSource source : {NeighbourSource::nearest, NeighbourSource::delaunay}) {
    Neighbours one, two, used;
    {
      const ThreadLimit limit(1);
      one.build(seeds, source);
    }
    const ThreadLimit limit(2);
    two.build(seeds, source);
    const SortedSeeds others = sort_seeds(ball({0, 0, 0}, 2, 3500, 13));
    used.build(others, NeighbourSource::nearest);
    used.wider(0, used.list(0));
    used.build(seeds, source);
    EXPECT_EQ(values(one), values(two));
    EXPECT_EQ(values(one), values(used));
  }
}

// After the seeds have moved, lists are either refused or still sorted and certified, as are wider ones.
TEST_P(Lists, AreCertifiedAfterAnUpdate) {
  SortedSeeds seeds = sort_seeds(given);
  SplitMix64 random(15);
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  // In units of the shortest radius, so that some are worth it.
  double shortest = 1;
  for (Index slot = 0; slot < seeds.x.size(); ++slot) shortest = std::min(shortest, neighbours.list(slot).radius);
  for (double reach : {1e-3, 0.01, 0.03, 0.1}) {
    for (Vec3& x : seeds.x) x += reach * shortest * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    if (!neighbours.update()) neighbours.build(seeds, NeighbourSource::nearest);
    const Index step = std::max<Index>(1, static_cast<Index>(seeds.x.size() / 200));
    for (Index slot = 0; slot < seeds.x.size(); slot += step) {
      const NeighbourList list = neighbours.list(slot);
      expect_certified(seeds, slot, list, true);
      if (HasFatalFailure()) return;
      if (list.radius == kInfinity) continue;
      const NeighbourList wider = neighbours.wider(slot, list);
      expect_certified(seeds, slot, wider, wider.radius < kInfinity);
      if (HasFatalFailure()) return;
    }
  }
}

// With lists and without.
TEST_P(Lists, OfSoManyNearestAgreeWithBruteForce) {
  const SortedSeeds seeds = sort_seeds(given);
  Neighbours listed, on_demand;
  listed.build(seeds, NeighbourSource::nearest);
  on_demand.build_on_demand(seeds, 0);
  SplitMix64 random(17);
  for (int sample = 0; sample < 100; ++sample) {
    const auto slot = static_cast<Index>(random.below(seeds.x.size()));
    std::vector<std::pair<double, Index>> expected;
    for (Index j = 0; j < seeds.x.size(); ++j)
      if (j != slot) expected.push_back({norm2(seeds.x[j] - seeds.x[slot]), seeds.id[j]});
    std::sort(expected.begin(), expected.end());
    for (const std::size_t count : {1, 6, 50}) {
      for (const Neighbours* neighbours : {&listed, &on_demand}) {
        std::vector<Index> found(count);
        found.resize(neighbours->nearest_to(slot, count, found.data()));
        ASSERT_EQ(found.size(), std::min(count, expected.size()));
        for (std::size_t k = 0; k < found.size(); ++k) ASSERT_EQ(seeds.id[found[k]], expected[k].second);
      }
    }
  }
}

TEST_P(Lists, NearestAndAroundAgreeWithBruteForce) {
  const SortedSeeds seeds = sort_seeds(given);
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  SplitMix64 random(14);
  for (int sample = 0; sample < 300; ++sample) {
    const Vec3 near = seeds.x[random.below(seeds.x.size())];
    const double spread = (0.01 + seeds.extent) * std::pow(10, random.range(-8, 0.5));
    const Vec3 q =
        sample % 5 ? near + spread * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)} : near;
    double best = kInfinity;
    for (const Vec3& x : seeds.x) best = std::min(best, norm2(x - q));
    ASSERT_LE(norm2(seeds.x[neighbours.nearest(q)] - q), best * (1 + 1e-12));
    const double radius = sample % 3 ? spread : std::sqrt(best);
    std::vector<Index> found = neighbours.around(q, radius);
    std::sort(found.begin(), found.end());
    ASSERT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
    for (Index j = 0; j < seeds.x.size(); ++j)
      if (norm(seeds.x[j] - q) <= radius) {
        ASSERT_TRUE(std::binary_search(found.begin(), found.end(), j));
      }
  }
}

TEST_P(Lists, SortedSeedsAreTheDistinctOnesInHilbertOrder) {
  const std::vector<Index> order = hilbert_order(given);
  ASSERT_EQ(order.size(), given.size());
  EXPECT_EQ(std::set<Index>(order.begin(), order.end()).size(), given.size());
  EXPECT_LT(*std::max_element(order.begin(), order.end()), given.size());
  const auto key = [](const Vec3& p) { return std::array<double, 3>{p.x, p.y, p.z}; };
  std::set<std::array<double, 3>> left;  // positions that the order has moved on from
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (given[order[k]] == given[order[k - 1]]) {
      EXPECT_LT(order[k - 1], order[k]);
      continue;
    }
    EXPECT_TRUE(left.insert(key(given[order[k - 1]])).second);
  }
  {
    const ThreadLimit limit(1);
    EXPECT_EQ(hilbert_order(given), order);
  }
  const SortedSeeds seeds = sort_seeds(given);
  ASSERT_EQ(seeds.x.size(), seeds.id.size());
  ASSERT_EQ(seeds.slot.size(), given.size());
  std::set<std::array<double, 3>> distinct;
  for (const Vec3& p : given) distinct.insert(key(p));
  EXPECT_EQ(seeds.x.size(), distinct.size());
  for (Index s = 0; s < seeds.x.size(); ++s) {
    EXPECT_EQ(seeds.x[s], given[seeds.id[s]]);
    EXPECT_EQ(seeds.slot[seeds.id[s]], s);
    for (Index i = 0; i < seeds.id[s] && given.size() < 100; ++i) EXPECT_FALSE(given[i] == seeds.x[s]);
  }
  EXPECT_EQ(static_cast<std::size_t>(std::count(seeds.slot.begin(), seeds.slot.end(), kNone)),
            given.size() - seeds.x.size());
}

INSTANTIATE_TEST_SUITE_P(Neighbours, Lists, testing::ValuesIn(seed_cases()), [](const auto& instance) {
  std::string name = instance.param.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

// Seeds are the sparser the farther they are from a point, by a factor of 150, and each moves by a hundredth of its
// distance from there: what moves far away does not count.
TEST(Neighbours, FollowGradedSeeds) {
  SplitMix64 random(16);
  std::vector<Vec3> given = ball({0, 0, 0}, 1, 4000, 18);
  for (Vec3& x : given) x = (std::exp(random.range(-5, 0)) / norm(x)) * x;
  SortedSeeds seeds = sort_seeds(given);
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  for (Vec3& x : seeds.x) x += 0.01 * norm(x) * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
  EXPECT_TRUE(neighbours.update());
  for (Index slot = 0; slot < seeds.x.size(); slot += 10) {
    expect_certified(seeds, slot, neighbours.list(slot), true);
    if (HasFatalFailure()) return;
  }
}

// A few seeds beyond the lists of others, which reach as far as a cluster on the other side, come nearer.
TEST(Neighbours, AreCertifiedWhereOthersComeNearer) {
  const std::vector<Vec3> middle = ball({0, 0, 0}, 1e-3, 6, 19), cluster = ball({1, 0, 0}, 1e-3, 60, 20);
  SortedSeeds seeds = sort_seeds(joined(joined(middle, cluster), ball({-1.15, 0, 0}, 1e-3, 6, 21)));
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  for (const Index slot : seeds.slot)
    if (norm(seeds.x[slot]) < 0.1) {
      ASSERT_LT(neighbours.list(slot).radius, 1.1);
    }
  for (Vec3& x : seeds.x)
    if (x.x < -1) x.x += 0.25;
  ASSERT_TRUE(neighbours.update());
  for (Index slot = 0; slot < seeds.x.size(); ++slot) {
    expect_certified(seeds, slot, neighbours.list(slot), true);
    if (HasFatalFailure()) return;
  }
}

// Near the cluster every list is short of the far seeds, and the far seeds' lists are full of the cluster.
TEST(Neighbours, SurviveAHeavyCluster) {
  const SortedSeeds seeds = sort_seeds(joined(ball({0.3, 0.2, 0.1}, 1e-6, 10'000, 21), ball({0, 0, 0}, 1, 100, 22)));
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  std::size_t longest = 0;
  for (Index slot = 0; slot < seeds.x.size(); ++slot) {
    const NeighbourList list = neighbours.list(slot);
    longest = std::max(longest, static_cast<std::size_t>(list.end - list.begin));
    if (slot % 37 == 0 || seeds.id[slot] >= 10'000) expect_certified(seeds, slot, list, true);
    if (HasFatalFailure()) return;
  }
  // Memory stays linear.
  EXPECT_LT(longest, 1000u);
}

TEST(Neighbours, GrowTogetherFromManyThreads) {
  const SortedSeeds seeds = sort_seeds(ball({0, 0, 0}, 1, 2000, 23));
  Neighbours alone, shared;
  alone.build(seeds, NeighbourSource::nearest);
  shared.build(seeds, NeighbourSource::nearest);
  std::vector<std::thread> threads;
  std::vector<std::size_t> failures(4, 0);
  for (std::size_t t = 0; t < failures.size(); ++t)
    threads.emplace_back([&, t] {
      for (Index k = 0; k < 200; ++k) {
        const Index slot = (k * 7) % 50;
        NeighbourList list = shared.list(slot);
        for (std::size_t rung = 0; rung < k % 4 + 1 && list.radius < kInfinity; ++rung) {
          const NeighbourList wider = shared.wider(slot, list);
          failures[t] += !(wider.radius > list.radius) || !(wider.level > list.level);
          list = wider;
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(std::accumulate(failures.begin(), failures.end(), std::size_t{0}), 0u);
  for (Index slot = 0; slot < 50; ++slot) {
    NeighbourList list = alone.list(slot);
    const NeighbourList reached = shared.wider(slot, shared.list(slot));
    while (list.level < reached.level) list = alone.wider(slot, list);
    EXPECT_TRUE(std::equal(list.begin, list.end, reached.begin, reached.end));
    EXPECT_EQ(list.radius, reached.radius);
  }
}

// --- Delaunay rings ---

void expect_listed(const Csr<Index>& rings, Index i, Index j) {
  EXPECT_TRUE(std::binary_search(rings.begin(i), rings.end(i), j)) << i << " lacks " << j;
}

void expect_well_formed(const Csr<Index>& rings, std::size_t seeds) {
  ASSERT_EQ(rings.rows(), seeds);
  for (Index i = 0; i < seeds; ++i) {
    EXPECT_TRUE(std::is_sorted(rings.begin(i), rings.end(i)));
    EXPECT_EQ(std::adjacent_find(rings.begin(i), rings.end(i)), rings.end(i));
    for (const Index* j = rings.begin(i); j != rings.end(i); ++j) {
      EXPECT_NE(*j, i);
      expect_listed(rings, *j, i);
    }
  }
}

// On a cubic grid the closed cells that touch are the 26 around, whatever the triangulation made of the ties.
TEST(DelaunayNeighbours, OfAGridAreAllThatTouch) {
  constexpr int n = 5;
  std::vector<Vec3> seeds;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) seeds.push_back({0.25 * x, 0.25 * y, 0.25 * z});
  const auto rings = delaunay_neighbours(seeds);
  ASSERT_TRUE(rings);
  expect_well_formed(*rings, seeds.size());
  for (Index i = 0; i < seeds.size(); ++i)
    for (Index j = 0; j < seeds.size(); ++j) {
      const Vec3 d = 4.0 * (seeds[i] - seeds[j]);
      if (i != j && std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) <= 1) expect_listed(*rings, i, j);
    }
}

TEST(DelaunayNeighbours, OfCosphericalSeedsAreAllUnlessOneIsInside) {
  for (const std::vector<Vec3>& seeds : {cospherical_seeds(), joined(cospherical_seeds(), {{0, 0, 0}})}) {
    const auto rings = delaunay_neighbours(seeds);
    ASSERT_TRUE(rings);
    expect_well_formed(*rings, seeds.size());
    for (Index i = 0; i < 24 && seeds.size() == 24; ++i) EXPECT_EQ(rings->size(i), 23u);
  }
}

// Four seeds with an empty circumsphere, borders included, are neighbours of each other: exact in small integers.
TEST(DelaunayNeighbours, ContainEveryEmptySphereOfIntegerSeeds) {
  SplitMix64 random(24);
  for (int trial = 0; trial < 60; ++trial) {
    std::set<std::array<int, 3>> chosen;
    const std::size_t count = 5 + random.below(14);
    while (chosen.size() < count)
      chosen.insert(
          {static_cast<int>(random.below(4)), static_cast<int>(random.below(4)), static_cast<int>(random.below(4))});
    std::vector<Vec3> seeds;
    for (const auto& [x, y, z] : chosen)
      seeds.push_back({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
    const auto rings = delaunay_neighbours(seeds);
    if (!rings) continue;
    expect_well_formed(*rings, seeds.size());
    const Index n = static_cast<Index>(seeds.size());
    for (Index a = 0; a < n; ++a)
      for (Index b = a + 1; b < n; ++b)
        for (Index c = b + 1; c < n; ++c)
          for (Index d = c + 1; d < n; ++d) {
            // All terms are integers far below 2^53.
            const Vec3 u = seeds[b] - seeds[a], v = seeds[c] - seeds[a], w = seeds[d] - seeds[a];
            const double volume = dot(u, cross(v, w));
            if (volume == 0) continue;
            const Vec3 centre =
                norm2(u) * cross(v, w) + norm2(v) * cross(w, u) + norm2(w) * cross(u, v);  // times 2 volume
            bool empty = true;
            for (Index e = 0; e < n && empty; ++e) {
              const Vec3 p = seeds[e] - seeds[a];
              empty = (volume > 0 ? 1 : -1) * (volume * norm2(p) - dot(centre, p)) >= 0;
            }
            if (!empty) continue;
            for (Index i : {a, b, c, d})
              for (Index j : {a, b, c, d})
                if (i != j) expect_listed(*rings, i, j);
          }
  }
}

TEST(DelaunayNeighbours, AreRefusedForSeedsInAPlane) {
  EXPECT_FALSE(delaunay_neighbours({}));
  EXPECT_FALSE(delaunay_neighbours({{0, 0, 0}}));
  EXPECT_FALSE(delaunay_neighbours({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_FALSE(delaunay_neighbours(grid_seeds(grid_patch(4, 4), 6, 6, 1)));
  EXPECT_TRUE(delaunay_neighbours({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
}

// Of points that are all but as near to several seeds, near them or far away, from whatever seed the search starts.
TEST(Neighbours, OwnersAreTheNearestSeedsInExactArithmetic) {
  SplitMix64 random(61);
  for (int trial = 0; trial < 400; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<Vec3> points;
    const Vec3 away = random.below(2) ? Vec3{100, -100, 100} : Vec3{};
    for (int k = 0; k < 4; ++k)
      points.push_back(away + Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)});
    const std::vector<Vec3> given = near_tie_seeds(points, random);
    const SortedSeeds seeds = sort_seeds(given);
    Neighbours neighbours;
    neighbours.build(seeds, NeighbourSource::nearest);
    for (const Vec3& q : points) {
      std::size_t nearest = 0;
      for (std::size_t i = 1; i < given.size(); ++i)
        if (exact_squared_distance(q, given[i]) < exact_squared_distance(q, given[nearest])) nearest = i;
      for (Index guess = 0; guess < seeds.x.size(); ++guess)
        ASSERT_EQ(seeds.id[find_owner(seeds, neighbours, q, guess)], nearest) << "from " << guess;
    }
  }
}

}  // namespace
}  // namespace bisector::test
