// A PLY file of triangles of which only some are looked at: no more of it is in memory than the system finds useful.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "core/geometry.h"
#include "io/ply_header.h"

namespace bisector::io {

class PlyParts {
 public:
  // Throws Error where the file cannot be read in parts: where it is text, or its vertices or faces are not all as long
  // as each other.
  explicit PlyParts(const std::string& path);

  std::size_t vertices() const { return vertices_.count; }
  std::size_t triangles() const { return faces_.count; }
  // Safe to call from many threads. Throw Error where a coordinate is not finite or beyond 1e40, or a face is no
  // triangle or names a vertex that is not there.
  Vec3 vertex(std::size_t v) const;
  Triangle triangle(std::size_t t) const;

 private:
  struct Items {
    std::size_t count = 0, begin = 0, stride = 0;
  };

  double number(Scalar type, std::size_t at) const;
  [[noreturn]] void fail_at(const char* element, std::size_t item, const std::string& what) const;

  struct Unmap {
    std::size_t size;
    void operator()(const char* bytes) const;
  };

  std::string path_;
  std::unique_ptr<const char[], Unmap> bytes_{nullptr, Unmap{0}};
  bool big_endian_ = false;
  Items vertices_, faces_;
  Scalar axis_type_[3] = {}, count_type_ = Scalar::uint8, index_type_ = Scalar::int32;
  std::size_t axis_at_[3] = {}, list_at_ = 0;
};

}  // namespace bisector::io
