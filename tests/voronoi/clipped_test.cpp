// The clipped Voronoi diagram against the oracle on small cases, and against itself on large ones: sources of
// neighbours, threads, cells whole or cut up, objects fresh and used.
#include "voronoi/clipped.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "compute/compute.h"
#include "support/diagram.h"
#include "support/oracle_tet.h"
#include "support/solids.h"
#include "voronoi/error_bounds.h"

namespace bisector::test {
namespace {

constexpr NeighbourSource kSources[] = {NeighbourSource::nearest, NeighbourSource::delaunay};

Diagram diagram_of(ClippedVoronoi& voronoi, const std::vector<Vec3>& seeds, NeighbourSource source) {
  Diagram d;
  const DiagramWork work = voronoi.evaluate(seeds, source, Want::polygons | Want::polyhedra, d);
  EXPECT_EQ(work.counts.pairs, d.polyhedra.pairs.size());
  return d;
}

Diagram diagram_of(const Solid& solid, const std::vector<Vec3>& seeds, NeighbourSource source, SolidCells how) {
  ClippedVoronoi voronoi(solid, how);
  return diagram_of(voronoi, seeds, source);
}

double reach_of(const Solid& solid, const std::vector<Vec3>& seeds) {
  double reach = 0;
  for (const Vec3& q : solid.mesh.vertices)
    for (const Vec3& x : seeds) reach = std::max(reach, norm(q - x));
  return reach;
}

using Labels = std::vector<std::int64_t>;
using Triples = std::vector<std::array<std::int64_t, 3>>;

std::int64_t signed_label(Index label) {
  return is_facet(label) ? -1 - static_cast<std::int64_t>(label & ~kFacetLabel) : static_cast<std::int64_t>(label);
}

Labels labels_of(const ClippedPolyhedra& p, std::size_t k) {
  Labels labels;
  for (std::size_t l = p.label_offsets[k]; l < p.label_offsets[k + 1]; ++l) labels.push_back(signed_label(p.labels[l]));
  return labels;
}

Triples triples_of(const ClippedPolyhedra& p, std::size_t k) {
  const Labels labels = labels_of(p, k);
  Triples triples;
  for (std::size_t v = p.vertex_offsets[k]; v < p.vertex_offsets[k + 1]; ++v)
    triples.push_back({labels[p.triples[v][0]], labels[p.triples[v][1]], labels[p.triples[v][2]]});
  return triples;
}

std::vector<std::array<Index, 2>> pairs_of(const ClippedPolyhedra& p) {
  std::vector<std::array<Index, 2>> pairs;
  for (const auto& [tet, cell] : p.pairs) pairs.push_back({tet, cell});
  return pairs;
}

std::vector<Tetrahedron> dual_of(const std::vector<OraclePolyhedron>& polyhedra) {
  std::vector<Tetrahedron> tets;
  for (const OraclePolyhedron& p : polyhedra)
    for (const auto& v : p.vertices)
      if (v[0] >= 0 && v[1] >= 0 && v[2] >= 0) {
        Tetrahedron tet{p.seed, static_cast<Index>(v[0]), static_cast<Index>(v[1]), static_cast<Index>(v[2])};
        std::sort(tet.begin(), tet.end());
        tets.push_back(tet);
      }
  std::sort(tets.begin(), tets.end());
  tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
  return tets;
}

// The pairs of triangles and cells on the boundary, by the labels of polyhedra.
std::vector<std::array<Index, 2>> boundary_pairs(const Solid& solid, const ClippedPolyhedra& p) {
  std::map<Triangle, Index> triangle_of;
  for (Index t = 0; t < solid.boundary.mesh.triangles.size(); ++t) {
    Triangle corners = solid.boundary.mesh.triangles[t];
    std::sort(corners.begin(), corners.end());
    triangle_of[corners] = t;
  }
  std::vector<std::array<Index, 2>> pairs;
  for (std::size_t k = 0; k < p.pairs.size(); ++k)
    for (std::size_t l = p.label_offsets[k]; l < p.label_offsets[k + 1]; ++l) {
      if (!is_facet(p.labels[l])) continue;
      const Index tet = p.pairs[k].tet, facet = p.labels[l] & ~kFacetLabel;
      if (solid.adjacent[tet][facet] != kNone) continue;
      Triangle corners;
      std::size_t n = 0;
      for (Index m = 0; m < 4; ++m)
        if (m != facet) corners[n++] = solid.mesh.tets[tet][m];
      std::sort(corners.begin(), corners.end());
      pairs.push_back({triangle_of.at(corners), p.pairs[k].cell});
    }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

// Where there are two triangles with the same corners, on either side of what has no volume, pairs are not told apart.
bool triangles_differ(const Solid& solid) {
  std::set<Triangle> seen;
  for (Triangle corners : solid.boundary.mesh.triangles) {
    std::sort(corners.begin(), corners.end());
    if (!seen.insert(corners).second) return false;
  }
  return true;
}

void expect_sound(const Solid& solid, const Diagram& d, double share = 1e-12) {
  EXPECT_EQ(count_untiled(solid, d.polyhedra), 0u);
  EXPECT_NEAR(d.moments.mass, solid.mass, share * solid.mass);
  const auto pairs = pairs_of(d.polyhedra);
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
  const bool cut = pairs.front()[0] != kNone;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    EXPECT_EQ(pairs[k][0] == kNone, !cut);
    const std::size_t planes = d.polyhedra.label_offsets[k + 1] - d.polyhedra.label_offsets[k];
    const std::size_t vertices = d.polyhedra.vertex_offsets[k + 1] - d.polyhedra.vertex_offsets[k];
    // Euler's formula for a simple polyhedron; what the boundary cuts off is not listed.
    if (cut || d.moments.triangles.size(pairs[k][1]) == 0) {
      EXPECT_EQ(vertices, 2 * (planes - 2));
    }
    const Labels labels = labels_of(d.polyhedra, k);
    EXPECT_TRUE(
        std::is_sorted(d.polyhedra.labels.begin() + static_cast<std::ptrdiff_t>(d.polyhedra.label_offsets[k]),
                       d.polyhedra.labels.begin() + static_cast<std::ptrdiff_t>(d.polyhedra.label_offsets[k + 1])));
    if (testing::Test::HasFailure()) return;
  }
  if (cut && triangles_differ(solid)) {
    std::vector<std::array<Index, 2>> surface;
    for (const auto& pair : d.polygons.pairs) surface.push_back({pair.triangle, pair.cell});
    EXPECT_TRUE(boundary_pairs(solid, d.polyhedra) == surface);
  }
}

void expect_oracle_polyhedra(const ClippedPolyhedra& got, const std::vector<OraclePolyhedron>& want,
                             const std::vector<Vec3>& seeds, double reach) {
  ASSERT_EQ(got.pairs.size(), want.size());
  for (std::size_t k = 0; k < want.size(); ++k) {
    SCOPED_TRACE("tetrahedron " + std::to_string(want[k].tet) + ", seed " + std::to_string(want[k].seed));
    ASSERT_EQ(got.pairs[k].tet, want[k].tet);
    ASSERT_EQ(got.pairs[k].cell, want[k].seed);
    ASSERT_EQ(labels_of(got, k), want[k].labels);
    const Triples triples = triples_of(got, k);
    ASSERT_EQ(triples.size(), want[k].vertices.size());
    for (std::size_t v = 0; v < triples.size(); ++v) {
      const auto other = std::find(want[k].vertices.begin(), want[k].vertices.end(), triples[v]);
      ASSERT_NE(other, want[k].vertices.end());
      const auto& at = want[k].at[static_cast<std::size_t>(other - want[k].vertices.begin())];
      const Vec3 local = got.vertices[got.vertex_offsets[k] + v] - seeds[want[k].seed];
      EXPECT_LE(norm(local - Vec3{at[0].get_d(), at[1].get_d(), at[2].get_d()}), 1e-6 * reach);
    }
  }
}

// `share`: by which integrals may differ, of what they are over the whole solid.
void expect_oracle(const SolidCase& problem, bool every_way, double share = 1e-12) {
  SCOPED_TRACE(problem.name);
  const Solid solid(problem.mesh);
  const std::vector<Vec3>& seeds = problem.seeds;
  const std::vector<OraclePolyhedron> want = oracle_polyhedra(solid.mesh, seeds);
  const double reach = reach_of(solid, seeds);
  std::vector<double> mass(seeds.size()), energy(seeds.size());
  std::vector<Vec3> first(seeds.size());
  std::map<Index, std::set<std::int64_t>> cell_labels;
  for (const OraclePolyhedron& p : want) {
    mass[p.seed] += p.volume.get_d();
    energy[p.seed] += p.energy.get_d();
    first[p.seed] += Vec3{p.first[0].get_d(), p.first[1].get_d(), p.first[2].get_d()};
    std::set<std::int64_t>& labels = cell_labels[p.seed];
    for (const std::int64_t label : p.labels)
      if (label >= 0) labels.insert(label);
  }
  for (const NeighbourSource source : kSources)
    for (const SolidCells how : {SolidCells::clipped, SolidCells::whole}) {
      if (!every_way && (source == NeighbourSource::nearest) != (how == SolidCells::whole)) continue;
      SCOPED_TRACE(source == NeighbourSource::nearest ? "nearest" : "delaunay");
      SCOPED_TRACE(how == SolidCells::whole ? "whole" : "clipped");
      const Diagram got = diagram_of(solid, seeds, source, how);
      expect_sound(solid, got, share);
      if (how == SolidCells::clipped) {
        expect_oracle_polyhedra(got.polyhedra, want, seeds, reach);
      } else {
        std::map<Index, std::set<std::int64_t>> labels;
        for (std::size_t k = 0; k < got.polyhedra.pairs.size(); ++k) {
          const Labels of_cell = labels_of(got.polyhedra, k);
          labels[got.polyhedra.pairs[k].cell].insert(of_cell.begin(), of_cell.end());
        }
        EXPECT_EQ(labels, cell_labels);
      }
      EXPECT_EQ(dual_tets(got.polyhedra), dual_of(want));
      for (std::size_t i = 0; i < seeds.size(); ++i) {
        const Moments& cell = got.moments.cells[i];
        EXPECT_NEAR(cell.mass, mass[i], share * solid.volume) << "seed " << i;
        EXPECT_LE(norm(cell.first - first[i]), share * solid.volume * reach) << "seed " << i;
        EXPECT_NEAR(cell.second, energy[i], share * solid.volume * reach * reach) << "seed " << i;
      }
      if (testing::Test::HasFailure()) return;
    }
}

class SmallSolid : public testing::TestWithParam<SolidCase> {};

TEST_P(SmallSolid, AgreesWithTheOracle) { expect_oracle(GetParam(), true); }

INSTANTIATE_TEST_SUITE_P(Clipped, SmallSolid, testing::ValuesIn(solid_cases()),
                         [](const auto& instance) { return test_name(instance.param.name); });

class IntegerSolids : public testing::TestWithParam<std::uint64_t> {};

constexpr std::uint64_t kIntegerSolids = 600, kIntegerSolidBlock = 50;

TEST_P(IntegerSolids, AgreeWithTheOracle) {
  for (std::uint64_t k = GetParam(); k < GetParam() + kIntegerSolidBlock && !HasFailure(); ++k)
    expect_oracle(integer_solid_case(k), false);
}

INSTANTIATE_TEST_SUITE_P(Clipped, IntegerSolids, testing::Range(std::uint64_t{0}, kIntegerSolids, kIntegerSolidBlock));

// Vertices are computed in double precision down to the angle kSteep, where they are off by a unit of rounding over its
// sine; how cells are bounded is exact.
TEST(Clipped, NearTiesAgreeWithTheOracle) {
  const double share = kUnit / std::sqrt(kSteep);
  constexpr std::uint64_t kCases = 120;
  for (std::uint64_t k = 0; k < kCases && !HasFailure(); ++k) expect_oracle(near_tie_solid_case(k), false, share);
}

// --- Against itself ---

void expect_same_diagram(const Diagram& a, const Diagram& b) {
  expect_same_moments(a.moments, b.moments);
  EXPECT_TRUE(same_bits(a.moments.step_mass, b.moments.step_mass));
  EXPECT_TRUE(pairs_of(a.polyhedra) == pairs_of(b.polyhedra));
  EXPECT_TRUE(a.polyhedra.labels == b.polyhedra.labels);
  EXPECT_TRUE(a.polyhedra.triples == b.polyhedra.triples);
  EXPECT_TRUE(same_bits(a.polyhedra.vertices, b.polyhedra.vertices));
}

std::vector<SolidCase> medium_solids() {
  struct Named {
    const char* name;
    TetMesh mesh;
  };
  const std::vector<Named> meshes{{"grid", tet_grid(4, 4, 4)},
                                  {"shaken grid", shaken(tet_grid(5, 4, 3), 0.2, 21)},
                                  {"step", step()},
                                  {"hollow", hollow()},
                                  {"pores", pores()},
                                  {"specks", specks()},
                                  {"two cubes", two_cubes()},
                                  {"slivers", slivers()},
                                  {"flat among good", flat_among_good()}};
  std::vector<SolidCase> cases;
  for (const auto& [name, mesh] : meshes) {
    const auto add = [&](const char* what, std::vector<Vec3> seeds) {
      cases.push_back({std::string(name) + " " + what, mesh, std::move(seeds)});
    };
    add("10 random", seeds_about(mesh, 10, 0, 22));
    add("1000 random", seeds_about(mesh, 1000, 0, 23));
    add("500 about", seeds_about(mesh, 500, 0.5, 24));
    add("grid", seed_grid(mesh, 7, 6, 5));
    add("vertices", mesh.vertices);
    std::vector<Vec3> clustered = seeds_about(mesh, 60, 0, 25);
    for (const Vec3& x : seeds_about(mesh, 240, 0, 26)) clustered.push_back(clustered[7] + 1e-6 * x);
    add("clustered", clustered);
  }
  return cases;
}

class MediumSolid : public testing::TestWithParam<SolidCase> {};

TEST_P(MediumSolid, EverySourceAndThreadCountGivesTheSameBits) {
  const Solid solid(GetParam().mesh);
  for (const SolidCells how : {SolidCells::clipped, SolidCells::whole}) {
    const auto with = [&](NeighbourSource source, unsigned threads) {
      const ThreadLimit limit(threads);
      return diagram_of(solid, GetParam().seeds, source, how);
    };
    const Diagram reference = with(NeighbourSource::nearest, 1);
    expect_sound(solid, reference);
    expect_same_diagram(reference, with(NeighbourSource::nearest, 2));
    expect_same_diagram(reference, with(NeighbourSource::delaunay, 2));
    if (HasFailure()) return;
  }
}

// Voronoi vertices inside the solid as each cell has them: the cell and the three others counter-clockwise, the least
// of them first.
std::map<std::array<Index, 4>, Vec3> inner_vertices(const ClippedPolyhedra& p) {
  std::map<std::array<Index, 4>, Vec3> vertices;
  for (std::size_t k = 0; k < p.pairs.size(); ++k) {
    const Index* labels = p.labels.data() + p.label_offsets[k];
    for (std::size_t v = p.vertex_offsets[k]; v < p.vertex_offsets[k + 1]; ++v) {
      const auto& on = p.triples[v];
      if (is_facet(labels[on[0]]) || is_facet(labels[on[1]]) || is_facet(labels[on[2]])) continue;
      vertices[{p.pairs[k].cell, labels[on[0]], labels[on[1]], labels[on[2]]}] = p.vertices[v];
    }
  }
  return vertices;
}

TEST_P(MediumSolid, WholeCellsAreTheSumOfTheirPieces) {
  const Solid solid(GetParam().mesh);
  const std::vector<Vec3>& seeds = GetParam().seeds;
  const Diagram cut = diagram_of(solid, seeds, NeighbourSource::delaunay, SolidCells::clipped);
  const Diagram whole = diagram_of(solid, seeds, NeighbourSource::delaunay, SolidCells::whole);
  EXPECT_EQ(dual_tets(cut.polyhedra), dual_tets(whole.polyhedra));
  EXPECT_EQ(cut.moments.triangles.values, whole.moments.triangles.values);
  const double reach = reach_of(solid, seeds);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments &a = cut.moments.cells[i], &b = whole.moments.cells[i];
    EXPECT_NEAR(a.mass, b.mass, 1e-13 * solid.volume);
    EXPECT_LE(norm(a.first - b.first), 1e-13 * solid.volume * reach);
    EXPECT_NEAR(a.second, b.second, 1e-13 * solid.volume * reach * reach);
  }
  const auto pieces = inner_vertices(cut.polyhedra), wholes = inner_vertices(whole.polyhedra);
  EXPECT_EQ(pieces.size(), wholes.size());
  for (const auto& [vertex, at] : pieces) {
    const auto found = wholes.find(vertex);
    ASSERT_NE(found, wholes.end());
    EXPECT_LE(norm(found->second - at), 1e-6 * reach);
  }
}

TEST_P(MediumSolid, AUsedObjectAnswersAsAFreshOne) {
  const Solid solid(GetParam().mesh);
  ClippedVoronoi used(solid);
  std::vector<Vec3> moved = GetParam().seeds;
  SplitMix64 random(27);
  for (Vec3& x : moved) x += 1e-3 * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
  diagram_of(used, moved, NeighbourSource::nearest);
  const Diagram again = diagram_of(used, GetParam().seeds, NeighbourSource::nearest);
  expect_same_diagram(again, diagram_of(solid, GetParam().seeds, NeighbourSource::nearest, SolidCells::whole));
}

INSTANTIATE_TEST_SUITE_P(Clipped, MediumSolid, testing::ValuesIn(medium_solids()),
                         [](const auto& instance) { return test_name(instance.param.name); });

// --- Moments ---

std::vector<double> linear_density(const TetMesh& mesh) {
  std::vector<double> density;
  for (const Vec3& p : mesh.vertices) density.push_back(6 + dot(p, Vec3{0.5, -0.25, 0.75}));
  return density;
}

double energy_of(ClippedVoronoi& voronoi, const std::vector<Vec3>& seeds) {
  Diagram diagram;
  voronoi.evaluate(seeds, NeighbourSource::nearest, Want::moments, diagram);
  return diagram.moments.energy;
}

void expect_gradient(const Solid& solid, std::vector<Vec3> seeds) {
  ClippedVoronoi voronoi(solid);
  Diagram diagram;
  voronoi.evaluate(seeds, NeighbourSource::nearest, Want::moments, diagram);
  const CellMoments& moments = diagram.moments;
  constexpr double kStep = 1e-5;
  for (std::size_t i = 0; i < seeds.size(); i += 5)
    for (int k = 0; k < 3; ++k) {
      const double at = seeds[i][k];
      seeds[i][k] = at + kStep;
      const double above = energy_of(voronoi, seeds);
      seeds[i][k] = at - kStep;
      const double below = energy_of(voronoi, seeds);
      seeds[i][k] = at;
      // F = sum int rho |p - x|^2, and the borders of cells do not count.
      EXPECT_NEAR((above - below) / (2 * kStep), -2 * moments.cells[i].first[k], 1e-6 * solid.mass) << i;
    }
}

TEST(ClippedMoments, TheFirstMomentIsTheGradient) {
  const TetMesh mesh = shaken(tet_grid(3, 2, 2), 0.2, 31);
  const std::vector<Vec3> seeds = seeds_about(mesh, 60, 0, 32);
  expect_gradient(Solid(mesh), seeds);
  expect_gradient(Solid(mesh, linear_density(mesh)), seeds);
}

TEST(ClippedMoments, ADensityThatIsLinearThroughoutWeighsTheUniformCells) {
  // On a cell of volume V, int (a + b . p) = V (a + b . c): the uniform diagram's centroids tell the mass.
  const TetMesh mesh = shaken(tet_grid(3, 2, 2), 0.2, 33);
  const std::vector<Vec3> seeds = seeds_about(mesh, 100, 0.2, 34);
  const Solid uniform(mesh), weighted(mesh, linear_density(mesh));
  const Diagram a = diagram_of(uniform, seeds, NeighbourSource::nearest, SolidCells::clipped);
  const Diagram b = diagram_of(weighted, seeds, NeighbourSource::nearest, SolidCells::whole);
  expect_sound(weighted, b);
  EXPECT_TRUE(pairs_of(a.polyhedra) == pairs_of(b.polyhedra));
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments& cell = a.moments.cells[i];
    const double want = cell.mass * (6 + dot(seeds[i], {0.5, -0.25, 0.75})) + dot(cell.first, {0.5, -0.25, 0.75});
    EXPECT_NEAR(b.moments.cells[i].mass, want, 1e-13 * weighted.mass) << i;
  }
}

