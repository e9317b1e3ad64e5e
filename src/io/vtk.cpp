// VTK's unstructured grids: legacy files, ASCII and binary, and XML files (VTK file formats, docs.vtk.org).
#include <zlib.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include "io/tet_formats.h"

namespace bisector::io {

namespace {

constexpr int kVertex = 1, kPolyVertex = 2, kLine = 3, kPolyLine = 4, kTriangle = 5, kTetrahedron = 10;

// Arrays that mark cells, the first that is there counts.
constexpr const char* kRegionNames[] = {"region",           "label",         "medit:ref", "gmsh:physical",
                                        "gmsh:geometrical", "CellEntityIds", "material"};
constexpr const char* kLabelNames[] = {"label", "medit:ref", "gmsh:physical", "gmsh:geometrical", "CellEntityIds"};

struct VtkGrid {
  std::vector<Vec3> points;
  std::vector<std::int64_t> offsets, connectivity;  // cell i: connectivity[offsets[i] .. offsets[i + 1])
  std::vector<std::int64_t> types;
  std::map<std::string, std::vector<double>> cell_data, point_data;  // arrays of one component
};

std::vector<std::int32_t> marks_of(const std::string& path, const std::string& name, const std::vector<double>& values,
                                   const std::vector<std::size_t>& cells) {
  std::vector<std::int32_t> marks;
  for (const std::size_t i : cells) {
    const double x = values[i];
    if (!(x >= -0x1p31 && x < 0x1p31 && x == std::floor(x)))
      fail(path, fmt::format("cell {}: {} in '{}' is not an integer of 32 bits; mend it", i, x, name));
    marks.push_back(static_cast<std::int32_t>(x));
  }
  return marks;
}

template <std::size_t N>
std::vector<std::int32_t> find_marks(const std::string& path, const VtkGrid& grid, const char* const (&names)[N],
                                     const std::vector<std::size_t>& cells) {
  if (cells.empty()) return {};
  for (const char* name : names)
    if (const auto found = grid.cell_data.find(name); found != grid.cell_data.end())
      return marks_of(path, name, found->second, cells);
  return {};
}

TetSoup to_soup(const std::string& path, VtkGrid grid) {
  const std::size_t n = grid.types.size();
  if (grid.offsets.size() != n + 1)
    fail(path, fmt::format("there are {} cells, but {} types; {}", grid.offsets.empty() ? 0 : grid.offsets.size() - 1,
                           n, kExportAgain));
  TetSoup soup;
  std::vector<std::size_t> tets, triangles;
  const auto corner = [&](std::size_t cell, std::int64_t at) {
    const std::int64_t v = grid.connectivity[static_cast<std::size_t>(at)];
    if (v < 0 || v >= static_cast<std::int64_t>(grid.points.size()))
      fail_index(path, "cell", cell, v, grid.points.size());
    return static_cast<Index>(v);
  };
  for (std::size_t i = 0; i < n; ++i) {
    const std::int64_t first = grid.offsets[i], last = grid.offsets[i + 1], type = grid.types[i];
    if (first < 0 || last < first || last > static_cast<std::int64_t>(grid.connectivity.size()))
      fail(path, fmt::format("cell {}: its offsets {} and {} are out of range; {}", i, first, last, kExportAgain));
    const auto need = [&](std::int64_t corners) {
      if (last - first != corners)
        fail(path, fmt::format("cell {}: it has {} vertices where its type {} has {}; {}", i, last - first, type,
                               corners, kExportAgain));
    };
    if (type == kTetrahedron) {
      need(4);
      soup.tets.push_back({corner(i, first), corner(i, first + 1), corner(i, first + 2), corner(i, first + 3)});
      tets.push_back(i);
    } else if (type == kTriangle) {
      need(3);
      soup.triangles.push_back({corner(i, first), corner(i, first + 1), corner(i, first + 2)});
      triangles.push_back(i);
    } else if (type == kLine || type == kPolyLine) {
      for (std::int64_t k = first; k + 1 < last; ++k) soup.edges.push_back({corner(i, k), corner(i, k + 1)});
    } else if (type != kVertex && type != kPolyVertex) {
      fail(path, fmt::format("cell {}: its type is {}; {}", i, type, kLinearOnly));
    }
  }
  for (const auto& [name, values] : grid.cell_data)
    if (values.size() != n)
      fail(path, fmt::format("the cell data '{}' has {} values for {} cells; {}", printable(name), values.size(), n,
                             kExportAgain));
  soup.regions = find_marks(path, grid, kRegionNames, tets);
  soup.labels = find_marks(path, grid, kLabelNames, triangles);
  soup.vertices = std::move(grid.points);
  return soup;
}

std::vector<double> attribute_of(const std::string& path, VtkGrid grid, const std::string& name) {
  const auto found = grid.point_data.find(name);
  if (found == grid.point_data.end()) {
    std::string known;
    for (const auto& [other, values] : grid.point_data) known += (known.empty() ? "" : ", ") + printable(other);
    fail(path, fmt::format("there is no scalar point data '{}'; {}", printable(name),
                           known.empty() ? "the file has none" : "use one of " + known));
  }
  if (found->second.size() != grid.points.size())
    fail(path, fmt::format("the point data '{}' has {} values for {} points; {}", printable(name), found->second.size(),
                           grid.points.size(), kExportAgain));
  for (std::size_t i = 0; i < found->second.size(); ++i)
    if (!std::isfinite(found->second[i]))
      fail(path, fmt::format("vertex {}: '{}' is not finite; mend the value", i, printable(name)));
  return std::move(found->second);
}

// Numbers that should be integers; -1, which no index is, for those beyond 2^53.
std::vector<std::int64_t> integers(const std::vector<double>& values) {
  std::vector<std::int64_t> result;
  result.reserve(values.size());
  for (const double x : values) result.push_back(std::abs(x) < 0x1p53 ? static_cast<std::int64_t>(x) : -1);
  return result;
}

// --- legacy files ---

bool same_word(std::string_view a, std::string_view upper) {
  return std::equal(a.begin(), a.end(), upper.begin(), upper.end(),
                    [](char x, char y) { return (x >= 'a' && x <= 'z' ? static_cast<char>(x - 'a' + 'A') : x) == y; });
}

bool is_one_of(std::string_view a, std::initializer_list<std::string_view> words) {
  return std::any_of(words.begin(), words.end(), [a](std::string_view word) { return same_word(a, word); });
}

class LegacyReader {
 public:
  LegacyReader(const std::string& path, std::string_view bytes) : in_(path, bytes) {}

