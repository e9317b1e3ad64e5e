// Tetrahedral meshing end to end on generated solids: validity, topology, quality, features, sizes, and input it has to
// refuse.
#include "bisector/tetmesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "backend/project.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "features/size_field.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "support/diagram.h"
#include "support/featured.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

// A ball with a concentric spherical cavity.
TriangleMesh shell() {
  TriangleMesh mesh = icosphere(4);
  const auto n = static_cast<Index>(mesh.vertices.size());
  const std::size_t count = mesh.triangles.size();
  for (Index v = 0; v < n; ++v) mesh.vertices.push_back(0.5 * mesh.vertices[v]);
  for (std::size_t t = 0; t < count; ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    mesh.triangles.push_back({a + n, b + n, c + n});  // outward here; the walls of cavities face inward
  }
  return mesh;
}

struct Case {
  std::string name;
  TriangleMesh mesh;
  std::size_t vertices;
  std::size_t sharp;  // edges of the input that are features
};

void PrintTo(const Case& problem, std::ostream* out) { *out << problem.name; }

std::vector<Case> cases() {
  return {{"ball", icosphere(4), 400, 0}, {"ball_2000", icosphere(4), 2000, 0}, {"torus", torus(60, 36), 600, 0},
          {"box", box(4), 700, 48},       {"box_of_12", box(1), 300, 12},       {"two_balls", two_spheres(), 500, 0},
          {"shell", shell(), 900, 0}};
}

TetOptions options_for(std::size_t vertices) {
  TetOptions options;
  options.vertices = vertices;
  options.iterations = 40;
  return options;
}

TriangleMesh boundary_mesh(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  surface.triangles = mesh.boundary;
  return surface;
}

class Tetrahedralise : public testing::TestWithParam<Case> {};

TEST_P(Tetrahedralise, FillsTheSolidWithGoodTetrahedraAndKeepsFeatures) {
  const auto& [name, surface, vertices, sharp] = GetParam();
  const TetResult result = tetrahedralise(surface, options_for(vertices));
  const TetMesh& mesh = result.mesh;
  const TetQualityReport quality = measure_tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0u);
  EXPECT_EQ(quality.zero_volume, 0u);
  EXPECT_EQ(result.untiled, 0u);
  const TetTopology topology = analyse_tet_topology(mesh);
  EXPECT_TRUE(topology.conforming);
  EXPECT_EQ(topology.unused_vertices, 0u);
  EXPECT_TRUE(topology.boundary.closed);
  EXPECT_TRUE(topology.boundary.manifold);
  EXPECT_TRUE(topology.boundary.oriented);
  const MeshTopology want = analyse_topology(surface.triangles, surface.vertices.size());
  EXPECT_EQ(topology.boundary.euler, want.euler);
  EXPECT_EQ(topology.boundary.components, want.components);
  // The marks are the boundary.
  std::vector<Triangle> marked = mesh.boundary, facets = boundary_facets(mesh.tets);
  for (std::vector<Triangle>* list : {&marked, &facets}) {
    for (Triangle& t : *list) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(list->begin(), list->end());
  }
  EXPECT_EQ(marked, facets);
  EXPECT_EQ(count_self_intersections(boundary_mesh(mesh)), 0u);
  // The bar for any mesh of a solid without acute edges, and what meshers reach on average.
  EXPECT_GE(quality.dihedral_min, 14);
  EXPECT_GE(quality.radius_ratio_mean, 0.86);
  EXPECT_GE(measure_quality(boundary_mesh(mesh)).theta_min, 25);
  EXPECT_NEAR(static_cast<double>(mesh.vertices.size()), static_cast<double>(vertices),
              0.05 * static_cast<double>(vertices));
  // Volumes differ by no more than what lies between the two boundaries.
  const DistanceReport distance = measure_distance(boundary_mesh(mesh), surface);
  double area = 0;
  for (const auto& [a, b, c] : surface.triangles)
    area += 0.5 * norm(cross(surface.vertices[b] - surface.vertices[a], surface.vertices[c] - surface.vertices[a]));
  const double gap = distance.max / 100 * bounding_box(surface.vertices).diagonal();
  EXPECT_NEAR(quality.volume, result.volume, area * gap + 1e-9);
  EXPECT_LT(gap, result.edge_length);
  EXPECT_EQ(result.boundary.features.broken, 0u);
  if (sharp == 0) return;
  // Marked edges lie on the box's edges and are as long in sum; its corners are vertices.
  double length = 0;
  for (const auto& [a, b] : result.mesh.feature_edges) {
    length += norm(result.mesh.vertices[b] - result.mesh.vertices[a]);
    for (Index v : {a, b}) {
      const Vec3 p = result.mesh.vertices[v];
      int on = 0;
      for (int k = 0; k < 3; ++k) on += std::abs(p[k]) < 1e-12 || std::abs(p[k] - 1) < 1e-12;
      EXPECT_GE(on, 2);
    }
  }
  EXPECT_NEAR(length, 12, 1e-9);
  for (int k = 0; k < 8; ++k) {
    const Vec3 corner{k & 1 ? 1.0 : 0, k & 2 ? 1.0 : 0, k & 4 ? 1.0 : 0};
    EXPECT_NE(std::find(result.mesh.vertices.begin(), result.mesh.vertices.end(), corner), result.mesh.vertices.end());
  }
}

