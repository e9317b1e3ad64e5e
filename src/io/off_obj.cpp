// OFF (Geomview's object file format, geomview.org/docs/html/OFF.html) and Wavefront's OBJ.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "io/bytes.h"
#include "io/labels.h"
#include "io/mesh_formats.h"
#include "io/text.h"

namespace bisector::io {

namespace {

// What the header says of the numbers that a point has; all but the coordinates are ignored.
struct OffHeader {
  bool binary = false;
  std::size_t columns = 3;  // numbers of a point, with normal, colour and texture coordinates
};

OffHeader read_off_header(TextReader& in) {
  if (!in.next_line()) in.fail_truncated("comments");
  const std::string_view word = in.word();
  if (!word.ends_with("OFF") && word != "off")
    in.fail("does not begin with OFF but with '" + printable(word) + "'; check that this is an OFF file");
  std::string_view prefix = word.substr(0, word.size() - 3);
  if (prefix.find_first_of("4n") != std::string_view::npos)
    in.fail("'" + printable(word) + "' has points of other than three coordinates; export as OFF");
  OffHeader header;
  if (prefix.starts_with("ST")) {
    header.columns += 2;
    prefix.remove_prefix(2);
  }
  if (prefix.find('C') != std::string_view::npos) header.columns += 4;
  if (prefix.find('N') != std::string_view::npos) header.columns += 3;
  header.binary = TextReader(in).word() == "BINARY";
  return header;
}

struct OffCounts {
  std::size_t vertices, faces;
};

Index off_corner(TextReader& in, std::string_view word, std::size_t vertices) {
  const std::int64_t v = in.integer(word);
  if (v < 0 || v >= static_cast<std::int64_t>(vertices))
    in.fail(fmt::format("index {} is out of range, the file has {} vertices; mend the face", v, vertices));
  return static_cast<Index>(v);
}

void check_degree(const TextReader& in, std::size_t degree) {
  if (degree < 3) in.fail(fmt::format("a face has {}; remove it", quantity(degree, "corner", "corners")));
}

// Each point and each face on a line of its own, whose further columns are ignored. As nearly all files are.
Soup read_off_lines(TextReader in) {
  Soup soup;
  if (!in.at_word() && !in.next_line()) in.fail_truncated("the header");
  const OffCounts n{in.count("vertices"), in.count("faces")};
  soup.vertices.reserve(std::min(n.vertices, in.remaining() / 6 + 1));  // "0 0 0\n"
  for (std::size_t i = 0; i < n.vertices; ++i) {
    if (!in.next_line()) in.fail_truncated(fmt::format("{} of {} vertices", i, n.vertices));
    soup.vertices.push_back(in.point());
  }
  for (std::size_t i = 0; i < n.faces; ++i) {
    if (!in.next_line()) in.fail_truncated(fmt::format("{} of {} faces", i, n.faces));
    const std::size_t degree = in.count("corners");
    check_degree(in, degree);
    for (std::size_t k = 0; k < degree; ++k) {
      const std::string_view word = in.word();
      if (word.empty()) in.fail(fmt::format("a face of {} corners ends after {}; {}", degree, k, kExportAgain));
      soup.faces.values.push_back(off_corner(in, word, n.vertices));
    }
    soup.end_face();
  }
  soup.ignored = count_lines_left(in);
  return soup;
}

// How a stream of numbers goes on after an item.
enum class OffRest {
  ignored,   // the rest of the line is colours and the like
  next_item  // the next number begins the next item, on whichever line it is
};

// A stream of numbers with line ends anywhere. Throws Error unless it ends with the last face.
Soup read_off_stream(TextReader in, const OffHeader& header, OffRest after_point, OffRest after_face) {
  const auto number_ahead = [&] {
    while (!in.at_word())
      if (!in.next_line()) in.fail_truncated("a part of the numbers");
  };
  const auto skip_rest = [&] {
    while (!in.word().empty()) {
    }
  };
  number_ahead();
  OffCounts n{};
  n.vertices = in.count("vertices");
  const std::size_t line = in.line();
  number_ahead();
  n.faces = in.count("faces");
  if (in.at_word() || in.line() != line) {  // the number of edges, which some files lack
    number_ahead();
    in.word();
  }
  Soup soup;
  soup.vertices.reserve(std::min(n.vertices, in.remaining() / 6 + 1));
  for (std::size_t i = 0; i < n.vertices; ++i) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) {
      number_ahead();
      p[k] = in.number();
      if (const char* flaw = coordinate_flaw(p[k])) in.fail(flaw);
    }
    soup.vertices.push_back(p);
    if (after_point == OffRest::ignored) {
      skip_rest();
      continue;
    }
    for (std::size_t k = 3; k < header.columns; ++k) {
      number_ahead();
      in.number();
    }
  }
  for (std::size_t i = 0; i < n.faces; ++i) {
    number_ahead();
    const std::size_t degree = in.count("corners");
    check_degree(in, degree);
    for (std::size_t k = 0; k < degree; ++k) {
      number_ahead();
      soup.faces.values.push_back(off_corner(in, in.word(), n.vertices));
    }
    if (after_face == OffRest::ignored) skip_rest();
    soup.end_face();
  }
  if (in.at_word() || in.next_line()) in.fail("there are more numbers than the header declares");
  return soup;
}

