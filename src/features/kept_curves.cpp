#include "features/kept_curves.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/shortest_ways.h"
#include "features/curve_network.h"

namespace bisector {

void KeptCurves::keep(const Candidate& candidate) {
  const auto c = static_cast<Index>(curves_.size());
  for (const Sample& sample : samples(candidate)) points_[box_of(sample.point)].push_back({sample, c});
  const std::vector<Index>& chain = candidate.curve.vertices;
  curves_.push_back({chain.front(), chain.back(), candidate.length, candidate.curve.closed});
  if (candidate.curve.closed) return;
  at_[chain.front()].push_back(c);
  at_[chain.back()].push_back(c);
}

std::vector<char> KeptCurves::beside(const Candidate& candidate, const std::vector<Sample>& samples) const {
  const std::vector<Index>& chain = candidate.curve.vertices;
  const bool closed = candidate.curve.closed;
  const Ways from_start = closed ? Ways{} : ways(chain.front()), from_end = closed ? Ways{} : ways(chain.back());
  std::vector<char> is_beside;
  for (const auto& [point, at] : samples) {
    char beside = 0;
    each_near(point, [&, at = at](const Point& other, double distance) {
      const double way = std::min(at + way_to(other, from_start), candidate.length - at + way_to(other, from_end));
      beside |= way > kDetour * distance;
    });
    is_beside.push_back(beside);
  }
  return is_beside;
}

bool KeptCurves::is_near(const Vec3& p) const {
  bool near = false;
  each_near(p, [&](const Point&, double) { near = true; });
  return near;
}

KeptCurves::Box KeptCurves::box_of(const Vec3& p) const {
  const auto along = [&](double x) { return static_cast<std::int64_t>(std::floor(x / width_)); };
  return {along(p.x), along(p.y), along(p.z)};
}

// Calls body(point, distance) for the points within the width.
template <class Body>
void KeptCurves::each_near(const Vec3& p, const Body& body) const {
  const Box middle = box_of(p);
  for (std::int64_t x = -1; x <= 1; ++x)
    for (std::int64_t y = -1; y <= 1; ++y)
      for (std::int64_t z = -1; z <= 1; ++z) {
        const auto box = points_.find({middle[0] + x, middle[1] + y, middle[2] + z});
        if (box == points_.end()) continue;
        for (const Point& point : box->second)
          if (const double distance = norm(point.sample.point - p); distance < width_) body(point, distance);
      }
}

// From a corner to others along what stays, as far as a detour matters.
KeptCurves::Ways KeptCurves::ways(Index corner) const {
  Ways shortest;
  const auto links = [&](Index v, const auto& visit) {
    const auto arms = at_.find(v);
    if (arms == at_.end()) return;
    for (const Index c : arms->second)
      visit(curves_[c].first == v ? curves_[c].last : curves_[c].first, curves_[c].length, c);
  };
  shortest_ways(corner, kDetour * width_, links,
                [&](Index v, double length, Index, Index) { return shortest.try_emplace(v, length).second; });
  return shortest;
}

double KeptCurves::way_to(const Point& point, const Ways& ways) const {
  double least = std::numeric_limits<double>::infinity();
  const Curve& curve = curves_[point.curve];
  if (curve.closed) return least;
  if (const auto first = ways.find(curve.first); first != ways.end()) least = first->second + point.sample.position;
  if (const auto last = ways.find(curve.last); last != ways.end())
    least = std::min(least, last->second + curve.length - point.sample.position);
  return least;
}

}  // namespace bisector
