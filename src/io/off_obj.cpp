// OFF (Geomview's object file format, geomview.org/docs/html/OFF.html) and Wavefront's OBJ.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "io/attributes.h"
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

// The place of index `text` among `count` that came before, counted from 0; negative ones count from the end.
Index read_obj_index(TextReader& in, std::string_view text, std::size_t count, const char* one, const char* many) {
  const std::int64_t v = in.integer(text);
  if (v == 0) in.fail("index 0 is out of range, OBJ counts from 1; mend the line");
  const std::int64_t index = v > 0 ? v - 1 : static_cast<std::int64_t>(count) + v;
  if (index < 0 || index >= kNone)
    in.fail(fmt::format("index {} is out of range after {}; mend the line", v, quantity(count, one, many)));
  return static_cast<Index>(index);
}

// An index beyond all that came before it, to be looked at again at the end.
class ForwardIndices {
 public:
  void note(Index index, std::size_t count, std::size_t line) {
    if (index >= count && (noted_.empty() || index > noted_.back().first)) noted_.emplace_back(index, line);
  }
  void check(const TextReader& in, std::size_t count, const char* one, const char* many) const {
    for (const auto& [index, line] : noted_)
      if (index >= count)
        in.fail_at(line, fmt::format("index {} is out of range, the file has {}; mend the line", std::size_t{index} + 1,
                                     quantity(count, one, many)));
  }

 private:
  std::vector<std::pair<Index, std::size_t>> noted_;
};

// The numbers that a line goes on with, as far as they are numbers.
std::vector<double> numbers_left(TextReader& in) {
  std::vector<double> numbers;
  for (std::string_view word = in.word(); !word.empty(); word = in.word()) {
    double x = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), x);
    if (error != std::errc{} || stop != word.data() + word.size()) break;
    numbers.push_back(x);
  }
  return numbers;
}

// Texture coordinates and the colours that many programs put behind coordinates.
class ObjAttributes {
 public:
  void add_vertex(TextReader& in) {
    const std::vector<double> numbers = numbers_left(in);
    all_coloured_ = all_coloured_ && (numbers.size() == 3 || numbers.size() == 4);
    if (all_coloured_) colours_.insert(colours_.end(), numbers.begin(), numbers.begin() + 3);
  }
  void add_texture(TextReader& in) {
    const double u = in.number();
    const std::vector<double> numbers = numbers_left(in);
    texture_.push_back({u, numbers.empty() ? 0 : numbers[0]});
  }
  // "v", "v/vt", "v//vn" or "v/vt/vn"
  void add_corner(TextReader& in, std::string_view corner, std::size_t line) {
    const std::size_t first = corner.find('/');
    const std::string_view rest = first == std::string_view::npos ? std::string_view{} : corner.substr(first + 1);
    const std::string_view text = rest.substr(0, rest.find('/'));
    // Some programs write indices of coordinates that they leave out.
    const bool none = text.empty() || (text[0] == '-' && texture_.empty());
    corners_.push_back(none ? kNone : read_obj_index(in, text, texture_.size(), kOne, kMany));
    if (!none) forward_.note(corners_.back(), texture_.size(), line);
  }
  void take(const TextReader& in, Soup& soup) {
    if (all_coloured_ && !colours_.empty()) {
      // Some programs write bytes.
      const bool bytes = std::any_of(colours_.begin(), colours_.end(), [](double x) { return x > 1; });
      soup.attributes.push_back({"color", Attribute::Site::vertex,
                                 bytes ? Attribute::Type::uint8 : Attribute::Type::float64, 3, std::move(colours_)});
    }
    if (texture_.empty() || std::all_of(corners_.begin(), corners_.end(), [](Index i) { return i == kNone; })) return;
    forward_.check(in, texture_.size(), kOne, kMany);
    if (!take_by_vertices(soup)) take_by_corners(soup);
  }

 private:
  static constexpr const char *kOne = "texture coordinate", *kMany = "texture coordinates";

  // Where all corners of each vertex have the same ones, these are the vertices'.
  bool take_by_vertices(Soup& soup) const {
    std::vector<Index> of_vertex(soup.vertices.size(), kNone);
    for (std::size_t c = 0; c < corners_.size(); ++c) {
      Index& known = of_vertex[soup.faces.values[c]];
      if (corners_[c] == kNone || (known != kNone && known != corners_[c])) return false;
      known = corners_[c];
    }
    soup.attributes.push_back(texture_at(Attribute::Site::vertex, of_vertex));
    return true;
  }
  void take_by_corners(Soup& soup) const { soup.attributes.push_back(texture_at(Attribute::Site::corner, corners_)); }
  Attribute texture_at(Attribute::Site site, const std::vector<Index>& indices) const {
    Attribute attribute{"texcoord", site, Attribute::Type::float64, 2, {}};
    attribute.values.reserve(2 * indices.size());
    for (const Index i : indices) {
      attribute.values.push_back(i == kNone ? 0 : texture_[i][0]);
      attribute.values.push_back(i == kNone ? 0 : texture_[i][1]);
    }
    return attribute;
  }

