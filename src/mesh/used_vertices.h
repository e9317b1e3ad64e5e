// The vertices of a mesh that it has a use for.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// Of so many vertices, marks those that triangles or tetrahedra have as corners, which must be among them.
template <class Element>
std::vector<char> mark_used_vertices(const std::vector<Element>& elements, std::size_t vertices) {
  std::vector<char> used(vertices, 0);
  for (const Element& element : elements)
    for (const Index v : element) used[v] = 1;
  return used;
}

// These, ascending.
template <class Element>
std::vector<Index> used_vertices(const std::vector<Element>& elements, std::size_t vertices) {
  const std::vector<char> used = mark_used_vertices(elements, vertices);
  std::vector<Index> list;
  for (Index v = 0; v < used.size(); ++v)
    if (used[v]) list.push_back(v);
  return list;
}

}  // namespace bisector
