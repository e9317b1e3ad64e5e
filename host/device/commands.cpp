#include "host/device/commands.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "core/parallel.h"
#include "host/device/buffer_impl.h"
#include "host/device/descriptors.h"
#include "host/device/device_impl.h"
#include "host/device/hazards.h"
#include "host/device/staging.h"
#include "host/device/timestamps.h"

namespace bisector::host {
namespace {

using Stage = vk::PipelineStageFlagBits;
using AccessBit = vk::AccessFlagBits;

constexpr std::uint64_t kTimeout = 600'000'000'000;  // nanoseconds

void check_range(const Buffer& buffer, std::size_t offset, std::size_t bytes) {
  if (offset > buffer.size() || bytes > buffer.size() - offset)
    throw std::logic_error("a transfer is out of its buffer");
}

}  // namespace

struct Commands::Impl {
  explicit Impl(Device::Impl& owner)
      : device(owner),
        pool(device.attempt("vkCreateCommandPool",
                            [&] {
                              return vk::raii::CommandPool(device.device, {{}, device.about.queue_family});
                            })),
        commands(device.attempt("vkAllocateCommandBuffers",
                                [&] {
                                  const vk::CommandBufferAllocateInfo info(*pool, vk::CommandBufferLevel::ePrimary, 1);
                                  return std::move(vk::raii::CommandBuffers(device.device, info).front());
                                })),
        fence(device.attempt("vkCreateFence", [&] { return vk::raii::Fence(device.device, vk::FenceCreateInfo()); })),
        staging(device), descriptors(device), timestamps(device) {}

  struct Readback {
    const std::byte* from;
    void* to;
    std::size_t bytes;
  };
  struct ItemReadback {
    const std::byte* from;
    std::size_t item_bytes, first, count;
    ReadItems read;
  };

  Device::Impl& device;
  vk::raii::CommandPool pool;
  vk::raii::CommandBuffer commands;
  vk::raii::Fence fence;
  Staging staging;
  Descriptors descriptors;
  Timestamps timestamps;
  Hazards hazards;
  std::vector<Readback> readbacks;
  std::vector<ItemReadback> item_readbacks;
  CommandCounts counts;
  Phase phase = &DeviceSeconds::transfer;
  bool recording = false;

  void use(const Buffer& buffer, vk::PipelineStageFlags stages, vk::AccessFlags reads, vk::AccessFlags writes) {
    if (!buffer.size()) throw std::logic_error("a buffer is used that has no memory");
    hazards.use(*buffer.impl().allocation.buffer, stages, reads, writes);
  }

  // Before each command: starts the recording if there is none, and puts the barrier for the uses.
  void prepare() {
    if (!recording) {
      device.attempt("vkBeginCommandBuffer", [&] {
        commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
      });
      recording = true;
    }
    timestamps.mark(commands, phase);
    hazards.record_barrier(commands);
  }

  // Staging memory; what was recorded is run first if there is none left.
  Staging::Span stage(std::size_t bytes, std::size_t unit = 1) {
    Staging::Span span = staging.take(bytes, unit);
    if (!span.bytes) {
      submit();
      span = staging.take(bytes, unit);
    }
    return span;
  }

  void submit() {
    if (!recording) return;
    if (!readbacks.empty() || !item_readbacks.empty()) {
      commands.pipelineBarrier(Stage::eTransfer, Stage::eHost, {},
                               vk::MemoryBarrier(AccessBit::eTransferWrite, AccessBit::eHostRead), {}, {});
    }
    timestamps.finish(commands);
    device.attempt("vkEndCommandBuffer", [&] { commands.end(); });
    recording = false;
    ++counts.submits;
    try {
      device.attempt("vkQueueSubmit", [&] { device.queue.submit(vk::SubmitInfo({}, {}, *commands), *fence); });
      const vk::Result result =
          device.attempt("vkWaitForFences", [&] { return device.device.waitForFences(*fence, true, kTimeout); });
      if (result == vk::Result::eTimeout) {
        throw DeviceError(device.about.description.name + ": no answer for 10 minutes");
      }
    } catch (const DeviceError&) {
      wait_until_idle();
      throw;
    }
    timestamps.collect();
    for (const Readback& readback : readbacks) std::memcpy(readback.to, readback.from, readback.bytes);
    readbacks.clear();
    for (const ItemReadback& readback : item_readbacks) {
      parallel_chunks(readback.count, kItemChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
        readback.read(readback.from + begin * readback.item_bytes, readback.first + begin, end - begin);
      });
    }
    item_readbacks.clear();
    hazards.reset();
    descriptors.reset();
    staging.reset();
    device.attempt("vkResetFences", [&] { device.device.resetFences(*fence); });
    device.attempt("vkResetCommandPool", [&] { pool.reset(); });
  }

