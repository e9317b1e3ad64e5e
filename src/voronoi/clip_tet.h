// Clipping one tetrahedron to one Voronoi cell: labels first, coordinates from labels (thesis 5.4).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry.h"
#include "voronoi/clipped.h"
#include "voronoi/exact_tet.h"
#include "voronoi/moments.h"
#include "voronoi/neighbours.h"
#include "voronoi/screen.h"
#include "voronoi/solid.h"

namespace bisector {

// One tetrahedron as the clipping reads it. Facet k is the one opposite corner k.
struct TetFrame {
  // `ranks`: what orders the corners, e.g. their vertices' indices; whatever has to agree on the two sides of a facet
  // or around an edge follows that order.
  TetFrame(const std::array<Vec3, 4>& corners, const Tetrahedron& ranks, const double* density, double six_volume);
  TetFrame() = default;

  Vec3 corners[4];          // positively oriented
  Vec3 normals[4];          // of the facets, unit length, of either sense
  double density[4];        // at the corners
  Vec3 gradient;            // of the density
  Moments moments;          // of the whole tetrahedron, about its first corner in order
  unsigned char order[4];   // corners in ascending rank
  unsigned char rank[4];    // of each corner: order[rank[k]] == k
  unsigned char anchor[4];  // of each facet: its first corner in order
};

// That of the solid's enclosure.
TetFrame enclosure_frame(const Solid& solid);
// Those of all tetrahedra of a solid; of no use for one of no volume.
std::vector<TetFrame> tet_frames(const Solid& solid);

// Clips tetrahedra to cells and integrates over the result. One object per thread; memory is kept between calls.
class TetClipper {
 public:
  TetClipper();

  // Forgets what is kept about the seeds; to be called whenever they or their neighbours change.
  void reset(const SortedSeeds& seeds, const Neighbours& neighbours);
  // The cell that the following calls are about.
  void begin(Index slot);
  // For many tetrahedra within `around`: from here on passes over those of the cell's first neighbours that the others
  // keep from bounding anything there.
  void narrow(const TetFrame& around);
  // Clips the tetrahedron, which must outlive the use of the result. False if the (perturbed) intersection is empty.
  bool clip(const TetFrame& tet);

  // Cuts the tetrahedron by the cell's listed neighbours alone, whatever the list leaves out. For a tetrahedron that
  // the cell meets. The list can be shortened to the nearest few at first, and widen() takes one that reaches farther.
  void cut_by_listed(const TetFrame& around);
  void shorten(std::size_t most);
  void widen();
  bool is_shortened() const { return shortened_; }
  // Whether the list leaves out nothing that could bound the cell.
  bool lists_all() const;
  // Whether no seed that is left out can be as near to vertex v as the cell's own.
  bool is_certain(std::size_t v) const;

  // Takes the polyhedron that these planes bound (labels, the tetrahedron's facets last) with these vertices, as
  // triples of positions among them, which the caller knows to be the result.
  void take(const TetFrame& tet, const std::vector<Index>& labels, const std::vector<std::array<Index, 3>>& triples);
  // Takes the whole tetrahedron.
  void take(const TetFrame& tet);

  // The last polyhedron. No bisector bounds it if it is the whole tetrahedron.
  bool whole() const { return plane_count_ == 4; }
  std::size_t vertex_count() const { return size_; }
  // The planes that bound it: slots in ascending order of the caller's index, then facets, as kFacetLabel | k.
  const std::vector<Index>& labels();
  // Calls visit(label) for the same in no particular order.
  template <class Visit>
  void each_label(const Visit& visit) {
    collect();
    for (const Index plane : bounding_) visit(planes_[plane].slot);
  }
  // Vertex v relative to the seed.
  const Vec3& vertex(std::size_t v) const { return vertices_[v].at; }
  // Bounds the error of each coordinate of vertex v.
  double slack(std::size_t v) const { return vertices_[v].slack; }
  // The label of plane e < 3 of vertex v, and the vertex at the other end of the edge that leaves it there.
  Index label_at(std::size_t v, std::size_t e) const { return planes_[vertices_[v].on[e]].slot; }
  Index adjacent(std::size_t v, std::size_t e) const { return vertices_[v].adjacent[e]; }
  // Positions in labels() of the three planes of vertex v, counter-clockwise seen from outside, the least first.
  std::array<Index, 3> triple(std::size_t v);
  // Integrals over the last polyhedron, about the seed.
  template <bool kUniform>
  Moments integrate();

