#include "host/device/cache_file.h"

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <span>
#include <system_error>

#include "core/temporary_name.h"

namespace bisector::host {
namespace {

namespace fs = std::filesystem;

struct Header {
  std::array<char, 8> magic;
  CacheOwner owner;
  std::uint32_t zero;
  std::uint64_t bytes;
  std::uint64_t hash;
};
static_assert(sizeof(Header) == 56);
static_assert(std::has_unique_object_representations_v<Header>);

// FNV-1a
std::uint64_t hash_of(std::span<const std::uint8_t> data) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const std::uint8_t byte : data) hash = (hash ^ byte) * 0x100000001b3;
  return hash;
}

Header header_of(const CacheOwner& owner, const std::vector<std::uint8_t>& data) {
  return {{'B', 'I', 'S', 'P', 'I', 'P', 'E', '1'}, owner, 0, data.size(), hash_of(data)};
}

}  // namespace

fs::path cache_path(const std::string& device_uuid) {
  const char* name = std::getenv("BISECTOR_CACHE");
  if (!name || !*name) return {};
  const fs::path path = name;
  std::error_code ignored;
  return !path.has_filename() || fs::is_directory(path, ignored) ? path / ("pipelines-" + device_uuid + ".cache")
                                                                 : path;
}

std::vector<std::uint8_t> load_cache(const fs::path& path, const CacheOwner& owner) {
  std::error_code error;
  if (path.empty() || !fs::is_regular_file(path, error)) return {};
  // The size is that of the open file, for the name may come to mean another.
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  Header header;
  if (!file.seekg(0) || !file.read(reinterpret_cast<char*>(&header), sizeof header)) return {};
  if (header.bytes != static_cast<std::uint64_t>(size) - sizeof header) return {};
  std::vector<std::uint8_t> data(header.bytes);
  if (!file.read(reinterpret_cast<char*>(data.data()), static_cast<std::streamsize>(data.size()))) return {};
  const Header expected = header_of(owner, data);
  return std::memcmp(&header, &expected, sizeof header) == 0 ? data : std::vector<std::uint8_t>{};
}

bool store_cache(const fs::path& path, const CacheOwner& owner, const std::vector<std::uint8_t>& data) {
  if (data.empty() || load_cache(path, owner) == data) return true;
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const fs::path temporary = path.parent_path() / temporary_name();
  const Header header = header_of(owner, data);
  std::ofstream file(temporary, std::ios::binary);
  file.write(reinterpret_cast<const char*>(&header), sizeof header);
  file.write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  file.close();
  if (file) fs::rename(temporary, path, error);
  if (file && !error) return true;
  fs::remove(temporary, error);
  return false;
}

}  // namespace bisector::host
