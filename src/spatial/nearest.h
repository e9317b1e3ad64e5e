// Nearest points on a mesh, through an AABB tree.
#pragma once

#include <memory>

#include "core/geometry.h"

namespace bisector {

struct NearestPoint {
  Vec3 point;
  Index triangle;  // of the mesh; one of them where several are as near
};

class NearestOnMesh {
 public:
  // Triangles without area are left out. Throws Error if there are no others.
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

}  // namespace bisector
