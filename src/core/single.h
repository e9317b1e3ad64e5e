// Rounding to single precision.
#pragma once

namespace bisector {

// The float nearest to x. g++ 12 makes double(float(x)) of two neighbouring values x themselves (-ftree-slp-vectorize,
// which -O2 turns on); what passes through a register that it cannot see into it leaves alone.
inline float to_single(double x) {
#if defined(__GNUC__) && !defined(__clang__) && defined(__SSE2__)
  float single = static_cast<float>(x);
  asm("" : "+x"(single));
  return single;
#elif defined(__GNUC__) && !defined(__clang__)
  const volatile float single = static_cast<float>(x);
  return single;
#else
  return static_cast<float>(x);
#endif
}

}  // namespace bisector
