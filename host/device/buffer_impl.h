// What a Buffer consists of.
#pragma once

#include "host/device/buffer.h"
#include "host/device/memory.h"

namespace bisector::host {

struct Buffer::Impl {
  Impl(Device::Impl& owner, Lifetime contents);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Device::Impl& device;
  const Lifetime lifetime;
  Allocation allocation;
  bool computed = false;  // a kernel has written into it
};

}  // namespace bisector::host
