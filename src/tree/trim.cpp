#include "tree/trim.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "spatial/kd_tree.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr double kGap = 12;              // between fitted places of an axis, in radii, at most
constexpr std::size_t kLeastFitted = 3;  // places of a limb, or fewer that are so far apart as it is thick
constexpr double kWider = 1.3;           // radius over that before a gap, at most

}  // namespace

std::size_t fitted_end(const Limb& limb, double hidden) {
  const std::size_t m = limb.axis.size();
  std::size_t last = 0, count = 0;
  double since = -hidden;  // length since the last fitted place, or since the base came out of the parent
  double length = 0;       // between the first and the last one
  for (std::size_t k = 0; k < m; ++k) {
    if (k > 0) since += norm(limb.axis[k] - limb.axis[k - 1]);
    if (!limb.fitted[k]) continue;
    if (since > kGap * limb.radii[k]) break;
    if (count > 0 && limb.radii[k] > kWider * limb.radii[last]) break;
    if (count > 0) length += since;
    since = 0;
    last = k;
    ++count;
  }
  return count >= kLeastFitted || (count > 1 && length >= 2 * limb.radii[last]) ? last + 1 : 0;
}

void trim_limbs(std::vector<Limb>& limbs) {
  std::vector<Index> number(limbs.size(), kNone);
  std::vector<std::size_t> kept(limbs.size(), 0);
  std::vector<Limb> result;
  for (std::size_t b = 0; b < limbs.size(); ++b) {
    Limb& limb = limbs[b];
    double hidden = 0;
    if (limb.parent != kNone) {
      if (number[limb.parent] == kNone) continue;
      const Limb& parent = limbs[limb.parent];
      const PolylineFoot foot = nearest_on_polyline(parent.axis, limb.axis.front());
      if (foot.segment + 1 >= kept[limb.parent]) continue;
      hidden = value_at(parent.radii, foot);
    }
    kept[b] = fitted_end(limb, hidden);
    if (kept[b] < 2) {
      kept[b] = 0;
      continue;
    }
    number[b] = static_cast<Index>(result.size());
    Limb copy = limb;
    copy.axis.resize(kept[b]);
    copy.radii.resize(kept[b]);
    copy.fitted.resize(kept[b]);
    copy.points.clear();
    if (copy.parent != kNone) copy.parent = number[copy.parent];
    result.push_back(std::move(copy));
  }
  limbs = std::move(result);
}

std::vector<Index> limbs_of_points(const std::vector<Vec3>& points, const std::vector<Limb>& limbs, double distance) {
  std::vector<Index> limb_of(points.size(), kNone);
  std::vector<double> least(points.size(), std::numeric_limits<double>::infinity());
  const PointSet set{points};
  const KdTree tree(3, set);
  std::vector<std::pair<Index, double>> found;
  for (std::size_t b = 0; b < limbs.size(); ++b) {
    const Limb& limb = limbs[b];
    for (std::size_t k = 0; k + 1 < limb.axis.size(); ++k) {
      const Vec3 middle = 0.5 * (limb.axis[k] + limb.axis[k + 1]);
      const double reach = std::max(limb.radii[k], limb.radii[k + 1]) + distance;
      const double half = 0.5 * norm(limb.axis[k + 1] - limb.axis[k]);
      const double at[3] = {middle.x, middle.y, middle.z};
      found.clear();
      tree.radiusSearch(at, reach * reach + half * half, found, nanoflann::SearchParams(32, 0, false));
      for (const auto& [i, squared] : found) {
        const PolylineFoot foot = nearest_on_polyline(limb.axis, points[i], k, k);
        const double out = foot.distance - value_at(limb.radii, foot);
        if (out > distance || !(out < least[i])) continue;
        least[i] = out;
        limb_of[i] = static_cast<Index>(b);
      }
    }
  }
  return limb_of;
}

}  // namespace bisector
