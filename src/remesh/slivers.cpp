#include "remesh/slivers.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>
#include <vector>

#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/topology.h"
#include "mesh/triangle_quality.h"
#include "remesh/improve_patch.h"

namespace bisector {
namespace {

// Degrees below which a triangle is a sliver; one below the second, or more than that share of slivers, is too many.
constexpr double kSliver = kBadAngle, kWorst = 25;
constexpr double kShare = 1e-3;
// Of the triangles; where more are slivers, other edge lengths are no help.
constexpr double kHopeless = 0.05;
// Edges to be had in a sliver's place, by its height, and at least this part of its own: equilateral triangles have
// 1.15 times their height as edges.
constexpr double kPerHeight = 1.15, kLeast = 0.5;
constexpr double kMuchFewer = 2.0 / 3;
constexpr std::size_t kTrianglesAtOnce = 4096;

}  // namespace

Slivers find_slivers(const TriangleMesh& mesh) {
  const ShapeGoal goal = shape_goal(kSliver, 180);
  const auto corners = [&](std::size_t t) {
    const Triangle& v = mesh.triangles[t];
    return std::array{mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]};
  };
  std::vector<std::vector<std::size_t>> thin((mesh.triangles.size() + kTrianglesAtOnce - 1) / kTrianglesAtOnce);
  parallel_chunks(mesh.triangles.size(), kTrianglesAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto [a, b, d] = corners(t);
      if (shape_excess(a, b, d, goal).under > 0) thin[c].push_back(t);
    }
  });

  Slivers found;
  std::size_t count = 0;
  bool has_bad_one = false;
  for (const std::vector<std::size_t>& chunk : thin)
    for (const std::size_t t : chunk) {
      const std::array<Vec3, 3> p = corners(t);
      const double lack = free_angle_lack(p, edges_among(mesh.triangles[t], mesh.feature_edges), kSliver);
      if (lack == 0) continue;
      double perimeter = 0;
      for (int k = 0; k < 3; ++k) perimeter += norm(p[(k + 1) % 3] - p[k]);
      ++count;
      has_bad_one |= kSliver - lack < kWorst;
      const double height = triangle_height(p[0], p[1], p[2]);
      for (const Vec3& corner : p) {
        found.bounds.points.push_back(corner);
        found.bounds.lengths.push_back(std::max(kPerHeight * height, kLeast * perimeter / 3));
      }
    }
  const double share =
      static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(mesh.triangles.size(), 1));
  found.hopeless = share >= kHopeless;
  found.worth_another_run = (has_bad_one || share > kShare) && !found.hopeless;
  return found;
}

Crossings find_crossings(const TriangleMesh& mesh) {
  Crossings found;
  std::vector<Index> crossing;
  for (const auto& pair : find_self_intersections(mesh)) {
    crossing.insert(crossing.end(), pair.begin(), pair.end());
    ++found.pairs;
  }
  std::sort(crossing.begin(), crossing.end());
  crossing.erase(std::unique(crossing.begin(), crossing.end()), crossing.end());
  for (const Index t : crossing) {
    const Triangle& v = mesh.triangles[t];
    double perimeter = 0;
    for (std::size_t k = 0; k < 3; ++k) perimeter += norm(mesh.vertices[v[(k + 1) % 3]] - mesh.vertices[v[k]]);
    for (const Index corner : v) {
      found.bounds.points.push_back(mesh.vertices[corner]);
      found.bounds.lengths.push_back(kLeast * perimeter / 3);
    }
  }
  return found;
}

JudgedResult judge(RemeshResult result) {
  Slivers slivers = find_slivers(result.mesh);
  return {std::move(result), std::move(slivers)};
}

bool is_better(const JudgedResult& judged, const JudgedResult& than) {
  const auto rank = [](const JudgedResult& j) {
    const RemeshResult& r = j.result;
    return std::tuple(!r.topology_matches, r.features.broken, j.crossings, j.slivers.bounds.points.size());
  };
  return rank(judged) < rank(than);
}

bool is_much_better(const JudgedResult& judged, const JudgedResult& than) {
  const auto rank = [](const JudgedResult& j) {
    return std::tuple(!j.result.topology_matches, j.result.features.broken, j.crossings);
  };
  if (rank(judged) != rank(than)) return rank(judged) < rank(than);
  return static_cast<double>(judged.slivers.bounds.points.size()) <=
         kMuchFewer * static_cast<double>(than.slivers.bounds.points.size());
}

bool is_worse(const JudgedResult& judged, const JudgedResult& than) {
  const auto rank = [](const JudgedResult& j) { return std::pair(!j.result.topology_matches, j.crossings); };
  return rank(than) < rank(judged);
}

}  // namespace bisector
