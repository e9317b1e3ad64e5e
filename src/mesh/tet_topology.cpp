#include "mesh/tet_topology.h"

#include <algorithm>
#include <utility>

#include "bisector/quality.h"
#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "mesh/attribute_sizes.h"
#include "mesh/tet_adjacency.h"
#include "mesh/topology.h"
#include "mesh/used_vertices.h"

namespace bisector {

namespace {

// Calls visit(first, last) for the sides of each facet.
template <class Visit>
void for_each_facet(const std::vector<TetSide>& sides, const Visit& visit) {
  for (std::size_t first = 0, last; first < sides.size(); first = last) {
    for (last = first + 1; last < sides.size() && sides[last].corners == sides[first].corners;) ++last;
    visit(first, last);
  }
}

// The facets whose sides, from first to last, are chosen, as their first tetrahedron has them.
template <class Chosen>
std::vector<Triangle> chosen_facets(const std::vector<Tetrahedron>& tets, const std::vector<TetSide>& sides,
                                    const Chosen& chosen) {
  std::vector<std::size_t> places;
  for_each_facet(sides, [&](std::size_t first, std::size_t last) {
    if (chosen(first, last)) places.push_back(sides[first].at);
  });
  std::sort(places.begin(), places.end());
  std::vector<Triangle> facets;
  for (const std::size_t at : places) facets.push_back(facet_of(tets[at / 4], static_cast<int>(at % 4)));
  return facets;
}

std::vector<Triangle> boundary_of(const std::vector<Tetrahedron>& tets, const std::vector<TetSide>& sides) {
  return chosen_facets(tets, sides, [](std::size_t first, std::size_t last) { return last - first == 1; });
}

void check_vertices(const TetMesh& mesh, TetTopology& topology) {
  std::vector<Index> order = used_vertices(mesh.tets, mesh.vertices.size());
  topology.unused_vertices = mesh.vertices.size() - order.size();
  const auto key = [&](Index v) {
    const Vec3& p = mesh.vertices[v];
    return std::tuple(p.x, p.y, p.z);
  };
  sort_in_parallel(order, [&](Index a, Index b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t i = 1; i < order.size(); ++i)
    if (mesh.vertices[order[i]] == mesh.vertices[order[i - 1]]) ++topology.repeated_vertices;
}

}  // namespace

TetTopology analyse_tet_topology(const TetMesh& mesh) {
  TetTopology topology;
  if (mesh.tets.empty()) return topology;
  const std::vector<TetSide> sides = sorted_sides(mesh.tets);
  DisjointSets<> parts(mesh.tets.size());
  for_each_facet(sides, [&](std::size_t first, std::size_t last) {
    if (last - first > 2) ++topology.overused_facets;
    if (last - first == 2 && sides[first].even == sides[first + 1].even) ++topology.misoriented_facets;
    for (std::size_t s = first + 1; s < last; ++s) parts.join(sides[first].at / 4, sides[s].at / 4);
  });
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) topology.components += parts.is_root(t);
  check_vertices(mesh, topology);
  topology.boundary = analyse_topology(boundary_of(mesh.tets, sides), mesh.vertices.size());
  topology.conforming =
      topology.overused_facets == 0 && topology.misoriented_facets == 0 && topology.repeated_vertices == 0;
  return topology;
}

std::vector<Triangle> boundary_facets(const std::vector<Tetrahedron>& tets) {
  return boundary_of(tets, sorted_sides(tets));
}

std::vector<Triangle> wall_facets(const TetMesh& mesh) {
  if (mesh.regions.empty()) return boundary_facets(mesh.tets);
  const std::vector<TetSide> sides = sorted_sides(mesh.tets);
  return chosen_facets(mesh.tets, sides, [&](std::size_t first, std::size_t last) {
    return last - first == 1 ||
           (last - first == 2 && mesh.regions[sides[first].at / 4] != mesh.regions[sides[first + 1].at / 4]);
  });
}

TriangleMesh boundary_surface(const TetMesh& mesh, std::vector<Index>* vertices) {
  TriangleMesh surface;
  surface.triangles = boundary_facets(mesh.tets);
  if (!mesh.boundary_labels.empty()) {
    std::vector<std::pair<Triangle, std::int32_t>> marks;
    for (std::size_t i = 0; i < mesh.boundary.size(); ++i) {
      Triangle t = mesh.boundary[i];
      std::sort(t.begin(), t.end());
      marks.emplace_back(t, mesh.boundary_labels[i]);
    }
    std::sort(marks.begin(), marks.end());
    for (Triangle t : surface.triangles) {
      std::sort(t.begin(), t.end());
      const auto at = std::lower_bound(marks.begin(), marks.end(), t,
                                       [](const auto& mark, const Triangle& key) { return mark.first < key; });
      surface.labels.push_back(at != marks.end() && at->first == t ? at->second : 0);
    }
    if (std::all_of(surface.labels.begin(), surface.labels.end(), [](std::int32_t label) { return label == 0; }))
      surface.labels.clear();
    else surface.label_names = mesh.label_names;
  }

  std::vector<Index> index(mesh.vertices.size(), kNone), origin;
  for (const Triangle& t : surface.triangles)
    for (const Index v : t) index[v] = 0;
  for (Index v = 0; v < index.size(); ++v) {
    if (index[v] == kNone) continue;
    index[v] = static_cast<Index>(origin.size());
    origin.push_back(v);
    surface.vertices.push_back(mesh.vertices[v]);
  }
  for (Triangle& t : surface.triangles)
    for (Index& v : t) v = index[v];
  const EdgeTable table = edge_table(surface.triangles, surface.vertices.size());
  for (const auto& [a, b] : mesh.feature_edges) {
    if (index[a] == kNone || index[b] == kNone) continue;
    const std::array<Index, 2> e{std::min(index[a], index[b]), std::max(index[a], index[b])};
    if (std::binary_search(table.edges.begin(), table.edges.end(), e)) surface.feature_edges.push_back(e);
  }
  for (const Attribute& attribute : mesh.attributes)
    if (attribute.site == Attribute::Site::vertex) surface.attributes.push_back(picked(attribute, origin));
  if (vertices) *vertices = std::move(origin);
  return surface;
}

}  // namespace bisector
