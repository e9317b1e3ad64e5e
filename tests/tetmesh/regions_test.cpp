// Solids of several regions: their walls, surfaces that enclose several parts, and meshes that keep the interfaces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "bisector/second_order.h"
#include "bisector/tetmesh.h"
#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "support/models.h"
#include "support/solids.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/tetgen.h"
#include "tetmesh/walls.h"

namespace bisector::test {
namespace {

using RegionOf = std::function<int(int x, int y, int z)>;

// The grid of cubes, each in the region that a function of its corner of least coordinates says.
TetMesh divided_grid(int nx, int ny, int nz, const RegionOf& region_of) {
  TetMesh mesh = tet_grid(nx, ny, nz);
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x)
        for (int k = 0; k < 6; ++k) mesh.regions.push_back(region_of(x, y, z));
  return mesh;
}

TetMesh two_halves() {
  return divided_grid(2, 1, 1, [](int x, int, int) { return 4 + x; });
}
TetMesh four_quarters() {
  return divided_grid(2, 2, 1, [](int x, int y, int) { return 1 + x + 2 * y; });
}
// Cubes of two regions, those of one touching along edges.
TetMesh checkerboard() {
  return divided_grid(2, 2, 2, [](int x, int y, int z) { return (x + y + z) % 2; });
}
TetMesh cube_in_cube() {
  return divided_grid(3, 3, 3, [](int x, int y, int z) { return x == 1 && y == 1 && z == 1 ? 9 : 3; });
}

double area_of(const std::vector<Vec3>& p, const Triangle& t) {
  return 0.5 * norm(cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]));
}

// Of each pair of regions, or a region and the outside (kOutside), the area between.
constexpr int kOutside = -100;
std::map<std::pair<int, int>, double> areas_between(const TetMesh& mesh) {
  const Walls walls = find_walls(mesh);
  std::map<std::pair<int, int>, double> areas;
  for (std::size_t t = 0; t < walls.surface.triangles.size(); ++t) {
    const Walls::Patch& patch = walls.patches[static_cast<std::size_t>(walls.surface.labels[t])];
    const int back = walls.regions[patch.back], front = patch.front == kNone ? kOutside : walls.regions[patch.front];
    areas[std::minmax(back, front)] += area_of(mesh.vertices, walls.surface.triangles[t]);
  }
  return areas;
}

struct Case {
  std::string name;
  TetMesh mesh;
};

void PrintTo(const Case& problem, std::ostream* out) { *out << problem.name; }

std::vector<Case> cases() {
  return {{"two_halves", two_halves()},
          {"four_quarters", four_quarters()},
          {"checkerboard", checkerboard()},
          {"cube_in_cube", cube_in_cube()},
          {"layers", marked_cube(3)}};
}

class SolidWalls : public testing::TestWithParam<Case> {};

TEST_P(SolidWalls, BoundEachPart) {
  const TetMesh& mesh = GetParam().mesh;
  const Walls walls = find_walls(mesh);
  EXPECT_TRUE(walls.divide());
  std::vector<Triangle> facets = wall_facets(mesh), found = walls.surface.triangles;
  for (std::vector<Triangle>* list : {&facets, &found}) {
    for (Triangle& t : *list) std::sort(t.begin(), t.end());
    std::sort(list->begin(), list->end());
  }
  EXPECT_EQ(found, facets);
  // By the divergence theorem: a triangle faces away from one part and into the other.
  std::vector<double> volume(walls.regions.size(), 0), expected(walls.regions.size(), 0);
  const std::vector<Vec3>& p = mesh.vertices;
  for (std::size_t t = 0; t < found.size(); ++t) {
    const auto [a, b, c] = walls.surface.triangles[t];
    const Walls::Patch& patch = walls.patches[static_cast<std::size_t>(walls.surface.labels[t])];
    const double cone = dot(p[a], cross(p[b], p[c])) / 6;
    volume[patch.back] += cone;
    if (patch.front != kNone) volume[patch.front] -= cone;
  }
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = mesh.tets[t];
    EXPECT_EQ(walls.regions[walls.part_of_tet[t]], mesh.regions[t]);
    expected[walls.part_of_tet[t]] += rounded_six_volume(p[a], p[b], p[c], p[d]) / 6;
  }
  for (std::size_t part = 0; part < volume.size(); ++part) EXPECT_NEAR(volume[part], expected[part], 1e-12);
}

class Regions : public testing::TestWithParam<Case> {};

