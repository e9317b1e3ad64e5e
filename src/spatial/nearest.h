// Nearest points on triangles and edges, through AABB trees.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct NearestPoint {
  Vec3 point;
  Index triangle;  // of the mesh; one of them where several are as near
};

class NearestOnMesh {
 public:
  // Triangles without area, or with one whose square vanishes beside the mesh, are left out. Throws Error if there are
  // no others.
  explicit NearestOnMesh(const TriangleMesh& mesh);
  ~NearestOnMesh();
  NearestOnMesh(const NearestOnMesh&) = delete;
  NearestOnMesh& operator=(const NearestOnMesh&) = delete;

  // May be called from many threads at once.
  NearestPoint nearest(const Vec3& p) const;
  // The same, faster the nearer `hint` is to p. `hint` must be a point of its triangle, up to
  // rounding; one that is not finite, or whose triangle was left out, is not used.
  NearestPoint nearest(const Vec3& p, const NearestPoint& hint) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

// Nearest points on edges between vertices, through an AABB tree.
class NearestOnEdges {
 public:
  // There are some.
  NearestOnEdges(const std::vector<Vec3>& vertices, const std::vector<std::array<Index, 2>>& edges);
  ~NearestOnEdges();
  NearestOnEdges(const NearestOnEdges&) = delete;
  NearestOnEdges& operator=(const NearestOnEdges&) = delete;

  // May be called from many threads at once.
  Vec3 nearest(const Vec3& p) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace bisector
