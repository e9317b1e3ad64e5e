// Files that appear under their names only when complete.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace bisector {

// Writes bytes to a temporary name beside `path` and renames it when complete, so no half file is ever seen under
// `path`. A link is followed; a device or pipe is written directly. Throws Error.
void write_file(const std::string& path, const std::string& bytes);

// While one lives, the files that its thread writes wait for each other: none appears unless all could be written, and
// none if it ends without put_in_place(). Devices and pipes get their bytes at once. There is one at a time.
class FilesTogether {
 public:
  FilesTogether();
  ~FilesTogether();
  FilesTogether(const FilesTogether&) = delete;
  FilesTogether& operator=(const FilesTogether&) = delete;

  // Throws Error.
  void put_in_place();

 private:
  friend void write_file(const std::string& path, const std::string& bytes);
  class File;
  std::vector<std::unique_ptr<File>> files_;
};

}  // namespace bisector
