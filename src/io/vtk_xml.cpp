// VTK's XML files of unstructured grids (.vtu) and polygons (.vtp): ASCII, base64, appended, compressed by zlib or not
// (VTK file formats, docs.vtk.org).
#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "core/base64.h"
#include "core/grouping.h"
#include "io/attributes.h"
#include "io/labels.h"
#include "io/nodes.h"
#include "io/vtk_grid.h"
#include "io/xml.h"

namespace bisector::io {

namespace {

// Names of the types of numbers, in the order of Attribute::Type.
constexpr std::array<std::string_view, 10> kTypes{"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                                  "UInt32", "Int64", "UInt64", "Float32", "Float64"};

Attribute::Type type_of(std::string_view name) {
  const auto at = std::find(kTypes.begin(), kTypes.end(), name);
  return at == kTypes.end() ? Attribute::Type::float64 : static_cast<Attribute::Type>(at - kTypes.begin());
}

int base64_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

// Bytes in base64 or as they are. In base64 padding may stand in the middle, where one piece ends and another begins.
class ByteStream {
 public:
  ByteStream(const std::string& path, std::string_view text, bool base64) : path_(path), text_(text), base64_(base64) {}

  std::string take(std::size_t n) {
    if (!base64_) {
      if (n > text_.size()) fail_short();
      const std::string bytes(text_.substr(0, n));
      text_.remove_prefix(n);
      return bytes;
    }
    if (n > buffer_.size() + text_.size()) fail_short();
    while (buffer_.size() < n) decode_quantum();
    std::string bytes = buffer_.substr(0, n);
    buffer_.erase(0, n);
    return bytes;
  }
  std::size_t left() const { return text_.size() + buffer_.size(); }

 private:
  [[noreturn]] void fail_short() const {
    fail(path_, std::string("an array ends early; the file is truncated, ") + kExportAgain);
  }
  void decode_quantum() {
    int digits[4], known = 0;
    std::size_t at = 0;
    while (at < text_.size() && known < 4) {
      const char c = text_[at++];
      if (c == ' ' || c == '\n' || c == '\r' || c == '\t') continue;
      const int value = c == '=' ? -2 : base64_value(c);
      if (value == -1) fail(path_, std::string("an array has what is not base64; ") + kExportAgain);
      digits[known++] = value;
    }
    if (known < 4 || digits[0] < 0 || digits[1] < 0) fail_short();
    text_.remove_prefix(at);
    buffer_ += static_cast<char>(digits[0] << 2 | digits[1] >> 4);
    if (digits[2] >= 0) buffer_ += static_cast<char>((digits[1] & 15) << 4 | digits[2] >> 2);
    if (digits[2] >= 0 && digits[3] >= 0) buffer_ += static_cast<char>((digits[2] & 3) << 6 | digits[3]);
  }

  const std::string& path_;
  std::string_view text_;
  bool base64_;
  std::string buffer_;
};

// What one piece holds: points, data and tables of cells.
struct VtkPiece {
  std::vector<Vec3> points;
  std::map<std::string, VtkCells, std::less<>> cells;  // by section: Cells; or Verts, Lines, Strips and Polys
  std::vector<std::int64_t> types;
  VtkArrays cell_data, point_data;
};

class VtkXmlReader {
 public:
  VtkXmlReader(const std::string& path, std::string_view bytes) : path_(path), markup_(path, find_appended(bytes)) {}

  // `kind`: UnstructuredGrid or PolyData.
  VtkPiece read(std::string_view kind) {
    std::string section;
    bool known = false, piece = false;
    Tag tag;
    while (markup_.next_tag(tag)) {
      if (tag.name == "VTKFile") read_head(tag);
      else if (tag.name == kind) known = true;
      else if (tag.name == "Piece") {
        if (piece) fail(path_, "there are several pieces; merge them");
        piece = true;
        read_counts(tag, kind);
      } else if (tag.name == "DataArray") {
        if (!section.empty()) take_array(tag, section);
      } else if (piece && is_section(tag.name)) {
        section = tag.closed ? "" : tag.name;
      } else if (tag.name.starts_with('/') && tag.name != "/DataArray" && is_section(tag.name.substr(1))) {
        section.clear();
      }
    }
    if (!known) fail(path_, fmt::format("there is no {}; save the mesh as that kind of data", kind));
    if (!piece || piece_.points.empty())
      fail(path_, std::string("there are no points or no cells; the file is empty or truncated, ") + kExportAgain);
    return std::move(piece_);
  }

 private:
  bool is_section(std::string_view name) const {
    return name == "Points" || name == "PointData" || name == "CellData" || counts_.count(name) > 0;
  }

  void read_counts(const Tag& tag, std::string_view kind) {
    points_ = number(tag, "NumberOfPoints");
    if (kind == "UnstructuredGrid") {
      counts_["Cells"] = cells_ = number(tag, "NumberOfCells");
      return;
    }
    for (const char* section : {"Verts", "Lines", "Strips", "Polys"}) {
      const std::string key = std::string("NumberOf") + section;
      const std::size_t n = tag[key].empty() ? 0 : number(tag, key.c_str());
      counts_[section] = n;
      cells_ += n;
    }
  }

  // Reads an array of a section; what is not known is passed over.
  void take_array(const Tag& tag, const std::string& section) {
    const std::string name(tag["Name"]);
    const std::size_t components = tag["NumberOfComponents"].empty() ? 1 : number(tag, "NumberOfComponents");
    if (section == "Points") {
      if (!piece_.points.empty()) fail(path_, std::string("the points have several arrays; ") + kExportAgain);
      take_points(read_array(tag, 3, points_));
    } else if (section == "PointData" || section == "CellData") {
      const bool points = section == "PointData";
      const std::size_t columns = std::max<std::size_t>(1, components);
      put_array(points ? piece_.point_data : piece_.cell_data,
                {name, Attribute::Site::vertex, type_of(tag["type"]), columns,
                 read_array(tag, columns, points ? points_ : cells_)});
    } else if (name == "types") {
      piece_.types = integers(read_array(tag, 1, counts_[section]));
    } else if (name == "offsets") {
      std::vector<std::int64_t>& offsets = piece_.cells[section].offsets;
      offsets = integers(read_array(tag, 1, counts_[section]));
      offsets.insert(offsets.begin(), 0);
    } else if (name == "connectivity") {
      piece_.cells[section].connectivity = integers(read_array(tag, 1, std::nullopt));
    }
  }

  // Raw data may hold anything, so tags are looked for before them only. Returns what comes before.
  std::string_view find_appended(std::string_view bytes) {
    const std::size_t start = bytes.find("<AppendedData");
    if (start == std::string_view::npos) return bytes;
    const std::size_t end = bytes.find('>', start), mark = bytes.find('_', end);
    if (end == std::string_view::npos || mark == std::string_view::npos)
      fail(path_, std::string("the appended data have no start; the file is truncated, ") + kExportAgain);
    appended_base64_ = bytes.substr(start, end - start).find("base64") != std::string_view::npos;
    appended_ = bytes.substr(mark + 1);
    if (const std::size_t close = appended_.rfind("</AppendedData"); close != std::string_view::npos)
      appended_ = appended_.substr(0, close);
    return bytes.substr(0, start);
  }

  void read_head(const Tag& tag) {
    big_endian_ = tag["byte_order"] == "BigEndian";
    wide_header_ = tag["header_type"] == "UInt64";
    const std::string_view compressor = tag["compressor"];
    compressed_ = !compressor.empty();
    if (compressed_ && compressor != "vtkZLibDataCompressor")
      fail(path_, "data compressed by " + printable(compressor) + " are not read; save them uncompressed or with zlib");
  }

  std::size_t number(const Tag& tag, const char* key) const {
    const std::string_view text = tag[key];
    const auto refuse = [&](const std::string& what) { fail(path_, fmt::format("{}: {}", key, what)); };
    if (text.empty()) refuse(std::string("is missing; ") + kExportAgain);
    const std::int64_t n = parse_integer(text, refuse);
    if (n < 0 || n >= std::int64_t{kNone}) refuse(fmt::format("{} is out of range; {}", n, kExportAgain));
    return static_cast<std::size_t>(n);
  }

  std::uint64_t head(ByteStream& stream) const {
    const std::string bytes = stream.take(wide_header_ ? 8 : 4);
    return wide_header_ ? load<std::uint64_t>(bytes.data(), big_endian_)
                        : load<std::uint32_t>(bytes.data(), big_endian_);
  }

  std::string read_bytes_of(ByteStream stream) const {
    if (!compressed_) return stream.take(head(stream));
    const std::uint64_t blocks = head(stream), size = head(stream), last = head(stream);
    if (blocks > stream.left()) fail(path_, std::string("an array ends early; the file is truncated, ") + kExportAgain);
    std::vector<std::uint64_t> packed(blocks);
    for (std::uint64_t& n : packed) n = head(stream);
    std::string bytes;
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::string block = stream.take(packed[b]);
      const std::uint64_t unpacked = b + 1 == blocks && last != 0 ? last : size;
      if (unpacked > 1100 * (block.size() + 1))
        fail(path_, std::string("a compressed block is damaged; ") + kExportAgain);
      const std::size_t start = bytes.size();
      bytes.resize(start + unpacked);
      uLongf got = unpacked;
      if (::uncompress(reinterpret_cast<Bytef*>(bytes.data() + start), &got,
                       reinterpret_cast<const Bytef*>(block.data()), block.size()) != Z_OK ||
          got != unpacked)
        fail(path_, std::string("a compressed block is damaged; ") + kExportAgain);
    }
    return bytes;
  }

  template <class T>
  std::vector<double> unpack(const std::string& bytes) const {
    std::vector<double> values(bytes.size() / sizeof(T));
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<double>(load<T>(bytes.data() + i * sizeof(T), big_endian_));
    return values;
  }

  std::vector<double> read_array(const Tag& tag, std::size_t components, std::optional<std::size_t> tuples) {
    const std::string_view form = tag["format"], type = tag["type"];
    std::vector<double> values;
    if (form == "ascii") {
      MixedReader in(path_, tag.closed ? std::string_view{} : markup_.text_ahead());
      for (std::string_view word = in.word(); !word.empty(); word = in.word())
        values.push_back(parse_number(word, [&](const std::string& what) {
          fail(path_, fmt::format("the array '{}': {}", printable(tag["Name"]), what));
        }));
    } else if (form == "binary" || form == "appended") {
      std::string_view text;
      if (form == "binary") {
        text = markup_.text_ahead();
      } else {
        const std::size_t offset = number(tag, "offset");
        if (offset > appended_.size())
          fail(path_, std::string("an array lies beyond the appended data; ") + kExportAgain);
        text = appended_.substr(offset);
      }
      const std::string bytes = read_bytes_of(ByteStream(path_, text, form == "binary" || appended_base64_));
      if (type == "Float64") values = unpack<double>(bytes);
      else if (type == "Float32") values = unpack<float>(bytes);
      else if (type == "Int64") values = unpack<std::int64_t>(bytes);
      else if (type == "UInt64") values = unpack<std::uint64_t>(bytes);
      else if (type == "Int32") values = unpack<std::int32_t>(bytes);
      else if (type == "UInt32") values = unpack<std::uint32_t>(bytes);
      else if (type == "Int16") values = unpack<std::int16_t>(bytes);
      else if (type == "UInt16") values = unpack<std::uint16_t>(bytes);
      else if (type == "Int8") values = unpack<std::int8_t>(bytes);
      else if (type == "UInt8") values = unpack<std::uint8_t>(bytes);
      else
        fail(path_, fmt::format("the array '{}' has type '{}', which is not read; {}", printable(tag["Name"]),
                                printable(type), kExportAgain));
    } else {
      fail(path_, fmt::format("the array '{}' has format '{}'; use ascii, binary or appended", printable(tag["Name"]),
                              printable(form)));
    }
    if (tuples && values.size() != *tuples * components)
      fail(path_, fmt::format("the array '{}' has {} numbers instead of {}; the file is truncated, {}",
                              printable(tag["Name"]), values.size(), *tuples * components, kExportAgain));
    return values;
  }

  void take_points(const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size() / 3; ++i) {
      piece_.points.push_back({values[3 * i], values[3 * i + 1], values[3 * i + 2]});
      for (int k = 0; k < 3; ++k)
        if (const char* flaw = coordinate_flaw(piece_.points[i][k])) fail(path_, fmt::format("vertex {}: {}", i, flaw));
    }
  }

