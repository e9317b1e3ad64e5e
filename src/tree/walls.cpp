#include "tree/walls.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "spatial/kd_tree.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr double kStoutest = 0.1;       // diameter of a trunk over the height of its tree, at most
constexpr double kLargeness = 2;        // least width and height of a wall, in that diameter
constexpr double kCubes = 8;            // across the least wall
constexpr double kAround = 2.5;         // surroundings of a cube, in its width
constexpr double kThickness = 0.15;     // of flat surroundings, rms, in a cube's width
constexpr double kBroad = 0.2;          // least ratio of their variances along the plane
constexpr double kUpright = 0.2;        // z of the normal of a wall, at most
constexpr double kTilt = 0.94;          // cosine of the angle between the surroundings' normal and the plane's
constexpr double kOff = 0.3;            // distance of means from the plane, in a cube's width
constexpr double kFilled = 0.5;         // share of the rectangle around
constexpr double kNear = 0.5;           // of a cube's width off the plane: points that tell the noise
constexpr double kBand = 3;             // deviations, at least: points that are the wall's
constexpr std::size_t kLeastCubes = 8;  // that a plane is grown to before it is looked at

using Cube = std::array<std::int64_t, 3>;

struct Plane {
  Vec3 centre, normal;
  double thickness = 0;  // rms
  double broad = 0;      // ratio of the variances along it
};

Plane fit_plane(const std::vector<Vec3>& points, const std::vector<Index>& ids) {
  Vec3 centre;
  for (const Index i : ids) centre += points[i];
  centre *= 1 / static_cast<double>(ids.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Index i : ids) {
    const Vec3 d = points[i] - centre;
    const Eigen::Vector3d e(d.x, d.y, d.z);
    spread += e * e.transpose();
  }
  spread /= static_cast<double>(ids.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  const Eigen::Vector3d n = solver.eigenvectors().col(0), l = solver.eigenvalues();
  return {centre, {n.x(), n.y(), n.z()}, std::sqrt(std::max(l[0], 0.0)), l[2] > 0 ? l[1] / l[2] : 0};
}

// The means of the points in cubes, ascending.
std::vector<Vec3> means_of_cubes(const std::vector<Vec3>& points, double width) {
  std::vector<std::pair<Cube, Index>> cubes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Cube cube;
    for (int k = 0; k < 3; ++k) cube[static_cast<std::size_t>(k)] = std::llround(std::floor(points[i][k] / width));
    cubes.emplace_back(cube, static_cast<Index>(i));
  }
  sort_in_parallel(cubes, std::less<>());
  std::vector<Vec3> means;
  for (std::size_t begin = 0, end; begin < cubes.size(); begin = end) {
    Vec3 sum;
    for (end = begin; end < cubes.size() && cubes[end].first == cubes[begin].first; ++end)
      sum += points[cubes[end].second];
    means.push_back(1 / static_cast<double>(end - begin) * sum);
  }
  return means;
}

// In a plane: across and up.
struct Axes {
  Vec3 across, up;
  explicit Axes(const Vec3& normal) : across(unit(cross(Vec3{0, 0, 1}, normal))), up(cross(normal, across)) {}
  std::pair<double, double> of(const Vec3& d) const { return {dot(d, across), dot(d, up)}; }
};

// Of places in ascending order (Andrew's monotone chain).
double hull_area(const std::vector<std::pair<double, double>>& places) {
  using Place = std::pair<double, double>;
  const auto chain = [](auto begin, auto end) {
    std::vector<Place> line;
    for (auto p = begin; p != end; ++p) {
      while (line.size() > 1) {
        const Place &a = line[line.size() - 2], &b = line.back();
        if ((b.first - a.first) * (p->second - a.second) > (b.second - a.second) * (p->first - a.first)) break;
        line.pop_back();
      }
      line.push_back(*p);
    }
    return line;
  };
  std::vector<Place> hull = chain(places.begin(), places.end());
  const std::vector<Place> back = chain(places.rbegin(), places.rend());
  hull.insert(hull.end(), back.begin() + 1, back.end());
  double twice = 0;
  for (std::size_t k = 0; k + 1 < hull.size(); ++k)
    twice += hull[k].first * hull[k + 1].second - hull[k + 1].first * hull[k].second;
  return 0.5 * std::abs(twice);
}

class WallFinder {
 public:
  WallFinder(const std::vector<Vec3>& points, double height, double width)
      : points_(points), least_(kLargeness * kStoutest * height), width_(width),
        means_(means_of_cubes(points, width)), set_{means_}, tree_(3, set_) {
    near_.resize(means_.size());
    around_.resize(means_.size());
    parallel_each(
        means_.size(),
        [&](std::size_t i) {
          std::vector<std::pair<Index, double>> found;
          const double at[3] = {means_[i].x, means_[i].y, means_[i].z}, reach = kAround * width_;
          tree_.radiusSearch(at, reach * reach, found, nanoflann::SearchParams(32, 0, false));
          for (const auto& [j, squared] : found) near_[i].push_back(j);
          std::sort(near_[i].begin(), near_[i].end());
          around_[i] = fit_plane(means_, near_[i]);
        },
        256);
  }

  std::vector<std::vector<Index>> grow(const Context& context) const {
    std::vector<Index> seeds;
    for (std::size_t i = 0; i < means_.size(); ++i)
      if (is_flat(static_cast<Index>(i))) seeds.push_back(static_cast<Index>(i));
    std::sort(seeds.begin(), seeds.end(), [&](Index a, Index b) {
      return std::pair(around_[a].thickness, a) < std::pair(around_[b].thickness, b);
    });
    std::vector<std::vector<Index>> walls;
    std::vector<char> taken(means_.size(), 0);
    for (std::size_t k = 0; k < seeds.size(); ++k) {
      if (k % 1024 == 0) context.check();
      if (taken[seeds[k]]) continue;
      std::vector<Index> region = grow_from(seeds[k], taken);
      if (region.size() < kLeastCubes || !is_wall(region)) continue;
      walls.push_back(std::move(region));
    }
    return walls;
  }