TEST(ClippedMoments, AConstantDensityScalesThem) {
  const TetMesh mesh = hollow();
  const std::vector<Vec3> seeds = seeds_about(mesh, 300, 0.1, 35);
  const Solid plain(mesh), tripled(mesh, std::vector<double>(mesh.vertices.size(), 3.0));
  const Diagram a = diagram_of(plain, seeds, NeighbourSource::nearest, SolidCells::whole);
  const Diagram b = diagram_of(tripled, seeds, NeighbourSource::nearest, SolidCells::whole);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(b.moments.cells[i].mass, 3 * a.moments.cells[i].mass, 1e-13 * tripled.mass);
    EXPECT_LE(norm(b.moments.cells[i].first - 3 * a.moments.cells[i].first), 1e-13 * tripled.mass * 3);
    EXPECT_NEAR(b.moments.cells[i].second, 3 * a.moments.cells[i].second, 1e-13 * tripled.mass * 9);
  }
}

// The lattice points of a cube belong to the nearest seed, and so does nearly all volume around them.
TEST(ClippedMoments, AgreeWithCountingPoints) {
  const TetMesh mesh = tet_grid(2, 2, 2);
  const std::vector<Vec3> seeds = seeds_about(mesh, 8, 0, 36);
  const Solid solid(mesh, linear_density(mesh));
  const Diagram d = diagram_of(solid, seeds, NeighbourSource::nearest, SolidCells::whole);
  constexpr int kPoints = 64;
  constexpr double kCell = 2.0 / kPoints;
  std::vector<Moments> counted(seeds.size());
  for (int x = 0; x < kPoints; ++x)
    for (int y = 0; y < kPoints; ++y)
      for (int z = 0; z < kPoints; ++z) {
        const Vec3 p = kCell * Vec3{x + 0.5, y + 0.5, z + 0.5};
        const auto nearest = std::min_element(
            seeds.begin(), seeds.end(), [&](const Vec3& a, const Vec3& b) { return norm2(p - a) < norm2(p - b); });
        const double mass = kCell * kCell * kCell * (6 + dot(p, {0.5, -0.25, 0.75}));
        counted[static_cast<std::size_t>(nearest - seeds.begin())] +=
            {mass, mass * (p - *nearest), mass * norm2(p - *nearest)};
      }
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(d.moments.cells[i].mass, counted[i].mass, 1e-3 * solid.mass);
    EXPECT_LE(norm(d.moments.cells[i].first - counted[i].first), 1e-3 * solid.mass);
    EXPECT_NEAR(d.moments.cells[i].second, counted[i].second, 1e-3 * solid.mass);
  }
}

