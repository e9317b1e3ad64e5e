// ZIP archives (PKWARE, APPNOTE.TXT 6.3): stored and deflated entries, with the 64-bit extension when reading.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bisector::io {

class ZipReader {
 public:
  // Reads the directory of a whole file; the path is for messages. Throws Error.
  ZipReader(const std::string& path, std::string_view bytes);

  // Whether there is an entry of that name, upper and lower case alike.
  bool has(std::string_view name) const { return find(name) != nullptr; }
  // Unpacks an entry. What all calls unpack together is at most kMostUnpacked times the file's size. Throws Error.
  std::string unpack(std::string_view name);

  static constexpr std::size_t kMostUnpacked = 1100;  // deflate makes a byte of at most 1032

 private:
  struct Entry {
    std::string name;
    unsigned method;
    std::size_t packed, unpacked, header;
    unsigned long checksum;
  };

  const Entry* find(std::string_view name) const;
  std::string_view packed_bytes(const Entry& entry) const;

  const std::string& path_;
  std::string_view bytes_;
  std::vector<Entry> entries_;
  std::size_t left_;  // bytes that may still be unpacked
};

// An archive of these files, name and contents, deflated. Throws Error, naming `path`, beyond 4 GiB.
std::string zipped(const std::string& path, const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace bisector::io