  const std::string& path_;
  std::string_view appended_;
  bool appended_base64_ = false, big_endian_ = false, wide_header_ = false, compressed_ = false;
  XmlReader markup_;
  std::size_t points_ = 0, cells_ = 0;
  std::map<std::string, std::size_t, std::less<>> counts_;  // of cells by section
  VtkPiece piece_;
};

VtkGrid read_grid(const std::string& path, std::string_view bytes) {
  VtkPiece piece = VtkXmlReader(path, bytes).read("UnstructuredGrid");
  if (piece.types.empty())
    fail(path, std::string("there are no points or no cells; the file is empty or truncated, ") + kExportAgain);
  return {std::move(piece.points), std::move(piece.cells["Cells"]), std::move(piece.types), std::move(piece.cell_data),
          std::move(piece.point_data)};
}

// Makes a surface of polygons, strips and lines.
class PolyDataReader {
 public:
  PolyDataReader(const std::string& path, VtkPiece piece) : path_(path), piece_(std::move(piece)) {}

  // Data of cells come in the order of these sections.
  Soup read() {
    first_ = piece_.cells["Verts"].size();
    each_cell("Lines", [this](std::size_t, const std::vector<Index>& v) {
      for (std::size_t k = 0; k + 1 < v.size(); ++k) soup_.edges.push_back({v[k], v[k + 1]});
    });
    each_cell("Polys", [this](std::size_t cell, const std::vector<Index>& v) {
      if (v.size() < 3)
        fail(path_, fmt::format("cell {}: a polygon has {}; remove it", cell, quantity(v.size(), "corner", "corners")));
      add_face(cell, v);
    });
    each_cell("Strips", [this](std::size_t cell, const std::vector<Index>& v) {
      for (std::size_t k = 0; k + 2 < v.size(); ++k) {
        std::array<Index, 3> t{v[k], v[k + 1], v[k + 2]};
        if (k % 2 == 1) std::swap(t[0], t[1]);
        add_face(cell, t);
      }
    });
    soup_.labels = labels_of_cells(path_, piece_.cell_data, cell_of_face_);
    if (std::all_of(soup_.labels.begin(), soup_.labels.end(), [](std::int32_t label) { return label == 0; }))
      soup_.labels.clear();
    soup_.vertices = std::move(piece_.points);
    soup_.attributes = attributes_of_points(std::move(piece_.point_data));
    for (Attribute& attribute : attributes_of_cells(piece_.cell_data, cell_of_face_, false))
      soup_.attributes.push_back(std::move(attribute));
    return std::move(soup_);
  }

