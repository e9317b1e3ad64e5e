// Polygons of which an earlier diagram with nearby seeds tells how they are bounded: vertices, a certificate and
// moments, of many at once.
//
// A facet is divided as before if every vertex of the division is there as before. Each vertex is where it was among
// the lines if its polygons turn the right way there, it lies within the facet, and no other seed is as near to it as
// those whose cells meet in it (a corner of the facet: if the cell that had it owns it). Then the boundary of each cell
// on the facet, which is convex, runs along each of its lines from one of its vertices to the next, and closes.
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
  KnownPolygons();

  // Starts a set of polygons of these seeds. `owner`: the slot of each used vertex. All must outlive the set.
  void begin(const Surface& surface, const SortedSeeds& seeds, const Neighbours& neighbours, const Index* owner,
             Screens& screens);
  // Adds a polygon; all those of a facet have to be. `labels` bound it in cyclic order, the least first: slots or facet
  // edges.
  void add(Index facet, Index slot, std::span<const Index> labels);
  // Adds one of which nothing is known.
  void add_unknown() { polygons_.emplace_back(); }
  // Computes all of them.
  void run();

  // Of the polygon that was added as the k-th: whether it passed its part of the facet's certificate, which holds if
  // all polygons of the facet pass; and its moments about the seed then, those that Clipper::integrate() gives.
  bool passes(std::size_t k) const { return polygons_[k].passes; }
  const Moments& moments(std::size_t k) const { return polygons_[k].moments; }
  Index slot(std::size_t k) const { return polygons_[k].slot; }
  std::span<const Index> labels(std::size_t k) const {
    return {labels_.data() + polygons_[k].first_label, polygons_[k].count};
  }
  std::size_t size() const { return polygons_.size(); }

 private:
  struct Polygon {
    Index facet = 0, slot = 0;
    Index first_label = 0, count = 0;
    bool passes = false;
    Moments moments;
  };

  void finish(PolygonBatch& batch);
  bool is_certain(const PolygonBatch& batch, std::size_t lane) const;
  bool is_empty_ball(Index slot, const Vec3& centre, double slack, Index one, Index other) const;

  const Surface* surface_ = nullptr;
  const SortedSeeds* seeds_ = nullptr;
  const Neighbours* neighbours_ = nullptr;
  const Index* owner_ = nullptr;
  Screens* screens_ = nullptr;
  std::vector<Polygon> polygons_;
  std::vector<Index> labels_;
  std::vector<PolygonBatch> batches_;  // by number of corners
};

}  // namespace bisector
