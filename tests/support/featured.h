// Models with feature curves, with seeds on them, and the slope of the energy along whatever a seed is held on.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "core/geometry.h"
#include "cvt/optimise.h"
#include "features/curves.h"
#include "mesh/topology.h"
#include "remesh/feature_seeds.h"
#include "support/models.h"

namespace bisector::test {

// Sharp edges and borders of a generated mesh, as a graph whose corners are the vertices with other than two of them
// and sharp turns: written here so that nothing of what is tested is used.
inline FeatureGraph sharp_graph(const TriangleMesh& mesh) {
  FeatureGraph graph;
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  const auto normal = [&](std::size_t half_edge) {
    const Triangle& t = mesh.triangles[half_edge / 3];
    const Vec3 n = cross(mesh.vertices[t[1]] - mesh.vertices[t[0]], mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    return (1 / norm(n)) * n;
  };
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const std::size_t* h = table.half_edges.begin(e);
    if (table.half_edges.size(e) != 2 || dot(normal(h[0]), normal(h[1])) < 0.8) graph.edges.push_back(table.edges[e]);
  }
  std::vector<std::vector<Index>> around(mesh.vertices.size());
  for (const auto& [a, b] : graph.edges) {
    around[a].push_back(b);
    around[b].push_back(a);
  }
  const auto is_corner = [&](Index v) {
    if (around[v].size() != 2) return true;
    const Vec3 p = mesh.vertices[around[v][0]] - mesh.vertices[v], q = mesh.vertices[around[v][1]] - mesh.vertices[v];
    return dot(p, q) > -0.7 * norm(p) * norm(q);
  };
  for (Index v = 0; v < around.size(); ++v)
    if (!around[v].empty() && is_corner(v)) graph.corners.push_back(v);
  std::set<std::array<Index, 2>> used;
  const auto walk = [&](Index a, Index b) {
    FeatureCurve curve{{a}, false};
    while (true) {
      if (!used.insert({std::min(a, b), std::max(a, b)}).second) break;
      if (b == curve.vertices.front() && !is_corner(b)) {
        curve.closed = true;
        break;
      }
      curve.vertices.push_back(b);
      if (is_corner(b)) break;
      const Index next = around[b][0] == a ? around[b][1] : around[b][0];
      a = b;
      b = next;
    }
    if (curve.vertices.size() > 1) graph.curves.push_back(curve);
  };
  for (Index v : graph.corners)
    for (Index w : around[v]) walk(v, w);
  for (const auto& [a, b] : graph.edges)
    if (!used.contains({a, b})) walk(a, b);
  return graph;
}

// Walls of height 1 over a closed polygon in the plane, with a bottom and a top fanned out from their middle.
inline TriangleMesh prism(const std::vector<std::array<double, 2>>& polygon) {
  TriangleMesh mesh;
  const Index n = static_cast<Index>(polygon.size());
  Vec3 middle;
  for (double z : {0.0, 1.0})
    for (const auto& [x, y] : polygon) {
      mesh.vertices.push_back({x, y, z});
      middle += (0.5 / n) * Vec3{x, y, 0};
    }
  mesh.vertices.push_back(middle);
  mesh.vertices.push_back(middle + Vec3{0, 0, 1});
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    mesh.triangles.push_back({2 * n, j, i});
    mesh.triangles.push_back({2 * n + 1, n + i, n + j});
  }
  return mesh;
}

inline TriangleMesh cylinder(int sides) {
  std::vector<std::array<double, 2>> polygon;
  for (int k = 0; k < sides; ++k)
    polygon.push_back({std::cos(2 * std::numbers::pi * k / sides), std::sin(2 * std::numbers::pi * k / sides)});
  return prism(polygon);
}

// A wedge with an edge of the given angle, in radians.
inline TriangleMesh wedge(double angle) { return prism({{0, 0}, {1, 0}, {std::cos(angle), std::sin(angle)}}); }

struct FeaturedModel {
  const char* name;
  TriangleMesh mesh;
};

inline std::vector<FeaturedModel> featured_models() {
  return {{"box", box(4)},
          {"cylinder", cylinder(48)},
          {"wedge30", wedge(0.5)},
          {"wedge3", wedge(0.05)},
          {"patch", wavy_patch(12)},
          {"pages", pages()},
          {"slab", prism({{0, 0}, {2, 0}, {2, 0.02}, {0, 0.02}})}};
}

// What is known of the seeds of a PlacedProblem.
struct CompletedProblem {
  CvtGradient gradient;
  CellMoments moments;
  double energy = 0, gradient_norm = 0;
};

