// The oracle of clipped diagrams against its own definition: what holds of any tiling, and cells small enough to work
// out by hand.
#include "support/oracle_tet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <tuple>

#include "support/models.h"
#include "support/solids.h"
#include "voronoi/solid.h"

namespace bisector::test {
namespace {

std::string case_name(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

class TetOracle : public testing::TestWithParam<SolidCase> {
 protected:
  const TetMesh mesh = Solid(GetParam().mesh).mesh;
  const std::vector<OraclePolyhedron> polyhedra = oracle_polyhedra(mesh, GetParam().seeds);
};

TEST_P(TetOracle, PolyhedraTileEveryTetrahedronExactly) {
  std::vector<mpq_class> covered(mesh.tets.size());
  for (const OraclePolyhedron& p : polyhedra) {
    EXPECT_TRUE(p.volume >= 0);
    EXPECT_EQ(p.vertices.size(), 2 * (p.labels.size() - 2));
    covered[p.tet] += p.volume;
  }
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    std::array<std::array<mpq_class, 3>, 3> e;
    for (std::size_t r = 0; r < 3; ++r)
      for (int k = 0; k < 3; ++k)
        e[r][static_cast<std::size_t>(k)] =
            mpq_class(mesh.vertices[mesh.tets[t][r + 1]][k]) - mpq_class(mesh.vertices[mesh.tets[t][0]][k]);
    const mpq_class volume =
        (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) + e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
         e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
        6;
    EXPECT_TRUE(covered[t] == volume) << t;
  }
}

// Each facet between two cells is seen from both, with the same corners.
TEST_P(TetOracle, PolyhedraMeetFacetToFacet) {
  using Corner = std::set<std::int64_t>;
  std::map<std::tuple<Index, std::int64_t, std::int64_t>, std::vector<std::multiset<Corner>>> facets;
  for (const OraclePolyhedron& p : polyhedra)
    for (const std::int64_t label : p.labels) {
      if (label < 0) continue;
      std::multiset<Corner> corners;
      for (const auto& v : p.vertices)
        if (std::find(v.begin(), v.end(), label) != v.end()) {
          Corner corner(v.begin(), v.end());
          corner.insert(p.seed);
          corners.insert(corner);
        }
      const std::int64_t self = p.seed;
      facets[{p.tet, std::min(self, label), std::max(self, label)}].push_back(corners);
    }
  for (const auto& [name, sides] : facets) {
    ASSERT_EQ(sides.size(), 2u);
    EXPECT_TRUE(sides[0] == sides[1]);
    EXPECT_GE(sides[0].size(), 3u);
  }
}

TEST_P(TetOracle, SmallerWeightsChangeNothing) {
  const std::vector<OraclePolyhedron> smaller = oracle_polyhedra(mesh, GetParam().seeds, 2);
  ASSERT_EQ(smaller.size(), polyhedra.size());
  for (std::size_t k = 0; k < polyhedra.size(); ++k) {
    EXPECT_EQ(smaller[k].labels, polyhedra[k].labels);
    EXPECT_EQ(smaller[k].vertices, polyhedra[k].vertices);
    EXPECT_TRUE(smaller[k].volume == polyhedra[k].volume);
  }
}

std::vector<SolidCase> oracle_cases() {
  std::vector<SolidCase> cases = solid_cases();
  for (std::uint64_t k = 0; k < 10; ++k) cases.push_back(integer_solid_case(k));
  return cases;
}

INSTANTIATE_TEST_SUITE_P(SmallCases, TetOracle, testing::ValuesIn(oracle_cases()),
                         [](const auto& instance) { return case_name(instance.param.name); });

TEST(TetOracleByHand, OneSeedOwnsAll) {
  const auto polyhedra = oracle_polyhedra(single_tet(), {{1, 1, 1}});
  ASSERT_EQ(polyhedra.size(), 1u);
  EXPECT_EQ(polyhedra[0].labels, (std::vector<std::int64_t>{-1, -2, -3, -4}));
  EXPECT_TRUE(polyhedra[0].volume == mpq_class(32, 3));
  // The centroid is the mean of the corners, the seed.
  for (const mpq_class& moment : polyhedra[0].first) EXPECT_TRUE(moment == 0);
}

TEST(TetOracleByHand, APlaneThroughAFacetGoesToTheLowerIndex) {
  // The bisector is z = 0.
  const std::vector<Vec3> below{{0, 0, -1}, {0, 0, 1}}, above{{0, 0, 1}, {0, 0, -1}};
  const auto first_below = oracle_polyhedra(single_tet(), below), first_above = oracle_polyhedra(single_tet(), above);
  ASSERT_EQ(first_below.size(), 2u);
  EXPECT_TRUE(first_below[0].volume == 0);
  ASSERT_EQ(first_above.size(), 1u);
  EXPECT_EQ(first_above[0].seed, 0u);
}

TEST(TetOracleByHand, EqualSeedsGoToTheLowest) {
  const auto polyhedra = oracle_polyhedra(single_tet(), {{1, 1, 1}, {1, 1, 1}});
  ASSERT_EQ(polyhedra.size(), 1u);
  EXPECT_EQ(polyhedra[0].seed, 0u);
}

TEST(TetOracleByHand, FourCellsMeetOnce) {
  TetMesh mesh = tet_grid(1, 1, 1);
  for (Vec3& p : mesh.vertices) p = 8 * p - Vec3{3.5, 4.25, 3.75};
  const std::vector<Vec3> seeds{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  std::size_t meetings = 0;
  for (const OraclePolyhedron& p : oracle_polyhedra(mesh, seeds))
    for (std::size_t v = 0; v < p.vertices.size(); ++v)
      if (std::all_of(p.vertices[v].begin(), p.vertices[v].end(), [](std::int64_t label) { return label >= 0; })) {
        ++meetings;
        for (int k = 0; k < 3; ++k) EXPECT_EQ(p.at[v][static_cast<std::size_t>(k)].get_d(), -seeds[p.seed][k]);
      }
  EXPECT_EQ(meetings, 4u);
}

}  // namespace
}  // namespace bisector::test