// --- Cells and solids ---

TEST(Clipped, ACellOutsideOwnsNothing) {
  const TetMesh mesh = hollow();
  std::vector<Vec3> seeds = seeds_about(mesh, 400, 0, 41);
  const std::size_t inside = seeds.size();
  seeds.push_back({1.5, 1.5, 1.5});
  for (const Vec3 d :
       {Vec3{0.05, 0, 0}, Vec3{-0.05, 0, 0}, Vec3{0, 0.05, 0}, Vec3{0, -0.05, 0}, Vec3{0, 0, 0.05}, Vec3{0, 0, -0.05}})
    seeds.push_back(Vec3{1.5, 1.5, 1.5} + d);
  seeds.push_back({9, 9, 9});
  const Diagram d = diagram_of(Solid(mesh), seeds, NeighbourSource::nearest, SolidCells::whole);
  EXPECT_EQ(d.moments.cells[inside].mass, 0);
  EXPECT_EQ(d.moments.cells.back().mass, 0);
  for (const auto& pair : d.polyhedra.pairs) EXPECT_NE(pair.cell, inside);
}

TEST(Clipped, EmptyCellsOfEqualSeedsHaveNoMass) {
  const TetMesh mesh = tet_grid(2, 2, 2);
  const std::vector<Vec3> seeds = repeated(seeds_about(mesh, 50, 0, 42), 2);
  const Diagram d = diagram_of(Solid(mesh), seeds, NeighbourSource::delaunay, SolidCells::whole);
  for (std::size_t i = 50; i < 100; ++i) EXPECT_EQ(d.moments.cells[i].mass, 0);
}