INSTANTIATE_TEST_SUITE_P(Solids, Tetrahedralise, testing::ValuesIn(cases()),
                         [](const auto& c) { return c.param.name; });

// Solids one or two cells thick: all sites of a free CVT meet the boundary.
TEST(TetrahedraliseThinSolids, HaveTheCountAndWhatRoomThereIsInside) {
  TriangleMesh plate = box(2);
  for (Vec3& p : plate.vertices) p.z *= 0.05;
  TriangleMesh wall = icosphere(3);
  const TriangleMesh cavity = icosphere(3);
  const auto n = static_cast<Index>(wall.vertices.size());
  for (const Vec3& p : cavity.vertices) wall.vertices.push_back(0.7 * p);
  for (const auto& [a, b, c] : cavity.triangles) wall.triangles.push_back({a + n, b + n, c + n});
  for (const auto& [surface, vertices] : {std::pair{plate, 1000.0}, std::pair{wall, 1000.0}}) {
    const TetResult result = tetrahedralise(surface, options_for(static_cast<std::size_t>(vertices)));
    EXPECT_NEAR(static_cast<double>(result.mesh.vertices.size()), vertices, 0.05 * vertices);
    const TetQualityReport quality = measure_tet_quality(result.mesh);
    EXPECT_EQ(quality.inverted, 0u);
    EXPECT_GE(quality.dihedral_min, 14);
    // A mesh without vertices inside has about 0.65.
    EXPECT_GE(quality.radius_ratio_mean, 0.8);
  }
}

bool same_bits_and_tets(const TetMesh& a, const TetMesh& b) {
  return a.tets == b.tets && a.boundary == b.boundary && same_bits(a.vertices, b.vertices);
}

// Blocks whose edges have chamfers much narrower than the mesh's edges, of which one curve each is left, or about as
// wide, which get shorter edges.
TEST(TetrahedraliseDetails, AreMergedOrGetShorterEdges) {
  for (const double chamfer : {0.004, 0.06}) {
    const TriangleMesh block = prism({{0, 0}, {1, 0}, {1, 1 - chamfer}, {1 - chamfer, 1}, {0, 1}});
    TetOptions options;
    options.vertices = 600;
    const TetResult with = tetrahedralise(block, options);
    EXPECT_EQ(with.detail.merged > 0, chamfer < 0.01);
    EXPECT_EQ(with.boundary.features.broken, 0u);
    const QualityReport quality = measure_quality(boundary_mesh(with.mesh));
    EXPECT_GT(quality.theta_min, 30) << chamfer;
    EXPECT_GT(measure_tet_quality(with.mesh).dihedral_min, 15) << chamfer;
    EXPECT_NEAR(static_cast<double>(with.mesh.vertices.size()), 600, 18);
    options.detail = DetailMode::off;
    const TetResult without = tetrahedralise(block, options);
    EXPECT_EQ(without.detail.merged, 0u);
    EXPECT_LT(measure_quality(boundary_mesh(without.mesh)).theta_min, quality.theta_min) << chamfer;
    options.detail = DetailMode::all;
    const TetResult all = tetrahedralise(block, options);
    EXPECT_EQ(all.detail.merged > 0, chamfer < 0.005) << "below a sixteenth of an edge";
    EXPECT_GT(measure_tet_quality(all.mesh).dihedral_min, 15) << chamfer;
  }
}

