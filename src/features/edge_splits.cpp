#include "features/edge_splits.h"

#include <algorithm>

namespace bisector {

std::vector<Index> edge_chain(const EdgeSplits& splits, Index a, Index b) {
  std::vector<Index> chain{a}, ahead{b};
  while (!ahead.empty()) {
    const Index from = chain.back(), to = ahead.back();
    const std::array<Index, 3> edge{std::min(from, to), std::max(from, to), 0};
    const auto split = std::lower_bound(splits.begin(), splits.end(), edge);
    if (split != splits.end() && (*split)[0] == edge[0] && (*split)[1] == edge[1]) {
      ahead.push_back((*split)[2]);
    } else {
      chain.push_back(to);
      ahead.pop_back();
    }
  }
  return chain;
}

FeatureGraph split_features(const FeatureGraph& graph, const EdgeSplits& splits) {
  if (splits.empty()) return graph;
  FeatureGraph refined;
  refined.corners = graph.corners;
  for (const FeatureCurve& curve : graph.curves) {
    FeatureCurve finer = curve;
    finer.vertices.clear();
    const std::size_t count = curve.vertices.size();
    for (std::size_t k = 0; k + (curve.closed ? 0 : 1) < count; ++k) {
      const std::vector<Index> chain = edge_chain(splits, curve.vertices[k], curve.vertices[(k + 1) % count]);
      finer.vertices.insert(finer.vertices.end(), chain.begin(), chain.end() - 1);
      for (std::size_t e = 1; e < chain.size(); ++e)
        refined.edges.push_back({std::min(chain[e - 1], chain[e]), std::max(chain[e - 1], chain[e])});
    }
    if (!curve.closed) finer.vertices.push_back(curve.vertices.back());
    refined.curves.push_back(std::move(finer));
  }
  // Curves may share edges (features/simplify.h).
  std::sort(refined.edges.begin(), refined.edges.end());
  refined.edges.erase(std::unique(refined.edges.begin(), refined.edges.end()), refined.edges.end());
  return refined;
}

}  // namespace bisector