 private:
  template <class Take>
  void each_cell(const char* section, const Take& take) {
    const VtkCells& cells = piece_.cells[section];
    for (std::size_t i = 0; i < cells.size(); ++i)
      take(first_ + i, corners_of(path_, cells, i, piece_.points.size(), first_));
    first_ += cells.size();
  }
  void add_face(std::size_t cell, std::span<const Index> corners) {
    soup_.faces.values.insert(soup_.faces.values.end(), corners.begin(), corners.end());
    soup_.end_face();
    cell_of_face_.push_back(cell);
  }

  const std::string& path_;
  VtkPiece piece_;
  Soup soup_;
  std::size_t first_ = 0;
  std::vector<std::size_t> cell_of_face_;
};

void append_array_of_bytes(std::string& out, std::string_view type, std::string_view name, std::size_t components,
                           std::string_view values) {
  // meshio takes an explicit 1 for a matrix of one column.
  const std::string shape = components == 1 ? "" : fmt::format(" NumberOfComponents=\"{}\"", components);
  fmt::format_to(std::back_inserter(out), "<DataArray type=\"{}\" Name=\"{}\"{} format=\"binary\">\n", type, name,
                 shape);
  std::string bytes;
  bytes.reserve(8 + values.size());
  append_bytes(bytes, static_cast<std::uint64_t>(values.size()));
  bytes += values;
  out += base64(bytes);
  out += "\n</DataArray>\n";
}

template <class T>
void append_array(std::string& out, const char* type, const char* name, std::size_t components,
                  const std::vector<T>& values) {
  std::string bytes;
  bytes.reserve(sizeof(T) * values.size());
  for (const T x : values) append_bytes(bytes, x);
  append_array_of_bytes(out, type, name, components, bytes);
}

// Attributes of some elements, between `before` and `after` others that have none: 0 there, or no number. Arrays that
// mark cells have names of their own.
void append_attributes(std::string& out, const std::vector<Attribute>& attributes, Attribute::Site site,
                       std::size_t before, std::size_t after) {
  std::set<std::string> taken{"label", "region"};
  for (const Attribute& attribute : attributes) {
    if (attribute.site != site) continue;
    std::string name = cleaned(attribute.name, "<>&\"'"), bytes;
    while (!taken.insert(name).second) name += '_';
    const double none = has_fractions(attribute) ? std::numeric_limits<double>::quiet_NaN() : 0;
    const auto append = [&](double value) { append_value_bytes(bytes, value, attribute.type); };
    for (std::size_t i = 0; i < attribute.components * before; ++i) append(none);
    for (const double value : attribute.values) append(value);
    for (std::size_t i = 0; i < attribute.components * after; ++i) append(none);
    append_array_of_bytes(out, kTypes[static_cast<std::size_t>(attribute.type)], name, attribute.components, bytes);
  }
}

// The section of the points' data, which tells programs what to show.
void append_point_data(std::string& out, const std::vector<Attribute>& attributes) {
  const auto active = [&](const char* key, AttributeMeaning meaning) {
    const Attribute* found = find_attribute(attributes, Attribute::Site::vertex, meaning);
    return found ? fmt::format(" {}=\"{}\"", key, cleaned(found->name, "<>&\"'")) : "";
  };
  const bool any = std::any_of(attributes.begin(), attributes.end(),
                               [](const Attribute& a) { return a.site == Attribute::Site::vertex; });
  if (!any) return;
  out += fmt::format("<PointData{}{}{}>\n", active("Scalars", AttributeMeaning::colour),
                     active("Normals", AttributeMeaning::normal), active("TCoords", AttributeMeaning::texture));
  append_attributes(out, attributes, Attribute::Site::vertex, 0, 0);
  out += "</PointData>\n";
}

void append_points(std::string& out, const std::vector<Vec3>& vertices) {
  std::vector<double> points;
  points.reserve(3 * vertices.size());
  for (const Vec3& p : vertices)
    for (int k = 0; k < 3; ++k) points.push_back(p[k]);
  out += "<Points>\n";
  append_array(out, "Float64", "Points", 3, points);
  out += "</Points>\n";
}

std::string file_start(const char* kind) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{}\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<{}>\n",
      kind, kind);
}

