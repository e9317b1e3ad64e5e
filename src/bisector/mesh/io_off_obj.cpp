#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/mesh/io_formats.h"
#include "bisector/mesh/io_text.h"

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
  if (v == 0) in.fail("index 0 is out of range, OBJ counts from 1; mend the face");
  const std::int64_t index = v > 0 ? v - 1 : static_cast<std::int64_t>(vertices) + v;
  if (index < 0 || index >= kNone)
    in.fail(fmt::format("index {} is out of range after {}; mend the face", v,
                        quantity(vertices, "vertex", "vertices")));
  return static_cast<Index>(index);
}

void append_number(std::string& out, double x) {
  std::array<char, 32> digits;
  out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), x).ptr);
}

void append_index(std::string& out, std::size_t i) {
  std::array<char, 24> digits;
  out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), i).ptr);
}

void append_point(std::string& out, const Vec3& p) {
  append_number(out, p.x);
  out += ' ';
  append_number(out, p.y);
  out += ' ';
  append_number(out, p.z);
  out += '\n';
}

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
  std::vector<std::pair<Index, std::size_t>> forward;  // indices beyond all before them and not yet defined; their line
  while (in.next_line()) {
    const std::size_t line = in.line();
    const std::string_view keyword = in.word();
    if (keyword == "v") {
      if (soup.vertices.size() == kNone - 1) in.fail("too many vertices; split the model");
      soup.vertices.push_back(in.point());
    } else if (keyword == "f") {
      for (std::string_view corner = in.word(); !corner.empty(); corner = in.word()) {
        const Index v = read_obj_corner(in, corner, soup.vertices.size());
        if (v >= soup.vertices.size() && (forward.empty() || v > forward.back().first)) forward.emplace_back(v, line);
        soup.faces.values.push_back(v);
      }
      if (soup.open_corners() < 3)
        in.fail_at(line, fmt::format("a face has {}; remove it", quantity(soup.open_corners(), "corner", "corners")));
      soup.end_face();
    }
  }
  for (const auto& [v, line] : forward)
    if (v >= soup.vertices.size())
      in.fail_at(line, fmt::format("index {} is out of range, the file has {}; mend the face", std::size_t{v} + 1,
                                   quantity(soup.vertices.size(), "vertex", "vertices")));
  return soup;
}

std::string format_off(const TriangleMesh& mesh) {
  std::string out = fmt::format("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.vertices) append_point(out, p);
  for (const Triangle& t : mesh.triangles) {
    out += '3';
    for (const Index v : t) {
      out += ' ';
      append_index(out, v);
    }
    out += '\n';
  }
  return out;
}

std::string format_obj(const TriangleMesh& mesh) {
  std::string out;
  for (const Vec3& p : mesh.vertices) {
    out += "v ";
    append_point(out, p);
  }
  for (const Triangle& t : mesh.triangles) {
    out += 'f';
    for (const Index v : t) {
      out += ' ';
      append_index(out, std::size_t{v} + 1);
    }
    out += '\n';
  }
  return out;
}

}  // namespace bisector::io
