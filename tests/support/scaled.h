// Models of other proportions.
#pragma once

#include "bisector/mesh.h"

namespace bisector::test {

inline TriangleMesh scaled(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& p : mesh.vertices) p = {p.x * by.x, p.y * by.y, p.z * by.z};
  return mesh;
}

}  // namespace bisector::test
