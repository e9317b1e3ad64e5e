#include "tree/point_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "bisector/error.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "spatial/kd_tree.h"
#include "tree/polyline.h"
#include "voronoi/delaunay.h"

namespace bisector {
namespace {

using Edge = std::array<Index, 2>;

// Points of some components in a kd-tree of their own.
struct Part {
  bool several = false;
  std::vector<Index> ids;
  std::vector<Vec3> points;
  PointSet set{points};
  std::unique_ptr<KdTree> tree;

  void add(Index id, const Vec3& p) {
    ids.push_back(id);
    points.push_back(p);
  }
};

// The nearest point that does not belong to one component, ties to the lower index.
class OutsideComponent {
 public:
  using DistanceType = double;

  OutsideComponent(const std::vector<Index>& component, Index own) : component_(component), own_(own) {}
  void look_in(const Part& part, const Vec3& p) {
    ids_ = &part.ids;
    const double at[3] = {p.x, p.y, p.z};
    part.tree->findNeighbors(*this, at, nanoflann::SearchParams());
  }
  bool addPoint(double distance, Index i) {
    const Index point = (*ids_)[i];
    if (component_[point] == own_) return true;
    if (distance < distance_ || (distance == distance_ && point < point_)) {
      distance_ = distance;
      point_ = point;
    }
    return true;
  }
  double worstDist() const { return std::nextafter(distance_, std::numeric_limits<double>::infinity()); }
  bool full() const { return true; }
  Index point() const { return point_; }
  double distance() const { return distance_; }

