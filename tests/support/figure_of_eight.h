// A torus of the section of a figure of eight.
#pragma once

#include <cmath>
#include <numbers>

#include "bisector/mesh.h"

namespace bisector::test {

// About z, of 2 nu nv triangles: goes through itself along the circle x^2 + y^2 = 9, z = 0.
inline TriangleMesh figure_of_eight(Index nu, Index nv) {
  TriangleMesh mesh;
  for (Index j = 0; j < nv; ++j)
    for (Index i = 0; i < nu; ++i) {
      // Turned, so that edges of the sheets do not cross in points.
      const double v = 2 * std::numbers::pi * j / nv, u = 2 * std::numbers::pi * i / nu + 0.1 * std::sin(v);
      const double r = 3 + 0.8 * std::sin(2 * v);
      mesh.vertices.push_back({r * std::cos(u), r * std::sin(u), std::cos(v)});
      const Index here = j * nu + i, right = j * nu + (i + 1) % nu;
      const Index above = (j + 1) % nv * nu + i, beyond = (j + 1) % nv * nu + (i + 1) % nu;
      mesh.triangles.push_back({here, right, beyond});
      mesh.triangles.push_back({here, beyond, above});
    }
  return mesh;
}

}  // namespace bisector::test