// All walls are flat, so that areas and volumes are the input's.
TEST_P(Regions, ShareTheirInterfaces) {
  const TetMesh& input = GetParam().mesh;
  TetOptions options;
  options.vertices = 500;
  options.iterations = 40;
  const TetResult result = tetrahedralise(input, options);
  const TetMesh& mesh = result.mesh;
  const TetQualityReport quality = measure_tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0u);
  EXPECT_EQ(quality.zero_volume, 0u);
  EXPECT_GE(quality.dihedral_min, 15);
  EXPECT_GE(quality.radius_ratio_mean, 0.82);
  EXPECT_EQ(result.untiled, 0u);
  EXPECT_EQ(result.boundary.features.broken, 0u);
  const TetTopology topology = analyse_tet_topology(mesh), given = analyse_tet_topology(input);
  EXPECT_TRUE(topology.conforming);
  EXPECT_EQ(topology.unused_vertices, 0u);
  EXPECT_EQ(topology.boundary.euler, given.boundary.euler);
  EXPECT_NEAR(static_cast<double>(mesh.vertices.size()), 500, 25);
  const auto areas = areas_between(mesh), expected = areas_between(input);
  ASSERT_EQ(areas.size(), expected.size());
  for (const auto& [pair, area] : expected) EXPECT_NEAR(areas.at(pair), area, 1e-12 * area);
  // Marked are the boundary and the interfaces, each triangle once.
  const Walls walls = find_walls(mesh);
  std::vector<Triangle> marked = mesh.boundary, expected_marks = walls.surface.triangles;
  std::size_t between = 0;
  for (std::size_t t = 0; t < expected_marks.size(); ++t) {
    const Walls::Patch& patch = walls.patches[static_cast<std::size_t>(walls.surface.labels[t])];
    if (patch.front == kNone) continue;
    ++between;
    // Those between regions face away from that of the lower number.
    if (walls.regions[patch.back] > walls.regions[patch.front]) std::swap(expected_marks[t][1], expected_marks[t][2]);
  }
  for (std::vector<Triangle>* list : {&marked, &expected_marks}) {
    for (Triangle& t : *list) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(list->begin(), list->end());
  }
  EXPECT_EQ(marked, expected_marks);
  EXPECT_GT(between, 0u);
  EXPECT_EQ(result.interface_triangles, between);
  std::set<Index> on_walls;
  for (const Triangle& t : mesh.boundary) on_walls.insert(t.begin(), t.end());
  EXPECT_EQ(result.boundary_vertices, on_walls.size());
  EXPECT_EQ(*on_walls.rbegin() + 1, on_walls.size());
  for (const TetRegion& region : result.regions) {
    EXPECT_NEAR(region.volume, region.input_volume, 1e-12);
    EXPECT_EQ(region.tets,
              static_cast<std::size_t>(std::count(mesh.regions.begin(), mesh.regions.end(), region.region)));
  }
  std::set<int> regions(input.regions.begin(), input.regions.end());
  EXPECT_EQ(result.regions.size(), regions.size());
}

INSTANTIATE_TEST_SUITE_P(Grids, SolidWalls, testing::ValuesIn(cases()), [](const auto& c) { return c.param.name; });
INSTANTIATE_TEST_SUITE_P(Grids, Regions, testing::ValuesIn(cases()), [](const auto& c) { return c.param.name; });

TEST(RegionsOfSolids, KeepLabelsNamesAndMarkedEdges) {
  TetMesh input = marked_cube(3);
  input.region_names = {{7, "floor"}, {4, "middle"}};
  input.label_names = {{1, "inlet"}};
  // A label on an interface as well.
  const Walls walls = find_walls(input);
  for (std::size_t t = 0; t < walls.surface.triangles.size(); ++t)
    if (walls.patches[static_cast<std::size_t>(walls.surface.labels[t])].front == 1) {
      input.boundary.push_back(walls.surface.triangles[t]);
      input.boundary_labels.push_back(17);
    }
  TetOptions options;
  options.vertices = 400;
  options.iterations = 20;
  const TetMesh mesh = tetrahedralise(input, options).mesh;
  EXPECT_EQ(mesh.region_names, input.region_names);
  EXPECT_EQ(mesh.label_names, input.label_names);
  std::map<std::int32_t, double> area, expected;
  for (std::size_t t = 0; t < mesh.boundary.size(); ++t)
    area[mesh.boundary_labels[t]] += area_of(mesh.vertices, mesh.boundary[t]);
  for (std::size_t t = 0; t < input.boundary.size(); ++t)
    expected[input.boundary_labels[t]] += area_of(input.vertices, input.boundary[t]);
  expected[0] += 1;  // the other interface
  ASSERT_EQ(area.size(), expected.size());
  for (const auto& [label, size] : expected) EXPECT_NEAR(area[label], size, 1e-12) << label;
  double length = 0;
  for (const auto& [a, b] : mesh.feature_edges) length += norm(mesh.vertices[b] - mesh.vertices[a]);
  EXPECT_NEAR(length, 12 + 8, 1e-9);  // the cube's edges, and those of two squares within
}

