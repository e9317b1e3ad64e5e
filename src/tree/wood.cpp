#include "tree/wood.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "spatial/kd_tree.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr double kReach = 9;                  // of a line to both sides, in spacings of the points
constexpr int kCells = 8;                     // of the line
constexpr double kLink = 2.5;                 // spacings between neighbours on a branch, at most
constexpr int kRounds = 2;                    // the second asks only what the first has taken for wood
constexpr double kFalseAlarms = 0.1;          // lines through a point that chance may bring, at most
constexpr double kAway = 3;                   // tolerances that a point is off another, at least, to tell a direction
constexpr std::size_t kMostDirections = 256;  // that are tried: farther points tell none that nearer ones do not

// Median distance of points from their second neighbours.
double spacing_of(const std::vector<Vec3>& points) {
  const PointSet set{points};
  const KdTree tree(3, set);
  std::vector<double> second(points.size());
  parallel_each(points.size(), [&](std::size_t i) {
    const double at[3] = {points[i].x, points[i].y, points[i].z};
    std::array<Index, 3> near{};
    std::array<double, 3> squared{};
    tree.knnSearch(at, 3, near.data(), squared.data());
    second[i] = std::sqrt(squared[2]);
  });
  return quantile(std::move(second), 0.5);
}

// The chance that at least `count` of a line's cells are occupied, of which one is, since a point there gave the line.
double chance_of(int count, double occupied) {
  constexpr int kOthers = kCells - 1;
  double sum = 0, choose = 1;
  for (int k = 0; k <= kOthers; ++k) {
    if (k + 1 >= count) sum += choose * std::pow(occupied, k) * std::pow(1 - occupied, kOthers - k);
    choose *= static_cast<double>(kOthers - k) / (k + 1);
  }
  return sum;
}

class Lines {
 public:
  Lines(const std::vector<Vec3>& points, double spacing, double tolerance)
      : points_(points), set_{points}, tree_(3, set_), link_(kLink * spacing), reach_(kReach * spacing),
        tolerance_(tolerance), cell_(2 * tolerance) {
    DisjointSets<Index> sets(points.size());
    std::vector<std::pair<Index, double>> found;
    for (std::size_t i = 0; i < points.size(); ++i) {
      search(points[i], link_, found);
      for (const auto& [j, squared] : found) sets.join(static_cast<Index>(i), j);
    }
    for (std::size_t i = 0; i < points.size(); ++i) part_.push_back(sets.root(static_cast<Index>(i)));
  }

  // Of a place that may be one of the points.
  bool holds(const Vec3& place) const {
    std::vector<std::pair<Index, double>> found;
    search(place, reach_, found);
    std::sort(found.begin(), found.end());
    Index part = kNone;  // that of the nearest other point
    double least = link_ * link_;
    for (const auto& [j, squared] : found)
      if (squared > 0 && squared < least) {
        least = squared;
        part = part_[j];
      }
    if (part == kNone) return false;
    std::vector<Vec3> offsets;
    for (const auto& [j, squared] : found)
      if (squared > 0 && part_[j] == part) offsets.push_back(points_[j] - place);
    std::vector<Vec3> directions = apart(offsets);
    const double length = 2 * reach_ / kCells;
    const double all = 4.0 / 3 * std::numbers::pi * std::pow(reach_ / cell_, 3);
    const double occupied = std::min(1.0, static_cast<double>(directions.size()) / all * length / cell_);
    std::erase_if(directions, [&](const Vec3& d) { return norm(d) < kAway * tolerance_; });
    const auto tests = static_cast<double>(std::max<std::size_t>(directions.size(), 1));
    if (directions.size() > kMostDirections) {
      std::stable_sort(directions.begin(), directions.end(),
                       [](const Vec3& a, const Vec3& b) { return norm2(a) < norm2(b); });
      directions.resize(kMostDirections);
    }
    int most = 0;
    for (const Vec3& d : directions) most = std::max(most, cells_along(unit(d), offsets));
    return tests * chance_of(most, occupied) < kFalseAlarms;
  }

 private:
  void search(const Vec3& place, double radius, std::vector<std::pair<Index, double>>& found) const {
    const double at[3] = {place.x, place.y, place.z};
    found.clear();
    tree_.radiusSearch(at, radius * radius, found, nanoflann::SearchParams(32, 0, false));
  }

  // One of the points in each cell of a grid.
  std::vector<Vec3> apart(const std::vector<Vec3>& offsets) const {
    using Cell = std::array<std::int64_t, 3>;
    std::vector<std::pair<Cell, std::size_t>> cells;
    for (std::size_t k = 0; k < offsets.size(); ++k) {
      Cell cell;
      for (int c = 0; c < 3; ++c) cell[c] = static_cast<std::int64_t>(std::floor(offsets[k][c] / cell_));
      cells.emplace_back(cell, k);
    }
    std::sort(cells.begin(), cells.end());
    std::vector<Vec3> result;
    for (std::size_t k = 0; k < cells.size(); ++k)
      if (k == 0 || cells[k].first != cells[k - 1].first) result.push_back(offsets[cells[k].second]);
    return result;
  }

  int cells_along(const Vec3& direction, const std::vector<Vec3>& offsets) const {
    std::uint32_t cells = 0;
    for (const Vec3& d : offsets) {
      const double along = dot(d, direction);
      if (norm2(d) - along * along > tolerance_ * tolerance_) continue;
      const int cell = static_cast<int>((along + reach_) / (2 * reach_) * kCells);
      cells |= std::uint32_t{1} << std::clamp(cell, 0, kCells - 1);
    }
    return std::popcount(cells);
  }

  const std::vector<Vec3>& points_;
  PointSet set_;
  KdTree tree_;
  std::vector<Index> part_;  // of each point: points that steps between neighbours lead to
  double link_, reach_, tolerance_, cell_;
};

}  // namespace

std::vector<char> points_on_lines(const std::vector<Vec3>& points, const std::vector<char>& asked, double tolerance) {
  std::vector<char> wood(points.size(), 1);
  if (points.size() < 3) return wood;
  const double spacing = spacing_of(points);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Vec3> taken;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (wood[i]) taken.push_back(points[i]);
    const Lines lines(taken, spacing, tolerance);
    parallel_each(points.size(), [&](std::size_t i) { wood[i] = !asked[i] || lines.holds(points[i]); });
  }
  return wood;
}

}  // namespace bisector
