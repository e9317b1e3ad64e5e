// Isotropic tetrahedral meshing by clipped Voronoi diagrams (thesis, chapter 5).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "bisector/context.h"
#include "bisector/device.h"
#include "bisector/export.h"
#include "bisector/features.h"
#include "bisector/mesh.h"
#include "bisector/quality.h"
#include "bisector/remesh.h"

namespace bisector {

// Edge lengths at points, or at the vertices of a background mesh, on whose tetrahedra they are linear.
struct SizeSamples {
  std::vector<Vec3> points;
  std::vector<double> lengths;
  std::vector<Tetrahedron> tets = {};
};

struct TetSizingOptions {
  // As for surfaces (remesh.h), from the boundary into the solid; but an attribute has one value for each vertex of the
  // tetrahedra (in which these lengths are linear), or of the surface that they were made of, and edges are as long as
  // its power -1/5. Gradation must not be 0.
  SizingOptions field;
  SizeSamples
      sizes;  // if not empty, instead of the field's kind: edge lengths, up to a common factor if a count is asked for
};

struct TetOptions {
  // One of these three. Counts are at least 8; edge_length is the wanted mean, in the mesh's unit.
  std::size_t vertices = 0;
  double edge_length = 0;
  std::vector<Vec3> seeds;  // start from these

  TetSizingOptions sizing;
  FeatureOptions features;
  DetailMode detail = DetailMode::budget;  // of the boundary; not with seeds
  std::uint64_t random_seed = 1;
  int iterations = 100;      // of which each phase may make a share (design.md)
  double tolerance = 1e-6;   // a phase ends when the energy falls by less than this share per step
  double min_angle = 40;     // degrees; goal for the boundary's triangles, 0: none
  double min_dihedral = 30;  // degrees; goal for the tetrahedra, 0: slivers stay
  // Length within which borders of a surface are joined, as in remesh.h. Without a value edges and triangles of the
  // size of rounding are mended, too, and solids that touch parted, by 2e-6 of the diagonal at most.
  std::optional<double> weld;
  // Of a surface: each part of space that it encloses is filled, and a region of its own, cavities as well. The surface
  // may branch, where more than two parts meet.
  bool enclosed_regions = false;
  ComputeOptions compute;
  unsigned threads = 0;  // 0: all cores
};

// The shapes of the tetrahedra of a mesh.
struct TetShapes {
  double dihedral_min = 0, dihedral_max = 0;           // degrees
  double radius_ratio_min = 0, radius_ratio_mean = 0;  // 3 r_in / R_circ
  std::size_t below = 0;                               // tetrahedra with a dihedral angle below the goal
};

// What the removal of slivers did.
struct TetImproveReport {
  std::size_t edge_removals = 0, face_removals = 0, contractions = 0, insertions = 0, moves = 0;
  int rounds = 0;
  TetShapes before, after;
  double seconds = 0;
};

struct TetSeconds {
  double total = 0, background = 0, prepare = 0, lbfgs = 0, boundary = 0, extract = 0, improve = 0;
  DiagramSeconds diagrams;  // of the optimiser, summed over its evaluations
};

// A region of a solid, and of the result.
struct TetRegion {
  std::int32_t region = 0;
  std::size_t tets = 0;
  double volume = 0, input_volume = 0;
};

struct TetResult {
  // The vertices of the boundary and the interfaces first; their triangles as marked ones, with the labels of the
  // input's, feature edges, and regions.
  TetMesh mesh;
  std::size_t boundary_vertices = 0;  // on the boundary and the interfaces
  std::size_t interface_triangles = 0;
  std::vector<TetRegion> regions;  // ascending; empty if the solid has none
  RemeshResult boundary;           // without its mesh
  DetailResult detail;             // vertices: of the boundary
  bool delaunay = false;           // the tetrahedra were Delaunay before slivers were removed
  std::size_t steiner_points = 0;  // vertices that TetGen had to add, where they were not
  std::size_t refused_sites = 0;   // sites inside that could not become vertices then
  TetImproveReport improved;
  MeshTopology input_topology;  // of the solid's boundary
  double volume = 0;            // of the solid
  std::size_t background_tets = 0;
  std::size_t boundary_sites = 0;  // whose cells met the boundary at the end of the unconstrained phase
  std::size_t wanted = 0;          // vertices
  double edge_length = 0;          // aimed at
  int iterations = 0;              // accepted steps, all phases
  int evaluations = 0;
  DeviceWork device_work;  // of these, summed
  double energy = 0;       // CVT energy of the final seeds, before slivers were removed
  double gradient_norm = 0;
  Certification certification;  // of the final diagram
  std::size_t untiled =
      0;  // tetrahedra and cells that fail the tiling check of the final diagram: 0, or the run is wrong
  BackendDescription device;  // that computed the final diagram
  TetSeconds seconds;
};

// Meshes the inside of a closed surface. Throws Error if it is open, crosses itself or, but with enclosed_regions, is
// not manifold, on options that contradict each other or the input, and if Bisector was built without TetGen;
// DeviceError if the device asked for is missing or fails; Cancelled.
BISECTOR_API TetResult tetrahedralise(const TriangleMesh& surface, const TetOptions& options,
                                      const Context& context = {});

// Meshes the domain of a tetrahedral mesh anew, whose boundary must be a closed manifold that does not cross itself.
// The interfaces between its regions are remeshed as the boundary is and kept: each of their triangles has a
// tetrahedron of either region.
BISECTOR_API TetResult tetrahedralise(const TetMesh& solid, const TetOptions& options, const Context& context = {});

}  // namespace bisector
