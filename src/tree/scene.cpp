#include "tree/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "bisector/error.h"
#include "core/parallel.h"
#include "tree/part_trees.h"
#include "tree/walls.h"

namespace bisector {
namespace {

constexpr std::size_t kLeastPoints = 20;    // of a tree
constexpr std::uint8_t kBuildingClass = 6;  // of LAS
constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

class Division {
 public:
  Division(const std::vector<Vec3>& points, const TreeOptions& options) : points_(points), options_(options) {
    result_.part.assign(points.size(), ScanPart::tree);
    result_.tree.assign(points.size(), kNone);
  }

  void find_ground_of(const Context& context) {
    const bool given = std::isfinite(options_.ground);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (points_[i].z < options_.ground) result_.part[i] = ScanPart::ground;
    known_ = given;
    if (!given) {
      ground_ = find_ground(points_, options_.classes, context);
      known_ = ground_.found;
      result_.ground_noise = ground_.noise;
      for (std::size_t i = 0; known_ && i < points_.size(); ++i)
        if (ground_.is_ground[i]) result_.part[i] = ScanPart::ground;
    }
    if (std::count(result_.part.begin(), result_.part.end(), ScanPart::ground) ==
        static_cast<std::ptrdiff_t>(points_.size()))
      throw Error(
          fmt::format("all {} points are ground; give a scan with a tree, or the ground's height", points_.size()));
    lowest_ = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points_) lowest_ = std::min(lowest_, p.z);
  }

  void find_walls_of(const Context& context) {
    const std::vector<Index> ids = distinct_points();
    std::vector<Vec3> own;
    double height = 0;
    for (const Index i : ids) {
      own.push_back(points_[i]);
      height = std::max(height, height_of(points_[i]));
    }
    const Walls walls = find_walls(own, height, context);
    result_.walls = walls.count;
    for (std::size_t k = 0; k < ids.size(); ++k)
      if (walls.wall[k] != kNone) result_.part[ids[k]] = ScanPart::wall;
    for (std::size_t i = 0; i < options_.classes.size(); ++i)
      if (options_.classes[i] == kBuildingClass) result_.part[i] = ScanPart::wall;
    share_with_twins();
  }

  void find_trees(const Context& context) {
    const std::vector<Index> ids = distinct_points();
    std::vector<Vec3> own;
    std::vector<double> heights;
    for (const Index i : ids) {
      own.push_back(points_[i]);
      heights.push_back(height_of(points_[i]));
    }
    if (own.size() < kLeastPoints) throw Error(no_tree());
    const PartedTrees parted = part_trees(own, heights, known_, context);
    std::vector<std::size_t> size(parted.base.size(), 0);
    for (const Index t : parted.tree)
      if (t != kNone) ++size[t];
    std::vector<Index> order;  // of the trees, largest first
    for (std::size_t t = 0; t < size.size(); ++t)
      if (size[t] >= kLeastPoints) order.push_back(static_cast<Index>(t));
    std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return size[a] > size[b]; });
    if (order.empty() && options_.scene) throw Error(no_tree());
    if (order.empty()) return;
    std::vector<Index> name(size.size(), kNone);
    for (std::size_t k = 0; k < order.size(); ++k) {
      name[order[k]] = options_.scene ? static_cast<Index>(k) : 0;
      if (options_.scene || k == 0) result_.base.push_back(ids[parted.base[order[k]]]);
    }
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const Index t = parted.tree[k];
      result_.tree[ids[k]] = t == kNone ? kNone : name[t];
      if (t == kNone || name[t] == kNone)
        result_.part[ids[k]] = t == kNone && parted.low[k] ? ScanPart::low_plant : ScanPart::stray;
    }
    share_with_twins();
  }

  // All that is left is one tree.
  void take_all() {
    for (std::size_t i = 0; i < points_.size(); ++i)
      result_.tree[i] = result_.part[i] == ScanPart::tree || result_.part[i] == ScanPart::stray ? 0 : kNone;
    for (ScanPart& part : result_.part)
      if (part == ScanPart::stray) part = ScanPart::tree;
  }

  SceneDivision take() {
    if (result_.base.empty()) result_.base.push_back(kNone);
    result_.height = known_ ? options_.ground : kNotKnown;
    if (ground_.found) result_.surface = std::move(ground_.surface);
    return std::move(result_);
  }

  bool ground_is_known() const { return known_; }

 private:
  std::string no_tree() const {
    return fmt::format(
        "no tree found among {} points: nothing narrow rises from the ground; give a scan with stems, or "
        "make no scene of it, and all points are one tree",
        points_.size());
  }

  // Above the ground, or the lowest point.
  double height_of(const Vec3& p) const {
    if (!known_) return p.z - lowest_;
    return p.z - (ground_.found ? ground_.surface.at(p.x, p.y) : options_.ground);
  }

  // Those that are still a tree's, without twins, ascending. twin_ is told of each.
  std::vector<Index> distinct_points() {
    std::vector<Index> order;
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (result_.part[i] == ScanPart::tree) order.push_back(static_cast<Index>(i));
    const auto key = [&](Index i) { return std::tie(points_[i].x, points_[i].y, points_[i].z); };
    sort_in_parallel(order, [&](Index a, Index b) {
      return std::tuple_cat(key(a), std::tie(a)) < std::tuple_cat(key(b), std::tie(b));
    });
    twin_.resize(points_.size());
    std::iota(twin_.begin(), twin_.end(), 0);
    for (std::size_t k = 1; k < order.size(); ++k)
      if (key(order[k - 1]) == key(order[k])) twin_[order[k]] = twin_[order[k - 1]];
    std::erase_if(order, [&](Index i) { return twin_[i] != i; });
    std::sort(order.begin(), order.end());
    return order;
  }

  void share_with_twins() {
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (twin_[i] != i) {
        result_.part[i] = result_.part[twin_[i]];
        result_.tree[i] = result_.tree[twin_[i]];
      }
  }

  const std::vector<Vec3>& points_;
  const TreeOptions& options_;
  Ground ground_;
  bool known_ = false;
  double lowest_ = 0;
  std::vector<Index> twin_;
  SceneDivision result_;
};

}  // namespace

double SceneDivision::ground_at(const Vec3& p) const { return surface.heights.empty() ? height : surface.at(p.x, p.y); }

SceneDivision divide_scene(const std::vector<Vec3>& points, const TreeOptions& options, const Context& context) {
  Division division(points, options);
  division.find_ground_of(context);
  if (options.scene) division.find_walls_of(context);
  if (options.scene || (options.find_ground && division.ground_is_known())) division.find_trees(context);
  if (!options.scene) division.take_all();
  return division.take();
}

}  // namespace bisector
