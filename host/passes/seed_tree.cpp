#include "host/passes/seed_tree.h"

#include "host/passes/packing.h"
#include "kernels/layout/push.h"

namespace bisector::host {
namespace {

// How far a coordinate may be from its box, or from what single precision makes of it, relative to the largest.
constexpr double kVague = 0x1p-20;

}  // namespace

void SeedTree::plan(std::size_t seeds) {
  std::size_t nodes = 0, level = 0;
  for (std::size_t count = seeds;; ++level) {
    count = (count + kTreeArity - 1) / kTreeArity;
    level_begin_[level] = static_cast<uint>(nodes);
    nodes += count;
    if (count == 1) break;
  }
  level_begin_[level + 1] = static_cast<uint>(nodes);
  top_level_ = static_cast<uint>(level);
  boxes_.reserve(nodes * kBoxWords * sizeof(float));
}

void SeedTree::record(Commands& commands, const DeviceSeeds& seeds, bool is_double) {
  const float vague = static_cast<float>(kVague * seeds.largest);
  for (uint level = 0; level <= top_level_; ++level) {
    const bool leaves = level == 0;
    const uint first = leaves ? 0 : level_begin_[level - 1];
    const uint count = leaves ? static_cast<uint>(seeds.count()) : level_begin_[level] - first;
    commands.dispatch(kernel("boxes", is_double, {leaves}), {reads(seeds.words), updates(boxes_)},
                      BoxesPush{first, count, level_begin_[level], vague},
                      level_begin_[level + 1] - level_begin_[level]);
  }
}

}  // namespace bisector::host
