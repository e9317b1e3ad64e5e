// PLY (Turk, The PLY polygon file format, Stanford 1994), and the triangle strips of Stanford's scans and Cyberware.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "io/attributes.h"
#include "io/bytes.h"
#include "io/labels.h"
#include "io/mesh_formats.h"
#include "io/ply_header.h"
#include "io/text.h"

namespace bisector::io {

namespace {

Attribute::Type type_of(Scalar type) {
  using Type = Attribute::Type;
  constexpr std::array<Type, 8> kTypes{Type::int8,  Type::uint8,  Type::int16,   Type::uint16,
                                       Type::int32, Type::uint32, Type::float32, Type::float64};
  return kTypes[static_cast<std::size_t>(type)];
}

// The body's values as text: one item a line, further columns ignored.
class PlyText {
 public:
  explicit PlyText(TextReader& in) : in_(in) {}
  void begin_item(const PlyElement& element, std::size_t item) {
    if (!in_.next_line())
      in_.fail_truncated(fmt::format("{} of {} items of '{}'", item, element.count, printable(element.name)));
  }
  double value(Scalar) { return in_.number(); }
  void skip(Scalar, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) {
      if (in_.word().empty()) fail(std::string("the line ends early; ") + kExportAgain);
    }
  }
  std::size_t most_items(const PlyElement& element) const {
    return in_.remaining() / (2 * std::max<std::size_t>(1, element.properties.size())) + 1;
  }
  std::string ignored() { return count_lines_left(in_); }
  [[noreturn]] void fail(const std::string& what) const { in_.fail(what); }

 private:
  TextReader& in_;
};

// The body's values as bytes.
class PlyBinary {
 public:
  PlyBinary(const std::string& path, std::string_view bytes, bool big_endian)
      : path_(path), bytes_(bytes), big_endian_(big_endian) {}
  void begin_item(const PlyElement& element, std::size_t item) {
    element_ = &element;
    item_ = item;
  }
  double value(Scalar type) { return load_scalar(type, take(size_of(type)), big_endian_); }
  void skip(Scalar type, std::size_t n) { take(n * size_of(type)); }
  std::size_t most_items(const PlyElement& element) const {
    return bytes_.size() / std::max<std::size_t>(1, element.least_size());
  }
  std::string ignored() const { return bytes_.empty() ? "" : quantity(bytes_.size(), "byte", "bytes"); }
  [[noreturn]] void fail(const std::string& what) const {
    io::fail(path_, fmt::format("{} {}: {}", printable(element_->name), item_, what));
  }

 private:
  const char* take(std::size_t size) {
    if (size > bytes_.size())
      fail(fmt::format("the file ends here, of {} declared; it is truncated, {}", element_->count, kExportAgain));
    const char* at = bytes_.data();
    bytes_.remove_prefix(size);
    return at;
  }

