// What the tetrahedral formats share.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "io/bytes.h"
#include "io/mesh_formats.h"
#include "io/text.h"

namespace bisector::io {

// What a file holds, as it holds it. Regions and labels have one entry per tetrahedron and triangle, or none.
struct TetSoup {
  std::vector<Vec3> vertices;
  std::vector<Tetrahedron> tets;
  std::vector<Triangle> triangles;
  std::vector<std::array<Index, 2>> edges;
  std::vector<std::int32_t> regions, labels;
  LabelNames region_names = {}, label_names = {};
  std::vector<Attribute> attributes = {};           // of vertices and tetrahedra
  std::vector<Attribute> triangle_attributes = {};  // elements are the triangles
  std::size_t curved = 0;                           // elements of second order, of which the corners were taken
  // Medit: the vertices, edges and triangles that are to stay, counted from 1, as the file has them.
  std::vector<std::int64_t> required_vertices = {}, required_edges = {}, required_triangles = {};
};

// What read_tet_mesh() makes of a file's contents, with its warnings; the path is for these.
TetMesh mesh_of(const std::string& path, TetSoup soup, const Context& context);
// A file's triangles as a surface. Throws Error, naming the file, if it has tetrahedra.
Soup surface_of(const std::string& path, TetSoup soup);

// Readers of a whole file, already in memory; the path is for messages. Indices and coordinates are checked.
TetSoup read_medit(const std::string& path, std::string_view bytes);
TetSoup read_medit_binary(const std::string& path, std::string_view bytes);
TetSoup read_gmsh(const std::string& path, std::string_view bytes);
TetSoup read_vtk(const std::string& path, std::string_view bytes);
TetSoup read_vtu(const std::string& path, std::string_view bytes);

// A scalar per vertex: of the point data of the VTK formats, or the first one of a Medit solution.
std::vector<double> read_vtk_attribute(const std::string& path, std::string_view bytes, const std::string& name);
std::vector<double> read_vtu_attribute(const std::string& path, std::string_view bytes, const std::string& name);
// The file of numbers that read_tet_attribute() reads beside a Medit file; empty for files of other formats.
std::string solution_beside(const std::string& path);
std::vector<double> read_medit_solution(const std::string& path, std::string_view bytes);
std::vector<double> read_medit_solution_binary(const std::string& path, std::string_view bytes);

// The bytes of a file; the mesh must be sound.
std::string format_medit(const TetMesh& mesh, const SecondOrder& order);
std::string format_medit_binary(const TetMesh& mesh, const SecondOrder& order);
std::string format_gmsh(const TetMesh& mesh, const SecondOrder& order);
std::string format_vtu(const TetMesh& mesh, const SecondOrder& order);

// Words and bytes of a file that has both. Words may be spread over lines in any way.
class MixedReader {
 public:
  MixedReader(const std::string& path, std::string_view bytes, char comment = 0)
      : path_(path), begin_(bytes.data()), at_(begin_), end_(begin_ + bytes.size()), comment_(comment) {
    if (bytes.starts_with("\xef\xbb\xbf")) at_ += 3;
  }

  bool binary = false, big_endian = false;  // how value() reads

  // The next word; empty at the end of the file.
  std::string_view word() {
    for (; at_ != end_; ++at_) {
      if (comment_ && *at_ == comment_)
        while (at_ != end_ && *at_ != '\n') ++at_;
      if (at_ == end_ || !is_space(*at_)) break;
      line_ += *at_ == '\n';
    }
    const char* start = at_;
    while (at_ != end_ && !is_space(*at_)) ++at_;
    return {start, static_cast<std::size_t>(at_ - start)};
  }
  std::string_view need_word(const char* what) {
    const std::string_view text = word();
    if (text.empty()) fail(fmt::format("the file ends where {} should be; it is truncated, {}", what, kExportAgain));
    return text;
  }
  // The rest of the line, without its end, which is passed.
  std::string_view line() {
    const char* start = at_;
    while (at_ != end_ && *at_ != '\n') ++at_;
    std::string_view text(start, static_cast<std::size_t>(at_ - start));
    if (at_ != end_) {
      ++at_;
      ++line_;
    }
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
  }
  // Passes the next line that begins with `text`; false, at the end of the file, if there is none.
  bool skip_past(std::string_view text) {
    while (at_ != end_)
      if (line().starts_with(text)) return true;
    return false;
  }
  // For values in binary: passes to where they are, if `text` is found.
  bool find_past(std::string_view text) {
    const std::size_t found = std::string_view(at_, remaining()).find(text);
    if (found == std::string_view::npos) return false;
    at_ += found + text.size();
    return true;
  }

