#include "distributed/regions.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/parallel.h"

namespace bisector {
namespace {

struct Item {
  double coordinate;
  Index point;
};

class Division {
 public:
  Division(const std::vector<Vec3>& points, const std::vector<double>& weights) : points_(points), weights_(weights) {}

  // Returns the node, or the complement of the region.
  int divide(std::vector<Index> some, int first, int count) {
    if (count == 1) return ~first;
    const int below = count / 2, place = static_cast<int>(nodes.size());
    nodes.emplace_back();
    Regions::Node node{};
    auto [lower, upper] = split(std::move(some), static_cast<double>(below) / count, node);
    node.children[0] = divide(std::move(lower), first, below);
    node.children[1] = divide(std::move(upper), first + below, count - below);
    nodes[static_cast<std::size_t>(place)] = node;
    return place;
  }

  std::vector<Regions::Node> nodes;

 private:
  // Across the longest side that can be split; where all points are the same, all are in the upper part.
  std::pair<std::vector<Index>, std::vector<Index>> split(std::vector<Index> some, double share, Regions::Node& node) {
    if (some.empty()) return {};
    Box box{points_[some[0]], points_[some[0]]};
    for (const Index i : some)
      for (int k = 0; k < 3; ++k) {
        box.lo[k] = std::min(box.lo[k], points_[i][k]);
        box.hi[k] = std::max(box.hi[k], points_[i][k]);
      }
    const Vec3 size = box.hi - box.lo;
    node.axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    std::vector<Item> items(some.size());
    double whole = 0;
    for (std::size_t k = 0; k < some.size(); ++k) {
      items[k] = {points_[some[k]][node.axis], some[k]};
      whole += weights_[some[k]];
    }
    some = {};
    sort_in_parallel(items, [](const Item& a, const Item& b) {
      return a.coordinate != b.coordinate ? a.coordinate < b.coordinate : a.point < b.point;
    });
    std::size_t middle = 0;
    for (double sum = 0; middle < items.size() && sum + 0.5 * weights_[items[middle].point] < share * whole; ++middle)
      sum += weights_[items[middle].point];
    middle = std::min(middle, items.size() - 1);
    // The first of the points with this coordinate; if it is the least, the first of the next.
    const auto before = [](const Item& item, double coordinate) { return item.coordinate < coordinate; };
    auto cut = std::lower_bound(items.begin(), items.end(), items[middle].coordinate, before);
    if (cut == items.begin()) {
      const auto next = std::find_if(items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                                     [&](const Item& item) { return item.coordinate > items[0].coordinate; });
      if (next != items.end()) cut = next;
    }
    node.at = cut->coordinate;
    std::vector<Index> lower, upper;
    for (auto item = items.begin(); item != cut; ++item) lower.push_back(item->point);
    for (auto item = cut; item != items.end(); ++item) upper.push_back(item->point);
    return {std::move(lower), std::move(upper)};
  }

  const std::vector<Vec3>& points_;
  const std::vector<double>& weights_;
};

}  // namespace

Regions::Regions(const std::vector<Vec3>& points, const std::vector<double>& weights, int count) {
  std::vector<Index> all(points.size());
  for (Index i = 0; i < all.size(); ++i) all[i] = i;
  Division division(points, weights);
  division.divide(std::move(all), 0, count);
  nodes_ = std::move(division.nodes);
  set_boxes();
}

Regions::Regions(std::vector<Node> nodes) : nodes_(std::move(nodes)) { set_boxes(); }

int Regions::at(const Vec3& p) const {
  if (nodes_.empty()) return 0;
  int node = 0;
  while (node >= 0) {
    const Node& here = nodes_[static_cast<std::size_t>(node)];
    node = here.children[p[here.axis] < here.at ? 0 : 1];
  }
  return ~node;
}

void Regions::set_boxes() {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const Box everything{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  boxes_.assign(nodes_.size() + 1, everything);
  if (nodes_.empty()) return;
  std::vector<std::pair<int, Box>> open{{0, everything}};
  while (!open.empty()) {
    const auto [node, box] = open.back();
    open.pop_back();
    if (node < 0) {
      boxes_[static_cast<std::size_t>(~node)] = box;
      continue;
    }
    const Node& here = nodes_[static_cast<std::size_t>(node)];
    Box lower = box, upper = box;
    lower.hi[here.axis] = std::min(box.hi[here.axis], here.at);
    upper.lo[here.axis] = std::max(box.lo[here.axis], here.at);
    open.push_back({here.children[0], lower});
    open.push_back({here.children[1], upper});
  }
}

}  // namespace bisector