// Faces and lines as PolyData. `labels`: one per face, or none.
std::string polydata_of(const std::vector<Vec3>& vertices, const Csr<Index>& faces,
                        const std::vector<std::int32_t>& labels, const std::vector<std::array<Index, 2>>& edges,
                        const std::vector<Attribute>& attributes) {
  std::string out = file_start("PolyData");
  out += fmt::format(
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" "
      "NumberOfPolys=\"{}\">\n",
      vertices.size(), edges.size(), faces.rows());
  append_points(out, vertices);
  append_point_data(out, attributes);
  const auto append_cells = [&](const char* section, const std::vector<std::int64_t>& connectivity,
                                const std::vector<std::int64_t>& offsets) {
    out += fmt::format("<{}>\n", section);
    append_array(out, "Int64", "connectivity", 1, connectivity);
    append_array(out, "Int64", "offsets", 1, offsets);
    out += fmt::format("</{}>\n", section);
  };
  std::vector<std::int64_t> connectivity, offsets;
  for (const std::array<Index, 2>& e : edges) {
    connectivity.insert(connectivity.end(), e.begin(), e.end());
    offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
  }
  append_cells("Lines", connectivity, offsets);
  append_cells("Polys", {faces.values.begin(), faces.values.end()}, {faces.offsets.begin() + 1, faces.offsets.end()});
  out += "<CellData>\n";
  if (!labels.empty()) {
    std::vector<std::int32_t> of_cells(edges.size(), 0);
    of_cells.insert(of_cells.end(), labels.begin(), labels.end());
    append_array(out, "Int32", "label", 1, of_cells);
  }
  append_attributes(out, attributes, Attribute::Site::element, edges.size(), 0);
  return out + "</CellData>\n</Piece>\n</PolyData>\n</VTKFile>\n";
}

