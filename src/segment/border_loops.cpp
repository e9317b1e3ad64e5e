#include "segment/border_loops.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/grouping.h"
#include "mesh/half_edges.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

class BorderFollower {
 public:
  BorderFollower(const std::vector<Triangle>& triangles, std::size_t vertex_count, const std::vector<Index>& labels,
                 std::size_t region_count)
      : triangles_(triangles), labels_(labels), twins_(half_edge_twins(triangles, vertex_count)),
        is_node_(vertex_count, 0), chain_of_edge_(twins_.edge_count, kNone), visited_(3 * triangles.size(), 0) {
    result_.regions.resize(region_count);
    find_nodes();
    const Csr<Index> of_region = items_of_labels<Index>(labels, region_count);
    for (std::size_t r = 0; r < region_count; ++r)
      for (const Index* t = of_region.begin(r); t != of_region.end(r); ++t)
        for (std::size_t h = 3 * std::size_t{*t}; h < 3 * std::size_t{*t} + 3; ++h)
          if (is_border(h) && !visited_[h]) follow_loop(h, result_.regions[r]);
    count_euler();
  }

  FollowedBorders take() { return {std::move(result_), std::move(half_edges_), std::move(twins_)}; }

 private:
  Index region_of(std::size_t half_edge) const { return labels_[half_edge / 3]; }
  Index begin_of(std::size_t half_edge) const { return origin(triangles_, half_edge); }
  bool is_border(std::size_t half_edge) const {
    const std::size_t twin = twins_.twin[half_edge];
    return twin == kNoTwin || region_of(twin) != region_of(half_edge);
  }
  // Nodes are vertices where other than two border edges meet, or two with different regions beside them.
  void find_nodes() {
    struct Sides {
      Index low = kNone, high = 0;
      bool is_single = false, is_border = false;
      bool operator==(const Sides&) const = default;
    };
    std::vector<Sides> sides(twins_.edge_count);
    std::vector<std::array<Index, 2>> ends(twins_.edge_count);
    for (std::size_t h = 0; h < 3 * triangles_.size(); ++h) {
      Sides& s = sides[twins_.edge[h]];
      s.low = std::min(s.low, region_of(h));
      s.high = std::max(s.high, region_of(h));
      s.is_single = twins_.is_single[h];
      s.is_border |= is_border(h);
      ends[twins_.edge[h]] = {begin_of(h), begin_of(next_half_edge(h))};
    }
    std::vector<std::size_t> degree(is_node_.size(), 0), last(is_node_.size(), 0);
    for (std::size_t e = 0; e < sides.size(); ++e) {
      if (!sides[e].is_border) continue;
      for (const Index v : ends[e]) {
        if (degree[v]++ > 0 && !(sides[last[v]] == sides[e])) is_node_[v] = 1;
        last[v] = e;
      }
    }
    for (std::size_t v = 0; v < is_node_.size(); ++v)
      if (degree[v] > 0 && degree[v] != 2) is_node_[v] = 1;
  }

  // The border half-edge that follows around the same region, found by turning about its end.
  std::size_t next_on_border(std::size_t half_edge) const {
    std::size_t h = next_half_edge(half_edge);
    while (!is_border(h)) h = next_half_edge(twins_.twin[h]);
    return h;
  }

  bool breaks_at(std::size_t half_edge, std::size_t next) const {
    return is_node_[begin_of(next)] || twins_.edge[half_edge] == twins_.edge[next];
  }

  void follow_loop(std::size_t first, RegionOutline& region) {
    std::vector<std::size_t> loop;
    for (std::size_t h = first; !visited_[h]; h = next_on_border(h)) {
      visited_[h] = 1;
      loop.push_back(h);
    }
    const std::size_t n = loop.size();
    std::size_t start = 0;
    while (start < n && !breaks_at(loop[(start + n - 1) % n], loop[start])) ++start;
    const bool closed = start == n;
    if (!closed) std::rotate(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(start), loop.end());

    BorderLoop& result = region.loops.emplace_back();
    for (const std::size_t h : loop) result.vertices.push_back(begin_of(h));
    for (std::size_t i = 0, end; i < n; i = end) {
      end = i + 1;
      while (end < n && !breaks_at(loop[end - 1], loop[end])) ++end;
      result.chains.push_back(use_chain(loop.data() + i, loop.data() + end, closed));
    }
  }

