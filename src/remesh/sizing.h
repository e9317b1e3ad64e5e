// Densities for remeshing: from a field on the surface and a wanted size to one value per vertex (thesis 4.4.1, 4.5).
//
// A CVT spreads its energy evenly over the cells; the energy of a cell of diameter h on a surface is about rho h^4, so
// the edges of the result have the length h = unit_edge rho^(-1/4) (Du, Faber and Gunzburger 1999).
#pragma once

#include <array>
#include <vector>

#include "bisector/remesh.h"
#include "core/geometry.h"
#include "features/edge_splits.h"
#include "features/size_field.h"

namespace bisector {

// What is wanted: exactly one of them positive.
struct SizingTarget {
  std::size_t vertices = 0;
  double edge_length = 0;  // the mean over the edges of the result, in the mesh's unit
};

struct Sizing {
  std::vector<double> density;  // per vertex, for Surface; empty if uniform
  double unit_edge = 0;         // edge length where the density is 1
  std::size_t vertices = 0;     // that the result should have
};

// The vertices that a mesh of equilateral triangles of edge length h has, h = unit_edge rho^(-1/4), rho linear on each
// triangle: the integral of 2 / (sqrt(3) h^2) over the surface, and of 1 / (2 h) over the borders. And the mean length
// of its edges: each vertex comes with three of length h.
struct MeshEstimate {
  double vertices = 0, mean_edge = 0;
};
MeshEstimate estimate_mesh(const TriangleMesh& mesh, const Sizing& sizing);

// The density for a mesh as it is. With h0 the edge length of a uniform result and D the diagonal of the box, lfs is
// taken within [h0 / 4, D], or from the spacing of its sample on if that is larger, and |kappa_max| within [1 / D,
// 4 / h0]: what is smaller than the edges could show is no reason to be finer still, and no density is 0 or infinite.
// Curvature is averaged over balls of radius h0, as far as principal_curvatures goes, and its logarithm once more over
// neighbours; lfs is a distance and needs no smoothing. Then h = clamp(limit_gradation(c rho^(-1/4)), min_edge,
// max_edge), c being chosen for the target. Throws Error for a bad value, where the target cannot be had within
// min_edge and max_edge, and for edges so short that they make more than 100 million vertices.
Sizing compute_sizing(const TriangleMesh& mesh, const SizingOptions& options, const SizingTarget& target);

// The edge length aimed at, at a vertex or at barycentric coordinates on a triangle.
double target_edge_length(const Sizing& sizing, Index vertex);
double target_edge_length(const Sizing& sizing, const TriangleMesh& mesh, Index triangle,
                          const std::array<double, 3>& weights);

// Bounds of h beside those of the options; null: none. Where they contradict each other, h is the upper one.
struct SizeLimits {
  const SizeField* most = nullptr;
  const SizeFloor* least = nullptr;

  bool any() const { return most || least; }
};

// A mesh whose triangles can carry the density: the input's surface, its vertices first, edges bisected.
struct SizedMesh {
  TriangleMesh mesh;
  Sizing sizing;
  std::vector<Index> parent;  // input triangle of each triangle
  EdgeSplits splits;
};

// Bisects edges over which rho changes by more than a factor of 10, or of 6 if rho between vertices is not known (lfs),
// unless they are shorter than 0.7 h, and those longer than 2 h if it is not known or, because of `bound`, not within a
// factor of 2.5 of the linear one, as far as points about h apart tell, along the edge or in its triangles; longer than
// 32 h, all. Longer edges of the triangles at such an edge go first (Rivara 1984), and all triangles at an edge are
// bisected with it, so no T-junction and no ever thinner triangle appears. New vertices are middles as rounded; lfs is
// measured there, other fields are linear. Stops at 400,000 triangles or the input's number, if that is larger; a
// uniform density bisects nothing. Throws as compute_sizing.
//
// `bounds` are not scaled with the field.
SizedMesh refine_for_density(const TriangleMesh& mesh, const SizingOptions& options, const SizingTarget& target,
                             const SizeLimits& bounds = {});

}  // namespace bisector
