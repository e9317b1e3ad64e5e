// The headers of this folder are read by the C++ of host/ and by the GLSL of kernels/, so that both agree on every
// struct, constant and place in a buffer. This one gives the two languages the same words.
#ifndef BISECTOR_KERNELS_LAYOUT_TYPES_H
#define BISECTOR_KERNELS_LAYOUT_TYPES_H

#ifdef __cplusplus

#include <array>
#include <cstddef>
#include <cstdint>

#define LAYOUT_CPLUSPLUS 1
#define LAYOUT_BEGIN namespace bisector::host {
#define LAYOUT_END }
#define LAYOUT_CONSTANT inline constexpr
#define PUSH_CONSTANTS(name) struct name

namespace bisector::host {
using uint = std::uint32_t;
using vec3 = std::array<float, 3>;  // in GLSL it starts at multiples of 16 bytes
}  // namespace bisector::host

#else

#define LAYOUT_CPLUSPLUS 0
#define LAYOUT_BEGIN
#define LAYOUT_END
#define LAYOUT_CONSTANT const
#define PUSH_CONSTANTS(name) layout(push_constant) uniform name

#endif
#endif
