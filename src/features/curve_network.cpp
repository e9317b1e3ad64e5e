#include "features/curve_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "core/grouping.h"
#include "core/parallel.h"
#include "core/shortest_ways.h"
#include "spatial/kd_tree.h"

namespace bisector {

namespace {

// Half of what a gap must grow per length from the corner of its curves to be an angle, and no strip: a little less
// than edges may grow away from a strip (kDetailGradation), so that sizes follow every strip up to its corner.
constexpr double kAcute = 0.15;

}  // namespace

CurveNetwork::CurveNetwork(const FeatureCurves& curves, double spacing) {
  struct Both {
    Index a, b;
    double length;
  };
  std::vector<Both> pairs;
  for (Index c = 0; c < curves.graph().corners.size(); ++c) points_.push_back(curves.corner(c));
  curve_.assign(points_.size(), kNone);
  position_.assign(points_.size(), 0);
  for (Index c = 0; c < curves.size(); ++c) {
    const double length = curves.length(c);
    const bool closed = curves.closed(c);
    const auto parts = std::max<std::size_t>(closed ? 3 : 2, static_cast<std::size_t>(std::ceil(length / spacing)));
    const double part = length / static_cast<double>(parts);
    const auto first = static_cast<Index>(points_.size());
    const auto inner = static_cast<Index>(parts - (closed ? 0 : 1));
    for (Index k = 0; k < inner; ++k) {
      position_.push_back(part * static_cast<double>(closed ? k : k + 1));
      points_.push_back(curves.point(c, position_.back()));
      curve_.push_back(c);
      if (k > 0) pairs.push_back({first + k - 1, first + k, part});
    }
    const auto [start, end] = curves.ends(c);
    if (closed) {
      pairs.push_back({first + inner - 1, first, part});
    } else {
      pairs.push_back({start, first, part});
      pairs.push_back({first + inner - 1, end, part});
    }
  }
  links_ = group_into_rows<Link>(points_.size(), [&](const auto& put) {
    for (const auto& [a, b, length] : pairs) {
      put(a, Link{b, length});
      put(b, Link{a, length});
    }
  });
}

std::vector<CurveNetwork::Way> CurveNetwork::within(Index from, double reach) const {
  std::unordered_map<Index, Index> corners;  // on the ways to the points that were reached
  std::vector<Way> ways;
  const auto links = [&](Index at, const auto& visit) {
    for (const Link* link = links_.begin(at); link != links_.end(at); ++link) visit(link->to, link->length, kNone);
  };
  shortest_ways(from, reach, links, [&](Index at, double length, Index before, Index) {
    const bool by_corner = before != kNone && before != from && curve_[before] == kNone;
    const Index count = before == kNone ? 0 : corners.at(before) + (by_corner ? 1 : 0);
    if (!corners.try_emplace(at, count).second) return false;
    ways.push_back({at, length, count});
    return true;
  });
  std::sort(ways.begin(), ways.end(), [](const Way& a, const Way& b) { return a.to < b.to; });
  return ways;
}

std::vector<double> curve_gaps(const CurveNetwork& network, const std::vector<double>& reach) {
  const std::vector<Vec3>& points = network.points();
  std::vector<double> gaps(points.size(), std::numeric_limits<double>::infinity());
  if (points.empty()) return gaps;
  const PointSet set{points};
  const KdTree tree(3, set);
  constexpr std::size_t kChunk = 64;
  parallel_chunks(points.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::vector<std::pair<Index, double>> near;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3& p = points[i];
      const double q[3] = {p.x, p.y, p.z};
      tree.radiusSearch(q, reach[i] * reach[i], near, nanoflann::SearchParams());
      if (near.size() < 2) continue;
      const std::vector<CurveNetwork::Way> ways = network.within(static_cast<Index>(i), kDetour * reach[i]);
      for (const auto& [other, squared] : near) {
        const double distance = std::sqrt(squared);
        const auto way = std::lower_bound(ways.begin(), ways.end(), other,
                                          [](const CurveNetwork::Way& w, Index to) { return w.to < to; });
        if (other == i) continue;
        if (way != ways.end() && way->to == other) {
          if (way->length <= kDetour * distance) continue;
          if (way->corners == 1 && distance >= kAcute * way->length) continue;
        }
        gaps[i] = distance;
        break;
      }
    }
  });
  return gaps;
}

}  // namespace bisector