  // After a failure the device may still be at work with what is about to be destroyed.
  void wait_until_idle() const noexcept {
    try {
      device.device.waitIdle();
    } catch (const vk::SystemError&) {
      // It was lost: nothing runs any more.
    }
  }

  const Pipeline& bind(const Kernel& kernel, std::initializer_list<Binding> bindings, const void* push,
                       std::size_t push_bytes) {
    const Pipeline& pipeline = device.pipelines->get(kernel, bindings.size(), push_bytes);
    std::vector<vk::DescriptorBufferInfo> buffers;
    for (const Binding& binding : bindings) {
      const vk::AccessFlags reads = binding.access == Access::write ? vk::AccessFlags() : AccessBit::eShaderRead;
      const vk::AccessFlags writes = binding.access == Access::read ? vk::AccessFlags() : AccessBit::eShaderWrite;
      use(*binding.buffer, Stage::eComputeShader, reads, writes);
      buffers.emplace_back(*binding.buffer->impl().allocation.buffer, 0, binding.buffer->size());
    }
    prepare();
    const vk::DescriptorSet set = descriptors.bind(*pipeline.set_layout, buffers);
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline.pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *pipeline.layout, 0, set, {});
    const vk::ArrayProxy<const std::byte> values(static_cast<std::uint32_t>(push_bytes),
                                                 static_cast<const std::byte*>(push));
    commands.pushConstants<std::byte>(*pipeline.layout, vk::ShaderStageFlagBits::eCompute, 0, values);
    return pipeline;
  }
};

Commands::Commands(Device& device) : impl_(std::make_unique<Impl>(device.impl())) {}
Commands::~Commands() = default;

void Commands::phase(Phase phase) { impl_->phase = phase; }

void Commands::upload(const Buffer& buffer, std::size_t offset, const void* data, std::size_t bytes) {
  check_range(buffer, offset, bytes);
  const std::byte* from = static_cast<const std::byte*>(data);
  while (bytes) {
    const Staging::Span span = impl_->stage(bytes);
    std::memcpy(span.mapped, from, span.bytes);
    impl_->use(buffer, Stage::eTransfer, {}, AccessBit::eTransferWrite);
    impl_->prepare();
    impl_->commands.copyBuffer(span.buffer, *buffer.impl().allocation.buffer,
                               vk::BufferCopy(span.offset, offset, span.bytes));
    impl_->counts.bytes_up += span.bytes;
    from += span.bytes;
    offset += span.bytes;
    bytes -= span.bytes;
  }
}

void Commands::upload_items(const Buffer& buffer, std::size_t item_bytes, std::size_t count, const WriteItems& write) {
  check_range(buffer, 0, item_bytes * count);
  for (std::size_t first = 0; first < count;) {
    const Staging::Span span = impl_->stage((count - first) * item_bytes, item_bytes);
    const std::size_t items = span.bytes / item_bytes;
    parallel_chunks(items, kItemChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
      write(span.mapped + begin * item_bytes, first + begin, end - begin);
    });
    impl_->use(buffer, Stage::eTransfer, {}, AccessBit::eTransferWrite);
    impl_->prepare();
    impl_->commands.copyBuffer(span.buffer, *buffer.impl().allocation.buffer,
                               vk::BufferCopy(span.offset, first * item_bytes, span.bytes));
    impl_->counts.bytes_up += span.bytes;
    first += items;
  }
}

