#include "host/device/buffer.h"

#include <algorithm>

#include "host/device/buffer_impl.h"
#include "host/device/device_impl.h"
#include "host/device/poison.h"

namespace bisector::host {

Buffer::Impl::Impl(Device::Impl& owner, Lifetime contents) : device(owner), lifetime(contents) {
  device.buffers.push_back(this);
}
Buffer::Impl::~Impl() { std::erase(device.buffers, this); }

Buffer::Buffer(Device& device, Lifetime lifetime) : impl_(std::make_unique<Impl>(device.impl(), lifetime)) {}
Buffer::~Buffer() = default;
Buffer::Buffer(Buffer&&) noexcept = default;
Buffer& Buffer::operator=(Buffer&&) noexcept = default;

std::size_t Buffer::size() const { return impl_->allocation.bytes; }

void Buffer::reserve(std::size_t bytes) {
  constexpr std::size_t kUnit = 16;
  const std::size_t least = std::max(kUnit, (bytes + kUnit - 1) / kUnit * kUnit);
  if (least <= size()) return;
  const Candidate& about = impl_->device.about;
  // Both limits are rounded down so that what is asked for stays a multiple of the unit.
  const std::size_t most = std::min<std::size_t>(about.limits.storage_range, about.allocation) / kUnit * kUnit;
  if (least > most) {
    throw DeviceError(about.description.name + ": a buffer of " + bytes_text(bytes) +
                      " is more than the device can bind (" + bytes_text(most) + ")");
  }
  const std::size_t grown = std::clamp((size() + size() / 2) / kUnit * kUnit, least, most);
  impl_->allocation = {};
  impl_->allocation = allocate_local(impl_->device, grown);
  impl_->computed = false;
  if (impl_->device.poison) fill_at_once(*impl_, *impl_->device.poison);
}

}  // namespace bisector::host
