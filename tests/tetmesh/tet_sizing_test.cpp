#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "bisector/error.h"
#include "core/parallel.h"
#include "features/size_field.h"
#include "mesh/locate.h"
#include "mesh/tet_adjacency.h"
#include "support/solids.h"
#include "tetmesh/sample_solid.h"
#include "tetmesh/tet_sizing.h"

namespace bisector::test {
namespace {

TriangleMesh surface_of(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  const auto adjacent = tet_adjacency(mesh.tets);
  for (Index t = 0; t < mesh.tets.size(); ++t)
    for (int k = 0; k < 4; ++k)
      if (adjacent[t][k] == kNone) surface.triangles.push_back(facet_of(mesh.tets[t], k));
  return surface;
}

// Small around the origin, growing by a tenth of the distance.
TetSizingOptions small_at_origin() {
  TetSizingOptions options;
  options.sizes = {{{0, 0, 0}}, {0.02}};
  options.field.gradation = 0.1;
  return options;
}

TEST(TetSizing, UniformLatticeCountsItself) {
  // A body-centred cubic lattice of side a in a large cube: 2 vertices per a^3, edges of mean length 0.9235 a.
  const double a = 0.01, h = a * (8 * std::sqrt(0.75) + 6) / 14;
  EXPECT_NEAR(estimate_tet_vertices(1, 0, h), 2 / (a * a * a), 1e-3 * 2 / (a * a * a));
}

TEST(TetSizing, UniformSizeMeetsTheCountAndBisectsNothing) {
  const TetMesh box = tet_box(2);
  SizingTarget target;
  target.vertices = 5000;
  const SizedSolid sized = refine_for_sizes(box, surface_of(box), {}, target);
  EXPECT_EQ(sized.mesh.tets.size(), box.tets.size());
  EXPECT_TRUE(sized.lengths.empty());
  EXPECT_NEAR(estimate_tet_vertices(1, 6, sized.edge_length), 5000, 1);
}

// Edges near the bound's point are short, the others one length, and the count is met.
TEST(TetSizing, ABoundShortensEdgesNearIt) {
  const TetMesh box = tet_box(6);
  SizingTarget target;
  target.vertices = 5000;
  const SizedSolid plain = refine_for_sizes(box, surface_of(box), {}, target);
  for (const double shorter : {0.2, 0.5}) {
    const SizeField bound({{0, 0, 0}}, {shorter * plain.edge_length}, 0.2);
    const SizedSolid sized = refine_for_sizes(box, surface_of(box), {}, target, &bound);
    ASSERT_EQ(sized.lengths.size(), sized.mesh.vertices.size());
    const double longest = *std::max_element(sized.lengths.begin(), sized.lengths.end());
    // Far from the point tetrahedra are as they were.
    const auto is_one_of_the_box = [&](const Tetrahedron& t) {
      return std::find(box.tets.begin(), box.tets.end(), t) != box.tets.end();
    };
    EXPECT_GT(std::count_if(sized.mesh.tets.begin(), sized.mesh.tets.end(), is_one_of_the_box), 0);
    EXPECT_GT(longest, plain.edge_length);
    EXPECT_LT(longest, 2 * plain.edge_length);
    for (std::size_t v = 0; v < sized.lengths.size(); ++v)
      EXPECT_DOUBLE_EQ(sized.lengths[v], std::min(bound(sized.mesh.vertices[v]), longest));
    double count = 0;
    for (const Tetrahedron& t : sized.mesh.tets) {
      double per_volume = 0;
      for (const Index v : t) per_volume += 0.25 * std::pow(sized.lengths[v], -3);
      const Vec3& p = sized.mesh.vertices[t[0]];
      count += estimate_tet_vertices(dot(sized.mesh.vertices[t[1]] - p,
                                         cross(sized.mesh.vertices[t[2]] - p, sized.mesh.vertices[t[3]] - p)) /
                                         6,
                                     0, 1) *
               per_volume;
    }
    const TriangleMesh surface = surface_of(sized.mesh);
    for (const Triangle& t : surface.triangles) {
      double per_area = 0;
      for (const Index v : t) per_area += std::pow(sized.lengths[v], -2) / 3;
      const Vec3& p = sized.mesh.vertices[t[0]];
      count +=
          estimate_tet_vertices(0, 0.5 * norm(cross(sized.mesh.vertices[t[1]] - p, sized.mesh.vertices[t[2]] - p)), 1) *
          per_area;
    }
    EXPECT_NEAR(count, 5000, 25);
  }
}

TEST(TetSizing, VerticesGrowWhereOtherEdgesMayNotBecomeLonger) {
  const TetMesh box = tet_box(6);
  SizingTarget target;
  target.vertices = 5000;
  const SizedSolid plain = refine_for_sizes(box, surface_of(box), {}, target);
  const SizeField bound({{0, 0, 0}}, {0.2 * plain.edge_length}, 0.2);
  const SizedSolid sized = refine_for_sizes(box, surface_of(box), {}, target, &bound, true);
  EXPECT_GT(sized.vertices, 5000u);
  EXPECT_NEAR(*std::max_element(sized.lengths.begin(), sized.lengths.end()), plain.edge_length, 1e-9);
}

TEST(TetSizing, RefinedSolidIsTheSameSolid) {
  TetMesh box = tet_box(2);
  for (std::size_t t = 0; t < box.tets.size(); ++t) box.regions.push_back(static_cast<int>(t % 3));
  std::vector<double> region_volume(3), refined_volume(3);
  const TriangleMesh surface = surface_of(box);
  box.boundary = surface.triangles;
  for (std::size_t t = 0; t < box.boundary.size(); ++t) box.boundary_labels.push_back(static_cast<int>(t));
  box.feature_edges = {{0, 1}};
  const auto volumes = [](const TetMesh& m, std::vector<double>& sums) {
    for (std::size_t t = 0; t < m.tets.size(); ++t) {
      const auto& [a, b, c, d] = m.tets[t];
      const Vec3 p = m.vertices[a];
      const double v = dot(m.vertices[b] - p, cross(m.vertices[c] - p, m.vertices[d] - p)) / 6;
      EXPECT_GT(v, 0);
      sums[m.regions[t]] += v;
    }
  };
  volumes(box, region_volume);
  SizingTarget target;
  target.vertices = 4000;
  const SizedSolid sized = refine_for_sizes(box, surface, small_at_origin(), target);
  ASSERT_GT(sized.mesh.tets.size(), box.tets.size());
  volumes(sized.mesh, refined_volume);
  for (int r = 0; r < 3; ++r) EXPECT_NEAR(refined_volume[r], region_volume[r], 1e-12);
  // Conforming: tet_adjacency throws if a facet has three; and the outer facets cover the box, so no facet is unmatched
  // inside.
  double area = 0;
  std::size_t outside = 0;
  const TriangleMesh refined = surface_of(sized.mesh);
  for (const auto& [a, b, c] : refined.triangles)
    area += 0.5 * norm(cross(sized.mesh.vertices[b] - sized.mesh.vertices[a],
                             sized.mesh.vertices[c] - sized.mesh.vertices[a]));
  EXPECT_NEAR(area, 6, 1e-12);
  outside = refined.triangles.size();
  // Marks cover the same triangles with their labels.
  EXPECT_EQ(sized.mesh.boundary.size(), outside);
  std::vector<double> marked(surface.triangles.size()), original(surface.triangles.size());
  const auto areas = [](const TetMesh& m, std::vector<double>& sums) {
    for (std::size_t t = 0; t < m.boundary.size(); ++t) {
      const auto& [a, b, c] = m.boundary[t];
      sums[m.boundary_labels[t]] += 0.5 * norm(cross(m.vertices[b] - m.vertices[a], m.vertices[c] - m.vertices[a]));
    }
  };
  areas(box, original);
  areas(sized.mesh, marked);
  for (std::size_t t = 0; t < marked.size(); ++t) EXPECT_NEAR(marked[t], original[t], 1e-14);
  // The feature edge became a chain.
  const std::vector<Index> chain = edge_chain(sized.splits, 0, 1);
  EXPECT_EQ(sized.mesh.feature_edges.size(), chain.size() - 1);
  for (std::size_t k = 1; k < chain.size(); ++k) {
    const std::array<Index, 2> edge{std::min(chain[k - 1], chain[k]), std::max(chain[k - 1], chain[k])};
    EXPECT_TRUE(std::binary_search(sized.mesh.feature_edges.begin(), sized.mesh.feature_edges.end(), edge));
  }
}

TEST(TetSizing, NoEdgeIsLongerThanTwiceTheSizeAndSizesGrowSlowly) {
  const TetMesh box = tet_box(2);
  SizingTarget target;
  target.vertices = 3000;
  const SizedSolid sized = refine_for_sizes(box, surface_of(box), small_at_origin(), target);
  ASSERT_EQ(sized.lengths.size(), sized.mesh.vertices.size());
  for (const Tetrahedron& t : sized.mesh.tets)
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        const double length = norm(sized.mesh.vertices[t[i]] - sized.mesh.vertices[t[j]]);
        const auto [a, b] = std::minmax(sized.lengths[t[i]], sized.lengths[t[j]]);
        EXPECT_LE(length, 2 * a * (1 + 1e-12));
        EXPECT_LE(b - a, 0.1 * length * (1 + 1e-12));
      }
  // The density stands for the sizes: unit^5 = rho h^5.
  const std::vector<double> rho = sized.volume_density(), sigma = sized.surface_density();
  for (std::size_t v = 0; v < rho.size(); ++v) {
    EXPECT_NEAR(std::pow(rho[v], -0.2) * sized.edge_length, sized.lengths[v], 1e-12);
    EXPECT_NEAR(std::pow(sigma[v], -0.25) * sized.edge_length, sized.lengths[v], 1e-12);
  }
  // The count, by an integral that knows nothing of the tetrahedra.
  const SizeField field({{0, 0, 0}}, {sized.lengths[0]}, 0.1);
  double count = 0;
  const int n = 60;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) {
        const double h = field({(i + 0.5) / n, (j + 0.5) / n, (k + 0.5) / n});
        count += estimate_tet_vertices(1, 0, h) / (n * n * n);
      }
      for (double side : {0.0, 1.0}) {
        const double u = (i + 0.5) / n, v = (j + 0.5) / n;
        for (const Vec3& p : {Vec3{side, u, v}, Vec3{u, side, v}, Vec3{u, v, side}})
          count += estimate_tet_vertices(0, 1, field(p)) / (n * n);
      }
    }
  EXPECT_NEAR(count, 3000, 300);
}

