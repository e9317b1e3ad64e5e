#include "host/device/hazards.h"

#include <algorithm>
#include <atomic>
#include <limits>

#include "host/device/faults.h"

namespace bisector::host {
namespace {

constexpr std::size_t kNoBarrier = std::numeric_limits<std::size_t>::max();
std::atomic<std::size_t> left_out{kNoBarrier}, counted{0};
std::atomic<bool> is_between_updates{false};

using Stage = vk::PipelineStageFlagBits;
using AccessBit = vk::AccessFlagBits;

bool is_update(const vk::BufferMemoryBarrier& barrier) {
  return barrier.srcAccessMask == AccessBit::eShaderWrite &&
         barrier.dstAccessMask == (AccessBit::eShaderRead | AccessBit::eShaderWrite);
}

// Counts the barrier.
bool is_left_out(vk::PipelineStageFlags from, vk::PipelineStageFlags to,
                 const std::vector<vk::BufferMemoryBarrier>& barriers) {
  if (counted++ != left_out) return false;
  is_between_updates =
      (from | to) == Stage::eComputeShader && !barriers.empty() && std::ranges::all_of(barriers, is_update);
  return true;
}

}  // namespace

void leave_out_barrier(std::optional<std::size_t> ordinal) {
  left_out = ordinal.value_or(kNoBarrier);
  counted = 0;
  is_between_updates = false;
}

std::size_t barriers() { return counted; }

bool left_out_between_updates() { return is_between_updates; }

void Hazards::use(vk::Buffer buffer, vk::PipelineStageFlags stages, vk::AccessFlags reads, vk::AccessFlags writes,
                  const ByteRange& written) {
  const auto same = std::ranges::find(uses_, buffer, &Use::buffer);
  if (same == uses_.end()) {
    uses_.push_back({buffer, stages, reads, writes, written});
  } else {
    same->stages |= stages;
    same->reads |= reads;
    same->writes |= writes;
    same->written = {};
  }
}

void Hazards::record_barrier(const vk::raii::CommandBuffer& commands) {
  vk::PipelineStageFlags from, to;
  std::vector<vk::BufferMemoryBarrier> barriers;
  for (const Use& use : uses_) {
    State& state = states_[use.buffer];
    const bool unseen = state.write_stages && (use.reads & ~state.visible);
    const bool overwrites = use.writes && state.write_stages && !state.read_stages &&
                            std::ranges::any_of(state.written, [&](const ByteRange& range) {
                              return range.begin < use.written.end && use.written.begin < range.end;
                            });
    if (unseen || overwrites) {
      from |= state.write_stages;
      to |= use.stages;
      barriers.emplace_back(state.write_access, use.reads | use.writes, VK_QUEUE_FAMILY_IGNORED,
                            VK_QUEUE_FAMILY_IGNORED, use.buffer, 0, VK_WHOLE_SIZE);
    }
    if (use.writes && state.read_stages) {
      from |= state.read_stages;
      to |= use.stages;
    }
    if (use.writes && state.write_stages && !state.read_stages && !unseen && !overwrites) {
      state.write_stages |= use.stages;
      state.write_access |= use.writes;
      state.written.push_back(use.written);
    } else if (use.writes) {
      state = {use.stages, use.writes, {use.written}, {}, {}};
    } else {
      state.read_stages |= use.stages;
      state.visible |= use.reads;
    }
  }
  uses_.clear();
  if (from && !is_left_out(from, to, barriers)) commands.pipelineBarrier(from, to, {}, {}, barriers, {});
}

void Hazards::reset() {
  uses_.clear();
  states_.clear();
}

}  // namespace bisector::host
