#include "io/zip.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <new>

#include "io/bytes.h"
#include "io/mesh_formats.h"
#include "io/text.h"

namespace bisector::io {

namespace {

constexpr std::uint32_t kLocalHeader = 0x04034b50, kDirectoryEntry = 0x02014b50, kDirectoryEnd = 0x06054b50,
                        kDirectoryEnd64 = 0x06064b50, kLocator64 = 0x07064b50;
constexpr std::size_t kLocalHeaderSize = 30, kDirectoryEntrySize = 46, kDirectoryEndSize = 22, kLocator64Size = 20,
                      kDirectoryEnd64Size = 56;
constexpr std::uint32_t kIn64Bits = 0xffffffffu;  // stands for a number in the 64-bit extension
constexpr unsigned kStored = 0, kDeflated = 8;
constexpr std::uint16_t kExtra64 = 1;

// Numbers of an archive, which are little-endian.
class Archive {
 public:
  Archive(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  template <class T>
  T at(std::size_t offset) const {
    need(offset, sizeof(T));
    return load<T>(bytes_.data() + offset, false);
  }
  std::string_view range(std::size_t offset, std::size_t size) const {
    need(offset, size);
    return bytes_.substr(offset, size);
  }
  std::size_t size() const { return bytes_.size(); }
  [[noreturn]] void fail_damaged() const {
    fail(path_, std::string("the ZIP archive is damaged or truncated; ") + kExportAgain);
  }

 private:
  void need(std::size_t offset, std::size_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) fail_damaged();
  }

