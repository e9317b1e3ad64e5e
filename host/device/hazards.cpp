#include "host/device/hazards.h"

#include <algorithm>

namespace bisector::host {

void Hazards::use(vk::Buffer buffer, vk::PipelineStageFlags stages, vk::AccessFlags reads, vk::AccessFlags writes) {
  const auto same = std::ranges::find(uses_, buffer, &Use::buffer);
  if (same == uses_.end()) {
    uses_.push_back({buffer, stages, reads, writes});
  } else {
    same->stages |= stages;
    same->reads |= reads;
    same->writes |= writes;
  }
}

void Hazards::record_barrier(const vk::raii::CommandBuffer& commands) {
  vk::PipelineStageFlags from, to;
  std::vector<vk::BufferMemoryBarrier> barriers;
  for (const Use& use : uses_) {
    State& state = states_[use.buffer];
    const bool unseen = state.write_stages && (use.reads & ~state.visible);
    const bool overwrites = use.writes && state.write_stages && !state.read_stages;
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
    if (use.writes) {
      state = {use.stages, use.writes, {}, {}};
    } else {
      state.read_stages |= use.stages;
      state.visible |= use.reads;
    }
  }
  uses_.clear();
  if (from) commands.pipelineBarrier(from, to, {}, {}, barriers, {});
}

void Hazards::reset() {
  uses_.clear();
  states_.clear();
}

}  // namespace bisector::host