  // Whether a decision of the last call to clip() was uncertain, or its list too short.
  bool uncertain() const { return uncertain_; }
  bool wider() const { return wider_; }

 private:
  // The plane n . p = k.
  struct Plane {
    Vec3 n;
    double k;
    double length;   // upper bound of |n|
    double squared;  // |n|^2
    Index key;   // order of labels: facets, by descending rank of the corner opposite, then seeds by the caller's index
    Index slot;  // of the other seed, or kFacetLabel | k
  };
  // A vertex in dual form: its planes, counter-clockwise seen from outside, and for each the vertex at the other end of
  // the edge that leaves it.
  struct Vertex {
    Vec3 at;
    double slack;
    float scaled[3];
    Index on[3];
    Index adjacent[3];
  };
  // An edge that is cut.
  struct Boundary {
    std::uint64_t planes;  // u and v << 32, as the vertex outside has them
    std::uint64_t inside;  // the vertex inside, and the edge's place there << 32
    Index u() const { return static_cast<Index>(planes); }
    Index v() const { return static_cast<Index>(planes >> 32); }
  };

  void start(const TetFrame& tet);
  void set_plane(Plane& plane, Index other) const;
  void load(std::size_t count);
  unsigned planes_that_may_cut(const ScreenBlock& block) const;
  bool cut_by_block(std::size_t k, std::size_t count);
  void bound();
  bool bounded_by(Index slot) const;
  bool cut(std::size_t neighbour);
  std::size_t count_outside(const Plane& by);
  void reserve(std::size_t vertices);
  void erase(Index vertex);
  void place(Vertex& vertex);
  void place_on_edge(Vertex& vertex, const Plane& f, const Plane& g, const Plane& bisector);
  void place_on_facet(Vertex& vertex, const Plane& f, const Plane& a, const Plane& b);
  void place_at_planes(Vertex& vertex, const Plane& a, const Plane& b, const Plane& c);
  void place_exactly(Vertex& vertex, const Plane& a, const Plane& b, const Plane& c);
  void set_vertex(Vertex& vertex, const Vec3& at, double slack) const;
  void collect();
  double density(const Vertex& vertex) const;
  ExactTetFrame frame() const;
  ExactPlane exact(const Plane& plane) const;

  const SortedSeeds* seeds_ = nullptr;
  const Neighbours* neighbours_ = nullptr;
  double scale_ = 1;  // of the screen

  // The cell: its neighbours in ascending distance, the first `loaded_` of them in `listed_` and `blocks_`.
  Index slot_ = 0;
  Vec3 seed_;
  NeighbourList list_;
  NeighbourList unshortened_;  // if list_ is the first part of one
  bool shortened_ = false;
  std::vector<Index> narrowed_;
  std::size_t loaded_ = 0;
  std::vector<Plane> listed_;
  std::vector<ScreenBlock> blocks_;

  // The polyhedron: planes that ever cut it, the first four being the facets, and its vertices.
  const TetFrame* tet_ = nullptr;
  Vec3 local_[4];           // the corners relative to the seed
  double largest_ = 0;      // absolute coordinate of local_
  double tet_squared_ = 0;  // upper bound of the squared distance of any point of the tetrahedron
  std::vector<Plane> planes_;
  std::size_t plane_count_ = 0;
  std::vector<Vertex> vertices_;
  std::size_t size_ = 0;

  bool bounded_ = false;  // what follows is that of the polyhedron
  Reach reach_;

  bool collected_ = false;       // what follows is that of the polyhedron
  std::vector<Index> bounding_;  // planes in order of their keys
  std::vector<Index> a_vertex_;  // of each plane, or kNone

  bool labelled_ = false;  // the same
  std::vector<Index> labels_;
  std::vector<Index> position_;  // of each plane in labels_

  // Room for as many vertices as vertices_ has.
  std::vector<signed char> sides_;
  std::vector<Index> removed_;
  std::vector<Boundary> boundary_;
  std::vector<Index> starting_, ending_;  // of each plane: the new vertex whose cut edge starts or ends with it
  std::vector<Vec3> relative_;
  std::vector<double> densities_;
  std::vector<Index> polygon_;
  bool uncertain_ = false, wider_ = false;
};

}  // namespace bisector
