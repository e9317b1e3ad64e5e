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

constexpr std::size_t kItemChunk = 1024;             // items that one task packs or unpacks
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

  Device::Impl& device;
  vk::raii::CommandPool pool;
  vk::raii::CommandBuffer commands;
  vk::raii::Fence fence;
  Staging staging;
  Descriptors descriptors;
  Timestamps timestamps;
  Hazards hazards;
  std::vector<std::function<void()>> readbacks;  // to be called once the commands have run
  DeviceWork work;
  Phase phase = &DeviceSeconds::transfer;
  bool recording = false;

  void use(const Buffer& buffer, vk::PipelineStageFlags stages, vk::AccessFlags reads, vk::AccessFlags writes,
           const ByteRange& written = {}) {
    if (!buffer.size()) throw std::logic_error("a buffer is used that has no memory");
    hazards.use(*buffer.impl().allocation.buffer, stages, reads, writes, written);
  }

  // Before each command: starts the recording if there is none, and puts the barrier for the uses.
  void prepare(std::string_view name) {
    if (!recording) {
      device.attempt("vkBeginCommandBuffer", [&] {
        commands.begin(vk::CommandBufferBeginInfo(vk::CommandBufferUsageFlagBits::eOneTimeSubmit));
      });
      recording = true;
    }
    timestamps.mark(commands, phase, name);
    hazards.record_barrier(commands);
  }

  // Staging memory; what was recorded is run first if there is none left.
  Staging::Span stage(std::size_t bytes, std::size_t unit) {
    Staging::Span span = staging.take(bytes, unit);
    if (!span.bytes) {
      submit();
      span = staging.take(bytes, unit);
    }
    return span;
  }

  // Records the transfer of up to `bytes` from staging memory, which the caller fills, and the other way.
  Staging::Span copy_up(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::size_t unit) {
    const Staging::Span span = stage(bytes, unit);
    use(buffer, Stage::eTransfer, {}, AccessBit::eTransferWrite, {offset, offset + span.bytes});
    prepare("upload");
    commands.copyBuffer(span.buffer, *buffer.impl().allocation.buffer, vk::BufferCopy(span.offset, offset, span.bytes));
    work.bytes_up += span.bytes;
    return span;
  }
  Staging::Span copy_down(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::size_t unit) {
    const Staging::Span span = stage(bytes, unit);
    use(buffer, Stage::eTransfer, AccessBit::eTransferRead, {});
    prepare("download");
    commands.copyBuffer(*buffer.impl().allocation.buffer, span.buffer, vk::BufferCopy(offset, span.offset, span.bytes));
    work.bytes_down += span.bytes;
    return span;
  }

  void submit() {
    if (!recording) return;
    if (!readbacks.empty()) {
      commands.pipelineBarrier(Stage::eTransfer, Stage::eHost, {},
                               vk::MemoryBarrier(AccessBit::eTransferWrite, AccessBit::eHostRead), {}, {});
    }
    timestamps.finish(commands);
    device.attempt("vkEndCommandBuffer", [&] { commands.end(); });
    recording = false;
    ++work.submits;
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
    for (const std::function<void()>& read : readbacks) read();
    readbacks.clear();
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
      binding.buffer->impl().computed |= binding.access != Access::read;
      buffers.emplace_back(*binding.buffer->impl().allocation.buffer, 0, binding.buffer->size());
    }
    prepare(kernel.name);
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
  for (std::size_t done = 0; done < bytes;) {
    const Staging::Span span = impl_->copy_up(buffer, offset + done, bytes - done, 1);
    std::memcpy(span.mapped, from + done, span.bytes);
    done += span.bytes;
  }
}

void Commands::upload_items(const Buffer& buffer, std::size_t item_bytes, std::size_t count, const WriteItems& write) {
  check_range(buffer, 0, item_bytes * count);
  for (std::size_t first = 0; first < count;) {
    const Staging::Span span = impl_->copy_up(buffer, first * item_bytes, (count - first) * item_bytes, item_bytes);
    const std::size_t items = span.bytes / item_bytes;
    parallel_chunks(items, kItemChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
      write(span.mapped + begin * item_bytes, first + begin, end - begin);
    });
    first += items;
  }
}

void Commands::download(const Buffer& buffer, std::size_t offset, void* to, std::size_t bytes) {
  check_range(buffer, offset, bytes);
  std::byte* target = static_cast<std::byte*>(to);
  for (std::size_t done = 0; done < bytes;) {
    const Staging::Span span = impl_->copy_down(buffer, offset + done, bytes - done, 1);
    impl_->readbacks.push_back([=] { std::memcpy(target + done, span.mapped, span.bytes); });
    done += span.bytes;
  }
}

void Commands::download_items(const Buffer& buffer, std::size_t item_bytes, std::size_t count, ReadItems read) {
  check_range(buffer, 0, item_bytes * count);
  for (std::size_t first = 0; first < count;) {
    const Staging::Span span = impl_->copy_down(buffer, first * item_bytes, (count - first) * item_bytes, item_bytes);
    const std::size_t items = span.bytes / item_bytes;
    impl_->readbacks.push_back([=] {
      parallel_chunks(items, kItemChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
        read(span.mapped + begin * item_bytes, first + begin, end - begin);
      });
    });
    first += items;
  }
}

void Commands::copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
                    std::size_t bytes) {
  check_range(from, from_offset, bytes);
  check_range(to, to_offset, bytes);
  if (!bytes) return;
  impl_->use(from, Stage::eTransfer, AccessBit::eTransferRead, {});
  impl_->use(to, Stage::eTransfer, {}, AccessBit::eTransferWrite, {to_offset, to_offset + bytes});
  impl_->prepare("copy");
  impl_->commands.copyBuffer(*from.impl().allocation.buffer, *to.impl().allocation.buffer,
                             vk::BufferCopy(from_offset, to_offset, bytes));
}

void Commands::fill(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::uint32_t word) {
  check_range(buffer, offset, bytes);
  if (offset % 4 || bytes % 4) throw std::logic_error("fill is by whole words");
  if (!bytes) return;
  impl_->use(buffer, Stage::eTransfer, {}, AccessBit::eTransferWrite, {offset, offset + bytes});
  impl_->prepare("fill");
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
  ++impl_->work.dispatches;
}

void Commands::dispatch_indirect(const Kernel& kernel, std::initializer_list<Binding> bindings, const void* push,
                                 std::size_t push_bytes, const Buffer& arguments, std::size_t offset) {
  check_range(arguments, offset, 12);
  impl_->use(arguments, Stage::eDrawIndirect, AccessBit::eIndirectCommandRead, {});
  impl_->bind(kernel, bindings, push, push_bytes);
  impl_->commands.dispatchIndirect(*arguments.impl().allocation.buffer, offset);
  ++impl_->work.dispatches;
}

void Commands::run() { impl_->submit(); }

DeviceSeconds Commands::take_seconds() { return impl_->timestamps.take(); }

DeviceWork Commands::take_work() { return std::exchange(impl_->work, {}); }

}  // namespace bisector::host
