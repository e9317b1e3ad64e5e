// Ways along edges of the mesh, for leading curves to each other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "core/grouping.h"
#include "core/shortest_ways.h"

namespace bisector {

// What a search does at a vertex.
enum class EdgeWay { goes_on, ends, arrives };

// The shortest ways along edges from one vertex to the first `most` for which visit(vertex, length) says that they
// arrive, the shortest first and none longer than `reach`: the vertices of each. `neighbours` are the other ends of
// each vertex's edges.
template <class Visit>
std::vector<std::vector<Index>> shortest_edge_ways(Index from, double reach, const std::vector<Vec3>& vertices,
                                                   const Csr<Index>& neighbours, std::size_t most, const Visit& visit) {
  std::map<Index, Index> before;
  std::vector<std::vector<Index>> ways;
  const auto links = [&](Index v, const auto& link) {
    for (const Index* other = neighbours.begin(v); other != neighbours.end(v); ++other)
      link(*other, norm(vertices[*other] - vertices[v]), kNone);
  };
  shortest_ways(from, reach, links, [&](Index v, double length, Index previous, Index) {
    if (ways.size() == most || !before.try_emplace(v, previous).second) return false;
    const EdgeWay step = visit(v, length);
    if (step != EdgeWay::arrives) return step == EdgeWay::goes_on;
    std::vector<Index>& way = ways.emplace_back();
    for (Index at = v; at != kNone; at = before.at(at)) way.push_back(at);
    std::reverse(way.begin(), way.end());
    return false;
  });
  return ways;
}

// The first of these; empty if there is none.
template <class Visit>
std::vector<Index> shortest_edge_way(Index from, double reach, const std::vector<Vec3>& vertices,
                                     const Csr<Index>& neighbours, const Visit& visit) {
  std::vector<std::vector<Index>> ways = shortest_edge_ways(from, reach, vertices, neighbours, 1, visit);
  return ways.empty() ? std::vector<Index>{} : std::move(ways.front());
}

}  // namespace bisector
