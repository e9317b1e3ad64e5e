// Files of tetrahedral meshes: Medit .mesh, Gmsh .msh, VTK .vtk and .vtu.
#pragma once

#include <string>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

// Whether a file name's extension is one of those below. Such files may hold triangles only.
bool is_tet_format(const std::string& path);

// Reads a mesh by its file name's extension: Medit .mesh (ASCII); Gmsh .msh of version 2.2 or 4.1, ASCII and binary;
// legacy .vtk with an unstructured grid, ASCII and binary; .vtu with one piece, ASCII, base64, raw, zlib-compressed or
// not. Tetrahedra become `tets`, turned positive by the exact sign (those of no volume stay and are counted in a
// warning), triangles `boundary`, turned outward where they have a tetrahedron on one side only, edges `feature_edges`,
// ascending, each once and with the lower vertex first. A file without tetrahedra gives an empty `tets`;
// surface_of_marks makes it a surface.
//
// Regions and labels are the refs of Medit; the first physical group of Gmsh, or, where there are none, the elementary
// entity; in VTK the cell data `region` or `label` of tetrahedra, `label` of triangles (or what other programs write:
// medit:ref, gmsh:physical, gmsh:geometrical, CellEntityIds). Where all are 0 there are none. Vertices keep the file's
// order, in Gmsh that of their tags, and stay though nothing uses them.
//
// Throws Error, naming the file and the line, byte, vertex or cell, for: a missing, empty, damaged or truncated file,
// other formats and versions, NaN or infinite coordinates and those beyond 1e100, an index out of range, a repeated
// corner, and elements that are curved or neither tetrahedra, triangles, edges nor points. Memory is bounded by the
// file's size.
TetMesh read_tet_mesh(const std::string& path, const Context& context = {});

// Writes Medit .mesh (ASCII), Gmsh .msh (4.1, ASCII) or .vtu (base64) by extension; read_tet_mesh brings back the same
// bits. In Gmsh each region is a volume, each label a surface, and feature edges are curves between their branches,
// with the physical groups region_K, label_K and features (volume and boundary where there are no numbers). The file
// appears under its name only when complete. Throws Error, also for a mesh whose indices, coordinates or numbers of
// marks are unsound.
void write_tet_mesh(const std::string& path, const TetMesh& mesh);

// A number for each vertex: the scalar point data `name` of a .vtk or .vtu file, or, for a .mesh file, the first scalar
// of the Medit solution beside it (NAME.sol for NAME.mesh; `name` does not matter). Throws Error as read_tet_mesh, and
// for values that are not finite or not one per vertex.
std::vector<double> read_tet_attribute(const std::string& path, const std::string& name);

// The marked triangles as a surface with all vertices, labels and those feature edges that are edges of it.
TriangleMesh surface_of_marks(const TetMesh& mesh);

}  // namespace bisector
