// One rank's share of a restricted Voronoi diagram that many compute together.
//
// A rank has some of the facets and, of the seeds, all within its region enlarged by a halo: the diagram of these on
// its facets is that of all seeds if no other can be as near to a corner of a polygon as the polygon's own seed, that
// is, if each such ball lies in the enlarged region. For on a convex polygon the difference of two squared distances is
// greatest at a corner. Where a ball reaches out, the halo is made as wide as the balls need; as more seeds only make
// them smaller, once is enough. (Compare Levy, Ray, Merigot, Leclerc, arXiv 2406.04192, who fetch the neighbours that
// cells of some of the seeds name.)
//
// Local indices are monotone in those of all seeds, vertices and triangles, so ties are broken alike. A cell is summed
// where its seed is at home, from the moments of single polygons in ascending order of the triangles' indices in the
// whole mesh: the bits do not tell how many ranks there are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bisector/cells.h"
#include "core/geometry.h"
#include "distributed/collect.h"
#include "distributed/kept_cells.h"
#include "distributed/ranks.h"
#include "distributed/regions.h"
#include "distributed/seed_shares.h"
#include "voronoi/diagram.h"
#include "voronoi/restricted.h"
#include "voronoi/surface.h"

namespace bisector {

// What a rank has, and what its last diagram took.
struct PartFigures {
  std::size_t facets = 0, home_seeds = 0, halo_seeds = 0;
  std::size_t untiled = 0;       // facets that the polygons of the last dual do not tile; anything but 0 is a bug
  double halo = 0;               // width around the region, in which all seeds are known
  std::uint64_t bytes_sent = 0;  // to other ranks, for the last diagram
  int rounds = 0;                // of fetching seeds, for the last diagram
  double cpu_seconds = 0;        // of all threads, for the last diagram
  std::uint64_t memory = 0;      // bytes that the process has held at most
};

class PartDiagram {
 public:
  PartDiagram(SurfacePart part, Regions regions, int rank);

  // The integral of the density over the whole surface: the same for any number of ranks.
  double total_mass(Ranks& ranks) const;

  // Takes part in the diagram of `seeds`, which only rank 0 knows; `halo` is a first guess. There the moments are set,
  // and the triangles, polygons and dual that are wanted, in the indices of the whole mesh. The counts are of all
  // ranks. With a `number` other than 0 each rank keeps what triangles its cells have, for project().
  PairCounts evaluate(Ranks& ranks, const std::vector<Vec3>& seeds, NeighbourSource source, Want want, double halo,
                      std::uint64_t number, Diagram& diagram);
  // Takes part in projecting `seeds`, which only rank 0 knows, to the triangles of their cells in the diagram of this
  // number: the last that was kept, or the one that was projected to last (distributed/kept_cells.h).
  std::vector<Foot> project(Ranks& ranks, std::uint64_t number, std::span<const Vec3> seeds) {
    return kept_.project(ranks, number, seeds, surface_ ? &*surface_ : nullptr, triangle_);
  }
  PartFigures figures() const { return figures_; }

 private:
  // The moments of one polygon of a cell.
  struct Term {
    Index seed, triangle;
    Moments moments;
  };

  const SortedSeeds& seeds() const { return voronoi_ ? voronoi_->seeds() : sorted_; }
  const Neighbours& neighbours() const { return voronoi_ ? voronoi_->neighbours() : lists_; }
  Index id_of(Index slot) const { return ids_[seeds().id[slot]]; }

  void meet_seeds(Ranks& ranks, SeedShares& to_share, const std::vector<Vec3>& all, NeighbourSource source, Want want);
  void receive(const std::string& message);
  void trace(NeighbourSource source, Want want);
  double needed_halo(std::size_t all_seeds) const;
  double halo_of_polygons() const;
  double halo_of_nearest(std::size_t all_seeds) const;
  double depth(const Vec3& p) const;
  std::vector<Term> fetch_terms(Ranks& ranks) const;
  void sum_cells(const std::vector<Term>& fetched, bool list_triangles);
  void set_step_masses(Ranks& ranks);
  void rename_polygons();

  std::optional<Surface> surface_;  // none where the rank has no facet with an area
  std::vector<Index> triangle_;     // of each of the surface's, in the whole mesh
  Regions regions_;
  int rank_;
  Box box_;          // of the region and the facets
  double rounding_;  // bounds the errors of what is compared with the sides of the box
  double halo_ = 0;
  SeedShares shares_;

  std::vector<Index> ids_;  // of the seeds that are known here, ascending
  std::vector<Vec3> x_;
  std::optional<RestrictedVoronoi> voronoi_;  // none without facets; then the seeds are kept here
  SortedSeeds sorted_;
  Neighbours lists_;
  Diagram local_;
  KeptCells kept_;
  PairCounts counts_;
  PartFigures figures_;

  std::vector<Index> home_;  // slots of the seeds that are at home here
  CellsOfRank at_home_;      // the cells of these
};

}  // namespace bisector
