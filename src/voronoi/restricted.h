// Restricted Voronoi diagrams of surfaces: exact combinatorics, closed-form moments (thesis 4.3, 5.4.2).
//
// The diagram is that of exact arithmetic on the given coordinates, made unique by simulation of simplicity (see
// exact.h): it depends on the seeds and the mesh alone, not on the source of neighbours, the clipping order or the number
// of threads.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "bisector/device.h"
#include "voronoi/moments.h"
#include "voronoi/neighbours.h"
#include "voronoi/surface.h"

namespace bisector {

// The non-empty intersections of cells and triangles, sorted by (triangle, cell).
struct RestrictedPolygons {
  struct Pair {
    Index triangle, cell;
  };
  std::vector<Pair> pairs;
  std::vector<std::size_t> offsets{0};  // polygon k has the entries offsets[k] .. offsets[k + 1)
  // Entry e: the counter-clockwise polygon's vertex and the label of the edge that starts there. The vertex is where the
  // preceding label and this one meet.
  std::vector<Index> labels;
  std::vector<Vec3> vertices;
};

// Integrals over the restricted or clipped cells; positions are relative to the seed.
struct CellMoments {
  std::vector<Moments> cells;      // by seed; zero for an empty cell
  // The mass, or a quarter of the median mass of the six nearest seeds where that is more: a scale for steps that does
  // not vanish with the cell.
  std::vector<double> step_mass;
  double mass = 0;                 // sum over the cells
  double energy = 0;               // sum of the second moments: the CVT energy
  Csr<Index> triangles;            // incident triangles of each cell, of the surface or the solid's boundary, ascending
  Certification certification;
  DiagramSeconds seconds;
};

class RestrictedVoronoi {
 public:
  // The surface must outlive the object.
  explicit RestrictedVoronoi(const Surface& surface, ListLength lists = {});
  ~RestrictedVoronoi();

  // The moments of every cell. Between calls memory is kept, and the owners of the last diagram serve as first guesses.
  void evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result);
  // The same, and the polygons.
  void evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result,
                RestrictedPolygons& polygons);
  // Only who meets whom: sets `triangles`, `certification` and `seconds`, and the polygons if there is room for them.
  void trace(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result, RestrictedPolygons* polygons);

  // Of the last diagram.
  const SortedSeeds& seeds() const;
  const Neighbours& neighbours() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace bisector