// The dual of a diagram whose every cell meets the boundary of a convex solid like a ball: seeds at the corners of a
// lattice.
TEST(Clipped, TheDualOfSeedsInTheSolidIsTheirDelaunayTriangulation) {
  // The solid reaches far beyond the seeds, so that all Voronoi vertices lie in it, and V - E + F - T = 1 for their
  // hull.
  TetMesh mesh = tet_grid(1, 1, 1);
  for (Vec3& p : mesh.vertices) p = 1e6 * (p - Vec3{0.5, 0.5, 0.5});
  const std::vector<Vec3> seeds = seeds_about(tet_grid(1, 1, 1), 200, 0, 43);
  const std::vector<Tetrahedron> tets =
      dual_tets(diagram_of(Solid(mesh), seeds, NeighbourSource::nearest, SolidCells::whole).polyhedra);
  std::set<std::array<Index, 2>> edges;
  std::map<Triangle, int> facets;
  std::set<Index> vertices;
  for (const Tetrahedron& t : tets)
    for (std::size_t a = 0; a < 4; ++a) {
      vertices.insert(t[a]);
      for (std::size_t b = a + 1; b < 4; ++b) {
        edges.insert({t[a], t[b]});
        for (std::size_t c = b + 1; c < 4; ++c) ++facets[{t[a], t[b], t[c]}];
      }
    }
  EXPECT_EQ(vertices.size(), seeds.size());
  for (const auto& [facet, times] : facets) EXPECT_LE(times, 2);
  EXPECT_EQ(static_cast<int>(vertices.size()) - static_cast<int>(edges.size()) + static_cast<int>(facets.size()) -
                static_cast<int>(tets.size()),
            1);
  // No seed lies in a circumsphere by more than rounding.
  for (std::size_t k = 0; k < tets.size(); k += 17) {
    const Vec3 a = seeds[tets[k][0]], b = seeds[tets[k][1]] - a, c = seeds[tets[k][2]] - a, d = seeds[tets[k][3]] - a;
    const Vec3 centre =
        (0.5 / dot(b, cross(c, d))) * (norm2(b) * cross(c, d) + norm2(c) * cross(d, b) + norm2(d) * cross(b, c));
    for (const Vec3& x : seeds) EXPECT_GE(norm2(x - a - centre), norm2(centre) * (1 - 1e-9));
  }
}

