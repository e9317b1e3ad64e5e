// What the kernels use arithmetic for, on pairs of numbers, for the host to compare: sums and products, the error terms
// that contraction or wrong rounding spoil, reciprocals, and in double precision conversions.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "real.glsl"

#define PUSH_COUNT
#include "layout/push.h"

#if BISECTOR_DOUBLE

layout(std430, binding = 0) readonly buffer Pairs { uvec4 pairs[]; };
layout(std430, binding = 1) writeonly buffer Results { uvec2 results[]; };

double two_sum_error(double a, double b) {
  precise double sum = a + b;
  precise double virtual_b = sum - a;
  precise double virtual_a = sum - virtual_b;
  precise double rest_b = b - virtual_b;
  precise double rest_a = a - virtual_a;
  precise double error = rest_a + rest_b;
  return error;
}

// Dekker's splitting into halves of 26 bits.
void split(double a, out precise double high, out precise double low) {
  precise double c = 134217729.0lf * a;
  precise double big = c - a;
  high = c - big;
  low = a - high;
}

double two_product_error(double a, double b) {
  precise double product = a * b;
  precise double a_high, a_low, b_high, b_low;
  split(a, a_high, a_low);
  split(b, b_high, b_low);
  precise double high_high = a_high * b_high;
  precise double low_high = a_low * b_high;
  precise double high_low = a_high * b_low;
  precise double low_low = a_low * b_low;
  precise double error = high_high - product;
  error = error + low_high;
  error = error + high_low;
  error = error + low_low;
  return error;
}

void main() {
  const uint i = invocation();
  if (i >= count) return;
  double a = packDouble2x32(pairs[i].xy), b = packDouble2x32(pairs[i].zw);
  precise double sum = a + b;
  precise double difference = a - b;
  precise double product = a * b;
  precise double product_then_sum = product + b;
  results[9 * i] = unpackDouble2x32(sum);
  results[9 * i + 1] = unpackDouble2x32(difference);
  results[9 * i + 2] = unpackDouble2x32(product);
  results[9 * i + 3] = unpackDouble2x32(product_then_sum);
  results[9 * i + 4] = unpackDouble2x32(two_sum_error(a, b));
  results[9 * i + 5] = unpackDouble2x32(two_product_error(a, b));
  results[9 * i + 6] = unpackDouble2x32(double(int(pairs[i].x)));
  // A multiple of 2^-20 below 2^30 in magnitude, cut to an integer.
  double bounded = double(int(pairs[i].z)) * 0.25lf;
  results[9 * i + 7] = uvec2(uint(int(bounded)), a < b ? 1u : 0u);
  results[9 * i + 8] = unpackDouble2x32(reciprocal(a));
}

#else

layout(std430, binding = 0) readonly buffer Pairs { vec2 pairs[]; };
layout(std430, binding = 1) writeonly buffer Results { float results[]; };

void main() {
  const uint i = invocation();
  if (i >= count) return;
  float a = pairs[i].x, b = pairs[i].y;
  precise float sum = a + b;
  precise float difference = a - b;
  precise float product = a * b;
  const vec2 pair_of_sum = two_sum(a, b), pair_of_product = two_product(a, b);
  results[8 * i] = sum;
  results[8 * i + 1] = difference;
  results[8 * i + 2] = product;
  results[8 * i + 3] = pair_of_sum.x;
  results[8 * i + 4] = pair_of_sum.y;
  results[8 * i + 5] = pair_of_product.x;
  results[8 * i + 6] = pair_of_product.y;
  results[8 * i + 7] = reciprocal(a);
}

#endif
