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
#include "core/geometry.h"

namespace bisector {

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Iterator = std::vector<Kernel::Triangle_3>::const_iterator;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Iterator>;
using AabbTree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point(const Vec3& p) { return {p.x, p.y, p.z}; }

// A power of two that brings coordinates of wild magnitude to about 1, for CGAL divides by the square of an area.
double scale_of(const std::vector<Vec3>& points) {
  double largest = 0;
  for (const Vec3& p : points) largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return largest == 0 || (largest > 0x1p-100 && largest < 0x1p100) ? 1 : std::ldexp(1.0, -std::ilogb(largest));
}

// What a square of an area must be for a division by it.
bool is_sound(double square) { return square > 1e-290 && std::isfinite(square); }

}  // namespace

struct NearestOnMesh::Tree {
  double scale = 1;  // of all that CGAL sees
  std::vector<Kernel::Triangle_3> triangles;
  std::vector<Index> triangle_of;  // the mesh's, ascending
  AabbTree tree;

  Kernel::Point_3 scaled(const Vec3& p) const { return point(scale * p); }
  NearestPoint convert(const AabbTree::Point_and_primitive_id& found) const {
    return {(1 / scale) * Vec3{found.first.x(), found.first.y(), found.first.z()},
            triangle_of[static_cast<std::size_t>(found.second - triangles.begin())]};
  }
};

NearestOnMesh::NearestOnMesh(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>()) {
  tree_->scale = scale_of(mesh.vertices);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    const Vec3 p = tree_->scale * mesh.vertices[a], q = tree_->scale * mesh.vertices[b],
               r = tree_->scale * mesh.vertices[c];
    if (!is_sound(norm2(cross(q - p, r - p)))) continue;
    tree_->triangles.emplace_back(point(p), point(q), point(r));
    tree_->triangle_of.push_back(static_cast<Index>(t));
  }
  if (tree_->triangles.empty()) throw Error("nearest points: the mesh has no area; check the mesh");
  tree_->tree.insert(tree_->triangles.cbegin(), tree_->triangles.cend());
  tree_->tree.build();
}

NearestOnMesh::~NearestOnMesh() = default;

NearestPoint NearestOnMesh::nearest(const Vec3& p) const {
  return tree_->convert(tree_->tree.closest_point_and_primitive(tree_->scaled(p)));
}

NearestPoint NearestOnMesh::nearest(const Vec3& p, const NearestPoint& hint) const {
  const auto found = std::lower_bound(tree_->triangle_of.begin(), tree_->triangle_of.end(), hint.triangle);
  const bool known = found != tree_->triangle_of.end() && *found == hint.triangle;
  if (!known || !std::isfinite(norm2(hint.point))) return nearest(p);
  const Iterator primitive = tree_->triangles.cbegin() + (found - tree_->triangle_of.begin());
  return tree_->convert(
      tree_->tree.closest_point_and_primitive(tree_->scaled(p), {tree_->scaled(hint.point), primitive}));
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
