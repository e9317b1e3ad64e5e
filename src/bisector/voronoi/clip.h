// Clipping one triangle to one restricted Voronoi cell: labels first, coordinates from labels (thesis 4.3.2, 4.3.4).
#pragma once

#include <vector>

#include "bisector/core/types.h"
#include "bisector/voronoi/exact.h"
#include "bisector/voronoi/moments.h"
#include "bisector/voronoi/neighbours.h"
#include "bisector/voronoi/surface.h"

namespace bisector {

// Clips facets to cells and integrates over the result. One object per thread; memory is kept between calls.
class Clipper {
 public:
  Clipper();

  // Clips the facet to the cell of `slot`. False if the (perturbed) intersection is empty.
  bool clip(const SortedSeeds& seeds, const Neighbours& neighbours, const Facet& facet, Index slot);
  // Takes the whole facet, which the caller knows to lie in the cell.
  void take(const SortedSeeds& seeds, const Facet& facet, Index slot);

  // The last polygon, counter-clockwise: label(k) (a slot or a facet edge) of the edge that starts at vertex k.
  std::size_t size() const { return edges_.size(); }
  Index label(std::size_t k) const { return lines_[edges_[k]].slot; }
  // Computes the vertices from their labels and integrates.
  template <bool kUniform>
  Moments integrate();
  // After integrate(): vertex k relative to the seed.
  const Vec3& vertex(std::size_t k) const { return points_[k]; }

  // Whether a decision of the last call to clip() was uncertain, or its list too short.
  bool uncertain() const { return uncertain_; }
  bool wider() const { return wider_; }

 private:
  // A line that bounds the polygon, as its values h at the facet's corners; see exact.h. |h| <= scale, and the rounding
  // error of h is at most 7 u scale with u = 2^-53.
  struct Line {
    double h[3];
    double scale;
    Vec3 towards;    // to the other seed
    double squared;  // its squared length
    Index slot;      // of the other seed, or kEdgeLabel | k
    Index id;        // the caller's index of the other seed
  };
  // A vertex of the polygon: its barycentric coordinates up to a positive factor, and its rounded position.
  struct Vertex {
    double lambda[3];
    double bound;    // times a line's scale: bounds the error of that line's value at the vertex
    Vec3 at;         // relative to the seed
    double slack;    // bounds the error of each coordinate of `at`, rounding of a product with it included
    double squared;  // upper bound of the squared distance from the seed
  };

  void start(const SortedSeeds& seeds, const Facet& facet, Index slot);
  void cut(Index other, const Vec3& towards, double squared);
  int side(std::size_t vertex, const Line& line);
  Vertex meet(const Line& a, const Line& b) const;
  Vec3 position(const Line& before, const Line& after) const;
  double density(const Line& before, const Line& after, const Vec3& point) const;
  std::size_t first_entry() const;
  ExactFrame frame() const;
  ExactLine exact(const Line& line) const;

  const SortedSeeds* seeds_ = nullptr;
  const Facet* facet_ = nullptr;
  Index slot_ = 0;
  Vec3 local_[3];             // corners relative to the seed
  double largest_ = 0;        // absolute coordinate of local_
  double facet_squared_ = 0;  // upper bound of the squared distance of any point of the facet
  double reach_ = 0;          // the same of the polygon
  std::vector<Line> lines_;   // the first three are the facet's edges
  std::vector<unsigned> edges_, kept_edges_;  // indices into lines_
  std::vector<Vertex> vertices_, kept_vertices_;
  std::vector<signed char> sides_;
  std::vector<Vec3> points_;
  std::vector<double> densities_;
  bool uncertain_ = false, wider_ = false;
};

}  // namespace bisector
