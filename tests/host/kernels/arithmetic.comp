// Reciprocals in double precision, products of vectors of pairs in single.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "real.glsl"
#include "points.glsl"

layout(std430, binding = 0) readonly buffer Numbers { real numbers[]; };  // double: one each; single: three points each
layout(std430, binding = 1) writeonly buffer Results { real results[]; };
layout(push_constant) uniform Push { uint count; };
LOAD_POINT(point, numbers)

void main() {
  const uint i = invocation();
  if (i >= count) return;
#if BISECTOR_DOUBLE
  results[i] = reciprocal(numbers[i]);
#else
  results[i] = pair_dot(point(3 * i), point(3 * i + 1), point(3 * i + 2));
#endif
}
