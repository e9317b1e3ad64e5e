// Second-order elements in files: their nodes follow the vertices, numbered on.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/attributes.h"
#include "bisector/mesh.h"
#include "bisector/second_order.h"
#include "mesh/attribute_sizes.h"

namespace bisector::io {

// In the order of VTK: edges 01, 12, 20, 03, 13, 23.
inline constexpr std::array<std::array<std::size_t, 2>, 6> kNodeEdges{{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

// What an element consists of: its corners, and after them, where there are nodes, those of its edges.
template <std::size_t N>
std::vector<Index> corners_and_nodes(const std::array<Index, N>& corners, const SecondOrder& order,
                                     std::size_t vertices) {
  std::vector<Index> all(corners.begin(), corners.end());
  if (order.empty()) return all;
  for (std::size_t k = 0; k < N * (N - 1) / 2; ++k)
    all.push_back(static_cast<Index>(vertices) + order.node_of(corners[kNodeEdges[k][0]], corners[kNodeEdges[k][1]]));
  return all;
}

inline std::vector<Vec3> vertices_and_nodes(const TetMesh& mesh, const SecondOrder& order) {
  std::vector<Vec3> points = mesh.vertices;
  points.insert(points.end(), order.nodes.begin(), order.nodes.end());
  return points;
}

// Attributes of vertices at the nodes too: the mean of an edge's ends, or, of integers but colours, that of its first.
inline std::vector<Attribute> attributes_with_nodes(std::vector<Attribute> attributes, const SecondOrder& order) {
  for (Attribute& attribute : attributes) {
    if (attribute.site != Attribute::Site::vertex) continue;
    const bool between = has_fractions(attribute) || meaning_of(attribute) == AttributeMeaning::colour;
    const std::size_t n = attribute.components;
    for (const auto& [a, b] : order.edges)
      for (std::size_t c = 0; c < n; ++c) {
        const double first = attribute.values[n * a + c], second = attribute.values[n * b + c];
        attribute.values.push_back(between ? 0.5 * (first + second) : first);
      }
  }
  return attributes;
}

}  // namespace bisector::io
