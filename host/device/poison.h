// Words on purpose where memory has no meaning, for tests (host/device/faults.h).
#pragma once

#include <cstdint>

#include "host/device/buffer.h"

namespace bisector::host {

// Fills all of the buffer and waits for it. Throws DeviceError.
void fill_at_once(const Buffer::Impl& buffer, std::uint32_t word);

}  // namespace bisector::host