TEST(Clipped, TilingFailsWhereAPolyhedronIsMissingOrWrong) {
  const Solid solid(tet_grid(2, 2, 2));
  for (const SolidCells how : {SolidCells::clipped, SolidCells::whole}) {
    const Diagram d = diagram_of(solid, seeds_about(solid.mesh, 40, 0, 44), NeighbourSource::nearest, how);
    ASSERT_EQ(count_untiled(solid, d.polyhedra), 0u);
    const std::size_t k = d.polyhedra.pairs.size() / 2;
    ClippedPolyhedra relabelled = d.polyhedra;
    ++relabelled.pairs[k].cell;
    EXPECT_GT(count_untiled(solid, relabelled), 0u);
    ClippedPolyhedra wrong = d.polyhedra;
    std::swap(wrong.labels[wrong.label_offsets[k]], wrong.labels[wrong.label_offsets[k] + 1]);
    EXPECT_GT(count_untiled(solid, wrong), 0u);
    ClippedPolyhedra cut = d.polyhedra;
    cut.pairs.erase(cut.pairs.begin());
    cut.label_offsets.erase(cut.label_offsets.begin());
    cut.vertex_offsets.erase(cut.vertex_offsets.begin());
    EXPECT_GT(count_untiled(solid, cut), 0u);
    ClippedPolyhedra turned = d.polyhedra;
    std::swap(turned.triples[turned.vertex_offsets[k]][1], turned.triples[turned.vertex_offsets[k]][2]);
    if (how == SolidCells::whole) {
      EXPECT_GT(count_untiled(solid, turned), 0u);
    }
  }
}

