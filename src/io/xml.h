// Tags of XML files, as far as meshes need them: no name spaces, no entities but in unescaped(), nothing validated.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bisector::io {

struct Tag {
  std::string_view name;  // "/X" of an end
  std::vector<std::pair<std::string_view, std::string_view>> attributes;
  bool closed = false;  // "<X/>"

  // Empty if there is no such attribute.
  std::string_view operator[](std::string_view key) const {
    for (const auto& [name_of_it, value] : attributes)
      if (name_of_it == key) return value;
    return {};
  }
};

class XmlReader {
 public:
  // The path is for messages.
  XmlReader(const std::string& path, std::string_view text) : path_(path), text_(text) {}

  // The next tag, passing over text, comments, declarations and instructions; false at the end. Throws Error if a tag
  // has no end.
  bool next_tag(Tag& tag);
  // What follows the tag that was read last, up to the next one.
  std::string_view text_ahead() const;

 private:
  const std::string& path_;
  std::string_view text_;
  std::size_t at_ = 0;
};

// A name of "prefix:name" without the prefix, and "/name" of "/prefix:name".
std::string local_name(std::string_view name);

// Text with its entities (&amp; &lt; &gt; &quot; &apos; &#65; &#x41;) replaced, and the other way.
std::string unescaped(std::string_view text);
std::string escaped(std::string_view text);

}  // namespace bisector::io
