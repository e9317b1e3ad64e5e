#include "tree/allometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tree/polyline.h"
#include "tree/tube_fit.h"

namespace bisector {
namespace {

constexpr double kLeastExponent = 2, kMostExponent = 3;
constexpr std::size_t kLeastPlaces = 20;  // that an exponent is fitted to
constexpr std::size_t kMostPlaces = 200;  // that are looked at, evenly
constexpr double kUnseen = 1;             // length of a twig beyond what is seen, in that of the last ones
constexpr double kLeastRatio = 1.5;       // of lengths beyond, of two places that tell a slope

// Length of all that grows beyond each point of each axis, and where a limb leaves its parent.
struct Lengths {
  std::vector<std::vector<double>> beyond;
  std::vector<PolylineFoot> root;
  std::vector<std::size_t> fork;  // the point of the parent's axis at or before the root
};

Lengths measure_lengths(const std::vector<Limb>& limbs) {
  Lengths lengths;
  lengths.beyond.resize(limbs.size());
  lengths.root.resize(limbs.size());
  lengths.fork.resize(limbs.size(), 0);
  // What a scan no longer shows of a twig is taken to be as long as what it shows of the last ones.
  std::vector<char> bears(limbs.size(), 0);
  for (const Limb& limb : limbs)
    if (limb.parent != kNone) bears[limb.parent] = 1;
  std::vector<double> last;
  for (std::size_t b = 0; b < limbs.size(); ++b)
    if (!bears[b]) last.push_back(polyline_length(limbs[b].axis));
  const double unseen = last.empty() ? 0 : kUnseen * upper_median(std::move(last));
  std::vector<std::vector<double>> grown(limbs.size());  // at each point
  for (std::size_t b = 0; b < limbs.size(); ++b) grown[b].assign(limbs[b].axis.size(), 0);
  for (std::size_t b = limbs.size(); b-- > 0;) {
    const Limb& limb = limbs[b];
    const std::size_t m = limb.axis.size();
    std::vector<double>& beyond = lengths.beyond[b];
    beyond.resize(m);
    beyond[m - 1] = grown[b][m - 1] > 0 ? grown[b][m - 1] : unseen;
    for (std::size_t k = m - 1; k-- > 0;)
      beyond[k] = beyond[k + 1] + norm(limb.axis[k + 1] - limb.axis[k]) + grown[b][k];
    if (limb.parent == kNone) continue;
    const PolylineFoot foot = nearest_on_polyline(limbs[limb.parent].axis, limb.axis.front());
    lengths.root[b] = foot;
    lengths.fork[b] = foot.segment + (foot.t == 1);
    grown[limb.parent][lengths.fork[b]] += beyond.front();
  }
  return lengths;
}

// The median of the slopes of log r over log length (Theil and Sen), as an exponent.
void fit_exponent(const std::vector<Limb>& limbs, const Lengths& lengths, PipeModel& model) {
  std::vector<std::pair<double, double>> places;
  for (std::size_t b = 0; b < limbs.size(); ++b)
    for (std::size_t k = 0; k < limbs[b].axis.size(); ++k)
      if (limbs[b].fitted[k] && lengths.beyond[b][k] > 0 && limbs[b].radii[k] > 0)
        places.emplace_back(std::log(lengths.beyond[b][k]), std::log(limbs[b].radii[k]));
  if (places.size() < kLeastPlaces) return;
  std::vector<double> slopes;
  const std::size_t stride = places.size() / kMostPlaces + 1;
  for (std::size_t i = 0; i < places.size(); i += stride)
    for (std::size_t j = i + stride; j < places.size(); j += stride)
      if (const double run = places[j].first - places[i].first; std::abs(run) > std::log(kLeastRatio))
        slopes.push_back((places[j].second - places[i].second) / run);
  if (slopes.size() < kLeastPlaces) return;
  model.exponent = 1 / std::clamp(upper_median(std::move(slopes)), 1 / kMostExponent, 1 / kLeastExponent);
  model.from_points = true;
}

// The radius of a limb where it comes out of its parent.
double free_radius(const std::vector<Limb>& limbs, Index b) {
  const Limb& limb = limbs[b];
  if (limb.parent == kNone) return limb.radii.front();
  const Limb& parent = limbs[limb.parent];
  for (std::size_t k = 0; k < limb.axis.size(); ++k) {
    const PolylineFoot foot = nearest_on_polyline(parent.axis, limb.axis[k]);
    if (foot.distance > value_at(parent.radii, foot)) return limb.radii[k];
  }
  return limb.radii.back();
}

class Filling {
 public:
  Filling(const Lengths& lengths, const PipeModel& model) : lengths_(lengths), model_(model) {}

