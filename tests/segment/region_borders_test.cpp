#include "bisector/region_borders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "bisector/error.h"
#include "core/geometry.h"
#include "support/csg.h"
#include "support/models.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

// A segmentation that has the given regions. Surfaces that no test looks at may be anything.
SegmentResult with_regions(std::vector<Index> labels, const std::vector<Primitive>& surfaces) {
  SegmentResult result;
  result.labels = std::move(labels);
  for (const Primitive& surface : surfaces) result.regions.push_back({surface});
  return result;
}

// Loops run along all border half-edges of their region once, chains between two regions are used once by either in
// opposite directions, and each border edge is in one chain. For manifolds that are oriented.
void expect_sound(const TriangleMesh& mesh, const SegmentResult& segmentation, const RegionBorders& borders) {
  ASSERT_EQ(borders.regions.size(), segmentation.regions.size());
  EXPECT_EQ(borders.triangles, mesh.triangles);
  std::map<Edge, Index> region_of;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      region_of[{mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]}] = segmentation.labels[t];
  std::vector<std::set<Edge>> expected(borders.regions.size());
  std::set<Edge> edges;
  for (const auto& [e, region] : region_of) {
    const auto other = region_of.find({e[1], e[0]});
    if (other != region_of.end() && other->second == region) continue;
    expected[region].insert(e);
    edges.insert({std::min(e[0], e[1]), std::max(e[0], e[1])});
  }

  std::vector<std::vector<std::pair<std::size_t, bool>>> uses(borders.chains.size());
  for (std::size_t r = 0; r < borders.regions.size(); ++r) {
    std::set<Edge> found;
    for (const BorderLoop& loop : borders.regions[r].loops) {
      double length = 0;
      for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
        const Edge e{loop.vertices[i], loop.vertices[(i + 1) % loop.vertices.size()]};
        EXPECT_TRUE(found.insert(e).second);
        length += norm(mesh.vertices[e[1]] - mesh.vertices[e[0]]);
      }
      EXPECT_NEAR(loop.length, length, 1e-9 * length);
      std::vector<Index> joined;
      for (const ChainUse& use : loop.chains) {
        std::vector<Index> path = borders.chains[use.chain].vertices;
        if (use.reversed) std::reverse(path.begin(), path.end());
        if (!borders.chains[use.chain].closed) path.pop_back();
        joined.insert(joined.end(), path.begin(), path.end());
        uses[use.chain].push_back({r, use.reversed});
      }
      // A closed chain may start anywhere on the loop of its right side.
      ASSERT_EQ(joined.size(), loop.vertices.size());
      const auto start = std::find(joined.begin(), joined.end(), loop.vertices[0]);
      ASSERT_NE(start, joined.end());
      if (loop.chains.size() == 1 && borders.chains[loop.chains[0].chain].closed)
        std::rotate(joined.begin(), start, joined.end());
      EXPECT_EQ(joined, loop.vertices);
    }
    EXPECT_EQ(found, expected[r]) << "region " << r;
  }

  std::set<Edge> in_chains;
  for (std::size_t k = 0; k < borders.chains.size(); ++k) {
    const BorderChain& chain = borders.chains[k];
    const std::size_t n = chain.vertices.size();
    for (std::size_t i = 0; i < (chain.closed ? n : n - 1); ++i) {
      const Index a = chain.vertices[i], b = chain.vertices[(i + 1) % n];
      EXPECT_TRUE(in_chains.insert({std::min(a, b), std::max(a, b)}).second);
    }
    std::vector<std::pair<std::size_t, bool>> sides{{chain.left, false}};
    if (chain.right != kNone) sides.push_back({chain.right, true});
    EXPECT_EQ(uses[k], sides) << "chain " << k;
    EXPECT_EQ(chain.right == kNone, chain.kind == ChainKind::border);
  }
  EXPECT_EQ(in_chains, edges);
}

SegmentResult true_segmentation(const test::CsgModel& model) { return with_regions(model.labels, model.primitives); }

