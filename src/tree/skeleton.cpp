#include "tree/skeleton.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/parallel.h"
#include "spatial/kd_tree.h"
#include "tree/shortest_paths.h"

namespace bisector {
namespace {

constexpr std::size_t kNearClusters = 16;  // nearest clusters that gaps are measured to
// What makes links longer, so that paths go straight on: the length added for a link across an axis, and for a gap, as
// a multiple of its own.
constexpr double kTurn = 1.5;
constexpr double kGap = 3;

double length_of(const ClusterLink& link, const std::vector<BranchCylinder>& cylinders) {
  return norm(link.junction - cylinders[link.from].centre) + norm(link.junction - cylinders[link.to].centre);
}

struct Paths {
  std::vector<Index> parent;  // of each cluster; a root's is itself
  std::vector<Index> order;   // of those that a path leads to, parents first
};

Paths paths_from_roots(const std::vector<ClusterLink>& links, std::size_t clusters, const std::vector<Index>& roots) {
  struct Arc {
    Index from, to;
    double length;
  };
  std::vector<Arc> arcs;
  for (const ClusterLink& l : links) {
    arcs.push_back({l.from, l.to, l.length});
    arcs.push_back({l.to, l.from, l.length});
  }
  std::sort(arcs.begin(), arcs.end(),
            [](const Arc& a, const Arc& b) { return std::tie(a.from, a.to) < std::tie(b.from, b.to); });
  Csr<Index> neighbours;
  std::vector<double> lengths;
  auto arc = arcs.begin();
  for (std::size_t c = 0; c < clusters; ++c) {
    for (; arc != arcs.end() && arc->from == c; ++arc) {
      neighbours.values.push_back(arc->to);
      lengths.push_back(arc->length);
    }
    neighbours.offsets.push_back(neighbours.values.size());
  }
  const ShortestPaths paths = shortest_paths(neighbours, lengths, roots);

  Paths result{paths.previous, {}};
  std::vector<std::size_t> depth(clusters,
                                 0);  // decides between clusters at one distance, which may be parent and child
  for (std::size_t c = 0; c < clusters; ++c) {
    if (!std::isfinite(paths.distance[c])) continue;
    result.order.push_back(static_cast<Index>(c));
    for (std::size_t up = c; result.parent[up] != up; up = result.parent[up]) ++depth[c];
  }
  std::sort(result.order.begin(), result.order.end(), [&](Index a, Index b) {
    return std::tie(paths.distance[a], depth[a], a) < std::tie(paths.distance[b], depth[b], b);
  });
  return result;
}

const ClusterLink& link_between(const std::vector<ClusterLink>& links, Index a, Index b) {
  const std::array<Index, 2> key{std::min(a, b), std::max(a, b)};
  return *std::lower_bound(links.begin(), links.end(), key, [](const ClusterLink& l, const std::array<Index, 2>& k) {
    return std::array{l.from, l.to} < k;
  });
}

}  // namespace

std::vector<ClusterLink> link_clusters(const std::vector<Vec3>& points, const Csr<Index>& neighbours,
                                       const std::vector<Index>& label, const std::vector<BranchCylinder>& cylinders) {
  struct BoundaryPoint {
    Index from, to, point;
    auto key() const { return std::tie(from, to, point); }
    bool operator<(const BoundaryPoint& o) const { return key() < o.key(); }
    bool operator==(const BoundaryPoint& o) const { return key() == o.key(); }
  };
  std::vector<BoundaryPoint> boundary;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const Index* j = neighbours.begin(i); j != neighbours.end(i); ++j) {
      const Index a = label[i], b = label[*j];
      if (a != b && a != kNone && b != kNone)
        boundary.push_back({std::min(a, b), std::max(a, b), static_cast<Index>(i)});
    }
  std::sort(boundary.begin(), boundary.end());
  boundary.erase(std::unique(boundary.begin(), boundary.end()), boundary.end());

  std::vector<ClusterLink> links;
  for (std::size_t begin = 0, end; begin < boundary.size(); begin = end) {
    ClusterLink link{boundary[begin].from, boundary[begin].to, {}, 0, 0};
    for (end = begin; end < boundary.size() && boundary[end].from == link.from && boundary[end].to == link.to; ++end)
      link.junction += points[boundary[end].point];
    link.junction *= 1 / static_cast<double>(end - begin);
    link.length = length_of(link, cylinders);
    links.push_back(link);
  }
  return links;
}

