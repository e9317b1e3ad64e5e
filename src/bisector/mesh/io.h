// Mesh files: OFF, OBJ, PLY (ASCII and binary) and STL (ASCII and binary), in and out; seeds as .xyz.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bisector/core/context.h"
#include "bisector/core/types.h"

namespace bisector {

// Reads a mesh by its file name's extension. Polygons are split into triangles (face_of_triangle tells from which
// face), identical STL corners are merged. Vertices that no face uses and zero-area triangles are kept, so that
// indices stay those of the file; each kind is counted in one warning, and so are polygons that were split and what
// follows the last face. Throws Error, naming the file and the line, vertex or face (counted from 0), for: a missing,
// empty or truncated file, an unknown format, NaN or infinite coordinates, coordinates beyond 1e100, an index out of
// range, a face of fewer than three corners, no face at all. Memory is bounded by the file's size, not by its counts.
TriangleMesh read_mesh(const std::string& path, const Context& context = {});

// Writes a mesh by extension, with as many of 17 significant digits as it takes to read back the same bits (STL is
// binary and float, as the format demands; PLY binary and double). The file appears under its name only when complete.
// Throws Error, also for coordinates that are not finite or beyond the format's range and indices out of range.
void write_mesh(const std::string& path, const TriangleMesh& mesh);

// A coloured polygon mesh as binary PLY (double coordinates; one colour and one integer label per face).
struct PolygonMesh {
  std::vector<Vec3> vertices;
  Csr<Index> polygons;
  std::vector<Index> labels;                       // one per polygon, or empty; property "label"
  std::vector<std::array<unsigned char, 3>> colours;  // one per polygon, or empty: red, green, blue
};
void write_polygons(const std::string& path, const PolygonMesh& mesh);

// Reads "x y z" lines; '#' starts a comment, further columns are ignored. Throws Error as read_mesh does.
std::vector<Vec3> read_points(const std::string& path);

// Writes bytes to a temporary name beside `path` and renames it when complete, so no half file is ever seen under
// `path`. A link is followed; a device or pipe is written directly. Throws Error.
void write_file(const std::string& path, const std::string& bytes);

}  // namespace bisector
