#include "core/lanes.h"

#include <algorithm>
#include <atomic>

namespace bisector {
namespace {

std::atomic<LaneSet> limit_of_lanes = LaneSet::avx512;

LaneSet lanes_of_processor() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return LaneSet::avx512;
  if (__builtin_cpu_supports("avx2")) return LaneSet::avx2;
#endif
  return LaneSet::portable;
}

}  // namespace

LaneSet widest_lanes() {
  static const LaneSet widest = lanes_of_processor();
  return std::min(widest, limit_of_lanes.load(std::memory_order_relaxed));
}

void limit_lanes(LaneSet limit) { limit_of_lanes = limit; }

}  // namespace bisector