  VtkGrid read() {
    read_header();
    std::size_t cells = 0, items = 0;
    std::map<std::string, std::vector<double>>* data = nullptr;
    for (std::string_view word = in_.word(); !word.empty(); word = in_.word()) {
      if (same_word(word, "POINTS")) {
        const std::size_t n = in_.count("points");
        const std::string_view type = in_.need_word("the type of points");
        const std::vector<double> values = read_array(n, 3, type);
        for (std::size_t i = 0; i < n; ++i) {
          grid_.points.push_back({values[3 * i], values[3 * i + 1], values[3 * i + 2]});
          for (int k = 0; k < 3; ++k)
            if (const char* flaw = coordinate_flaw(grid_.points[i][k])) in_.fail(fmt::format("vertex {}: {}", i, flaw));
        }
      } else if (same_word(word, "CELLS")) {
        cells = read_cells();
      } else if (same_word(word, "CELL_TYPES")) {
        const std::size_t n = in_.count("cell types");
        grid_.types = integers(read_array(n, 1, "int"));
      } else if (same_word(word, "CELL_DATA") || same_word(word, "POINT_DATA")) {
        items = in_.count("values");
        data = same_word(word, "CELL_DATA") ? &grid_.cell_data : &grid_.point_data;
        const std::size_t expected = data == &grid_.cell_data ? cells : grid_.points.size();
        if (items != expected)
          in_.fail(fmt::format("there are data of {} items, but {} items; {}", items, expected, kExportAgain));
      } else if (same_word(word, "FIELD")) {
        read_field(data);
      } else if (same_word(word, "METADATA")) {
        in_.line();
        while (in_.remaining() > 0 && !in_.line().empty()) {
        }
      } else if (data) {
        read_attribute(word, items, *data);
      } else {
        in_.fail("'" + printable(word) + "' is not known here; " + kExportAgain);
      }
    }
    if (grid_.types.empty() || grid_.points.empty())
      in_.fail(std::string("there are no points or no cells; ") + kExportAgain);
    return std::move(grid_);
  }

