// The header of a PLY file: which elements follow, and of what.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "io/text.h"

namespace bisector::io {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t size_of(Scalar type);
// The number whose bytes begin there.
double load_scalar(Scalar type, const char* bytes, bool big_endian);

struct PlyProperty {
  std::string name;
  Scalar type;
  bool list = false;
  Scalar count_type = Scalar::uint8;
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  // Bytes that one item takes at least.
  std::size_t least_size() const {
    std::size_t size = 0;
    for (const PlyProperty& p : properties) size += size_of(p.list ? p.count_type : p.type);
    return size;
  }
};

struct PlyHeader {
  bool text = false, big_endian = false;
  std::vector<std::string> textures;  // of comments "TextureFile NAME"
  std::vector<PlyElement> elements;

  const PlyElement* find(std::string_view name) const {
    for (const PlyElement& e : elements)
      if (e.name == name) return &e;
    return nullptr;
  }
};

inline bool is_index_list(const PlyProperty& p) {
  return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
}

// Of a coordinate, or -1.
inline int axis_of(const PlyProperty& p) { return p.name == "x" ? 0 : p.name == "y" ? 1 : p.name == "z" ? 2 : -1; }

// Leaves the reader in the last line of the header. Throws Error.
PlyHeader read_ply_header(TextReader& in);

}  // namespace bisector::io
