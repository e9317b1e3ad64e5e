#include "segment/planar_patch.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_data_structure_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>

namespace bisector {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<Index, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Delaunay = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::No_constraint_intersection_tag>;
using Edge = std::array<Index, 2>;

// All edges of the loops in their direction; empty if one occurs twice.
std::set<Edge> directed_edges(const std::vector<std::vector<Index>>& loops) {
  std::set<Edge> edges;
  for (const std::vector<Index>& loop : loops)
    for (std::size_t i = 0; i < loop.size(); ++i)
      if (!edges.insert({loop[i], loop[(i + 1) % loop.size()]}).second) return {};
  return edges;
}

// False if two vertices are at the same point or two edges cross.
bool insert_edges(const std::set<Edge>& edges, const std::vector<std::array<double, 2>>& points,
                  std::map<Index, Delaunay::Vertex_handle>& vertices, Delaunay& delaunay) {
  for (const Edge& e : edges) vertices.try_emplace(e[0]);
  for (auto& [index, vertex] : vertices) {
    vertex = delaunay.insert({points[index][0], points[index][1]});
    vertex->info() = index;
  }
  if (delaunay.number_of_vertices() != vertices.size()) return false;
  try {
    for (const Edge& e : edges) delaunay.insert_constraint(vertices[e[0]], vertices[e[1]]);
  } catch (const Delaunay::Intersection_of_constraints_exception&) {
    return false;
  }
  return true;
}

// The face to the left of an edge, null if it is none of the triangulation.
Delaunay::Face_handle face_left_of(const Delaunay& delaunay, Delaunay::Vertex_handle from, Delaunay::Vertex_handle to) {
  Delaunay::Face_handle face;
  int k = 0;
  if (!delaunay.is_edge(from, to, face, k)) return {};
  return face->vertex(Delaunay::ccw(k)) == from ? face : face->neighbor(k);
}

}  // namespace

std::vector<Triangle> triangulate_loops(const std::vector<std::vector<Index>>& loops,
                                        const std::vector<std::array<double, 2>>& points) {
  const std::set<Edge> edges = directed_edges(loops);
  Delaunay delaunay;
  std::map<Index, Delaunay::Vertex_handle> vertices;
  if (edges.empty() || !insert_edges(edges, points, vertices, delaunay)) return {};

  std::vector<Delaunay::Face_handle> stack;
  for (const Edge& e : edges) stack.push_back(face_left_of(delaunay, vertices[e[0]], vertices[e[1]]));
  std::set<Delaunay::Face_handle> inside;
  while (!stack.empty()) {
    const Delaunay::Face_handle face = stack.back();
    stack.pop_back();
    if (face == nullptr || delaunay.is_infinite(face)) return {};
    if (!inside.insert(face).second) continue;
    for (int k = 0; k < 3; ++k)
      if (!face->is_constrained(k)) stack.push_back(face->neighbor(k));
  }

  std::vector<Triangle> triangles;
  std::size_t border = 0;
  for (const Delaunay::Face_handle& face : inside) {
    Triangle& t = triangles.emplace_back();
    for (int k = 0; k < 3; ++k) t[static_cast<std::size_t>(k)] = face->vertex(k)->info();
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    for (int k = 0; k < 3; ++k) {
      if (!face->is_constrained(k)) continue;
      ++border;
      if (!edges.contains({face->vertex(Delaunay::ccw(k))->info(), face->vertex(Delaunay::cw(k))->info()})) return {};
    }
  }
  std::sort(triangles.begin(), triangles.end());
  // Loops apart from each other would give several pieces, and nested ones of the same direction too few triangles.
  const bool is_one = triangles.size() + 4 == edges.size() + 2 * loops.size();
  return border == edges.size() && is_one ? triangles : std::vector<Triangle>{};
}

}  // namespace bisector
