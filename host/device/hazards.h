// Which barriers the commands of one recording need.
#pragma once

#include <cstddef>
#include <limits>
#include <unordered_map>
#include <vector>

#include "host/device/vulkan.h"

namespace bisector::host {

// Bytes of a buffer, up to before `end`; all of them if nothing else is said.
struct ByteRange {
  std::size_t begin = 0, end = std::numeric_limits<std::size_t>::max();
};

// Follows what was done to each buffer. A read waits for the last write and sees it, once per kind of access; a write
// waits for the reads since, or for the last write where there were none, unless that was elsewhere in the buffer. What
// was done before the recording is complete.
class Hazards {
 public:
  // The next command touches the buffer; the range is of what it writes. Several uses of one buffer count as one that
  // does all of it to the whole buffer.
  void use(vk::Buffer buffer, vk::PipelineStageFlags stages, vk::AccessFlags reads, vk::AccessFlags writes,
           const ByteRange& written = {});
  // To be called when the uses of a command are complete, before it is recorded: records what it has to wait for, if
  // anything.
  void record_barrier(const vk::raii::CommandBuffer& commands);
  // Forgets all, as a new recording starts.
  void reset();

 private:
  struct Use {
    vk::Buffer buffer;
    vk::PipelineStageFlags stages;
    vk::AccessFlags reads, writes;
    ByteRange written;
  };
  struct State {
    vk::PipelineStageFlags write_stages;  // none if it was not written
    vk::AccessFlags write_access;
    std::vector<ByteRange> written;      // by these writes, no two of which overlap
    vk::PipelineStageFlags read_stages;  // since the write
    vk::AccessFlags visible;             // reads that were made to see the write
  };

  std::vector<Use> uses_;
  std::unordered_map<VkBuffer, State> states_;
};

}  // namespace bisector::host
