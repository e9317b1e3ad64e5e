// The oracle against its own definition: invariants, and cells small enough to work out by hand.
#include "support/oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "support/models.h"

namespace bisector::test {
namespace {

using Pairs = std::vector<std::array<Index, 2>>;
using Rdt = std::vector<Triangle>;

bool is_collinear(const TriangleMesh& mesh, Index t) {
  const auto& [a, b, c] = mesh.triangles[t];
  // The problems with collinear triangles have coordinates that make this exact.
  return cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]) == Vec3{};
}

std::vector<Index> shuffled(std::size_t n, std::uint64_t random_seed) {
  std::vector<Index> order(n);
  std::iota(order.begin(), order.end(), Index{0});
  SplitMix64 random(random_seed);
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  return order;
}

class Oracle : public testing::TestWithParam<SmallCase> {};

TEST_P(Oracle, PolygonsTileEveryTriangleExactly) {
  const auto& [name, mesh, seeds] = GetParam();
  std::vector<mpq_class> covered(mesh.triangles.size());
  for (const OraclePolygon& p : oracle_polygons(mesh, seeds)) {
    EXPECT_GE(p.edges.size(), 3u);
    EXPECT_TRUE(p.share >= 0) << p.share.get_d();
    covered[p.triangle] += p.share;
  }
  for (Index t = 0; t < mesh.triangles.size(); ++t) EXPECT_TRUE(covered[t] == (is_collinear(mesh, t) ? 0 : 1)) << t;
}

// Each edge between cells occurs once on either side, with the same ends; sides are covered from corner to corner.
TEST_P(Oracle, PolygonsMeetEdgeToEdge) {
  const auto& [name, mesh, seeds] = GetParam();
  using Label = std::int64_t;
  std::map<std::tuple<Index, Label, Label>, std::vector<std::set<Label>>> edges;  // (triangle, cells) -> ends
  std::map<std::tuple<Index, Label>, std::map<std::set<Label>, int>> sides;       // (triangle, side) -> ends
  for (const OraclePolygon& p : oracle_polygons(mesh, seeds)) {
    const std::size_t n = p.edges.size();
    for (std::size_t k = 0; k < n; ++k) {
      const Label self = p.seed, edge = p.edges[k], before = p.edges[(k + n - 1) % n], after = p.edges[(k + 1) % n];
      if (edge >= 0) {
        edges[{p.triangle, std::min(self, edge), std::max(self, edge)}].push_back({before, after});
        continue;
      }
      // On a side, a point is a corner (the other side) or where two cells meet.
      for (Label end : {before, after})
        ++sides[{p.triangle, edge}][end < 0 ? std::set<Label>{end} : std::set<Label>{end, self}];
    }
  }
  for (const auto& [key, ends] : edges) {
    ASSERT_EQ(ends.size(), 2u);
    EXPECT_EQ(ends[0], ends[1]);
  }
  for (const auto& [key, ends] : sides) {
    int corners = 0;
    for (const auto& [end, count] : ends)
      if (end.size() == 1) {
        corners += count;
      } else {
        EXPECT_EQ(count, 2);
      }
    EXPECT_EQ(corners, 2);
  }
}

TEST_P(Oracle, SmallerWeightsChangeNothing) {
  const auto& [name, mesh, seeds] = GetParam();
  const std::vector<OraclePolygon> a = oracle_polygons(mesh, seeds), b = oracle_polygons(mesh, seeds, {{}, 2});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].triangle, b[k].triangle);
    EXPECT_EQ(a[k].seed, b[k].seed);
    EXPECT_EQ(a[k].edges, b[k].edges);
  }
}

// Seeds in another order, each keeping its weight, are the same problem under other names.
TEST_P(Oracle, PermutedSeedsWithTheirWeightsGiveTheSameCells) {
  const auto& [name, mesh, seeds] = GetParam();
  const std::vector<Index> old_index = shuffled(seeds.size(), 99);
  std::vector<Vec3> permuted;
  for (Index i : old_index) permuted.push_back(seeds[i]);
  const OracleDiagram want = oracle_diagram(mesh, seeds);
  OracleDiagram got = oracle_diagram(mesh, permuted, {old_index, 1});
  for (auto& [triangle, seed] : got.pairs) seed = old_index[seed];
  std::sort(got.pairs.begin(), got.pairs.end());
  for (Triangle& t : got.rdt) {
    for (Index& i : t) i = old_index[i];
    std::sort(t.begin(), t.end());
  }
  std::sort(got.rdt.begin(), got.rdt.end());
  EXPECT_EQ(got.pairs, want.pairs);
  EXPECT_EQ(got.rdt, want.rdt);
  for (std::size_t k = 0; k < seeds.size(); ++k) EXPECT_DOUBLE_EQ(got.mass[k], want.mass[old_index[k]]);
}

