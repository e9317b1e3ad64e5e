#include "io/xml.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <system_error>

#include "io/mesh_formats.h"

namespace bisector::io {

namespace {

constexpr std::string_view kBlank = " \t\r\n";

// Where the tag that begins at `open` ends: at the next '>' outside of quotes.
std::size_t tag_end(std::string_view text, std::size_t open) {
  char quote = 0;
  for (std::size_t at = open; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at;
    }
  }
  return std::string_view::npos;
}

void parse_tag(std::string_view text, Tag& tag) {
  tag.attributes.clear();
  tag.closed = text.ends_with('/');
  if (tag.closed) text.remove_suffix(1);
  std::size_t at = std::min(text.find_first_of(kBlank), text.size());
  tag.name = text.substr(0, at);
  for (;;) {
    const std::size_t start = text.find_first_not_of(kBlank, at), equals = text.find('=', start);
    if (start == std::string_view::npos || equals == std::string_view::npos || equals == start) return;
    const std::size_t open = text.find_first_of("\"'", equals);
    if (open == std::string_view::npos) return;
    const std::size_t close = text.find(text[open], open + 1);
    if (close == std::string_view::npos) return;
    const std::size_t key_end = text.find_last_not_of(kBlank, equals - 1);
    tag.attributes.emplace_back(text.substr(start, key_end - start + 1), text.substr(open + 1, close - open - 1));
    at = close + 1;
  }
}

void append_utf8(std::string& out, std::uint32_t code) {
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xc0 | code >> 6);
    out += static_cast<char>(0x80 | (code & 0x3f));
  } else if (code < 0x10000) {
    out += static_cast<char>(0xe0 | code >> 12);
    out += static_cast<char>(0x80 | (code >> 6 & 0x3f));
    out += static_cast<char>(0x80 | (code & 0x3f));
  } else {
    out += static_cast<char>(0xf0 | code >> 18);
    out += static_cast<char>(0x80 | (code >> 12 & 0x3f));
    out += static_cast<char>(0x80 | (code >> 6 & 0x3f));
    out += static_cast<char>(0x80 | (code & 0x3f));
  }
}

struct Entity {
  std::string_view name;
  char character;
};
constexpr std::array<Entity, 5> kEntities{{{"amp", '&'}, {"lt", '<'}, {"gt", '>'}, {"quot", '"'}, {"apos", '\''}}};

// Appends what an entity stands for, without its '&' and ';'; false if it is none.
bool append_entity(std::string& out, std::string_view name) {
  for (const Entity& entity : kEntities)
    if (name == entity.name) {
      out += entity.character;
      return true;
    }
  if (!name.starts_with('#')) return false;
  name.remove_prefix(1);
  const bool hexadecimal = name.starts_with('x');
  if (hexadecimal) name.remove_prefix(1);
  std::uint32_t code = 0;
  const auto [stop, error] = std::from_chars(name.data(), name.data() + name.size(), code, hexadecimal ? 16 : 10);
  if (error != std::errc{} || stop != name.data() + name.size() || code > 0x10ffff) return false;
  append_utf8(out, code);
  return true;
}

}  // namespace

bool XmlReader::next_tag(Tag& tag) {
  for (;;) {
    const std::size_t open = text_.find('<', at_);
    if (open == std::string_view::npos) return false;
    const std::string_view ahead = text_.substr(open);
    const std::string_view end_mark = ahead.starts_with("<!--") ? "-->" : ahead.starts_with("<?") ? "?>" : "";
    const std::size_t close = end_mark.empty() ? tag_end(text_, open) : text_.find(end_mark, open);
    if (close == std::string_view::npos)
      fail(path_, std::string("a tag has no end; the file is truncated, ") + kExportAgain);
    at_ = close + std::max<std::size_t>(1, end_mark.size());
    if (!end_mark.empty() || ahead.starts_with("<!")) continue;
    parse_tag(text_.substr(open + 1, close - open - 1), tag);
    return true;
  }
}

std::string_view XmlReader::text_ahead() const {
  return text_.substr(at_, std::min(text_.find('<', at_), text_.size()) - at_);
}

std::string local_name(std::string_view name) {
  const bool end = name.starts_with('/');
  const std::size_t colon = name.find(':');
  if (colon == std::string_view::npos) return std::string(name);
  return (end ? "/" : "") + std::string(name.substr(colon + 1));
}

std::string unescaped(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '&') {
      constexpr std::size_t kLongest = 12;  // of an entity
      const std::size_t length = text.substr(at, kLongest).find(';');
      if (length != std::string_view::npos && append_entity(out, text.substr(at + 1, length - 1))) {
        at += length;
        continue;
      }
    }
    out += text[at];
  }
  return out;
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto* const entity =
        std::find_if(kEntities.begin(), kEntities.end(), [c](const Entity& e) { return e.character == c; });
    if (entity == kEntities.end()) out += c;
    else (out += '&').append(entity->name) += ';';
  }
  return out;
}

}  // namespace bisector::io
