// A recorded run of kernels and transfers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "bisector/device.h"
#include "host/device/buffer.h"
#include "host/device/device.h"
#include "kernels/layout/sizes.h"

namespace bisector::host {

// Names one of the embedded SPIR-V modules (kernels/NAME.comp gives "NAME", or "NAME_single" and "NAME_double" where it
// is built for both precisions) and gives its specialisation constants 0, 1, ... The number of bindings and of bytes of
// push constants are read off the first dispatch.
struct Kernel {
  std::string name;
  std::vector<std::uint32_t> constants;
};

enum class Access { read, write, update };

struct Binding {
  const Buffer* buffer;
  Access access;
};
inline Binding reads(const Buffer& buffer) { return {&buffer, Access::read}; }
inline Binding writes(const Buffer& buffer) { return {&buffer, Access::write}; }
inline Binding updates(const Buffer& buffer) { return {&buffer, Access::update}; }

// What device time is counted for: one of the fields of DeviceSeconds.
using Phase = double DeviceSeconds::*;

// Sets, or reads, the bytes of items [first, first + count), which lie at `at`. Called for several ranges at once, from
// any thread.
using WriteItems = std::function<void(std::byte* at, std::size_t first, std::size_t count)>;
using ReadItems = std::function<void(const std::byte* at, std::size_t first, std::size_t count)>;

// Each command sees what the commands before it wrote: barriers are put where a buffer written before is touched again,
// and only for that buffer. Commands are recorded until run(), which submits them and waits.
class Commands {
 public:
  explicit Commands(Device& device);
  ~Commands();

  // What follows counts for this phase.
  void phase(Phase phase);
  void upload(const Buffer& buffer, std::size_t offset, const void* data, std::size_t bytes);  // data is copied at once
  // The same for `count` items of `item_bytes` each that `write` puts where the device reads them; it is called before
  // this returns.
  void upload_items(const Buffer& buffer, std::size_t item_bytes, std::size_t count, const WriteItems& write);
  // The bytes are at `to` when run() has returned.
  void download(const Buffer& buffer, std::size_t offset, void* to, std::size_t bytes);
  // The same for the first `count` items, which `read` takes from where the device puts them; it is called in run(), or
  // before.
  void download_items(const Buffer& buffer, std::size_t item_bytes, std::size_t count, ReadItems read);
  void copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset, std::size_t bytes);
  // offset and bytes are multiples of 4.
  void fill(const Buffer& buffer, std::size_t offset, std::size_t bytes, std::uint32_t word);

  // Runs the kernel with at least `items` invocations, in workgroups of kGroupSize laid out in x and y so that both
  // stay within the device's limits; none if items is 0. Bindings are numbered in order, set 0, each the whole buffer.
  template <class Push>
  void dispatch(const Kernel& kernel, std::initializer_list<Binding> bindings, const Push& push, std::size_t items) {
    static_assert(sizeof(Push) <= 128 && sizeof(Push) % 4 == 0);
    dispatch(kernel, bindings, &push, sizeof push, items);
  }
  // The same with the numbers of workgroups (3 words) read from `arguments` at `offset` on the device.
  template <class Push>
  void dispatch_indirect(const Kernel& kernel, std::initializer_list<Binding> bindings, const Push& push,
                         const Buffer& arguments, std::size_t offset) {
    static_assert(sizeof(Push) <= 128 && sizeof(Push) % 4 == 0);
    dispatch_indirect(kernel, bindings, &push, sizeof push, arguments, offset);
  }

  // Submits what was recorded and waits for it. Nothing is recorded afterwards. Throws DeviceError; then the downloads'
  // contents are undefined and the device is lost.
  void run();

  // Seconds on the device by phase, over all runs since the last call, which it clears. All 0 without timestamps.
  DeviceSeconds take_seconds();
  // What all runs since the last call came to, which it clears, but for the host's seconds.
  DeviceWork take_work();

 private:
  void dispatch(const Kernel&, std::initializer_list<Binding>, const void* push, std::size_t push_bytes,
                std::size_t items);
  void dispatch_indirect(const Kernel&, std::initializer_list<Binding>, const void* push, std::size_t push_bytes,
                         const Buffer& arguments, std::size_t offset);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bisector::host
