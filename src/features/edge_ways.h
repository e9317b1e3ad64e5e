// Ways along edges of the mesh, for leading curves to each other.
#pragma once

#include <algorithm>
#include <map>
#include <vector>

#include "core/geometry.h"
#include "core/grouping.h"
#include "core/shortest_ways.h"

namespace bisector {

// What a search does at a vertex.
enum class EdgeWay { goes_on, ends, arrives };

// The vertices of the shortest way along edges from one vertex to the first for which visit(vertex, length) says that
// it arrives; empty if there is none no longer than `reach`. `neighbours` are the other ends of each vertex's edges.
template <class Visit>
std::vector<Index> shortest_edge_way(Index from, double reach, const std::vector<Vec3>& vertices,
                                     const Csr<Index>& neighbours, const Visit& visit) {
  std::map<Index, Index> before;
  Index to = kNone;
  const auto links = [&](Index v, const auto& link) {
    for (const Index* other = neighbours.begin(v); other != neighbours.end(v); ++other)
      link(*other, norm(vertices[*other] - vertices[v]), kNone);
  };
  shortest_ways(from, reach, links, [&](Index v, double length, Index previous, Index) {
    if (to != kNone || !before.try_emplace(v, previous).second) return false;
    const EdgeWay step = visit(v, length);
    if (step == EdgeWay::arrives) to = v;
    return step == EdgeWay::goes_on;
  });
  std::vector<Index> way;
  for (Index v = to; v != kNone; v = before.at(v)) way.push_back(v);
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace bisector