  // The points of a wall. Those at its cubes tell the noise, by which all in its rectangle are judged: of what is
  // behind a crown pieces are seen that hang on nothing.
  std::vector<Index> points_of(const std::vector<Index>& region) const {
    Plane plane = fit_plane(means_, region);
    const Axes axes(plane.normal);
    const Cells cells(*this, region, plane, axes);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::pair<double, double> lo{kInfinity, kInfinity}, hi{-kInfinity, -kInfinity};
    for (const Index i : region) {
      const auto [u, v] = axes.of(means_[i] - plane.centre);
      lo = {std::min(lo.first, u - width_), std::min(lo.second, v - width_)};
      hi = {std::max(hi.first, u + width_), std::max(hi.second, v + width_)};
    }
    std::vector<Index> inside;
    std::vector<double> off, own;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Vec3 d = points_[i] - plane.centre;
      const double away = dot(d, plane.normal);
      const auto [u, v] = axes.of(d);
      if (std::abs(away) > kNear * width_ || u < lo.first || u > hi.first || v < lo.second || v > hi.second) continue;
      inside.push_back(static_cast<Index>(i));
      off.push_back(away);
      if (cells.near({u, v})) own.push_back(away);
    }
    if (own.empty()) return {};
    const double middle = quantile(own, 0.5);
    for (double& d : own) d = std::abs(d - middle);
    // Of so many points, hardly one is farther off than this (the expected maximum of normal deviates).
    const double deviations = std::sqrt(2 * std::log(static_cast<double>(own.size())));
    const double band = std::max(kBand, deviations) * 1.4826 * quantile(own, 0.5);
    std::vector<Index> result;
    for (std::size_t k = 0; k < inside.size(); ++k)
      if (std::abs(off[k] - middle) <= band) result.push_back(inside[k]);
    return result;
  }

 private:
  // Squares of a plane, as wide as a cube, that it has cubes in.
  class Cells {
   public:
    Cells(const WallFinder& walls, const std::vector<Index>& region, const Plane& plane, const Axes& axes)
        : width_(walls.width_) {
      for (const Index i : region) ++count_[cell(axes.of(walls.means_[i] - plane.centre))];
    }
    std::size_t count() const { return count_.size(); }
    bool near(const std::pair<double, double>& at) const {
      const auto [x, y] = cell(at);
      for (std::int64_t dx = -1; dx <= 1; ++dx)
        for (std::int64_t dy = -1; dy <= 1; ++dy)
          if (count_.contains({x + dx, y + dy})) return true;
      return false;
    }

   private:
    using Cell = std::pair<std::int64_t, std::int64_t>;
    Cell cell(const std::pair<double, double>& at) const {
      return {std::llround(std::floor(at.first / width_)), std::llround(std::floor(at.second / width_))};
    }
    double width_;
    std::map<Cell, std::size_t> count_;
  };

  bool is_flat(Index i) const {
    const Plane& plane = around_[i];
    return near_[i].size() >= kLeastCubes && plane.thickness <= kThickness * width_ && plane.broad >= kBroad &&
           std::abs(plane.normal.z) <= kUpright;
  }

  std::vector<Index> grow_from(Index seed, std::vector<char>& taken) const {
    Plane plane = around_[seed];
    std::vector<Index> region{seed};
    taken[seed] = 1;
    std::size_t fitted = kLeastCubes;
    for (std::size_t k = 0; k < region.size(); ++k) {
      if (region.size() >= 2 * fitted) {
        plane = fit_plane(means_, region);
        fitted = region.size();
      }
      for (const Index j : near_[region[k]]) {
        if (taken[j] || std::abs(dot(means_[j] - plane.centre, plane.normal)) > kOff * width_) continue;
        if (!is_flat(j) || std::abs(dot(around_[j].normal, plane.normal)) < kTilt) continue;
        taken[j] = 1;
        region.push_back(j);
      }
    }
    return region;
  }

  bool is_wall(const std::vector<Index>& region) const {
    const Plane plane = fit_plane(means_, region);
    if (std::abs(plane.normal.z) > kUpright || plane.thickness > kOff * width_) return false;
    const Axes axes(plane.normal);
    std::vector<std::pair<double, double>> places;
    for (const Index i : region) places.push_back(axes.of(means_[i] - plane.centre));
    std::sort(places.begin(), places.end());
    const double width = places.back().first - places.front().first + width_;
    const double filled = static_cast<double>(Cells(*this, region, plane, axes).count()) * width_ * width_;
    return width >= least_ && filled >= kFilled * least_ * width && filled >= kFilled * hull_area(places);
  }

  const std::vector<Vec3>& points_;
  double least_, width_;
  std::vector<Vec3> means_;
  PointSet set_;
  KdTree tree_;
  std::vector<std::vector<Index>> near_;  // cubes around each
  std::vector<Plane> around_;             // what they lie on
};

}  // namespace

Walls find_walls(const std::vector<Vec3>& points, double height, const Context& context) {
  Walls walls;
  walls.wall.assign(points.size(), kNone);
  if (points.size() < kLeastCubes || !(height > 0)) return walls;
  const WallFinder finder(points, height, kLargeness * kStoutest * height / kCubes);
  for (const std::vector<Index>& region : finder.grow(context)) {
    const auto name = static_cast<Index>(walls.count++);
    for (const Index i : finder.points_of(region))
      if (walls.wall[i] == kNone) walls.wall[i] = name;
  }
  return walls;
}

}  // namespace bisector
