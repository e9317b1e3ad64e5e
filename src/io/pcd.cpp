// PCD 0.5 to 0.7, the point clouds of PCL (Point Cloud Library).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "io/bytes.h"
#include "io/point_formats.h"
#include "io/text.h"

namespace bisector::io {

namespace {

struct Field {
  std::string name;
  char type = 'F';
  std::size_t size = 4, count = 1;

  std::size_t bytes() const { return size * count; }
};

enum class Data { text, binary, compressed };

struct Header {
  std::vector<Field> fields;
  std::size_t width = 0, height = 1, points = 0;
  bool has_width = false, has_points = false;
  Data data = Data::text;
};

std::vector<Field> read_fields(TextReader& in) {
  std::vector<Field> fields;
  while (in.at_word()) {
    Field field;
    field.name = in.word();
    fields.push_back(std::move(field));
  }
  return fields;
}

// A word for each field, given to `take`.
template <class Take>
void for_each_field(TextReader& in, Header& h, std::string_view keyword, const Take& take) {
  for (Field& field : h.fields) {
    const std::string_view word = in.word();
    if (word.empty() || !take(field, word))
      in.fail(fmt::format("{} '{}' of the field '{}' is not known; {}", keyword, printable(word), printable(field.name),
                          kExportAgain));
  }
}

bool read_size(Field& field, std::string_view word) {
  if (word != "1" && word != "2" && word != "4" && word != "8") return false;
  field.size = static_cast<std::size_t>(word[0] - '0');
  return true;
}

bool read_type(Field& field, std::string_view word) {
  field.type = word[0];
  return word == "F" || word == "I" || word == "U";
}

bool read_count(TextReader& in, Field& field, std::string_view word) {
  const std::int64_t n = in.integer(word);
  if (n < 1 || n >= kNone) return false;
  field.count = static_cast<std::size_t>(n);
  return true;
}

Data read_data(TextReader& in) {
  const std::string_view word = in.word();
  if (word == "ascii") return Data::text;
  if (word == "binary") return Data::binary;
  if (word == "binary_compressed") return Data::compressed;
  in.fail("DATA '" + printable(word) + "' is not known; use ascii, binary or binary_compressed");
}

void check_header(const TextReader& in, Header& h) {
  for (const char* axis : {"x", "y", "z"}) {
    const auto is_axis = [&](const Field& f) { return f.name == axis; };
    if (std::count_if(h.fields.begin(), h.fields.end(), is_axis) != 1)
      in.fail(fmt::format("FIELDS needs one '{}'; {}", axis, kExportAgain));
    const Field& field = *std::find_if(h.fields.begin(), h.fields.end(), is_axis);
    if (field.count != 1 || (field.type == 'F' && field.size < 4))
      in.fail(fmt::format("the field '{}' is not one number of 4 or 8 bytes, or an integer; {}", axis, kExportAgain));
  }
  if (!h.has_width && !h.has_points) in.fail(std::string("neither WIDTH nor POINTS is there; ") + kExportAgain);
  const std::size_t area = h.width * h.height;
  if (!h.has_points) h.points = area;
  if (h.has_width && h.points != area)
    in.fail(fmt::format("{} times {} points are not {}; {}", h.width, h.height, h.points, kExportAgain));
  if (h.points == 0) in.fail("there is no point at all; export the file with points");
  if (h.points >= kNone) in.fail(fmt::format("{} points are too many; split the scan", h.points));
}

// Up to the line DATA.
Header read_header(TextReader& in) {
  Header h;
  for (;;) {
    if (!in.next_line()) in.fail_truncated("a part of the header");
    const std::string_view keyword = in.word();
    if (keyword == "VERSION" || keyword == "VIEWPOINT") continue;
    if (keyword == "FIELDS" || keyword == "COLUMNS") {
      h.fields = read_fields(in);
    } else if (keyword == "SIZE") {
      for_each_field(in, h, keyword, read_size);
    } else if (keyword == "TYPE") {
      for_each_field(in, h, keyword, read_type);
    } else if (keyword == "COUNT") {
      for_each_field(in, h, keyword, [&](Field& field, std::string_view word) { return read_count(in, field, word); });
    } else if (keyword == "WIDTH") {
      h.width = in.count("points");
      h.has_width = true;
    } else if (keyword == "HEIGHT") {
      h.height = in.count("rows");
    } else if (keyword == "POINTS") {
      h.points = in.count("points");
      h.has_points = true;
    } else if (keyword == "DATA") {
      h.data = read_data(in);
      check_header(in, h);
      return h;
    } else {
      in.fail("unknown header line '" + printable(keyword) + "'; check that this is a PCD file");
    }
  }
}

// --- points ---

// Points without a return are NaN.
class Points {
 public:
  explicit Points(const std::string& path) : path_(path) {}