 private:
  void read_header() {
    if (!in_.line().starts_with("# vtk DataFile Version"))
      in_.fail(std::string("a VTK file starts with '# vtk DataFile'; ") + kExportAgain);
    in_.line();
    const std::string_view form = in_.need_word("ASCII or BINARY");
    if (same_word(form, "BINARY")) binary_ = true;
    else if (!same_word(form, "ASCII"))
      in_.fail("'" + printable(form) + "' is neither ASCII nor BINARY; " + kExportAgain);
    in_.big_endian = true;
    if (!same_word(in_.need_word("DATASET"), "DATASET")) in_.fail(std::string("DATASET is missing; ") + kExportAgain);
    const std::string_view kind = in_.need_word("the kind of data set");
    if (!same_word(kind, "UNSTRUCTURED_GRID"))
      in_.fail("'" + printable(kind) + "' is not read; save as UNSTRUCTURED_GRID");
  }

  template <class T>
  std::vector<double> read_values(std::size_t n, std::size_t components) {
    in_.need_room(n, std::max<std::size_t>(1, components), sizeof(T), "items");
    std::vector<double> values(n * components);
    for (double& x : values) {
      if constexpr (sizeof(T) == 1) x = in_.binary ? static_cast<double>(in_.value<T>()) : in_.value<double>();
      else x = static_cast<double>(in_.value<T>());
    }
    return values;
  }

  std::vector<double> read_array(std::size_t n, std::size_t components, std::string_view type) {
    if (components > in_.remaining()) in_.fail(std::string("the number of components is too large; ") + kExportAgain);
    if (binary_) {
      in_.line();
      in_.binary = true;
    }
    std::vector<double> values;
    if (same_word(type, "DOUBLE")) values = read_values<double>(n, components);
    else if (same_word(type, "FLOAT"))
      values = binary_ ? read_values<float>(n, components) : read_values<double>(n, components);
    else if (is_one_of(type, {"INT", "VTKTYPEINT32"}) || (same_word(type, "VTKIDTYPE") && binary_))
      values = read_values<std::int32_t>(n, components);
    else if (is_one_of(type, {"UNSIGNED_INT", "VTKTYPEUINT32"})) values = read_values<std::uint32_t>(n, components);
    else if (is_one_of(type, {"LONG", "VTKTYPEINT64", "VTKIDTYPE"})) values = read_values<std::int64_t>(n, components);
    else if (is_one_of(type, {"UNSIGNED_LONG", "VTKTYPEUINT64"})) values = read_values<std::uint64_t>(n, components);
    else if (is_one_of(type, {"SHORT", "VTKTYPEINT16"})) values = read_values<std::int16_t>(n, components);
    else if (is_one_of(type, {"UNSIGNED_SHORT", "VTKTYPEUINT16"})) values = read_values<std::uint16_t>(n, components);
    else if (is_one_of(type, {"CHAR", "VTKTYPEINT8"})) values = read_values<std::int8_t>(n, components);
    else if (is_one_of(type, {"UNSIGNED_CHAR", "VTKTYPEUINT8"})) values = read_values<std::uint8_t>(n, components);
    else in_.fail("the type '" + printable(type) + "' is not read; save as double or int");
    in_.binary = false;
    return values;
  }

  // Returns the number of cells.
  std::size_t read_cells() {
    const std::size_t n = in_.count("cells"), size = in_.count("indices");
    const char* here = in_.position();
    const std::string_view next = in_.word();
    if (same_word(next, "OFFSETS")) {  // version 5: n is the number of offsets
      grid_.offsets = integers(read_array(n, 1, in_.need_word("the type of offsets")));
      if (!same_word(in_.need_word("CONNECTIVITY"), "CONNECTIVITY"))
        in_.fail(std::string("CONNECTIVITY is missing; ") + kExportAgain);
      grid_.connectivity = integers(read_array(size, 1, in_.need_word("the type of indices")));
      return n == 0 ? 0 : n - 1;
    }
    in_.seek(here);
    const std::vector<std::int64_t> rows = integers(read_array(size, 1, "int"));
    grid_.offsets.push_back(0);
    std::size_t at = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (at >= rows.size() || rows[at] < 0 || rows[at] > static_cast<std::int64_t>(rows.size() - at - 1))
        in_.fail(fmt::format("cell {} goes beyond the {} numbers declared; {}", i, size, kExportAgain));
      const std::size_t corners = static_cast<std::size_t>(rows[at++]);
      grid_.connectivity.insert(grid_.connectivity.end(), rows.begin() + static_cast<std::ptrdiff_t>(at),
                                rows.begin() + static_cast<std::ptrdiff_t>(at + corners));
      at += corners;
      grid_.offsets.push_back(static_cast<std::int64_t>(grid_.connectivity.size()));
    }
    return n;
  }