  const std::string& path_;
  std::string_view bytes_;
  bool big_endian_;
  const PlyElement* element_ = nullptr;
  std::size_t item_ = 0;
};

template <class Source>
std::size_t read_ply_count(Source& source, const PlyProperty& property) {
  const double n = source.value(property.count_type);
  if (!(n >= 0 && n < kNone && n == std::floor(n)))
    source.fail(fmt::format("a list cannot have {} entries; {}", n, kExportAgain));
  return static_cast<std::size_t>(n);
}

template <class Source>
void skip_ply_property(Source& source, const PlyProperty& property) {
  source.skip(property.type, property.list ? read_ply_count(source, property) : 1);
}

template <class Source>
void skip_ply_items(Source& source, const PlyElement& element) {
  for (std::size_t i = 0; i < element.count; ++i) {
    source.begin_item(element, i);
    for (const PlyProperty& property : element.properties) skip_ply_property(source, property);
  }
}

// The scalar properties that are attributes: all but those that are something else.
template <class IsElse>
AttributeColumns ply_columns(const PlyElement& element, Attribute::Site site, const IsElse& is_else) {
  AttributeColumns columns(site);
  for (const PlyProperty& p : element.properties)
    p.list || is_else(p) ? columns.skip() : columns.add(p.name, type_of(p.type));
  columns.group();
  return columns;
}

void move_attributes(AttributeColumns& columns, Soup& soup) {
  for (Attribute& attribute : columns.take()) soup.attributes.push_back(std::move(attribute));
}

template <class Source>
void read_ply_vertices(Source& source, const PlyElement& element, Soup& soup, bool with_attributes) {
  AttributeColumns columns = ply_columns(element, Attribute::Site::vertex,
                                         [&](const PlyProperty& p) { return !with_attributes || axis_of(p) >= 0; });
  soup.vertices.reserve(std::min(element.count, source.most_items(element)));
  for (std::size_t i = 0; i < element.count; ++i) {
    source.begin_item(element, i);
    Vec3 p;
    for (std::size_t j = 0; j < element.properties.size(); ++j) {
      const PlyProperty& property = element.properties[j];
      const int axis = axis_of(property);
      if (axis >= 0) {
        p[axis] = source.value(property.type);
        if (const char* flaw = coordinate_flaw(p[axis])) source.fail(flaw);
      } else if (columns.wants(j)) {
        columns.set(j, source.value(property.type));
      } else {
        skip_ply_property(source, property);
      }
    }
    columns.end_element();
    soup.vertices.push_back(p);
  }
  move_attributes(columns, soup);
}

template <class Source>
void read_ply_face(Source& source, const PlyProperty& property, std::size_t vertices, Soup& soup) {
  const std::size_t degree = read_ply_count(source, property);
  if (degree < 3) source.fail(fmt::format("has {}; remove it", quantity(degree, "corner", "corners")));
  for (std::size_t k = 0; k < degree; ++k) {
    const double v = source.value(property.type);
    if (!(v >= 0 && v < static_cast<double>(vertices) && v == std::floor(v)))
      source.fail(fmt::format("index {} is out of range, the file has {} vertices; mend the face", v, vertices));
    soup.faces.values.push_back(static_cast<Index>(v));
  }
  soup.end_face();
}

bool is_label(const PlyProperty& p) { return p.name == "label" && !p.list && p.type < Scalar::float32; }

template <class Source>
void read_ply_label(Source& source, const PlyProperty& property, Soup& soup) {
  const double label = source.value(property.type);
  if (!(label >= -0x1p31 && label < 0x1p32 && label == std::floor(label)))
    source.fail(fmt::format("{} is not a label; give an integer of 32 bits", label));
  soup.labels.push_back(static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::int64_t>(label))));
}

bool is_texture(const PlyProperty& p) { return p.list && p.name == "texcoord" && p.type >= Scalar::float32; }

// Texture coordinates of a face's corners, as MeshLab writes them.
template <class Source>
std::vector<double> read_ply_texture(Source& source, const PlyProperty& property) {
  std::vector<double> values;
  const std::size_t count = read_ply_count(source, property);
  for (std::size_t k = 0; k < count; ++k) values.push_back(source.value(property.type));
  return values;
}

template <class Source>
void read_ply_faces(Source& source, const PlyElement& element, std::size_t vertices, Soup& soup) {
  if (std::any_of(element.properties.begin(), element.properties.end(), is_label))
    soup.labels.resize(soup.faces.rows(), 0);  // of strips before
  AttributeColumns columns = ply_columns(element, Attribute::Site::element, is_label);
  for (std::size_t i = 0; i < soup.faces.rows(); ++i) columns.end_element();
  const bool textured = std::any_of(element.properties.begin(), element.properties.end(), is_texture);
  Attribute corners{"texcoord", Attribute::Site::corner, Attribute::Type::float32, 2, {}};
  for (std::size_t i = 0; i < element.count; ++i) {
    source.begin_item(element, i);
    std::vector<double> texture;
    for (std::size_t j = 0; j < element.properties.size(); ++j) {
      const PlyProperty& property = element.properties[j];
      if (is_index_list(property)) read_ply_face(source, property, vertices, soup);
      else if (is_label(property)) read_ply_label(source, property, soup);
      else if (is_texture(property)) texture = read_ply_texture(source, property);
      else if (columns.wants(j)) columns.set(j, source.value(property.type));
      else skip_ply_property(source, property);
    }
    columns.end_element();
    if (!textured) continue;
    const std::size_t degree = soup.faces.size(soup.faces.rows() - 1);
    if (!texture.empty() && texture.size() != 2 * degree)
      source.fail(fmt::format("'texcoord' has {} for {} corners; give two each, or none",
                              quantity(texture.size(), "number", "numbers"), degree));
    corners.values.resize(2 * (soup.faces.values.size() - degree), 0);  // of faces without
    corners.values.insert(corners.values.end(), texture.begin(), texture.end());
  }
  move_attributes(columns, soup);
  if (textured) soup.attributes.push_back(std::move(corners));
}

