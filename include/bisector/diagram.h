// One diagram: the Voronoi cells of given seeds on a surface or in a solid, and the dual triangles and tetrahedra.
//
// Diagrams are those of exact arithmetic on the given coordinates, made unique by simulation of simplicity: what meets
// what does not depend on the device, the source of neighbours or the number of threads. Coordinates and integrals are
// rounded.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/cells.h"
#include "bisector/context.h"
#include "bisector/device.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

struct DiagramOptions {
  ComputeOptions compute;
};

// Integrals over one cell.
struct DiagramCell {
  double mass = 0;    // of the density: the area or volume where it is 1; 0 for a cell that misses the surface or solid
  Vec3 centroid;      // of the density; the seed itself where the mass is 0
  double energy = 0;  // of the density times the squared distance from the seed
};

struct SurfaceDiagram {
  std::vector<DiagramCell> cells;  // by seed. Of equal seeds the first has the cell and the others have none
  double mass = 0;                 // sum over the cells
  double energy = 0;               // sum over the cells: the energy of centroidal Voronoi tessellations
  double surface_mass = 0;    // integral of the density over the surface, which `mass` differs from by rounding only:
  double mass_tolerance = 0;  // at most this much of it
  RestrictedPolygons polygons;
  Dual dual;
  // The certificate of the polygons: the number of triangles that they do not tile, edge to edge. Anything but 0 is a
  // bug.
  std::size_t untiled = 0;
  BackendDescription device;  // that computed
  Certification certification;
  DiagramSeconds seconds;
};

struct SolidDiagram {
  std::vector<DiagramCell> cells;  // by seed. Of equal seeds the first has the cell and the others have none
  double mass = 0;                 // sum over the cells
  double energy = 0;               // sum over the cells
  double solid_mass = 0;      // integral of the density over the solid, which `mass` differs from by rounding only:
  double mass_tolerance = 0;  // at most this much of it
  ClippedPolyhedra polyhedra;
  // Sets of four seeds whose cells meet in a point inside the solid, each ascending, sorted, without repeats.
  std::vector<Tetrahedron> dual_tets;
  // The boundary: facets of tetrahedra with no other across, counter-clockwise seen from outside, over the vertices of
  // the input; and the diagram restricted to it, whose triangles are these.
  std::vector<Triangle> boundary;
  RestrictedPolygons boundary_polygons;
  Dual boundary_dual;
  // The certificate of polyhedra and polygons: the number of tetrahedra, whole cells and boundary triangles that they
  // do not tile, facet to facet and edge to edge. Anything but 0 is a bug.
  std::size_t untiled = 0;
  BackendDescription device;  // that computed
  Certification certification;
  DiagramSeconds seconds;
};

// The diagram of the seeds restricted to a surface (thesis 4.3). `density`: one positive value per vertex, linear on
// each triangle; empty means 1. Exactly collinear triangles are left out. Throws Error if there are no seeds, a
// coordinate is not finite or beyond 1e40, the mesh has none of 1e-40 or more, names a vertex that it lacks or has no
// area, a density is not positive and finite, or the CPU is asked for single precision; DeviceError if an exact request
// for a device cannot be met.
BISECTOR_API SurfaceDiagram compute_diagram(const TriangleMesh& surface, const std::vector<double>& density,
                                            const std::vector<Vec3>& seeds, const DiagramOptions& options = {},
                                            const Context& context = {});

// The diagram of the seeds clipped to a solid (thesis 5.4). `density`: as above, on each tetrahedron. Tetrahedra of
// either orientation are accepted; those of exactly no volume are left out. Throws as above, and Error if a facet has
// more than two tetrahedra or two on one side, or there is no volume.
BISECTOR_API SolidDiagram compute_diagram(const TetMesh& solid, const std::vector<double>& density,
                                          const std::vector<Vec3>& seeds, const DiagramOptions& options = {},
                                          const Context& context = {});

}  // namespace bisector