// A surface with a density and seeds about half of which are held on its features, out of balance in every direction.
struct PlacedProblem {
  PlacedProblem(const TriangleMesh& mesh, std::size_t count)
      : surface(mesh, density_of(mesh)), curves(sharp_graph(mesh), mesh.vertices) {
    const CurveMeasure measure(surface, curves);
    placed = seeds_on_features(curves, measure, measure.scale(count));
    SplitMix64 random(3);
    for (std::size_t i = 0; i < placed.size(); ++i) {
      SeedPlace place = placed.place(i);
      if (place.kind != SeedPlace::Kind::curve) continue;
      place.position = curves.wrap(place.curve, place.position + random.range(-0.01, 0.01));
      placed.put(i, curves.point(place.curve, place.position), place);
    }
    placed.add(random_seeds(mesh, count, 7));
  }

  CompletedProblem completed_on(Backend& backend) const {
    const Context context;
    CvtRun run(backend, curves, context);
    run.seeds = placed;
    CompletedProblem result;
    result.gradient = complete(run, true);
    result.moments = run.diagram().moments;
    result.energy = run.energy;
    result.gradient_norm = run.gradient_norm;
    return result;
  }

  Surface surface;
  FeatureCurves curves;
  PlacedSeeds placed;

 private:
  static std::vector<double> density_of(const TriangleMesh& mesh) {
    std::vector<double> density;
    for (const Vec3& v : mesh.vertices) density.push_back(1 + v.x * v.x + 0.5 * v.y + v.z);
    return density;
  }
};

struct Differences {
  double step;        // of central differences, in lengths of the cell
  double tolerance;   // relative to 2 m length
  std::size_t every;  // seed of each kind is tried, from the first
};

// Along curves, and along two directions of the tangent plane of seeds on the surface, the gradient is the slope of the
// energy; across it is 0.
inline void expect_slopes(Backend& backend, const PlacedProblem& problem, const CompletedProblem& found,
                          const Differences& how) {
  const auto rise = [&](std::size_t i, const Vec3& ahead, const Vec3& behind) {
    std::array<double, 2> energy;
    for (int side : {0, 1}) {
      std::vector<Vec3> moved = problem.placed.positions();
      moved[i] = side ? ahead : behind;
      Diagram diagram;
      backend.evaluate(moved, Want::moments, diagram);
      energy[side] = diagram.moments.energy;
    }
    return energy[1] - energy[0];
  };
  std::array<std::size_t, 3> seen{};
  for (std::size_t i = 0; i < problem.placed.size(); ++i) {
    SCOPED_TRACE("seed " + std::to_string(i));
    const SeedPlace& place = problem.placed.place(i);
    const auto kind = static_cast<std::size_t>(place.kind);
    const Vec3 &x = problem.placed.position(i), &g = found.gradient.vectors[i];
    const Moments& cell = found.moments.cells[i];
    const double length = std::sqrt(cell.second / cell.mass), scale = 2 * cell.mass * length, h = how.step * length;
    if (place.kind == SeedPlace::Kind::fixed) {
      EXPECT_EQ(g, Vec3{});
      continue;
    }
    if (place.kind == SeedPlace::Kind::curve) {
      const FeatureCurves& curves = problem.curves;
      // Not where the step would leave the segment: the slope jumps there.
      const std::size_t k = curves.segment_at(place.curve, place.position);
      if (place.position - h < curves.position_of(place.curve, k) ||
          place.position + h > curves.position_of(place.curve, k + 1))
        continue;
      if (seen[kind]++ % how.every) continue;
      const Vec3 tangent = curves.tangent(place.curve, place.position);
      const Vec3 ahead = curves.point(place.curve, place.position + h),
                 behind = curves.point(place.curve, place.position - h);
      EXPECT_NEAR(dot(g, tangent), rise(i, ahead, behind) / (2 * h), how.tolerance * scale);
      EXPECT_NEAR(norm(g), std::abs(dot(g, tangent)), 1e-14 * scale);
    } else {
      if (seen[kind]++ % how.every) continue;
      const Vec3& n = found.gradient.normals[i];
      const Vec3 across = cross(n, std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
      for (const Vec3& d : {(1 / norm(across)) * across, (1 / norm(across)) * cross(n, across)})
        EXPECT_NEAR(dot(g, d), rise(i, x + h * d, x - h * d) / (2 * h), how.tolerance * scale);
      EXPECT_NEAR(dot(g, n), 0, 1e-14 * scale);
    }
  }
  EXPECT_GT(seen[static_cast<std::size_t>(SeedPlace::Kind::curve)], 5u);
  EXPECT_GT(seen[static_cast<std::size_t>(SeedPlace::Kind::surface)], 50u);
}

}  // namespace bisector::test
