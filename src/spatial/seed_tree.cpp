#include "spatial/seed_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"

namespace bisector {
namespace {

// Covers the rounding of a squared distance.
constexpr double kMargin = 1 + 1e-12;

inline double gap(double lo, double hi, double other_lo, double other_hi) {
  return std::max(0.0, std::max(lo - other_hi, other_lo - hi));
}

inline double squared_distance(const Box& a, const Box& b) {
  const double x = gap(a.lo.x, a.hi.x, b.lo.x, b.hi.x), y = gap(a.lo.y, a.hi.y, b.lo.y, b.hi.y),
               z = gap(a.lo.z, a.hi.z, b.lo.z, b.hi.z);
  return x * x + y * y + z * z;
}

void include(Box& box, const Box& other) {
  box.lo = {std::min(box.lo.x, other.lo.x), std::min(box.lo.y, other.lo.y), std::min(box.lo.z, other.lo.z)};
  box.hi = {std::max(box.hi.x, other.hi.x), std::max(box.hi.y, other.hi.y), std::max(box.hi.z, other.hi.z)};
}

}  // namespace

void SeedTree::build(const std::vector<Vec3>& points) {
  points_ = &points;
  std::size_t depth = 0;
  const auto next_level = [&](std::size_t children, std::size_t arity, const auto& child) {
    if (levels_.size() == depth) levels_.emplace_back();
    std::vector<Box>& level = levels_[depth++];
    level.resize((children + arity - 1) / arity);
    parallel_each(level.size(), [&](std::size_t i) {
      Box box = child(i * arity);
      for (std::size_t c = i * arity + 1; c < std::min(children, (i + 1) * arity); ++c) include(box, child(c));
      level[i] = box;
    });
  };
  next_level(points.size(), kLeaf, [&](std::size_t i) { return Box{points[i], points[i]}; });
  while (levels_[depth - 1].size() > 1) {
    levels_.reserve(depth + 1);
    const std::vector<Box>& below = levels_[depth - 1];
    next_level(below.size(), kArity, [&](std::size_t i) { return below[i]; });
  }
  levels_.resize(depth);
}

void SeedTree::near(const Box& box, double radius, std::vector<Index>& indices) const {
  const double squared = radius * radius * kMargin;
  const std::size_t top = levels_.size() - 1;
  if (squared_distance(levels_[top][0], box) <= squared) descend(top, 0, box, squared, indices);
}

void SeedTree::descend(std::size_t level, std::size_t node, const Box& box, double squared,
                       std::vector<Index>& indices) const {
  if (level == 0) {
    const std::size_t end = std::min(points_->size(), (node + 1) * kLeaf);
    for (std::size_t i = node * kLeaf; i < end; ++i) indices.push_back(static_cast<Index>(i));
    return;
  }
  const std::vector<Box>& below = levels_[level - 1];
  const std::size_t end = std::min(below.size(), (node + 1) * kArity);
  for (std::size_t child = node * kArity; child < end; ++child)
    if (squared_distance(below[child], box) <= squared) descend(level - 1, child, box, squared, indices);
}

Index SeedTree::nearest(const Vec3& q) const {
  double squared = std::numeric_limits<double>::infinity();
  Index best = 0;
  descend(levels_.size() - 1, 0, q, squared, best);
  return best;
}

void SeedTree::descend(std::size_t level, std::size_t node, const Vec3& q, double& squared, Index& best) const {
  if (level == 0) {
    const std::size_t end = std::min(points_->size(), (node + 1) * kLeaf);
    for (std::size_t i = node * kLeaf; i < end; ++i) {
      const double d = norm2((*points_)[i] - q);
      if (d < squared) {
        squared = d;
        best = static_cast<Index>(i);
      }
    }
    return;
  }
  const std::vector<Box>& below = levels_[level - 1];
  std::array<std::pair<double, std::size_t>, kArity> order;
  std::size_t count = 0;
  const std::size_t end = std::min(below.size(), (node + 1) * kArity);
  for (std::size_t child = node * kArity; child < end; ++child)
    order[count++] = {squared_distance(below[child], {q, q}), child};
  std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t k = 0; k < count; ++k)
    if (order[k].first <= squared * kMargin) descend(level - 1, order[k].second, q, squared, best);
}

void SeedTree::set_values(std::vector<double> values) {
  values_ = std::move(values);
  largest_.resize(levels_.size());
  const auto set_level = [&](std::size_t level, const std::vector<double>& below, std::size_t arity) {
    largest_[level].resize(levels_[level].size());
    parallel_each(largest_[level].size(), [&](std::size_t i) {
      const auto first = below.begin() + static_cast<std::ptrdiff_t>(i * arity);
      const auto end = below.begin() + static_cast<std::ptrdiff_t>(std::min(below.size(), (i + 1) * arity));
      largest_[level][i] = *std::max_element(first, end);
    });
  };
  set_level(0, values_, kLeaf);
  for (std::size_t level = 1; level < levels_.size(); ++level) set_level(level, largest_[level - 1], kArity);
}

double SeedTree::largest_within(const Box& box, double radius) const {
  double largest = 0;
  descend(levels_.size() - 1, 0, box, radius, largest);
  return largest;
}

void SeedTree::descend(std::size_t level, std::size_t node, const Box& box, double radius, double& largest) const {
  const auto within = [&](double value, const Box& of) {
    return value - std::max(0.0, std::sqrt(squared_distance(of, box)) / kMargin - radius);
  };
  if (largest_[level][node] <= largest || within(largest_[level][node], levels_[level][node]) <= largest) return;
  if (level == 0) {
    const std::size_t end = std::min(points_->size(), (node + 1) * kLeaf);
    for (std::size_t i = node * kLeaf; i < end; ++i)
      largest = std::max(largest, within(values_[i], {(*points_)[i], (*points_)[i]}));
    return;
  }
  const std::size_t end = std::min(levels_[level - 1].size(), (node + 1) * kArity);
  for (std::size_t child = node * kArity; child < end; ++child) descend(level - 1, child, box, radius, largest);
}

}  // namespace bisector