TEST_P(Oracle, MomentsAgreeWithTheWholeSurface) {
  const auto& [name, mesh, seeds] = GetParam();
  const OracleDiagram d = oracle_diagram(mesh, seeds);
  ASSERT_EQ(d.mass.size(), seeds.size());
  double area = 0, mass = 0, scale = 0;
  Vec3 moment, sum;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    const double s = norm(cross(q - p, r - p)) / 2;
    area += s;
    moment += (s / 3) * (p + q + r);
    scale += s * (norm(p) + norm(q) + norm(r));
  }
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    mass += d.mass[i];
    sum += d.mass[i] * d.centroid[i];
    EXPECT_GE(d.energy[i], 0);
    if (d.mass[i] == 0) {
      EXPECT_EQ(d.centroid[i], Vec3{});
    }
    // Parallel axes: the energy about any seed is at least that of the mass put into the centroid.
    EXPECT_GE(d.energy[i] * (1 + 1e-12), d.mass[i] * norm2(d.centroid[i] - seeds[i]));
  }
  EXPECT_NEAR(mass, area, 1e-14 * area);
  EXPECT_LE(norm(sum - moment), 1e-14 * scale);
}

// Random points, their nearest seed by exact rational distance: the cell found must own part of the triangle.
TEST_P(Oracle, OwnersOfRandomPointsArePairs) {
  const auto& [name, mesh, seeds] = GetParam();
  const OracleDiagram d = oracle_diagram(mesh, seeds);
  const auto distance2 = [&](const std::array<mpq_class, 3>& p, const Vec3& x) {
    mpq_class sum = 0;
    for (int k = 0; k < 3; ++k) {
      const mpq_class e = p[static_cast<std::size_t>(k)] - x[k];
      sum += e * e;
    }
    return sum;
  };
  SplitMix64 random(7);
  for (Index t = 0; t < mesh.triangles.size(); ++t) {
    if (is_collinear(mesh, t)) continue;
    for (int sample = 0; sample < 10; ++sample) {
      // Coarse parameters, so that some samples fall on corners, sides and bisectors.
      const std::size_t s = random.below(9), r = random.below(9 - s);
      std::array<mpq_class, 3> p;
      for (int k = 0; k < 3; ++k) {
        const mpq_class a = mesh.vertices[mesh.triangles[t][0]][k], b = mesh.vertices[mesh.triangles[t][1]][k],
                        c = mesh.vertices[mesh.triangles[t][2]][k];
        p[static_cast<std::size_t>(k)] = a + (b - a) * mpq_class(s, 8) + (c - a) * mpq_class(r, 8);
      }
      Index owner = 0;
      mpq_class best = distance2(p, seeds[0]);
      for (Index i = 1; i < seeds.size(); ++i)
        if (const mpq_class x = distance2(p, seeds[i]); x < best) best = x, owner = i;
      EXPECT_TRUE(std::binary_search(d.pairs.begin(), d.pairs.end(), std::array<Index, 2>{t, owner}))
          << "triangle " << t << ", seed " << owner;
    }
  }
}

std::vector<SmallCase> all_cases() {
  std::vector<SmallCase> cases = small_cases();
  for (std::uint64_t k = 0; k < 40; ++k) cases.push_back(integer_case(k));
  return cases;
}

INSTANTIATE_TEST_SUITE_P(SmallCases, Oracle, testing::ValuesIn(all_cases()), [](const auto& instance) {
  std::string name = instance.param.name;
  for (char& c : name)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'))) c = '_';
  return name;
});

TEST(OracleByHand, OneSeedOwnsAll) {
  const OracleDiagram d = oracle_diagram(single_triangle(), {{0, 0, 3}});
  EXPECT_EQ(d.pairs, (Pairs{{0, 0}}));
  EXPECT_TRUE(d.rdt.empty());
  EXPECT_DOUBLE_EQ(d.mass[0], 32);
  EXPECT_DOUBLE_EQ(d.centroid[0].x, 8.0 / 3);
  EXPECT_DOUBLE_EQ(d.centroid[0].y, 8.0 / 3);
  EXPECT_EQ(d.centroid[0].z, 0);
  // 9 * 32 of height, and 2 * (8^4 / 12) in the plane.
  EXPECT_DOUBLE_EQ(d.energy[0], 288 + 2 * 4096.0 / 12);
}

TEST(OracleByHand, HalfAndHalf) {
  // x = 2 cuts the triangle with legs 8 into a trapezoid and a triangle with legs 6.
  const OracleDiagram d = oracle_diagram(single_triangle(), {{3, 1, 0}, {1, 1, 0}});
  EXPECT_EQ(d.pairs, (Pairs{{0, 0}, {0, 1}}));
  EXPECT_DOUBLE_EQ(d.mass[0], 18);
  EXPECT_DOUBLE_EQ(d.mass[1], 14);
  EXPECT_DOUBLE_EQ(d.centroid[0].x, 4);
  EXPECT_DOUBLE_EQ(d.centroid[0].y, 2);
}