std::optional<Soup> try_off_stream(const TextReader& in, const OffHeader& header) {
  for (const OffRest after_point : {OffRest::ignored, OffRest::next_item})
    for (const OffRest after_face : {OffRest::ignored, OffRest::next_item}) try {
        return read_off_stream(in, header, after_point, after_face);
      } catch (const Error&) {
      }
  return {};
}

// "OFF BINARY": integers and floats of 32 bits, the high byte first.
class OffBinary {
 public:
  OffBinary(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes), whole_(bytes.size()) {}

  Soup read(const OffHeader& header) {
    Soup soup;
    const std::size_t vertices = count("vertices"), faces = count("faces");
    count("edges");
    need(vertices, 4 * header.columns, "vertices");
    soup.vertices.resize(vertices);
    for (Vec3& p : soup.vertices) {
      for (int k = 0; k < 3; ++k) {
        p[k] = value<float>();
        if (const char* flaw = coordinate_flaw(p[k])) fail(flaw);
      }
      bytes_.remove_prefix(4 * (header.columns - 3));
    }
    need(faces, 20, "faces");  // three corners and two counts
    for (std::size_t i = 0; i < faces; ++i) {
      const std::size_t degree = count("corners");
      if (degree < 3) fail(fmt::format("face {} has {}; remove it", i, quantity(degree, "corner", "corners")));
      need(degree, 4, "corners");
      for (std::size_t k = 0; k < degree; ++k) {
        const auto v = value<std::int32_t>();
        if (v < 0 || static_cast<std::size_t>(v) >= vertices)
          fail(fmt::format("index {} is out of range, the file has {} vertices; mend the face", v, vertices));
        soup.faces.values.push_back(static_cast<Index>(v));
      }
      soup.end_face();
      const std::size_t colours = count("colours");
      need(colours, 4, "colours");
      bytes_.remove_prefix(4 * colours);
    }
    if (!bytes_.empty()) soup.ignored = quantity(bytes_.size(), "byte", "bytes");
    return soup;
  }

 private:
  template <class T>
  T value() {
    need(1, sizeof(T), "numbers");
    const T x = load<T>(bytes_.data(), true);
    bytes_.remove_prefix(sizeof(T));
    return x;
  }
  std::size_t count(const char* things) {
    const auto n = value<std::int32_t>();
    if (n < 0) fail(fmt::format("the number of {} is negative; {}", things, kExportAgain));
    return static_cast<std::size_t>(n);
  }
  void need(std::size_t n, std::size_t bytes_each, const char* things) const {
    if (n > bytes_.size() / bytes_each)
      fail(
          fmt::format("{} {} are declared, more than the file can hold; it is truncated, {}", n, things, kExportAgain));
  }
  [[noreturn]] void fail(const std::string& what) const {
    io::fail(path_, fmt::format("byte {} after the header: {}", whole_ - bytes_.size(), what));
  }

  const std::string& path_;
  std::string_view bytes_;
  std::size_t whole_;
};

// The vertex of a corner "v", "v/vt", "v//vn" or "v/vt/vn", counted from 0.
Index read_obj_corner(TextReader& in, std::string_view corner, std::size_t vertices) {
  const std::int64_t v = in.integer(corner.substr(0, corner.find('/')));
  if (v == 0) in.fail("index 0 is out of range, OBJ counts from 1; mend the line");
  const std::int64_t index = v > 0 ? v - 1 : static_cast<std::int64_t>(vertices) + v;
  if (index < 0 || index >= kNone)
    in.fail(
        fmt::format("index {} is out of range after {}; mend the line", v, quantity(vertices, "vertex", "vertices")));
  return static_cast<Index>(index);
}

// The rest of a line, its words one blank apart.
std::string words_left(TextReader& in) {
  std::string words;
  for (std::string_view word = in.word(); !word.empty(); word = in.word()) {
    if (!words.empty()) words += ' ';
    words += word;
  }
  return words;
}

}  // namespace

// Numbers beside coordinates and corners are told from items by lines, so lines are tried first; what is no stream
// either is refused with what is wrong with its lines.
Soup read_off(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, '#');
  const OffHeader header = read_off_header(in);
  if (header.binary) return OffBinary(path, in.after_line()).read(header);
  try {
    return read_off_lines(in);
  } catch (const Error&) {
    if (std::optional<Soup> soup = try_off_stream(in, header)) return *std::move(soup);
    throw;
  }
}

