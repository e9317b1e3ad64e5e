#include "host/device/timestamps.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>

#include "host/device/device_impl.h"

namespace bisector::host {
namespace {
constexpr std::uint32_t kQueries = 128;  // of a pool
}

KernelTimes::~KernelTimes() {
  std::FILE* file = std::fopen(path_.c_str(), "w");
  if (!file) return;
  std::vector<std::pair<std::string, Sum>> sorted(sums_.begin(), sums_.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second.seconds > b.second.seconds; });
  std::fprintf(file, "kernel,runs,ms\n");
  for (const auto& [name, sum] : sorted) {
    std::fprintf(file, "%s,%zu,%.4f\n", name.c_str(), sum.runs, 1e3 * sum.seconds);
  }
  std::fclose(file);
}

void KernelTimes::add(const std::string& name, double seconds) {
  Sum& sum = sums_[name];
  ++sum.runs;
  sum.seconds += seconds;
}

void Timestamps::mark(const vk::raii::CommandBuffer& commands, Phase phase, std::string_view name) {
  if (!device_.about.timestamp_bits) return;
  if (device_.kernel_times) {
    names_.emplace_back(name);
  } else if (!phases_.empty() && phases_.back() == phase) {
    return;
  }
  using Stage = vk::PipelineStageFlagBits;
  write(commands, phases_.empty() ? Stage::eTopOfPipe : Stage::eBottomOfPipe);
  phases_.push_back(phase);
}

void Timestamps::finish(const vk::raii::CommandBuffer& commands) {
  if (!phases_.empty()) write(commands, vk::PipelineStageFlagBits::eBottomOfPipe);
}

void Timestamps::write(const vk::raii::CommandBuffer& commands, vk::PipelineStageFlagBits stage) {
  const std::size_t pool = written_ / kQueries;
  const std::uint32_t query = written_ % kQueries;
  if (pool == pools_.size()) {
    const vk::QueryPoolCreateInfo info({}, vk::QueryType::eTimestamp, kQueries);
    pools_.push_back(device_.attempt("vkCreateQueryPool", [&] { return vk::raii::QueryPool(device_.device, info); }));
  }
  if (query == 0) commands.resetQueryPool(*pools_[pool], 0, kQueries);
  commands.writeTimestamp(stage, *pools_[pool], query);
  ++written_;
}

void Timestamps::collect() {
  std::vector<std::uint64_t> ticks;
  for (std::size_t first = 0; first < written_; first += kQueries) {
    const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(kQueries, written_ - first));
    const auto flags = vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait;
    const auto [result, values] = device_.attempt("vkGetQueryPoolResults", [&] {
      return pools_[first / kQueries].getResults<std::uint64_t>(0, count, count * sizeof(std::uint64_t),
                                                                sizeof(std::uint64_t), flags);
    });
    ticks.insert(ticks.end(), values.begin(), values.end());
  }
  const std::uint64_t mask = ~std::uint64_t{0} >> (64 - std::max(1u, device_.about.timestamp_bits));
  for (std::size_t i = 0; i < phases_.size(); ++i) {
    const std::uint64_t elapsed = (ticks[i + 1] - ticks[i]) & mask;
    const double seconds = static_cast<double>(elapsed) * device_.about.timestamp_period;
    seconds_.*phases_[i] += seconds;
    if (device_.kernel_times) device_.kernel_times->add(names_[i], seconds);
  }
  phases_.clear();
  names_.clear();
  written_ = 0;
}

DeviceSeconds Timestamps::take() { return std::exchange(seconds_, {}); }

}  // namespace bisector::host
