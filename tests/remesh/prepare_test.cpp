// What is done to an input before seeds are placed: cracks that rounding made, and solids that touch.
#include "remesh/prepare.h"

#include <gtest/gtest.h>

#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "core/random.h"
#include "support/models.h"

namespace bisector::test {
namespace {

// Every triangle with vertices of its own, moved by up to `size` along each axis.
TriangleMesh torn(const TriangleMesh& mesh, double size) {
  TriangleMesh soup;
  SplitMix64 random(5);
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<Index>(soup.vertices.size());
    for (const Index v : t) {
      Vec3 p = mesh.vertices[v];
      for (int k = 0; k < 3; ++k) p[k] += random.range(-size, size);
      soup.vertices.push_back(p);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

TEST(JoinBorders, ClosesWhatRoundingOpens) {
  const TriangleMesh sphere = icosphere(3);
  for (const double size : {0.0, 5e-8, 5e-7, 5e-6}) {
    SCOPED_TRACE(size);
    const WeldResult joined = join_borders(torn(sphere, size), {});
    EXPECT_EQ(joined.border_after, 0u);
    EXPECT_EQ(joined.mesh.vertices.size(), sphere.vertices.size());
    EXPECT_EQ(joined.mesh.triangles.size(), sphere.triangles.size());
  }
  EXPECT_GT(join_borders(torn(sphere, 1e-3), {}).border_after, 1000u);
}

TEST(JoinBorders, MovesNothingOfAClosedSurface) {
  TriangleMesh sphere = icosphere(3);
  for (Vec3& p : sphere.vertices) p.z *= 1e-6;
  const WeldResult joined = join_borders(sphere, {});
  EXPECT_EQ(joined.merged_vertices, 0u);
  EXPECT_EQ(joined.mesh.triangles, sphere.triangles);
}

// Two boxes over one edge, with the same vertices there.
TEST(Preparation, SolidsThatTouchAlongAnEdgeAreMeshedApart) {
  TriangleMesh boxes = box(4);
  const std::size_t count = boxes.vertices.size();
  TriangleMesh second = box(4);
  std::vector<Index> names;
  for (Vec3 p : second.vertices) {
    p.x += 1;
    p.y += 1;
    Index name = kNone;
    for (Index v = 0; v < count; ++v)
      if (boxes.vertices[v] == p) name = v;
    if (name == kNone) {
      name = static_cast<Index>(boxes.vertices.size());
      boxes.vertices.push_back(p);
    }
    names.push_back(name);
  }
  for (const Triangle& t : second.triangles) boxes.triangles.push_back({names[t[0]], names[t[1]], names[t[2]]});
  ASSERT_EQ(analyse_topology(boxes.triangles, boxes.vertices.size()).non_manifold_edges, 4u);
  RemeshOptions options;
  options.vertices = 600;
  options.sizing.kind = DensityKind::attribute;
  options.sizing.attribute.assign(boxes.vertices.size(), 1.0);
  std::vector<std::string> warnings;
  Context context;
  context.warning = [&](const std::string& line) { warnings.push_back(line); };
  const RemeshResult result = remesh(boxes, options, context);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_TRUE(result.topology.manifold);
  EXPECT_EQ(result.topology.components, 2u);
  EXPECT_EQ(result.features.broken, 0u);
  EXPECT_GT(measure_quality(result.mesh).theta_min, 30);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("along 4 edges"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace bisector::test
