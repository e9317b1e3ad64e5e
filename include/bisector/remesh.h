// Isotropic surface remeshing by centroidal Voronoi tessellation (thesis, chapter 4).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bisector/context.h"
#include "bisector/device.h"
#include "bisector/export.h"
#include "bisector/features.h"
#include "bisector/mesh.h"
#include "bisector/quality.h"
#include "bisector/repair.h"

namespace bisector {

// How the size of triangles varies. A CVT of density rho has edges of the length c rho^(-1/4).
enum class DensityKind {
  uniform,
  lfs,        // rho = lfs^-exponent (mesh/local_feature_size.h)
  curvature,  // rho = |kappa_max|^exponent (mesh/curvature.h)
  attribute,  // rho as given
};

struct SizingOptions {
  DensityKind kind = DensityKind::uniform;
  double exponent = 0;            // 0: 2 for lfs, 1 for curvature
  std::vector<double> attribute;  // rho, one positive value per vertex; its scale does not matter
  // |h(x) - h(y)| <= gradation |x - y|; 0: no bound. The default lets rho, which is linear between vertices, about
  // double from one vertex of the result to the next: (1 + 0.2)^4 = 2.07. Mesh generators for the finite element method
  // bound the growth of neighbouring elements likewise (Persson 2006, "Mesh size functions for implicit geometries and
  // PDE-based gradient limiting").
  double gradation = 0.2;
  double min_edge = 0, max_edge = 0;        // bounds of h, in the mesh's unit; 0: none
  std::vector<std::array<Index, 2>> sharp;  // edges that have no curvature (FeatureGraph::edges)
};

enum class TopologyControl {
  enforce,  // move seeds to where the dual is not the surface's topologically, or add some, and optimise again
  check,    // report only
  off,
};

enum class Energy {
  automatic,    // constrained. Where the input's normals are noise, creases are not looked for, a dual that is a
                // manifold like the input is not asked for the ball property, and the result is fitted
  constrained,  // seeds end on the surface (CCVT)
  restricted,   // seeds may leave the surface (RCVT), but for those on features
};

// What happens where features are finer than the edges can show.
enum class DetailMode {
  budget,  // details as fine as the number of vertices can pay for get smaller edges; finer ones are merged or let go
  all,     // all details get smaller edges, and the mesh the vertices that it takes
  off,     // edges are as long there as elsewhere
};

struct RemeshOptions {
  // One of these three. Counts are at least 4; edge_length is the wanted mean, in the mesh's unit.
  std::size_t vertices = 0;
  double edge_length = 0;
  std::vector<Vec3> seeds;  // start from these, in one level; topology control may add as many as it takes

  // Vertices, edges and triangles of the input that are those of the result, bit for bit. Kept triangles count among
  // the vertices asked for; edges are as long around what is kept as there.
  std::vector<Index> keep_vertices;
  std::vector<std::array<Index, 2>> keep_edges;
  std::vector<Index> keep_triangles;

