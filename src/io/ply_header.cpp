#include "io/ply_header.h"

#include <array>
#include <cstdint>
#include <utility>

#include "io/bytes.h"

namespace bisector::io {

std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

double load_scalar(Scalar type, const char* bytes, bool big_endian) {
  switch (type) {
    case Scalar::int8: return load<std::int8_t>(bytes, big_endian);
    case Scalar::uint8: return load<std::uint8_t>(bytes, big_endian);
    case Scalar::int16: return load<std::int16_t>(bytes, big_endian);
    case Scalar::uint16: return load<std::uint16_t>(bytes, big_endian);
    case Scalar::int32: return load<std::int32_t>(bytes, big_endian);
    case Scalar::uint32: return load<std::uint32_t>(bytes, big_endian);
    case Scalar::float32: return load<float>(bytes, big_endian);
    case Scalar::float64: return load<double>(bytes, big_endian);
  }
  return 0;
}

namespace {

Scalar read_scalar_type(TextReader& in) {
  static constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames{{{"char", Scalar::int8},
                                                                               {"int8", Scalar::int8},
                                                                               {"uchar", Scalar::uint8},
                                                                               {"uint8", Scalar::uint8},
                                                                               {"short", Scalar::int16},
                                                                               {"int16", Scalar::int16},
                                                                               {"ushort", Scalar::uint16},
                                                                               {"uint16", Scalar::uint16},
                                                                               {"int", Scalar::int32},
                                                                               {"int32", Scalar::int32},
                                                                               {"uint", Scalar::uint32},
                                                                               {"uint32", Scalar::uint32},
                                                                               {"float", Scalar::float32},
                                                                               {"float32", Scalar::float32},
                                                                               {"double", Scalar::float64},
                                                                               {"float64", Scalar::float64}}};
  const std::string_view word = in.word();
  for (const auto& [name, type] : kNames)
    if (word == name) return type;
  in.fail("'" + printable(word) + "' is not a PLY type; " + kExportAgain);
}

PlyProperty read_ply_property(TextReader& in) {
  PlyProperty property{};
  TextReader ahead = in;
  if (ahead.word() == "list") {
    in.word();
    property.list = true;
    property.count_type = read_scalar_type(in);
    if (property.count_type >= Scalar::float32) in.fail(std::string("a list is counted by floats; ") + kExportAgain);
  }
  property.type = read_scalar_type(in);
  property.name = in.word();
  if (property.name.empty()) in.fail(std::string("a property has no name; ") + kExportAgain);
  return property;
}

}  // namespace

PlyHeader read_ply_header(TextReader& in) {
  PlyHeader header;
  if (!in.next_line() || in.word() != "ply") in.fail("does not begin with 'ply'; check that this is a PLY file");
  bool format = false;
  for (;;) {
    if (!in.next_line()) in.fail_truncated("a part of the header");
    const std::string_view keyword = in.word();
    if (keyword == "end_header") break;
    if (keyword == "comment" && in.word() == "TextureFile" && in.at_word())
      header.textures.emplace_back(in.rest_of_line());
    if (keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "format") {
      const std::string_view name = in.word();
      header.text = name == "ascii";
      header.big_endian = name == "binary_big_endian";
      if (!header.text && !header.big_endian && name != "binary_little_endian")
        in.fail("unknown PLY format '" + printable(name) + "'; " + kExportAgain);
      format = true;
    } else if (keyword == "element") {
      PlyElement element;
      element.name = in.word();
      if (header.find(element.name))
        in.fail("element '" + printable(element.name) + "' appears twice; " + kExportAgain);
      element.count = in.count("items");
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (header.elements.empty()) in.fail(std::string("a property comes before all elements; ") + kExportAgain);
      header.elements.back().properties.push_back(read_ply_property(in));
    } else if (!header.elements.empty()) {  // some programs name themselves above without "comment"
      in.fail("unknown header line '" + printable(keyword) + "'; " + kExportAgain);
    }
  }
  if (!format) in.fail(std::string("the header has no format line; ") + kExportAgain);
  return header;
}

}  // namespace bisector::io