 private:
  const std::vector<Index>& component_;
  Index own_;
  const std::vector<Index>* ids_ = nullptr;
  double distance_ = std::numeric_limits<double>::infinity();
  Index point_ = kNone;
};

// Large components have trees of their own, which a search from inside skips: it would have to look at all of it.
std::vector<std::unique_ptr<Part>> make_parts(const std::vector<Vec3>& points, const PointGraph& graph) {
  constexpr std::size_t kMostParts = 64;
  std::vector<std::size_t> size(graph.components, 0);
  for (const Index c : graph.component) ++size[c];
  std::vector<std::unique_ptr<Part>> parts;
  parts.push_back(std::make_unique<Part>());
  parts.front()->several = true;
  std::vector<std::size_t> part_of(graph.components, 0);
  for (std::size_t c = 0; c < graph.components; ++c)
    if (size[c] * kMostParts > points.size()) {
      part_of[c] = parts.size();
      parts.push_back(std::make_unique<Part>());
    }
  for (std::size_t i = 0; i < points.size(); ++i)
    parts[part_of[graph.component[i]]]->add(static_cast<Index>(i), points[i]);
  if (parts.front()->ids.empty()) parts.erase(parts.begin());
  for (auto& part : parts) part->tree = std::make_unique<KdTree>(3, part->set);
  return parts;
}

void check_points(const std::vector<Vec3>& points) {
  if (points.size() < 2)
    throw Error(fmt::format("{} distinct points are no point cloud; give at least 2", points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(points[i][k]))
        throw Error(fmt::format("point {}: a coordinate is not finite; remove the point", i));
}

Csr<Index> make_symmetric(const std::vector<Index>& nearest, std::size_t k) {
  const std::size_t n = nearest.size() / k;
  Csr<Index> rows = group_into_rows<Index>(n, [&](const auto& put) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t s = 0; s < k; ++s) {
        const Index j = nearest[i * k + s];
        put(i, j);
        put(j, static_cast<Index>(i));
      }
  });
  Csr<Index> unique;
  unique.offsets.reserve(n + 1);
  unique.values.reserve(rows.values.size());
  for (std::size_t i = 0; i < n; ++i) {
    Index* begin = rows.values.data() + rows.offsets[i];
    Index* end = rows.values.data() + rows.offsets[i + 1];
    std::sort(begin, end);
    unique.values.insert(unique.values.end(), begin, std::unique(begin, end));
    unique.offsets.push_back(unique.values.size());
  }
  return unique;
}

void find_components(PointGraph& graph) {
  const std::size_t n = graph.neighbours.rows();
  graph.component.assign(n, kNone);
  std::vector<Index> stack;
  for (std::size_t start = 0; start < n; ++start) {
    if (graph.component[start] != kNone) continue;
    const auto name = static_cast<Index>(graph.components++);
    graph.component[start] = name;
    stack.push_back(static_cast<Index>(start));
    while (!stack.empty()) {
      const Index i = stack.back();
      stack.pop_back();
      for (const Index* j = graph.neighbours.begin(i); j != graph.neighbours.end(i); ++j)
        if (graph.component[*j] == kNone) {
          graph.component[*j] = name;
          stack.push_back(*j);
        }
    }
  }
}

bool before(const Bridge& a, const Bridge& b) {
  if (a.length != b.length) return a.length < b.length;
  return Edge{std::min(a.from, a.to), std::max(a.from, a.to)} < Edge{std::min(b.from, b.to), std::max(b.from, b.to)};
}

Index find(std::vector<Index>& parent, Index i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

PointGraph build_point_graph(const std::vector<Vec3>& points, std::size_t k) {
  check_points(points);
  const std::size_t n = points.size();
  k = std::min(k, n - 1);
  const PointSet set{points};
  const KdTree tree(3, set);
  std::vector<Index> nearest(n * k);
  std::vector<double> reach(n);
  parallel_chunks(n, 1024, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::vector<Index> found(k + 1);
    std::vector<double> distances(k + 1);
    for (std::size_t i = begin; i < end; ++i) {
      const double at[3] = {points[i].x, points[i].y, points[i].z};
      tree.knnSearch(at, k + 1, found.data(), distances.data());
      std::size_t taken = 0;
      for (std::size_t s = 0; s <= k && taken < k; ++s)
        if (found[s] != i) {
          nearest[i * k + taken++] = found[s];
          reach[i] = std::sqrt(distances[s]);
        }
    }
  });
  PointGraph graph;
  graph.neighbours = make_symmetric(nearest, k);
  graph.spacing = upper_median(reach);
  find_components(graph);
  return graph;
}

std::vector<Bridge> shortest_bridges(const std::vector<Vec3>& points, const PointGraph& graph) {
  std::vector<Bridge> bridges;
  if (graph.components < 2) return bridges;
  const auto parts = make_parts(points, graph);
  std::vector<Index> component = graph.component;
  std::vector<Index> parent(graph.components);
  std::iota(parent.begin(), parent.end(), 0);

  while (bridges.size() + 1 < graph.components) {
    std::vector<std::size_t> size(graph.components, 0);
    for (const Index c : component) ++size[c];
    const auto largest = static_cast<Index>(std::max_element(size.begin(), size.end()) - size.begin());
    // By the cut property the shortest gap of any component is in the tree: the largest need not be asked.
    std::vector<Bridge> gap(points.size());
    parallel_each(
        points.size(),
        [&](std::size_t i) {
          if (component[i] == largest) return;
          OutsideComponent result(component, component[i]);
          for (const auto& part : parts)
            if (part->several || component[part->ids.front()] != component[i]) result.look_in(*part, points[i]);
          gap[i] = {static_cast<Index>(i), result.point(), std::sqrt(result.distance())};
        },
        256);
    std::vector<Bridge> best(graph.components, {kNone, kNone, 0});
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (component[i] == largest) continue;
      Bridge& b = best[component[i]];
      if (b.from == kNone || before(gap[i], b)) b = gap[i];
    }
    for (const Bridge& b : best) {
      if (b.from == kNone) continue;
      const Index x = find(parent, component[b.from]), y = find(parent, component[b.to]);
      if (x == y) continue;
      parent[std::max(x, y)] = std::min(x, y);
      bridges.push_back(b);
    }
    for (Index& c : component) c = find(parent, c);
  }
  std::sort(bridges.begin(), bridges.end(), before);
  return bridges;
}

Csr<Index> add_edges(const Csr<Index>& neighbours, const std::vector<Edge>& edges) {
  std::vector<Edge> directed;
  for (const Edge& e : edges) {
    directed.push_back({e[0], e[1]});
    directed.push_back({e[1], e[0]});
  }
  std::sort(directed.begin(), directed.end());
  Csr<Index> rows;
  rows.offsets.reserve(neighbours.rows() + 1);
  auto next = directed.begin();
  for (std::size_t i = 0; i < neighbours.rows(); ++i) {
    const auto start = static_cast<std::ptrdiff_t>(rows.values.size());
    rows.values.insert(rows.values.end(), neighbours.begin(i), neighbours.end(i));
    for (; next != directed.end() && (*next)[0] == i; ++next) rows.values.push_back((*next)[1]);
    std::sort(rows.values.begin() + start, rows.values.end());
    rows.values.erase(std::unique(rows.values.begin() + start, rows.values.end()), rows.values.end());
    rows.offsets.push_back(rows.values.size());
  }
  return rows;
}

Csr<Index> ways_graph(const std::vector<Vec3>& points) {
  if (auto graph = delaunay_neighbours(points)) return std::move(*graph);
  const PointGraph near = build_point_graph(points);
  std::vector<Edge> edges;
  for (const Bridge& b : shortest_bridges(points, near)) edges.push_back({b.from, b.to});
  return add_edges(near.neighbours, edges);
}

}  // namespace bisector
