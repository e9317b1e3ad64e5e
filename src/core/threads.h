// The threads of loops, before the loops.
#pragma once

namespace bisector {

// Starts, once in a process, the threads that loops may use by the limits that hold (core/parallel.h). TBB by itself
// starts them when they are wanted, some of them from others and some where a limit ends, where it aborts the process
// if the system refuses one. Throws std::system_error if it refuses one here.
void start_threads();

// Limits the threads of all loops for as long as the process lives, and starts them; 0 means all cores.
void start_threads(unsigned limit);

}  // namespace bisector
