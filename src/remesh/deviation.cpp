#include "remesh/deviation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "bisector/distance_bound.h"
#include "core/degenerate.h"
#include "core/parallel.h"
#include "features/size_field.h"
#include "remesh/detail.h"

namespace bisector {
namespace {

// Of the distance asked for, the gap between bounds; and of that aimed at, what is near enough to be looked at no
// closer.
constexpr double kGap = 0.1, kNear = 0.4;
// Of the edges there are, at once: distances at corners that are cut are as their length, and the square is wrong
// there.
constexpr double kShortest = 0.35;

double mean_edge(const TriangleMesh& mesh, const Triangle& t) {
  double perimeter = 0;
  for (std::size_t k = 0; k < 3; ++k) perimeter += norm(mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]]);
  return perimeter / 3;
}

// How many times the vertices there are with edges as short as the bounds say, growing from there.
double growth_with(const SizeBounds& bounds, const TriangleMesh& mesh) {
  const SizeField field(bounds.points, bounds.lengths, kDetailGradation);
  std::vector<double> before(mesh.triangles.size()), after(before.size());
  parallel_each(before.size(), [&](std::size_t t) {
    const auto [a, b, c] = mesh.triangles[t];
    const double area = triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    const double length = mean_edge(mesh, mesh.triangles[t]);
    const double shorter =
        std::min(length, field((1.0 / 3) * (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c])));
    before[t] = length > 0 ? area / (length * length) : 0;
    after[t] = shorter > 0 ? area / (shorter * shorter) : 0;
  });
  const auto sum = [](const std::vector<double>& terms) {
    return fixed_sum(terms.size(), [&](std::size_t t) { return terms[t]; });
  };
  const double all = sum(before);
  return all > 0 ? sum(after) / all : 1;
}

}  // namespace

Deviation find_deviation(const TriangleMesh& result, const TriangleMesh& input, double most, double aim,
                         const Context& context) {
  Deviation deviation;
  std::vector<double> off(result.triangles.size(), 0);
  const double near = kNear * aim * most, gap = kGap * most;
  const std::vector<TriangleDistance> forth = bound_distances(result, input, near, gap, context);
  for (std::size_t t = 0; t < off.size(); ++t) off[t] = forth[t].upper;
  for (const TriangleDistance& back : bound_distances(input, result, near, gap, context)) {
    deviation.upper = std::max(deviation.upper, back.upper);
    if (back.upper <= near) continue;
    double& there = off[back.nearest];
    there = std::max(there, back.upper);
  }
  for (std::size_t t = 0; t < off.size(); ++t) {
    deviation.upper = std::max(deviation.upper, off[t]);
    if (off[t] <= near) continue;
    const double share = std::max(std::sqrt(aim * most / off[t]), kShortest);
    for (const Index v : result.triangles[t]) {
      deviation.bounds.points.push_back(result.vertices[v]);
      deviation.bounds.lengths.push_back(share * mean_edge(result, result.triangles[t]));
    }
  }
  if (!deviation.bounds.points.empty()) deviation.growth = growth_with(deviation.bounds, result);
  return deviation;
}

}  // namespace bisector
