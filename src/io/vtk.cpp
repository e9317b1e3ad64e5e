// VTK's legacy files with unstructured grids, ASCII and binary (VTK file formats, docs.vtk.org).
#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <utility>

#include "io/vtk_grid.h"

namespace bisector::io {

namespace {

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
    std::size_t items = 0;
    VtkArrays* data = nullptr;
    for (std::string_view word = in_.word(); !word.empty(); word = in_.word()) {
      if (same_word(word, "POINTS")) {
        if (!grid_.points.empty()) fail_twice(word);
        const std::size_t n = in_.count("points");
        const std::string_view type = in_.need_word("the type of points");
        const std::vector<double> values = read_array(n, 3, type);
        for (std::size_t i = 0; i < n; ++i) {
          grid_.points.push_back({values[3 * i], values[3 * i + 1], values[3 * i + 2]});
          for (int k = 0; k < 3; ++k)
            if (const char* flaw = coordinate_flaw(grid_.points[i][k])) in_.fail(fmt::format("vertex {}: {}", i, flaw));
        }
      } else if (same_word(word, "CELLS")) {
        if (cells_ > 0) fail_twice(word);
        cells_ = read_cells();
      } else if (same_word(word, "CELL_TYPES")) {
        if (!grid_.types.empty()) fail_twice(word);
        const std::size_t n = in_.count("cell types");
        grid_.types = integers(read_array(n, 1, "int"));
      } else if (same_word(word, "CELL_DATA") || same_word(word, "POINT_DATA")) {
        items = in_.count("values");
        data = same_word(word, "CELL_DATA") ? &grid_.cell_data : &grid_.point_data;
        const std::size_t expected = data == &grid_.cell_data ? cells_ : grid_.points.size();
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
  [[noreturn]] void fail_twice(std::string_view word) const {
    in_.fail("'" + printable(word) + "' occurs twice; " + kExportAgain);
  }
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

  static Attribute::Type type_of(std::string_view type) {
    using Type = Attribute::Type;
    if (same_word(type, "FLOAT")) return Type::float32;
    if (is_one_of(type, {"INT", "VTKTYPEINT32"})) return Type::int32;
    if (is_one_of(type, {"UNSIGNED_INT", "VTKTYPEUINT32"})) return Type::uint32;
    if (is_one_of(type, {"LONG", "VTKTYPEINT64", "VTKIDTYPE"})) return Type::int64;
    if (is_one_of(type, {"UNSIGNED_LONG", "VTKTYPEUINT64"})) return Type::uint64;
    if (is_one_of(type, {"SHORT", "VTKTYPEINT16"})) return Type::int16;
    if (is_one_of(type, {"UNSIGNED_SHORT", "VTKTYPEUINT16"})) return Type::uint16;
    if (is_one_of(type, {"CHAR", "VTKTYPEINT8"})) return Type::int8;
    if (is_one_of(type, {"UNSIGNED_CHAR", "VTKTYPEUINT8"})) return Type::uint8;
    return Type::float64;
  }

  // What an attribute of the current data is: its numbers follow.
  void put(VtkArrays& data, std::string name, std::size_t n, std::size_t components, std::string_view type) {
    const Attribute::Type own = type_of(type);
    put_array(data, {std::move(name), Attribute::Site::vertex, own, components, read_array(n, components, type)});
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
      grid_.cells.offsets = integers(read_array(n, 1, in_.need_word("the type of offsets")));
      if (!same_word(in_.need_word("CONNECTIVITY"), "CONNECTIVITY"))
        in_.fail(std::string("CONNECTIVITY is missing; ") + kExportAgain);
      grid_.cells.connectivity = integers(read_array(size, 1, in_.need_word("the type of indices")));
      return n == 0 ? 0 : n - 1;
    }
    in_.seek(here);
    const std::vector<std::int64_t> rows = integers(read_array(size, 1, "int"));
    grid_.cells.offsets.push_back(0);
    std::size_t at = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (at >= rows.size() || rows[at] < 0 || rows[at] > static_cast<std::int64_t>(rows.size() - at - 1))
        in_.fail(fmt::format("cell {} goes beyond the {} numbers declared; {}", i, size, kExportAgain));
      const std::size_t corners = static_cast<std::size_t>(rows[at++]);
      grid_.cells.connectivity.insert(grid_.cells.connectivity.end(), rows.begin() + static_cast<std::ptrdiff_t>(at),
                                      rows.begin() + static_cast<std::ptrdiff_t>(at + corners));
      at += corners;
      grid_.cells.offsets.push_back(static_cast<std::int64_t>(grid_.cells.connectivity.size()));
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

  void read_field(VtkArrays* data) {
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
      const std::string_view type = in_.need_word("the type of an array");
      const std::size_t items = data == &grid_.point_data ? grid_.points.size() : cells_;
      if (data && components > 0 && n == items) put(*data, decoded(name), n, components, type);
      else read_array(n, components, type);
    }
  }

  void read_attribute(std::string_view kind, std::size_t n, VtkArrays& data) {
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
      put(data, name, n, components, type);
    } else if (same_word(kind, "VECTORS") || same_word(kind, "NORMALS")) {
      put(data, name, n, 3, in_.need_word("the type of vectors"));
    } else if (same_word(kind, "TENSORS")) {
      put(data, name, n, 9, in_.need_word("the type of tensors"));
    } else if (same_word(kind, "TEXTURE_COORDINATES")) {
      const std::size_t components = in_.count("components");
      put(data, name, n, components, in_.need_word("the type of coordinates"));
    } else if (same_word(kind, "COLOR_SCALARS")) {
      const std::size_t components = in_.count("components");
      put(data, name, n, components, binary_ ? "unsigned_char" : "float");
    } else if (same_word(kind, "LOOKUP_TABLE")) {
      const std::size_t colours = in_.count("colours");
      read_array(colours, 4, binary_ ? "unsigned_char" : "float");
    } else {
      in_.fail("'" + printable(kind) + "' is not known here; " + kExportAgain);
    }
  }

  MixedReader in_;
  bool binary_ = false;
  std::size_t cells_ = 0;
  VtkGrid grid_;
};

}  // namespace

TetSoup read_vtk(const std::string& path, std::string_view bytes) {
  return soup_of_grid(path, LegacyReader(path, bytes).read());
}

std::vector<double> read_vtk_attribute(const std::string& path, std::string_view bytes, const std::string& name) {
  VtkGrid grid = LegacyReader(path, bytes).read();
  return point_data_of(path, std::move(grid.point_data), grid.points.size(), name);
}

}  // namespace bisector::io
