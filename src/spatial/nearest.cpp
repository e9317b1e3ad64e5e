#include "spatial/nearest.h"

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/geometry.h"

namespace bisector {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Iterator = std::vector<Kernel::Triangle_3>::const_iterator;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Iterator>;
using AabbTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point(const Vec3& p) { return {p.x, p.y, p.z}; }

}  // namespace

struct NearestOnMesh::Tree {
  std::vector<Kernel::Triangle_3> triangles;
  std::vector<Index> triangle_of;  // the mesh's, ascending
  AabbTree tree;

  NearestPoint convert(const AabbTree::Point_and_primitive_id& found) const {
    return {{found.first.x(), found.first.y(), found.first.z()},
            triangle_of[static_cast<std::size_t>(found.second - triangles.begin())]};
  }
};

NearestOnMesh::NearestOnMesh(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>()) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    if (!(triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) > 0)) continue;
    tree_->triangles.emplace_back(point(mesh.vertices[a]), point(mesh.vertices[b]), point(mesh.vertices[c]));
    tree_->triangle_of.push_back(static_cast<Index>(t));
  }
  if (tree_->triangles.empty()) throw Error("nearest points: the mesh has no area; check the mesh");
  tree_->tree.insert(tree_->triangles.cbegin(), tree_->triangles.cend());
  tree_->tree.build();
}

NearestOnMesh::~NearestOnMesh() = default;

NearestPoint NearestOnMesh::nearest(const Vec3& p) const {
  return tree_->convert(tree_->tree.closest_point_and_primitive(point(p)));
}

NearestPoint NearestOnMesh::nearest(const Vec3& p, const NearestPoint& hint) const {
  const auto found = std::lower_bound(tree_->triangle_of.begin(), tree_->triangle_of.end(), hint.triangle);
  const bool known = found != tree_->triangle_of.end() && *found == hint.triangle;
  if (!known || !std::isfinite(norm2(hint.point))) return nearest(p);
  const Iterator primitive = tree_->triangles.cbegin() + (found - tree_->triangle_of.begin());
  return tree_->convert(tree_->tree.closest_point_and_primitive(point(p), {point(hint.point), primitive}));
}

struct NearestOnEdges::Tree {
  using Primitive = CGAL::AABB_segment_primitive<Kernel, std::vector<Kernel::Segment_3>::const_iterator>;

  std::vector<Kernel::Segment_3> segments;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;
};

NearestOnEdges::NearestOnEdges(const std::vector<Vec3>& vertices, const std::vector<std::array<Index, 2>>& edges)
    : tree_(std::make_unique<Tree>()) {
  for (const auto& [a, b] : edges) tree_->segments.emplace_back(point(vertices[a]), point(vertices[b]));
  tree_->tree.insert(tree_->segments.cbegin(), tree_->segments.cend());
  tree_->tree.build();
}

NearestOnEdges::~NearestOnEdges() = default;

Vec3 NearestOnEdges::nearest(const Vec3& p) const {
  const Kernel::Point_3 found = tree_->tree.closest_point(point(p));
  return {found.x(), found.y(), found.z()};
}

}  // namespace bisector
