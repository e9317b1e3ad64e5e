#include "tree/refine.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>

#include "core/parallel.h"
#include "tree/polyline.h"
#include "tree/reattach.h"
#include "tree/support.h"
#include "tree/tube_fit.h"

namespace bisector {
namespace {

// Which points belong to a surface: those within so many standard deviations of the noise, and so many radii, of it.
constexpr double kSurface = 2.2;
constexpr double kOutOfRound = 0.1;

// Which branches stand out of their parent. Noise is in standard deviations of points off surfaces.
constexpr std::size_t kLeastPoints = 6;  // outside the parent
constexpr std::size_t kFewPoints = 2;    // that are enough if they are this many times as far outside as needed:
constexpr double kFarProtrusion = 3;
constexpr double kLeastProtrusion = 1;  // in the branch's own radii, beyond the surface of its parent
constexpr double kThickestTwig = 1;     // the same in noise, whichever is less: thinner twigs may be lost
constexpr double kBump = 0.3;           // in radii of the parent: forks and bark stick out so far

// Which branch is a part of another, not its parent: most of its points lie on that one's surface, and few far from it.
constexpr double kTwinShare = 0.6;
constexpr std::size_t kFarShare = 10;     // one of the points in so many may be far
constexpr std::size_t kTwinSamples = 64;  // points looked at

// Where a branch starts on its parent.
constexpr double kLeastSupport = 2;  // points of the node of the axis that is taken for the base
constexpr double kTangent = 6;       // length in radii that tells the direction at the base
constexpr int kRootSteps = 24;       // places looked at straight on backwards
constexpr double kRootReach = 3;     // up to so many times the base's distance from the parent's axis

// Radii.
constexpr double kOwnNoise = 1.2;   // noise taken out of a radius, in the deviation of the branch's own points, at most
constexpr double kWider = 1.3;      // of a radius over those nearer to the base, at most
constexpr double kUnfitted = 1e-3;  // weight of a radius that does not rest on points

class Refinement {
 public:
  Refinement(const std::vector<Vec3>& points, const Csr<Index>& neighbours, std::vector<Limb> limbs,
             const RefineOptions& options, const Context& context)
      : points_(points), neighbours_(neighbours), limbs_(std::move(limbs)), options_(options), context_(context),
        merged_(limbs_.size(), 0), support_(limbs_.size()), deviation_(limbs_.size(), 0) {}

  void fit_all() {
    parallel_each(
        limbs_.size(), [&](std::size_t b) { fit(b); }, 1);
  }

  // Children's points in their parent's surface go to the parent; children with hardly any others are merged.
  void merge() {
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      Limb& limb = limbs_[b];
      if (merged_[b] || limb.parent == kNone) continue;
      while (merged_[limb.parent]) limb.parent = limbs_[limb.parent].parent;
      Limb& parent = limbs_[limb.parent];
      std::vector<Index> inside, outside;
      std::vector<double> protrusion;
      const std::vector<Place> places = place_points(limb, parent);
      const double exit = exit_length(places);
      for (const Place& place : places) {
        if (place.inside && place.along <= exit) {
          inside.push_back(place.point);
        } else {
          outside.push_back(place.point);
          protrusion.push_back(place.out - kBump * place.parent_radius);
        }
      }
      const double own = quantile(limb.radii, 0.5);
      const double skin = skin_of(own);
      const bool stands_out = (outside.size() >= kLeastPoints && quantile(protrusion, 0.9) > skin) ||
                              (outside.size() >= kFewPoints && quantile(protrusion, 0.5) > kFarProtrusion * skin);
      if (!stands_out) {
        inside = std::move(limb.points);
        limb.points.clear();
        merged_[b] = 1;
      } else {
        limb.points = std::move(outside);
        cut_base(limb, exit);
      }
      give(inside, parent);
    }
  }

