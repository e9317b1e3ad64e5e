// Points near the axis of a branch.
#pragma once

#include <utility>
#include <vector>

#include "core/geometry.h"
#include "spatial/kd_tree.h"
#include "tree/polyline.h"

namespace bisector {

// Calls visit(point, foot) for each point within reach(k) of segment k of a line, segment by segment; a point near
// several segments comes once for each, with its foot on that segment. `tree` holds the points.
template <class Reach, class Visit>
void visit_near(const KdTree& tree, const std::vector<Vec3>& points, const std::vector<Vec3>& line, const Reach& reach,
                const Visit& visit) {
  std::vector<std::pair<Index, double>> found;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const Vec3 middle = 0.5 * (line[k] + line[k + 1]);
    const double most = reach(k), around = most + 0.5 * norm(line[k + 1] - line[k]);
    const double at[3] = {middle.x, middle.y, middle.z};
    found.clear();
    tree.radiusSearch(at, around * around, found, nanoflann::SearchParams(32, 0, false));
    for (const auto& [i, squared] : found)
      if (const PolylineFoot foot = nearest_on_polyline(line, points[i], k, k); foot.distance <= most) visit(i, foot);
  }
}

}  // namespace bisector