  SizingOptions sizing;
  FeatureOptions features;
  DetailMode detail = DetailMode::budget;
  std::uint64_t random_seed = 1;
  int iterations = 100;     // at most, per level; fewer on the coarsest and the finest of several
  double tolerance = 1e-6;  // a level ends when the energy falls by less than this share per step
  int levels = 0;           // of the multilevel start; 0: as many as the count allows, at most 3
  Energy energy = Energy::automatic;
  TopologyControl topology = TopologyControl::enforce;
  double min_angle = 40;  // degrees; goal of the final pass (improve.h), 0: none
  bool fit = false;       // move the result's vertices off the surface, nearer to it on both sides (fit.h)
  // Length within which borders are joined (weld()). Without a value 0, 1e-7, 1e-6 and 1e-5 of the bounding box's
  // diagonal are tried, for files round their coordinates: the first that leaves fewest border and non-manifold edges
  // together is taken, if it leaves no more border edges, nor, beyond 0, more non-manifold ones.
  std::optional<double> weld;
  // If positive: the Hausdorff distance of result and input, in the mesh's unit, is to be no more. Where it may be,
  // edges become shorter, in several runs, while the vertices asked for are fewer than `most_vertices` (0: ten times
  // those without). Not with seeds.
  double distance_max = 0;
  std::size_t most_vertices = 0;
  ComputeOptions compute;
  unsigned threads = 0;  // 0: all cores
};

// What came of RemeshOptions::distance_max.
struct DistanceOutcome {
  double lower = 0, upper = 0;    // bounds of the Hausdorff distance of the result and the input
  int runs = 0;                   // with shorter edges
  std::size_t most_vertices = 0;  // that could be asked for
};

// What the final pass did to bad triangles and irregular vertices.
struct ImproveReport {
  std::size_t trials = 0;                 // changes that were tried on a patch
  std::size_t made = 0;                   // that stayed, of a patch each
  std::size_t inserted = 0, removed = 0;  // seeds, by those
  std::size_t missed = 0;                 // triangles that it left with an angle beyond the goal
};

// What was done in the mesh itself to bad angles, feature curves and crossings that no seeds could mend.
struct MendReport {
  std::size_t bad = 0;                    // triangles with an angle below 30 degrees that no two curves impose, before
  std::size_t made = 0;                   // changes that stayed
  std::size_t inserted = 0, removed = 0;  // vertices, by those
};

// What moving the vertices off the surface has changed.
struct FitReport {
  // Root mean squares over area, in percent of the diagonal of the reference's bounding box, as the fit's own samples
  // see them: after the fit a little less than what others measure. The sum of the two squares never rises.
  struct Distance {
    double to_reference = 0, from_reference = 0;
  };
  Distance before, after;
  int iterations = 0;        // steps taken
  std::size_t damped = 0;    // vertices that the quality of a triangle held back in the last step
  std::size_t restored = 0;  // vertices put back because triangles would have intersected
};

// A cell, edge or vertex of the diagram that breaks the topological ball property.
struct TopologyFault {
  std::vector<Index> seeds;  // one, two or three
  Vec3 position;             // of the first seed
  std::string what;          // "2 components", "closed", ...
};
struct RemeshSeconds {
  double total = 0, prepare = 0, lbfgs = 0, features = 0, topology = 0, improve = 0, fit = 0, extract = 0;
  DiagramSeconds diagrams;  // of the optimiser, summed over its evaluations
};

// What became of the input's features where they are fine (remesh/detail.h).
struct DetailResult {
  double width = 0;          // details below it were merged or let go; 0: there are none
  std::size_t merged = 0;    // curves that a neighbour stands for
  std::size_t let_go = 0;    // curves that nothing stands for
  std::size_t vertices = 0;  // that would resolve all; 0: far more than were asked for
};

struct FeatureResult {
  std::size_t curves = 0, corners = 0;  // of the input, without details that were merged or let go
  std::size_t broken = 0;               // curves that are not chains of edges of the result
  std::size_t seeds = 0;                // of the result, on features
  FeatureDistance distance;             // of the result's feature edges and the input's, before a fit
};

struct RemeshResult {
  // The restricted Delaunay triangulation of the seeds that own a cell, but for kept triangles, what surrounds kept
  // edges that seeds had divided, and what was mended. Where sheets would cross by less, vertices lie up to a tenth of
  // an edge off the surface. Its feature_edges are the edges along the input's features; labels are those of the
  // input's triangles in which its dual vertices lie.
  TriangleMesh mesh;
  std::vector<SeedPlace> places;   // of mesh's vertices
  std::vector<Index> kept;         // of each of mesh's vertices, the input's that it is, or kNone; empty: none is kept
  std::size_t kept_triangles = 0;  // the last ones of mesh, in the input's order
  MeshTopology topology;           // of mesh
  MeshTopology input_topology;     // after welding and orienting
  bool topology_matches = false;   // manifold, oriented, closed and of Euler characteristic and components as the input
  bool ball_property = false;      // of the final diagram, without stray parts of cells
  std::size_t divided = 0;         // vertices beside their cell's first, where sheets cross or nearly touch (sheets.h)
  std::vector<TopologyFault> faults;  // where it fails; indices are those of mesh's vertices, kNone if none
  FeatureResult features;
  DetailResult detail;
  bool noisy = false;      // the input's normals were taken for noise
  WeldResult welded;       // without the mesh; vertex_of is kNone where no triangle uses a vertex
  std::size_t wanted = 0;  // vertices
  double edge_length = 0;  // aimed at where the density is 1
  ImproveReport improved;
  MendReport mended;
  FitReport fitted;
  DistanceOutcome distance;  // all 0 unless one was asked for
  int iterations = 0;        // accepted steps, all levels
  int evaluations = 0;
  DeviceWork device_work;       // of these, summed
  double energy = 0;            // CVT energy of the final seeds
  double gradient_norm = 0;     // Euclidean norm over all seeds (tangential where constrained)
  Certification certification;  // of the final diagram
  std::size_t untiled = 0;      // triangles that fail the tiling check of the final diagram: 0, or the run is wrong
  BackendDescription device;    // that computed the final diagram
  RemeshSeconds seconds;
};

// Remeshes a surface. Throws Error on input without area, on options that contradict each other or the input, and on
// fewer than 4 vertices; DeviceError if the device asked for is missing or fails; and Cancelled.
BISECTOR_API RemeshResult remesh(const TriangleMesh& input, const RemeshOptions& options, const Context& context = {});

}  // namespace bisector
