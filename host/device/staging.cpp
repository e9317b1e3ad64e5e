#include "host/device/staging.h"

#include <algorithm>

#include "host/device/device_impl.h"

namespace bisector::host {
namespace {

constexpr std::size_t kSmallestChunk = std::size_t{1} << 20;
constexpr std::size_t kLargestChunk = std::size_t{64} << 20;
constexpr std::size_t kBudget = std::size_t{256} << 20;
constexpr std::size_t kAlignment = 16;
static_assert(Staging::kLargestUnit <= kSmallestChunk);

}  // namespace

Staging::Span Staging::take(std::size_t bytes, std::size_t unit) {
  if (current_ < chunks_.size() && used_ + unit > chunks_[current_].bytes) {
    ++current_;
    used_ = 0;
  }
  if (current_ == chunks_.size()) {
    const std::size_t left = kBudget - total_;
    if (left < kSmallestChunk) return {};
    // Doubling keeps the chunks few.
    std::size_t chunk = std::max(kSmallestChunk, total_);
    while (chunk < bytes && chunk < kLargestChunk) chunk *= 2;
    chunks_.push_back(allocate_staging(device_, std::min({chunk, kLargestChunk, left})));
    total_ += chunks_.back().bytes;
  }
  const Allocation& chunk = chunks_[current_];
  const std::size_t room = (chunk.bytes - used_) / unit * unit;
  const Span span{*chunk.buffer, used_, std::min(bytes, room), chunk.mapped + used_};
  used_ += (span.bytes + kAlignment - 1) / kAlignment * kAlignment;
  return span;
}

void Staging::reset() { current_ = used_ = 0; }

}  // namespace bisector::host
