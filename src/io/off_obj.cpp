#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "io/mesh_formats.h"
#include "io/text.h"

namespace bisector::io {

namespace {

// The header may say which columns follow the coordinates; all are ignored, so only other dimensions matter.
void check_off_header(TextReader& in, std::string_view header) {
  if (!header.ends_with("OFF") && header != "off")
    in.fail("does not begin with OFF but with '" + printable(header) + "'; check that this is an OFF file");
  const std::string_view prefix = header.substr(0, header.size() - 3);
  if (prefix.find_first_of("4n") != std::string_view::npos)
    in.fail("'" + printable(header) + "' has points of other than three coordinates; export as OFF");
}

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

// The label that a group's name tells, if format_obj may have written it.
bool parse_label(std::string_view name, std::int32_t& label) {
  for (const std::string_view prefix : {"label_", "region_", "branch_"}) {
    if (!name.starts_with(prefix)) continue;
    const char *begin = name.data() + prefix.size(), *end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(begin, end, label);
    return error == std::errc{} && (stop == end || *stop == '_');
  }
  return false;
}

// The labels of an OBJ file's faces: one for each pair of group and material.
class ObjGroups {
 public:
  void set_group(TextReader& in) { set(group_, in); }
  void set_material(TextReader& in) { set(material_, in); }
  void add_face() {
    if (current_ == numbers_.end())
      current_ = numbers_.try_emplace({group_, material_}, static_cast<std::int32_t>(numbers_.size())).first;
    labels_.push_back(current_->second);
  }
  // Empty where they tell nothing.
  std::vector<std::int32_t> take() {
    std::vector<std::int32_t> named(numbers_.size());
    const bool all_named = std::all_of(numbers_.begin(), numbers_.end(), [&](const auto& entry) {
      return entry.first.second.empty() && parse_label(entry.first.first, named[static_cast<Index>(entry.second)]);
    });
    if (all_named && all_different(named)) {
      for (std::int32_t& label : labels_) label = named[static_cast<Index>(label)];
      return std::move(labels_);
    }
    return numbers_.size() > 1 ? std::move(labels_) : std::vector<std::int32_t>{};
  }

 private:
  static bool all_different(std::vector<std::int32_t> labels) {
    std::sort(labels.begin(), labels.end());
    return std::adjacent_find(labels.begin(), labels.end()) == labels.end();
  }
  void set(std::string& name, TextReader& in) {
    name.clear();
    for (std::string_view word = in.word(); !word.empty(); word = in.word()) {
      if (!name.empty()) name += ' ';
      name += word;
    }
    current_ = numbers_.end();
  }

  std::string group_, material_;
  std::map<std::pair<std::string, std::string>, std::int32_t> numbers_;
  std::map<std::pair<std::string, std::string>, std::int32_t>::const_iterator current_ = numbers_.end();
  std::vector<std::int32_t> labels_;
};

}  // namespace

Soup read_off(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, '#');
  Soup soup;
  if (!in.next_line()) in.fail_truncated("comments");
  check_off_header(in, in.word());
  if (!in.at_word() && !in.next_line()) in.fail_truncated("the header");
  if (TextReader(in).word() == "BINARY") in.fail("binary OFF is not supported; export as text or PLY");
  const std::size_t vertices = in.count("vertices"), faces = in.count("faces");

  soup.vertices.reserve(std::min(vertices, in.remaining() / 6 + 1));  // "0 0 0\n"
  for (std::size_t i = 0; i < vertices; ++i) {
    if (!in.next_line()) in.fail_truncated(fmt::format("{} of {} vertices", i, vertices));
    soup.vertices.push_back(in.point());
  }
  for (std::size_t i = 0; i < faces; ++i) {
    if (!in.next_line()) in.fail_truncated(fmt::format("{} of {} faces", i, faces));
    const std::size_t degree = in.count("corners");
    if (degree < 3) in.fail(fmt::format("a face has {}; remove it", quantity(degree, "corner", "corners")));
    for (std::size_t k = 0; k < degree; ++k) {
      const std::string_view word = in.word();
      if (word.empty()) in.fail(fmt::format("a face of {} corners ends after {}; {}", degree, k, kExportAgain));
      const std::int64_t v = in.integer(word);
      if (v < 0 || v >= static_cast<std::int64_t>(vertices))
        in.fail(fmt::format("index {} is out of range, the file has {} vertices; mend the face", v, vertices));
      soup.faces.values.push_back(static_cast<Index>(v));
    }
    soup.end_face();
  }
  soup.ignored = count_lines_left(in);
  return soup;
}

Soup read_obj(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, '#', true);
  Soup soup;
  ObjGroups groups;
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
      groups.set_group(in);
    } else if (keyword == "usemtl") {
      groups.set_material(in);
    }
  }
  for (const auto& [v, line] : forward)
    if (v >= soup.vertices.size())
      in.fail_at(line, fmt::format("index {} is out of range, the file has {}; mend the line", std::size_t{v} + 1,
                                   quantity(soup.vertices.size(), "vertex", "vertices")));
  soup.labels = groups.take();
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

template <class Mesh>
std::string obj_of(const Mesh& mesh, const GroupNames& groups) {
  std::string out;
  for (const Vec3& p : mesh.vertices) {
    out += "v ";
    append_point(out, p);
  }
  for (std::size_t i = 0; i < face_count(mesh); ++i) {
    if (!mesh.labels.empty() && (i == 0 || mesh.labels[i] != mesh.labels[i - 1])) {
      out += fmt::format("g {}_{}", groups.prefix, mesh.labels[i]);
      if (!groups.names.empty()) out += '_' + groups.names[static_cast<std::size_t>(mesh.labels[i])];
      out += '\n';
    }
    out += 'f';
    for (const Index v : face(mesh, i)) {
      out += ' ';
      append_index(out, std::size_t{v} + 1);
    }
    out += '\n';
  }
  for (const std::array<Index, 2>& e : mesh.feature_edges)
    out += fmt::format("l {} {}\n", std::size_t{e[0]} + 1, std::size_t{e[1]} + 1);
  return out;
}

}  // namespace

std::string format_off(const TriangleMesh& mesh) { return off_of(mesh); }
std::string format_off(const PolygonMesh& mesh) { return off_of(mesh); }
std::string format_obj(const TriangleMesh& mesh, const GroupNames& groups) { return obj_of(mesh, groups); }
std::string format_obj(const PolygonMesh& mesh, const GroupNames& groups) { return obj_of(mesh, groups); }

}  // namespace bisector::io