// Along acute edges the seeds of both sides tear each other's cells on the boundary, unless these are localised.
TEST(TetrahedraliseDetails, AcuteEdgesLeaveTheBoundaryEven) {
  TriangleMesh acute;
  acute.vertices = {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}};
  acute.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}};
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    TetOptions options = options_for(600);
    options.random_seed = seed;
    const TetResult result = tetrahedralise(acute, options);
    EXPECT_TRUE(result.boundary.ball_property);
    EXPECT_GT(measure_tet_quality(result.mesh).dihedral_min, 25) << seed;
    EXPECT_NEAR(static_cast<double>(result.mesh.vertices.size()), 600, 6) << seed;
  }
}

TEST(TetrahedraliseAgain, GivesTheSameWithAnyThreadsAndNeighbours) {
  const TetMesh solid = tet_box(3);
  TetOptions options = options_for(400);
  const TetMesh mesh = tetrahedralise(solid, options).mesh;
  options.threads = 1;
  EXPECT_TRUE(same_bits_and_tets(tetrahedralise(solid, options).mesh, mesh));
  options.compute.neighbours = NeighbourSource::delaunay;
  EXPECT_TRUE(same_bits_and_tets(tetrahedralise(solid, options).mesh, mesh));
}

TEST(TetrahedraliseAgain, TakesTetrahedraAsItTakesTheirSurface) {
  const TetResult result = tetrahedralise(tet_box(2), options_for(500));
  EXPECT_EQ(measure_tet_quality(result.mesh).inverted, 0u);
  EXPECT_NEAR(measure_tet_quality(result.mesh).volume, 1, 1e-12);
  EXPECT_NEAR(result.volume, 1, 1e-12);
  EXPECT_GE(measure_tet_quality(result.mesh).dihedral_min, 14);
  EXPECT_EQ(result.boundary.features.curves, 12u);
}

TEST(TetrahedraliseAgain, KeepsLabelsAndTheRegionsOfSolidsApart) {
  TetMesh solid = tet_box(4);
  const std::size_t tets = solid.tets.size();
  const auto vertices = static_cast<Index>(solid.vertices.size());
  for (Index v = 0; v < vertices; ++v) solid.vertices.push_back(solid.vertices[v] + Vec3{2, 0, 0});
  for (std::size_t t = 0; t < tets; ++t) {
    const auto [a, b, c, d] = solid.tets[t];
    solid.tets.push_back({a + vertices, b + vertices, c + vertices, d + vertices});
  }
  solid.regions.assign(tets, 3);
  solid.regions.resize(2 * tets, 7);
  solid.boundary = boundary_facets(solid.tets);
  for (const Triangle& t : solid.boundary) {
    bool bottom = true;
    for (Index v : t) bottom &= solid.vertices[v].z == 0;
    solid.boundary_labels.push_back(bottom ? 5 : 2);
  }
  const TetResult result = tetrahedralise(solid, options_for(1500));
  ASSERT_EQ(result.mesh.regions.size(), result.mesh.tets.size());
  for (std::size_t t = 0; t < result.mesh.tets.size(); ++t)
    for (const Index v : result.mesh.tets[t]) EXPECT_EQ(result.mesh.regions[t] == 3, result.mesh.vertices[v].x < 1.5);
  ASSERT_EQ(result.regions.size(), 2u);
  for (const TetRegion& region : result.regions) EXPECT_NEAR(region.volume, 1, 1e-12);
  ASSERT_EQ(result.mesh.boundary_labels.size(), result.mesh.boundary.size());
  double bottom = 0;
  for (std::size_t t = 0; t < result.mesh.boundary.size(); ++t) {
    const auto [a, b, c] = result.mesh.boundary[t];
    const std::vector<Vec3>& v = result.mesh.vertices;
    const bool flat = v[a].z == 0 && v[b].z == 0 && v[c].z == 0;
    EXPECT_EQ(result.mesh.boundary_labels[t], flat ? 5 : 2);
    if (flat) bottom += 0.5 * norm(cross(v[b] - v[a], v[c] - v[a]));
  }
  EXPECT_NEAR(bottom, 2, 1e-12);
}