void link_across_gaps(const std::vector<Vec3>& points, const std::vector<Index>& label,
                      const std::vector<Index>& component, const std::vector<BranchCylinder>& cylinders,
                      std::vector<ClusterLink>& links) {
  std::vector<std::vector<Index>> members(cylinders.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (label[i] != kNone) members[label[i]].push_back(static_cast<Index>(i));
  std::vector<Vec3> centres;
  for (const BranchCylinder& c : cylinders) centres.push_back(c.centre);
  const PointSet set{centres};
  const KdTree tree(3, set);
  const std::size_t count = std::min(kNearClusters + 1, centres.size());
  std::vector<std::vector<ClusterLink>> found(cylinders.size());
  parallel_each(
      cylinders.size(),
      [&](std::size_t c) {
        std::vector<Index> near(count);
        std::vector<double> squared(count);
        const double at[3] = {centres[c].x, centres[c].y, centres[c].z};
        tree.knnSearch(at, count, near.data(), squared.data());
        for (const Index other : near) {
          if (members[c].empty() || members[other].empty()) continue;
          if (component[members[c].front()] == component[members[other].front()]) continue;
          ClusterLink link{std::min(static_cast<Index>(c), other), std::max(static_cast<Index>(c), other), {}, 0, 0};
          double least = std::numeric_limits<double>::infinity();
          for (const Index i : members[link.from])
            for (const Index j : members[link.to])
              if (const double d = norm2(points[i] - points[j]); d < least) {
                least = d;
                link.junction = 0.5 * (points[i] + points[j]);
              }
          link.gap = std::sqrt(least);
          link.length = length_of(link, cylinders);
          found[c].push_back(link);
        }
      },
      16);
  // A gap between clusters that the bridges have made neighbours is measured here too; the pair stays once.
  for (const auto& some : found) links.insert(links.end(), some.begin(), some.end());
  std::stable_sort(links.begin(), links.end(), [](const ClusterLink& a, const ClusterLink& b) {
    return std::tuple{a.from, a.to, -a.gap} < std::tuple{b.from, b.to, -b.gap};
  });
  links.erase(std::unique(links.begin(), links.end(),
                          [](const ClusterLink& a, const ClusterLink& b) { return a.from == b.from && a.to == b.to; }),
              links.end());
}

void weigh_links(const std::vector<BranchCylinder>& cylinders, std::vector<ClusterLink>& links) {
  for (ClusterLink& link : links) {
    const BranchCylinder& a = cylinders[link.from];
    const BranchCylinder& b = cylinders[link.to];
    const Vec3 way = b.centre - a.centre;
    const double length = norm(way);
    if (!(length > 0)) continue;
    const auto turn = [&](const BranchCylinder& c) {
      const double slender = std::min(1.0, c.length / std::max(2 * c.radius, 1e-300));
      return slender * (1 - std::abs(dot(c.axis, way)) / length);
    };
    link.length = (link.length + kGap * link.gap) * (1 + kTurn * (turn(a) + turn(b)));
  }
}

std::vector<SkeletonNode> make_skeleton(const std::vector<ClusterLink>& links,
                                        const std::vector<BranchCylinder>& cylinders, const std::vector<Index>& roots) {
  const Paths paths = paths_from_roots(links, cylinders.size(), roots);
  std::vector<SkeletonNode> nodes;
  std::vector<Index> node_of(cylinders.size(), kNone);
  std::vector<Vec3> entry(cylinders.size());  // of the path into each cluster
  std::vector<std::size_t> children(cylinders.size(), 0);
  for (const Index c : paths.order) {
    const Index up = paths.parent[c];
    if (up == c) {
      const ClusterLink* nearest = nullptr;
      for (const ClusterLink& l : links)
        if ((l.from == c || l.to == c) && (!nearest || l.length < nearest->length)) nearest = &l;
      const BranchCylinder& root = cylinders[c];
      const Vec3 way =
          nearest ? root.centre - nearest->junction : (-0.5 * std::max(root.length, root.radius)) * root.axis;
      nodes.push_back({root.centre + way, root.radius, kNone, kNone});
      node_of[c] = static_cast<Index>(nodes.size());
      nodes.push_back({root.centre, root.radius, node_of[c] - 1, c});
      if (!nearest) nodes.push_back({root.centre - way, root.radius, node_of[c], kNone});
      continue;
    }
    ++children[up];
    entry[c] = link_between(links, up, c).junction;
    nodes.push_back({entry[c], 0.5 * (cylinders[up].radius + cylinders[c].radius), node_of[up], kNone});
    node_of[c] = static_cast<Index>(nodes.size());
    nodes.push_back({cylinders[c].centre, cylinders[c].radius, node_of[c] - 1, c});
  }
  for (const Index c : paths.order)
    if (children[c] == 0 && paths.parent[c] != c)
      nodes.push_back({2 * cylinders[c].centre - entry[c], cylinders[c].radius, node_of[c], kNone});
  return nodes;
}

}  // namespace bisector