TEST(Clipped, TetrahedraThatOverlapAreRefused) {
  TetMesh mesh = tet_grid(1, 1, 1);
  const auto first = static_cast<Index>(mesh.vertices.size());
  const TetMesh other = mesh;
  for (const Vec3& p : other.vertices) mesh.vertices.push_back(p + Vec3{0.31, 0.27, 0.23});
  for (const Tetrahedron& t : other.tets) mesh.tets.push_back({t[0] + first, t[1] + first, t[2] + first, t[3] + first});
  const std::vector<Vec3> seeds = seeds_about(mesh, 300, 0, 45);
  EXPECT_THROW(diagram_of(Solid(mesh), seeds, NeighbourSource::nearest, SolidCells::whole), Error);
}

TEST(Solid, KeepsFlatTetrahedraOutOfTheWay) {
  const Solid solid(flat_among_good());
  EXPECT_EQ(solid.six_volumes[4], 0);
  // The two pyramids over the square, whose bases are boundary now.
  EXPECT_EQ(solid.boundary.mesh.triangles.size(), 12u);
  EXPECT_NEAR(solid.volume, 2.0 / 3, 1e-15);
  for (Index t = 0; t < 4; ++t)
    for (const Index other : solid.adjacent[t]) EXPECT_NE(other, 4u);
}

