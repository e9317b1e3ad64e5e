// Diagrams as the library hands them out: what must hold of any of them, and what is refused.
#include "bisector/diagram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "bisector/error.h"
#include "core/geometry.h"
#include "mesh/sampling.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

DiagramOptions on_cpu() {
  DiagramOptions options;
  options.compute.device.kind = DeviceRequest::Kind::cpu;
  return options;
}

std::vector<Vec3> seeds_on(const TriangleMesh& mesh, std::size_t count) {
  std::vector<Vec3> seeds;
  for (const SurfaceSample& sample : sample_surface(mesh, count, 11)) seeds.push_back(sample.point);
  return seeds;
}

std::vector<Vec3> grid_of_seeds(int n) {
  std::vector<Vec3> seeds;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        seeds.push_back({(i + 0.45 + 0.01 * j) / n, (j + 0.5 + 0.01 * k) / n, (k + 0.55 + 0.01 * i) / n});
  return seeds;
}

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles)
    area += 0.5 * norm(cross(mesh.vertices[t[1]] - mesh.vertices[t[0]], mesh.vertices[t[2]] - mesh.vertices[t[0]]));
  return area;
}

double area_of(const RestrictedPolygons& polygons) {
  double area = 0;
  for (std::size_t k = 0; k < polygons.pairs.size(); ++k) {
    const Vec3 origin = polygons.vertices[polygons.offsets[k]];
    Vec3 twice;
    for (std::size_t e = polygons.offsets[k] + 1; e + 1 < polygons.offsets[k + 1]; ++e)
      twice += cross(polygons.vertices[e] - origin, polygons.vertices[e + 1] - origin);
    area += 0.5 * norm(twice);
  }
  return area;
}

long long euler_characteristic(const std::vector<Triangle>& triangles) {
  std::set<Index> vertices;
  std::set<std::pair<Index, Index>> edges;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      vertices.insert(t[k]);
      edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
    }
  return static_cast<long long>(vertices.size()) - static_cast<long long>(edges.size()) +
         static_cast<long long>(triangles.size());
}

template <class Result>
void expect_sums(const Result& diagram, double measure) {
  double mass = 0, energy = 0;
  for (const DiagramCell& cell : diagram.cells) {
    EXPECT_GE(cell.mass, 0);
    EXPECT_GE(cell.energy, 0);
    mass += cell.mass;
    energy += cell.energy;
  }
  EXPECT_NEAR(mass, measure, 1e-12 * measure);
  EXPECT_NEAR(diagram.mass, measure, 1e-12 * measure);
  EXPECT_NEAR(diagram.energy, energy, 1e-12 * energy);
  EXPECT_EQ(diagram.untiled, 0u);
  EXPECT_EQ(diagram.device.kind, "cpu");
  EXPECT_EQ(diagram.certification.cpu, diagram.certification.uncertain);
}

TEST(SurfaceDiagram, PolygonsTileTheSurface) {
  for (const TriangleMesh& mesh : {test::icosphere(3), test::wavy_patch(12), test::soup(40, 3)}) {
    const SurfaceDiagram diagram = compute_diagram(mesh, {}, seeds_on(mesh, 60), on_cpu());
    const double area = area_of(mesh);
    expect_sums(diagram, area);
    EXPECT_NEAR(area_of(diagram.polygons), area, 1e-12 * area);
    EXPECT_NEAR(diagram.surface_mass, area, 1e-12 * area);
    EXPECT_EQ(diagram.certification.pairs, diagram.polygons.pairs.size());
  }
}

TEST(SurfaceDiagram, TheDualOfASphereIsASphere) {
  const TriangleMesh mesh = test::icosphere(4);
  const SurfaceDiagram diagram = compute_diagram(mesh, {}, seeds_on(mesh, 200), on_cpu());
  EXPECT_EQ(euler_characteristic(diagram.dual.triangles), 2);
  EXPECT_EQ(diagram.dual.triangles.size(), 2 * 200u - 4);
  EXPECT_EQ(diagram.dual.multiplicity, std::vector<Index>(diagram.dual.triangles.size(), 1));
}

