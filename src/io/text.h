// The text reader that the formats share.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>

#include "bisector/error.h"
#include "core/geometry.h"
#include "io/mesh_formats.h"

namespace bisector::io {

// The number that a word is. `fail` is called with what is wrong and must throw.
template <class Fail>
double parse_number(std::string_view text, const Fail& fail) {
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

template <class Fail>
std::int64_t parse_integer(std::string_view text, const Fail& fail) {
  std::int64_t n = 0;
  const char* begin = text.data() + (text.size() > 1 && text[0] == '+' && text[1] != '-');
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, n);
  if (error == std::errc::result_out_of_range) fail("'" + printable(text) + "' is out of range; mend the line");
  if (error != std::errc{} || stop != end) fail("'" + printable(text) + "' is not an integer; mend the line");
  return n;
}

// What ends the lines of a text: '\n', which may follow a '\r', or '\r' alone, as on the Macintosh before OS X. Of a
// PLY file with binary data only the header is looked at.
inline char end_of_lines(std::string_view bytes) {
  constexpr std::size_t kEnough = 4096;  // a line ends within so many bytes
  std::string_view head = bytes.substr(0, std::min(kEnough, bytes.find("end_header")));
  if (head.ends_with('\r')) head.remove_suffix(1);  // what follows it is not in sight
  return head.find('\n') == head.npos && head.find('\r') != head.npos ? '\r' : '\n';
}

// Words of a text, line by line.
class TextReader {
 public:
  // `comment` starts a comment anywhere in a line (0: none); with `joins`, a backslash joins a line with the next one.
  TextReader(const std::string& path, std::string_view bytes, char comment, bool joins = false)
      : path_(path), at_(bytes.data()), end_(bytes.data() + bytes.size()), end_of_line_(end_of_lines(bytes)),
        comment_(comment), joins_(joins) {
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
      if (joint == 0) return *at_ != end_of_line_ && !(comment_ && *at_ == comment_);
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

  // What is left of the line without blanks around it, up to a comment.
  std::string_view rest_of_line() {
    if (!at_word()) return {};
    const char *begin = at_, *last = at_;
    for (std::string_view text = word(); !text.empty(); text = word()) last = text.data() + text.size();
    return {begin, static_cast<std::size_t>(last - begin)};
  }

  double number() {
    const std::string_view text = word();
    if (text.empty()) fail(std::string("a number is missing at the end of the line; ") + kExportAgain);
    return parse_number(text, [this](const std::string& what) { fail(what); });
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
    return parse_integer(text, [this](const std::string& what) { fail(what); });
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
  bool is_blank(char c) const {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f' || (c == '\r' && c != end_of_line_);
  }
  bool ends_word() const {
    return is_blank(*at_) || *at_ == end_of_line_ || (comment_ && *at_ == comment_) || joint_length() > 0;
  }
  // Of a backslash and the line's end after it.
  std::size_t joint_length() const {
    if (!joins_ || *at_ != '\\') return 0;
    if (end_ - at_ > 1 && at_[1] == end_of_line_) return 2;
    return end_ - at_ > 2 && at_[1] == '\r' && at_[2] == '\n' ? 3 : 0;
  }
  void skip_line() {
    bool commented = false;
    for (; at_ != end_; ++at_) {
      if (*at_ == end_of_line_) {
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
  char end_of_line_;
  char comment_;
  bool joins_;
};

// Goes to the end of the file and tells, as "3 lines", what was there; empty if nothing was.
inline std::string count_lines_left(TextReader& in) {
  std::size_t lines = 0;
  while (in.next_line()) ++lines;
  return lines == 0 ? "" : quantity(lines, "line", "lines");
}

// As few digits as it takes to read back the same bits.
inline void append_number(std::string& out, double x) {
  std::array<char, 32> digits;
  out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), x).ptr);
}

inline void append_index(std::string& out, std::size_t i) {
  std::array<char, 24> digits;
  out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), i).ptr);
}

inline void append_coordinates(std::string& out, const Vec3& p) {
  append_number(out, p.x);
  out += ' ';
  append_number(out, p.y);
  out += ' ';
  append_number(out, p.z);
}

inline void append_point(std::string& out, const Vec3& p) {
  append_coordinates(out, p);
  out += '\n';
}

}  // namespace bisector::io
