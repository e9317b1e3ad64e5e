#include "host/device/ranking.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace bisector::host {

bool better(const DeviceDescription& a, const DeviceDescription& b) {
  const auto rank = [](const DeviceDescription& description) {
    constexpr std::array<std::string_view, 5> kOrder{"discrete", "integrated", "virtual", "other", "software"};
    return std::ranges::find(kOrder, description.kind) - kOrder.begin();
  };
  return rank(a) != rank(b) ? rank(a) < rank(b) : a.memory > b.memory;
}

const DeviceDescription* best_gpu(const DeviceList& list) {
  const DeviceDescription* best = nullptr;
  for (const DeviceDescription& description : list.devices) {
    if (description.kind == "software" || !description.rejected.empty()) continue;
    if (!best || better(description, *best)) best = &description;
  }
  return best;
}

}  // namespace bisector::host
