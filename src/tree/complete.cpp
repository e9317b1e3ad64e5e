#include "tree/complete.h"

#include <algorithm>

#include "tree/growth.h"
#include "tree/polyline.h"
#include "tree/refit.h"
#include "tree/support.h"
#include "tree/trim.h"
#include "tree/wood.h"

namespace bisector {
namespace {

constexpr int kRounds = 3;           // of growing and fitting: a branch that is found lets those on it be found better
constexpr double kSlenderness = 80;  // height over the radius at the base: trees that stand alone have 60 to 110

// A branch explains points within this distance, which is at least what noise and spacing blur, and at most what would
// be seen of a tree as a whole.
constexpr double kSpacings = 0.5, kNoises = 2.5, kLargestTolerance = 0.006;
constexpr double kSkin = 3.5;  // of noise: points that lie so near a surface are its own

// Where radii rest on points as they would without noise.
std::vector<Limb> strictly_fitted(const std::vector<Vec3>& points, const std::vector<Limb>& limbs) {
  std::vector<Limb> result = limbs;
  for (Limb& limb : result) {
    const std::vector<char> strict = supported_radii(points, limb, 0);
    for (std::size_t k = 0; k < strict.size(); ++k) limb.fitted[k] = limb.fitted[k] && strict[k];
  }
  return result;
}

void give_points(const std::vector<Index>& limb_of, std::vector<Limb>& limbs) {
  for (Limb& limb : limbs) limb.points.clear();
  for (std::size_t i = 0; i < limb_of.size(); ++i)
    if (limb_of[i] != kNone) limbs[limb_of[i]].points.push_back(static_cast<Index>(i));
}

// Points of limbs are wood, the rest is asked.
std::vector<char> find_wood(const std::vector<Vec3>& points, const std::vector<Index>& limb_of, double tolerance) {
  std::vector<char> asked(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) asked[i] = limb_of[i] == kNone;
  return points_on_lines(points, asked, tolerance);
}

// Of the branch at each point; 0 where there is none.
std::vector<double> radii_at(const std::vector<Vec3>& points, const std::vector<Index>& limb_of,
                             const std::vector<Limb>& limbs) {
  std::vector<double> radius(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (limb_of[i] == kNone) continue;
    const Limb& limb = limbs[limb_of[i]];
    radius[i] = value_at(limb.radii, nearest_on_polyline(limb.axis, points[i]));
  }
  return radius;
}

}  // namespace

Completion complete_limbs(const std::vector<Vec3>& points, const CompletionOptions& options, std::vector<Limb>& limbs,
                          const Context& context) {
  std::vector<Limb> expected = strictly_fitted(points, limbs);
  const double noise = surface_noise(points, expected);
  fill_radii(expected, 0, kSlenderness);
  confirm_radii(points, noise, expected, limbs);

  const double tolerance = std::min(kLargestTolerance, std::max(kNoises * noise, kSpacings * options.spacing));
  Completion result;
  std::vector<double> radius;
  std::vector<char> wood;
  for (int round = 0; round < kRounds; ++round) {
    context.check();
    trim_limbs(limbs);
    result.limb_of = limbs_of_points(points, limbs, std::max(kSkin * noise, tolerance));
    for (std::size_t i = 0; i < options.group.size(); ++i)
      if (options.group[i] == kNone) result.limb_of[i] = kNone;
    if (options.leaves && wood.empty()) wood = find_wood(points, result.limb_of, tolerance);
    grow_limbs(points, {tolerance, radius, options.group, wood}, limbs, result.limb_of, context);
    give_points(result.limb_of, limbs);
    fill_radii(limbs, options.tip_radius, kSlenderness);
    straighten_limbs(points, tolerance, limbs);
    result.pipe = fill_radii(limbs, options.tip_radius, kSlenderness);
    if (round + 1 == kRounds) break;
    radius = radii_at(points, result.limb_of, limbs);
    refit_limbs(points, tolerance, noise, limbs, context);
  }
  for (std::size_t i = 0; i < wood.size(); ++i) result.leaf.push_back(!wood[i] && result.limb_of[i] == kNone);
  return result;
}

}  // namespace bisector