TEST(RegionsOfSolids, AreTheSameWithAnyThreads) {
  TetOptions options;
  options.vertices = 200;
  options.iterations = 10;
  options.sizing.sizes = {{{0, 0, 0}}, {0.1}};
  options.threads = 1;
  const TetMesh one = tetrahedralise(four_quarters(), options).mesh;
  options.threads = 3;
  const TetMesh three = tetrahedralise(four_quarters(), options).mesh;
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.tets, three.tets);
  EXPECT_EQ(one.boundary, three.boundary);
}

TEST(RegionsOfSolids, StartFromGivenSeeds) {
  const TetMesh input = two_halves();
  TetOptions options;
  options.seeds = seeds_about(input, 300, 0, 5);
  options.iterations = 20;
  const TetResult result = tetrahedralise(input, options);
  EXPECT_TRUE(analyse_tet_topology(result.mesh).conforming);
  EXPECT_NEAR(static_cast<double>(result.mesh.vertices.size()), 300, 15);
}

// A region that closes upon itself along an edge has a boundary that is no manifold.
TEST(RegionsOfSolids, MayTouchThemselves) {
  const TetMesh input = divided_grid(2, 2, 2, [](int x, int y, int z) { return z == 0 || x == y ? 1 : 2; });
  TetOptions options;
  options.vertices = 300;
  options.iterations = 20;
  const TetResult result = tetrahedralise(input, options);
  EXPECT_TRUE(analyse_tet_topology(result.mesh).conforming);
  EXPECT_EQ(measure_tet_quality(result.mesh).inverted, 0u);
  EXPECT_GE(measure_tet_quality(result.mesh).dihedral_min, 15);
  ASSERT_EQ(result.regions.size(), 2u);
  EXPECT_NEAR(result.regions[0].volume, 6, 1e-12);
  EXPECT_NEAR(result.regions[1].volume, 2, 1e-12);
  const auto areas = areas_between(result.mesh), expected = areas_between(input);
  for (const auto& [pair, area] : expected) EXPECT_NEAR(areas.at(pair), area, 1e-12 * area);
}

// The walls of a solid alone.
TriangleMesh walls_alone(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  surface.triangles = wall_facets(mesh);
  return surface;
}

TEST(EnclosedRegions, AreNumberedByTheirFirstTriangles) {
  TriangleMesh surface = walls_alone(four_quarters());
  for (std::size_t t = 0; t < surface.triangles.size(); t += 3)
    std::swap(surface.triangles[t][0], surface.triangles[t][1]);
  const TriangleMesh walls = check_walls(surface);
  const TetMesh mesh = tetgen_regions(walls).mesh;
  EXPECT_EQ(areas_between(mesh).size(), 4u + 4u);
  const std::vector<Vec3>& p = mesh.vertices;
  int known = 0;
  for (const Triangle& t : walls.triangles) {
    int back = 0, front = 0;
    for (std::size_t k = 0; k < mesh.tets.size(); ++k) {
      const Tetrahedron& tet = mesh.tets[k];
      if (!std::all_of(t.begin(), t.end(), [&](Index v) { return std::find(tet.begin(), tet.end(), v) != tet.end(); }))
        continue;
      const Index other =
          *std::find_if(tet.begin(), tet.end(), [&](Index v) { return std::find(t.begin(), t.end(), v) == t.end(); });
      const double height = dot(cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]), p[other] - p[t[0]]);
      (height < 0 ? back : front) = mesh.regions[k];
    }
    for (const int region : {back, front}) {
      EXPECT_LE(region, known + 1);
      known = std::max(known, region);
    }
  }
  EXPECT_EQ(known, 4);
}

TEST(EnclosedRegions, AreAllFilledAndShareTheirWalls) {
  for (const TetMesh& solid : {checkerboard(), cube_in_cube()}) {
    TetOptions options;
    options.vertices = 400;
    options.iterations = 20;
    options.enclosed_regions = true;
    const TetResult result = tetrahedralise(walls_alone(solid), options);
    EXPECT_TRUE(analyse_tet_topology(result.mesh).conforming);
    EXPECT_EQ(result.regions.size(), find_walls(solid).regions.size());
    double volume = 0;
    for (const TetRegion& region : result.regions) {
      EXPECT_NEAR(region.volume, region.input_volume, 1e-12);
      volume += region.volume;
    }
    EXPECT_NEAR(volume, measure_tet_quality(solid).volume, 1e-9);
    EXPECT_GE(measure_tet_quality(result.mesh).dihedral_min, 15);
  }
}