TEST(RegionBorders, ChainsOfGeneratedPartsPartitionTheBorders) {
  for (const test::CsgModel& model : {test::csg_part(3000, 0, 1), test::turned_part(3000, 0, 1)}) {
    const SegmentResult segmentation = true_segmentation(model);
    const RegionBorders borders = region_borders(model.mesh, segmentation);
    expect_sound(model.mesh, segmentation, borders);
    for (const RegionOutline& region : borders.regions)
      EXPECT_EQ(region.euler, 2 - static_cast<long long>(region.loops.size()));  // disks and rings: no handles
  }
}

TEST(RegionBorders, AnglesAndSensesAreThoseOfThePart) {
  const test::CsgModel model = test::csg_part(6000, 0, 1);
  const SegmentResult segmentation = true_segmentation(model);
  const RegionBorders borders = region_borders(model.mesh, segmentation);
  const Vec3 middle = 0.5 * (bounding_box(model.mesh.vertices).lo + bounding_box(model.mesh.vertices).hi);
  std::size_t tangent = 0;
  for (const BorderChain& chain : borders.chains) {
    const SurfaceType left = type_of(segmentation.regions[chain.left].proxy);
    const SurfaceType right = type_of(segmentation.regions[chain.right].proxy);
    const bool has_torus = left == SurfaceType::torus || right == SurfaceType::torus;
    // The torus alone is tangent to its neighbours.
    EXPECT_EQ(chain.kind, has_torus ? ChainKind::tangent : ChainKind::sharp);
    EXPECT_TRUE(!has_torus || std::abs(chain.surface_angle) < 1e-3);
    // Away from curved surfaces both angles are the same.
    if (left == SurfaceType::plane && right == SurfaceType::plane) {
      EXPECT_NEAR(chain.surface_angle, chain.mesh_angle, 1e-9);
      EXPECT_GT(chain.surface_angle, 0);  // a block is convex
    }
    tangent += has_torus;
  }
  EXPECT_EQ(tangent, 2u);
  for (std::size_t r = 0; r < borders.regions.size(); ++r) {
    const Primitive& surface = segmentation.regions[r].proxy;
    if (const auto* plane = std::get_if<Plane>(&surface)) {
      // The middle of the block is behind its sides.
      const double depth = plane->offset - dot(plane->normal, middle);
      EXPECT_TRUE(std::abs(depth) < 0.2 || borders.regions[r].same_sense == (depth > 0)) << "region " << r;
    } else if (type_of(surface) == SurfaceType::sphere) {
      EXPECT_TRUE(borders.regions[r].same_sense);  // a dome
    } else if (type_of(surface) == SurfaceType::torus) {
      EXPECT_FALSE(borders.regions[r].same_sense);  // a fillet
    }
  }
}

TEST(RegionBorders, OuterLoopsComeFirst) {
  const test::CsgModel model = test::csg_part(3000, 0, 2);
  const SegmentResult segmentation = true_segmentation(model);
  const RegionBorders borders = region_borders(model.mesh, segmentation);
  std::size_t with_holes = 0;
  for (std::size_t r = 0; r < borders.regions.size(); ++r) {
    const RegionOutline& region = borders.regions[r];
    const auto* plane = std::get_if<Plane>(&segmentation.regions[r].proxy);
    if (plane == nullptr) continue;
    EXPECT_TRUE(region.has_outer);
    with_holes += region.loops.size() > 1;
    const Vec3 facing = region.same_sense ? plane->normal : -plane->normal;
    for (std::size_t k = 0; k < region.loops.size(); ++k) {
      const Vec3 area =
          twice_vector_area(region.loops[k].vertices, [&](Index v) -> const Vec3& { return model.mesh.vertices[v]; });
      EXPECT_EQ(dot(area, facing) > 0, k == 0) << "region " << r << ", loop " << k;
    }
  }
  EXPECT_GT(with_holes, 0u);
}

