// list_devices() and Device::open().
#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>

#include "host/device/device_impl.h"
#include "host/device/ranking.h"

namespace bisector::host {
namespace {

std::string uuid_digits(std::string_view text) {
  std::string digits;
  for (const char c : text) {
    if (c != '-') digits += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return digits;
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

std::string rejection(const DeviceRequest& request, const DeviceDescription& description) {
  return word_of(request) + ": " + description.name + " cannot be used: " + description.rejected;
}

// The devices that fit the request, best first.
std::vector<const Candidate*> matching(const std::vector<Candidate>& candidates, const DeviceRequest& wanted) {
  std::vector<const Candidate*> found;
  const std::string wanted_digits = uuid_digits(wanted.uuid);
  for (const Candidate& candidate : candidates) {
    const DeviceDescription& description = candidate.description;
    if (wanted.index && description.index != *wanted.index) continue;
    if (!wanted_digits.empty() && uuid_digits(description.uuid) != wanted_digits) continue;
    found.push_back(&candidate);
  }
  std::ranges::stable_sort(
      found, [](const Candidate* a, const Candidate* b) { return better(a->description, b->description); });
  return found;
}

}  // namespace

std::unique_ptr<Device> Device::open(const DeviceRequest& request) {
  const auto instance = Instance::shared();
  const std::vector<Candidate> candidates = enumerate_candidates(*instance);
  const std::vector<const Candidate*> found = matching(candidates, request);
  if (found.empty()) {
    throw DeviceError(word_of(request) + ": " + count_and_names(candidates), Reason::no_such_device);
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
  throw DeviceError(refusal, Reason::no_such_device);
}

namespace {

DeviceList list_devices(bool with_software) {
  DeviceList list;
  try {
    const auto instance = Instance::shared();
    for (const Candidate& candidate : enumerate_candidates(*instance)) {
      if (!with_software && candidate.description.kind == "software") continue;
      DeviceDescription& description = list.devices.emplace_back(candidate.description);
      if (!description.rejected.empty()) continue;
      try {
        description = Device::Impl::make(instance, candidate)->description();
      } catch (const DeviceError& error) {
        description.rejected = error.what();
      }
    }
    if (list.devices.empty()) list.problem = "Vulkan's drivers find no device; let the container or user see it";
  } catch (const DeviceError& error) {
    list.problem = error.what();
  }
  return list;
}

}  // namespace

DeviceList list_devices() { return list_devices(true); }
DeviceList list_gpus() { return list_devices(false); }

}  // namespace bisector::host