TEST(TetSizing, LengthsOfABackgroundAreTakenAsTheyAre) {
  const TetMesh box = tet_box(3);
  TetSizingOptions options;
  options.sizes.points = box.vertices;
  options.sizes.lengths.assign(box.vertices.size(), 0.11);
  options.sizes.tets = box.tets;
  SizingTarget target;
  target.edge_length = 0.11;
  const SizedSolid sized = refine_for_sizes(box, surface_of(box), options, target);
  for (double h : sized.lengths) EXPECT_NEAR(h, 0.11, 2e-3 * 0.11);
}

TEST(TetSizing, AnAttributeIsAVolumeDensity) {
  const TetMesh box = tet_box(3);
  TetSizingOptions options;
  options.field.kind = DensityKind::attribute;
  options.field.gradation = 5;  // no bound in effect
  for (const Vec3& p : box.vertices) options.field.attribute.push_back(std::pow(1 + p.x, -5));
  SizingTarget target;
  target.vertices = 2000;
  const SizedSolid sized = refine_for_sizes(box, surface_of(box), options, target);
  // h is as (1 + x), which is linear.
  for (std::size_t v = 0; v < sized.mesh.vertices.size(); ++v)
    EXPECT_NEAR(sized.lengths[v] / sized.lengths[0], 1 + sized.mesh.vertices[v].x, 1e-9);
}