TEST(Solid, TurnsTetrahedraPositive) {
  const Solid solid(inverted_among_good());
  EXPECT_NEAR(solid.volume, 2, 1e-15);
  for (const double volume : solid.six_volumes) EXPECT_GT(volume, 0);
  // Outward: by the divergence theorem the boundary has the same volume.
  double volume = 0;
  const auto& q = solid.boundary.mesh.vertices;
  for (const Triangle& t : solid.boundary.mesh.triangles) volume += dot(q[t[0]], cross(q[t[1]], q[t[2]])) / 6;
  EXPECT_NEAR(volume, 2, 1e-14);
}

TEST(Solid, TheEnclosureHoldsIt) {
  for (const TetMesh& mesh : {tet_grid(3, 1, 1), scaled(hollow(), 1e-20), shaken(step(), 0.1, 45)}) {
    const Solid solid(mesh);
    const auto& e = solid.enclosure;
    const double volume = dot(e[1] - e[0], cross(e[2] - e[0], e[3] - e[0]));
    EXPECT_GT(volume, 0);
    for (const Vec3& p : solid.mesh.vertices)
      for (std::size_t k = 0; k < 4; ++k) {
        std::array<Vec3, 4> other = e;
        other[k] = p;
        EXPECT_GT(dot(other[1] - other[0], cross(other[2] - other[0], other[3] - other[0])), 0.01 * volume);
      }
  }
}

