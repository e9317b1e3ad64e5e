#include "tree/shortest_paths.h"

#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>
#include <functional>
#include <limits>
#include <utility>

namespace bisector {
namespace {

struct Edge {
  double length;
};
using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, Edge, boost::no_property, Index,
                                                 std::size_t>;

Graph make_graph(const Csr<Index>& neighbours, const std::vector<double>& lengths) {
  std::vector<std::pair<Index, Index>> ends;
  std::vector<Edge> edges;
  ends.reserve(neighbours.values.size());
  edges.reserve(neighbours.values.size());
  for (std::size_t i = 0; i < neighbours.rows(); ++i)
    for (std::size_t k = neighbours.offsets[i]; k < neighbours.offsets[i + 1]; ++k) {
      ends.emplace_back(static_cast<Index>(i), neighbours.values[k]);
      edges.push_back({lengths[k]});
    }
  return {boost::edges_are_sorted, ends.begin(), ends.end(), edges.begin(), static_cast<Index>(neighbours.rows())};
}

}  // namespace

ShortestPaths shortest_paths(const Csr<Index>& neighbours, const std::vector<double>& lengths,
                             const std::vector<Index>& sources) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const Graph graph = make_graph(neighbours, lengths);
  ShortestPaths paths;
  paths.distance.resize(neighbours.rows());
  paths.previous.resize(neighbours.rows());
  const auto index = get(boost::vertex_index, graph);
  boost::dijkstra_shortest_paths(
      graph, sources.begin(), sources.end(), boost::make_iterator_property_map(paths.previous.begin(), index),
      boost::make_iterator_property_map(paths.distance.begin(), index), get(&Edge::length, graph), index, std::less<>(),
      boost::closed_plus<double>(kFar), kFar, 0.0, boost::dijkstra_visitor<>());
  return paths;
}

}  // namespace bisector
