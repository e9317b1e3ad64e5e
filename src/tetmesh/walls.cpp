#include "tetmesh/walls.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "mesh/tet_adjacency.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

// The labels of a solid's marked triangles.
class Marks {
 public:
  explicit Marks(const TetMesh& mesh) {
    if (mesh.boundary_labels.empty()) return;
    for (std::size_t t = 0; t < mesh.boundary.size(); ++t)
      labels_.push_back({ascending(mesh.boundary[t]), mesh.boundary_labels[t]});
    std::sort(labels_.begin(), labels_.end());
  }

  bool empty() const { return labels_.empty(); }
  // 0 of a triangle that is not marked; the least of several.
  std::int32_t label(const Triangle& triangle) const {
    const Triangle t = ascending(triangle);
    const auto at =
        std::lower_bound(labels_.begin(), labels_.end(), std::pair{t, std::numeric_limits<std::int32_t>::min()});
    return at != labels_.end() && at->first == t ? at->second : 0;
  }

 private:
  static Triangle ascending(Triangle t) {
    std::sort(t.begin(), t.end());
    return t;
  }

  std::vector<std::pair<Triangle, std::int32_t>> labels_;
};

}  // namespace

bool Walls::divide() const {
  return std::any_of(patches.begin(), patches.end(), [](const Patch& patch) { return patch.front != kNone; });
}

Walls find_walls(const TetMesh& mesh) {
  Walls walls;
  const std::vector<std::array<Index, 4>> adjacent = tet_adjacency(mesh.tets);
  const auto region = [&](Index t) { return mesh.regions.empty() ? 0 : mesh.regions[t]; };
  walls.part_of_tet = tet_parts(adjacent, [&](Index t, std::size_t k) { return region(adjacent[t][k]) == region(t); });
  for (Index t = 0; t < mesh.tets.size(); ++t)
    if (walls.part_of_tet[t] == walls.regions.size()) walls.regions.push_back(region(t));

  walls.surface.vertices = mesh.vertices;
  walls.surface.feature_edges = mesh.feature_edges;
  const Marks marks(mesh);
  std::map<std::tuple<Index, Index, std::int32_t>, std::int32_t> patch_of;
  for (Index t = 0; t < mesh.tets.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      const Index other = adjacent[t][static_cast<std::size_t>(k)], part = walls.part_of_tet[t];
      const Index beyond = other == kNone ? kNone : walls.part_of_tet[other];
      if (beyond <= part) continue;
      const Triangle facet = facet_of(mesh.tets[t], k);
      const std::int32_t label = marks.label(facet);
      const auto [patch, fresh] =
          patch_of.insert({{part, beyond, label}, static_cast<std::int32_t>(walls.patches.size())});
      if (fresh) walls.patches.push_back({part, beyond, label});
      walls.surface.triangles.push_back(facet);
      walls.surface.labels.push_back(patch->second);
    }
  keep_own_edges(walls.surface);
  return walls;
}

TriangleMesh labelled_boundary(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  surface.triangles = boundary_facets(mesh.tets);
  surface.feature_edges = mesh.feature_edges;
  const Marks marks(mesh);
  if (marks.empty()) return surface;
  for (const Triangle& t : surface.triangles) surface.labels.push_back(marks.label(t));
  return surface;
}

void keep_own_edges(TriangleMesh& surface) {
  const EdgeTable table = edge_table(surface.triangles, surface.vertices.size());
  std::erase_if(surface.feature_edges, [&](std::array<Index, 2> e) {
    if (e[0] > e[1]) std::swap(e[0], e[1]);
    return !std::binary_search(table.edges.begin(), table.edges.end(), e);
  });
}

}  // namespace bisector