  const std::string& path_;
  std::string_view bytes_;
};

// Where the end of the directory is: a comment of at most 64 kB follows it.
std::size_t directory_end(const std::string& path, const Archive& zip) {
  constexpr std::size_t kLongestComment = 0xffff;
  for (std::size_t back = kDirectoryEndSize; back <= std::min(zip.size(), kDirectoryEndSize + kLongestComment); ++back)
    if (zip.at<std::uint32_t>(zip.size() - back) == kDirectoryEnd) return zip.size() - back;
  fail(path, std::string("is no ZIP archive, or a truncated one; ") + kExportAgain);
}

struct Directory {
  std::size_t entries, offset;
};

Directory find_directory(const std::string& path, const Archive& zip) {
  const std::size_t end = directory_end(path, zip);
  if (end >= kLocator64Size && zip.at<std::uint32_t>(end - kLocator64Size) == kLocator64) {
    const auto end64 = zip.at<std::uint64_t>(end - kLocator64Size + 8);
    if (end64 > zip.size() || zip.size() - end64 < kDirectoryEnd64Size ||
        zip.at<std::uint32_t>(end64) != kDirectoryEnd64)
      zip.fail_damaged();
    return {zip.at<std::uint64_t>(end64 + 32), zip.at<std::uint64_t>(end64 + 48)};
  }
  return {zip.at<std::uint16_t>(end + 10), zip.at<std::uint32_t>(end + 16)};
}

// The numbers of a directory entry that stand in its extension because they need 64 bits, in their fixed order.
void read_extra_64(const Archive& zip, std::string_view extra, std::initializer_list<std::size_t*> numbers) {
  while (extra.size() >= 4) {
    const auto id = load<std::uint16_t>(extra.data(), false), size = load<std::uint16_t>(extra.data() + 2, false);
    extra.remove_prefix(4);
    if (size > extra.size()) return;
    std::string_view field = extra.substr(0, size);
    extra.remove_prefix(size);
    if (id != kExtra64) continue;
    for (std::size_t* number : numbers) {
      if (*number != kIn64Bits) continue;
      if (field.size() < 8) zip.fail_damaged();
      *number = load<std::uint64_t>(field.data(), false);
      field.remove_prefix(8);
    }
    return;
  }
}

bool same_name(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

// Raw deflate. False unless it gives exactly so many bytes.
bool inflate_raw(std::string_view packed, std::string& out) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  // zlib counts in 32 bits.
  std::size_t in_left = packed.size(), out_left = out.size();
  int state = Z_OK;
  while (state == Z_OK) {
    constexpr std::size_t kAtOnce = std::numeric_limits<uInt>::max();
    const auto in = static_cast<uInt>(std::min(in_left, kAtOnce)),
               room = static_cast<uInt>(std::min(out_left, kAtOnce));
    stream.avail_in = in;
    stream.avail_out = room;
    state = inflate(&stream, Z_NO_FLUSH);
    in_left -= in - stream.avail_in;
    out_left -= room - stream.avail_out;
  }
  inflateEnd(&stream);
  return state == Z_STREAM_END && out_left == 0;
}

std::string deflate_raw(std::string_view bytes) {
  z_stream stream{};
  constexpr int kMemory = 8;  // zlib's default
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string out(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::uint32_t checksum_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

ZipReader::ZipReader(const std::string& path, std::string_view bytes)
    : path_(path), bytes_(bytes), left_(kMostUnpacked * bytes.size()) {
  const Archive zip(path, bytes);
  const Directory directory = find_directory(path, zip);
  std::size_t at = directory.offset;
  for (std::size_t i = 0; i < directory.entries; ++i) {
    if (zip.at<std::uint32_t>(at) != kDirectoryEntry) zip.fail_damaged();
    Entry entry;
    const auto flags = zip.at<std::uint16_t>(at + 8);
    entry.method = zip.at<std::uint16_t>(at + 10);
    entry.checksum = zip.at<std::uint32_t>(at + 16);
    entry.packed = zip.at<std::uint32_t>(at + 20);
    entry.unpacked = zip.at<std::uint32_t>(at + 24);
    entry.header = zip.at<std::uint32_t>(at + 42);
    const std::size_t name = zip.at<std::uint16_t>(at + 28), extra = zip.at<std::uint16_t>(at + 30),
                      comment = zip.at<std::uint16_t>(at + 32);
    entry.name = zip.range(at + kDirectoryEntrySize, name);
    read_extra_64(zip, zip.range(at + kDirectoryEntrySize + name, extra),
                  {&entry.unpacked, &entry.packed, &entry.header});
    if (flags & 1) fail(path, "'" + printable(entry.name) + "' is encrypted; save the file without a password");
    entries_.push_back(std::move(entry));
    at += kDirectoryEntrySize + name + extra + comment;
  }
}

const ZipReader::Entry* ZipReader::find(std::string_view name) const {
  for (const Entry& entry : entries_)
    if (same_name(entry.name, name)) return &entry;
  return nullptr;
}

std::string_view ZipReader::packed_bytes(const Entry& entry) const {
  const Archive zip(path_, bytes_);
  if (zip.at<std::uint32_t>(entry.header) != kLocalHeader) zip.fail_damaged();
  const std::size_t name = zip.at<std::uint16_t>(entry.header + 26), extra = zip.at<std::uint16_t>(entry.header + 28);
  return zip.range(entry.header + kLocalHeaderSize + name + extra, entry.packed);
}

std::string ZipReader::unpack(std::string_view name) {
  const Entry* entry = find(name);
  if (!entry) fail(path_, fmt::format("there is no '{}' in the archive; {}", printable(name), kExportAgain));
  const std::string_view packed = packed_bytes(*entry);
  const auto refuse = [&] { fail(path_, fmt::format("'{}' is damaged; {}", printable(name), kExportAgain)); };
  if (entry->method != kStored && entry->method != kDeflated)
    fail(path_, fmt::format("'{}' is compressed by method {}, which is not read; save it deflated", printable(name),
                            entry->method));
  constexpr std::size_t kMostDeflated = 1032;  // bytes from one, whatever the directory says
  if (entry->unpacked > left_ || entry->unpacked / kMostDeflated > packed.size() ||
      (entry->method == kStored && entry->unpacked != packed.size()))
    refuse();
  left_ -= entry->unpacked;
  std::string bytes;
  if (entry->method == kStored) {
    bytes = packed;
  } else {
    bytes.resize(entry->unpacked);
    if (!inflate_raw(packed, bytes)) refuse();
  }
  if (checksum_of(bytes) != entry->checksum) refuse();
  return bytes;
}

std::string zipped(const std::string& path, const std::vector<std::pair<std::string, std::string>>& files) {
  std::string out, directory;
  constexpr std::size_t kLargestFile = std::numeric_limits<std::uint32_t>::max();
  const auto check_size = [&](std::size_t size) {
    if (size > kLargestFile) fail(path, "the file would be larger than the 4 GiB of a ZIP archive; use another format");
  };
  for (const auto& [name, contents] : files) {
    check_size(contents.size());
    const std::string packed = deflate_raw(contents);
    // What a file's header and its directory entry share.
    std::string shared;
    constexpr std::uint16_t kVersion = 20, kMidnight = 0, kFirstDay = 0x21;  // of 1980: the same bytes whenever written
    append_bytes(shared, kVersion);
    append_bytes(shared, std::uint16_t{0});
    append_bytes(shared, static_cast<std::uint16_t>(kDeflated));
    append_bytes(shared, kMidnight);
    append_bytes(shared, kFirstDay);
    append_bytes(shared, checksum_of(contents));
    append_bytes(shared, static_cast<std::uint32_t>(packed.size()));
    append_bytes(shared, static_cast<std::uint32_t>(contents.size()));
    append_bytes(shared, static_cast<std::uint16_t>(name.size()));
    append_bytes(shared, std::uint16_t{0});
    append_bytes(directory, kDirectoryEntry);
    append_bytes(directory, kVersion);
    directory += shared;
    for (int k = 0; k < 3; ++k) append_bytes(directory, std::uint16_t{0});  // comment, disk, attributes
    append_bytes(directory, std::uint32_t{0});
    append_bytes(directory, static_cast<std::uint32_t>(out.size()));
    directory += name;
    append_bytes(out, kLocalHeader);
    out += shared + name + packed;
    check_size(out.size() + directory.size());
  }
  const std::size_t offset = out.size();
  out += directory;
  append_bytes(out, kDirectoryEnd);
  append_bytes(out, std::uint32_t{0});
  append_bytes(out, static_cast<std::uint16_t>(files.size()));
  append_bytes(out, static_cast<std::uint16_t>(files.size()));
  append_bytes(out, static_cast<std::uint32_t>(directory.size()));
  append_bytes(out, static_cast<std::uint32_t>(offset));
  append_bytes(out, std::uint16_t{0});
  return out;
}

}  // namespace bisector::io