  void reserve(std::size_t n) { cloud_.points.reserve(n); }
  void add(const Vec3& p) {
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) {
      for (int k = 0; k < 3; ++k)
        if (const char* flaw = coordinate_flaw(p[k]))
          fail(path_, fmt::format("point {}: {}", cloud_.points.size() + lost_, flaw));
      cloud_.points.push_back(p);
    } else {
      ++lost_;
    }
  }
  PointCloud finish(const Context& context) {
    if (cloud_.points.empty()) fail(path_, "no point has coordinates, all are NaN; export the file with points");
    if (lost_ > 0)
      context.warn(
          fmt::format("{}: {} without a return (NaN) left out", name_of(path_), quantity(lost_, "point", "points")));
    return std::move(cloud_);
  }

 private:
  const std::string& path_;
  PointCloud cloud_;
  std::size_t lost_ = 0;
};

void read_text(TextReader& in, const Header& h, Points& points) {
  std::vector<int> axes;  // of the columns up to the last coordinate; -1: none
  std::vector<std::size_t> skips;
  for (const Field& f : h.fields) {
    axes.push_back(f.name == "x" ? 0 : f.name == "y" ? 1 : f.name == "z" ? 2 : -1);
    skips.push_back(f.count);
  }
  while (axes.back() < 0) axes.pop_back();
  points.reserve(std::min(h.points, in.remaining() / 6 + 1));
  for (std::size_t i = 0; i < h.points; ++i) {
    if (!in.next_line()) in.fail_truncated(fmt::format("{} of {} points", i, h.points));
    Vec3 p;
    for (std::size_t j = 0; j < axes.size(); ++j) {
      if (axes[j] >= 0) {
        p[axes[j]] = in.number();
        continue;
      }
      for (std::size_t k = 0; k < skips[j]; ++k)
        if (in.word().empty()) in.fail(std::string("the line ends early; ") + kExportAgain);
    }
    points.add(p);
  }
}

double number_at(const char* at, char type, std::size_t size) {
  switch (type) {
    case 'F': return size == 4 ? load<float>(at, false) : load<double>(at, false);
    case 'I':
      return size == 1   ? load<std::int8_t>(at, false)
             : size == 2 ? load<std::int16_t>(at, false)
             : size == 4 ? load<std::int32_t>(at, false)
                         : static_cast<double>(load<std::int64_t>(at, false));
    default:
      return size == 1   ? load<std::uint8_t>(at, false)
             : size == 2 ? load<std::uint16_t>(at, false)
             : size == 4 ? load<std::uint32_t>(at, false)
                         : static_cast<double>(load<std::uint64_t>(at, false));
  }
}

// Where a coordinate's numbers are, and how far apart.
struct Column {
  std::size_t first = 0, stride = 0, size = 0;
  char type = 'F';
};

std::array<Column, 3> find_columns(const Header& h) {
  std::array<Column, 3> columns;
  const bool by_field = h.data == Data::compressed;  // all values of a field together
  std::size_t step = 0;
  for (const Field& f : h.fields)
    if (!by_field || f.name != "_") {  // padding is not compressed
      const std::size_t axis = f.name == "x" ? 0 : f.name == "y" ? 1 : f.name == "z" ? 2 : 3;
      if (axis < 3) columns[axis] = {by_field ? step * h.points : step, f.size, f.size, f.type};
      step += f.bytes();
    }
  if (!by_field)
    for (Column& c : columns) c.stride = step;
  return columns;
}

std::size_t bytes_per_point(const Header& h) {
  std::size_t step = 0;
  for (const Field& f : h.fields)
    if (h.data != Data::compressed || f.name != "_") step += f.bytes();
  return step;
}

void read_columns(std::string_view bytes, const Header& h, Points& points) {
  const std::array<Column, 3> columns = find_columns(h);
  points.reserve(h.points);
  for (std::size_t i = 0; i < h.points; ++i) {
    Vec3 p;
    for (int k = 0; k < 3; ++k) {
      const Column& c = columns[static_cast<std::size_t>(k)];
      p[k] = number_at(bytes.data() + c.first + i * c.stride, c.type, c.size);
    }
    points.add(p);
  }
}

void read_binary(const std::string& path, std::string_view bytes, const Header& h, Points& points) {
  if (const std::size_t room = bytes.size() / bytes_per_point(h); h.points > room)
    fail(path, fmt::format("the header tells {}, the file has room for {}; it is truncated, {}",
                           quantity(h.points, "point", "points"), room, kExportAgain));
  read_columns(bytes, h, points);
}

// --- LZF ---

// Marc Lehmann's LZF: a byte below 32 precedes so many and one more bytes as they are; else its upper three bits (with
// 7, the next byte is added) and two are the length of a copy from as far back as its other bits and the next byte say.
// Gives exactly `size` bytes, or nothing if that is not what the bytes hold.
std::string decompress_lzf(std::string_view bytes, std::size_t size) {
  std::string out;
  out.reserve(size);
  std::size_t at = 0;
  const auto next = [&] { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[at++])); };
  while (at < bytes.size()) {
    const std::size_t control = next();
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > bytes.size() - at || length > size - out.size()) return {};
      out.append(bytes.substr(at, length));
      at += length;
      continue;
    }
    std::size_t length = control >> 5;
    if (bytes.size() - at < (length == 7 ? 2u : 1u)) return {};
    if (length == 7) length += next();
    length += 2;
    const std::size_t back = ((control & 31) << 8) + next() + 1;
    if (back > out.size() || length > size - out.size()) return {};
    for (std::size_t from = out.size() - back, k = 0; k < length; ++k) out += out[from + k];  // may overlap its source
  }
  return out.size() == size ? out : std::string();
}