TEST(TetrahedraliseAgain, EdgesFollowASizeField) {
  const TetMesh solid = tet_box(3);
  TetOptions options = options_for(2500);
  options.sizing.sizes.points = {{0, 0, 0}};
  options.sizing.sizes.lengths = {0.03};
  const TetResult result = tetrahedralise(solid, options);
  EXPECT_GE(measure_tet_quality(result.mesh).dihedral_min, 14);
  // h = c + 0.2 r, c such that there are as many vertices: the ratio of edges to it must not depend on r.
  std::vector<std::pair<double, double>> at;  // distance, length
  for (const Tetrahedron& t : result.mesh.tets)
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        const Vec3 a = result.mesh.vertices[t[i]], b = result.mesh.vertices[t[j]];
        at.push_back({norm(0.5 * (a + b)), norm(b - a)});
      }
  const auto mean_between = [&](double lo, double hi) {
    double sum = 0, count = 0;
    for (const auto& [r, length] : at)
      if (r >= lo && r < hi) {
        sum += length;
        ++count;
      }
    return sum / count;
  };
  const double near = mean_between(0, 0.3), middle = mean_between(0.5, 0.7), far = mean_between(1.1, 1.4);
  // Slopes between the means of r, which are about 0.22, 0.61 and 1.2.
  EXPECT_NEAR((middle - near) / (0.61 - 0.22), 0.2, 0.08);
  EXPECT_NEAR((far - middle) / (1.2 - 0.61), 0.2, 0.08);
}

TEST(TetrahedraliseAgain, WithoutImprovementTheTetrahedraAreDelaunay) {
  TetOptions options = options_for(300);
  options.min_dihedral = 0;
  const TetResult result = tetrahedralise(tet_box(2), options);
  ASSERT_TRUE(result.delaunay);
  for (const Tetrahedron& t : result.mesh.tets) {
    const Vec3 p = result.mesh.vertices[t[0]];
    const Vec3 b = result.mesh.vertices[t[1]] - p, c = result.mesh.vertices[t[2]] - p,
               d = result.mesh.vertices[t[3]] - p;
    const double six = dot(b, cross(c, d));
    const Vec3 centre = (0.5 / six) * (norm2(b) * cross(c, d) + norm2(c) * cross(d, b) + norm2(d) * cross(b, c));
    if (six < 1e-7) continue;  // the centre of a sliver is too uncertain
    for (const Vec3& q : result.mesh.vertices) EXPECT_GE(norm(q - p - centre), norm(centre) * (1 - 1e-6));
  }
}

TEST(TetrahedraliseAgain, StartsFromGivenSeeds) {
  TetOptions options;
  options.iterations = 20;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j)
      for (int k = 0; k < 5; ++k) options.seeds.push_back({0.1 + 0.2 * i, 0.1 + 0.2 * j, 0.1 + 0.2 * k});
  const TetResult result = tetrahedralise(tet_box(2), options);
  EXPECT_NEAR(static_cast<double>(result.mesh.vertices.size()), 125, 20);
  EXPECT_NEAR(measure_tet_quality(result.mesh).volume, 1, 1e-12);
}

