#include "io/ply_parts.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

#include "core/magnitude.h"

namespace bisector::io {
namespace {

constexpr const char* kAskForParts = "write it as binary PLY with nothing but triangles";

}  // namespace

PlyParts::PlyParts(const std::string& path) : path_(path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (file < 0 || fstat(file, &status) != 0) {
    const std::string why = std::strerror(errno);
    if (file >= 0) close(file);
    fail(path, "cannot be read: " + why + "; check its name and permissions");
  }
  const auto size = static_cast<std::size_t>(status.st_size);
  void* mapped = size ? mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0) : MAP_FAILED;
  close(file);
  if (mapped == MAP_FAILED) fail(path, "cannot be read in parts; it has to be a file on disk that is not empty");
  bytes_ = std::unique_ptr<const char[], Unmap>(static_cast<const char*>(mapped), Unmap{size});

  TextReader in(path_, {bytes_.get(), size}, 0);
  const PlyHeader header = read_ply_header(in);
  if (header.text) fail(path, fmt::format("a PLY file in text cannot be read in parts; {}", kAskForParts));
  big_endian_ = header.big_endian;
  std::size_t at = size - in.after_line().size();
  for (const PlyElement& element : header.elements) {
    Items items{element.count, at, 0};
    int axes = 0, lists = 0;
    for (const PlyProperty& p : element.properties) {
      if (element.name == "vertex" && !p.list && axis_of(p) >= 0) {
        axis_type_[axis_of(p)] = p.type;
        axis_at_[axis_of(p)] = items.stride;
        ++axes;
      }
      if (p.list) {
        if (element.name != "face" || !is_index_list(p) || lists++ > 0)
          fail(path, fmt::format("the list '{}' of '{}' has no fixed length; {}", printable(p.name),
                                 printable(element.name), kAskForParts));
        count_type_ = p.count_type;
        index_type_ = p.type;
        list_at_ = items.stride;
        items.stride += size_of(p.count_type) + 3 * size_of(p.type);
      } else {
        items.stride += size_of(p.type);
      }
    }
    if (items.stride > 0 && element.count > (size - at) / items.stride)
      fail(path, fmt::format("the file ends within its {} items of '{}'; {}", element.count, printable(element.name),
                             kExportAgain));
    at += element.count * items.stride;
    if (element.name == "vertex" && axes == 3) vertices_ = items;
    if (element.name == "face" && lists == 1) faces_ = items;
    if (vertices_.count > 0 && faces_.count > 0) break;
  }
  if (vertices_.count == 0 || faces_.count == 0)
    fail(path, "there are no vertices with x, y, z or no faces with vertex_indices; export the file with a surface");
}

void PlyParts::Unmap::operator()(const char* bytes) const { munmap(const_cast<char*>(bytes), size); }

double PlyParts::number(Scalar type, std::size_t at) const { return load_scalar(type, bytes_.get() + at, big_endian_); }

void PlyParts::fail_at(const char* element, std::size_t item, const std::string& what) const {
  fail(path_, fmt::format("{} {}: {}", element, item, what));
}

Vec3 PlyParts::vertex(std::size_t v) const {
  const std::size_t at = vertices_.begin + v * vertices_.stride;
  Vec3 p;
  for (int k = 0; k < 3; ++k) {
    p[k] = number(axis_type_[k], at + axis_at_[k]);
    if (const char* flaw = coordinate_flaw(p[k])) fail_at("vertex", v, flaw);
    if (std::abs(p[k]) > kLargestCoordinate)
      fail_at("vertex", v, fmt::format("a coordinate is beyond {:g}; scale the model", kLargestCoordinate));
  }
  return p;
}

Triangle PlyParts::triangle(std::size_t t) const {
  std::size_t at = faces_.begin + t * faces_.stride + list_at_;
  const double corners = number(count_type_, at);
  if (corners != 3) fail_at("face", t, fmt::format("it has {} corners; {}", corners, kAskForParts));
  at += size_of(count_type_);
  Triangle triangle;
  for (Index& v : triangle) {
    const double index = number(index_type_, at);
    if (!(index >= 0 && index < static_cast<double>(vertices_.count) && index == std::floor(index)))
      fail_at("face", t, fmt::format("there is no vertex {} of {}; {}", index, vertices_.count, kExportAgain));
    v = static_cast<Index>(index);
    at += size_of(index_type_);
  }
  return triangle;
}

}  // namespace bisector::io
