// Where the vertices of one mesh lie on another one, and the attributes of the other one there.
#pragma once

#include <array>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

// For each of some points a triangle of a surface and the barycentric coordinates of a point of it: none is negative,
// they add up to 1 up to rounding, and are 1, 0, 0 in some order for a point that is a vertex of the surface.
struct SurfaceMap {
  std::vector<Index> triangles;
  std::vector<std::array<double, 3>> weights;
};

// The points of a surface nearest to some points. Throws Error if all of its triangles have no area, Cancelled.
BISECTOR_API SurfaceMap map_to_surface(const std::vector<Vec3>& points, const TriangleMesh& surface,
                                       const Context& context = {});

// The same for tetrahedra; a point outside has the nearest point of the boundary.
struct SolidMap {
  std::vector<Index> tets;
  std::vector<std::array<double, 4>> weights;
};

// Throws Error if there are no tetrahedra, Cancelled.
BISECTOR_API SolidMap map_to_solid(const std::vector<Vec3>& points, const TetMesh& solid, const Context& context = {});

// Whether an attribute is one of those that formats have places of their own for, by its name, type and number of
// components: colours are `color`, `colors`, `rgb` or `rgba` of three or four (red, green, blue, opacity; 0 to 255, or
// 0 to 1 for floats), normals `normal` or `normals` of three, texture coordinates `texcoord`, `uv`, `tcoords` or
// `texture coordinates` of two. Capitals, and blanks, hyphens and underscores between words, make no difference.
enum class AttributeMeaning { other, colour, normal, texture };
BISECTOR_API AttributeMeaning meaning_of(const Attribute& attribute);

// Gives `to` the attributes of `from`, in place of its own; material_files and names of labels are not touched. The
// map is that of the vertices of `to`.
//   vertices   Numbers with a fraction and colours are interpolated, normals made as long as 1 again. Other integers
//              are those of the corner with the greatest weight: what lies between two numbers of parts means nothing.
//   triangles  Those of the triangle nearest to the centroid.
//   corners    A seam is an edge along which the numbers of its triangles' corners differ. A triangle of `to` takes all
//              of its corners' from what lies around the point nearest to its centroid without a seam between, at the
//              points of that nearest to the corners, so that no triangle is stretched across a seam of a texture.
// Texture coordinates of vertices become those of corners where `from` has vertices at one place that differ in them,
// as files have it whose seams are doubled vertices.
// Throws Error if an attribute's values are not as many as it takes, or the map's sizes are not those of `to`;
// Cancelled.
BISECTOR_API void carry_attributes(const TriangleMesh& from, const SurfaceMap& map, TriangleMesh& to,
                                   const Context& context = {});

// The attributes that the above makes, without their values.
BISECTOR_API std::vector<Attribute> carried_attributes(const TriangleMesh& from);

// The vertices' alone, to all vertices of tetrahedra: those inside have what the surface has nearest to them.
BISECTOR_API void carry_attributes(const TriangleMesh& from, const SurfaceMap& map, TetMesh& to,
                                   const Context& context = {});

// The vertices' as above; tetrahedra have those of the one that their centroid is in.
BISECTOR_API void carry_attributes(const TetMesh& from, const SolidMap& map, TetMesh& to, const Context& context = {});

}  // namespace bisector
