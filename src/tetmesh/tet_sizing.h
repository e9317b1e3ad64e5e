// Edge lengths for tetrahedral meshes: from a field on the boundary, on the vertices or on a background mesh to one
// length everywhere in the solid (thesis 5.5.1).
//
// A CVT spreads its energy evenly over the cells; the energy of a cell of diameter h in three dimensions is about rho
// h^5, so the edges of the result have the length h = unit_edge rho^(-1/5) (Du, Faber and Gunzburger 1999).
#pragma once

#include <vector>

#include "bisector/tetmesh.h"
#include "features/edge_splits.h"
#include "features/size_field.h"
#include "remesh/sizing.h"

namespace bisector {

// A solid whose tetrahedra can carry the density.
struct SizedSolid {
  TetMesh mesh;  // the input's, its vertices first, edges bisected; regions, marks and feature edges follow
  std::vector<double> lengths;  // h at each vertex; empty if uniform
  EdgeSplits splits;
  double edge_length = 0;    // the mean aimed at
  std::size_t vertices = 0;  // that the result should have

  std::vector<double> volume_density() const;   // (edge_length / h)^5, for Solid; empty if uniform
  std::vector<double> surface_density() const;  // (edge_length / h)^4, for Surface
};

// The vertices of a tetrahedral mesh with edges of length h: a body-centred cubic lattice, whose cells a CVT's are
// about, has 1.575 / h^3 of them per volume for the mean h of its edges; on the boundary there are as many as an
// equilateral triangulation has, each with half a cell.
double estimate_tet_vertices(double volume, double area, double h);
// What a target means where all edges are alike. Throws Error if the solid has no volume, or would get more vertices
// than may be asked for.
struct UniformSize {
  double edge_length = 0;
  std::size_t vertices = 0;
};
UniformSize uniform_size(const TetMesh& mesh, const TriangleMesh& boundary, const SizingTarget& target);
// Those of its cells in a solid, for the lengths that it is sized for, of which each vertex on the boundary has half a
// one.
double estimate_cells(const SizedSolid& sized);

// Bisects edges that are longer than 2 h at one of their ends, longest first (Rivara 1984). With a gradation of 0.2 the
// linear density then stands for lengths within 8 % of h, and its integrals are exact; edges of length h would take
// eight times as many tetrahedra. A uniform size bisects nothing, nor does a bound where it does not reach.
// `target.vertices` is of the whole mesh. Stops at 2 million tetrahedra or the input's number, if that is larger.
// `boundary` is the mesh's, on the same vertices. `bound`, in the mesh's unit, is what edges should not be longer than;
// the others become at most twice as long for it. With `more_vertices` they stay as they are, and the result has as
// many vertices as that takes. Throws Error as refine_for_density does.
SizedSolid refine_for_sizes(const TetMesh& mesh, const TriangleMesh& boundary, const TetSizingOptions& options,
                            const SizingTarget& target, const SizeField* bound = nullptr, bool more_vertices = false);

}  // namespace bisector