TEST(TetSizing, RefusesNonsense) {
  const TetMesh box = tet_box(1);
  const TriangleMesh surface = surface_of(box);
  SizingTarget target;
  EXPECT_THROW(refine_for_sizes(box, surface, {}, target), Error);
  target.vertices = 100;
  TetSizingOptions options;
  options.field.gradation = 0;
  EXPECT_THROW(refine_for_sizes(box, surface, options, target), Error);
  options = {};
  options.sizes = {{{0, 0, 0}}, {-1}};
  EXPECT_THROW(refine_for_sizes(box, surface, options, target), Error);
  options.sizes = {{{0, 0, 0}}, {}};
  EXPECT_THROW(refine_for_sizes(box, surface, options, target), Error);
  target = {0, 1e-9};
  EXPECT_THROW(refine_for_sizes(box, surface, {}, target), Error);
}

TEST(SampleSolid, FollowsALinearDensity) {
  const TetMesh box = tet_box(2);
  std::vector<double> density;
  for (const Vec3& p : box.vertices) density.push_back(p.x);
  const std::size_t n = 40'000;
  const std::vector<Vec3> points = sample_solid(box, n, 7, density);
  // E x = 2/3, E x^2 = 1/2; E y = 1/2, E y^2 = 1/3; deviations of order 0.25 / sqrt(n) = 0.00125.
  double x = 0, xx = 0, y = 0, yy = 0;
  for (const Vec3& p : points) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(p[k], 0);
      EXPECT_LE(p[k], 1);
    }
    x += p.x / n;
    xx += p.x * p.x / n;
    y += p.y / n;
    yy += p.y * p.y / n;
  }
  EXPECT_NEAR(x, 2.0 / 3, 0.006);
  EXPECT_NEAR(xx, 0.5, 0.006);
  EXPECT_NEAR(y, 0.5, 0.006);
  EXPECT_NEAR(yy, 1.0 / 3, 0.006);
}

TEST(SampleSolid, UniformMomentsAndThreads) {
  const TetMesh box = tet_box(1);
  const std::size_t n = 40'000;
  const std::vector<Vec3> points = sample_solid(box, n, 1);
  double xx = 0, xy = 0;
  for (const Vec3& p : points) {
    xx += p.x * p.x / n;
    xy += p.x * p.y / n;
  }
  EXPECT_NEAR(xx, 1.0 / 3, 0.006);
  EXPECT_NEAR(xy, 0.25, 0.006);
  const ThreadLimit one(1);
  EXPECT_EQ(sample_solid(box, n, 1), points);
}

TEST(TetLocator, FindsTheTetrahedronOfAPoint) {
  const TetMesh box = tet_box(3);
  const TetLocator locator(box);
  for (Index t = 0; t < box.tets.size(); ++t) {
    Vec3 centre;
    for (Index v : box.tets[t]) centre += 0.25 * box.vertices[v];
    EXPECT_EQ(locator.nearest(centre), t);
  }
  // Outside: a tetrahedron at the nearest corner.
  const Index found = locator.nearest({-0.01, -0.01, -0.01});
  Vec3 centre;
  for (Index v : box.tets[found]) centre += 0.25 * box.vertices[v];
  EXPECT_LT(norm(centre), 0.6);
}

}  // namespace
}  // namespace bisector::test