Soup read_obj(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, '#', true);
  Soup soup;
  GroupLabels groups;
  std::vector<std::pair<Index, std::size_t>> forward;  // indices beyond all before them and not yet defined; their line
  const auto read_corner = [&](std::string_view corner, std::size_t line) {
    const Index v = read_obj_corner(in, corner, soup.vertices.size());
    if (v >= soup.vertices.size() && (forward.empty() || v > forward.back().first)) forward.emplace_back(v, line);
    return v;
  };
  while (in.next_line()) {
    const std::size_t line = in.line();
    const std::string_view keyword = in.word();
    if (keyword == "v") {
      if (soup.vertices.size() == kNone - 1) in.fail("too many vertices; split the model");
      soup.vertices.push_back(in.point());
    } else if (keyword == "f") {
      for (std::string_view corner = in.word(); !corner.empty(); corner = in.word())
        soup.faces.values.push_back(read_corner(corner, line));
      if (soup.open_corners() < 3)
        in.fail_at(line, fmt::format("a face has {}; remove it", quantity(soup.open_corners(), "corner", "corners")));
      soup.end_face();
      groups.add_face();
    } else if (keyword == "l") {
      Index last = kNone;
      std::size_t count = 0;
      for (std::string_view corner = in.word(); !corner.empty(); corner = in.word(), ++count) {
        const Index v = read_corner(corner, line);
        if (count > 0) soup.edges.push_back({last, v});
        last = v;
      }
      if (count < 2) in.fail_at(line, fmt::format("a line has {}; remove it", quantity(count, "vertex", "vertices")));
    } else if (keyword == "g") {
      groups.set_part(words_left(in));
    } else if (keyword == "usemtl") {
      groups.set_material(words_left(in));
    }
  }
  for (const auto& [v, line] : forward)
    if (v >= soup.vertices.size())
      in.fail_at(line, fmt::format("index {} is out of range, the file has {}; mend the line", std::size_t{v} + 1,
                                   quantity(soup.vertices.size(), "vertex", "vertices")));
  groups.take(soup);
  return soup;
}

namespace {

// The corners of each face, whichever kind of mesh it is.
std::size_t face_count(const TriangleMesh& mesh) { return mesh.triangles.size(); }
std::size_t face_count(const PolygonMesh& mesh) { return mesh.polygons.rows(); }
std::span<const Index> face(const TriangleMesh& mesh, std::size_t i) { return mesh.triangles[i]; }
std::span<const Index> face(const PolygonMesh& mesh, std::size_t i) {
  return {mesh.polygons.begin(i), mesh.polygons.size(i)};
}

template <class Mesh>
std::string off_of(const Mesh& mesh) {
  std::string out = fmt::format("OFF\n{} {} 0\n", mesh.vertices.size(), face_count(mesh));
  for (const Vec3& p : mesh.vertices) append_point(out, p);
  for (std::size_t i = 0; i < face_count(mesh); ++i) {
    append_index(out, face(mesh, i).size());
    for (const Index v : face(mesh, i)) {
      out += ' ';
      append_index(out, v);
    }
    out += '\n';
  }
  return out;
}

const LabelNames& names_in(const TriangleMesh& mesh) { return mesh.label_names; }
LabelNames names_in(const PolygonMesh&) { return {}; }

template <class Mesh>
std::string obj_of(const Mesh& mesh, const WriteOptions& options) {
  const LabelNames names = names_of_labels({mesh.labels.begin(), mesh.labels.end()}, names_in(mesh), options, "#\\");
  std::string out;
  for (const Vec3& p : mesh.vertices) {
    out += "v ";
    append_point(out, p);
  }
  for (std::size_t i = 0; i < face_count(mesh); ++i) {
    if (!mesh.labels.empty() && (i == 0 || mesh.labels[i] != mesh.labels[i - 1]))
      out += "g " + names.at(static_cast<std::int32_t>(mesh.labels[i])) + '\n';
    out += 'f';
    for (const Index v : face(mesh, i)) {
      out += ' ';
      append_index(out, std::size_t{v} + 1);
    }
    out += '\n';
  }
  if (!options.lines) return out;
  for (const std::array<Index, 2>& e : mesh.feature_edges)
    out += fmt::format("l {} {}\n", std::size_t{e[0]} + 1, std::size_t{e[1]} + 1);
  return out;
}

}  // namespace

std::string format_off(const std::string&, const TriangleMesh& mesh, const WriteOptions&) { return off_of(mesh); }
std::string format_off(const PolygonMesh& mesh, const WriteOptions&) { return off_of(mesh); }
std::string format_obj(const std::string&, const TriangleMesh& mesh, const WriteOptions& options) {
  return obj_of(mesh, options);
}
std::string format_obj(const PolygonMesh& mesh, const WriteOptions& options) { return obj_of(mesh, options); }

}  // namespace bisector::io