  // `most`: the radius at the base, at most; `base`: the radius there of a limb that has none of its own.
  void fill(std::size_t b, double most, double base, Limb& limb) const {
    const std::vector<double>& length = lengths_.beyond[b];
    const std::size_t m = limb.axis.size();
    std::vector<std::size_t> known;
    std::vector<double> fitted;
    for (std::size_t k = 0; k < m; ++k)
      if (limb.fitted[k]) {
        known.push_back(k);
        fitted.push_back(limb.radii[k]);
      }
    fitted = non_increasing(fitted, std::vector<double>(fitted.size(), 1));
    for (std::size_t i = 0; i < known.size(); ++i) limb.radii[known[i]] = std::min(fitted[i], most);
    if (known.empty()) {
      limb.radii[0] = std::min(base, most);
      for (std::size_t k = 1; k < m; ++k) limb.radii[k] = scaled(limb.radii[0], length[0], length[k]);
    } else {
      for (std::size_t k = 0; k < known.front(); ++k)
        limb.radii[k] = std::min(most, scaled(limb.radii[known.front()], length[known.front()], length[k]));
      for (std::size_t i = 0; i + 1 < known.size(); ++i)
        for (std::size_t k = known[i] + 1; k < known[i + 1]; ++k) {
          const double s = (length[known[i]] - length[k]) /
                           std::max(length[known[i]] - length[known[i + 1]], std::numeric_limits<double>::min());
          limb.radii[k] = (1 - s) * limb.radii[known[i]] + s * limb.radii[known[i + 1]];
        }
      for (std::size_t k = known.back() + 1; k < m; ++k)
        limb.radii[k] = scaled(limb.radii[known.back()], length[known.back()], length[k]);
    }
    for (std::size_t k = 1; k < m; ++k) limb.radii[k] = std::min(limb.radii[k], limb.radii[k - 1]);
  }

  // The radius where `length` grows beyond, of a branch that has `radius` where `full` does.
  double scaled(double radius, double full, double length) const {
    const double scaled = radius * std::pow(length / std::max(full, 1e-300), 1 / model_.exponent);
    return std::max(scaled, std::min(model_.tip_radius, radius));
  }

 private:
  const Lengths& lengths_;
  const PipeModel& model_;
};

// Of each trunk the largest extent of its tree.
std::vector<double> tree_sizes(const std::vector<Limb>& limbs) {
  std::vector<std::size_t> trunk(limbs.size());
  std::vector<Box> box(limbs.size());
  for (std::size_t b = 0; b < limbs.size(); ++b) {
    const Limb& limb = limbs[b];
    trunk[b] = limb.parent == kNone ? b : trunk[limb.parent];
    if (limb.parent == kNone) box[b] = {limb.axis[0], limb.axis[0]};
    Box& all = box[trunk[b]];
    for (const Vec3& p : limb.axis)
      for (int c = 0; c < 3; ++c) {
        all.lo[c] = std::min(all.lo[c], p[c]);
        all.hi[c] = std::max(all.hi[c], p[c]);
      }
  }
  std::vector<double> sizes;
  for (const Box& all : box) sizes.push_back(std::max({all.hi.x - all.lo.x, all.hi.y - all.lo.y, all.hi.z - all.lo.z}));
  return sizes;
}

}  // namespace

PipeModel fill_radii(std::vector<Limb>& limbs, double tip_radius, double slenderness) {
  PipeModel model;
  model.tip_radius = tip_radius;
  const Lengths lengths = measure_lengths(limbs);
  fit_exponent(limbs, lengths, model);
  const std::vector<double> sizes = tree_sizes(limbs);
  const Filling filling(lengths, model);
  for (std::size_t b = 0; b < limbs.size(); ++b) {
    Limb& limb = limbs[b];
    if (limb.parent == kNone) {
      filling.fill(b, std::numeric_limits<double>::infinity(), sizes[b] / slenderness, limb);
      continue;
    }
    const Limb& parent = limbs[limb.parent];
    const PolylineFoot& foot = lengths.root[b];
    const double most = std::min(value_at(parent.radii, foot), free_radius(limbs, limb.parent));
    filling.fill(b, most,
                 filling.scaled(value_at(parent.radii, foot), lengths.beyond[limb.parent][lengths.fork[b]],
                                lengths.beyond[b].front()),
                 limb);
  }
  return model;
}

}  // namespace bisector
