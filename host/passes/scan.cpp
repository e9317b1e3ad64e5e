#include "host/passes/scan.h"

namespace bisector::host {
namespace {

constexpr std::size_t kBlock = 1024;  // of kernels/scan_blocks.comp

}  // namespace

void Scan::reserve(std::size_t count) {
  for (std::size_t level = 0, size = count; size > 0; ++level) {
    size = (size + kBlock - 1) / kBlock;
    if (totals_.size() <= level) totals_.emplace_back(device_);
    totals_[level].reserve(size * sizeof(std::uint32_t));
    if (size == 1) break;
  }
}

void Scan::record(Commands& commands, const Buffer& words, std::size_t count) { record(commands, words, count, 0); }

void Scan::record(Commands& commands, const Buffer& words, std::size_t count, std::size_t level) {
  const std::size_t blocks = (count + kBlock - 1) / kBlock;
  const Buffer& totals = totals_[level];
  const std::uint32_t push = static_cast<std::uint32_t>(count);
  commands.dispatch({"scan_blocks", {}}, {updates(words), writes(totals)}, push, blocks * kGroupSize);
  if (blocks <= 1) return;
  record(commands, totals, blocks, level + 1);
  commands.dispatch({"scan_add", {}}, {updates(words), reads(totals)}, push, count);
}

}  // namespace bisector::host
