// The readers are our own because CGAL's neither tell the place of an error nor bound what they allocate by the file's
// size, and they let NaN and indices out of range through.
#include "bisector/mesh/io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "bisector/mesh/degenerate.h"

namespace bisector {

namespace {

constexpr double kLargest = 1e100;
constexpr const char* kExportAgain = "export the file again";

// --- messages ---

// For messages of one line: control characters become '?', long text is cut.
std::string printable(std::string_view text, std::size_t limit = 40) {
  std::string shown(text.substr(0, limit));
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  if (text.size() > limit) shown += "...";
  return shown;
}

std::string name_of(const std::string& path) { return printable(path, 4096); }

[[noreturn]] void fail(const std::string& path, const std::string& what) { throw Error(name_of(path) + ": " + what); }

std::string quantity(std::size_t n, const char* one, const char* many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

// What is wrong with a coordinate, or null.
const char* coordinate_flaw(double x) {
  if (!std::isfinite(x)) return "a coordinate is not finite; mend the vertex";
  if (std::abs(x) > kLargest) return "a coordinate is beyond 1e100; scale the model";
  return nullptr;
}

// --- files ---

std::string lower_extension(const std::string& path) {
  const std::size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return "";
  std::string extension = path.substr(dot);
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

[[noreturn]] void fail_extension(const std::string& path, const std::string& extension) {
  if (extension.empty()) fail(path, "no file name extension; use .off, .obj, .ply or .stl");
  fail(path, "unknown mesh format '" + printable(extension) + "'; use .off, .obj, .ply or .stl");
}

class File {
 public:
  File(const std::string& path, int flags) : descriptor_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~File() { if (is_open()) ::close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }
  bool write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  // A full disk may show only here.
  bool close() { return ::close(std::exchange(descriptor_, -1)) == 0; }

 private:
  int descriptor_;
};

std::string read_bytes(const std::string& path) {
  const File file(path, O_RDONLY);
  struct stat status {};
  if (!file.is_open() || ::fstat(file.descriptor(), &status) != 0)
    fail(path, fmt::format("cannot be opened: {}; check the name and its permissions", std::strerror(errno)));
  if (S_ISDIR(status.st_mode)) fail(path, "is a directory; name a file");
  std::string bytes;
  std::size_t size = 0;
  for (;;) {
    // One byte more than expected shows the end; a pipe does not tell its size and is read in growing pieces.
    if (size == bytes.size())
      bytes.resize(size > 0 ? 2 * size : status.st_size > 0 ? static_cast<std::size_t>(status.st_size) + 1 : 1 << 16);
    const ssize_t n = ::read(file.descriptor(), bytes.data() + size, bytes.size() - size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, fmt::format("cannot be read: {}; check the disk", std::strerror(errno)));
    if (n == 0) break;
    size += static_cast<std::size_t>(n);
  }
  bytes.resize(size);
  if (bytes.find_first_not_of(" \t\r\n") == std::string::npos)
    fail(path, std::string("the file is empty; ") + kExportAgain);
  return bytes;
}

// --- what a file holds ---

struct Soup {
  std::vector<Vec3> vertices;
  Csr<Index> faces;
  std::string ignored;  // what follows the last face, if anything does

  void end_face() { faces.offsets.push_back(faces.values.size()); }
  std::size_t open_corners() const { return faces.values.size() - faces.offsets.back(); }
};

// Words of a text, line by line, with '\n' or "\r\n" at the ends of lines.
class TextReader {
 public:
  // `comment` starts a comment anywhere in a line (0: none); with `joins`, a backslash joins a line with the next one.
  TextReader(const std::string& path, std::string_view bytes, char comment, bool joins = false)
      : path_(path), at_(bytes.data()), end_(bytes.data() + bytes.size()), comment_(comment), joins_(joins) {
    if (bytes.starts_with("\xef\xbb\xbf")) at_ += 3;
  }

  // Goes to the next line that has a word; false at the end of the file.
  bool next_line() {
    if (line_ == 0) line_ = 1;
    else skip_line();
    while (at_ != end_) {
      if (at_word()) return true;
      skip_line();
    }
    return false;
  }

  // Whether the line has another word.
  bool at_word() {
    for (; at_ != end_; ++at_) {
      if (is_blank(*at_)) continue;
      const std::size_t joint = joint_length();
      if (joint == 0) return *at_ != '\n' && !(comment_ && *at_ == comment_);
      at_ += joint - 1;
      ++line_;
    }
    return false;
  }

  // The next word of the line; empty at its end.
  std::string_view word() {
    if (!at_word()) return {};
    const char* begin = at_;
    while (at_ != end_ && !ends_word()) ++at_;
    return {begin, static_cast<std::size_t>(at_ - begin)};
  }

  double number() {
    const std::string_view text = word();
    if (text.empty()) fail(std::string("a number is missing at the end of the line; ") + kExportAgain);
    const char* begin = text.data() + (text[0] == '+' && text.size() > 1 && text[1] != '-');
    const char* end = text.data() + text.size();
    double x = 0;
    auto [stop, error] = std::from_chars(begin, end, x);
    if (error == std::errc::result_out_of_range) {  // too small is as good as zero, too large is not
      long double wide = 0;
      error = std::from_chars(begin, end, wide).ec;
      x = error == std::errc{} ? static_cast<double>(wide) : std::numeric_limits<double>::infinity();
      if (!std::isfinite(x)) fail("'" + printable(text) + "' is too large; scale the model");
    }
    if (error != std::errc{} || stop != end) fail("'" + printable(text) + "' is not a number; mend the line");
    return x;
  }

  Vec3 point() {
    Vec3 p;
    for (int k = 0; k < 3; ++k) {
      p[k] = number();
      if (const char* flaw = coordinate_flaw(p[k])) fail(flaw);
    }
    return p;
  }

  // A number of things, at most 2^32 - 2.
  std::size_t count(const char* things) {
    const std::string_view text = word();
    if (text.empty()) fail(fmt::format("the number of {} is missing; {}", things, kExportAgain));
    const std::int64_t n = integer(text);
    if (n < 0) fail(fmt::format("the number of {} is negative; {}", things, kExportAgain));
    if (n >= kNone) fail(fmt::format("'{}' are too many {}; split the model", printable(text), things));
    return static_cast<std::size_t>(n);
  }

  std::int64_t integer(std::string_view text) {
    std::int64_t n = 0;
    const char* begin = text.data() + (text.size() > 1 && text[0] == '+' && text[1] != '-');
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(begin, end, n);
    if (error == std::errc::result_out_of_range) fail("'" + printable(text) + "' is out of range; mend the line");
    if (error != std::errc{} || stop != end) fail("'" + printable(text) + "' is not an integer; mend the line");
    return n;
  }

  std::size_t remaining() const { return static_cast<std::size_t>(end_ - at_); }
  // What follows the current line.
  std::string_view after_line() {
    skip_line();
    return {at_, remaining()};
  }
  std::size_t line() const { return line_; }

  [[noreturn]] void fail(const std::string& what) const { fail_at(line_, what); }
  [[noreturn]] void fail_at(std::size_t line, const std::string& what) const {
    throw Error(fmt::format("{}:{}: {}", name_of(path_), line, what));
  }
  [[noreturn]] void fail_truncated(const std::string& got) const {
    fail(fmt::format("the file ends after {}; it is truncated, {}", got, kExportAgain));
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
  bool ends_word() const {
    return is_blank(*at_) || *at_ == '\n' || (comment_ && *at_ == comment_) || joint_length() > 0;
  }
  // Of a backslash and the line's end after it.
  std::size_t joint_length() const {
    if (!joins_ || *at_ != '\\') return 0;
    if (end_ - at_ > 1 && at_[1] == '\n') return 2;
    return end_ - at_ > 2 && at_[1] == '\r' && at_[2] == '\n' ? 3 : 0;
  }
  void skip_line() {
    bool commented = false;
    for (; at_ != end_; ++at_) {
      if (*at_ == '\n') {
        ++at_;
        ++line_;
        return;
      }
      if (comment_ && *at_ == comment_) commented = true;
      if (commented) continue;
      if (const std::size_t joint = joint_length()) {
        at_ += joint - 1;
        ++line_;
      }
    }
  }

  const std::string& path_;
  const char* at_;
  const char* end_;
  std::size_t line_ = 0;
  char comment_;
  bool joins_;
};

std::string count_lines_left(TextReader& in) {
  std::size_t lines = 0;
  while (in.next_line()) ++lines;
  return lines == 0 ? "" : quantity(lines, "line", "lines");
}

// --- OFF ---

// The header may say which columns follow the coordinates; all are ignored, so only other dimensions matter.
void check_off_header(TextReader& in, std::string_view header) {
  if (!header.ends_with("OFF") && header != "off")
    in.fail("does not begin with OFF but with '" + printable(header) + "'; check that this is an OFF file");
  const std::string_view prefix = header.substr(0, header.size() - 3);
  if (prefix.find_first_of("4n") != std::string_view::npos)
    in.fail("'" + printable(header) + "' has points of other than three coordinates; export as OFF");
}

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

// --- OBJ ---

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

// --- PLY ---

template <class T>
T load(const char* bytes, bool big_endian) {
  using Bits = std::conditional_t<sizeof(T) == 1, std::uint8_t,
                                  std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                                     std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;
  Bits bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[big_endian ? sizeof(T) - 1 - i : i]);
    bits = static_cast<Bits>(bits | static_cast<Bits>(static_cast<Bits>(byte) << (8 * i)));
  }
  return std::bit_cast<T>(bits);
}

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

Scalar read_scalar_type(TextReader& in) {
  static constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames{
      {{"char", Scalar::int8}, {"int8", Scalar::int8}, {"uchar", Scalar::uint8}, {"uint8", Scalar::uint8},
       {"short", Scalar::int16}, {"int16", Scalar::int16}, {"ushort", Scalar::uint16}, {"uint16", Scalar::uint16},
       {"int", Scalar::int32}, {"int32", Scalar::int32}, {"uint", Scalar::uint32}, {"uint32", Scalar::uint32},
       {"float", Scalar::float32}, {"float32", Scalar::float32}, {"double", Scalar::float64},
       {"float64", Scalar::float64}}};
  const std::string_view word = in.word();
  for (const auto& [name, type] : kNames)
    if (word == name) return type;
  in.fail("'" + printable(word) + "' is not a PLY type; " + kExportAgain);
}

struct PlyProperty {
  std::string name;
  Scalar type;
  bool list = false;
  Scalar count_type = Scalar::uint8;
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  // Bytes that one item takes at least.
  std::size_t least_size() const {
    std::size_t size = 0;
    for (const PlyProperty& p : properties) size += size_of(p.list ? p.count_type : p.type);
    return size;
  }
};

struct PlyHeader {
  bool text = false, big_endian = false;
  std::vector<PlyElement> elements;

  const PlyElement* find(std::string_view name) const {
    for (const PlyElement& e : elements)
      if (e.name == name) return &e;
    return nullptr;
  }
};

bool is_index_list(const PlyProperty& p) {
  return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
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

PlyHeader read_ply_header(TextReader& in) {
  PlyHeader header;
  if (!in.next_line() || in.word() != "ply") in.fail("does not begin with 'ply'; check that this is a PLY file");
  bool format = false;
  for (;;) {
    if (!in.next_line()) in.fail_truncated("a part of the header");
    const std::string_view keyword = in.word();
    if (keyword == "end_header") break;
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
    } else {
      in.fail("unknown header line '" + printable(keyword) + "'; " + kExportAgain);
    }
  }
  if (!format) in.fail(std::string("the header has no format line; ") + kExportAgain);
  return header;
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
  double value(Scalar type) {
    const char* at = take(size_of(type));
    switch (type) {
      case Scalar::int8: return load<std::int8_t>(at, big_endian_);
      case Scalar::uint8: return load<std::uint8_t>(at, big_endian_);
      case Scalar::int16: return load<std::int16_t>(at, big_endian_);
      case Scalar::uint16: return load<std::uint16_t>(at, big_endian_);
      case Scalar::int32: return load<std::int32_t>(at, big_endian_);
      case Scalar::uint32: return load<std::uint32_t>(at, big_endian_);
      case Scalar::float32: return load<float>(at, big_endian_);
      case Scalar::float64: return load<double>(at, big_endian_);
    }
    return 0;
  }
  void skip(Scalar type, std::size_t n) { take(n * size_of(type)); }
  std::size_t most_items(const PlyElement& element) const {
    return bytes_.size() / std::max<std::size_t>(1, element.least_size());
  }
  std::string ignored() const { return bytes_.empty() ? "" : quantity(bytes_.size(), "byte", "bytes"); }
  [[noreturn]] void fail(const std::string& what) const {
    bisector::fail(path_, fmt::format("{} {}: {}", printable(element_->name), item_, what));
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
void read_ply_vertices(Source& source, const PlyElement& element, Soup& soup) {
  std::vector<int> axes;
  for (const PlyProperty& p : element.properties)
    axes.push_back(p.name == "x" ? 0 : p.name == "y" ? 1 : p.name == "z" ? 2 : -1);
  soup.vertices.reserve(std::min(element.count, source.most_items(element)));
  for (std::size_t i = 0; i < element.count; ++i) {
    source.begin_item(element, i);
    Vec3 p;
    for (std::size_t j = 0; j < axes.size(); ++j) {
      const int axis = axes[j];
      if (axis < 0) {
        skip_ply_property(source, element.properties[j]);
        continue;
      }
      p[axis] = source.value(element.properties[j].type);
      if (const char* flaw = coordinate_flaw(p[axis])) source.fail(flaw);
    }
    soup.vertices.push_back(p);
  }
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

template <class Source>
void read_ply_body(Source& source, const PlyHeader& header, Soup& soup) {
  const std::size_t vertices = header.find("vertex")->count;
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty()) continue;
    if (element.name == "vertex") {
      read_ply_vertices(source, element, soup);
      continue;
    }
    for (std::size_t i = 0; i < element.count; ++i) {
      source.begin_item(element, i);
      for (const PlyProperty& property : element.properties) {
        if (element.name == "face" && is_index_list(property)) read_ply_face(source, property, vertices, soup);
        else skip_ply_property(source, property);
      }
    }
  }
  soup.ignored = source.ignored();
}

void check_ply_elements(const TextReader& in, const PlyHeader& header) {
  const PlyElement* vertex = header.find("vertex");
  const PlyElement* face = header.find("face");
  if (!vertex) in.fail(std::string("the header has no element 'vertex'; ") + kExportAgain);
  if (!face) in.fail("the header has no element 'face'; export as triangles");
  for (const char* axis : {"x", "y", "z"})
    if (std::count_if(vertex->properties.begin(), vertex->properties.end(),
                      [&](const PlyProperty& p) { return p.name == axis && !p.list; }) != 1 ||
        std::count_if(vertex->properties.begin(), vertex->properties.end(),
                      [&](const PlyProperty& p) { return p.name == axis; }) != 1)
      in.fail(fmt::format("element 'vertex' needs one property '{}'; {}", axis, kExportAgain));
  if (std::count_if(face->properties.begin(), face->properties.end(), is_index_list) != 1)
    in.fail("element 'face' needs one list 'vertex_indices'; export as triangles");
}

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

// --- STL ---

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
  bool in_solid = false, in_facet = false;
  std::size_t stray = 0;
  while (in.next_line()) {
    const std::string_view word = in.word();
    if (!in_solid) {
      if (is_keyword(word, "solid")) in_solid = true;
      else ++stray;
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

Soup read_stl(const std::string& path, std::string_view bytes) {
  return is_stl_text(path, bytes) ? read_stl_text(path, bytes) : read_stl_binary(path, bytes);
}

// --- from polygons to triangles ---

// Splits polygons in the plane of their Newell normal, seen along its main axis.
class PolygonSplitter {
 public:
  PolygonSplitter(const std::vector<Vec3>& vertices, std::vector<Triangle>& triangles)
      : vertices_(vertices), triangles_(triangles) {}

  // False if the polygon is degenerate or crosses itself, so that a part of it was split like a fan.
  bool split(const Index* corners, std::size_t n) {
    corners_ = corners;
    if (!project(n)) {
      for (std::size_t i = 2; i < n; ++i) emit(0, i - 1, i);
      return false;
    }
    if (n == 4 && split_convex_quad()) return true;
    return clip_ears(n);
  }

 private:
  struct Point {
    double x, y;
  };

  const Vec3& position(std::size_t i) const { return vertices_[corners_[i]]; }
  void emit(std::size_t i, std::size_t j, std::size_t k) {
    triangles_.push_back({corners_[i], corners_[j], corners_[k]});
  }
  // Positive if corners i, j, k turn to the left.
  double turn(std::size_t i, std::size_t j, std::size_t k) const {
    const Point &a = plane_[i], &b = plane_[j], &c = plane_[k];
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  }

  bool project(std::size_t n) {
    Vec3 normal;
    for (std::size_t i = 2; i < n; ++i)
      normal += cross(position(i - 1) - position(0), position(i) - position(0));
    int axis = 0;
    for (int k = 1; k < 3; ++k)
      if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
    if (normal[axis] == 0) return false;
    int x = (axis + 1) % 3, y = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(x, y);
    plane_.resize(n);
    for (std::size_t i = 0; i < n; ++i) plane_[i] = {position(i)[x], position(i)[y]};
    return true;
  }

  bool split_convex_quad() {
    for (std::size_t i = 0; i < 4; ++i)
      if (!(turn(i, (i + 1) % 4, (i + 2) % 4) > 0)) return false;
    if (norm2(position(2) - position(0)) <= norm2(position(3) - position(1))) {
      emit(0, 1, 2);
      emit(0, 2, 3);
    } else {
      emit(0, 1, 3);
      emit(1, 2, 3);
    }
    return true;
  }

  bool clip_ears(std::size_t n) {
    previous_.resize(n);
    next_.resize(n);
    blocks_.assign(n, 0);
    blocking_.clear();
    for (std::size_t i = 0; i < n; ++i) {
      previous_[i] = i == 0 ? n - 1 : i - 1;
      next_[i] = i + 1 == n ? 0 : i + 1;
    }
    for (std::size_t i = 0; i < n; ++i)
      if (!(turn(previous_[i], i, next_[i]) > 0)) {
        blocks_[i] = 1;
        blocking_.push_back(i);
      }
    tests_ = 0;

    std::size_t i = 0, refused = 0;
    for (std::size_t left = n; left > 3;) {
      if (!is_ear(i)) {
        i = next_[i];
        if (++refused < left && tests_ < kMostTests) continue;
        for (std::size_t j = next_[i]; next_[j] != i; j = next_[j]) emit(i, j, next_[j]);
        return false;
      }
      const std::size_t p = previous_[i], q = next_[i];
      emit(p, i, q);
      next_[p] = q;
      previous_[q] = p;
      blocks_[i] = 0;
      for (const std::size_t j : {p, q}) blocks_[j] = !(turn(previous_[j], j, next_[j]) > 0);
      i = next_[q];
      --left;
      refused = 0;
    }
    emit(previous_[i], i, next_[i]);
    return true;
  }

  // A corner that turns left and whose triangle holds none of the other corners that do not.
  bool is_ear(std::size_t i) {
    const std::size_t p = previous_[i], q = next_[i];
    if (blocks_[i]) return false;
    for (std::size_t k = 0; k < blocking_.size();) {
      const std::size_t v = blocking_[k];
      if (!blocks_[v]) {
        blocking_[k] = blocking_.back();
        blocking_.pop_back();
        continue;
      }
      ++k;
      ++tests_;
      if (v == p || v == q || position(v) == position(p) || position(v) == position(i) || position(v) == position(q))
        continue;
      if (turn(p, i, v) >= 0 && turn(i, q, v) >= 0 && turn(q, p, v) >= 0) return false;
    }
    return true;
  }

  static constexpr std::size_t kMostTests = 500'000'000;  // seconds, for one polygon of a hundred thousand corners

  const std::vector<Vec3>& vertices_;
  std::vector<Triangle>& triangles_;
  const Index* corners_ = nullptr;
  std::vector<Point> plane_;
  std::vector<std::size_t> previous_, next_, blocking_;
  std::vector<char> blocks_;
  std::size_t tests_ = 0;
};

void split_faces(const std::string& path, const Soup& soup, TriangleMesh& mesh, const Context& context) {
  const std::size_t faces = soup.faces.rows(), triangles = soup.faces.values.size() - 2 * faces;
  if (triangles >= kNone) fail(path, fmt::format("{} triangles are too many; split the model", triangles));
  mesh.triangles.reserve(triangles);
  const bool split = triangles > faces;
  if (split) mesh.face_of_triangle.reserve(triangles);
  PolygonSplitter splitter(mesh.vertices, mesh.triangles);
  std::size_t polygons = 0, fans = 0;
  for (std::size_t i = 0; i < faces; ++i) {
    const Index* corners = soup.faces.begin(i);
    const std::size_t degree = soup.faces.size(i);
    if (degree == 3) {
      mesh.triangles.push_back({corners[0], corners[1], corners[2]});
    } else {
      ++polygons;
      if (!splitter.split(corners, degree)) ++fans;
    }
    if (split) mesh.face_of_triangle.resize(mesh.triangles.size(), static_cast<Index>(i));
  }
  if (polygons > 0)
    context.warn(fmt::format("{}: {} split into triangles{}", name_of(path),
                             quantity(polygons, "polygon was", "polygons were"),
                             fans > 0 ? fmt::format(", {} of them degenerate", fans) : ""));
}

void warn_of_leftovers(const std::string& path, const TriangleMesh& mesh, const Context& context) {
  std::vector<char> used(mesh.vertices.size(), 0);
  std::size_t flat = 0;
  for (const Triangle& t : mesh.triangles) {
    for (const Index v : t) used[v] = 1;
    if (collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) ++flat;
  }
  const auto unused = static_cast<std::size_t>(std::count(used.begin(), used.end(), 0));
  if (unused > 0)
    context.warn(fmt::format("{}: {} used by no face", name_of(path), quantity(unused, "vertex is", "vertices are")));
  if (flat > 0)
    context.warn(fmt::format("{}: {} no area", name_of(path), quantity(flat, "triangle has", "triangles have")));
}

TriangleMesh to_triangles(const std::string& path, Soup soup, const Context& context) {
  if (soup.faces.rows() == 0) fail(path, "face 0: there is no face at all; export a surface");
  if (!soup.ignored.empty())
    context.warn(fmt::format("{}: {} after the end of the mesh ignored", name_of(path), soup.ignored));
  TriangleMesh mesh;
  mesh.vertices = std::move(soup.vertices);
  split_faces(path, soup, mesh, context);
  warn_of_leftovers(path, mesh, context);
  return mesh;
}

// --- writing ---

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

// Little-endian on every machine.
template <class T>
void append_bytes(std::string& out, T value) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
  out.append(bytes.data(), bytes.size());
}

void check_points(const std::string& path, const std::vector<Vec3>& vertices) {
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(vertices[v][k]))
        fail(path, fmt::format("vertex {}: a coordinate is not finite; nothing was written", v));
}

void check_face(const std::string& path, std::size_t face, const Index* begin, const Index* end,
                std::size_t vertices) {
  for (const Index* v = begin; v != end; ++v)
    if (*v >= vertices)
      fail(path, fmt::format("face {}: index {} is out of range, the mesh has {} vertices; nothing was written", face,
                             *v, vertices));
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

std::string ply_header(std::size_t vertices, std::size_t faces, std::size_t largest_degree) {
  return fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
                     "property double x\nproperty double y\nproperty double z\n"
                     "element face {}\nproperty list {} {} vertex_indices\n",
                     vertices, faces, largest_degree > 255 ? "uint" : "uchar", vertices >> 31 ? "uint" : "int");
}

void append_ply_vertices(std::string& out, const std::vector<Vec3>& vertices) {
  for (const Vec3& p : vertices)
    for (int k = 0; k < 3; ++k) append_bytes(out, p[k]);
}

std::string format_ply(const TriangleMesh& mesh) {
  std::string out = ply_header(mesh.vertices.size(), mesh.triangles.size(), 3) + "end_header\n";
  out.reserve(out.size() + 24 * mesh.vertices.size() + 13 * mesh.triangles.size());
  append_ply_vertices(out, mesh.vertices);
  for (const Triangle& t : mesh.triangles) {
    append_bytes(out, static_cast<std::uint8_t>(3));
    for (const Index v : t) append_bytes(out, v);
  }
  return out;
}

std::string format_stl(const std::string& path, const TriangleMesh& mesh) {
  std::string out = "binary STL by bisector";
  out.resize(80, ' ');
  out.reserve(kStlHeader + kStlFacet * mesh.triangles.size());
  append_bytes(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  const auto append_floats = [&](const Vec3& p) {
    for (int k = 0; k < 3; ++k) append_bytes(out, static_cast<float>(p[k]));
  };
  for (const Triangle& t : mesh.triangles) {
    std::array<Vec3, 3> rounded;  // so that the normal is that of the corners in the file
    for (std::size_t i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const double x = mesh.vertices[t[i]][k];
        if (std::abs(x) > std::numeric_limits<float>::max())
          fail(path, fmt::format("vertex {}: a coordinate is beyond STL's range; write OFF, OBJ or PLY", t[i]));
        rounded[i][k] = static_cast<float>(x);
      }
    const Vec3 normal = cross(rounded[1] - rounded[0], rounded[2] - rounded[0]);
    const double length = norm(normal);
    append_floats(std::isnormal(length) ? (1 / length) * normal : Vec3{});
    for (const Vec3& p : rounded) append_floats(p);
    append_bytes(out, std::uint16_t{0});
  }
  return out;
}

// --- replacing a file ---

[[noreturn]] void fail_write(const std::string& path, int error) {
  fail(path, fmt::format("cannot be written: {}; check the folder, its permissions and the free space",
                         std::strerror(error)));
}

}  // namespace

TriangleMesh read_mesh(const std::string& path, const Context& context) {
  const std::string extension = lower_extension(path);
  Soup (*read)(const std::string&, std::string_view) = extension == ".off"   ? read_off
                                                       : extension == ".obj" ? read_obj
                                                       : extension == ".ply" ? read_ply
                                                       : extension == ".stl" ? read_stl
                                                                             : nullptr;
  if (!read) fail_extension(path, extension);
  const std::string bytes = read_bytes(path);
  return to_triangles(path, read(path, bytes), context);
}

void write_mesh(const std::string& path, const TriangleMesh& mesh) {
  const std::string extension = lower_extension(path);
  check_points(path, mesh.vertices);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    check_face(path, i, mesh.triangles[i].data(), mesh.triangles[i].data() + 3, mesh.vertices.size());
  if (extension == ".off") write_file(path, format_off(mesh));
  else if (extension == ".obj") write_file(path, format_obj(mesh));
  else if (extension == ".ply") write_file(path, format_ply(mesh));
  else if (extension == ".stl") write_file(path, format_stl(path, mesh));
  else fail_extension(path, extension);
}

void write_polygons(const std::string& path, const PolygonMesh& mesh) {
  const std::size_t faces = mesh.polygons.rows();
  if (lower_extension(path) != ".ply") fail(path, "polygons are written as PLY only; use .ply");
  if ((!mesh.labels.empty() && mesh.labels.size() != faces) || (!mesh.colours.empty() && mesh.colours.size() != faces))
    fail(path, fmt::format("{} labels and {} colours for {} polygons; give one each", mesh.labels.size(),
                           mesh.colours.size(), faces));
  check_points(path, mesh.vertices);
  std::size_t largest_degree = 0;
  for (std::size_t i = 0; i < faces; ++i) {
    check_face(path, i, mesh.polygons.begin(i), mesh.polygons.end(i), mesh.vertices.size());
    largest_degree = std::max(largest_degree, mesh.polygons.size(i));
  }

  std::string out = ply_header(mesh.vertices.size(), faces, largest_degree);
  if (!mesh.labels.empty()) out += "property uint label\n";
  if (!mesh.colours.empty()) out += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  out += "end_header\n";
  append_ply_vertices(out, mesh.vertices);
  for (std::size_t i = 0; i < faces; ++i) {
    if (largest_degree > 255) append_bytes(out, static_cast<std::uint32_t>(mesh.polygons.size(i)));
    else append_bytes(out, static_cast<std::uint8_t>(mesh.polygons.size(i)));
    for (const Index* v = mesh.polygons.begin(i); v != mesh.polygons.end(i); ++v) append_bytes(out, *v);
    if (!mesh.labels.empty()) append_bytes(out, mesh.labels[i]);
    if (!mesh.colours.empty())
      for (const unsigned char channel : mesh.colours[i]) append_bytes(out, channel);
  }
  write_file(path, out);
}

std::vector<Vec3> read_points(const std::string& path) {
  const std::string bytes = read_bytes(path);
  TextReader in(path, bytes, '#');
  std::vector<Vec3> points;
  while (in.next_line()) points.push_back(in.point());
  if (points.empty()) in.fail("there is no point at all; give one \"x y z\" a line");
  return points;
}

void write_file(const std::string& path, const std::string& bytes) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path target = path;
  if (fs::is_symlink(target, error)) {
    const fs::path resolved = fs::canonical(target, error);
    if (!error) target = resolved;
  }
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status)) fail(path, "is a directory; name a file");
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    File device(path, O_WRONLY);
    if (!device.is_open() || !device.write(bytes) || !device.close()) fail_write(path, errno);
    return;
  }

  static std::atomic<unsigned> serial = 0;
  const fs::path temporary = target.parent_path() / fmt::format(".bisector-{}-{}.tmp", ::getpid(), serial++);
  File file(temporary.string(), O_WRONLY | O_CREAT | O_EXCL);
  if (!file.is_open()) fail_write(path, errno);
  if (!file.write(bytes) || !file.close() || ::rename(temporary.c_str(), target.c_str()) != 0) {
    const int reason = errno;
    ::unlink(temporary.c_str());
    fail_write(path, reason);
  }
}

}  // namespace bisector
