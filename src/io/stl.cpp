// STL, binary and ASCII (3D Systems, Stereolithography interface specification, 1989).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/single.h"
#include "io/bytes.h"
#include "io/labels.h"
#include "io/mesh_formats.h"
#include "io/text.h"

namespace bisector::io {

namespace {

// Numbers points by first appearance; equal ones (0.0 equals -0.0) get one number.
class PointMerger {
 public:
  explicit PointMerger(std::vector<Vec3>& points) : points_(points), slots_(64, kNone) {}

  Index add(const Vec3& p) {
    if (2 * points_.size() >= slots_.size()) grow();
    Index& slot = find(p);
    if (slot == kNone) {
      slot = static_cast<Index>(points_.size());
      points_.push_back(p);
    }
    return slot;
  }

 private:
  static std::size_t hash(const Vec3& p) {
    std::uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
      h = (h ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) * 0x9e3779b97f4a7c15u;  // -0.0 + 0.0 is 0.0
      h ^= h >> 32;
    }
    return h;
  }
  Index& find(const Vec3& p) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = hash(p) & mask;
    while (slots_[i] != kNone && !(points_[slots_[i]] == p)) i = (i + 1) & mask;
    return slots_[i];
  }
  void grow() {
    slots_.assign(2 * slots_.size(), kNone);
    for (std::size_t i = 0; i < points_.size(); ++i) find(points_[i]) = static_cast<Index>(i);
  }

  std::vector<Vec3>& points_;
  std::vector<Index> slots_;
};

constexpr std::size_t kStlHeader = 84, kStlFacet = 50;

Soup read_stl_binary(const std::string& path, std::string_view bytes) {
  if (bytes.size() < kStlHeader)
    fail(path, fmt::format("byte {}: the file ends in the header; it is truncated, {}", bytes.size(), kExportAgain));
  const std::size_t faces = load<std::uint32_t>(bytes.data() + 80, false);
  bytes.remove_prefix(kStlHeader);
  if (faces > bytes.size() / kStlFacet)
    fail(path, fmt::format("face {}: the file ends here, of {} declared; it is truncated, {}", bytes.size() / kStlFacet,
                           faces, kExportAgain));
  Soup soup;
  PointMerger merger(soup.vertices);
  soup.faces.values.reserve(3 * faces);
  soup.faces.offsets.reserve(faces + 1);
  for (std::size_t i = 0; i < faces; ++i) {
    const char* corners = bytes.data() + i * kStlFacet + 12;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 p;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double x = load<float>(corners + 12 * k + 4 * axis, false);
        if (const char* flaw = coordinate_flaw(x)) fail(path, fmt::format("face {}: {}", i, flaw));
        p[static_cast<int>(axis)] = x;
      }
      soup.faces.values.push_back(merger.add(p));
    }
    soup.end_face();
  }
  const std::size_t left = bytes.size() - faces * kStlFacet;
  if (left > 0) soup.ignored = quantity(left, "byte", "bytes");
  return soup;
}

bool is_keyword(std::string_view word, std::string_view keyword) {
  return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(),
                    [](char a, char b) { return a == b || (b >= 'a' && b <= 'z' && a == b - 'a' + 'A'); });
}

Soup read_stl_text(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, 0);
  Soup soup;
  PointMerger merger(soup.vertices);
  GroupLabels solids;
  bool in_solid = false, in_facet = false;
  std::size_t stray = 0;
  while (in.next_line()) {
    const std::string_view word = in.word();
    if (!in_solid) {
      if (is_keyword(word, "solid")) {
        in_solid = true;
        solids.set_part(std::string(in.rest_of_line()));
      } else {
        ++stray;
      }
    } else if (is_keyword(word, "facet")) {
      if (in_facet) in.fail(std::string("a facet begins inside another; ") + kExportAgain);
      in_facet = true;
    } else if (is_keyword(word, "vertex")) {
      if (!in_facet) in.fail(std::string("a vertex outside any facet; ") + kExportAgain);
      soup.faces.values.push_back(merger.add(in.point()));
    } else if (is_keyword(word, "endfacet")) {
      if (!in_facet) in.fail(std::string("endfacet without a facet; ") + kExportAgain);
      if (soup.open_corners() < 3)
        in.fail(fmt::format("a facet has {}; remove it", quantity(soup.open_corners(), "corner", "corners")));
      soup.end_face();
      solids.add_face();
      in_facet = false;
    } else if (is_keyword(word, "endsolid")) {
      if (in_facet) in.fail(std::string("the solid ends inside a facet; ") + kExportAgain);
      in_solid = false;
    } else if (!is_keyword(word, "outer") && !is_keyword(word, "endloop")) {
      in.fail("'" + printable(word) + "' is not an STL keyword; " + kExportAgain);
    }
  }
  const std::size_t faces = soup.faces.rows();
  if (in_solid) in.fail_truncated(quantity(faces, "face", "faces") + " without endsolid");
  if (stray > 0) soup.ignored = quantity(stray, "line", "lines");
  solids.take(soup);
  return soup;
}

