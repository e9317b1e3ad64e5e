// What a mesh is like: topology, shapes of triangles and tetrahedra, self-intersections, distances between meshes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

// --- triangle meshes ---

struct MeshTopology {
  bool manifold = false;       // every edge has one or two triangles and every vertex one fan or disk of them
  bool closed = false;         // every edge has at least two triangles
  bool oriented = false;       // across every edge of two triangles they run in opposite directions
  long long euler = 0;         // V - E + F over the vertices that triangles use
  std::size_t components = 0;  // connected through vertices
  std::size_t boundary_edges = 0;
  std::size_t non_manifold_edges = 0;     // of more than two triangles, or from a vertex to itself
  std::size_t non_manifold_vertices = 0;  // whose triangles, linked through edges, fall apart into several fans
};

// All false and 0 if there are no triangles. Every index must be below `vertex_count`.
BISECTOR_API MeshTopology analyse_topology(const std::vector<Triangle>& triangles, std::size_t vertex_count);

struct QualityReport {
  double q_min = 0, q_ave = 0;  // Q = 6/sqrt(3) S/(p h): area, half-perimeter, longest edge; 1 is equilateral
  double theta_min = 0;         // smallest angle, degrees
  double theta_min_ave = 0;     // mean over triangles of their smallest angle, degrees
  double theta_max = 0;         // largest angle, degrees
  double theta_below_30 = 0;    // percent of triangles with an angle under 30 degrees
  // The same without what two of mesh.feature_edges impose on a triangle: its Q, and the angle between them.
  double q_min_free = 0, theta_min_free = 0, theta_max_free = 0, theta_below_30_free = 0;
  double valence6 = 0;                              // fraction of interior vertices with six neighbours
  double edge_min = 0, edge_ave = 0, edge_max = 0;  // lengths, in the mesh's unit
  double area = 0;
  std::size_t zero_area = 0;  // triangles without area: Q 0, angles 0 and 180, left out of the two means
  MeshTopology topology;
};

// All zeros if there are no triangles.
BISECTOR_API QualityReport measure_quality(const TriangleMesh& mesh);

// Pairs of triangles that intersect other than in a shared vertex or edge (exact predicates). Vertices at the same
// point count as one; triangles without area are ignored; two that fold onto each other at their edge do count. Throws
// Cancelled.
BISECTOR_API std::size_t count_self_intersections(const TriangleMesh& mesh, const Context& context = {});

// The same pairs, lower index first, ascending.
BISECTOR_API std::vector<std::array<Index, 2>> find_self_intersections(const TriangleMesh& mesh,
                                                                       const Context& context = {});

// --- distances between surfaces ---

struct DistanceReport {
  // In percent of the diagonal of the reference's bounding box. `mean` and `rms` are over area and the larger of the
  // two one-sided values; `max`, over the samples and vertices of both sides, is the Hausdorff distance from below.
  double mean = 0, rms = 0, max = 0;
  double rms_to_reference = 0, rms_from_reference = 0;
  std::size_t samples = 0;  // on each side
};

inline constexpr std::size_t kDistanceSamples = 200'000;

// Area-uniform stratified samples plus the vertices of each side; reproducible from `random_seed`, for any thread
// count. Throws Error if a mesh has no area, and Cancelled.
BISECTOR_API DistanceReport measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference,
                                             std::size_t samples = kDistanceSamples, std::uint64_t random_seed = 1,
                                             const Context& context = {});
BISECTOR_API DistanceReport measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference,
                                             const Context& context);

using FeatureEdges = std::vector<std::array<Index, 2>>;

struct FeatureDistance {
  // In percent of the diagonal of the bounding box of the reference's triangles, by samples along the edges.
  double vertices = 0;        // largest distance of a vertex of the mesh's feature edges from those of the reference
  double to_reference = 0;    // of a point of the mesh's feature edges
  double from_reference = 0;  // of a point of the reference's feature edges from those of the mesh
};

// All 0 if neither has any; infinite if one alone has none.
BISECTOR_API FeatureDistance measure_feature_distance(const std::vector<Vec3>& vertices, const FeatureEdges& edges,
                                                      const TriangleMesh& reference,
                                                      const FeatureEdges& reference_edges);

// --- tetrahedral meshes ---

struct TetTopology {
  // Every facet has one or two tetrahedra, two lie on opposite sides of it, and no two used vertices lie at the same
  // point. With all tetrahedra positive and a boundary that is closed and free of self-intersections the mesh then
  // fills its solid once.
  bool conforming = false;
  std::size_t components = 0;          // connected through facets
  std::size_t overused_facets = 0;     // of more than two tetrahedra
  std::size_t misoriented_facets = 0;  // of two tetrahedra that lie on the same side, if both are positive
  std::size_t repeated_vertices = 0;   // used ones at the point of one with a lower index
  std::size_t unused_vertices = 0;     // of no tetrahedron
  MeshTopology boundary;               // of the facets with one tetrahedron
};

// All false and 0 if there are no tetrahedra. Every index must be in range.
BISECTOR_API TetTopology analyse_tet_topology(const TetMesh& mesh);

struct TetQualityReport {
  double dihedral_min = 0, dihedral_max = 0;           // of all six angles of all tetrahedra, degrees
  double dihedral_min_mean = 0;                        // mean over tetrahedra of their smallest, degrees
  std::array<std::size_t, 18> dihedral_counts{};       // angles in [0, 10), [10, 20), ... [170, 180] degrees
  double radius_ratio_min = 0, radius_ratio_mean = 0;  // 3 r_in / R_circum: 1 is regular
  double edge_min = 0, edge_ave = 0, edge_max = 0;     // lengths, in the mesh's unit
  double volume = 0, volume_min = 0;                   // signed, in the unit cubed
  // By exact signs. Both kinds count with dihedral angles 0 and 180 and radius ratio 0 and are left out of the two
  // means and of the counts.
  std::size_t inverted = 0, zero_volume = 0;
};

// All zeros if there are no tetrahedra.
BISECTOR_API TetQualityReport measure_tet_quality(const TetMesh& mesh);

}  // namespace bisector
