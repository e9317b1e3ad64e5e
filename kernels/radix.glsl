// One pass of a stable radix sort over four bits of the first word. Each invocation owns a run of consecutive items.
const uint kRun = 64;
const uint kDigits = 16;

layout(push_constant) uniform Push {
  uint item_count;
  uint run_count;
  uint shift;
};

uint digit_of(uint key) { return (key >> shift) & (kDigits - 1); }
