// The topology of regions of triangles while some of these change sides, at a cost that depends on how many do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "mesh/topology.h"
#include "segment/dual_graph.h"

namespace bisector {

// A region counts as the surface glued from its triangles along their edges: where it touches itself in a vertex only,
// it has two vertices there.
class RegionTopology {
 public:
  // Refers to all three; from here on `labels` are changed through relabel() only.
  RegionTopology(const DualGraph& graph, const std::vector<Triangle>& triangles, std::vector<Index>& labels);

  std::size_t regions() const { return contacts_.size(); }
  void relabel(Index triangle, Index label);

  std::size_t triangle_count(Index region) const { return sizes_[region]; }
  // The regions across an edge, with the number of pairs of triangles.
  const std::map<Index, std::size_t>& contacts(Index region) const { return contacts_[region]; }

  // The triangles of a region that was connected through edges, and no longer hang together with the middle of it (or
  // most of it, if that left) since the given triangles joined or left it.
  std::vector<Index> crumbs(Index region, const std::vector<Index>& changed);
  // Finds the middle of a connected region and ways to it anew, after changes that stay: crumbs() is faster then.
  // `triangles`: all of the region, and others.
  void settle(Index region, const std::vector<Index>& triangles);

  // The Euler characteristic of a region's part incident to the given triangles, and the number of its border loops,
  // those of the mesh included, that pass through their vertices: differences of these are differences of the whole.
  long long local_euler(Index region, const std::vector<Index>& changed);
  std::size_t local_loops(Index region, const std::vector<Index>& changed);
  // How the border runs at the vertices of the given triangles: of each of its pieces there, the edges by which it
  // leaves them. Where these are equal before and after, so are the loops' numbers, and no loop needs to be followed.
  std::vector<std::vector<std::size_t>> border_chains(Index region, const std::vector<Index>& changed);

 private:
  // A triangle and the fan about a vertex that it is part of.
  struct Fan {
    Index triangle;
    std::size_t root;
  };

  // Whether a triangle's way to the middle of its region, which is in it, is in the region still.
  bool is_rooted(Index triangle, Index region);
  Index innermost(Index region, const std::vector<Index>& triangles);

  std::vector<Index> vertices_of(const std::vector<Index>& changed) const;
  std::vector<std::size_t> border_edges_at(Index region, const std::vector<Index>& vertices) const;
  std::size_t find_fans(Index vertex, Index region, std::vector<Fan>& fans);
  void add_border_edges(Index vertex, Index region, Index triangle, std::vector<std::size_t>& edges) const;
  std::size_t triangles_at(std::size_t edge, Index region) const;

  const DualGraph& graph_;
  std::vector<Index>& labels_;
  const std::vector<Triangle>& triangles_;
  std::vector<std::size_t> sizes_;
  std::vector<std::map<Index, std::size_t>> contacts_;
  EdgeTable table_;
  std::vector<std::size_t> edge_of_;  // of half-edge 3 t + k
  Csr<Index> at_vertex_;              // triangles, ascending
  std::vector<Index> front_;          // of a triangle: where the search for crumbs came from, or kNone
  // Of each region that it was settled with, a spanning tree; of each triangle the tree that it is in, and the next one
  // towards the root.
  std::vector<Index> root_, tree_, parent_;
  std::vector<std::uint64_t> rooted_;  // of a triangle: twice the search that last asked for its way, plus the answer
  std::uint64_t search_ = 0;
  std::vector<Index> way_, queue_;
  std::vector<char> seen_;                                   // of an edge, while loops are followed
  std::vector<std::pair<std::size_t, std::size_t>> spokes_;  // about a vertex: edge, position in a list of fans
};

}  // namespace bisector
