// Words of messages and summaries.
#pragma once

#include <cstddef>
#include <exception>
#include <string>
#include <string_view>

#include "bisector/error.h"
#include "bisector/quality.h"

namespace bisector::job {

// Control characters become spaces.
std::string one_line(std::string_view text);

// "1 face", "2 faces".
std::string counted(std::size_t n, const char* one, const char* many);

// "manifold, closed, oriented, 1 component, Euler characteristic 2"
std::string describe(const MeshTopology& topology);

// An error of the library with the options that help.
std::string with_advice(const Error& error);
inline constexpr const char* kNoMemory = "not enough memory; ask for fewer vertices or use a larger machine";
// Whether the system refused a thread, which it does for want of memory, too.
bool wants_thread(const std::exception& error);
inline constexpr const char* kNoThread =
    "the system refuses another thread; give fewer --threads, or raise the limits of memory and processes";

}  // namespace bisector::job