TEST(RegionBorders, OpenMeshesHaveBorderChains) {
  const TriangleMesh mesh = test::grid_patch(4, 2);
  std::vector<Index> labels;
  for (const Triangle& t : mesh.triangles) {
    double x = 0;
    for (const Index v : t) x += mesh.vertices[v].x / 3;
    labels.push_back(x < 2 ? 0 : 1);
  }
  const SegmentResult segmentation = with_regions(labels, {Plane{{0, 0, 1}, 0}, Plane{{0, 0, -1}, 0}});
  const RegionBorders borders = region_borders(mesh, segmentation);
  expect_sound(mesh, segmentation, borders);
  ASSERT_EQ(borders.chains.size(), 3u);
  std::multiset<double> lengths;
  for (const BorderChain& chain : borders.chains) {
    lengths.insert(chain.length);
    EXPECT_NEAR(chain.surface_angle, 0, 1e-12);  // same_sense undoes the opposite normals
  }
  EXPECT_EQ(lengths, (std::multiset<double>{2, 6, 6}));
  EXPECT_NE(borders.regions[0].same_sense, borders.regions[1].same_sense);
}

TEST(RegionBorders, RegionsWithoutBorderAndTouchingThemselves) {
  const TriangleMesh ball = test::icosphere(1);
  const SegmentResult whole = with_regions(std::vector<Index>(ball.triangles.size(), 0), {Sphere{{}, 1}});
  const RegionBorders none = region_borders(ball, whole);
  expect_sound(ball, whole, none);
  EXPECT_TRUE(none.chains.empty());
  EXPECT_EQ(none.regions[0].euler, 2);
  EXPECT_TRUE(none.regions[0].same_sense);

  // Two triangles that meet in a vertex are taken out of a disk of six: the rest touches itself there.
  TriangleMesh fan;
  fan.vertices = {{0, 0, 0}};
  for (int k = 0; k < 6; ++k)
    fan.vertices.push_back({std::cos(k * std::numbers::pi / 3), std::sin(k * std::numbers::pi / 3), 0});
  for (Index k = 0; k < 6; ++k) fan.triangles.push_back({0, 1 + k, 1 + (k + 1) % 6});
  const SegmentResult split = with_regions({0, 1, 1, 0, 1, 1}, {Plane{{0, 0, 1}, 0}, Plane{{0, 0, 1}, 0}});
  const RegionBorders touching = region_borders(fan, split);
  expect_sound(fan, split, touching);
  for (const RegionOutline& region : touching.regions) {
    EXPECT_EQ(region.loops.size(), 2u);  // two pieces each
    EXPECT_EQ(region.euler, 2);
  }
}

TEST(RegionBorders, NonManifoldEdgesAreAChainForEachSide) {
  const TriangleMesh mesh = test::pages();
  std::vector<Index> labels(mesh.triangles.size());
  std::vector<Primitive> surfaces;
  for (std::size_t t = 0; t < labels.size(); ++t) {
    labels[t] = static_cast<Index>(t);
    surfaces.push_back(Plane{{0, 0, 1}, 0});
  }
  const RegionBorders borders = region_borders(mesh, with_regions(labels, surfaces));
  std::size_t seams = 0;
  for (const BorderChain& chain : borders.chains) seams += chain.kind == ChainKind::non_manifold;
  EXPECT_EQ(seams, 3u);
  for (const RegionOutline& region : borders.regions) {
    ASSERT_EQ(region.loops.size(), 1u);
    EXPECT_EQ(region.loops[0].vertices.size(), 3u);
  }
}

TEST(RegionBorders, OtherLabelsAreErrors) {
  const TriangleMesh mesh = test::icosphere(0);
  EXPECT_THROW(region_borders(mesh, with_regions({0}, {Sphere{{}, 1}})), Error);
  EXPECT_THROW(region_borders(mesh, with_regions(std::vector<Index>(20, 1), {Sphere{{}, 1}})), Error);
}

}  // namespace
}  // namespace bisector