  static std::string decoded(std::string_view name) {
    std::string text;
    for (std::size_t i = 0; i < name.size(); ++i) {
      int code = 0;
      if (name[i] == '%' && i + 2 < name.size() &&
          std::from_chars(name.data() + i + 1, name.data() + i + 3, code, 16).ptr == name.data() + i + 3) {
        text += static_cast<char>(code);
        i += 2;
      } else {
        text += name[i];
      }
    }
    return text;
  }

  void read_field(std::map<std::string, std::vector<double>>* data) {
    in_.need_word("the field's name");
    const std::size_t arrays = in_.count("arrays");
    for (std::size_t a = 0; a < arrays; ++a) {
      std::string_view name = in_.need_word("an array's name");
      if (same_word(name, "METADATA")) {
        in_.line();
        while (in_.remaining() > 0 && !in_.line().empty()) {
        }
        name = in_.need_word("an array's name");
      }
      const std::size_t components = in_.count("components"), n = in_.count("tuples");
      std::vector<double> values = read_array(n, components, in_.need_word("the type of an array"));
      if (data && components == 1) (*data)[decoded(name)] = std::move(values);
    }
  }

  void read_attribute(std::string_view kind, std::size_t n, std::map<std::string, std::vector<double>>& data) {
    const std::string name = decoded(in_.need_word("an array's name"));
    if (same_word(kind, "SCALARS")) {
      const std::string_view type = in_.need_word("the type of scalars");
      std::size_t components = 1;
      std::string_view next = in_.need_word("LOOKUP_TABLE");
      if (!same_word(next, "LOOKUP_TABLE")) {
        components = static_cast<std::size_t>(parse_integer(next, [this](const std::string& flaw) { in_.fail(flaw); }));
        if (components < 1 || components > 9) in_.fail(std::string("scalars have 1 to 4 components; ") + kExportAgain);
        next = in_.need_word("LOOKUP_TABLE");
      }
      if (!same_word(next, "LOOKUP_TABLE")) in_.fail(std::string("LOOKUP_TABLE is missing; ") + kExportAgain);
      in_.need_word("the table's name");
      std::vector<double> values = read_array(n, components, type);
      if (components == 1) data[name] = std::move(values);
    } else if (same_word(kind, "VECTORS") || same_word(kind, "NORMALS")) {
      read_array(n, 3, in_.need_word("the type of vectors"));
    } else if (same_word(kind, "TENSORS")) {
      read_array(n, 9, in_.need_word("the type of tensors"));
    } else if (same_word(kind, "TEXTURE_COORDINATES")) {
      const std::size_t components = in_.count("components");
      read_array(n, components, in_.need_word("the type of coordinates"));
    } else if (same_word(kind, "COLOR_SCALARS")) {
      const std::size_t components = in_.count("components");
      read_array(n, components, binary_ ? "unsigned_char" : "float");
    } else if (same_word(kind, "LOOKUP_TABLE")) {
      const std::size_t colours = in_.count("colours");
      read_array(colours, 4, binary_ ? "unsigned_char" : "float");
    } else {
      in_.fail("'" + printable(kind) + "' is not known here; " + kExportAgain);
    }
  }

  MixedReader in_;
  bool binary_ = false;
  VtkGrid grid_;
};

// --- XML files ---

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

struct Tag {
  std::string_view name;  // "/X" of an end
  std::map<std::string_view, std::string_view> attributes;
  bool closed = false;  // "<X/>"

