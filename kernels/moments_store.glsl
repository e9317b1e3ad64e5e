// Moments of pairs in buffers of words, in the precision of the whole diagram: that of the build, or single where the
// double kernels help out (kNarrow).

#if BISECTOR_DOUBLE
void store_real(uint at, real value, bool of_first) {
  if (kNarrow) {
    const uint word = floatBitsToUint(float(value));
    if (of_first) first_moments[at] = word;
    else mass_second[at] = word;
  } else {
    const uvec2 words = unpackDouble2x32(value);
    if (of_first) {
      first_moments[2 * at] = words.x;
      first_moments[2 * at + 1] = words.y;
    } else {
      mass_second[2 * at] = words.x;
      mass_second[2 * at + 1] = words.y;
    }
  }
}
#else
void store_real(uint at, real value, bool of_first) {
  if (of_first) first_moments[at] = floatBitsToUint(value);
  else mass_second[at] = floatBitsToUint(value);
}
#endif

void store_moments(uint pair, Moments m) {
  store_real(kMassSecondWords * pair, m.mass, false);
  store_real(kMassSecondWords * pair + 1, m.second, false);
  for (uint k = 0; k < 3; ++k) store_real(kFirstWords * pair + k, m.first[k], true);
}
