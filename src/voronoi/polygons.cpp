#include "voronoi/polygons.h"

namespace bisector {

void append_polygon(const Clipper& clipper, const SortedSeeds& seeds, Index triangle, Index slot, RestrictedPolygons& out) {
  out.pairs.push_back({triangle, seeds.id[slot]});
  const std::size_t first = clipper.first_corner();
  for (std::size_t e = 0; e < clipper.size(); ++e) {
    const std::size_t k = (first + e) % clipper.size();
    const Index label = clipper.label(k);
    out.labels.push_back(is_edge(label) ? label : seeds.id[label]);
    out.vertices.push_back(seeds.x[slot] + clipper.vertex(k));
  }
  out.offsets.push_back(out.labels.size());
}

}  // namespace bisector
