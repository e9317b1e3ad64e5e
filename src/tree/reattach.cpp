#include "tree/reattach.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/parallel.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr std::size_t kWindow = 5;  // nodes of the axis that a radius is the median of
constexpr double kTangent = 6;      // length in radii that tells a direction

// Another parent is looked for where a base is far from its parent's surface.
constexpr double kFar = 3;        // distance in radii of the base
constexpr double kTurn = 3;       // what a gap across the base's direction counts more than one along it, in its length
constexpr double kBetter = 0.6;   // cost of the gap to another parent over that to the present one, at most
constexpr double kThinner = 0.7;  // radius of a parent over its child's, at least

// A child becomes the rest of its parent's branch where it goes on straighter and thicker.
constexpr double kSwapScore = 0.5;   // by which its score is higher, at least
constexpr double kSwapLength = 0.6;  // its length over that of what it replaces, at least

class Reattachment {
 public:
  Reattachment(const std::vector<Vec3>& points, double noise, std::vector<Limb>& limbs)
      : points_(points), noise_(noise), limbs_(limbs) {}

  void find_parents() {
    std::vector<char> open(limbs_.size(), 0);
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      const Limb& limb = limbs_[b];
      if (limb.parent != kNone && gap_to(limb, limbs_[limb.parent]).length > kFar * (base_radius(limb) + noise_))
        open[b] = 1;
    }
    std::vector<Index> wanted(limbs_.size(), kNone);
    parallel_each(
        limbs_.size(),
        [&](std::size_t b) {
          if (open[b]) wanted[b] = best_parent(static_cast<Index>(b));
        },
        1);
    for (std::size_t b = 0; b < limbs_.size(); ++b)
      if (wanted[b] != kNone && !descends(wanted[b], static_cast<Index>(b))) limbs_[b].parent = wanted[b];
  }

  void swap_at_forks() {
    const std::vector<double> heights = longest_paths();
    const std::size_t before = limbs_.size();
    std::vector<char> done(before, 0);
    for (std::size_t r = 0; r < before; ++r) {
      const Index b = limbs_[r].parent;
      if (b == kNone || b >= before || done[b] || done[r]) continue;  // what a split made is left for good
      const Limb& branch = limbs_[b];
      const Gap gap = gap_to(limbs_[r], branch);
      const std::size_t k = std::max<std::size_t>(1, gap.foot.segment + (gap.foot.t > 0.5));
      if (k >= branch.axis.size()) continue;
      const bool tip = k + 2 >= branch.axis.size();
      if (tip ? !lines_up(branch, limbs_[r]) : !goes_on(branch, k, limbs_[r], heights[r])) continue;
      done[b] = done[r] = 1;
      if (!tip) split(b, k);
      append(b, static_cast<Index>(r));
    }
  }

  // Leaves out limbs that were appended to others.
  void tidy() {
    std::vector<Index> number(limbs_.size(), kNone);
    Index next = 0;
    for (std::size_t b = 0; b < limbs_.size(); ++b)
      if (!limbs_[b].axis.empty()) number[b] = next++;
    for (Limb& limb : limbs_)
      if (limb.parent != kNone) limb.parent = number[limb.parent];
    std::erase_if(limbs_, [](const Limb& limb) { return limb.axis.empty(); });
  }

 private:
  struct Gap {
    PolylineFoot foot;  // on the other's axis
    double length = 0;  // from the base to the other's surface
    double cost = 0;    // longer where it is not straight on
  };

  static double base_radius(const Limb& limb) {
    const auto count = static_cast<std::ptrdiff_t>(std::min(kWindow, limb.radii.size()));
    return upper_median({limb.radii.begin(), limb.radii.begin() + count});
  }

  // Of the base of a limb; its first node may lie on the axis of its parent.
  static std::size_t base(const Limb& limb) { return limb.axis.size() > 2 && limb.parent != kNone ? 1 : 0; }

  static Vec3 direction(const std::vector<Vec3>& axis, std::size_t from, double reach) {
    std::size_t to = from + 1;
    while (to + 1 < axis.size() && norm(axis[to] - axis[from]) < reach) ++to;
    return unit(axis[to] - axis[from]);
  }

  static Vec3 direction_back(const std::vector<Vec3>& axis, std::size_t from, double reach) {
    std::size_t to = from - 1;
    while (to > 0 && norm(axis[to] - axis[from]) < reach) --to;
    return unit(axis[from] - axis[to]);
  }

  Gap gap_to(const Limb& limb, const Limb& other) const {
    const std::size_t k = base(limb);
    const Vec3 start = limb.axis[k];
    const double radius = base_radius(limb);
    const Vec3 ahead = direction(limb.axis, k, kTangent * (radius + noise_));
    Gap best;
    best.cost = std::numeric_limits<double>::infinity();
    const double reach = nearest_on_polyline(other.axis, start).distance;
    for (int step = 0; step <= 8; ++step) {
      const PolylineFoot foot = nearest_on_polyline(other.axis, start - (step * 0.25 * reach) * ahead);
      const Vec3 way = start - foot.point;
      const double distance = norm(way);
      const double gap = std::max(0.0, distance - value_at(other.radii, foot));
      const double cost = gap * (1 + kTurn * (1 - (distance > 0 ? dot(way, ahead) / distance : 1)));
      if (cost < best.cost) best = {foot, gap, cost};
    }
    return best;
  }

  Index best_parent(Index b) const {
    const Limb& limb = limbs_[b];
    const double radius = base_radius(limb);
    Index best = kNone;
    double least = kBetter * gap_to(limb, limbs_[limb.parent]).cost;
    for (std::size_t q = 0; q < limbs_.size(); ++q) {
      if (q == b || q == limb.parent || descends(static_cast<Index>(q), b)) continue;
      const Gap gap = gap_to(limb, limbs_[q]);
      if (!(gap.cost < least) || value_at(limbs_[q].radii, gap.foot) < kThinner * radius) continue;
      least = gap.cost;
      best = static_cast<Index>(q);
    }
    return best;
  }

  bool descends(Index limb, Index from) const {
    for (; limb != kNone; limb = limbs_[limb].parent)
      if (limb == from) return true;
    return false;
  }

  // The part from node k on becomes a limb on the rest; its number.
  Index split(Index b, std::size_t k) {
    const auto name = static_cast<Index>(limbs_.size());
    Limb outer;
    Limb& inner = limbs_[b];
    const std::vector<Vec3> axis = inner.axis;
    const auto at = static_cast<std::ptrdiff_t>(k);
    outer.axis.assign(axis.begin() + at, axis.end());
    outer.radii.assign(inner.radii.begin() + at, inner.radii.end());
    outer.parent = b;
    if (outer.axis.size() < 2) {
      outer.axis.insert(outer.axis.begin(), axis[k - 1]);
      outer.radii.insert(outer.radii.begin(), outer.radii.front());
    }
    inner.axis.resize(k + 1);
    inner.radii.resize(k + 1);
    const auto beyond = [&](const Vec3& p) { return nearest_on_polyline(axis, p).segment >= k; };
    std::vector<Index> own;
    for (const Index i : inner.points) (beyond(points_[i]) ? outer.points : own).push_back(i);
    inner.points = std::move(own);
    for (Limb& child : limbs_)
      if (child.parent == b && beyond(child.axis.front())) child.parent = name;
    limbs_.push_back(std::move(outer));
    return name;
  }

  // Limb r goes on where limb b ends.
  void append(Index b, Index r) {
    Limb& branch = limbs_[b];
    Limb& rest = limbs_[r];
    const auto from = static_cast<std::ptrdiff_t>(base(rest));
    branch.axis.insert(branch.axis.end(), rest.axis.begin() + from, rest.axis.end());
    branch.radii.insert(branch.radii.end(), rest.radii.begin() + from, rest.radii.end());
    std::vector<Index> all;
    std::merge(branch.points.begin(), branch.points.end(), rest.points.begin(), rest.points.end(),
               std::back_inserter(all));
    branch.points = std::move(all);
    rest = {};
    for (Limb& child : limbs_)
      if (child.parent == r) child.parent = b;
  }

  // Longest path from each limb's base to a tip.
  std::vector<double> longest_paths() const {
    std::vector<double> heights(limbs_.size(), 0);
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      double length = polyline_length(limbs_[b].axis);
      Index at = static_cast<Index>(b);
      heights[b] = std::max(heights[b], length);
      while (limbs_[at].parent != kNone) {
        const Limb& parent = limbs_[limbs_[at].parent];
        const PolylineFoot foot = nearest_on_polyline(parent.axis, limbs_[at].axis.front());
        for (std::size_t k = 0; k < foot.segment; ++k) length += norm(parent.axis[k + 1] - parent.axis[k]);
        at = limbs_[at].parent;
        heights[at] = std::max(heights[at], length);
      }
    }
    return heights;
  }

  // Whether a limb that starts at the tip of a branch is its continuation.
  bool lines_up(const Limb& branch, const Limb& rest) const {
    const double radius = branch.radii.back() + noise_;
    const Vec3 before = direction_back(branch.axis, branch.axis.size() - 1, kTangent * radius);
    return dot(before, direction(rest.axis, base(rest), kTangent * radius)) > 0.8;
  }

  bool goes_on(const Limb& branch, std::size_t k, const Limb& rest, double height) const {
    const double length = polyline_length({branch.axis.begin() + static_cast<std::ptrdiff_t>(k), branch.axis.end()});
    if (height < kSwapLength * length) return false;
    const auto window = [&](std::size_t begin, std::size_t end) {
      const auto at = [&](std::size_t i) { return branch.radii.begin() + static_cast<std::ptrdiff_t>(i); };
      return upper_median({at(begin), at(std::max(end, begin + 1))});
    };
    const double before = window(k > kWindow ? k - kWindow : 0, k);
    const double after = window(k, std::min(k + kWindow, branch.radii.size()));
    const double reach = kTangent * (before + noise_);
    const Vec3 from = direction_back(branch.axis, k, reach);
    const auto score = [&](const Vec3& way, double radius) { return dot(from, way) + std::min(1.0, radius / before); };
    return score(direction(rest.axis, base(rest), reach), base_radius(rest)) >
           score(direction(branch.axis, k, reach), after) + kSwapScore;
  }

  const std::vector<Vec3>& points_;
  double noise_;
  std::vector<Limb>& limbs_;
};

}  // namespace

void reattach_limbs(const std::vector<Vec3>& points, double noise, std::vector<Limb>& limbs) {
  Reattachment reattachment(points, noise, limbs);
  reattachment.find_parents();
  reattachment.swap_at_forks();
  reattachment.tidy();
}

}  // namespace bisector
