#include <algorithm>
#include <cctype>
#include <charconv>

#include "bisector/device.h"
#include "bisector/error.h"

namespace bisector {
namespace {

constexpr std::string_view kVulkan = "vulkan";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// 32 hexadecimal digits, with dashes anywhere.
bool is_uuid(std::string_view text) {
  const auto is_hexadecimal = [](unsigned char c) { return std::isxdigit(c) != 0; };
  return std::ranges::all_of(text, [&](char c) { return c == '-' || is_hexadecimal(static_cast<unsigned char>(c)); }) &&
         text.size() - static_cast<std::size_t>(std::ranges::count(text, '-')) == 32;
}

}  // namespace

DeviceRequest parse_device(std::string_view word) {
  if (word == "auto") return {};
  if (word == "cpu") return {.kind = DeviceRequest::Kind::cpu};
  DeviceRequest request{.kind = DeviceRequest::Kind::vulkan};
  if (word == kVulkan) return request;
  if (word.starts_with(kVulkan) && word.substr(kVulkan.size()).starts_with(':')) {
    const std::string_view which = word.substr(kVulkan.size() + 1);
    if (is_uuid(which)) {
      request.uuid = which;
      return request;
    }
    // Nine digits fit.
    if (!which.empty() && which.size() <= 9 && std::ranges::all_of(which, is_digit)) {
      std::from_chars(which.data(), which.data() + which.size(), request.index.emplace());
      return request;
    }
  }
  throw Error("'" + std::string(word) + "' is none of auto, cpu, vulkan, vulkan:INDEX, vulkan:UUID");
}

std::string word_of(const DeviceRequest& request) {
  if (request.kind == DeviceRequest::Kind::automatic) return "auto";
  if (request.kind == DeviceRequest::Kind::cpu) return "cpu";
  std::string word(kVulkan);
  if (request.index) return word + ':' + std::to_string(*request.index);
  return request.uuid.empty() ? word : word + ':' + request.uuid;
}

}  // namespace bisector