// Faces at the end may have no values: strips, and those without texture coordinates.
void fill_attributes(Soup& soup) {
  for (Attribute& attribute : soup.attributes) {
    const std::size_t sites = attribute.site == Attribute::Site::vertex    ? soup.vertices.size()
                              : attribute.site == Attribute::Site::element ? soup.faces.rows()
                                                                           : soup.faces.values.size();
    attribute.values.resize(attribute.components * sites, 0);
  }
}

// Triangles of a strip: every second one runs the other way round; -1 begins a new strip. A triangle with a corner
// twice only leads from one part of a strip to another.
template <class Source>
void read_ply_strip(Source& source, const PlyProperty& property, std::size_t vertices, Soup& soup) {
  const std::size_t length = read_ply_count(source, property);
  Triangle last{};
  std::size_t known = 0;
  for (std::size_t i = 0; i < length; ++i) {
    const double v = source.value(property.type);
    if (v == -1) {
      known = 0;
      continue;
    }
    if (!(v >= 0 && v < static_cast<double>(vertices) && v == std::floor(v)))
      source.fail(fmt::format("index {} is out of range, the file has {} vertices; mend the strip", v, vertices));
    last = {last[1], last[2], static_cast<Index>(v)};
    if (++known < 3 || last[0] == last[1] || last[1] == last[2] || last[2] == last[0]) continue;
    Triangle t = last;
    if (known % 2 == 0) std::swap(t[1], t[2]);
    soup.faces.values.insert(soup.faces.values.end(), t.begin(), t.end());
    soup.end_face();
  }
}

template <class Source>
void read_ply_strips(Source& source, const PlyElement& element, std::size_t vertices, Soup& soup) {
  for (std::size_t i = 0; i < element.count; ++i) {
    source.begin_item(element, i);
    for (const PlyProperty& property : element.properties) {
      if (is_index_list(property)) read_ply_strip(source, property, vertices, soup);
      else skip_ply_property(source, property);
    }
  }
}

int edge_end(const PlyProperty& p) {
  if (p.list || p.type >= Scalar::float32) return -1;
  return p.name == "vertex1" ? 0 : p.name == "vertex2" ? 1 : -1;
}

bool has_ends(const PlyElement& element) {
  for (const int end : {0, 1})
    if (std::count_if(element.properties.begin(), element.properties.end(),
                      [&](const PlyProperty& p) { return edge_end(p) == end; }) != 1)
      return false;
  return true;
}

template <class Source>
void read_ply_edges(Source& source, const PlyElement& element, std::size_t vertices, Soup& soup) {
  for (std::size_t i = 0; i < element.count; ++i) {
    source.begin_item(element, i);
    std::array<Index, 2> ends{};
    for (const PlyProperty& property : element.properties) {
      const int end = edge_end(property);
      if (end < 0) {
        skip_ply_property(source, property);
        continue;
      }
      const double v = source.value(property.type);
      if (!(v >= 0 && v < static_cast<double>(vertices) && v == std::floor(v)))
        source.fail(fmt::format("index {} is out of range, the file has {} vertices; mend the edge", v, vertices));
      ends[static_cast<std::size_t>(end)] = static_cast<Index>(v);
    }
    soup.edges.push_back(ends);
  }
}