TEST(OracleByHand, ThreeCellsMeetOnce) {
  const OracleDiagram d = oracle_diagram(single_triangle(), {{1, 1, 0}, {3, 1, 0}, {1, 3, 0}});
  EXPECT_EQ(d.rdt, (Rdt{{0, 1, 2}}));
  EXPECT_DOUBLE_EQ(d.mass[0], 4);
}

TEST(OracleByHand, EqualSeedsGoToTheLowest) {
  const OracleDiagram d = oracle_diagram(single_triangle(), {{1, 1, 0}, {1, 1, 0}, {1, 1, 0}});
  EXPECT_EQ(d.pairs, (Pairs{{0, 0}}));
  EXPECT_EQ(d.mass, (std::vector<double>{32, 0, 0}));
  EXPECT_EQ(d.centroid[1], Vec3{});
}

TEST(OracleByHand, ASideInABisectorBelongsToTheLowestOnEitherSide) {
  // The bisector is y = 0, the triangle lies in y >= 0. The heavier cell 0 reaches beyond its half.
  EXPECT_EQ(oracle_diagram(single_triangle(), {{3, 1, 0}, {3, -1, 0}}).pairs, (Pairs{{0, 0}}));
  const OracleDiagram below = oracle_diagram(single_triangle(), {{3, -1, 0}, {3, 1, 0}});
  EXPECT_EQ(below.pairs, (Pairs{{0, 0}, {0, 1}}));
  EXPECT_EQ(below.mass[0], 0);
  EXPECT_DOUBLE_EQ(below.mass[1], 32);
}

TEST(OracleByHand, ATriangleInABisectorBelongsToTheLowest) {
  for (double z : {1.0, -1.0})
    EXPECT_EQ(oracle_diagram(single_triangle(), {{3, 1, z}, {3, 1, -z}}).pairs, (Pairs{{0, 0}}));
}

TEST(OracleByHand, AVertexInABisector) {
  // The bisector is x + y = 0 and meets the triangle in corner 0 alone.
  EXPECT_EQ(oracle_diagram(single_triangle(), {{1, 1, 0}, {-1, -1, 0}}).pairs, (Pairs{{0, 0}}));
  const OracleDiagram far_first = oracle_diagram(single_triangle(), {{-1, -1, 0}, {1, 1, 0}});
  EXPECT_EQ(far_first.pairs, (Pairs{{0, 0}, {0, 1}}));
  EXPECT_EQ(far_first.mass[0], 0);
}

// Four cells around (2, 2): the heaviest seed's cell grows, so it meets the one across.
TEST(OracleByHand, FourCocircularSeedsAreJoinedAcrossFromTheLowest) {
  const std::vector<Vec3> around{{1, 1, 0}, {3, 1, 0}, {3, 3, 0}, {1, 3, 0}};
  EXPECT_EQ(oracle_diagram(single_triangle(), around).rdt, (Rdt{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(oracle_diagram(single_triangle(), {around[1], around[0], around[2], around[3]}).rdt,
            (Rdt{{0, 1, 3}, {0, 2, 3}}));
}

// Four cells that meet on the square's diagonal: each triple is found in the triangle its perturbed vertex falls into.
TEST(OracleByHand, TriplesOnASharedEdgeAreFoundOnce) {
  TriangleMesh square{{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}}, {{0, 1, 2}, {0, 2, 3}}, {}};
  const std::vector<Vec3> seeds{{1, 1, 1}, {3, 1, 1}, {3, 3, 1}, {1, 3, 1}};
  EXPECT_EQ(oracle_diagram(square, seeds).rdt, (Rdt{{0, 1, 2}, {0, 2, 3}}));
}

TEST(OracleByHand, CollinearTrianglesHaveNoPairs) {
  for (const auto& [triangle, seed] : oracle_diagram(collinear_among_good(), {{0, 0, 0}, {1, 0, 0}}).pairs)
    EXPECT_TRUE(triangle != 1 && triangle != 3);
}

TEST(OracleByHand, WeightsFollowTheRank) {
  const std::vector<Vec3> equal{{1, 1, 0}, {1, 1, 0}, {1, 1, 0}};
  EXPECT_EQ(oracle_diagram(single_triangle(), equal, {{2, 0, 1}, 1}).pairs, (Pairs{{0, 1}}));
}

TEST(OracleByHand, CoordinatesOfAnyScale) {
  for (double scale : {0x1p-300, 0x1p-40, 0x1p60, 0x1p200}) {
    TriangleMesh mesh = single_triangle();
    for (Vec3& v : mesh.vertices) v *= scale;
    const OracleDiagram d = oracle_diagram(mesh, {scale * Vec3{3, 1, 0}, scale * Vec3{1, 1, 0}});
    EXPECT_DOUBLE_EQ(d.mass[0], 18 * scale * scale);
    EXPECT_DOUBLE_EQ(d.centroid[0].x, 4 * scale);
  }
}

}  // namespace
}  // namespace bisector::test
