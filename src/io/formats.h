// The formats of meshes: who reads and writes them, and what they hold.
#pragma once

#include <string>
#include <string_view>

#include "bisector/io.h"
#include "io/mesh_formats.h"
#include "io/tet_formats.h"

namespace bisector::io {

// Null where a format has no such reader or writer.
struct Format {
  std::string_view extension;  // in lower case, with the dot
  FileFormat::Labels labels;
  bool (*holds)(const Attribute& attribute) = nullptr;  // null: none
  Soup (*read)(const std::string& path, std::string_view bytes) = nullptr;
  TetSoup (*read_tets)(const std::string& path, std::string_view bytes) = nullptr;
  std::string (*bytes_of)(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options) = nullptr;
  std::string (*bytes_of_polygons)(const PolygonMesh& mesh, const WriteOptions& options) = nullptr;
  std::string (*bytes_of_tets)(const TetMesh& mesh, const SecondOrder& order) = nullptr;
  bool has_second_order = false;
};

// The format of a file's extension. Throws Error, listing what `use` is true of, if there is none or it lacks that use;
// `what` is for the message: "meshes", "polygons", "tetrahedral meshes".
const Format& format_of(const std::string& path, bool FileFormat::*use, const char* what);

}  // namespace bisector::io
