// What a process may ask the system for. Beyond it allocations fail with std::bad_alloc, so that a run ends with a word
// instead of being killed.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace bisector {

// Bytes of this process, used or not: all that is allocated, and the stacks of threads. Devices' memory does not count.
// A limit that is there already is not raised.
void limit_memory(std::uint64_t bytes);

// 0: none.
std::uint64_t memory_limit();

// Leaves a child what this process does not hold, so that the limit is of both.
void share_memory_limit(pid_t child);

}  // namespace bisector
