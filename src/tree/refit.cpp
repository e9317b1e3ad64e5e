#include "tree/refit.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "spatial/kd_tree.h"
#include "tree/near_axis.h"
#include "tree/polyline.h"
#include "tree/support.h"
#include "tree/trim.h"
#include "tree/tube_fit.h"

namespace bisector {
namespace {

constexpr std::size_t kLeastPoints = 20;  // for a tube
constexpr double kReach = 2;              // of a limb's points from its axis, in radii and with the tolerance added
constexpr double kOwnNoise = 1.2;         // noise taken out of a radius, in the deviation of the branch's own points
constexpr double kMostRatio = 2;          // of a fitted radius and that of the pipe model, either way
constexpr double kTangent = 2;  // length that tells a branch's direction at its base, in that to the parent's axis
constexpr int kRootSteps = 16;  // places looked at straight on backwards, over as much
constexpr double kBend = 3;     // length over which an axis is straight, in radii

// Each point's nearest limb by the distance from its surface, inside counting half.
std::vector<std::vector<Index>> share_out(const std::vector<Vec3>& points, double tolerance,
                                          const std::vector<Limb>& limbs) {
  std::vector<Index> limb_of(points.size(), kNone);
  std::vector<double> least(points.size(), std::numeric_limits<double>::infinity());
  const PointSet set{points};
  const KdTree tree(3, set);
  for (std::size_t b = 0; b < limbs.size(); ++b) {
    const Limb& limb = limbs[b];
    const auto reach = [&](std::size_t k) { return kReach * std::max(limb.radii[k], limb.radii[k + 1]) + tolerance; };
    visit_near(tree, points, limb.axis, reach, [&](Index i, const PolylineFoot& foot) {
      const double off = foot.distance - value_at(limb.radii, foot);
      const double cost = off > 0 ? off : -0.5 * off;
      if (!(cost < least[i])) return;
      least[i] = cost;
      limb_of[i] = static_cast<Index>(b);
    });
  }
  std::vector<std::vector<Index>> members(limbs.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (limb_of[i] != kNone) members[limb_of[i]].push_back(static_cast<Index>(i));
  return members;
}

void confirm(const std::vector<Vec3>& points, double noise, const Limb& expected, Limb& limb) {
  limb.fitted = supported_radii(points, limb, noise);
  for (std::size_t k = 0; k < limb.axis.size(); ++k) {
    const double radius = value_at(expected.radii, nearest_on_polyline(expected.axis, limb.axis[k]));
    if (limb.radii[k] > kMostRatio * radius || limb.radii[k] < radius / kMostRatio) limb.fitted[k] = 0;
  }
}

double length_to(const Limb& limb, std::size_t end) {
  double length = 0;
  for (std::size_t k = 1; k < end; ++k) length += norm(limb.axis[k] - limb.axis[k - 1]);
  return length;
}

void refit(const std::vector<Vec3>& points, double noise, double hidden, Limb& limb) {
  if (limb.points.size() < kLeastPoints) return;
  std::vector<Vec3> own;
  for (const Index i : limb.points) own.push_back(points[i]);
  Tube tube = fit_tube(own, limb.axis, noise);
  Limb fitted;
  fitted.axis = std::move(tube.axis);
  fitted.radii = std::move(tube.radii);
  fitted.points = limb.points;
  confirm(points, noise, limb, fitted);
  remove_noise(std::min(noise, kOwnNoise * tube.deviation), fitted.radii);
  const std::size_t last = fitted_end(fitted, hidden);
  if (last < 2 || length_to(fitted, last) <= length_to(limb, fitted_end(limb, hidden))) return;
  const PolylineFoot foot = nearest_on_polyline(limb.axis, fitted.axis[last - 1]);
  fitted.axis.resize(last);
  fitted.radii.resize(last);
  fitted.fitted.resize(last);
  for (std::size_t k = foot.segment + 1; k < limb.axis.size(); ++k) {
    if (norm(limb.axis[k] - fitted.axis.back()) < fitted.radii[last - 1]) continue;
    fitted.axis.push_back(limb.axis[k]);
    fitted.radii.push_back(0);
    fitted.fitted.push_back(0);
  }
  fitted.parent = limb.parent;
  limb = std::move(fitted);
}

// Near a fork a way follows the surface of the parent: what is inside it goes, and the rest, straight on backwards,
// begins where it comes nearest to the parent's axis.
void root(const Limb& parent, double tolerance, Limb& limb) {
  std::size_t inside = 1;
  for (; inside + 2 < limb.axis.size() && !limb.fitted[inside]; ++inside) {
    const PolylineFoot foot = nearest_on_polyline(parent.axis, limb.axis[inside]);
    if (foot.distance > value_at(parent.radii, foot) + tolerance) break;
  }
  const auto gone = static_cast<std::ptrdiff_t>(inside - 1);
  limb.axis.erase(limb.axis.begin(), limb.axis.begin() + gone);
  limb.radii.erase(limb.radii.begin(), limb.radii.begin() + gone);
  limb.fitted.erase(limb.fitted.begin(), limb.fitted.begin() + gone);
  const Vec3 start = limb.axis[1];
  PolylineFoot best = nearest_on_polyline(parent.axis, start);
  const double reach = kTangent * best.distance;
  std::size_t ahead = 1;
  while (ahead + 1 < limb.axis.size() && norm(limb.axis[ahead] - start) < reach) ++ahead;
  if (ahead > 1) {
    const Vec3 back = unit(start - limb.axis[ahead]);
    for (int k = 1; k <= kRootSteps; ++k) {
      const PolylineFoot foot = nearest_on_polyline(parent.axis, start + (reach * k / kRootSteps) * back);
      if (foot.distance < best.distance) best = foot;
    }
  }
  limb.axis.front() = best.point;
  limb.fitted.front() = 0;
}

// Where the axis' points would lie in the middle of the limb's points beside them.
std::vector<Vec3> centred(const std::vector<Vec3>& points, const Limb& limb) {
  std::vector<Vec3> middle = limb.axis;
  std::vector<double> count(limb.axis.size(), 1);
  for (const Index i : limb.points) {
    const PolylineFoot foot = nearest_on_polyline(limb.axis, points[i]);
    const std::size_t k = foot.segment + (foot.t > 0.5);
    middle[k] += limb.axis[k] + (points[i] - foot.point);
    ++count[k];
  }
  for (std::size_t k = 0; k < middle.size(); ++k) middle[k] *= 1 / count[k];
  return middle;
}

void straighten(const std::vector<Vec3>& points, Limb& limb) {
  const auto m = static_cast<Eigen::Index>(limb.axis.size());
  if (m < 3) return;
  const std::vector<Vec3> middle = centred(points, limb);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd right(m, 3);
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double weight = k == 0 || k + 1 == m ? 1e3 : limb.fitted[at] ? 10.0 : 1.0;
    entries.emplace_back(k, k, weight);
    const Vec3& target = k == 0 || limb.fitted[at] ? limb.axis[at] : middle[at];
    for (int c = 0; c < 3; ++c) right(k, c) = weight * target[c];
  }
  for (Eigen::Index k = 1; k + 1 < m; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (limb.fitted[at]) continue;
    const double before = norm(limb.axis[at] - limb.axis[at - 1]), after = norm(limb.axis[at + 1] - limb.axis[at]);
    if (!(before > 0 && after > 0)) continue;
    const double step = 0.5 * (before + after), stiffness = std::pow(kBend * limb.radii[at] / step, 4);
    const double row[3] = {after / step, -2, before / step};
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j) entries.emplace_back(k + i, k + j, stiffness * row[i + 1] * row[j + 1]);
  }
  Eigen::SparseMatrix<double> matrix(m, m);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  const Eigen::MatrixXd x = solver.solve(right);
  if (solver.info() != Eigen::Success || !x.allFinite()) return;
  for (Eigen::Index k = 0; k < m; ++k)
    for (int c = 0; c < 3; ++c) limb.axis[static_cast<std::size_t>(k)][c] = x(k, c);
}

}  // namespace