// Three cells around the sphere meet in two points.
TEST(SurfaceDiagram, MultiplicitiesCountVertices) {
  const std::vector<Vec3> seeds{{1, 0, 0}, {-0.5, 0.8, 0}, {-0.5, -0.8, 0}};
  const SurfaceDiagram diagram = compute_diagram(test::icosphere(3), {}, seeds, on_cpu());
  ASSERT_EQ(diagram.dual.triangles.size(), 1u);
  EXPECT_EQ(diagram.dual.multiplicity, std::vector<Index>{2});
}

TEST(SurfaceDiagram, DensityScalesMassesAndEnergies) {
  const TriangleMesh mesh = test::icosphere(2);
  const std::vector<Vec3> seeds = seeds_on(mesh, 20);
  const SurfaceDiagram one = compute_diagram(mesh, {}, seeds, on_cpu());
  const SurfaceDiagram three = compute_diagram(mesh, std::vector<double>(mesh.vertices.size(), 3), seeds, on_cpu());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(three.cells[i].mass, 3 * one.cells[i].mass, 1e-12);
    EXPECT_NEAR(three.cells[i].energy, 3 * one.cells[i].energy, 1e-12);
    EXPECT_NEAR(norm(three.cells[i].centroid - one.cells[i].centroid), 0, 1e-12);
  }
}

TEST(SurfaceDiagram, CellsThatMissTheSurfaceAndEqualSeedsAreEmpty) {
  std::vector<Vec3> seeds = seeds_on(test::icosphere(3), 20);
  const Vec3 far{50, 0, 0}, twice = seeds[7];
  seeds.push_back(far);
  seeds.push_back(twice);
  const SurfaceDiagram diagram = compute_diagram(test::icosphere(3), {}, seeds, on_cpu());
  EXPECT_GT(diagram.cells[7].mass, 0);
  for (const std::size_t empty : {20, 21}) {
    EXPECT_EQ(diagram.cells[empty].mass, 0);
    EXPECT_EQ(diagram.cells[empty].energy, 0);
    EXPECT_EQ(diagram.cells[empty].centroid, seeds[empty]);
    for (const auto& pair : diagram.polygons.pairs) EXPECT_NE(pair.cell, empty);
    for (const Triangle& t : diagram.dual.triangles) EXPECT_EQ(std::count(t.begin(), t.end(), empty), 0);
  }
}

TEST(SurfaceDiagram, BadInputIsRefused) {
  const TriangleMesh mesh = test::single_triangle();
  const std::vector<Vec3> seeds{{1, 1, 0}};
  EXPECT_THROW(compute_diagram(mesh, {}, {}, on_cpu()), Error);
  EXPECT_THROW(compute_diagram(mesh, {}, {{kNaN, 0, 0}}, on_cpu()), Error);
  EXPECT_THROW(compute_diagram(mesh, {1, 1}, seeds, on_cpu()), Error);
  EXPECT_THROW(compute_diagram(mesh, {1, 0, 1}, seeds, on_cpu()), Error);
  TriangleMesh wrong = mesh;
  wrong.triangles[0][1] = 17;
  EXPECT_THROW(compute_diagram(wrong, {}, seeds, on_cpu()), Error);
  wrong = mesh;
  wrong.vertices[2].y = kNaN;
  EXPECT_THROW(compute_diagram(wrong, {}, seeds, on_cpu()), Error);
  wrong = mesh;
  wrong.vertices[2] = wrong.vertices[1];
  EXPECT_THROW(compute_diagram(wrong, {}, seeds, on_cpu()), Error);
  DiagramOptions options = on_cpu();
  options.compute.precision = Precision::single;
  EXPECT_THROW(compute_diagram(mesh, {}, seeds, options), Error);
}

TEST(SurfaceDiagram, CanBeCancelled) {
  const std::atomic<bool> cancel = true;
  Context context;
  context.cancel = &cancel;
  EXPECT_THROW(compute_diagram(test::single_triangle(), {}, {{1, 1, 0}}, on_cpu(), context), Cancelled);
}