template <class Source>
void read_ply_body(Source& source, const PlyHeader& header, Soup& soup) {
  const std::size_t vertices = header.find("vertex")->count;
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    if (element.name == "vertex") {
      read_ply_vertices(source, element, soup, true);
    } else if (element.name == "face") {
      read_ply_faces(source, element, vertices, soup);
    } else if (element.name == "tristrips") {
      read_ply_strips(source, element, vertices, soup);
    } else if (element.name == "edge" && has_ends(element)) {
      read_ply_edges(source, element, vertices, soup);
    } else {
      skip_ply_items(source, element);
    }
  }
  if (!soup.labels.empty()) soup.labels.resize(soup.faces.rows(), 0);  // strips have none
  fill_attributes(soup);
  soup.material_files = header.textures;
  soup.ignored = source.ignored();
}

void check_ply_vertices(const TextReader& in, const PlyHeader& header) {
  const PlyElement* vertex = header.find("vertex");
  if (!vertex) in.fail(std::string("the header has no element 'vertex'; ") + kExportAgain);
  for (const char* axis : {"x", "y", "z"})
    if (std::count_if(vertex->properties.begin(), vertex->properties.end(),
                      [&](const PlyProperty& p) { return p.name == axis && !p.list; }) != 1 ||
        std::count_if(vertex->properties.begin(), vertex->properties.end(),
                      [&](const PlyProperty& p) { return p.name == axis; }) != 1)
      in.fail(fmt::format("element 'vertex' needs one property '{}'; {}", axis, kExportAgain));
}

void check_ply_elements(const TextReader& in, const PlyHeader& header) {
  check_ply_vertices(in, header);
  const PlyElement *face = header.find("face"), *strips = header.find("tristrips");
  if (!face && !strips) in.fail("the header has no element 'face'; export as triangles");
  for (const PlyElement* element : {face, strips})
    if (element && std::count_if(element->properties.begin(), element->properties.end(), is_index_list) != 1)
      in.fail(fmt::format("element '{}' needs one list 'vertex_indices'; export as triangles", element->name));
  if (face && std::count_if(face->properties.begin(), face->properties.end(), is_label) > 1)
    in.fail(std::string("element 'face' has several properties 'label'; ") + kExportAgain);
}

// What comes after the vertices is not read.
template <class Source>
std::vector<Vec3> read_ply_positions(Source& source, const PlyHeader& header) {
  Soup soup;
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    if (element.name == "vertex") {
      read_ply_vertices(source, element, soup, false);
      break;
    }
    skip_ply_items(source, element);
  }
  return std::move(soup.vertices);
}

template <class Source>
std::vector<double> read_ply_scalars(Source& source, const PlyHeader& header, const PlyProperty* wanted,
                                     const std::string& path) {
  std::vector<double> values;
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    if (element.name != "vertex") {
      skip_ply_items(source, element);
      continue;
    }
    values.reserve(std::min(element.count, source.most_items(element)));
    for (std::size_t i = 0; i < element.count; ++i) {
      source.begin_item(element, i);
      for (const PlyProperty& property : element.properties) {
        if (&property != wanted) {
          skip_ply_property(source, property);
          continue;
        }
        values.push_back(source.value(property.type));
        if (!std::isfinite(values.back()))
          fail(path, fmt::format("vertex {}: '{}' is not finite; mend the value", i, printable(wanted->name)));
      }
    }
    break;
  }
  return values;
}

std::string ply_header(std::size_t vertices, std::size_t faces, std::size_t largest_degree) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list {} {} vertex_indices\n",
      vertices, faces, largest_degree > 255 ? "uint" : "uchar", vertices >> 31 ? "uint" : "int");
}

void append_ply_vertices(std::string& out, const std::vector<Vec3>& vertices) {
  for (const Vec3& p : vertices)
    for (int k = 0; k < 3; ++k) append_bytes(out, p[k]);
}