void confirm_radii(const std::vector<Vec3>& points, double noise, const std::vector<Limb>& expected,
                   std::vector<Limb>& limbs) {
  parallel_each(
      limbs.size(), [&](std::size_t b) { confirm(points, noise, expected[b], limbs[b]); }, 1);
}

void refit_limbs(const std::vector<Vec3>& points, double tolerance, double noise, std::vector<Limb>& limbs,
                 const Context& context) {
  std::vector<std::vector<Index>> members = share_out(points, tolerance, limbs);
  std::vector<double> hidden(limbs.size(), 0);
  for (std::size_t b = 0; b < limbs.size(); ++b)
    if (limbs[b].parent != kNone) {
      const Limb& parent = limbs[limbs[b].parent];
      hidden[b] = value_at(parent.radii, nearest_on_polyline(parent.axis, limbs[b].axis.front()));
    }
  parallel_each(
      limbs.size(),
      [&](std::size_t b) {
        context.check();
        limbs[b].points = std::move(members[b]);
        refit(points, noise, hidden[b], limbs[b]);
      },
      1);
}

void straighten_limbs(const std::vector<Vec3>& points, double tolerance, std::vector<Limb>& limbs) {
  for (Limb& limb : limbs) {
    if (limb.parent != kNone) root(limbs[limb.parent], tolerance, limb);
    straighten(points, limb);
  }
}

}  // namespace bisector
