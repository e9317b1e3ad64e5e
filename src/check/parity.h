// How far two evaluations of the same seeds agree.
#pragma once

#include "voronoi/clipped.h"
#include "voronoi/restricted.h"

namespace bisector {

// Errors are the worst over all cells and infinite where a value is not a number. A cell's size is that of `a`: the
// mass is CellMoments::step_mass, so that slivers of cells do not count as cells of their own size (at least 1e-12 of
// the mean), and the length the square root of the area (of solids the cube root of the volume) that this mass has at
// the mean density, or the cell's root mean square distance if that is more.
struct Parity {
  bool same_pairs = false;    // of cell and triangle, or tetrahedron
  bool same_labels = false;   // of all polygons or polyhedra, in order; of these the vertices too
  bool same_dual = false;     // the restricted Delaunay triangulation with its multiplicities, or the dual tetrahedra
  bool bitwise = false;       // everything but seconds and certification
  double mass_error = 0;      // relative to the mass
  double centroid_error = 0;  // of the first moment, relative to mass times length: centroids in lengths
  double energy_error = 0;    // of the second moment, relative to mass times length squared
  double sum_error = 0;       // of the sum of b's masses, relative to the domain's mass
};

// Whether all but seconds and certification is equal to the last bit.
bool same_bits(const CellMoments& a, const CellMoments& b);

// Compares `b` with the reference `a`.
Parity compare(const CellMoments& a, const RestrictedPolygons& polygons_a, const CellMoments& b,
               const RestrictedPolygons& polygons_b, const Surface& surface);
Parity compare(const CellMoments& a, const ClippedPolyhedra& polyhedra_a, const CellMoments& b,
               const ClippedPolyhedra& polyhedra_b, const Solid& solid);

}  // namespace bisector
