// A triangle mesh with a density, prepared as the domain of restricted Voronoi diagrams.
#pragma once

#include <vector>

#include "bisector/cells.h"
#include "core/geometry.h"
#include "voronoi/moments.h"

namespace bisector {

// One triangle as the clipping reads it. Edge k runs from corner k to corner k + 1.
struct Facet {
  Vec3 corners[3];
  Vec3 normal;              // unit length
  unsigned char anchor;     // the corner of lowest vertex index
  unsigned char origin[3];  // of each edge: its end of lower vertex index
  unsigned char rank[3];    // of each edge among the three, by sorted vertex indices
};

// A linear density on it.
struct FacetDensity {
  double at[3];  // the corners
  Vec3 gradient;
};

// What is needed of a triangle that lies in one cell.
struct FacetSummary {
  Vec3 anchor;      // position of that corner
  Moments moments;  // of the whole triangle, about the anchor
  Index vertex[3];  // the corners' places in Surface::used_vertices
  Index triangle;   // index in the mesh
};

// (b - a) x (c - a) at unit length, each coordinate off by at most 60 units of roundoff; the zero vector exactly when
// the corners are collinear.
Vec3 facet_normal(const Vec3& a, const Vec3& b, const Vec3& c);

struct Surface {
  // `density`: one positive value per vertex, linear on each triangle; empty means 1. Throws Error if the mesh has no
  // area or a density is not positive and finite.
  explicit Surface(TriangleMesh mesh, std::vector<double> density = {});

  TriangleMesh mesh;
  std::vector<double> density;          // per vertex, or empty
  std::vector<Facet> facets;            // in a spatial order; exactly collinear triangles are left out
  std::vector<FacetSummary> summaries;  // of the facets
  std::vector<FacetDensity> densities;  // of the facets; empty where the density is 1
  std::vector<Index> used_vertices;     // of the mesh: those that facets use, in a spatial order
  std::vector<Index> facet_of;          // of each triangle, or kNone
  double area = 0;
  double mass = 0;  // integral of the density
  Box box;          // of the used vertices

  // Null where the density is 1.
  const FacetDensity* density_of(std::size_t facet) const { return densities.empty() ? nullptr : &densities[facet]; }
};

// Some triangles of a surface. Vertices and triangles keep their order, by which ties are broken.
struct SurfacePart {
  TriangleMesh mesh;
  std::vector<double> density;  // of the vertices; empty means 1
  std::vector<Index> triangle;  // of each of mesh.triangles, its index in the whole mesh; ascending
};

// `triangles`: those of the whole surface, ascending.
SurfacePart part_of(const Surface& whole, std::vector<Index> triangles);

}  // namespace bisector
