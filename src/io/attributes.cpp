#include "io/attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "io/bytes.h"
#include "io/text.h"
#include "mesh/attribute_sizes.h"

namespace bisector::io {

namespace {

using Site = Attribute::Site;
using Type = Attribute::Type;

struct Group {
  const char* name;
  std::vector<std::string> properties;
};

const std::vector<Group>& known_groups() {
  static const std::vector<Group> groups{{"color", {"red", "green", "blue", "alpha"}},
                                         {"color", {"red", "green", "blue"}},
                                         {"normal", {"nx", "ny", "nz"}},
                                         {"texcoord", {"u", "v"}},
                                         {"texcoord", {"s", "t"}},
                                         {"texcoord", {"texture_u", "texture_v"}}};
  return groups;
}

template <class Integer>
Integer clamped(double value) {
  using Limits = std::numeric_limits<Integer>;
  if (!(value > static_cast<double>(Limits::min()))) return std::isnan(value) ? Integer{0} : Limits::min();
  return value >= static_cast<double>(Limits::max()) ? Limits::max() : static_cast<Integer>(value);
}

// Calls visit with a value of the type.
template <class Visit>
void with_type(double value, Type type, const Visit& visit) {
  switch (type) {
    case Type::int8: return visit(clamped<std::int8_t>(value));
    case Type::uint8: return visit(clamped<std::uint8_t>(value));
    case Type::int16: return visit(clamped<std::int16_t>(value));
    case Type::uint16: return visit(clamped<std::uint16_t>(value));
    case Type::int32: return visit(clamped<std::int32_t>(value));
    case Type::uint32: return visit(clamped<std::uint32_t>(value));
    case Type::int64: return visit(clamped<std::int64_t>(value));
    case Type::uint64: return visit(clamped<std::uint64_t>(value));
    case Type::float32: return visit(static_cast<float>(value));
    case Type::float64: return visit(value);
  }
}

// Where in a face's corners a vertex is, for the corners of the face's triangles.
class CornerFinder {
 public:
  explicit CornerFinder(const Csr<Index>& faces) : faces_(faces) {}

  std::size_t find(std::size_t face, Index vertex) {
    const Index *begin = faces_.begin(face), *end = faces_.end(face);
    if (end - begin <= 8) return faces_.offsets[face] + static_cast<std::size_t>(std::find(begin, end, vertex) - begin);
    if (face != sorted_face_) {
      sorted_face_ = face;
      sorted_.clear();
      for (const Index* v = begin; v != end; ++v) sorted_.emplace_back(*v, static_cast<std::size_t>(v - begin));
      std::sort(sorted_.begin(), sorted_.end());
    }
    return faces_.offsets[face] +
           std::lower_bound(sorted_.begin(), sorted_.end(), std::pair(vertex, std::size_t{0}))->second;
  }