// A sheet of thickness 0.004, rolled up to nine tenths of a circle of radius 0.3.
TriangleMesh rolled_sheet() {
  constexpr Index kSteps = 41, kRing = 2 * kSteps;
  TriangleMesh mesh;
  for (const double z : {0.0, 0.25})
    for (const double r : {0.304, 0.3})
      for (Index k = 0; k < kSteps; ++k) {
        const Index i = r > 0.3 ? k : kSteps - 1 - k;
        const double angle = 1.8 * std::numbers::pi * i / (kSteps - 1);
        mesh.vertices.push_back({r * std::cos(angle), r * std::sin(angle), z});
      }
  const auto quad = [&](Index a, Index b, Index c, Index d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (Index i = 0; i < kRing; ++i) quad(i, (i + 1) % kRing, kRing + (i + 1) % kRing, kRing + i);
  for (Index i = 0; i + 1 < kSteps; ++i) {
    const Index across = kRing - 1 - i;
    quad(i, across, across - 1, i + 1);
    quad(kRing + i, kRing + i + 1, kRing + across - 1, kRing + across);
  }
  return mesh;
}

// Where the sites alone leave a boundary that crosses itself, it is remeshed as surfaces are.
TEST(TetrahedraliseThinSolids, HaveABoundaryWhereSheetsAreNear) {
  TetOptions options = options_for(250);
  options.iterations = 100;
  options.min_dihedral = 0;
  const TetResult result = tetrahedralise(rolled_sheet(), options);
  EXPECT_EQ(measure_tet_quality(result.mesh).inverted, 0u);
  const TriangleMesh boundary = boundary_mesh(result.mesh);
  EXPECT_EQ(count_self_intersections(boundary), 0u);
  const MeshTopology topology = analyse_topology(boundary.triangles, boundary.vertices.size());
  EXPECT_TRUE(topology.manifold && topology.closed);
  EXPECT_EQ(topology.euler, 2);
}

// Sites of one would own parts of the other, and their facing sides count as details.
TEST(TetrahedraliseNear, SolidsAreFilledEachForItself) {
  TriangleMesh slab = box(1);
  for (Vec3& p : slab.vertices) p = {2 * p.x + 1.0 / 3, 2 * p.y, p.z};
  const TriangleMesh input = joined(slab, slab, {0.1, 0.1, 1.001});
  const TetResult result = tetrahedralise(input, options_for(250));
  EXPECT_NEAR(measure_tet_quality(result.mesh).volume, 8, 1e-9);
  EXPECT_EQ(result.boundary.features.broken, 0u);
  EXPECT_EQ(result.detail.merged, 0u);
  for (const Vec3& corner : input.vertices)
    EXPECT_NE(std::find(result.mesh.vertices.begin(), result.mesh.vertices.end(), corner), result.mesh.vertices.end());
}

// Moved apart by rounding, as in remeshing of surfaces.
TEST(TetrahedraliseTouching, SolidsAreFilledEachForItself) {
  const TriangleMesh cube = box(1);
  const Vec3 in_a_point{1, 1, 1}, along_an_edge{1, 1, 0}, with_a_face{0.25, 0.25, 1};
  for (const Vec3& offset : {in_a_point, along_an_edge, with_a_face}) {
    const TetResult result = tetrahedralise(joined(cube, cube, offset), options_for(150));
    EXPECT_EQ(measure_tet_quality(result.mesh).inverted, 0u);
    EXPECT_NEAR(measure_tet_quality(result.mesh).volume, 2, 1e-4);
    const TriangleMesh boundary = boundary_mesh(result.mesh);
    EXPECT_EQ(count_self_intersections(boundary), 0u);
    const MeshTopology topology = analyse_topology(boundary.triangles, boundary.vertices.size());
    EXPECT_TRUE(topology.manifold && topology.closed);
    EXPECT_EQ(topology.components, 2u);
  }
}

TEST(TetrahedraliseTouching, TrianglesWithoutAreaAreMended) {
  TriangleMesh mesh = box(2);
  // A corner on an edge of the neighbour, which keeps its edge.
  const auto [a, b, c] = mesh.triangles[0];
  const auto middle = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
  mesh.triangles[0] = {a, middle, c};
  mesh.triangles.push_back({middle, b, c});
  mesh.triangles.push_back({a, b, middle});
  const TetResult result = tetrahedralise(mesh, options_for(150));
  EXPECT_NEAR(measure_tet_quality(result.mesh).volume, 1, 1e-9);
  EXPECT_GE(measure_tet_quality(result.mesh).dihedral_min, 10);
}

TEST(TetrahedraliseErrors, RefusesWhatBoundsNoSolid) {
  EXPECT_THROW(tetrahedralise(wavy_patch(8), options_for(100)), Error);  // open
  EXPECT_THROW(tetrahedralise(pages(), options_for(100)), Error);        // open and not manifold
  TriangleMesh crossing = icosphere(2);
  const auto n = static_cast<Index>(crossing.vertices.size());
  for (Index v = 0; v < n; ++v) crossing.vertices.push_back(crossing.vertices[v] + Vec3{0.5, 0, 0});
  const std::size_t count = crossing.triangles.size();
  for (std::size_t t = 0; t < count; ++t) {
    const auto [a, b, c] = crossing.triangles[t];
    crossing.triangles.push_back({a + n, b + n, c + n});
  }
  EXPECT_THROW(tetrahedralise(crossing, options_for(100)), Error);
}

TEST(TetrahedraliseErrors, RefusesTetrahedraWhoseBoundaryIsNoSuchSurface) {
  const auto refused = [](const TetMesh& solid, const std::string& part) {
    try {
      tetrahedralise(solid, options_for(100));
      ADD_FAILURE() << "no error: " << part;
    } catch (const Error& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("the tetrahedra's boundary: ")) << error.what();
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  TetMesh edge = single_tet();  // two on one edge
  edge.vertices.insert(edge.vertices.end(), {{5, -5, 1}, {5, -4, 8}});
  edge.tets.push_back({0, 1, 4, 5});
  refused(edge, "1 edge has more than two triangles (");
  TetMesh vertex = single_tet();
  vertex.vertices.insert(vertex.vertices.end(), {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}});
  vertex.tets.push_back({0, 4, 6, 5});
  refused(vertex, "touches itself at 1 vertex (");
  TetMesh crossing = single_tet();
  for (const Vec3& p : single_tet().vertices) crossing.vertices.push_back(p + Vec3{0.5, 0.25, 0.125});
  crossing.tets.push_back({4, 5, 6, 7});
  refused(crossing, "intersects itself");
  TetMesh flat = single_tet();  // one without volume on a facet
  flat.vertices.push_back({4, 4, 0});
  flat.tets.push_back({0, 2, 1, 4});
  refused(flat, "intersects itself");
  refused({}, "no triangles");
}

TEST(TetrahedraliseErrors, RefusesOptionsThatMakeNoSense) {
  const TetMesh solid = tet_box(1);
  TetOptions options;
  EXPECT_THROW(tetrahedralise(solid, options), Error);
  options.vertices = 100;
  options.edge_length = 0.1;
  EXPECT_THROW(tetrahedralise(solid, options), Error);
  options = {};
  options.vertices = 4;
  EXPECT_THROW(tetrahedralise(solid, options), Error);
  options = {};
  options.edge_length = 100;
  EXPECT_THROW(tetrahedralise(solid, options), Error);
  options = options_for(100);
  options.sizing.field.kind = DensityKind::attribute;
  options.sizing.field.attribute = {1, 2, 3};
  EXPECT_THROW(tetrahedralise(solid, options), Error);
  options = options_for(100);
  options.features.given = {{0, 1000}};
  EXPECT_THROW(tetrahedralise(box(1), options), Error);
}

TEST(TetrahedraliseErrors, CanBeCancelled) {
  std::atomic<bool> cancel = false;
  Context context;
  context.cancel = &cancel;
  int steps = 0;
  context.progress = [&](const Progress&) { cancel = ++steps > 3; };
  EXPECT_THROW(tetrahedralise(tet_box(2), options_for(300), context), Cancelled);
}

}  // namespace
}  // namespace bisector::test