  bool all_coloured_ = true;
  std::vector<double> colours_;  // of the vertices so far, if all have them
  std::vector<std::array<double, 2>> texture_;
  std::vector<Index> corners_;  // of faces: an index of texture_, or kNone
  ForwardIndices forward_;
};

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
  ObjAttributes attributes;
  ForwardIndices forward;
  const auto read_corner = [&](std::string_view corner, std::size_t line) {
    const std::string_view text = corner.substr(0, corner.find('/'));
    const Index v = read_obj_index(in, text, soup.vertices.size(), "vertex", "vertices");
    forward.note(v, soup.vertices.size(), line);
    return v;
  };
  while (in.next_line()) {
    const std::size_t line = in.line();
    const std::string_view keyword = in.word();
    if (keyword == "v") {
      if (soup.vertices.size() == kNone - 1) in.fail("too many vertices; split the model");
      soup.vertices.push_back(in.point());
      attributes.add_vertex(in);
    } else if (keyword == "vt") {
      attributes.add_texture(in);
    } else if (keyword == "f") {
      for (std::string_view corner = in.word(); !corner.empty(); corner = in.word()) {
        soup.faces.values.push_back(read_corner(corner, line));
        attributes.add_corner(in, corner, line);
      }
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
    } else if (keyword == "mtllib" && in.at_word()) {
      soup.material_files.emplace_back(in.rest_of_line());
    }
  }
  forward.check(in, soup.vertices.size(), "vertex", "vertices");
  attributes.take(in, soup);
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

// What an OBJ file has beside points, faces and groups.
class ObjExtras {
 public:
  LabelNames names;  // of the labels

  explicit ObjExtras(const PolygonMesh&) {}
  explicit ObjExtras(const TriangleMesh& mesh) : names(mesh.label_names), mesh_(&mesh) {
    for (const std::string& file : mesh.material_files) has_library_ = has_library_ || is_material_library(file);
    const auto find = [&](Attribute::Site site, AttributeMeaning meaning) {
      return find_attribute(mesh.attributes, site, meaning);
    };
    if (const Attribute* found = find(Attribute::Site::vertex, AttributeMeaning::colour)) {
      colours_ = found;
      scale_ = found->type == Attribute::Type::uint8 ? 1.0 / 255 : 1;
    }
    texture_ = find(Attribute::Site::corner, AttributeMeaning::texture);
    if (texture_) table_ = tell_corners_apart(mesh, *texture_);
    else texture_ = find(Attribute::Site::vertex, AttributeMeaning::texture);
  }

  std::string libraries() const {
    std::string lines;
    if (has_library_)
      for (const std::string& file : mesh_->material_files)
        if (is_material_library(file)) lines += "mtllib " + cleaned(file) + '\n';
    return lines;
  }
  // Behind a vertex's coordinates.
  void append_colour(std::string& out, std::size_t v) const {
    if (!colours_) return;
    const bool exact = colours_->type == Attribute::Type::float64;
    const Attribute::Type type = exact ? Attribute::Type::float64 : Attribute::Type::float32;
    for (std::size_t c = 0; c < 3; ++c) {
      out += ' ';
      append_value(out, scale_ * colours_->values[colours_->components * v + c], type);
    }
  }
  std::string texture_lines() const {
    std::string lines;
    if (!texture_) return lines;
    const bool corners = texture_->site == Attribute::Site::corner;
    const std::size_t count = corners ? table_.corner.size() : mesh_->vertices.size();
    for (std::size_t i = 0; i < count; ++i) {
      const double* uv = texture_->values.data() + 2 * (corners ? table_.corner[i] : i);
      lines += "vt ";
      append_value(lines, uv[0], texture_->type);
      lines += ' ';
      append_value(lines, uv[1], texture_->type);
      lines += '\n';
    }
    return lines;
  }
  // Behind the vertex of corner k of face i.
  void append_texture(std::string& out, std::size_t i, std::size_t k, Index v) const {
    if (!texture_) return;
    out += '/';
    append_index(out, std::size_t{texture_->site == Attribute::Site::corner ? table_.index[3 * i + k] : v} + 1);
  }
  void append_material(std::string& out, std::int32_t label) const {
    if (!has_library_) return;
    if (const auto found = mesh_->label_materials.find(label); found != mesh_->label_materials.end())
      out += "usemtl " + cleaned(found->second, "#\\") + '\n';
  }

 private:
  const TriangleMesh* mesh_ = nullptr;
  bool has_library_ = false;
  const Attribute *colours_ = nullptr, *texture_ = nullptr;
  double scale_ = 1;  // from colours to 0 .. 1
  CornerTable table_;
};

template <class Mesh>
std::string obj_of(const Mesh& mesh, const WriteOptions& options) {
  const ObjExtras extras(mesh);
  const LabelNames names = names_of_labels({mesh.labels.begin(), mesh.labels.end()}, extras.names, options, "#\\");
  std::string out = extras.libraries();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    out += "v ";
    append_coordinates(out, mesh.vertices[v]);
    extras.append_colour(out, v);
    out += '\n';
  }
  out += extras.texture_lines();
  if (mesh.labels.empty()) extras.append_material(out, 0);
  for (std::size_t i = 0; i < face_count(mesh); ++i) {
    if (!mesh.labels.empty() && (i == 0 || mesh.labels[i] != mesh.labels[i - 1])) {
      const auto label = static_cast<std::int32_t>(mesh.labels[i]);
      out += "g " + names.at(label) + '\n';
      extras.append_material(out, label);
    }
    out += 'f';
    for (std::size_t k = 0; k < face(mesh, i).size(); ++k) {
      out += ' ';
      append_index(out, std::size_t{face(mesh, i)[k]} + 1);
      extras.append_texture(out, i, k, face(mesh, i)[k]);
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
