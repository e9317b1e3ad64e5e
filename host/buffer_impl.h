// What a Buffer consists of.
#pragma once

#include "host/buffer.h"
#include "host/memory.h"

namespace bisector::host {

struct Buffer::Impl {
  Device::Impl& device;
  Allocation allocation;
};

}  // namespace bisector::host