// Cells as an UnstructuredGrid; `of_triangles`: attributes of the boundary's.
std::string grid_of(const TetMesh& mesh, const SecondOrder& order, const std::vector<Attribute>& of_triangles) {
  const std::size_t cells = mesh.tets.size() + mesh.boundary.size() + mesh.feature_edges.size();
  std::vector<std::int64_t> connectivity, offsets;
  std::vector<std::uint8_t> types;
  const auto append = [&](const auto& elements, VtkCell straight, VtkCell curved) {
    const VtkCell type = order.empty() ? straight : curved;
    for (const auto& element : elements) {
      const std::vector<Index> nodes = corners_and_nodes(element, order, mesh.vertices.size());
      connectivity.insert(connectivity.end(), nodes.begin(), nodes.end());
      offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
      types.push_back(static_cast<std::uint8_t>(type));
    }
  };
  append(mesh.tets, kTetrahedron, kQuadraticTetrahedron);
  append(mesh.boundary, kTriangle, kQuadraticTriangle);
  append(mesh.feature_edges, kLine, kQuadraticEdge);

  std::string out = file_start("UnstructuredGrid");
  out += fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", mesh.vertices.size() + order.nodes.size(),
                     cells);
  append_points(out, vertices_and_nodes(mesh, order));
  append_point_data(out, attributes_with_nodes(mesh.attributes, order));
  out += "<Cells>\n";
  append_array(out, "Int64", "connectivity", 1, connectivity);
  append_array(out, "Int64", "offsets", 1, offsets);
  append_array(out, "UInt8", "types", 1, types);
  out += "</Cells>\n<CellData>\n";
  if (!mesh.regions.empty()) {
    std::vector<std::int32_t> regions = mesh.regions;
    regions.resize(cells, 0);
    append_array(out, "Int32", "region", 1, regions);
  }
  if (!mesh.boundary_labels.empty()) {
    std::vector<std::int32_t> labels(mesh.tets.size(), 0);
    labels.insert(labels.end(), mesh.boundary_labels.begin(), mesh.boundary_labels.end());
    labels.resize(cells, 0);
    append_array(out, "Int32", "label", 1, labels);
  }
  append_attributes(out, mesh.attributes, Attribute::Site::element, 0, cells - mesh.tets.size());
  append_attributes(out, of_triangles, Attribute::Site::element, mesh.tets.size(), mesh.feature_edges.size());
  return out + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

}  // namespace

