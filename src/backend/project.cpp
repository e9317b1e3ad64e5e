#include "backend/project.h"

#include <algorithm>
#include <limits>

#include "core/parallel.h"

namespace bisector {

SurfacePoint nearest_on_triangles(const Surface& surface, std::span<const Index> triangles, const Vec3& p) {
  const auto facet_of = [&](Index t) -> const Facet& { return surface.facets[surface.facet_of[t]]; };
  const auto nearest_on = [&](const Facet& f) {
    return nearest_on_triangle(p, f.corners[0], f.corners[1], f.corners[2]);
  };
  SurfacePoint result;
  if (triangles.empty()) return result;
  // Most triangles are farther than the one that has the nearest corner: a point of a triangle with sides up to L at
  // corner a is at a distance of |p - a| - L or more, and (x + y)^2 <= 2 (x^2 + y^2).
  const Facet* likely = nullptr;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Index t : triangles) {
    const double squared = norm2(facet_of(t).corners[0] - p);
    if (likely && squared >= nearest) continue;
    nearest = squared;
    likely = &facet_of(t);
  }
  const double limit = norm2(nearest_on(*likely) - p);
  double best = std::numeric_limits<double>::infinity();
  for (const Index t : triangles) {
    const Facet& f = facet_of(t);
    const Vec3& a = f.corners[0];
    const double side = std::max(norm2(f.corners[1] - a), norm2(f.corners[2] - a));
    if (norm2(a - p) > 2 * (1 + 1e-9) * (limit + side)) continue;
    const Vec3 q = nearest_on(f);
    const double squared = norm2(q - p);
    if (squared >= best) continue;
    best = squared;
    result = {q, &f};
  }
  return result;
}

void project_to_cells(const Surface& surface, const Csr<Index>& cells, std::span<const SeedPlace> places,
                      std::span<Vec3> seeds, std::vector<Vec3>& normals) {
  normals.resize(seeds.size());
  parallel_each(
      seeds.size(),
      [&](std::size_t i) {
        if (!places.empty() && places[i].kind == SeedPlace::Kind::interior) return;
        const SurfacePoint nearest = nearest_on_triangles(surface, {cells.begin(i), cells.end(i)}, seeds[i]);
        if (!nearest.facet) return;
        seeds[i] = nearest.at;
        normals[i] = nearest.facet->normal;
      },
      256);
}

}  // namespace bisector
