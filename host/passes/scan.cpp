#include "host/passes/scan.h"

#include "kernels/layout/push.h"
#include "kernels/layout/sizes.h"

namespace bisector::host {
void Scan::reserve(std::size_t count) {
  for (std::size_t level = 0, size = count; size > 0; ++level) {
    size = (size + kScanBlock - 1) / kScanBlock;
    if (totals_.size() <= level) totals_.emplace_back(device_);
    totals_[level].reserve(size * sizeof(std::uint32_t));
    if (size == 1) break;
  }
}

void Scan::record(Commands& commands, const Buffer& words, std::size_t count) { record(commands, words, count, 0); }

void Scan::record(Commands& commands, const Buffer& words, std::size_t count, std::size_t level) {
  const std::size_t blocks = (count + kScanBlock - 1) / kScanBlock;
  const Buffer& totals = totals_[level];
  const CountPush push{static_cast<uint>(count)};
  commands.dispatch({"scan_blocks", {}}, {updates(words), writes(totals)}, push, blocks * kGroupSize);
  if (blocks <= 1) return;
  record(commands, totals, blocks, level + 1);
  commands.dispatch({"scan_add", {}}, {updates(words), reads(totals)}, push, count);
}

}  // namespace bisector::host
