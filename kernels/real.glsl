// Arithmetic in the precision of the build. Every operation is `precise`, so that none is fused or reordered: in double
// the results are those of src/core/geometry.h bit for bit, and in single the error bounds hold.
//
// A Point is a position as the host gives it: three doubles, or in single three pairs (high, low) of floats, which hold
// 48 of its 53 bits; what they leave out is bounded by `residual`, which the callers have among their push constants.

#include "layout/elements.h"

#if BISECTOR_DOUBLE
#define real double
#define real3 dvec3
const real kUnit = 1.1102230246251565e-16LF;  // 2^-53, rounding to nearest: checked when the device is opened
const uint kPointWords = kDoublePointWords;
struct Point {
  real3 high;
};
#else
#define real float
#define real3 vec3
const real kUnit = 1.1920929e-7;              // 2^-23: the direction of rounding is not promised
const uint kPointWords = kSinglePointWords;
struct Point {
  real3 high, low;
};
#endif

// Stands for infinity, which not every device keeps; the host keeps all squares below.
const real kInfinity = real(1e37);

real dot3(real3 a, real3 b) {
  precise real r = a.x * b.x + a.y * b.y + a.z * b.z;
  return r;
}

real norm2(real3 a) { return dot3(a, a); }

real3 cross3(real3 a, real3 b) {
  precise real3 r;
  r.x = a.y * b.z - a.z * b.y;
  r.y = a.z * b.x - a.x * b.z;
  r.z = a.x * b.y - a.y * b.x;
  return r;
}

real largest_of(real3 a) { return max(max(abs(a.x), abs(a.y)), abs(a.z)); }

#if BISECTOR_DOUBLE

real3 difference(Point a, Point b) {
  precise real3 r = a.high - b.high;
  return r;
}

// 1 / d correctly rounded, from additions and multiplications alone, for devices promise nothing about dividing
// doubles. With d in [1, 2) and y near 1 / d the residual 1 - d y is a multiple of 2^-105 below 2^-51, hence computed
// exactly, and tells which of y and its neighbours is nearest; no reciprocal lies half way. 0 if |d| is outside
// [2^-1000, 2^1000].
double reciprocal(double d) {
  const uvec2 words = unpackDouble2x32(d);
  const int exponent = int((words.y >> 20) & 0x7ffu) - 1023;
  if (abs(exponent) > 1000) return 0.0LF;
  const double m = packDouble2x32(uvec2(words.x, (words.y & 0xfffffu) | 0x3ff00000u));
  precise double y = double(1.0 / float(m));
  y = y * (2.0LF - m * y);
  y = y * (2.0LF - m * y);
  y = y * (2.0LF - m * y);
  // Dekker's product: m y = p + q.
  precise double p = m * y;
  precise double s = 134217729.0LF * m;
  precise double mh = s - (s - m);
  precise double ml = m - mh;
  precise double t = 134217729.0LF * y;
  precise double yh = t - (t - y);
  precise double yl = y - yh;
  precise double q = ((mh * yh - p) + mh * yl + ml * yh) + ml * yl;
  precise double residual = (1.0LF - p) - q;
  precise double half_place = m * 5.5511151231257827e-17LF;  // 2^-54
  precise double nearest = y;
  if (residual > half_place) nearest = y + 1.1102230246251565e-16LF;
  if (residual < -half_place) nearest = y - 1.1102230246251565e-16LF;
  const double scale = packDouble2x32(uvec2(0u, (words.y & 0x80000000u) | (uint(1023 - exponent) << 20)));
  precise double r = nearest * scale;
  return r;
}

#else

// Pairs of floats, a = high + low, for the few data whose terms are far larger than the cell (Dekker 1971; Knuth).
vec2 two_sum(float a, float b) {
  precise float s = a + b;
  precise float t = s - a;
  precise float e = (a - (s - t)) + (b - t);
  return vec2(s, e);
}

vec2 two_product(float a, float b) {
  precise float p = a * b;
  precise float s = 4097.0 * a;
  precise float ah = s - (s - a);
  precise float al = a - ah;
  precise float t = 4097.0 * b;
  precise float bh = t - (t - b);
  precise float bl = b - bh;
  precise float e = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
  return vec2(p, e);
}

vec2 pair_sum(vec2 a, vec2 b) {
  const vec2 s = two_sum(a.x, b.x);
  precise float low = s.y + (a.y + b.y);
  return two_sum(s.x, low);
}

vec2 pair_product(vec2 a, vec2 b) {
  const vec2 p = two_product(a.x, b.x);
  precise float low = p.y + (a.x * b.y + a.y * b.x);
  return two_sum(p.x, low);
}

vec2 pair_difference(Point a, Point b, int k) {
  return pair_sum(vec2(a.high[k], a.low[k]), vec2(-b.high[k], -b.low[k]));
}

real3 difference(Point a, Point b) {
  return real3(pair_difference(a, b, 0).x, pair_difference(a, b, 1).x, pair_difference(a, b, 2).x);
}

// v . (a - b)
float pair_dot(Point v, Point a, Point b) {
  vec2 sum = vec2(0.0);
  for (int k = 0; k < 3; ++k) sum = pair_sum(sum, pair_product(vec2(v.high[k], v.low[k]), pair_difference(a, b, k)));
  return sum.x;
}

float reciprocal(float d) { return 1.0 / d; }

#endif
