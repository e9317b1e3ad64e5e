// What a Buffer consists of.
#pragma once

#include "host/device/buffer.h"
#include "host/device/memory.h"

namespace bisector::host {

struct Buffer::Impl {
  Device::Impl& device;
  Allocation allocation;
};

}  // namespace bisector::host