void Commands::download(const Buffer& buffer, std::size_t offset, void* to, std::size_t bytes) {
  check_range(buffer, offset, bytes);
  std::byte* target = static_cast<std::byte*>(to);
  while (bytes) {
    const Staging::Span span = impl_->stage(bytes);
    impl_->use(buffer, Stage::eTransfer, AccessBit::eTransferRead, {});
    impl_->prepare();
    impl_->commands.copyBuffer(*buffer.impl().allocation.buffer, span.buffer,
                               vk::BufferCopy(offset, span.offset, span.bytes));
    impl_->readbacks.push_back({span.mapped, target, span.bytes});
    impl_->counts.bytes_down += span.bytes;
    target += span.bytes;
    offset += span.bytes;
    bytes -= span.bytes;
  }
}

void Commands::download_items(const Buffer& buffer, std::size_t item_bytes, std::size_t count, ReadItems read) {
  check_range(buffer, 0, item_bytes * count);
  for (std::size_t first = 0; first < count;) {
    // Whole chunks, but for the last.
    const std::size_t bytes = (count - first) * item_bytes, chunk = std::min(bytes, kItemChunk * item_bytes);
    Staging::Span span = impl_->stage(bytes, chunk);
    const std::size_t items = span.bytes / item_bytes;
    impl_->use(buffer, Stage::eTransfer, AccessBit::eTransferRead, {});
    impl_->prepare();
    impl_->commands.copyBuffer(*buffer.impl().allocation.buffer, span.buffer,
                               vk::BufferCopy(first * item_bytes, span.offset, span.bytes));
    impl_->item_readbacks.push_back({span.mapped, item_bytes, first, items, read});
    impl_->counts.bytes_down += span.bytes;
    first += items;
  }
}

void Commands::copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
                    std::size_t bytes) {
  check_range(from, from_offset, bytes);
  check_range(to, to_offset, bytes);
  if (!bytes) return;
  impl_->use(from, Stage::eTransfer, AccessBit::eTransferRead, {});
  impl_->use(to, Stage::eTransfer, {}, AccessBit::eTransferWrite);
  impl_->prepare();
  impl_->commands.copyBuffer(*from.impl().allocation.buffer, *to.impl().allocation.buffer,
                             vk::BufferCopy(from_offset, to_offset, bytes));
}

void Commands::fill(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::uint32_t word) {
  check_range(buffer, offset, bytes);
  if (offset % 4 || bytes % 4) throw std::logic_error("fill is by whole words");
  if (!bytes) return;
  impl_->use(buffer, Stage::eTransfer, {}, AccessBit::eTransferWrite);
  impl_->prepare();
  impl_->commands.fillBuffer(*buffer.impl().allocation.buffer, offset, bytes, word);
}

void Commands::dispatch(const Kernel& kernel, std::initializer_list<Binding> bindings, const void* push,
                        std::size_t push_bytes, std::size_t items) {
  if (!items) return;
  const std::size_t groups = (items + kGroupSize - 1) / kGroupSize;
  const std::size_t most = impl_->device.about.limits.groups;
  const std::size_t x = std::min(groups, most);
  const std::size_t y = (groups + x - 1) / x;
  if (y > most) throw std::logic_error("kernel " + kernel.name + " has too many items");
  impl_->bind(kernel, bindings, push, push_bytes);
  impl_->commands.dispatch(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 1);
  ++impl_->counts.dispatches;
}

void Commands::dispatch_indirect(const Kernel& kernel, std::initializer_list<Binding> bindings, const void* push,
                                 std::size_t push_bytes, const Buffer& arguments, std::size_t offset) {
  check_range(arguments, offset, 12);
  impl_->use(arguments, Stage::eDrawIndirect, AccessBit::eIndirectCommandRead, {});
  impl_->bind(kernel, bindings, push, push_bytes);
  impl_->commands.dispatchIndirect(*arguments.impl().allocation.buffer, offset);
  ++impl_->counts.dispatches;
}

void Commands::run() { impl_->submit(); }

DeviceSeconds Commands::take_seconds() { return impl_->timestamps.take(); }

CommandCounts Commands::take_counts() { return std::exchange(impl_->counts, {}); }

}  // namespace bisector::host
