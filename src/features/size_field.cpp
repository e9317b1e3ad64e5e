#include "features/size_field.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "spatial/hilbert.h"

namespace bisector {

SizeField::SizeField(const std::vector<Vec3>& points, const std::vector<double>& lengths, double gradation)
    : gradation_(gradation), points_(points.size()), lengths_(points.size()) {
  const std::vector<Index> order = hilbert_order(points);
  for (std::size_t k = 0; k < order.size(); ++k) {
    points_[k] = points[order[k]];
    lengths_[k] = lengths[order[k]];
  }
  for (std::size_t n = points_.size(), below = 0;; ++below) {
    const std::size_t width = below == 0 ? kLeaf : kArity;
    std::vector<Node> level((n + width - 1) / width);
    parallel_each(level.size(), [&](std::size_t i) {
      Node& node = level[i];
      for (std::size_t k = i * width; k < std::min(n, (i + 1) * width); ++k) {
        const Node child = below == 0 ? Node{{points_[k], points_[k]}, lengths_[k]} : levels_[below - 1][k];
        if (k == i * width) node = child;
        for (int m = 0; m < 3; ++m) {
          node.box.lo[m] = std::min(node.box.lo[m], child.box.lo[m]);
          node.box.hi[m] = std::max(node.box.hi[m], child.box.hi[m]);
        }
        node.least = std::min(node.least, child.least);
      }
    });
    n = level.size();
    levels_.push_back(std::move(level));
    if (n == 1) break;
  }
}

void SizeField::descend(std::size_t level, std::size_t i, const Vec3& q, double& best, Index& at) const {
  if (level == 0) {
    for (std::size_t k = i * kLeaf; k < std::min(points_.size(), (i + 1) * kLeaf); ++k) {
      const double h = lengths_[k] + gradation_ * norm(q - points_[k]);
      if (h < best) {
        best = h;
        at = static_cast<Index>(k);
      }
    }
    return;
  }
  const std::vector<Node>& below = levels_[level - 1];
  std::array<std::pair<double, std::size_t>, kArity> order;
  std::size_t count = 0;
  for (std::size_t k = i * kArity; k < std::min(below.size(), (i + 1) * kArity); ++k) {
    Vec3 gap;
    for (int m = 0; m < 3; ++m) gap[m] = std::max({0.0, below[k].box.lo[m] - q[m], q[m] - below[k].box.hi[m]});
    order[count++] = {below[k].least + gradation_ * norm(gap), k};
  }
  std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
  for (std::size_t k = 0; k < count && order[k].first < best; ++k) descend(level - 1, order[k].second, q, best, at);
}

double SizeField::at_most(const Vec3& x, double most, Index& near) const {
  double best = std::min(most, lengths_[near] + gradation_ * norm(x - points_[near]));
  descend(levels_.size() - 1, 0, x, best, near);
  return best;
}

double SizeField::operator()(const Vec3& x) const {
  Index near = 0;
  return at_most(x, std::numeric_limits<double>::infinity(), near);
}

std::vector<double> SizeField::at(const std::vector<Vec3>& points, std::vector<Index>& near) const {
  std::vector<double> h(points.size());
  const bool guessed = near.size() == points.size();
  near.resize(points.size());
  parallel_chunks(points.size(), 1024, [&](std::size_t, std::size_t begin, std::size_t end) {
    Index last = 0;
    for (std::size_t k = begin; k < end; ++k) {
      if (guessed && near[k] < points_.size()) last = near[k];
      h[k] = at_most(points[k], std::numeric_limits<double>::infinity(), last);
      near[k] = last;
    }
  });
  return h;
}

namespace {

std::vector<double> less_than(double most, std::vector<double> lengths) {
  for (double& h : lengths) h = most - h;
  return lengths;
}

}  // namespace

SizeFloor::SizeFloor(const std::vector<Vec3>& points, const std::vector<double>& lengths, double gradation)
    : longest_(*std::max_element(lengths.begin(), lengths.end())),
      below_(points, less_than(longest_, lengths), gradation) {}

std::vector<double> limit_gradation(const std::vector<Vec3>& points, const std::vector<double>& lengths,
                                    double gradation) {
  if (points.empty()) return {};
  const SizeField field(points, lengths, gradation);
  const std::vector<Index> order = hilbert_order(points);
  std::vector<Vec3> sorted(points.size());
  for (std::size_t k = 0; k < order.size(); ++k) sorted[k] = points[order[k]];
  std::vector<Index> near(points.size());
  for (Index k = 0; k < near.size(); ++k) near[k] = k;  // the field keeps its points in this very order
  const std::vector<double> h = field.at(sorted, near);
  std::vector<double> limited(points.size());
  for (std::size_t k = 0; k < order.size(); ++k) limited[order[k]] = h[k];
  return limited;
}

}  // namespace bisector
