#include "solids.h"

#include <algorithm>
#include <array>

namespace bisector {

TetMesh tet_box(int n) {
  TetMesh mesh;
  const auto at = [&](int x, int y, int z) { return static_cast<Index>((z * (n + 1) + y) * (n + 1) + x); };
  for (int z = 0; z <= n; ++z)
    for (int y = 0; y <= n; ++y)
      for (int x = 0; x <= n; ++x)
        mesh.vertices.push_back({static_cast<double>(x) / n, static_cast<double>(y) / n, static_cast<double>(z) / n});
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        // One for each order in which the three directions are walked along.
        std::array<int, 3> axes{0, 1, 2};
        do {
          std::array<int, 3> p{x, y, z};
          Tetrahedron tet{at(p[0], p[1], p[2])};
          for (std::size_t k = 0; k < 3; ++k) {
            ++p[static_cast<std::size_t>(axes[k])];
            tet[k + 1] = at(p[0], p[1], p[2]);
          }
          const bool even = (axes[0] < axes[1]) ^ (axes[1] < axes[2]) ^ (axes[0] < axes[2]);
          if (!even) std::swap(tet[2], tet[3]);
          mesh.tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  return mesh;
}

}  // namespace bisector
