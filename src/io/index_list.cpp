#include <fmt/format.h>

#include <algorithm>

#include "bisector/io.h"
#include "io/files.h"
#include "io/text.h"

namespace bisector {

std::vector<Index> read_indices(const std::string& path, std::size_t count, const std::string& what) {
  const std::string bytes = io::read_bytes(path);
  io::TextReader in(path, bytes, '#');
  std::vector<Index> indices;
  while (in.next_line())
    for (std::string_view word = in.word(); !word.empty(); word = in.word()) {
      const std::int64_t i = in.integer(word);
      if (i < 0 || i >= static_cast<std::int64_t>(count))
        in.fail(fmt::format("there is no {} {}, the mesh has {}; mend or remove it", what, i, count));
      indices.push_back(static_cast<Index>(i));
    }
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  return indices;
}

}  // namespace bisector
