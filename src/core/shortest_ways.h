// Shortest ways in a graph from one node to all that are near (Dijkstra 1959). For many short searches in a large
// graph: nothing is set up for nodes that are not reached.
#pragma once

#include <functional>
#include <queue>
#include <tuple>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// `links(node, visit)` calls visit(to, length, via) for the links of a node, `via` being the link's name.
// `settle(node, length, before, via)` is called with ascending length, for ways no longer than `reach`: with the node
// and the link that the way comes by, kNone at the start. It may be called again for a node, with a way that is no
// shorter; it returns whether to go on from there.
template <class Links, class Settle>
void shortest_ways(Index from, double reach, const Links& links, const Settle& settle) {
  using Way = std::tuple<double, Index, Index, Index>;  // length, node, node before, link
  std::priority_queue<Way, std::vector<Way>, std::greater<>> ways;
  ways.push({0, from, kNone, kNone});
  while (!ways.empty()) {
    const auto [length, node, before, via] = ways.top();
    ways.pop();
    if (!settle(node, length, before, via)) continue;
    links(node, [&, length = length, node = node](Index to, double link, Index name) {
      if (length + link <= reach) ways.push({length + link, to, node, name});
    });
  }
}

}  // namespace bisector
