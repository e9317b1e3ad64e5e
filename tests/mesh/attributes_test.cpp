// Attributes at other places: what is linear comes back exactly, what is not is as its kind demands.
#include "bisector/attributes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "core/geometry.h"
#include "mesh/tet_topology.h"
#include "spatial/nearest.h"
#include "support/models.h"
#include "support/solids.h"

namespace bisector::test {
namespace {

using Site = Attribute::Site;
using Type = Attribute::Type;

Attribute coordinates(const std::vector<Vec3>& vertices) {
  Attribute xyz{"xyz", Site::vertex, Type::float64, 3};
  for (const Vec3& p : vertices) xyz.values.insert(xyz.values.end(), {p.x, p.y, p.z});
  return xyz;
}

// A mesh of these vertices alone, for what attributes of vertices become.
TriangleMesh points_of(std::vector<Vec3> vertices) { return {std::move(vertices), {}}; }

TriangleMesh carried(const TriangleMesh& from, TriangleMesh to) {
  carry_attributes(from, map_to_surface(to.vertices, from), to);
  return to;
}

Vec3 at(const Attribute& xyz, std::size_t i) {
  return {xyz.values[3 * i], xyz.values[3 * i + 1], xyz.values[3 * i + 2]};
}

TEST(Attributes, WhatIsLinearOnTrianglesIsThatOfTheNearestPoint) {
  for (TriangleMesh mesh : {torus(64, 24), box(4), needles(), wavy_patch(16), soup(60, 5), collinear_among_good()}) {
    mesh.attributes = {coordinates(mesh.vertices)};
    const double size = bounding_box(mesh.vertices).diagonal();
    std::vector<Vec3> points = random_seeds(mesh, 500, 7);
    for (std::size_t i = 0; i < points.size(); i += 2) points[i] += Vec3{0.1 * size, -0.05 * size, 0.02 * size};
    const NearestOnMesh nearest(mesh);
    const SurfaceMap map = map_to_surface(points, mesh);
    const TriangleMesh result = carried(mesh, points_of(points));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::array<double, 3>& w = map.weights[i];
      EXPECT_GE(*std::min_element(w.begin(), w.end()), 0);
      EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-15);
      const double distance = norm(nearest.nearest(points[i]).point - points[i]);
      EXPECT_NEAR(norm(at(result.attributes[0], i) - points[i]), distance, 1e-9 * size);
    }
  }
}

TEST(Attributes, VerticesOfTheSurfaceHaveTheirOwnBitForBit) {
  TriangleMesh mesh = torus(31, 17);
  SplitMix64 random(3);
  mesh.attributes = {{"a", Site::vertex, Type::float64, 2}, {"b", Site::vertex, Type::int32, 1}};
  for (Attribute& attribute : mesh.attributes)
    for (std::size_t i = 0; i < attribute.components * mesh.vertices.size(); ++i)
      attribute.values.push_back(attribute.type == Type::int32 ? static_cast<double>(random.below(1000))
                                                               : random.unit());
  const TriangleMesh result = carried(mesh, points_of(mesh.vertices));
  ASSERT_EQ(result.attributes.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(result.attributes[k].name, mesh.attributes[k].name);
    EXPECT_EQ(result.attributes[k].type, mesh.attributes[k].type);
    EXPECT_EQ(result.attributes[k].values, mesh.attributes[k].values);
  }
}

TEST(Attributes, IntegersAreOnesThatAreThereColoursAreBetween) {
  TriangleMesh mesh = grid_patch(2, 2);
  const std::size_t n = mesh.vertices.size();
  Attribute part{"part", Site::vertex, Type::int32, 1, std::vector<double>(n)};
  Attribute colour{"Color", Site::vertex, Type::uint8, 3, std::vector<double>(3 * n)};
  Attribute normal{"Normals", Site::vertex, Type::float32, 3, std::vector<double>(3 * n)};
  for (std::size_t v = 0; v < n; ++v) {
    part.values[v] = v % 2 == 0 ? 0 : 100;
    colour.values[3 * v] = v % 2 == 0 ? 0 : 200;
    normal.values[3 * v + v % 3] = 1;
  }
  mesh.attributes = {part, colour, normal};
  ASSERT_EQ(meaning_of(colour), AttributeMeaning::colour);
  ASSERT_EQ(meaning_of(normal), AttributeMeaning::normal);
  const TriangleMesh result = carried(mesh, points_of(random_seeds(mesh, 400, 1)));
  std::set<double> between;
  for (std::size_t i = 0; i < 400; ++i) {
    const double p = result.attributes[0].values[i], red = result.attributes[1].values[3 * i];
    EXPECT_TRUE(p == 0 || p == 100) << p;
    EXPECT_EQ(red, std::round(red));
    between.insert(red);
    EXPECT_NEAR(norm(at(result.attributes[2], i)), 1, 1e-12);
  }
  EXPECT_GT(between.size(), 50u);
}

