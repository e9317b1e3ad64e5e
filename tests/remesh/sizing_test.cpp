#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "features/size_field.h"
#include "mesh/topology.h"
#include "remesh/remesh.h"
#include "remesh/sizing.h"
#include "support/models.h"

namespace bisector::test {
namespace {

double area_of(const TriangleMesh& mesh, std::size_t t) {
  const auto [a, b, c] = mesh.triangles[t];
  return triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
}

std::vector<double> lengths_of(const Sizing& sizing, const TriangleMesh& mesh) {
  std::vector<double> lengths;
  for (Index v = 0; v < mesh.vertices.size(); ++v) lengths.push_back(target_edge_length(sizing, v));
  return lengths;
}

// A density that falls a thousandfold from one corner of the box to the other.
std::vector<double> falling(const TriangleMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  std::vector<double> rho;
  for (const Vec3& p : mesh.vertices) rho.push_back(std::pow(10.0, -3 * norm(p - box.lo) / box.diagonal()));
  return rho;
}

SizingOptions attribute(std::vector<double> rho, double gradation) {
  SizingOptions options;
  options.kind = DensityKind::attribute;
  options.attribute = std::move(rho);
  options.gradation = gradation;
  return options;
}

// An equilateral triangle of side n, cut into unit ones.
TriangleMesh equilateral(int n) {
  TriangleMesh mesh;
  const auto at = [&](int i, int j) { return static_cast<Index>(j * (2 * n + 3 - j) / 2 + i); };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) mesh.vertices.push_back({i + 0.5 * j, 0.5 * std::sqrt(3.0) * j, 0});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 1 < n) mesh.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TEST(SizingEstimate, CountsEquilateralTriangles) {
  // Exact up to the Euler characteristic.
  for (const int n : {4, 30}) {
    const TriangleMesh mesh = equilateral(n);
    const MeshEstimate e = estimate_mesh(mesh, Sizing{{}, 1.0, 0});
    EXPECT_NEAR(e.vertices, static_cast<double>(mesh.vertices.size()) - 1, 1e-9 * e.vertices);
    EXPECT_NEAR(e.mean_edge, 1, 1e-12);
  }
}

TEST(SizingEstimate, OfADensityIsItsIntegral) {
  // rho = 1 + 3 x on the unit square: the integrals of its square and fourth root, and of the latter around the border.
  TriangleMesh mesh = grid_patch(16, 16);
  Sizing sizing{{}, 0.1, 0};
  for (Vec3& p : mesh.vertices) {
    p = (1.0 / 16) * p;
    sizing.density.push_back(1 + 3 * p.x);
  }
  const double square = 14.0 / 9, fourth = 4.0 / 15 * (std::pow(4, 1.25) - 1);
  const double border = 2 * fourth + 1 + std::numbers::sqrt2;
  const MeshEstimate e = estimate_mesh(mesh, sizing);
  EXPECT_NEAR(e.vertices, 2 / std::sqrt(3.0) * square * 100 + 0.5 * border * 10, 1e-3);
  EXPECT_NEAR(e.mean_edge, 0.1 * fourth / square, 1e-6);
}

TEST(Sizing, CountsAndLengthsAgree) {
  for (const TriangleMesh& mesh : {icosphere(3), wavy_patch(12)}) {
    for (const auto& options : {SizingOptions{}, attribute(falling(mesh), 0), attribute(falling(mesh), 0.1)}) {
      const Sizing by_count = compute_sizing(mesh, options, {3000, 0});
      const MeshEstimate e = estimate_mesh(mesh, by_count);
      EXPECT_EQ(by_count.vertices, 3000u);
      EXPECT_NEAR(e.vertices, 3000, 10);
      const Sizing by_length = compute_sizing(mesh, options, {0, e.mean_edge});
      EXPECT_NEAR(static_cast<double>(by_length.vertices), 3000, 20);
      EXPECT_NEAR(estimate_mesh(mesh, by_length).mean_edge, e.mean_edge, 2e-3 * e.mean_edge);
      EXPECT_EQ(by_length.density.empty(), options.kind == DensityKind::uniform);
    }
  }
}

TEST(Sizing, LengthIsTheFourthRootOfDensity) {
  const TriangleMesh mesh = icosphere(3);
  const std::vector<double> rho = falling(mesh);
  const std::vector<double> h = lengths_of(compute_sizing(mesh, attribute(rho, 0), {500, 0}), mesh);
  for (std::size_t v = 0; v < h.size(); ++v)
    EXPECT_NEAR(std::pow(h[v] / h[0], -4), rho[v] / rho[0], 1e-9 * rho[v] / rho[0]);
  // The attribute's unit is the user's.
  std::vector<double> other = rho;
  for (double& x : other) x *= 1e30;
  const std::vector<double> same = lengths_of(compute_sizing(mesh, attribute(other, 0), {500, 0}), mesh);
  for (std::size_t v = 0; v < h.size(); ++v) EXPECT_NEAR(same[v], h[v], 1e-9 * h[v]);
}

TEST(Sizing, LengthsOnATriangleLieBetweenThoseOfItsCorners) {
  const TriangleMesh mesh = icosphere(2);
  const Sizing sizing = compute_sizing(mesh, attribute(falling(mesh), 0), {500, 0});
  for (Index t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    EXPECT_DOUBLE_EQ(target_edge_length(sizing, mesh, t, {0, 1, 0}), target_edge_length(sizing, b));
    const double middle = target_edge_length(sizing, mesh, t, {0.25, 0.25, 0.5});
    const auto [low, high] =
        std::minmax({target_edge_length(sizing, a), target_edge_length(sizing, b), target_edge_length(sizing, c)});
    EXPECT_GE(middle, low * (1 - 1e-12));
    EXPECT_LE(middle, high * (1 + 1e-12));
  }
}

TEST(SizingGradation, IsTheLargestLipschitzFunctionBelow) {
  SplitMix64 random(3);
  std::vector<Vec3> points;
  std::vector<double> lengths;
  for (int i = 0; i < 1500; ++i) {
    points.push_back({random.unit(), random.unit(), i % 3 == 0 ? 0.0 : random.unit()});
    lengths.push_back(std::exp(random.range(-6, 0)));
  }
  points[7] = points[100];
  for (const double g : {0.01, 0.3, 5.0}) {
    const std::vector<double> limited = limit_gradation(points, lengths, g);
    for (std::size_t i = 0; i < points.size(); ++i) {
      double least = lengths[i];
      for (std::size_t k = 0; k < points.size(); ++k)
        least = std::min(least, lengths[k] + g * norm(points[i] - points[k]));
      EXPECT_DOUBLE_EQ(limited[i], least);
    }
  }
  EXPECT_TRUE(limit_gradation({}, {}, 0.2).empty());
}

TEST(SizingGradation, HoldsForTheResult) {
  const TriangleMesh mesh = box(8);
  std::vector<double> rho(mesh.vertices.size(), 1);
  rho[5] = 1e6;
  const std::vector<double> h = lengths_of(compute_sizing(mesh, attribute(rho, 0.15), {2000, 0}), mesh);
  double steepest = 0;
  for (std::size_t i = 0; i < h.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      steepest = std::max(steepest, std::abs(h[i] - h[k]) / norm(mesh.vertices[i] - mesh.vertices[k]));
  EXPECT_NEAR(steepest, 0.15, 1e-9);
}

TEST(SizingBounds, AreKeptAndTheCountIsMet) {
  const TriangleMesh mesh = icosphere(4);
  SizingOptions options = attribute(falling(mesh), 0.2);
  const std::vector<double> free = lengths_of(compute_sizing(mesh, options, {1000, 0}), mesh);
  const auto [low, high] = std::minmax_element(free.begin(), free.end());
  options.min_edge = 1.2 * *low;
  options.max_edge = 0.9 * *high;
  const double middle = 0.5 * (options.min_edge + options.max_edge);
  for (const SizingTarget& target : {SizingTarget{1000, 0}, SizingTarget{0, middle}}) {
    const Sizing sizing = compute_sizing(mesh, options, target);
    const std::vector<double> h = lengths_of(sizing, mesh);
    EXPECT_NEAR(*std::min_element(h.begin(), h.end()), options.min_edge, 1e-9);
    EXPECT_NEAR(*std::max_element(h.begin(), h.end()), options.max_edge, 1e-9);
    const MeshEstimate e = estimate_mesh(mesh, sizing);
    if (target.vertices) {
      EXPECT_NEAR(e.vertices, 1000, 4);
    } else {
      EXPECT_NEAR(e.mean_edge, target.edge_length, 2e-3 * target.edge_length);
    }
  }
}

TEST(SizingBounds, ThatCannotBeMetAreRefused) {
  const TriangleMesh mesh = icosphere(2);
  for (const bool uniform : {true, false}) {
    SizingOptions options = uniform ? SizingOptions{} : attribute(falling(mesh), 0.2);
    const double h = compute_sizing(mesh, SizingOptions{}, {1000, 0}).unit_edge;
    options.min_edge = 1.1 * h;
    EXPECT_THROW(compute_sizing(mesh, options, {1000, 0}), Error);
    EXPECT_THROW(refine_for_density(mesh, options, {0, h}), Error);
    EXPECT_NO_THROW(compute_sizing(mesh, options, {800, 0}));
    options.min_edge = 0;
    options.max_edge = 0.9 * h;
    EXPECT_THROW(compute_sizing(mesh, options, {1000, 0}), Error);
    EXPECT_NO_THROW(compute_sizing(mesh, options, {1300, 0}));
    options.min_edge = h;
    EXPECT_THROW(compute_sizing(mesh, options, {1000, 0}), Error);
  }
}

TEST(Sizing, RefusesBadValues) {
  const TriangleMesh mesh = icosphere(0);
  const SizingOptions plain;
  EXPECT_THROW(compute_sizing(mesh, plain, {0, 0}), Error);
  EXPECT_THROW(compute_sizing(mesh, plain, {10, 0.1}), Error);
  EXPECT_THROW(compute_sizing(mesh, plain, {0, -1}), Error);
  EXPECT_THROW(compute_sizing(mesh, plain, {0, NAN}), Error);
  EXPECT_THROW(compute_sizing({}, plain, {10, 0}), Error);
  EXPECT_THROW(compute_sizing(mesh, attribute({}, 0), {10, 0}), Error);
  EXPECT_THROW(compute_sizing(mesh, attribute(std::vector<double>(12, 0), 0), {10, 0}), Error);
  EXPECT_THROW(compute_sizing(mesh, attribute(std::vector<double>(12, NAN), 0), {10, 0}), Error);
  EXPECT_THROW(compute_sizing(mesh, attribute(std::vector<double>(12, 1), -1), {10, 0}), Error);
  SizingOptions options;
  options.exponent = -1;
  EXPECT_THROW(compute_sizing(mesh, options, {10, 0}), Error);
}

TEST(Sizing, OfPlanesIsUniform) {
  // No curvature, and a medial axis nowhere.
  const TriangleMesh mesh = grid_patch(10, 10);
  for (const DensityKind kind : {DensityKind::lfs, DensityKind::curvature}) {
    SizingOptions options;
    options.kind = kind;
    for (const double density : compute_sizing(mesh, options, {500, 0}).density) EXPECT_NEAR(density, 1, 1e-9);
  }
}

TEST(Sizing, SharpEdgesHaveNoCurvature) {
  const TriangleMesh mesh = box(16);
  SizingOptions options;
  options.kind = DensityKind::curvature;
  const auto spread = [&] {
    const std::vector<double> rho = compute_sizing(mesh, options, {500, 0}).density;
    return *std::max_element(rho.begin(), rho.end()) / *std::min_element(rho.begin(), rho.end());
  };
  EXPECT_GT(spread(), 1.5);
  options.sharp = edge_table(mesh.triangles, mesh.vertices.size()).edges;
  EXPECT_NEAR(spread(), 1, 1e-9);
}

TEST(Sizing, FollowsFeatureSizeAndCurvature) {
  // Two spheres of radii 1 and 4: rho = 1/lfs^2 and |kappa| give length ratios of 2 and of the square root of 2.
  TriangleMesh mesh = icosphere(4);
  const auto n = static_cast<Index>(mesh.vertices.size());
  const TriangleMesh other = icosphere(4);
  for (const Vec3& p : other.vertices) mesh.vertices.push_back(4 * p + Vec3{20, 0, 0});
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({a + n, b + n, c + n});
  for (const auto& [kind, ratio] : {std::pair{DensityKind::lfs, 2.0}, {DensityKind::curvature, std::numbers::sqrt2}}) {
    SizingOptions options;
    options.kind = kind;
    const std::vector<double> h = lengths_of(compute_sizing(mesh, options, {1800, 0}), mesh);
    for (Index v = 0; v < n; ++v) EXPECT_NEAR(h[v + n] / h[v], ratio, 0.05 * ratio);
    options.exponent = kind == DensityKind::lfs ? 4 : 2;
    const std::vector<double> squared = lengths_of(compute_sizing(mesh, options, {1800, 0}), mesh);
    EXPECT_NEAR(squared[n] / squared[0], ratio * ratio, 0.1 * ratio * ratio);
  }
}

TEST(Sizing, IsTheSameWithAnyNumberOfThreads) {
  for (const DensityKind kind : {DensityKind::lfs, DensityKind::curvature}) {
    const auto densities = [&](unsigned threads) {
      const ThreadLimit limit(threads);
      SizingOptions options;
      options.kind = kind;
      return refine_for_density(torus(40, 20), options, {1000, 0}).sizing.density;
    };
    EXPECT_EQ(densities(1), densities(4));
  }
}

TEST(SizingRefinement, OfAUniformDensityIsNone) {
  const TriangleMesh mesh = box(1);
  const SizedMesh sized = refine_for_density(mesh, {}, {5000, 0});
  EXPECT_EQ(sized.mesh.triangles, mesh.triangles);
  EXPECT_TRUE(sized.splits.empty());
  EXPECT_TRUE(sized.mesh.face_of_triangle.empty());
  EXPECT_TRUE(sized.sizing.density.empty());
}

// What holds for every refined mesh.
void check_refinement(const TriangleMesh& mesh, const SizedMesh& sized) {
  const TriangleMesh& fine = sized.mesh;
  ASSERT_EQ(sized.parent.size(), fine.triangles.size());
  ASSERT_EQ(sized.sizing.density.size(), fine.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) EXPECT_EQ(fine.vertices[v], mesh.vertices[v]);

  // Triangles tile their parents and keep their normals and faces.
  std::vector<double> area(mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < fine.triangles.size(); ++t) {
    const Index p = sized.parent[t];
    area[p] += area_of(fine, t);
    const auto normal = [](const TriangleMesh& m, const Triangle& v) {
      return cross(m.vertices[v[1]] - m.vertices[v[0]], m.vertices[v[2]] - m.vertices[v[0]]);
    };
    EXPECT_GE(dot(normal(fine, fine.triangles[t]), normal(mesh, mesh.triangles[p])), 0);
    const Index face = mesh.face_of_triangle.empty() ? p : mesh.face_of_triangle[p];
    EXPECT_EQ(fine.face_of_triangle[t], face);
  }
  for (std::size_t t = 0; t < area.size(); ++t) EXPECT_NEAR(area[t], area_of(mesh, t), 1e-12 * (1 + area_of(mesh, t)));

  // No T-junctions: they would open the surface.
  const MeshTopology before = analyse_topology(mesh.triangles, mesh.vertices.size());
  const MeshTopology after = analyse_topology(fine.triangles, fine.vertices.size());
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.closed, before.closed);
  EXPECT_EQ(after.manifold, before.manifold);
  EXPECT_EQ(after.oriented, before.oriented);

  // Every input edge is a chain of edges that are as long together.
  std::map<std::array<Index, 2>, int> edges;
  for (const auto& e : edge_table(fine.triangles, fine.vertices.size()).edges) edges[e] = 1;
  for (const auto& [a, b] : edge_table(mesh.triangles, mesh.vertices.size()).edges) {
    const std::vector<Index> chain = edge_chain(sized.splits, a, b);
    ASSERT_GE(chain.size(), 2u);
    EXPECT_EQ(chain.front(), a);
    EXPECT_EQ(chain.back(), b);
    double length = 0;
    for (std::size_t i = 1; i < chain.size(); ++i) {
      EXPECT_TRUE(edges.count({std::min(chain[i - 1], chain[i]), std::max(chain[i - 1], chain[i])}));
      length += norm(fine.vertices[chain[i]] - fine.vertices[chain[i - 1]]);
    }
    EXPECT_NEAR(length, norm(mesh.vertices[b] - mesh.vertices[a]), 1e-12 * length);
    std::vector<Index> back = edge_chain(sized.splits, b, a);
    std::reverse(back.begin(), back.end());
    EXPECT_EQ(back, chain);
  }
}

TEST(SizingRefinement, IsTheSameSurface) {
  TriangleMesh faces = box(1);
  for (Index t = 0; t < faces.triangles.size(); ++t) faces.face_of_triangle.push_back(t / 2);
  for (const TriangleMesh& mesh : {box(1), faces, pages(), wavy_patch(3), two_spheres(), torus(8, 5)}) {
    std::vector<double> steep = falling(mesh);
    for (double& rho : steep) rho *= rho * rho * rho;
    const SizedMesh sized = refine_for_density(mesh, attribute(steep, 2), {3000, 0});
    EXPECT_GT(sized.splits.size(), 0u);
    check_refinement(mesh, sized);
  }
}

TEST(SizingRefinement, ResolvesTheField) {
  // Edges of a cube have no feature size and the middle of its sides much, which the cube's corners cannot tell.
  SizingOptions options;
  options.kind = DensityKind::lfs;
  const SizedMesh sized = refine_for_density(box(1), options, {1000, 0});
  check_refinement(box(1), sized);
  const std::vector<double> h = lengths_of(sized.sizing, sized.mesh);
  const auto [low, high] = std::minmax_element(h.begin(), h.end());
  EXPECT_GT(*high, 1.5 * *low);
  for (const auto& [a, b] : edge_table(sized.mesh.triangles, sized.mesh.vertices.size()).edges) {
    const double length = norm(sized.mesh.vertices[b] - sized.mesh.vertices[a]);
    // The last calibration moves all lengths by what settles them.
    EXPECT_LE(length, 2.05 * std::min(h[a], h[b]));
    const double ratio = std::pow(std::max(h[a], h[b]) / std::min(h[a], h[b]), 4);
    EXPECT_TRUE(ratio < 3.1 || length < 0.72 * std::min(h[a], h[b])) << ratio << ' ' << length;
  }
  EXPECT_NEAR(estimate_mesh(sized.mesh, sized.sizing).vertices, 1000, 4);
}

// Short edges around a point of a cube's side, which neither corners nor edges of the input's triangles tell.
TEST(SizingRefinement, IsAsFineAsTheLinearDensityNeeds) {
  const TriangleMesh mesh = box(1);
  const double least = 0.004;
  for (const Vec3& at : {Vec3{0.3, 0.6, 0}, Vec3{0.5, 0.5, 1}, Vec3{1, 0.1, 0.9}}) {
    // Steeper than the field itself may be by default.
    const SizeField bound({at}, {least}, 0.35);
    const SizedMesh sized = refine_for_density(mesh, {}, {5000, 0}, {&bound});
    check_refinement(mesh, sized);
    const std::vector<double> h = lengths_of(sized.sizing, sized.mesh);
    const double most = *std::max_element(h.begin(), h.end());
    SplitMix64 random(1);
    for (const Triangle& t : sized.mesh.triangles)
      for (int k = 0; k < 20; ++k) {
        const double root = std::sqrt(random.unit()), share = random.unit();
        const double weights[3] = {1 - root, root * share, root * (1 - share)};
        Vec3 p{};
        double density = 0;
        for (int m = 0; m < 3; ++m) {
          p += weights[m] * sized.mesh.vertices[t[m]];
          density += weights[m] * std::pow(h[t[m]], -4);
        }
        const double wanted = std::min(most, bound(p));
        // The least of all lengths is between points that are looked at.
        if (wanted < 2 * least) continue;
        // Densities within a factor of 2.5 are lengths within its fourth root.
        EXPECT_NEAR(std::pow(density, -0.25) / wanted, 1, 0.26);
      }
    // With edges of 2 h everywhere there would be thousands.
    EXPECT_LT(sized.mesh.triangles.size(), 800u);
    EXPECT_NEAR(estimate_mesh(sized.mesh, sized.sizing).vertices, 5000, 20);
  }
}

TEST(SizingRefinement, TakesAnySoup) {
  for (const TriangleMesh& mesh : {soup(30, 5), duplicated_triangles(), needles(), collinear_among_good()}) {
    for (const DensityKind kind : {DensityKind::lfs, DensityKind::curvature, DensityKind::attribute}) {
      SizingOptions options = attribute(falling(mesh), 0.2);
      options.kind = kind;
      const SizedMesh sized = refine_for_density(mesh, options, {500, 0});
      EXPECT_LE(sized.mesh.triangles.size(), 400'010u);
      for (const double density : sized.sizing.density) EXPECT_TRUE(density > 0 && std::isfinite(density));
      EXPECT_NEAR(estimate_mesh(sized.mesh, sized.sizing).vertices, 500, 3);
    }
  }
}

TEST(Sizing, IsWhatTheRemesherGives) {
  const TriangleMesh input = torus(48, 24);
  std::vector<double> rho;
  for (const Vec3& p : input.vertices) rho.push_back(std::exp(2.5 * p.x));  // lengths from 1 to 5.6
  for (const bool uniform : {true, false}) {
    const SizingOptions options = uniform ? SizingOptions{} : attribute(rho, 0.2);
    const SizedMesh sized = refine_for_density(input, options, {0, 0.1});
    const Surface surface(sized.mesh, sized.sizing.density);
    CpuBackend backend(surface, NeighbourSource::nearest);
    RemeshOptions remeshing;
    remeshing.vertices = sized.sizing.vertices;
    const RemeshResult result = remesh(backend, {}, plan_of(remeshing));
    EXPECT_NEAR(measure_quality(result.mesh).edge_ave, 0.1, 0.003);
    // Locally, too: each edge beside what is wanted at the input's vertex that is nearest to its middle.
    double fine = 0, coarse = 0, fine_count = 0, coarse_count = 0;
    for (const auto& [a, b] : edge_table(result.mesh.triangles, result.mesh.vertices.size()).edges) {
      const Vec3 p = 0.5 * (result.mesh.vertices[a] + result.mesh.vertices[b]);
      Index nearest = 0;
      for (Index v = 1; v < input.vertices.size(); ++v)
        if (norm2(input.vertices[v] - p) < norm2(input.vertices[nearest] - p)) nearest = v;
      const double length = norm(result.mesh.vertices[b] - result.mesh.vertices[a]);
      const double ratio = length / target_edge_length(sized.sizing, nearest);
      (p.x > 0 ? fine : coarse) += ratio;
      ++(p.x > 0 ? fine_count : coarse_count);
    }
    EXPECT_NEAR(fine / fine_count, 1, 0.04);
    EXPECT_NEAR(coarse / coarse_count, 1, 0.06);
  }
}

}  // namespace
}  // namespace bisector::test