  // The next number, of the type that it has in binary.
  template <class T>
  T value() {
    if (binary) {
      if (remaining() < sizeof(T)) fail(std::string("the file ends here; it is truncated, ") + kExportAgain);
      const T x = load<T>(at_, big_endian);
      at_ += sizeof(T);
      return x;
    }
    const std::string_view text = need_word("a number");
    const auto refuse = [this](const std::string& what) { fail(what); };
    if constexpr (std::is_floating_point_v<T>) {
      return static_cast<T>(parse_number(text, refuse));
    } else {
      const std::int64_t x = parse_integer(text, refuse);
      if (!std::in_range<T>(x)) fail("'" + printable(text) + "' is out of range; mend the file");
      return static_cast<T>(x);
    }
  }
  void skip_bytes(std::size_t n) {
    if (remaining() < n) fail(std::string("the file ends here; it is truncated, ") + kExportAgain);
    at_ += n;
  }
  double coordinate() {
    const double x = value<double>();
    if (const char* flaw = coordinate_flaw(x)) fail(flaw);
    return x;
  }
  std::int64_t integer(const char* what) {
    return parse_integer(need_word(what), [this](const std::string& flaw) { fail(flaw); });
  }
  // A number of things given as a word.
  std::size_t count(const char* things) {
    const std::int64_t n = integer(things);
    if (n < 0) fail(fmt::format("the number of {} is negative; {}", things, kExportAgain));
    return static_cast<std::size_t>(n);
  }
  // Fails unless `n` things of that many numbers can follow; an index of vertices must fit 32 bits.
  void need_room(std::size_t n, std::size_t numbers, std::size_t bytes_each, const char* things) const {
    const std::size_t least = std::max<std::size_t>(1, binary ? numbers * bytes_each : 2 * numbers);
    if (n > (remaining() + 1) / least)
      fail(
          fmt::format("{} {} are declared, more than the file can hold; it is truncated, {}", n, things, kExportAgain));
    if (n >= kNone) fail(fmt::format("{} {} are too many; split the model", n, things));
  }

  std::size_t remaining() const { return static_cast<std::size_t>(end_ - at_); }
  const char* position() const { return at_; }
  void seek(const char* position) { at_ = position; }
  [[noreturn]] void fail(const std::string& what) const {
    if (binary) throw Error(fmt::format("{}: byte {}: {}", name_of(path_), at_ - begin_, what));
    throw Error(fmt::format("{}:{}: {}", name_of(path_), line_, what));
  }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  const std::string& path_;
  const char* begin_;
  const char* at_;
  const char* end_;
  std::size_t line_ = 1;
  char comment_;
};

// "tetrahedron 5: index 9 is out of range, ..." for an index counted as in the file.
[[noreturn]] inline void fail_index(const std::string& path, const char* kind, std::size_t element, std::int64_t index,
                                    std::size_t vertices) {
  fail(path, fmt::format("{} {}: index {} is out of range, the file has {} vertices; mend it", kind, element, index,
                         vertices));
}

inline constexpr const char* kStraightOnly =
    "only tetrahedra, triangles and edges of straight sides are read; convert the mesh";
inline constexpr const char* kUpToSecondOrder =
    "only tetrahedra, triangles and edges of first or second order are read; convert the mesh";

}  // namespace bisector::io