  std::string_view operator[](std::string_view key) const {
    const auto found = attributes.find(key);
    return found == attributes.end() ? std::string_view{} : found->second;
  }
};

class VtuReader {
 public:
  VtuReader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  VtkGrid read() {
    find_appended();
    Section section = Section::none;
    bool grid = false, piece = false;
    Tag tag;
    while (next_tag(tag)) {
      if (tag.name == "VTKFile") read_head(tag);
      else if (tag.name == "UnstructuredGrid") grid = true;
      else if (tag.name == "Piece") {
        if (piece) fail(path_, "there are several pieces; merge them");
        piece = true;
        points_ = number(tag, "NumberOfPoints");
        cells_ = number(tag, "NumberOfCells");
      } else if (tag.name == "Points") section = Section::points;
      else if (tag.name == "Cells") section = Section::cells;
      else if (tag.name == "PointData") section = Section::point_data;
      else if (tag.name == "CellData") section = Section::cell_data;
      else if (tag.name == "/Points" || tag.name == "/Cells" || tag.name == "/PointData" || tag.name == "/CellData" ||
               tag.name == "/Piece")
        section = Section::none;
      else if (tag.name == "DataArray" && section != Section::none) take_array(tag, section);
    }
    if (!grid) fail(path_, "there is no UnstructuredGrid; save as an unstructured grid (.vtu)");
    if (!piece || grid_.points.empty() || grid_.types.empty())
      fail(path_, std::string("there are no points or no cells; the file is empty or truncated, ") + kExportAgain);
    return std::move(grid_);
  }

 private:
  enum class Section { none, points, cells, point_data, cell_data };

  // Reads an array of a section into the grid; what is not known is passed over.
  void take_array(const Tag& tag, Section section) {
    const std::string name(tag["Name"]);
    const std::size_t components = tag["NumberOfComponents"].empty() ? 1 : number(tag, "NumberOfComponents");
    if (section == Section::points) {
      take_points(read_array(tag, 3, points_));
    } else if (section == Section::cells && name == "types") {
      grid_.types = integers(read_array(tag, 1, cells_));
    } else if (section == Section::cells && name == "offsets") {
      grid_.offsets = integers(read_array(tag, 1, cells_));
      grid_.offsets.insert(grid_.offsets.begin(), 0);
    } else if (section == Section::cells && name == "connectivity") {
      grid_.connectivity = integers(read_array(tag, 1, std::nullopt));
    } else if (section == Section::point_data && components <= 1) {
      grid_.point_data[name] = read_array(tag, 1, points_);
    } else if (section == Section::cell_data && components <= 1) {
      grid_.cell_data[name] = read_array(tag, 1, cells_);
    }
  }

  // Raw data may hold anything, so tags are looked for before them only.
  void find_appended() {
    const std::size_t start = bytes_.find("<AppendedData");
    markup_ = bytes_.substr(0, start);
    if (start == std::string_view::npos) return;
    const std::size_t end = bytes_.find('>', start), mark = bytes_.find('_', end);
    if (end == std::string_view::npos || mark == std::string_view::npos)
      fail(path_, std::string("the appended data have no start; the file is truncated, ") + kExportAgain);
    appended_base64_ = bytes_.substr(start, end - start).find("base64") != std::string_view::npos;
    appended_ = bytes_.substr(mark + 1);
    if (const std::size_t close = appended_.rfind("</AppendedData"); close != std::string_view::npos)
      appended_ = appended_.substr(0, close);
  }

  bool next_tag(Tag& tag) {
    for (;;) {
      const std::size_t open = markup_.find('<', at_);
      if (open == std::string_view::npos) return false;
      if (markup_.substr(open).starts_with("<!--")) {
        const std::size_t end = markup_.find("-->", open);
        if (end == std::string_view::npos) return false;
        at_ = end + 3;
        continue;
      }
      const std::size_t close = markup_.find('>', open);
      if (close == std::string_view::npos)
        fail(path_, std::string("a tag has no end; the file is truncated, ") + kExportAgain);
      at_ = close + 1;
      parse_tag(markup_.substr(open + 1, close - open - 1), tag);
      return true;
    }
  }
  static void parse_tag(std::string_view text, Tag& tag) {
    constexpr std::string_view kBlank = " \t\r\n";
    tag = {};
    tag.closed = text.ends_with('/');
    if (tag.closed) text.remove_suffix(1);
    const std::size_t name_end = std::min(text.find_first_of(kBlank), text.size());
    tag.name = text.substr(0, name_end);
    std::size_t at = name_end;
    for (;;) {
      const std::size_t start = text.find_first_not_of(kBlank, at), equals = text.find('=', start);
      if (start == std::string_view::npos || equals == std::string_view::npos) return;
      const std::size_t open = text.find_first_of("\"'", equals);
      if (open == std::string_view::npos) return;
      const std::size_t close = text.find(text[open], open + 1);
      if (close == std::string_view::npos) return;
      const std::size_t key_end = text.find_last_not_of(kBlank, equals - 1);
      tag.attributes[text.substr(start, key_end - start + 1)] = text.substr(open + 1, close - open - 1);
      at = close + 1;
    }
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
      const std::size_t end = tag.closed ? at_ : std::min(markup_.find('<', at_), markup_.size());
      MixedReader in(path_, markup_.substr(at_, end - at_));
      for (std::string_view word = in.word(); !word.empty(); word = in.word())
        values.push_back(parse_number(word, [&](const std::string& what) {
          fail(path_, fmt::format("the array '{}': {}", printable(tag["Name"]), what));
        }));
    } else if (form == "binary" || form == "appended") {
      std::string_view text;
      if (form == "binary") {
        const std::size_t end = std::min(markup_.find('<', at_), markup_.size());
        text = markup_.substr(at_, end - at_);
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
      grid_.points.push_back({values[3 * i], values[3 * i + 1], values[3 * i + 2]});
      for (int k = 0; k < 3; ++k)
        if (const char* flaw = coordinate_flaw(grid_.points[i][k])) fail(path_, fmt::format("vertex {}: {}", i, flaw));
    }
  }

