// Failures and adversity on purpose, for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/device/device.h"

namespace bisector::host {

enum class Fault { none, out_of_memory, device_lost };

// The `call`-th fallible Vulkan call from now on (from 0) fails with this; those before and after it do not.
void inject_fault(Fault fault, std::size_t call);
// Fallible calls since the last inject_fault().
std::size_t fallible_calls();
// From now on the names of such calls are appended here; null: nowhere.
void log_fallible_calls(std::vector<std::string>* names);

// Of the barriers between commands, the `ordinal`-th from now on (from 0) is not recorded; null: all are.
void leave_out_barrier(std::optional<std::size_t> ordinal);
// Barriers since the last leave_out_barrier().
std::size_t barriers();
// Whether the one left out stood between two kernels alone, of which each reads and writes all the buffers concerned.
bool left_out_between_updates();

// From now on the device has no double precision, or binds no more bytes than this.
void hide_float64(Device& device);
void limit_storage_range(Device& device, std::size_t bytes);

// From now on memory that the device's buffers get is full of this word.
void poison_new_memory(Device& device, std::uint32_t word);
// Overwrites what kernels have written so far into the device's buffers, but for those whose contents are kept from one
// evaluation to the next. To be called between evaluations. Throws DeviceError.
void poison_computed(Device& device, std::uint32_t word);

// Kernels that are used from now on for the first time take their items in another order, given by an odd number other
// than 1: workgroups go backwards, and the lanes of each are mixed.
void permute_invocations(Device& device, std::uint32_t odd);

}  // namespace bisector::host
