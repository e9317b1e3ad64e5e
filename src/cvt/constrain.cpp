#include "cvt/constrain.h"

#include <limits>

#include "core/parallel.h"

namespace bisector {

void project_to_cells(const Surface& surface, const Csr<Index>& cells, std::span<const SeedPlace> places,
                      std::span<Vec3> seeds, std::vector<Vec3>& normals) {
  normals.resize(seeds.size());
  parallel_each(
      seeds.size(),
      [&](std::size_t i) {
        if (!places.empty() && places[i].kind == SeedPlace::Kind::interior) return;
        const Vec3 p = seeds[i];
        double best = std::numeric_limits<double>::infinity();
        for (const Index* t = cells.begin(i); t != cells.end(i); ++t) {
          const Facet& facet = surface.facets[surface.facet_of[*t]];
          const Vec3 q = nearest_on_triangle(p, facet.corners[0], facet.corners[1], facet.corners[2]);
          const double squared = norm2(q - p);
          if (squared < best) {
            best = squared;
            seeds[i] = q;
            normals[i] = facet.normal;
          }
        }
      },
      256);
}

}  // namespace bisector
