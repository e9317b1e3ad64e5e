// list_devices() and Device::open().
#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>

#include "host/device/device_impl.h"
#include "host/device/ranking.h"

namespace bisector::host {
namespace {

// One of the three ways to ask for a device: nothing but "vulkan", an index, or a UUID as 32 digits.
struct Request {
  std::optional<unsigned> index;
  std::string uuid;
};

std::string uuid_digits(std::string_view text) {
  std::string digits;
  for (const char c : text) {
    if (c != '-') digits += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return digits;
}

Request parse(const std::string& request) {
  constexpr std::string_view kPrefix = "vulkan:";
  if (request == "vulkan") return {};
  if (request.starts_with(kPrefix)) {
    const std::string_view which = std::string_view(request).substr(kPrefix.size());
    const auto all = [](std::string_view text, int (*kind)(int)) {
      return std::ranges::all_of(text, [&](char c) { return kind(static_cast<unsigned char>(c)) != 0; });
    };
    const std::string digits = uuid_digits(which);
    if (digits.size() == 32 && all(digits, std::isxdigit)) return {.index = {}, .uuid = digits};
    if (!which.empty() && which.size() <= 9 && all(which, std::isdigit)) {
      return {.index = static_cast<unsigned>(std::stoul(std::string(which))), .uuid = {}};
    }
  }
  throw Error("--device " + request + ": not vulkan, vulkan:INDEX or vulkan:UUID; see `bisector devices`");
}

std::string count_and_names(const std::vector<Candidate>& candidates) {
  if (candidates.empty()) return "there is no Vulkan device";
  std::string text = candidates.size() == 1 ? "there is 1 Vulkan device ("
                                            : "there are " + std::to_string(candidates.size()) + " Vulkan devices (";
  for (const Candidate& candidate : candidates) {
    if (candidate.description.index) text += ", ";
    text += std::to_string(candidate.description.index) + ": " + candidate.description.name;
  }
  return text + ")";
}

std::string rejection(const std::string& request, const DeviceDescription& description) {
  return "--device " + request + ": " + description.name + " cannot be used: " + description.rejected +
         "; see `bisector devices`";
}

// The devices that fit the request, best first.
std::vector<const Candidate*> matching(const std::vector<Candidate>& candidates, const Request& wanted) {
  std::vector<const Candidate*> found;
  for (const Candidate& candidate : candidates) {
    const DeviceDescription& description = candidate.description;
    if (wanted.index && description.index != *wanted.index) continue;
    if (!wanted.uuid.empty() && uuid_digits(description.uuid) != wanted.uuid) continue;
    found.push_back(&candidate);
  }
  std::ranges::stable_sort(found, [](const Candidate* a, const Candidate* b) {
    return better(a->description, b->description);
  });
  return found;
}

}  // namespace

std::unique_ptr<Device> Device::open(const std::string& request) {
  const Request wanted = parse(request);
  const auto instance = std::make_shared<const Instance>();
  const std::vector<Candidate> candidates = enumerate_candidates(*instance);
  const std::vector<const Candidate*> found = matching(candidates, wanted);
  if (found.empty()) {
    throw DeviceError("--device " + request + ": " + count_and_names(candidates) + "; see `bisector devices`");
  }
  std::string refusal;
  for (const Candidate* candidate : found) {
    DeviceDescription description = candidate->description;
    if (description.rejected.empty()) {
      std::unique_ptr<Device> device = Impl::make(instance, *candidate);
      description = device->description();
      if (description.rejected.empty()) return device;
    }
    if (refusal.empty()) refusal = rejection(request, description);
  }
  throw DeviceError(refusal);
}

}  // namespace bisector::host

namespace bisector {

DeviceList list_devices() {
  DeviceList list;
  try {
    const auto instance = std::make_shared<const host::Instance>();
    for (const host::Candidate& candidate : host::enumerate_candidates(*instance)) {
      DeviceDescription& description = list.devices.emplace_back(candidate.description);
      if (!description.rejected.empty()) continue;
      try {
        description = host::Device::Impl::make(instance, candidate)->description();
      } catch (const DeviceError& error) {
        description.rejected = error.what();
      }
    }
    if (list.devices.empty()) list.problem = "there is no Vulkan device; use --device cpu";
  } catch (const DeviceError& error) {
    list.problem = error.what();
  }
  return list;
}

}  // namespace bisector