  // The chain along these half-edges, which the region on the other side may have made before.
  ChainUse use_chain(const std::size_t* begin, const std::size_t* end, bool closed) {
    const std::size_t twin = twins_.twin[*begin], edge = twins_.edge[*begin];
    if (twin != kNoTwin && chain_of_edge_[edge] != kNone) return {chain_of_edge_[edge], true};
    const auto number = static_cast<Index>(result_.chains.size());
    BorderChain& chain = result_.chains.emplace_back();
    chain.closed = closed;
    chain.left = region_of(*begin);
    chain.kind = twin != kNoTwin            ? ChainKind::sharp
                 : twins_.is_single[*begin] ? ChainKind::border
                                            : ChainKind::non_manifold;
    if (twin != kNoTwin) chain.right = region_of(twin);
    for (const std::size_t* h = begin; h != end; ++h) {
      chain.vertices.push_back(begin_of(*h));
      chain_of_edge_[twins_.edge[*h]] = number;
    }
    half_edges_.emplace_back(begin, end);
    if (!closed) chain.vertices.push_back(begin_of(next_half_edge(end[-1])));
    return {number, false};
  }

  // Corners that hang together through edges within a region are one vertex of it.
  void count_euler() {
    const std::size_t n = 3 * triangles_.size();
    DisjointSets<std::size_t> corners(n);
    for (std::size_t h = 0; h < n; ++h) {
      RegionOutline& region = result_.regions[region_of(h)];
      if (h % 3 == 0) ++region.euler;
      if (is_border(h) || h < twins_.twin[h]) --region.euler;
      if (is_border(h)) continue;
      corners.join(h, next_half_edge(twins_.twin[h]));
      corners.join(next_half_edge(h), twins_.twin[h]);
    }
    for (std::size_t h = 0; h < n; ++h)
      if (corners.is_root(h)) ++result_.regions[region_of(h)].euler;
  }

  const std::vector<Triangle>& triangles_;
  const std::vector<Index>& labels_;
  HalfEdgeTwins twins_;
  std::vector<char> is_node_;  // of a vertex
  std::vector<Index> chain_of_edge_;
  std::vector<char> visited_;  // of a half-edge
  RegionBorders result_;
  std::vector<std::vector<std::size_t>> half_edges_;  // of each chain
};

}  // namespace

HalfEdgeTwins half_edge_twins(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  const EdgeTable table = edge_table(triangles, vertex_count);
  const std::size_t n = 3 * triangles.size();
  HalfEdgeTwins twins{std::vector<std::size_t>(n, kNoTwin), std::vector<char>(n, 0), std::vector<std::size_t>(n, 0),
                      table.edges.size()};
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const std::size_t* at = table.half_edges.begin(e);
    for (std::size_t k = 0; k < table.half_edges.size(e); ++k) twins.edge[at[k]] = e;
    if (table.half_edges.size(e) == 1) twins.is_single[at[0]] = 1;
    // A triangle with a repeated corner is no neighbour of itself.
    if (table.half_edges.size(e) != 2 || origin(triangles, at[0]) == origin(triangles, at[1]) || at[0] / 3 == at[1] / 3)
      continue;
    twins.twin[at[0]] = at[1];
    twins.twin[at[1]] = at[0];
  }
  return twins;
}

FollowedBorders follow_borders(const std::vector<Triangle>& triangles, std::size_t vertex_count,
                               const std::vector<Index>& labels, std::size_t region_count) {
  return BorderFollower(triangles, vertex_count, labels, region_count).take();
}

}  // namespace bisector