TetSoup read_vtu(const std::string& path, std::string_view bytes) { return soup_of_grid(path, read_grid(path, bytes)); }

Soup read_vtp(const std::string& path, std::string_view bytes) {
  return PolyDataReader(path, VtkXmlReader(path, bytes).read("PolyData")).read();
}

std::vector<double> read_vtu_attribute(const std::string& path, std::string_view bytes, const std::string& name) {
  VtkGrid grid = read_grid(path, bytes);
  return point_data_of(path, std::move(grid.point_data), grid.points.size(), name);
}

std::vector<double> read_vtp_attribute(const std::string& path, std::string_view bytes, const std::string& name) {
  VtkPiece piece = VtkXmlReader(path, bytes).read("PolyData");
  return point_data_of(path, std::move(piece.point_data), piece.points.size(), name);
}

std::string format_vtp(const std::string&, const TriangleMesh& mesh, const WriteOptions&) {
  return polydata_of(mesh.vertices, rows_of(mesh.triangles), mesh.labels, mesh.feature_edges, mesh.attributes);
}

std::string format_vtp(const PolygonMesh& mesh, const WriteOptions&) {
  return polydata_of(mesh.vertices, mesh.polygons, {mesh.labels.begin(), mesh.labels.end()}, mesh.feature_edges, {});
}