TEST(Attributes, NoNumberSpreadsOnlyToWhereItCounts) {
  TriangleMesh mesh = grid_patch(4, 1);
  Attribute heat{"heat", Site::vertex, Type::float64, 1, std::vector<double>(mesh.vertices.size(), 1)};
  heat.values[0] = std::numeric_limits<double>::quiet_NaN();
  mesh.attributes = {heat};
  const TriangleMesh result = carried(mesh, points_of(mesh.vertices));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_EQ(std::isnan(result.attributes[0].values[v]), v == 0) << v;
}

TEST(Attributes, TrianglesHaveThoseOfTheNearestOne) {
  TriangleMesh mesh = torus(40, 20);
  Attribute number{"number", Site::element, Type::int32, 1, std::vector<double>(mesh.triangles.size())};
  std::iota(number.values.begin(), number.values.end(), 0);
  mesh.attributes = {number};
  const TriangleMesh same = carried(mesh, {mesh.vertices, mesh.triangles});
  EXPECT_EQ(same.attributes[0].values, number.values);
  const TriangleMesh other = carried(mesh, torus(23, 9));
  const NearestOnMesh nearest(mesh);
  for (std::size_t t = 0; t < other.triangles.size(); ++t) {
    Vec3 centre;
    for (const Index v : other.triangles[t]) centre += (1.0 / 3) * other.vertices[v];
    TriangleMesh one;
    for (const Index v : mesh.triangles[static_cast<std::size_t>(other.attributes[0].values[t])])
      one.vertices.push_back(mesh.vertices[v]);
    one.triangles = {{0, 1, 2}};
    EXPECT_NEAR(norm(NearestOnMesh(one).nearest(centre).point - centre), norm(nearest.nearest(centre).point - centre),
                1e-12);
  }
}

// The angle about the axis in turns, from 0 on: a seam where it jumps from 1 to 0.
double turns(const Vec3& p) {
  const double angle = std::atan2(p.y, p.x) / (2 * std::numbers::pi);
  return angle < 0 ? angle + 1 : angle;
}

// A torus whose corners have their angle, without a jump within a triangle.
TriangleMesh torus_with_seam() {
  TriangleMesh mesh = torus(60, 20);
  Attribute uv{"texcoord", Site::corner, Type::float32, 2};
  for (const Triangle& t : mesh.triangles) {
    std::array<double, 3> u{turns(mesh.vertices[t[0]]), turns(mesh.vertices[t[1]]), turns(mesh.vertices[t[2]])};
    const double most = *std::max_element(u.begin(), u.end());
    for (std::size_t k = 0; k < 3; ++k)
      uv.values.insert(uv.values.end(), {most - u[k] > 0.5 ? u[k] + 1 : u[k], mesh.vertices[t[k]].z});
  }
  mesh.attributes = {uv};
  return mesh;
}

// The same with a vertex for each of several values at one place, as files with attributes of vertices have seams.
TriangleMesh torus_with_doubled_vertices() {
  const TriangleMesh mesh = torus_with_seam();
  const std::vector<double>& uv = mesh.attributes[0].values;
  TriangleMesh doubled;
  doubled.attributes = {{"texcoord", Site::vertex, Type::float32, 2}};
  std::map<std::array<double, 3>, Index> known;  // vertex, u, v
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle& corners = doubled.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const double *value = uv.data() + 2 * (3 * t + k), v = mesh.triangles[t][k];
      const auto [entry, fresh] =
          known.try_emplace({v, value[0], value[1]}, static_cast<Index>(doubled.vertices.size()));
      if (fresh) {
        doubled.vertices.push_back(mesh.vertices[mesh.triangles[t][k]]);
        doubled.attributes[0].values.insert(doubled.attributes[0].values.end(), value, value + 2);
      }
      corners[k] = entry->second;
    }
  }
  return doubled;
}

// Triangles that cross the seam.
TriangleMesh turned_torus() {
  TriangleMesh mesh = torus(37, 15);
  for (Vec3& p : mesh.vertices)
    p = {std::cos(1.0) * p.x - std::sin(1.0) * p.y, std::sin(1.0) * p.x + std::cos(1.0) * p.y, p.z};
  return mesh;
}

TEST(Attributes, NoTriangleIsStretchedAcrossASeam) {
  for (const TriangleMesh& from : {torus_with_seam(), torus_with_doubled_vertices()}) {
    const TriangleMesh result = carried(from, turned_torus());
    ASSERT_EQ(result.attributes.size(), 1u);
    EXPECT_EQ(result.attributes[0].site, Site::corner);
    EXPECT_EQ(carried_attributes(from)[0].site, Site::corner);
    const std::vector<double>& uv = result.attributes[0].values;
    ASSERT_EQ(uv.size(), 6 * result.triangles.size());
    std::size_t across = 0;
    for (std::size_t t = 0; t < result.triangles.size(); ++t) {
      const auto [least, most] = std::minmax({uv[6 * t], uv[6 * t + 2], uv[6 * t + 4]});
      EXPECT_LT(most - least, 2.0 / 37);
      const Triangle& v = result.triangles[t];
      const auto [low, high] =
          std::minmax({turns(result.vertices[v[0]]), turns(result.vertices[v[1]]), turns(result.vertices[v[2]])});
      across += high - low > 0.5;
      for (std::size_t k = 0; k < 3; ++k) {
        const double off = uv[6 * t + 2 * k] - turns(result.vertices[v[k]]);
        // A corner beyond the seam has what the chart has at its border.
        EXPECT_NEAR(std::remainder(off, 1.0), 0, high - low > 0.5 ? 1.0 / 37 : 0.002);
      }
    }
    EXPECT_GT(across, 10u);
  }
}

