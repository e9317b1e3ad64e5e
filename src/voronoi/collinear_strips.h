// How exactly collinear triangles are divided among cells. The diagram leaves them out, but the cells of the triangles
// around them cross them, too.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "core/geometry.h"
#include "voronoi/diagram.h"
#include "voronoi/surface.h"

namespace bisector {

// Divides collinear triangles as the cells cross their edges. A cell is convex and so meets a line in one interval; the
// cells along an edge are a list without repeats, and a vertex between the ends splits that list at its owner.
class CollinearStrips {
 public:
  // Surface and polygons must outlive the object.
  CollinearStrips(const Surface& surface, const RestrictedPolygons& polygons);

  // Collinear triangles whose division is unknown.
  std::size_t unread() const { return flat_.size() - chains_.size(); }
  bool empty() const { return chains_.empty(); }
  // The diagram with the strips among its polygons, without positions; `source` receives the given polygon of each, or
  // kNone for a strip.
  RestrictedPolygons merged(std::vector<Index>& source) const;

 private:
  using Edge = std::array<Index, 2>;  // lower vertex first
  using Cells = std::vector<Index>;

  // A triangle's corners along its line, and the cells from the low end to the high one.
  struct Chain {
    Index low, middle, high;  // corners
    Cells cells;
    std::size_t split = 0;  // the middle corner lies in cells[split]
  };

  static Edge edge_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }
  std::optional<Cells> along(Index a, Index b) const;
  bool know(Index a, Index b, Cells cells);
  void read_facets();
  Cells walk(std::size_t begin, std::size_t end, Index k) const;
  void place_loose_vertices();
  void read_flat();
  bool read(Index t);
  static void append_strip(const Chain& chain, std::size_t r, std::vector<Index>& labels);

  const Surface& surface_;
  const RestrictedPolygons& polygons_;
  std::vector<Index> flat_;       // collinear triangles of three different vertices
  std::map<Edge, Cells> cells_;   // along edges, from the lower vertex
  std::map<Index, Index> owner_;  // of vertices
  std::map<Index, Vec3> position_;
  std::map<Index, Chain> chains_;  // of the triangles that could be read
};

}  // namespace bisector