// Binary files may begin with "solid" too: they have the size that their count asks for, or no facet after that line.
bool is_stl_text(const std::string& path, std::string_view bytes) {
  if (bytes.size() >= kStlHeader &&
      bytes.size() == kStlHeader + kStlFacet * std::size_t{load<std::uint32_t>(bytes.data() + 80, false)})
    return false;
  TextReader in(path, bytes, 0);
  if (!in.next_line() || !is_keyword(in.word(), "solid")) return false;
  if (!in.next_line()) return bytes.size() < kStlHeader;
  const std::string_view word = in.word();
  return is_keyword(word, "facet") || is_keyword(word, "endsolid");
}

}  // namespace

Soup read_stl(const std::string& path, std::string_view bytes) {
  return is_stl_text(path, bytes) ? read_stl_text(path, bytes) : read_stl_binary(path, bytes);
}

namespace {

// The corners of a triangle as the file has them, and the normal of these.
struct StlFacet {
  std::array<Vec3, 3> corners;
  Vec3 normal;
};

StlFacet facet_of(const std::string& path, const TriangleMesh& mesh, const Triangle& t) {
  StlFacet facet;
  for (std::size_t i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const double x = mesh.vertices[t[i]][k];
      if (std::abs(x) > std::numeric_limits<float>::max())
        fail(path, fmt::format("vertex {}: a coordinate is beyond STL's range; write OFF, OBJ or PLY", t[i]));
      facet.corners[i][k] = to_single(x);
    }
  const Vec3 normal = twice_area_normal(facet.corners[0], facet.corners[1], facet.corners[2]);
  const double length = norm(normal);
  if (std::isnormal(length)) facet.normal = (1 / length) * normal;
  return facet;
}

std::string format_stl_binary(const std::string& path, const TriangleMesh& mesh) {
  std::string out = "binary STL by bisector";
  out.resize(80, ' ');
  out.reserve(kStlHeader + kStlFacet * mesh.triangles.size());
  append_bytes(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  const auto append_floats = [&](const Vec3& p) {
    for (int k = 0; k < 3; ++k) append_bytes(out, static_cast<float>(p[k]));
  };
  for (const Triangle& t : mesh.triangles) {
    const StlFacet facet = facet_of(path, mesh, t);
    append_floats(facet.normal);
    for (const Vec3& p : facet.corners) append_floats(p);
    append_bytes(out, std::uint16_t{0});
  }
  return out;
}

// A solid for each label, ascending. Numbers are those of the binary form.
std::string format_stl_solids(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options) {
  const auto append_floats = [](std::string& out, const Vec3& p) {
    for (int k = 0; k < 3; ++k) {
      std::array<char, 32> digits;
      out += ' ';
      out.append(digits.data(),
                 std::to_chars(digits.data(), digits.data() + digits.size(), static_cast<float>(p[k])).ptr);
    }
    out += '\n';
  };
  const LabelNames names = names_of_labels(mesh.labels, mesh.label_names, options);
  LabelNames facets;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const StlFacet facet = facet_of(path, mesh, mesh.triangles[i]);
    std::string& out = facets[mesh.labels[i]];
    out += "facet normal";
    append_floats(out, facet.normal);
    out += "outer loop\n";
    for (const Vec3& p : facet.corners) {
      out += "vertex";
      append_floats(out, p);
    }
    out += "endloop\nendfacet\n";
  }
  std::string out;
  for (const auto& [label, text] : facets) {
    const std::string& name = names.at(label);
    out += "solid " + name + '\n' + text + "endsolid " + name + '\n';
  }
  return out;
}

}  // namespace

std::string format_stl(const std::string& path, const TriangleMesh& mesh, const WriteOptions& options) {
  if (mesh.labels.empty() || mesh.label_names.empty()) return format_stl_binary(path, mesh);
  return format_stl_solids(path, mesh, options);
}

}  // namespace bisector::io
