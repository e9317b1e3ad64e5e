#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "mesh/topology.h"
#include "support/csg.h"
#include "support/primitive_parameters.h"

namespace bisector::test {
namespace {

struct Generator {
  std::string name;
  CsgModel (*make)(std::size_t, double, std::uint64_t);
  std::map<SurfaceType, std::size_t> least;  // surfaces of each type
};

const Generator kGenerators[] = {{"csg_part",
                                  csg_part,
                                  {{SurfaceType::plane, 3},
                                   {SurfaceType::cylinder, 2},
                                   {SurfaceType::sphere, 1},
                                   {SurfaceType::cone, 2},
                                   {SurfaceType::torus, 1}}},
                                 {"turned_part",
                                  turned_part,
                                  {{SurfaceType::plane, 1},
                                   {SurfaceType::cylinder, 1},
                                   {SurfaceType::sphere, 1},
                                   {SurfaceType::cone, 1},
                                   {SurfaceType::torus, 1}}}};

double area(const TriangleMesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return 0.5 * norm(cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]));
}

// From the definitions.
double offset(const Primitive& primitive, const Vec3& p) {
  const PrimitiveParameters s = parameters_of(primitive);
  const Vec3 d = p - s.centre;
  const double along = dot(d, s.axis), beside = norm(d - along * s.axis);
  switch (s.type) {
    case SurfaceType::plane: return std::abs(along);
    case SurfaceType::sphere: return std::abs(norm(d) - s.radius);
    case SurfaceType::cylinder: return std::abs(beside - s.radius);
    case SurfaceType::cone: return std::abs(beside * std::cos(s.angle) - along * std::sin(s.angle));
    case SurfaceType::torus: return std::abs(std::hypot(beside - s.radius, along) - s.minor_radius);
    default: return 1e9;
  }
}

TEST(CsgModels, AreClosedManifoldsOfTheSizeAskedFor) {
  for (const Generator& generator : kGenerators)
    for (const std::size_t count : {3000, 20000}) {
      SCOPED_TRACE(generator.name);
      const CsgModel model = generator.make(count, 0, 1);
      const TriangleMesh& mesh = model.mesh;
      ASSERT_EQ(model.labels.size(), mesh.triangles.size());
      EXPECT_NEAR(static_cast<double>(mesh.triangles.size()) / static_cast<double>(count), 1, 0.1);
      const MeshTopology topology = analyse_topology(mesh.triangles, mesh.vertices.size());
      EXPECT_TRUE(topology.manifold && topology.closed && topology.oriented);
      EXPECT_EQ(topology.euler, 2);
      EXPECT_EQ(topology.components, 1u);
      EXPECT_TRUE(std::ranges::all_of(label_components(mesh.triangles, mesh.vertices.size()),
                                      [](Index c) { return c == 0; }));  // no vertex is left over
      double volume = 0;
      for (const auto& [a, b, c] : mesh.triangles)
        volume += dot(mesh.vertices[a], cross(mesh.vertices[b], mesh.vertices[c])) / 6;
      EXPECT_GT(volume, 0);
    }
}

TEST(CsgModels, HaveTheirVerticesOnTheirSurfaces) {
  for (const Generator& generator : kGenerators) {
    SCOPED_TRACE(generator.name);
    const CsgModel model = generator.make(5000, 0, 2);
    for (std::size_t t = 0; t < model.labels.size(); ++t)
      for (const Index v : model.mesh.triangles[t])
        EXPECT_LT(offset(model.primitives[model.labels[t]], model.mesh.vertices[v]), 1e-13) << "triangle " << t;
  }
}

TEST(CsgModels, HaveTheSurfacesAndAreasTheySay) {
  for (const Generator& generator : kGenerators) {
    SCOPED_TRACE(generator.name);
    const CsgModel model = generator.make(20000, 0, 3);
    ASSERT_EQ(model.areas.size(), model.primitives.size());
    std::map<SurfaceType, std::size_t> found;
    for (const Primitive& p : model.primitives) ++found[type_of(p)];
    for (const auto& [type, least] : generator.least) EXPECT_GE(found[type], least) << name_of(type);
    std::vector<double> areas(model.areas.size(), 0);
    for (std::size_t t = 0; t < model.labels.size(); ++t) areas[model.labels[t]] += area(model.mesh, t);
    for (std::size_t r = 0; r < areas.size(); ++r) {
      const bool flat = std::holds_alternative<Plane>(model.primitives[r]);
      EXPECT_NEAR(areas[r], model.areas[r], 0.02 * model.areas[r]) << "surface " << r;
      EXPECT_LT(areas[r], (flat ? 1.02 : 1.002) * model.areas[r]) << "surface " << r;
    }
  }
}

TEST(CsgModels, HaveIrregularTrianglesOfSimilarSize) {
  for (const Generator& generator : kGenerators) {
    SCOPED_TRACE(generator.name);
    const CsgModel model = generator.make(20000, 0, 4);
    double total = 0;
    for (std::size_t t = 0; t < model.labels.size(); ++t) total += area(model.mesh, t);
    const double mean = total / static_cast<double>(model.labels.size());
    std::set<double> areas;
    std::size_t odd = 0;
    for (std::size_t t = 0; t < model.labels.size(); ++t) {
      areas.insert(area(model.mesh, t));
      EXPECT_GT(area(model.mesh, t), 0.02 * mean) << "triangle " << t;
      odd += area(model.mesh, t) < 0.25 * mean || area(model.mesh, t) > 3 * mean;
    }
    EXPECT_LT(static_cast<double>(odd), 0.02 * static_cast<double>(model.labels.size()));
    EXPECT_GT(static_cast<double>(areas.size()), 0.9 * static_cast<double>(model.labels.size()));
  }
}

TEST(CsgModels, CarryTheNoiseAskedFor) {
  for (const Generator& generator : kGenerators) {
    SCOPED_TRACE(generator.name);
    const CsgModel clean = generator.make(8000, 0, 5), noisy = generator.make(8000, 1e-3, 5);
    ASSERT_EQ(noisy.mesh.triangles, clean.mesh.triangles);
    const double sigma = 1e-3 * bounding_box(clean.mesh.vertices).diagonal();
    std::set<Index> inner;  // vertices of a single surface, which move by the distance from it
    std::vector<Index> label(clean.mesh.vertices.size(), kNone);
    for (std::size_t t = 0; t < clean.labels.size(); ++t)
      for (const Index v : clean.mesh.triangles[t]) {
        if (label[v] == kNone) inner.insert(v);
        else if (label[v] != clean.labels[t]) inner.erase(v);
        label[v] = clean.labels[t];
      }
    double moved = 0, apart = 0;
    for (const Index v : inner) {
      moved += norm2(noisy.mesh.vertices[v] - clean.mesh.vertices[v]);
      apart += std::pow(offset(clean.primitives[label[v]], noisy.mesh.vertices[v]), 2);
    }
    const auto n = static_cast<double>(inner.size());
    EXPECT_NEAR(std::sqrt(moved / n), sigma, 0.05 * sigma);
    EXPECT_NEAR(std::sqrt(apart / n), sigma, 0.05 * sigma);
  }
}

TEST(CsgModels, DependOnTheSeedAlone) {
  const CsgModel a = csg_part(2000, 1e-3, 7), b = csg_part(2000, 1e-3, 7), c = csg_part(2000, 1e-3, 8);
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_NE(a.mesh.vertices, c.mesh.vertices);
}

}  // namespace
}  // namespace bisector::test
