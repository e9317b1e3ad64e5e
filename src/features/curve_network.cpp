#include "features/curve_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/grouping.h"
#include "core/parallel.h"
#include "core/shortest_ways.h"
#include "spatial/kd_tree.h"

namespace bisector {

namespace {

// Half of what a gap must grow per length from the corner of its curves to be an angle, and no strip: a little less
// than edges may grow away from a strip (kDetailGradation), so that sizes follow every strip up to its corner.
constexpr double kAcute = 0.15;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The nearest point across a gap from another, which the tree's search narrows down to. Most points within reach are on
// the same stretch of the same curve, and are told without a search along the curves.
class AcrossGap {
 public:
  using DistanceType = double;

  AcrossGap(const CurveNetwork& network, CurveNetwork::Search& search, Index from, double reach)
      : network_(network), search_(search), from_(from), reach_(reach), squared_(reach * reach) {}
  bool addPoint(double squared, Index point) {
    if (!(squared < squared_) || point == from_) return true;
    const double distance = std::sqrt(squared);
    if (network_.along(from_, point) <= kDetour * distance) return true;
    if (!std::exchange(started_, true)) search_.start(from_, kDetour * reach_);
    const CurveNetwork::Way way = search_.to(point);
    if (way.length <= kDetour * distance) return true;
    if (way.corners == 1 && distance >= kAcute * way.length) return true;
    squared_ = squared;
    gap_ = distance;
    return true;
  }
  double worstDist() const { return squared_; }
  bool full() const { return true; }
  double gap() const { return gap_; }

 private:
  const CurveNetwork& network_;
  CurveNetwork::Search& search_;
  Index from_;
  double reach_, squared_;
  double gap_ = kInfinity;
  bool started_ = false;
};

}  // namespace

CurveNetwork::CurveNetwork(const FeatureCurves& curves, double spacing) {
  const std::size_t corners = curves.graph().corners.size();
  for (Index c = 0; c < corners; ++c) points_.push_back(curves.corner(c));
  curve_.assign(corners, kNone);
  position_.assign(corners, 0);
  for (Index c = 0; c < curves.size(); ++c) {
    const double length = curves.length(c);
    const bool closed = curves.closed(c);
    lines_.push_back({curves.ends(c), length});
    const auto parts = std::max<std::size_t>(closed ? 3 : 2, static_cast<std::size_t>(std::ceil(length / spacing)));
    const double part = length / static_cast<double>(parts);
    for (std::size_t k = closed ? 0 : 1; k < parts; ++k) {
      position_.push_back(part * static_cast<double>(k));
      points_.push_back(curves.point(c, position_.back()));
      curve_.push_back(c);
    }
  }
  links_ = group_into_rows<Link>(corners, [&](const auto& put) {
    for (const auto& [ends, length] : lines_) {
      if (ends[0] == kNone) continue;
      put(ends[0], Link{ends[1], length});
      put(ends[1], Link{ends[0], length});
    }
  });
}

double CurveNetwork::along(Index a, Index b) const {
  const Index curve = curve_[a];
  if (curve == kNone || curve != curve_[b]) return kInfinity;
  const Line& line = lines_[curve];
  const double length = std::abs(position_[a] - position_[b]);
  return line.ends[0] == kNone ? std::min(length, line.length - length) : length;
}

CurveNetwork::Search::Search(const CurveNetwork& network)
    : network_(network), to_corner_(network.links_.rows(), Way{kInfinity, 0}) {}

void CurveNetwork::Search::start(Index from, double reach) {
  for (const Index corner : reached_) to_corner_[corner].length = kInfinity;
  reached_.clear();
  from_ = from;
  reach_ = reach;
  const auto links = [&](Index at, const auto& visit) {
    if (network_.curve_[at] != kNone)
      return network_.nearest_corners(at, [&](Index corner, double length) { visit(corner, length, kNone); });
    for (const Link* link = network_.links_.begin(at); link != network_.links_.end(at); ++link)
      visit(link->to, link->length, kNone);
  };
  shortest_ways(from, reach, links, [&](Index at, double length, Index before, Index) {
    if (network_.curve_[at] != kNone) return true;
    const Way way{length, before == kNone || before == from ? 0 : to_corner_[before].corners + 1};
    if (!(way < to_corner_[at])) return false;
    if (std::isinf(to_corner_[at].length)) reached_.push_back(at);
    to_corner_[at] = way;
    return true;
  });
}

CurveNetwork::Way CurveNetwork::Search::to(Index point) const {
  Way best{kInfinity, 0};
  network_.nearest_corners(point, [&](Index corner, double length) {
    const Way& way = to_corner_[corner];
    const bool is_end = corner == from_ || corner == point;
    best = std::min(best, Way{way.length + length, way.corners + (is_end ? 0 : 1)});
  });
  best = std::min(best, Way{network_.along(from_, point), 0});
  return best.length <= reach_ ? best : Way{kInfinity, 0};
}

std::vector<double> curve_gaps(const CurveNetwork& network, const std::vector<double>& reach) {
  const std::vector<Vec3>& points = network.points();
  std::vector<double> gaps(points.size(), kInfinity);
  if (points.empty()) return gaps;
  const PointSet set{points};
  const KdTree tree(3, set);
  constexpr std::size_t kChunk = 1024;
  parallel_chunks(points.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    CurveNetwork::Search search(network);
    for (auto i = static_cast<Index>(begin); i < end; ++i) {
      const double at[3] = {points[i].x, points[i].y, points[i].z};
      AcrossGap across(network, search, i, reach[i]);
      tree.findNeighbors(across, at, nanoflann::SearchParams());
      gaps[i] = across.gap();
    }
  });
  return gaps;
}

}  // namespace bisector
