// Files that appear under their names only when complete.
#pragma once

#include <string>

namespace bisector {

// Writes bytes to a temporary name beside `path` and renames it when complete, so no half file is ever seen under
// `path`. A link is followed; a device or pipe is written directly. Throws Error.
void write_file(const std::string& path, const std::string& bytes);

}  // namespace bisector