TEST(Attributes, TextureWithoutDoubledVerticesStaysOfVertices) {
  TriangleMesh mesh = wavy_patch(8);
  mesh.attributes = {{"uv", Site::vertex, Type::float32, 2}};
  for (const Vec3& p : mesh.vertices) mesh.attributes[0].values.insert(mesh.attributes[0].values.end(), {p.x, p.y});
  EXPECT_EQ(carried_attributes(mesh)[0].site, Site::vertex);
  EXPECT_EQ(carried(mesh, points_of({{0.3, 0.4, 0}})).attributes[0].site, Site::vertex);
}

TEST(Attributes, OfTetrahedraInsideAndOutside) {
  TetMesh solid = shaken(tet_box(4), 0.03, 9);
  Attribute number{"number", Site::element, Type::int32, 1, std::vector<double>(solid.tets.size())};
  std::iota(number.values.begin(), number.values.end(), 0);
  solid.attributes = {coordinates(solid.vertices), number};
  TetMesh result;
  result.vertices = seeds_about(solid, 300, 0.2, 4);
  result.vertices.insert(result.vertices.end(), solid.vertices.begin(), solid.vertices.end());
  result.tets = solid.tets;
  for (Tetrahedron& t : result.tets)
    for (Index& v : t) v += 300;
  const SolidMap map = map_to_solid(result.vertices, solid);
  carry_attributes(solid, map, result);
  const TriangleMesh boundary = boundary_surface(solid);
  const NearestOnMesh nearest(boundary);
  std::size_t outside = 0;
  for (std::size_t i = 0; i < result.vertices.size(); ++i) {
    const Vec3 p = result.vertices[i], found = at(result.attributes[0], i);
    const std::array<double, 4>& w = map.weights[i];
    EXPECT_GE(*std::min_element(w.begin(), w.end()), 0);
    EXPECT_NEAR(w[0] + w[1] + w[2] + w[3], 1, 1e-14);
    if (norm(found - p) < 1e-9) continue;
    ++outside;
    EXPECT_NEAR(norm(found - p), norm(nearest.nearest(p).point - p), 1e-9);
  }
  EXPECT_GT(outside, 50u);
  EXPECT_LT(outside, 300u);
  for (std::size_t v = 0; v < solid.vertices.size(); ++v)
    EXPECT_EQ(at(result.attributes[0], 300 + v), solid.vertices[v]);
  EXPECT_EQ(result.attributes[1].values, number.values);
}

TEST(Attributes, OfASurfaceToAllVerticesOfTetrahedra) {
  TetMesh solid = tet_box(4);
  TriangleMesh surface = boundary_surface(solid);
  surface.attributes = {coordinates(surface.vertices),
                        {"area", Site::element, Type::float64, 1, std::vector<double>(surface.triangles.size())}};
  carry_attributes(surface, map_to_surface(solid.vertices, surface), solid);
  ASSERT_EQ(solid.attributes.size(), 1u);
  for (std::size_t v = 0; v < solid.vertices.size(); ++v) {
    const Vec3 p = solid.vertices[v], off = at(solid.attributes[0], v) - p;
    const double depth = std::min({p.x, p.y, p.z, 1 - p.x, 1 - p.y, 1 - p.z});
    EXPECT_NEAR(norm(off), depth, 1e-12);
  }
}

TEST(Attributes, WhatIsRefused) {
  TriangleMesh mesh = grid_patch(2, 2), to = mesh;
  mesh.attributes = {{"short", Site::vertex, Type::float64, 1, {1, 2}}};
  EXPECT_THROW(carry_attributes(mesh, map_to_surface(to.vertices, mesh), to), Error);
  mesh.attributes = {};
  EXPECT_THROW(carry_attributes(mesh, {}, to), Error);
  EXPECT_THROW(map_to_surface(to.vertices, TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}), Error);
  EXPECT_THROW(map_to_solid(to.vertices, TetMesh{}), Error);
  std::atomic<bool> cancel = true;
  Context context;
  context.cancel = &cancel;
  EXPECT_THROW(map_to_surface(to.vertices, mesh, context), Cancelled);
  EXPECT_THROW(map_to_solid(to.vertices, tet_box(1), context), Cancelled);
}

}  // namespace
}  // namespace bisector::test