  // Branches that run on the surface of another one, not their parent, are parts of it too.
  void merge_twins() {
    std::vector<Box> boxes(limbs_.size());
    for (std::size_t b = 0; b < limbs_.size(); ++b) boxes[b] = bounding_box(limbs_[b].axis);
    std::vector<Index> twin(limbs_.size(), kNone);
    parallel_each(
        limbs_.size(),
        [&](std::size_t b) {
          if (!merged_[b] && limbs_[b].parent != kNone) twin[b] = find_twin(b, boxes);
        },
        1);
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      if (twin[b] == kNone) continue;
      Index into = twin[b];
      while (merged_[into]) into = limbs_[into].parent;
      if (descends(into, static_cast<Index>(b))) continue;
      give(limbs_[b].points, limbs_[into]);
      limbs_[b].points.clear();
      limbs_[b].parent = into;
      merged_[b] = 1;
    }
  }

  // Radii without the noise in them, falling from base to tip and from parent to child.
  void denoise_radii() {
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      Limb& limb = limbs_[b];
      const double noise = std::min(options_.noise, kOwnNoise * deviation_[b]);  // rough bark tells nothing of twigs
      limb.fitted = supported_radii(points_, limb, options_.noise);
      reject_wider(limb);
      remove_noise(noise, limb.radii);
      std::vector<double> weights = support_[b];
      for (std::size_t k = 0; k < weights.size(); ++k)
        weights[k] = (weights[k] + 0.01) * (limb.fitted[k] ? 1 : kUnfitted);
      limb.radii = non_increasing(limb.radii, weights);
      if (limb.parent == kNone) continue;
      const Limb& parent = limbs_[limb.parent];
      const double most = value_at(parent.radii, nearest_on_polyline(parent.axis, limb.axis.front()));
      for (double& r : limb.radii) r = std::min(r, most);
    }
  }

  // Makes each child start where its free part, straight on backwards, meets its parent's axis. Near a fork its points
  // are in its parent's clusters, and the skeleton leads into it from too far below.
  void root_all() {
    for (std::size_t b = 0; b < limbs_.size(); ++b)
      if (limbs_[b].parent != kNone) root(b);
  }

  // Points of a parent that are off its surface and on a child's go to the child.
  void return_points() {
    std::vector<std::vector<Index>> children(limbs_.size());
    for (std::size_t b = 0; b < limbs_.size(); ++b)
      if (limbs_[b].parent != kNone) children[limbs_[b].parent].push_back(static_cast<Index>(b));
    std::vector<std::vector<std::pair<Index, Index>>> given(limbs_.size());  // child, point
    parallel_each(
        limbs_.size(),
        [&](std::size_t b) {
          if (children[b].empty()) return;
          for (const Index i : limbs_[b].points) {
            double least = off_surface(limbs_[b], points_[i]);
            if (least <= kSurface * options_.noise) continue;
            Index best = kNone;
            for (const Index child : children[b])
              if (const double off = std::abs(off_surface(limbs_[child], points_[i])); off < least) {
                least = off;
                best = child;
              }
            if (best != kNone && least <= kSurface * options_.noise) given[b].emplace_back(best, i);
          }
        },
        1);
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      if (given[b].empty()) continue;
      std::vector<Index> gone;
      for (const auto& [child, i] : given[b]) {
        gone.push_back(i);
        limbs_[child].points.push_back(i);
      }
      std::vector<Index> left;
      std::set_difference(limbs_[b].points.begin(), limbs_[b].points.end(), gone.begin(), gone.end(),
                          std::back_inserter(left));
      limbs_[b].points = std::move(left);
    }
    for (Limb& limb : limbs_) std::sort(limb.points.begin(), limb.points.end());
  }

  // Points that hang together off the surface of their branch become branches on it.
  void sprout() {
    std::vector<Index> owner(points_.size(), kNone);
    const std::size_t before = limbs_.size();
    parallel_each(
        before,
        [&](std::size_t b) {
          const double skin = skin_of(quantile(limbs_[b].radii, 0.5));
          for (const Index i : limbs_[b].points) {
            const PolylineFoot foot = nearest_on_polyline(limbs_[b].axis, points_[i]);
            if (foot.distance > skin + (1 + kBump) * value_at(limbs_[b].radii, foot)) owner[i] = static_cast<Index>(b);
          }
        },
        1);
    std::vector<char> gone(points_.size(), 0);
    for (std::size_t start = 0; start < points_.size(); ++start) {
      const Index b = owner[start];
      if (b == kNone) continue;
      std::vector<Index> group{static_cast<Index>(start)};
      owner[start] = kNone;
      for (std::size_t at = 0; at < group.size(); ++at)
        for (const Index* j = neighbours_.begin(group[at]); j != neighbours_.end(group[at]); ++j)
          if (owner[*j] == b) {
            owner[*j] = kNone;
            group.push_back(*j);
          }
      if (group.size() < kLeastPoints) continue;
      std::sort(group.begin(), group.end());
      for (const Index i : group) gone[i] = 1;
      limbs_.push_back(sprout_of(limbs_[b], static_cast<Index>(b), std::move(group)));
    }
    for (std::size_t b = 0; b < before; ++b) std::erase_if(limbs_[b].points, [&](Index i) { return gone[i] != 0; });
    merged_.assign(limbs_.size(), 0);
    support_.resize(limbs_.size());
    deviation_.resize(limbs_.size(), 0);
    parallel_each(
        limbs_.size() - before, [&](std::size_t k) { fit(before + k); }, 1);
  }

  void reattach() {
    reattach_limbs(points_, options_.noise, limbs_);
    merged_.assign(limbs_.size(), 0);
    tidy();
  }

  // Leaves out the merged, parents first.
  void tidy() {
    for (Limb& limb : limbs_)
      while (limb.parent != kNone && merged_[limb.parent]) limb.parent = limbs_[limb.parent].parent;
    std::vector<std::vector<Index>> children(limbs_.size());
    std::vector<Index> order;
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
      if (merged_[b]) continue;
      if (limbs_[b].parent == kNone) order.push_back(static_cast<Index>(b));
      else children[limbs_[b].parent].push_back(static_cast<Index>(b));
    }
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::vector<Index>& next = children[order[k]];
      order.insert(order.end(), next.begin(), next.end());
    }
    std::vector<Index> number(limbs_.size(), kNone);
    std::vector<Limb> limbs;
    for (const Index b : order) {
      number[b] = static_cast<Index>(limbs.size());
      limbs.push_back(std::move(limbs_[b]));
      if (limbs.back().parent != kNone) limbs.back().parent = number[limbs.back().parent];
    }
    limbs_ = std::move(limbs);
    merged_.assign(limbs_.size(), 0);
    support_.assign(limbs_.size(), {});
    deviation_.assign(limbs_.size(), 0);
  }

  std::vector<Limb> take() { return std::move(limbs_); }

 private:
  static void give(const std::vector<Index>& points, Limb& limb) {
    std::vector<Index> all;
    std::merge(limb.points.begin(), limb.points.end(), points.begin(), points.end(), std::back_inserter(all));
    limb.points = std::move(all);
  }

  // How far out of a surface what belongs to it may be, for a branch of a radius, which may itself be wrong.
  double skin_of(double radius) const {
    return kSurface * options_.noise + std::min(kLeastProtrusion * radius, kThickestTwig * options_.noise);
  }

  // From the point nearest to the parent's axis to the one farthest from it.
  Limb sprout_of(const Limb& parent, Index name, std::vector<Index> group) const {
    Limb limb;
    limb.parent = name;
    const auto distance = [&](Index i) { return nearest_on_polyline(parent.axis, points_[i]).distance; };
    Index near = group.front();
    for (const Index i : group)
      if (distance(i) < distance(near)) near = i;
    Index far = group.front();
    for (const Index i : group)
      if (norm2(points_[i] - points_[near]) > norm2(points_[far] - points_[near])) far = i;
    limb.axis = {points_[near], points_[far]};
    limb.radii.assign(2, 0);
    limb.points = std::move(group);
    return limb;
  }

  bool descends(Index limb, Index from) const {
    for (; limb != kNone; limb = limbs_[limb].parent)
      if (limb == from) return true;
    return false;
  }

  // Branches do not get wider on the way out: a wider tube is a cloud of twigs.
  void reject_wider(Limb& limb) const {
    double least = std::numeric_limits<double>::infinity();
    if (limb.parent != kNone) {
      const Limb& parent = limbs_[limb.parent];
      least = value_at(parent.radii, nearest_on_polyline(parent.axis, limb.axis.front()));
    }
    for (std::size_t k = 0; k < limb.axis.size(); ++k) {
      if (!limb.fitted[k]) continue;
      if (limb.radii[k] > kWider * least) limb.fitted[k] = 0;
      else least = std::min(least, limb.radii[k]);
    }
  }

  // The limb that holds most of the points of this one in its surface.
  Index find_twin(std::size_t b, const std::vector<Box>& boxes) const {
    const std::vector<Index>& own = limbs_[b].points;
    const std::size_t stride = own.size() / kTwinSamples + 1;
    Index twin = kNone;
    if (own.empty()) return twin;
    Box box{points_[own.front()], points_[own.front()]};
    for (const Index i : own)
      for (int axis = 0; axis < 3; ++axis) {
        box.lo[axis] = std::min(box.lo[axis], points_[i][axis]);
        box.hi[axis] = std::max(box.hi[axis], points_[i][axis]);
      }
    double most = kTwinShare;
    for (std::size_t q = 0; q < limbs_.size(); ++q) {
      if (q == b || merged_[q] || limbs_[q].points.size() <= own.size()) continue;
      const Limb& limb = limbs_[q];
      const double reach =
          *std::max_element(limb.radii.begin(), limb.radii.end()) * (1 + kOutOfRound) + kSurface * options_.noise;
      bool apart = false;
      for (int axis = 0; axis < 3; ++axis)
        apart = apart || box.lo[axis] > boxes[q].hi[axis] + reach || box.hi[axis] < boxes[q].lo[axis] - reach;
      if (apart) continue;
      std::size_t inside = 0, samples = 0, far = 0;
      const double skin = skin_of(quantile(limbs_[b].radii, 0.5));
      for (std::size_t k = 0; k < own.size(); k += stride, ++samples) {
        const Vec3& p = points_[own[k]];
        bool near = true;
        for (int axis = 0; axis < 3; ++axis)
          near = near && p[axis] >= boxes[q].lo[axis] - reach && p[axis] <= boxes[q].hi[axis] + reach;
        if (!near) {
          ++far;
          continue;
        }
        const PolylineFoot foot = nearest_on_polyline(limb.axis, p);
        const double radius = value_at(limb.radii, foot);
        inside += foot.distance <= radius * (1 + kOutOfRound) + kSurface * options_.noise;
        far += foot.distance > radius + skin;
      }
      const double share = samples > 0 ? static_cast<double>(inside) / static_cast<double>(samples) : 0;
      if (share > most && kFarShare * far <= samples) {
        most = share;
        twin = static_cast<Index>(q);
      }
    }
    return twin;
  }

  void fit(std::size_t b) {
    context_.check();
    Limb& limb = limbs_[b];
    std::vector<Vec3> own;
    own.reserve(limb.points.size());
    for (const Index i : limb.points) own.push_back(points_[i]);
    Tube tube = fit_tube(own, limb.axis, options_.noise);
    limb.axis = std::move(tube.axis);
    limb.radii = std::move(tube.radii);
    support_[b] = std::move(tube.support);
    deviation_[b] = tube.deviation;
  }

  static double length_to(const std::vector<Vec3>& axis, const PolylineFoot& foot) {
    double length = foot.t * norm(axis[foot.segment + 1] - axis[foot.segment]);
    for (std::size_t k = 0; k < foot.segment; ++k) length += norm(axis[k + 1] - axis[k]);
    return length;
  }

  struct Place {
    Index point;
    double along;  // the axis of its branch
    double out;    // of the surface of the parent
    double parent_radius;
    bool inside;
  };

  std::vector<Place> place_points(const Limb& limb, const Limb& parent) const {
    std::vector<Place> places;
    for (const Index i : limb.points) {
      const PolylineFoot on_parent = nearest_on_polyline(parent.axis, points_[i]);
      const double radius = value_at(parent.radii, on_parent), out = on_parent.distance - radius;
      places.push_back({i, length_to(limb.axis, nearest_on_polyline(limb.axis, points_[i])), out, radius,
                        out <= kSurface * options_.noise + kOutOfRound * radius});
    }
    return places;
  }

  // The length up to which most of the points of a branch are on the surface of its parent: where those inside
  // outnumber the others most.
  static double exit_length(std::vector<Place> places) {
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return std::tie(a.along, a.point) < std::tie(b.along, b.point); });
    double exit = -1;
    long lead = 0, most = 0;
    for (const Place& place : places) {
      lead += place.inside ? 1 : -2;
      if (lead > most) {
        most = lead;
        exit = place.along;
      }
    }
    return exit;
  }

  // Leaves at least the last segment.
  static void cut_base(Limb& limb, double length) {
    std::size_t k = 0;
    for (; k + 2 < limb.axis.size(); ++k) {
      const double segment = norm(limb.axis[k + 1] - limb.axis[k]);
      if (segment > length) break;
      length -= segment;
    }
    limb.axis.erase(limb.axis.begin(), limb.axis.begin() + static_cast<std::ptrdiff_t>(k));
    limb.radii.erase(limb.radii.begin(), limb.radii.begin() + static_cast<std::ptrdiff_t>(k));
  }

  static double off_surface(const Limb& limb, const Vec3& p) {
    const PolylineFoot foot = nearest_on_polyline(limb.axis, p);
    return foot.distance - value_at(limb.radii, foot);
  }

  void root(std::size_t b) {
    Limb& limb = limbs_[b];
    const Limb& parent = limbs_[limb.parent];
    std::vector<double>& support = support_[b];
    const double own = quantile(limb.radii, 0.5);
    const double least = std::min(kLeastSupport, 0.3 * quantile(support, 0.5));
    std::size_t base = 0;
    while (base + 2 < limb.axis.size() &&
           (support[base] < least || off_surface(parent, limb.axis[base]) < 0.5 * own + options_.noise))
      ++base;
    limb.axis.erase(limb.axis.begin(), limb.axis.begin() + static_cast<std::ptrdiff_t>(base));
    limb.radii.erase(limb.radii.begin(), limb.radii.begin() + static_cast<std::ptrdiff_t>(base));
    support.erase(support.begin(), support.begin() + static_cast<std::ptrdiff_t>(base));
    const PolylineFoot foot = find_root(limb, parent);
    if (norm(foot.point - limb.axis.front()) > 1e-9) {
      limb.axis.insert(limb.axis.begin(), foot.point);
      limb.radii.insert(limb.radii.begin(), limb.radii.front());
      support.insert(support.begin(), 0);
    }
  }

  // The point of the parent's axis that the child's axis, straight on backwards, comes nearest to.
  PolylineFoot find_root(const Limb& limb, const Limb& parent) const {
    const Vec3 start = limb.axis.front();
    const double reach = kTangent * (limb.radii.front() + options_.noise);
    // The line of least squares through the base, by sums over distance.
    Vec3 sum;
    double squares = 0, length = 0;
    for (std::size_t k = 1; k < limb.axis.size(); ++k) {
      length += norm(limb.axis[k] - limb.axis[k - 1]);
      if (k > 1 && length > reach) break;
      sum += length * (limb.axis[k] - start);
      squares += length * length;
    }
    const Vec3 back = -unit(sum);
    PolylineFoot best = nearest_on_polyline(parent.axis, start);
    const double farthest = kRootReach * best.distance;
    double least = best.distance;
    for (int k = 1; k <= kRootSteps; ++k) {
      const PolylineFoot foot = nearest_on_polyline(parent.axis, start + (farthest * k / kRootSteps) * back);
      if (foot.distance < least) {
        least = foot.distance;
        best = foot;
      }
    }
    return best;
  }

  const std::vector<Vec3>& points_;
  const Csr<Index>& neighbours_;
  std::vector<Limb> limbs_;
  const RefineOptions& options_;
  const Context& context_;
  std::vector<char> merged_;
  std::vector<std::vector<double>> support_;
  std::vector<double> deviation_;
};

}  // namespace

std::vector<Limb> refine_limbs(const std::vector<Vec3>& points, const Csr<Index>& neighbours, std::vector<Limb> limbs,
                               const RefineOptions& options, const Context& context) {
  Refinement refinement(points, neighbours, std::move(limbs), options, context);
  for (int pass = 0; pass < options.passes; ++pass) {
    context.check();
    refinement.fit_all();
    if (pass > 0) refinement.sprout();
    refinement.root_all();
    refinement.return_points();
    refinement.merge();
    refinement.merge_twins();
    refinement.tidy();
    if (pass == 0) refinement.reattach();
  }
  refinement.fit_all();
  refinement.sprout();
  refinement.root_all();
  refinement.denoise_radii();
  return refinement.take();
}

}  // namespace bisector
