// Attributes as files name and hold them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/attributes.h"
#include "bisector/mesh.h"
#include "io/mesh_formats.h"

namespace bisector::io {

// Properties of one element that a file has by single names, put together: red, green, blue and alpha are `color`, nx,
// ny, nz `normal`, pairs of texture coordinates `texcoord`, and NAME_0, NAME_1, ... NAME. A file's names stay
// otherwise.
class AttributeColumns {
 public:
  explicit AttributeColumns(Attribute::Site site) : site_(site) {}

  // The next property; a name that was there before is none.
  void add(const std::string& name, Attribute::Type type);
  // A property that is no attribute, so that those beside it do not belong together.
  void skip() { columns_.push_back({}); }
  // Once all are known.
  void group();

  // The number of property k of the next element; elements come in their order, properties in any.
  void set(std::size_t k, double value) {
    const Column& column = columns_[k];
    if (column.attribute == kNowhere) return;
    std::vector<double>& values = attributes_[column.attribute].values;
    const std::size_t components = attributes_[column.attribute].components;
    if (values.size() <= components * elements_) values.resize(components * (elements_ + 1));
    values[components * elements_ + column.component] = value;
  }
  bool wants(std::size_t k) const { return columns_[k].attribute != kNowhere; }
  void end_element() { ++elements_; }

  std::vector<Attribute> take() { return std::move(attributes_); }

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  struct Column {
    std::string name;  // empty: none
    Attribute::Type type = Attribute::Type::float64;
    std::size_t attribute = kNowhere, component = 0;
  };

  bool is_run(std::size_t at, const std::vector<std::string>& names) const;
  void put_together(std::size_t at, std::size_t count, const std::string& name);

  Attribute::Site site_;
  std::vector<Column> columns_;
  std::vector<Attribute> attributes_;
  std::size_t elements_ = 0;
};

// The names of an attribute's components in a file that names each by itself; what set them together puts them together
// again.
std::vector<std::string> component_names(const Attribute& attribute);

// Red, green, blue and, if there is one, opacity of each vertex or face, 0 to 255. The attribute is one of colours.
std::vector<std::uint8_t> colour_bytes(const Attribute& attribute);

// The first attribute of a site that has a meaning, or null.
const Attribute* find_attribute(const std::vector<Attribute>& attributes, Attribute::Site site,
                                AttributeMeaning meaning);

// Whether a file of materials is one that OBJ names; others are pictures.
bool is_material_library(const std::string& file);

// Appends a number as an attribute's type has it: float32 with the digits of that.
void append_value(std::string& out, double value, Attribute::Type type);
// The bytes of a number in an attribute's type; what is out of its range becomes the nearest number that is not, NaN 0.
void append_value_bytes(std::string& out, double value, Attribute::Type type);

// Numbers of the corners of faces as indices of different ones: `index` has three for each triangle.
struct CornerTable {
  std::vector<Index> vertex;        // of each entry
  std::vector<std::size_t> corner;  // a corner that has it
  std::vector<Index> index;         // of each corner
};
// Entries are told apart by vertex and numbers; the first `vertices` of them are those of the vertices in their order,
// as some triangle has them (of vertices without any: corner 0).
CornerTable tell_corners_apart(const TriangleMesh& mesh, const Attribute& corners);

// What a file's attributes are for triangles, of which `mesh` has been made.
void split_attributes(const Soup& soup, TriangleMesh& mesh);

}  // namespace bisector::io