std::string ply_edge_header(const std::vector<std::array<Index, 2>>& edges, std::size_t vertices) {
  if (edges.empty()) return {};
  const char* type = vertices >> 31 ? "uint" : "int";
  return fmt::format("element edge {}\nproperty {} vertex1\nproperty {} vertex2\n", edges.size(), type, type);
}

void append_ply_edges(std::string& out, const std::vector<std::array<Index, 2>>& edges) {
  for (const std::array<Index, 2>& e : edges)
    for (const Index v : e) append_bytes(out, v);
}

const char* name_of(Attribute::Type type) {
  using Type = Attribute::Type;
  switch (type) {
    case Type::int8: return "char";
    case Type::uint8: return "uchar";
    case Type::int16: return "short";
    case Type::uint16: return "ushort";
    case Type::int32: return "int";
    case Type::uint32: return "uint";
    case Type::float32: return "float";
    case Type::int64:
    case Type::uint64:
    case Type::float64: break;  // PLY has no integers of 64 bits
  }
  return "double";
}

// The attributes of one kind of element as properties with names of their own.
class PlyProperties {
 public:
  PlyProperties(const TriangleMesh& mesh, Attribute::Site site) {
    std::set<std::string> taken{"x", "y", "z", "label", "vertex_indices", "texcoord"};
    for (const Attribute& attribute : mesh.attributes) {
      if (attribute.site != site) continue;
      const bool colours = meaning_of(attribute) == AttributeMeaning::colour;
      const char* type = colours ? "uchar" : name_of(attribute.type);
      for (const std::string& own : component_names(attribute)) {
        std::string name = cleaned(own.empty() ? "attribute" : own, " \t");
        while (!taken.insert(name).second) name += '_';
        header_ += fmt::format("property {} {}\n", type, name);
      }
      if (colours) colours_.push_back(colour_bytes(attribute));
      attributes_.push_back({&attribute, colours ? colours_.size() - 1 : kNone});
    }
  }

  const std::string& header() const { return header_; }
  // Bytes of one element, at most.
  std::size_t size() const {
    std::size_t size = 0;
    for (const Entry& entry : attributes_) size += sizeof(double) * entry.attribute->components;
    return size;
  }
  void append(std::string& out, std::size_t i) const {
    for (const auto& [attribute, colours] : attributes_)
      for (std::size_t k = attribute->components * i; k < attribute->components * (i + 1); ++k) {
        if (colours != kNone) append_bytes(out, colours_[colours][k]);
        else if (name_of(attribute->type) == std::string_view("double")) append_bytes(out, attribute->values[k]);
        else append_value_bytes(out, attribute->values[k], attribute->type);
      }
  }

 private:
  struct Entry {
    const Attribute* attribute;
    std::size_t colours;  // or kNone
  };
  std::string header_;
  std::vector<Entry> attributes_;
  std::vector<std::vector<std::uint8_t>> colours_;
};

}  // namespace

Soup read_ply(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, 0);
  const PlyHeader header = read_ply_header(in);
  check_ply_elements(in, header);
  Soup soup;
  if (header.text) {
    PlyText source(in);
    read_ply_body(source, header, soup);
  } else {
    PlyBinary source(path, in.after_line(), header.big_endian);
    read_ply_body(source, header, soup);
  }
  return soup;
}

std::vector<Vec3> read_ply_points(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, 0);
  const PlyHeader header = read_ply_header(in);
  check_ply_vertices(in, header);
  if (header.find("vertex")->count == 0) fail(path, "there is no point at all; export the file with points");
  if (header.text) {
    PlyText source(in);
    return read_ply_positions(source, header);
  }
  PlyBinary source(path, in.after_line(), header.big_endian);
  return read_ply_positions(source, header);
}

