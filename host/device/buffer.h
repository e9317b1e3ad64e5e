// Storage buffers on a device.
#pragma once

#include <cstddef>
#include <memory>

#include "host/device/device.h"

namespace bisector::host {

// For how long what kernels write into a buffer is of use.
enum class Lifetime { evaluation, kept };

// Device-local memory for storage, transfers and indirect arguments. Memory is asked for once and kept for reuse.
class Buffer {
 public:
  explicit Buffer(Device& device, Lifetime lifetime = Lifetime::evaluation);
  ~Buffer();
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;

  // Makes room for at least `bytes`, at least 16; what was in it is lost if it has to grow. Not while commands that use
  // it are recorded and not yet run. Throws DeviceError if there is no memory, or one binding cannot span that much.
  void reserve(std::size_t bytes);
  std::size_t size() const;  // bytes; what was last reserved or more

  struct Impl;
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bisector::host