  const std::string& path_;
  std::string_view bytes_, markup_, appended_;
  std::size_t at_ = 0;
  bool appended_base64_ = false, big_endian_ = false, wide_header_ = false, compressed_ = false;
  std::size_t points_ = 0, cells_ = 0;
  VtkGrid grid_;
};

// --- writing ---

void append_base64(std::string& out, const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u;
    };
    const unsigned bits = byte(0) << 16 | byte(1) << 8 | byte(2);
    const std::size_t left = bytes.size() - i;
    out += kDigits[bits >> 18];
    out += kDigits[bits >> 12 & 63];
    out += left > 1 ? kDigits[bits >> 6 & 63] : '=';
    out += left > 2 ? kDigits[bits & 63] : '=';
  }
}

template <class T>
void append_array(std::string& out, const char* type, const char* name, int components, const std::vector<T>& values) {
  // meshio takes an explicit 1 for a matrix of one column.
  const std::string shape = components == 1 ? "" : fmt::format(" NumberOfComponents=\"{}\"", components);
  fmt::format_to(std::back_inserter(out), "<DataArray type=\"{}\" Name=\"{}\"{} format=\"binary\">\n", type, name,
                 shape);
  std::string bytes;
  bytes.reserve(8 + sizeof(T) * values.size());
  append_bytes(bytes, static_cast<std::uint64_t>(sizeof(T) * values.size()));
  for (const T x : values) append_bytes(bytes, x);
  append_base64(out, bytes);
  out += "\n</DataArray>\n";
}

}  // namespace

TetSoup read_vtk(const std::string& path, std::string_view bytes) {
  return to_soup(path, LegacyReader(path, bytes).read());
}

TetSoup read_vtu(const std::string& path, std::string_view bytes) {
  return to_soup(path, VtuReader(path, bytes).read());
}

std::vector<double> read_vtk_attribute(const std::string& path, std::string_view bytes, const std::string& name) {
  return attribute_of(path, LegacyReader(path, bytes).read(), name);
}

std::vector<double> read_vtu_attribute(const std::string& path, std::string_view bytes, const std::string& name) {
  return attribute_of(path, VtuReader(path, bytes).read(), name);
}

std::string format_vtu(const TetMesh& mesh) {
  const std::size_t cells = mesh.tets.size() + mesh.boundary.size() + mesh.feature_edges.size();
  std::vector<double> points;
  for (const Vec3& p : mesh.vertices)
    for (int k = 0; k < 3; ++k) points.push_back(p[k]);
  std::vector<std::int64_t> connectivity, offsets;
  std::vector<std::uint8_t> types;
  const auto append = [&](const auto& elements, int type) {
    for (const auto& element : elements) {
      connectivity.insert(connectivity.end(), element.begin(), element.end());
      offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
      types.push_back(static_cast<std::uint8_t>(type));
    }
  };
  append(mesh.tets, kTetrahedron);
  append(mesh.boundary, kTriangle);
  append(mesh.feature_edges, kLine);

  std::string out = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>\n",
      mesh.vertices.size(), cells);
  append_array(out, "Float64", "Points", 3, points);
  out += "</Points>\n<Cells>\n";
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
  return out + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

}  // namespace bisector::io
