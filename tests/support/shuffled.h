// The same mesh, listed in another order.
#pragma once

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "support/models.h"

namespace bisector::test {

// With vertices and triangles in another order, and triangles that begin with other corners.
inline TriangleMesh shuffled(const TriangleMesh& mesh, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  const auto any_order = [&](std::size_t n) {
    std::vector<Index> order(n);
    std::iota(order.begin(), order.end(), Index{0});
    for (std::size_t k = n; k > 1; --k) std::swap(order[k - 1], order[random.below(k)]);
    return order;
  };
  const std::vector<Index> place = any_order(mesh.vertices.size());
  TriangleMesh result;
  result.vertices.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < place.size(); ++v) result.vertices[place[v]] = mesh.vertices[v];
  for (const Index t : any_order(mesh.triangles.size())) {
    Triangle corners;
    for (int k = 0; k < 3; ++k) corners[k] = place[mesh.triangles[t][k]];
    std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(random.below(3)), corners.end());
    result.triangles.push_back(corners);
    if (!mesh.labels.empty()) result.labels.push_back(mesh.labels[t]);
  }
  for (const auto& [a, b] : mesh.feature_edges) result.feature_edges.push_back({place[a], place[b]});
  return result;
}

}  // namespace bisector::test
