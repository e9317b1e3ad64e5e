// One pass of a stable radix sort over kRadixBits bits of the first word. Each invocation owns a run of consecutive
// items.
#define PUSH_RADIX
#include "layout/push.h"
#include "layout/sizes.h"

uint digit_of(uint key) { return (key >> shift) & (kRadixDigits - 1); }
