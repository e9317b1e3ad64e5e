// Restricted Voronoi diagrams of surfaces: exact combinatorics, closed-form moments (thesis 4.3, 5.4.2).
//
// The diagram is that of exact arithmetic on the given coordinates, made unique by simulation of simplicity (see
// exact.h): it depends on the seeds and the mesh alone, not on the source of neighbours, the clipping order or the number
// of threads.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bisector/core/types.h"
#include "bisector/voronoi/moments.h"
#include "bisector/voronoi/neighbours.h"
#include "bisector/voronoi/surface.h"

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

// Seconds on a device, from its own clock; all 0 where the CPU computed.
struct DeviceSeconds {
  double transfer = 0, grid = 0, neighbours = 0, owners = 0, clip = 0, sort = 0, sum = 0;

  DeviceSeconds& operator+=(const DeviceSeconds& b);
};

struct DiagramSeconds {
  double delaunay = 0, neighbours = 0, pairs = 0, clip = 0;
  DeviceSeconds device;  // within those above

  DiagramSeconds& operator+=(const DiagramSeconds& b);
};

// How the pairs of a diagram were certified.
struct Certification {
  std::size_t pairs = 0;
  std::size_t uncertain = 0;  // a decision, or a cell's mass in single precision, was within its error bound at first
  std::size_t wider = 0;      // needed a longer list of neighbours
  std::size_t doubled = 0;    // of a device: uncertain in single precision and clipped anew in double
  std::size_t cpu = 0;        // settled by the CPU's exact arithmetic
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
