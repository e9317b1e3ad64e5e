// The sum of a block of terms by the one rule of sums: in order, from the first one on.

#define BLOCK_SUM(name, data)                                                                  \
  double name(uint first, uint count) {                                                        \
    precise double sum = data[first];                                                          \
    [[dont_unroll]] for (uint k = 1; k < count; ++k) sum = sum + data[first + k];              \
    return sum;                                                                                \
  }
