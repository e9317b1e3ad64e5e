// Mesh files: OFF, OBJ, PLY (ASCII and binary) and STL (ASCII and binary), in and out; seeds as .xyz.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

// Reads a mesh by its file name's extension. Polygons are split into triangles (face_of_triangle tells from which
// face), identical STL corners are merged. Vertices that no face uses and zero-area triangles are kept, so that indices
// stay those of the file; each kind is counted in one warning, and so are polygons that were split and what follows the
// last face. Face labels are the property `label` of a PLY file, of any integer type (from 2^31 on they wrap around),
// and the groups of an OBJ file where it has more than one: each pair of `g` and `usemtl` gets the next number from 0
// as its first face appears; where all are named as write_mesh does, the numbers in the names. Feature edges are
// `vertex1 vertex2` of the PLY element `edge` and the lines `l` of an OBJ file, ascending, each once and with the lower
// vertex first; those that are not edges of a triangle are left out with a warning. Throws Error, naming the file and
// the line, vertex or face (counted from 0), for: a missing, empty or truncated file, an unknown format, NaN or
// infinite coordinates, coordinates beyond 1e100, an index out of range, a face of fewer than three corners, no face at
// all. Memory is bounded by the file's size, not by its counts.
TriangleMesh read_mesh(const std::string& path, const Context& context = {});

// How an OBJ file's groups are called: PREFIX_K, K being the label, or PREFIX_K_NAME where the labels 0, 1, ... have names.
struct GroupNames {
  std::string prefix = "label";  // label, region or branch; others are not read back as labels
  std::vector<std::string> names = {};
};

// Writes a mesh by extension, with as many of 17 significant digits as it takes to read back the same bits (STL is
// binary and float, as the format demands; PLY binary and double). Labels become the face property `int label` in PLY
// and groups `label_K` in OBJ, or `PREFIX_K` or `PREFIX_K_NAME` as `groups` says; feature edges the
// element `edge` in PLY and lines `l` in OBJ; OFF and STL hold neither. The file appears under its name only when
// complete. Throws Error, also for coordinates that are not finite or beyond the format's range, indices out of range,
// labels that are not one per triangle and labels without a name among those given.
void write_mesh(const std::string& path, const TriangleMesh& mesh, const GroupNames& groups = {});

// A coloured polygon mesh as binary PLY (double coordinates; one colour and one integer label per face).
struct PolygonMesh {
  std::vector<Vec3> vertices;
  Csr<Index> polygons;
  std::vector<Index> labels;                       // one per polygon, or empty; property "label"
  std::vector<std::array<unsigned char, 3>> colours;  // one per polygon, or empty: red, green, blue
  std::vector<std::array<Index, 2>> feature_edges = {};  // element "edge", or empty
};
void write_polygons(const std::string& path, const PolygonMesh& mesh);

// Reads the vertices of a .ply file, with or without faces, and any other as "x y z" lines; '#' starts a comment, further
// columns are ignored. Throws Error as read_mesh does.
std::vector<Vec3> read_points(const std::string& path);

// Reads a number for each vertex from a scalar property of a PLY file's element `vertex`. Throws Error, listing the
// properties that are there, if `name` is not among them, and for other formats and values that are not finite.
std::vector<double> read_vertex_attribute(const std::string& path, const std::string& name);

// Reads "a b" lines, vertex indices counted from 0 as in the mesh's file; '#' starts a comment, further columns are
// ignored. Ascending, each edge once and with the lower vertex first. Throws Error, naming the line, for what is not an
// edge of the mesh.
std::vector<std::array<Index, 2>> read_feature_edges(const std::string& path, const TriangleMesh& mesh);

// Writes what read_feature_edges reads. Throws Error.
void write_feature_edges(const std::string& path, const std::vector<std::array<Index, 2>>& edges);

// Writes bytes to a temporary name beside `path` and renames it when complete, so no half file is ever seen under
// `path`. A link is followed; a device or pipe is written directly. Throws Error.
void write_file(const std::string& path, const std::string& bytes);

}  // namespace bisector