 private:
  const Csr<Index>& faces_;
  std::size_t sorted_face_ = static_cast<std::size_t>(-1);
  std::vector<std::pair<Index, std::size_t>> sorted_;
};

}  // namespace

void AttributeColumns::add(const std::string& name, Type type) {
  const bool again = std::any_of(columns_.begin(), columns_.end(), [&](const Column& c) { return c.name == name; });
  if (again) return skip();
  columns_.push_back({name, type});
}

bool AttributeColumns::is_run(std::size_t at, const std::vector<std::string>& names) const {
  if (names.size() > columns_.size() - at) return false;
  for (std::size_t k = 0; k < names.size(); ++k)
    if (columns_[at + k].name != names[k] || columns_[at + k].type != columns_[at].type) return false;
  return true;
}

void AttributeColumns::put_together(std::size_t at, std::size_t count, const std::string& name) {
  for (std::size_t k = 0; k < count; ++k) {
    columns_[at + k].attribute = attributes_.size();
    columns_[at + k].component = k;
  }
  attributes_.push_back({name, site_, columns_[at].type, count});
}

void AttributeColumns::group() {
  for (std::size_t at = 0; at < columns_.size();) {
    const std::string& name = columns_[at].name;
    if (name.empty()) {
      ++at;
      continue;
    }
    std::size_t count = 1;
    std::string together = name;
    const auto known = std::find_if(known_groups().begin(), known_groups().end(),
                                    [&](const Group& group) { return is_run(at, group.properties); });
    if (known != known_groups().end()) {
      count = known->properties.size();
      together = known->name;
    } else if (name.size() > 2 && name.ends_with("_0")) {
      const std::string stem = name.substr(0, name.size() - 2);
      while (at + count < columns_.size() && columns_[at + count].name == fmt::format("{}_{}", stem, count) &&
             columns_[at + count].type == columns_[at].type)
        ++count;
      if (count > 1) together = stem;
    }
    put_together(at, count, together);
    at += count;
  }
}

std::vector<std::string> component_names(const Attribute& attribute) {
  const AttributeMeaning meaning = meaning_of(attribute);
  if (meaning == AttributeMeaning::colour)
    return attribute.components == 3 ? std::vector<std::string>{"red", "green", "blue"}
                                     : std::vector<std::string>{"red", "green", "blue", "alpha"};
  if (meaning == AttributeMeaning::normal) return {"nx", "ny", "nz"};
  if (meaning == AttributeMeaning::texture) return {"u", "v"};
  if (attribute.components == 1) return {attribute.name};
  std::vector<std::string> names;
  for (std::size_t c = 0; c < attribute.components; ++c) names.push_back(fmt::format("{}_{}", attribute.name, c));
  return names;
}

std::vector<std::uint8_t> colour_bytes(const Attribute& attribute) {
  const double scale = has_fractions(attribute) ? 255 : 1;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(attribute.values.size());
  for (const double x : attribute.values) bytes.push_back(clamped<std::uint8_t>(std::round(scale * x)));
  return bytes;
}

const Attribute* find_attribute(const std::vector<Attribute>& attributes, Site site, AttributeMeaning meaning) {
  for (const Attribute& attribute : attributes)
    if (attribute.site == site && meaning_of(attribute) == meaning) return &attribute;
  return nullptr;
}

bool is_material_library(const std::string& file) { return lower_extension(file) == ".mtl"; }

void append_value(std::string& out, double value, Type type) {
  if (type != Type::float32) return append_number(out, value);
  std::array<char, 32> digits;
  out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), static_cast<float>(value)).ptr);
}

void append_value_bytes(std::string& out, double value, Type type) {
  with_type(value, type, [&](auto typed) { append_bytes(out, typed); });
}

CornerTable tell_corners_apart(const TriangleMesh& mesh, const Attribute& corners) {
  const std::size_t n = mesh.vertices.size(), components = corners.components;
  CornerTable table;
  table.vertex.resize(n);
  table.corner.assign(n, 0);
  table.index.resize(3 * mesh.triangles.size());
  std::vector<char> known(n, 0);
  std::vector<Index> next(n, kNone);  // the next entry of the same vertex
  for (std::size_t v = 0; v < n; ++v) table.vertex[v] = static_cast<Index>(v);
  const auto same = [&](std::size_t a, std::size_t b) {
    const double* values = corners.values.data();
    return a == b || std::equal(values + components * a, values + components * (a + 1), values + components * b);
  };
  for (std::size_t corner = 0; corner < table.index.size(); ++corner) {
    Index entry = mesh.triangles[corner / 3][corner % 3];
    if (!known[entry]) {
      known[entry] = 1;
      table.corner[entry] = corner;
    }
    while (!same(table.corner[entry], corner)) {
      if (next[entry] == kNone) {
        next[entry] = static_cast<Index>(table.vertex.size());
        table.vertex.push_back(table.vertex[entry]);
        table.corner.push_back(corner);
        next.push_back(kNone);
      }
      entry = next[entry];
    }
    table.index[corner] = entry;
  }
  return table;
}

void split_attributes(const Soup& soup, TriangleMesh& mesh) {
  const auto face_of = [&](std::size_t t) -> std::size_t {
    return mesh.face_of_triangle.empty() ? t : mesh.face_of_triangle[t];
  };
  std::vector<std::size_t> faces, corners;
  for (const Attribute& attribute : soup.attributes) {
    if (attribute.site == Site::vertex) {
      mesh.attributes.push_back(attribute);
    } else if (attribute.site == Site::element) {
      if (faces.empty())
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) faces.push_back(face_of(t));
      mesh.attributes.push_back(picked(attribute, faces));
    } else {
      CornerFinder finder(soup.faces);
      if (corners.empty())
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
          for (const Index v : mesh.triangles[t]) corners.push_back(finder.find(face_of(t), v));
      mesh.attributes.push_back(picked(attribute, corners));
    }
  }
}

}  // namespace bisector::io
