// The pipeline cache on disk. BISECTOR_CACHE names its file, or a folder to put it in; without it there is none.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace bisector::host {

// The only device and driver that can use a cache.
struct CacheOwner {
  std::uint32_t vendor = 0;
  std::uint32_t device = 0;
  std::uint32_t driver = 0;
  std::array<std::uint8_t, 16> uuid{};
  bool operator==(const CacheOwner&) const = default;
};

// Empty without BISECTOR_CACHE. In a folder there is a file for each device.
std::filesystem::path cache_path(const std::string& device_uuid);

// What store_cache() was given; empty if there is no such file, it cannot be read, is another owner's, or is damaged.
std::vector<std::uint8_t> load_cache(const std::filesystem::path& path, const CacheOwner& owner);

// Replaces the file at once, so that others read the old or the new one; leaves it alone if it has this content. False
// if it cannot be written.
bool store_cache(const std::filesystem::path& path, const CacheOwner& owner, const std::vector<std::uint8_t>& data);

}  // namespace bisector::host