// Two closed cubes with the square between them in both.
TEST(EnclosedRegions, TakeWallsThatAreThereTwiceOnce) {
  TriangleMesh two = box(2);
  const auto n = static_cast<Index>(two.vertices.size());
  const std::vector<Triangle> one = two.triangles;
  for (Index v = 0; v < n; ++v) two.vertices.push_back({two.vertices[v].x + 1, two.vertices[v].y, two.vertices[v].z});
  for (const auto& [a, b, c] : one) two.triangles.push_back({a + n, b + n, c + n});
  TetOptions options;
  options.vertices = 300;
  options.iterations = 20;
  options.enclosed_regions = true;
  const TetResult result = tetrahedralise(two, options);
  ASSERT_EQ(result.regions.size(), 2u);
  EXPECT_GT(result.interface_triangles, 0u);
  EXPECT_TRUE(analyse_tet_topology(result.mesh).conforming);
  EXPECT_NEAR(result.volume, 2, 1e-12);
}

void expect_refused(const TriangleMesh& surface, const std::string& what) {
  TetOptions options;
  options.vertices = 200;
  options.enclosed_regions = true;
  try {
    tetrahedralise(surface, options);
    FAIL() << what;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
  }
}

TEST(EnclosedRegions, RefuseWallsThatEncloseNothing) {
  TriangleMesh open = walls_alone(two_halves());
  open.triangles.pop_back();
  expect_refused(open, "not closed");

  TriangleMesh crossing = walls_alone(two_halves());
  const auto first = static_cast<Index>(crossing.vertices.size());
  for (const Vec3& p : single_tet().vertices) crossing.vertices.push_back(0.2 * p + Vec3{0.5, 0.5, 0.5});
  for (const Triangle& t : boundary_facets(single_tet().tets))
    crossing.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  expect_refused(crossing, "intersects itself");

  // A ring of cubes with one wall across.
  TetMesh ring = divided_grid(3, 3, 1, [](int x, int y, int) { return x == 1 && y == 1 ? 0 : 1; });
  TriangleMesh wall;
  wall.vertices = ring.vertices;
  std::vector<Tetrahedron> tets;
  for (std::size_t t = 0; t < ring.tets.size(); ++t)
    if (ring.regions[t] == 1) tets.push_back(ring.tets[t]);
  wall.triangles = boundary_facets(tets);
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      const Triangle facet = {tets[t][static_cast<std::size_t>((k + 1) % 4)],
                              tets[t][static_cast<std::size_t>((k + 2) % 4)],
                              tets[t][static_cast<std::size_t>((k + 3) % 4)]};
      const auto across = [&](Index v) { return ring.vertices[v].x == 1 && ring.vertices[v].y <= 1; };
      if (std::all_of(facet.begin(), facet.end(), across)) wall.triangles.push_back(facet);
    }
  expect_refused(wall, "the same enclosed part on both sides");
}

TEST(EnclosedRegions, SecondOrderNodesFollowInterfaces) {
  TriangleMesh surface = box(3);
  const TriangleMesh ball = icosphere(4);
  const auto first = static_cast<Index>(surface.vertices.size());
  for (const Vec3& p : ball.vertices) surface.vertices.push_back(0.3 * p + Vec3{0.5, 0.5, 0.5});
  for (const auto& [a, b, c] : ball.triangles) surface.triangles.push_back({a + first, b + first, c + first});
  TetOptions options;
  options.vertices = 500;
  options.iterations = 30;
  options.enclosed_regions = true;
  const TetResult result = tetrahedralise(surface, options);
  // An inscribed triangle with edges h lies at most h^2 / 6 r under the sphere.
  double longest = 0;
  for (const Triangle& t : wall_facets(result.mesh))
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, norm(result.mesh.vertices[t[k]] - result.mesh.vertices[t[(k + 1) % 3]]));
  const double ball_volume = result.regions[1].input_volume;
  EXPECT_LT(result.regions[1].volume, ball_volume);
  EXPECT_GT(result.regions[1].volume, ball_volume * (1 - 3 / 0.3 * longest * longest / (6 * 0.3)));
  SecondOrderReport report;
  second_order(result.mesh, surface, detect_features(surface, {}).edges, &report);
  EXPECT_GT(report.curved, 0u);
  EXPECT_LT(report.node_distance_mean, 0.1 * report.middle_distance_mean);
  EXPECT_GT(report.jacobian_min, 0);
}

}  // namespace
}  // namespace bisector::test