TEST(SolidDiagram, PolyhedraTileTheSolid) {
  const TetMesh mesh = test::tet_box(3);
  for (const bool uniform : {true, false}) {
    std::vector<double> density;
    if (!uniform)
      for (const Vec3& p : mesh.vertices) density.push_back(1 + p.x);
    const SolidDiagram diagram = compute_diagram(mesh, density, grid_of_seeds(4), on_cpu());
    expect_sums(diagram, uniform ? 1.0 : 1.5);
    EXPECT_NEAR(diagram.solid_mass, uniform ? 1.0 : 1.5, 1e-12);
    EXPECT_NEAR(area_of(diagram.boundary_polygons), 6, 1e-12);
    EXPECT_EQ(diagram.boundary.size(), 12u * 3 * 3);
    EXPECT_EQ(diagram.certification.pairs, diagram.polyhedra.pairs.size());
    // Only a uniform density leaves inner cells whole.
    const bool whole = std::any_of(diagram.polyhedra.pairs.begin(), diagram.polyhedra.pairs.end(),
                                   [](const ClippedPolyhedra::Pair& pair) { return pair.tet == kNone; });
    EXPECT_EQ(whole, uniform);
  }
}

TEST(SolidDiagram, TheDualOfACubeIsABall) {
  const TetMesh mesh = test::tet_box(2);
  const SolidDiagram diagram = compute_diagram(mesh, {}, grid_of_seeds(4), on_cpu());
  EXPECT_EQ(euler_characteristic(diagram.boundary_dual.triangles), 2);
  EXPECT_TRUE(std::is_sorted(diagram.dual_tets.begin(), diagram.dual_tets.end()));
  std::set<Triangle> facets, once;
  std::set<std::pair<Index, Index>> edges;
  std::set<Index> vertices;
  for (const Tetrahedron& t : diagram.dual_tets)
    for (std::size_t k = 0; k < 4; ++k) {
      Triangle facet{};
      for (std::size_t l = 0, n = 0; l < 4; ++l)
        if (l != k) facet[n++] = t[l];
      facets.insert(facet);
      if (!once.insert(facet).second) once.erase(facet);
      vertices.insert(t[k]);
      for (std::size_t l = k + 1; l < 4; ++l) edges.insert({t[k], t[l]});
    }
  const auto count = [](const auto& set) { return static_cast<long long>(set.size()); };
  EXPECT_EQ(count(vertices) - count(edges) + count(facets) - static_cast<long long>(diagram.dual_tets.size()), 1);
  EXPECT_EQ(euler_characteristic({once.begin(), once.end()}), 2);
}

TEST(SolidDiagram, CellsOutsideAndEqualSeedsAreEmpty) {
  std::vector<Vec3> seeds = grid_of_seeds(2);
  seeds.push_back({9, 9, 9});
  seeds.push_back(seeds[3]);
  const SolidDiagram diagram = compute_diagram(test::tet_box(1), {}, seeds, on_cpu());
  EXPECT_GT(diagram.cells[3].mass, 0);
  for (const std::size_t empty : {8, 9}) {
    EXPECT_EQ(diagram.cells[empty].mass, 0);
    EXPECT_EQ(diagram.cells[empty].centroid, seeds[empty]);
    for (const Tetrahedron& t : diagram.dual_tets) EXPECT_EQ(std::count(t.begin(), t.end(), empty), 0);
  }
}

TEST(SolidDiagram, BadInputIsRefused) {
  const TetMesh mesh = test::single_tet();
  const std::vector<Vec3> seeds{{1, 1, 1}};
  EXPECT_THROW(compute_diagram(mesh, {}, {}, on_cpu()), Error);
  EXPECT_THROW(compute_diagram(mesh, {}, {{0, kNaN, 0}}, on_cpu()), Error);
  EXPECT_THROW(compute_diagram(mesh, {1}, seeds, on_cpu()), Error);
  TetMesh wrong = mesh;
  wrong.tets[0][2] = 99;
  EXPECT_THROW(compute_diagram(wrong, {}, seeds, on_cpu()), Error);
  wrong = mesh;
  wrong.vertices[3] = wrong.vertices[0];
  EXPECT_THROW(compute_diagram(wrong, {}, seeds, on_cpu()), Error);
}

}  // namespace
}  // namespace bisector
