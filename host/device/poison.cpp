#include "host/device/poison.h"

#include "host/device/buffer_impl.h"
#include "host/device/device_impl.h"
#include "host/device/faults.h"

namespace bisector::host {

void fill_at_once(const Buffer::Impl& buffer, std::uint32_t word) {
  const Device::Impl& owner = buffer.device;
  owner.attempt("vkCmdFillBuffer", [&] {
    const vk::raii::CommandPool pool(owner.device, {{}, owner.about.queue_family});
    const vk::CommandBufferAllocateInfo info(*pool, vk::CommandBufferLevel::ePrimary, 1);
    const vk::raii::CommandBuffer commands = std::move(vk::raii::CommandBuffers(owner.device, info).front());
    commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
    commands.fillBuffer(*buffer.allocation.buffer, 0, VK_WHOLE_SIZE, word);
    commands.end();
    owner.queue.submit(vk::SubmitInfo({}, {}, *commands));
    owner.queue.waitIdle();
  });
}

void poison_new_memory(Device& device, std::uint32_t word) { device.impl().poison = word; }

void poison_computed(Device& device, std::uint32_t word) {
  for (const Buffer::Impl* buffer : device.impl().buffers)
    if (buffer->computed && buffer->lifetime == Lifetime::evaluation) fill_at_once(*buffer, word);
}

}  // namespace bisector::host