std::vector<double> read_ply_attribute(const std::string& path, std::string_view bytes, const std::string& name) {
  TextReader in(path, bytes, 0);
  const PlyHeader header = read_ply_header(in);
  check_ply_vertices(in, header);
  const PlyProperty* wanted = nullptr;
  std::string known;
  for (const PlyProperty& p : header.find("vertex")->properties) {
    if (p.list) continue;
    if (p.name == name && wanted)
      fail(path, fmt::format("element 'vertex' has several properties '{}'; {}", printable(name), kExportAgain));
    if (p.name == name) wanted = &p;
    known += (known.empty() ? "" : ", ") + printable(p.name);
  }
  if (!wanted)
    fail(path, fmt::format("element 'vertex' has no scalar property '{}'; use one of {}", printable(name), known));
  if (header.text) {
    PlyText source(in);
    return read_ply_scalars(source, header, wanted, path);
  }
  PlyBinary source(path, in.after_line(), header.big_endian);
  return read_ply_scalars(source, header, wanted, path);
}

std::string format_ply(const std::string&, const TriangleMesh& mesh, const WriteOptions&) {
  const PlyProperties of_vertices(mesh, Attribute::Site::vertex), of_faces(mesh, Attribute::Site::element);
  const Attribute* texture = find_attribute(mesh.attributes, Attribute::Site::corner, AttributeMeaning::texture);
  std::string out = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& file : mesh.material_files)
    if (!is_material_library(file)) out += "comment TextureFile " + cleaned(file) + '\n';
  out += fmt::format(
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n{}element face {}\n"
      "property list uchar {} vertex_indices\n",
      mesh.vertices.size(), of_vertices.header(), mesh.triangles.size(), mesh.vertices.size() >> 31 ? "uint" : "int");
  if (!mesh.labels.empty()) out += "property int label\n";
  out += of_faces.header();
  if (texture) out += "property list uchar float texcoord\n";
  out += ply_edge_header(mesh.feature_edges, mesh.vertices.size()) + "end_header\n";
  out.reserve(out.size() + (24 + of_vertices.size()) * mesh.vertices.size() +
              (17 + of_faces.size() + (texture ? 25 : 0)) * mesh.triangles.size() + 8 * mesh.feature_edges.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    for (int k = 0; k < 3; ++k) append_bytes(out, mesh.vertices[v][k]);
    of_vertices.append(out, v);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    append_bytes(out, static_cast<std::uint8_t>(3));
    for (const Index v : mesh.triangles[i]) append_bytes(out, v);
    if (!mesh.labels.empty()) append_bytes(out, mesh.labels[i]);
    of_faces.append(out, i);
    if (!texture) continue;
    append_bytes(out, static_cast<std::uint8_t>(6));
    for (std::size_t k = 0; k < 6; ++k) append_value_bytes(out, texture->values[6 * i + k], Attribute::Type::float32);
  }
  append_ply_edges(out, mesh.feature_edges);
  return out;
}

std::string format_ply(const PolygonMesh& mesh, const WriteOptions&) {
  const std::size_t faces = mesh.polygons.rows();
  std::size_t largest_degree = 0;
  for (std::size_t i = 0; i < faces; ++i) largest_degree = std::max(largest_degree, mesh.polygons.size(i));
  std::string out = ply_header(mesh.vertices.size(), faces, largest_degree);
  if (!mesh.labels.empty()) out += "property uint label\n";
  if (!mesh.colours.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  out += ply_edge_header(mesh.feature_edges, mesh.vertices.size()) + "end_header\n";
  append_ply_vertices(out, mesh.vertices);
  for (std::size_t i = 0; i < faces; ++i) {
    if (largest_degree > 255) append_bytes(out, static_cast<std::uint32_t>(mesh.polygons.size(i)));
    else append_bytes(out, static_cast<std::uint8_t>(mesh.polygons.size(i)));
    for (const Index* v = mesh.polygons.begin(i); v != mesh.polygons.end(i); ++v) append_bytes(out, *v);
    if (!mesh.labels.empty()) append_bytes(out, mesh.labels[i]);
    if (!mesh.colours.empty())
      for (const unsigned char channel : mesh.colours[i]) append_bytes(out, channel);
  }
  append_ply_edges(out, mesh.feature_edges);
  return out;
}

}  // namespace bisector::io
