// What the mesh formats share. The readers are our own because CGAL's neither tell the place of an error nor bound what
// they allocate by the file's size, and they let NaN and indices out of range through.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/io.h"
#include "core/geometry.h"

namespace bisector::io {

inline constexpr double kLargest = 1e100;
inline constexpr const char* kExportAgain = "export the file again";

// For messages of one line: control characters become '?', long text is cut.
std::string printable(std::string_view text, std::size_t limit = 40);

// A path for a message of one line.
std::string name_of(const std::string& path);

// Throws Error, naming the file.
[[noreturn]] void fail(const std::string& path, const std::string& what);

// With the dot; empty if there is none.
std::string lower_extension(const std::string& path);

// All of a file, which must not be empty. Throws Error.
std::string read_bytes(const std::string& path);

// "1 vertex", "2 vertices".
std::string quantity(std::size_t n, const char* one, const char* many);

// What is wrong with a coordinate, or null.
inline const char* coordinate_flaw(double x) {
  if (!std::isfinite(x)) return "a coordinate is not finite; mend the vertex";
  if (std::abs(x) > kLargest) return "a coordinate is beyond 1e100; scale the model";
  return nullptr;
}

// What a file holds.
struct Soup {
  std::vector<Vec3> vertices;
  Csr<Index> faces;
  std::vector<std::int32_t> labels;         // of each face, or empty
  std::vector<std::array<Index, 2>> edges;  // whether or not they are edges of a face
  std::string ignored;                      // what follows the last face, if anything does
  LabelNames label_names = {};
  double unit = 0;                         // of the coordinates, in metres; 0: not known
  std::vector<Attribute> attributes = {};  // of vertices, faces and their corners
  std::vector<std::string> material_files = {};
  LabelNames label_materials = {};  // without labels that of label 0 is that of all faces

  void end_face() { faces.offsets.push_back(faces.values.size()); }
  std::size_t open_corners() const { return faces.values.size() - faces.offsets.back(); }
};

// What read_mesh() makes of a file's contents, with its warnings; the path is for these.
TriangleMesh mesh_of(const std::string& path, Soup soup, const Context& context);

// Readers of a whole file, already in memory; the path is for messages. Indices are checked, coordinates too.
Soup read_off(const std::string& path, std::string_view bytes);
Soup read_obj(const std::string& path, std::string_view bytes);
Soup read_ply(const std::string& path, std::string_view bytes);
Soup read_stl(const std::string& path, std::string_view bytes);
Soup read_vtp(const std::string& path, std::string_view bytes);
Soup read_3mf(const std::string& path, std::string_view bytes);
std::vector<Vec3> read_ply_points(const std::string& path, std::string_view bytes);
std::vector<double> read_ply_attribute(const std::string& path, std::string_view bytes, const std::string& name);
std::vector<double> read_vtp_attribute(const std::string& path, std::string_view bytes, const std::string& name);

// The bytes of a file; the path is for messages. Coordinates must be finite and indices in range; formats of floats
// throw for what is beyond these.
std::string format_off(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_obj(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_ply(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_stl(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_vtp(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_vtu(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_3mf(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_glb(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options);
std::string format_vtu(const PolyhedronMesh& mesh);
std::string format_off(const PolygonMesh& mesh, const WriteOptions& options);
std::string format_obj(const PolygonMesh& mesh, const WriteOptions& options);
std::string format_ply(const PolygonMesh& mesh, const WriteOptions& options);
std::string format_vtp(const PolygonMesh& mesh, const WriteOptions& options);

}  // namespace bisector::io
