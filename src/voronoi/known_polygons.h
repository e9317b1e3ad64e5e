// Polygons of which an earlier diagram with nearby seeds tells how they are bounded: vertices, a certificate and
// moments, of many at once.
//
// A facet is divided as before if every vertex of the division is there as before: it lies within the facet, and no
// other seed is as near to it as those whose cells meet in it; a corner of the facet is owned by the cell that had it.
// For then the boundary of each cell on the facet, which is convex, runs along each of its lines from one of its
// vertices to the next, and closes; and as the facet's own edges are where they were, all polygons turn the way they
// did.
#pragma once

#include <span>
#include <vector>

#include "voronoi/moments.h"
#include "voronoi/neighbours.h"
#include "voronoi/polygon_batch.h"
#include "voronoi/screens.h"
#include "voronoi/surface.h"

namespace bisector {

class KnownPolygons {
 public:
  // Starts a set of polygons of these seeds. `owner`: the slot of each used vertex. All must outlive the set.
  void begin(const Surface& surface, const SortedSeeds& seeds, const Neighbours& neighbours, const Index* owner,
             Screens& screens);
  // Adds a polygon; all those of a facet have to be. `labels` bound it in cyclic order, the least first: slots or facet
  // edges. Until finish() has returned, its moments about the seed are set, those that Clipper::integrate() gives; or
  // `fails` is set to 1, if the facet's certificate does not hold for its part, and nothing is known of the facet.
  void add(Index facet, Index slot, std::span<const Index> labels, Moments& moments, char& fails);
  // Deals with all that were added.
  void finish();

 private:
  struct Polygon {
    Index slot;
    const Index* labels;
    Moments* moments;
    char* fails;
  };
  using Batches = PolygonBatches<Polygon>;
  using Batch = Batches::Batch;

  // A vertex between two lines of a polygon.
  struct Vertex {
    Index before, after;
    unsigned char lane, corner;
  };

  void take(const Batch& batch) const;
  bool is_certain(const Batch& batch, const Vertex& vertex) const;

  const Surface* surface_ = nullptr;
  const SortedSeeds* seeds_ = nullptr;
  const Neighbours* neighbours_ = nullptr;
  const Index* owner_ = nullptr;
  Screens* screens_ = nullptr;
  Batches batches_;
};

}  // namespace bisector