void read_compressed(const std::string& path, std::string_view bytes, const Header& h, Points& points) {
  constexpr std::size_t kSizes = 8;     // bytes of the two sizes
  constexpr std::size_t kLargest = 88;  // times that LZF can expand: 264 bytes from 3
  const std::size_t step = bytes_per_point(h);
  if (bytes.size() < kSizes)
    fail(path, fmt::format("the file ends before its points; it is truncated, {}", kExportAgain));
  const std::size_t packed = load<std::uint32_t>(bytes.data(), false),
                    size = load<std::uint32_t>(bytes.data() + 4, false);
  if (packed > bytes.size() - kSizes)
    fail(path, fmt::format("{} bytes of compressed points are announced, {} are there; it is truncated, {}", packed,
                           bytes.size() - kSizes, kExportAgain));
  if (size / step != h.points || size % step != 0)
    fail(path, fmt::format("{} bytes of points are announced, {} of {} bytes need others; {}", size,
                           quantity(h.points, "point", "points"), step, kExportAgain));
  const std::string flat =
      size / kLargest > packed ? std::string() : decompress_lzf(bytes.substr(kSizes, packed), size);
  if (flat.empty()) fail(path, std::string("the compressed points are damaged; ") + kExportAgain);
  read_columns(flat, h, points);
}

}  // namespace

PointCloud read_pcd(const std::string& path, std::string_view bytes, const Context& context) {
  TextReader in(path, bytes, '#');
  const Header h = read_header(in);
  Points points(path);
  switch (h.data) {
    case Data::text: {
      read_text(in, h, points);
      if (const std::string ignored = count_lines_left(in); !ignored.empty())
        context.warn(fmt::format("{}: {} after the last point ignored", name_of(path), ignored));
      break;
    }
    case Data::binary: read_binary(path, in.after_line(), h, points); break;
    case Data::compressed: read_compressed(path, in.after_line(), h, points); break;
  }
  return points.finish(context);
}

}  // namespace bisector::io
