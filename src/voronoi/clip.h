// Clipping one triangle to one restricted Voronoi cell: labels first, coordinates from labels (thesis 4.3.2, 4.3.4).
#pragma once

#include <span>
#include <vector>

#include "core/geometry.h"
#include "voronoi/exact.h"
#include "voronoi/moments.h"
#include "voronoi/neighbours.h"
#include "voronoi/screens.h"
#include "voronoi/surface.h"

namespace bisector {

// Clips facets to cells and integrates over the result. One object per thread; memory is kept between calls.
class Clipper {
 public:
  Clipper();

  // Forgets what is kept about the seeds; to be called whenever they or their neighbours change.
  void reset(const SortedSeeds& seeds);
  // The facet that the following calls are about; it must outlive them.
  void begin(const Surface& surface, std::size_t facet);
  // Clips the facet to the cell of `slot`. False if the (perturbed) intersection is empty.
  bool clip(const Neighbours& neighbours, Index slot);
  // The same as if no other seeds than these, ascending, were there.
  bool clip(std::span<const Index> others, Index slot);
  // Takes the whole facet, which the caller knows to lie in the cell.
  void take(Index slot);
  // Takes the polygon bounded by the lines with these labels in this cyclic order, which the caller knows to be the
  // result.
  void take(Index slot, const Index* labels, std::size_t count);

  // The last polygon, counter-clockwise: vertex k relative to the seed, and the label (a slot or a facet edge) of the
  // edge that starts there.
  std::size_t size() const { return polygon_.size; }
  const Vec3& vertex(std::size_t k) const { return polygon_.corners[k].at; }
  Index label(std::size_t k) const { return lines_[polygon_.edges[k]].slot; }
  // Bounds the error of each coordinate of vertex k.
  double slack(std::size_t k) const { return polygon_.corners[k].slack; }
  // The index of the edge with the smallest label.
  std::size_t first_corner() const;
  // Integrals over the last polygon.
  Moments integrate();

  // What is kept of the cells' neighbours, for others who look at the same cells.
  Screens& screens() { return screens_; }

  // Whether a decision of the last call to clip() was uncertain, or its list too short.
  bool uncertain() const { return uncertain_; }
  bool wider() const { return wider_; }

 private:
  // A line on the facet: its meeting with the plane m . p = c through a facet edge along the normal, or the bisector.
  struct Line {
    Vec3 m;
    Vec3 along;         // n x m, the line's direction
    double offset;      // c less the part of it along the normal
    double squared;     // |m|^2
    std::uint64_t key;  // order of labels: facet edges by their vertices' indices, then seeds by the caller's index
    Index slot;         // of the other seed, or kEdgeLabel | k
  };
  struct alignas(16) Corner {
    Vec3 at;
    double slack;
  };
  // Corners, and for each the edge that starts there (an index into lines_). Capacity is kept.
  struct Polygon {
    std::size_t size = 0;
    std::vector<Corner> corners;
    std::vector<unsigned> edges;

    void reserve(std::size_t count);
    Corner& push(unsigned edge) {
      edges[size] = edge;
      return corners[size++];
    }
  };

  // A corner in single precision, each coordinate four times.
  struct Splat {
    FourFloats x, y, z;
  };

  void start(Index slot);
  template <bool kUniform>
  Moments integrate_with();
  unsigned lines_that_may_cut(const ScreenBlock& block) const;
  void place_lines();
  unsigned add_line(Index other, const Vec3& towards, double squared);
  void set_labels(const Index* labels, std::size_t count);
  // Cuts by one neighbour. False if the polygon is empty then.
  bool visit(Index other);
  void bound_polygon();
  void cut(Index other, const Vec3& towards, double squared);
  // Sets the corner where the lines meet. False if they do so too steeply to be sure of it.
  bool meet(const Line& before, const Line& after, Corner& corner) const;
  // The same, by exact arithmetic where need be.
  void add_corner(const Line& before, const Line& after, Corner& corner) const;
  bool bounded_by(Index other) const;
  double density(std::size_t corner) const;
  std::size_t previous(std::size_t corner) const { return corner ? corner - 1 : polygon_.size - 1; }
  ExactFrame frame() const;
  ExactLine exact(const Line& line) const;

  const SortedSeeds* seeds_ = nullptr;
  const Facet* facet_ = nullptr;
  const FacetDensity* density_ = nullptr;
  Index slot_ = 0;
  Vec3 local_[3];             // the facet's corners relative to the seed
  double largest_ = 0;        // absolute coordinate of local_
  double height_ = 0;         // of the facet's plane over the seed, along the normal
  Vec3 foot_;                 // of the seed on that plane
  double facet_squared_ = 0;  // upper bound of the squared distance of any point of the facet
  Reach reach_;               // of the polygon
  bool bounded_ = false;      // reach_ and splats_ are those of the polygon
  std::vector<Line> lines_;   // all that ever cut; the first three are the facet's edges
  std::size_t line_count_ = 0;
  Polygon polygon_, kept_;
  Screens screens_;
  std::vector<Splat> splats_;  // the polygon's corners, scaled
  std::vector<signed char> sides_;
  std::vector<double> densities_;
  bool uncertain_ = false, wider_ = false;
};

}  // namespace bisector