std::string format_vtu(const TetMesh& mesh, const SecondOrder& order) { return grid_of(mesh, order, {}); }

std::string format_vtu(const std::string&, const TriangleMesh& mesh, const WriteOptions&) {
  TetMesh marks{mesh.vertices, {}, {}, mesh.triangles, mesh.labels, mesh.feature_edges};
  std::vector<Attribute> of_triangles;
  for (const Attribute& attribute : mesh.attributes) {
    if (attribute.site == Attribute::Site::vertex) marks.attributes.push_back(attribute);
    else if (attribute.site == Attribute::Site::element) of_triangles.push_back(attribute);
  }
  return grid_of(marks, {}, of_triangles);
}

std::string format_vtu(const PolyhedronMesh& mesh) {
  const std::size_t n = mesh.polyhedra.rows();
  // Of each polyhedron its points; and how many faces it has, of each how many corners, and these.
  std::vector<std::int64_t> connectivity, offsets, faces, face_offsets;
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<Index> points;
    faces.push_back(static_cast<std::int64_t>(mesh.polyhedra.size(i)));
    for (const Index* f = mesh.polyhedra.begin(i); f != mesh.polyhedra.end(i); ++f) {
      faces.push_back(static_cast<std::int64_t>(mesh.faces.size(*f)));
      faces.insert(faces.end(), mesh.faces.begin(*f), mesh.faces.end(*f));
      points.insert(points.end(), mesh.faces.begin(*f), mesh.faces.end(*f));
    }
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    connectivity.insert(connectivity.end(), points.begin(), points.end());
    offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
    face_offsets.push_back(static_cast<std::int64_t>(faces.size()));
  }
  std::string out = file_start("UnstructuredGrid");
  out += fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", mesh.vertices.size(), n);
  append_points(out, mesh.vertices);
  out += "<Cells>\n";
  append_array(out, "Int64", "connectivity", 1, connectivity);
  append_array(out, "Int64", "offsets", 1, offsets);
  append_array(out, "UInt8", "types", 1, std::vector<std::uint8_t>(n, kPolyhedron));
  append_array(out, "Int64", "faces", 1, faces);
  append_array(out, "Int64", "faceoffsets", 1, face_offsets);
  out += "</Cells>\n<CellData>\n";
  append_array(out, "UInt32", "cell", 1, mesh.cells);
  append_array(out, "UInt32", "tet", 1, mesh.tets);
  return out + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

}  // namespace bisector::io
