// A tetrahedral mesh that can be changed locally and changed back. Boundary facets, facets between regions, marked
// facets and marked edges are kept by every change.
#pragma once

#include <span>
#include <vector>

#include "core/geometry.h"

namespace bisector {

class TetEdit {
 public:
  struct Tet {
    Tetrahedron corners;
    std::array<Index, 4> across;  // as tet_adjacency
    double shape;                 // dihedral_shape
    std::int32_t region;
    std::uint8_t kept;  // bit k: facet k stays as it is
    bool alive;
  };

  // Throws Error if a tetrahedron is not positively oriented, an index is out of range, a coordinate is not finite, a
  // list has the wrong length, or a facet has more than two tetrahedra.
  explicit TetEdit(const TetMesh& mesh);

  std::size_t size() const { return tets_.size(); }  // slots; some are not alive
  std::size_t points() const { return points_.size(); }
  const Tet& tet(Index t) const { return tets_[t]; }
  const Vec3& point(Index v) const { return points_[v]; }
  bool alive(Index v) const { return alive_[v]; }
  // On a facet or an edge that is kept: cannot be moved (but see `on_boundary`) or removed.
  bool held(Index v) const { return held_[v]; }
  // On the boundary and on nothing else that is kept, its tetrahedra joined by facets.
  bool on_boundary(Index v) const { return on_boundary_[v]; }
  bool kept(Index t, int facet) const { return tets_[t].kept >> facet & 1; }
  // Whether the edge itself is marked.
  bool kept_edge(Index a, Index b) const;

  // The tetrahedra at a vertex that are joined by facets. Valid until the next call.
  const std::vector<Index>& star(Index v);
  // The tetrahedra around the edge from corner i to corner j of t, in turn, where no facet at the edge is kept: those
  // of corners (a, b, ring[k], ring[k + 1]), positively oriented. False if a facet is kept or there are more than
  // `most`.
  bool ring(Index t, int i, int j, std::size_t most, std::vector<Index>& tets, std::vector<Index>& vertices) const;

  // Puts `fresh` where `old` was: both must have the same outer facets. False, and nothing is changed, if they have
  // not, a fresh one is not exactly positive, or something kept would be lost. A vertex that no tetrahedron is left
  // at is not alive any more.
  bool replace(std::span<const Index> old, std::span<const Tetrahedron> fresh);
  const std::vector<Index>& added() const { return added_; }  // by the last replace
  Index add_point(const Vec3& p);
  // False, and nothing is changed, if a tetrahedron would not be exactly positive.
  bool move(Index v, const Vec3& p);

  // Changes since `begin` are undone by `undo`, down to the slots, or kept by `keep`.
  void begin();
  void undo();
  void keep();
  // Tetrahedra that were added or changed since `begin` and are alive, ascending.
  std::vector<Index> changed();

  // The mesh in the order of its slots, and for each of its vertices the slot it comes from.
  TetMesh mesh(std::vector<Index>& slots) const;

 private:
  struct Change {
    enum Kind { replaced, moved, inserted } kind;
    Index vertex = kNone;
    Vec3 position = {};
    std::vector<Index> added = {}, freed = {};  // slots
    std::vector<Tetrahedron> removed = {};      // from the freed slots
    std::size_t slots = 0;                      // before
  };

  // A facet of an old tetrahedron on the cavity's boundary, or any facet of a fresh one.
  struct Side {
    Triangle corners;  // ascending
    bool odd;          // whether sorting them took an odd permutation
    bool fresh;
    std::uint8_t kept;
    Index tet;  // the one outside, or the place among the fresh ones
    int facet;  // of it
  };

  double shape_of(const Tetrahedron& corners) const;
  bool positive(const Tetrahedron& corners) const;
  // replace(). `slots`: where the fresh ones are to go, known to fit; otherwise null.
  bool exchange(std::span<const Index> old, std::span<const Tetrahedron> fresh, const std::vector<Index>* slots);
  // Fills sides_, sorted by corners, old ones first. False if old ones differ in region or a kept facet lies between
  // them.
  bool collect_sides(std::span<const Index> old, std::span<const Tetrahedron> fresh);
  // Whether each side of the cavity occurs once among the fresh facets and every other fresh facet from either side:
  // with positive tetrahedra this is a tiling.
  bool sides_match() const;
  bool loses_kept_edge(std::span<const Index> old, std::span<const Tetrahedron> fresh) const;
  Index new_slot();
  // Frees the old slots and fills others; the links across facets come from link_sides.
  void put_in_slots(std::span<const Index> old, std::span<const Tetrahedron> fresh, const std::vector<Index>* slots);
  void link_sides();

  std::vector<Vec3> points_;
  std::vector<Tet> tets_;
  std::vector<Index> free_;
  std::vector<Index> tet_of_;  // a tetrahedron at each vertex
  std::vector<std::uint8_t> alive_, held_, on_boundary_;
  std::vector<std::array<Index, 2>> kept_edges_;  // ascending
  std::vector<std::int32_t> boundary_labels_;
  bool has_regions_ = false;
  std::vector<Triangle> marked_;
  std::vector<std::array<Index, 2>> feature_edges_;

  bool recording_ = false;
  std::vector<Change> changes_;
  std::vector<Index> added_;
  std::vector<Index> star_;
  std::vector<Side> sides_;  // of the exchange under way
  std::vector<std::uint32_t> stamps_;
  std::uint32_t stamp_ = 0;
};

}  // namespace bisector