TEST(Solid, RejectsWhatItCannotIntegrate) {
  const auto with = [](std::vector<Tetrahedron> tets, std::vector<double> density = {}) {
    TetMesh mesh = tet_grid(1, 1, 1);
    mesh.tets = std::move(tets);
    Solid solid(mesh, std::move(density));
  };
  EXPECT_THROW(with({}), Error);
  EXPECT_THROW(with({{0, 1, 2, 3}}), Error);                              // coplanar
  EXPECT_THROW(with({{0, 1, 2, 8}}), Error);                              // no such vertex
  EXPECT_THROW(with({{0, 1, 2, 4}, {0, 1, 2, 5}}), Error);                // on one side of a facet
  EXPECT_THROW(with({{0, 1, 2, 4}, {0, 1, 2, 5}, {0, 1, 2, 6}}), Error);  // three on a facet
  EXPECT_THROW(with({{0, 1, 2, 4}}, {1, 1}), Error);
  EXPECT_THROW(with({{0, 1, 2, 4}}, {1, 1, 1, 0, 1, 1, 1, 1}), Error);
  EXPECT_THROW(with({{0, 1, 2, 4}}, {1, 1, 1, 1, 1, 1, 1, std::nan("")}), Error);
  TetMesh infinite = tet_grid(1, 1, 1);
  infinite.vertices[3].y = INFINITY;
  EXPECT_THROW(Solid{infinite}, Error);
}

TEST(SolidBackends, TheCpuIsOne) {
  const Solid solid(tet_grid(2, 2, 2));
  ComputeOptions options;
  options.device.kind = DeviceRequest::Kind::cpu;
  const auto backend = make_backend(solid, options);
  EXPECT_EQ(backend->description().kind, "cpu");
  EXPECT_EQ(backend->mass(), solid.mass);
  const std::vector<Vec3> seeds = seeds_about(solid.mesh, 100, 0, 46);
  Diagram d;
  backend->evaluate(seeds, Want::polygons | Want::polyhedra, d);
  expect_same_diagram(d, diagram_of(solid, seeds, NeighbourSource::nearest, SolidCells::whole));
  options.precision = Precision::single;
  EXPECT_THROW(make_backend(solid, options), Error);
}

}  // namespace
}  // namespace bisector::test
