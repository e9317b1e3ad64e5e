// Includes BISECTOR_LANES_FILE once for each set of instructions, and defines of_widest_lanes() to choose between the
// results. Only GCC compiles parts of a source for other instructions than the rest by these directives.

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512vl")
namespace avx512 {
constexpr int kWidth = 8;
#include "core/lanes.inl"
#include BISECTOR_LANES_FILE
}  // namespace avx512
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
constexpr int kWidth = 4;
#include "core/lanes.inl"
#include BISECTOR_LANES_FILE
}  // namespace avx2
#pragma GCC pop_options
namespace portable {
constexpr int kWidth = 2;
#include "core/lanes.inl"
#include BISECTOR_LANES_FILE
}  // namespace portable
#else
namespace portable {
constexpr int kWidth = 2;
#include "core/lanes.inl"
#include BISECTOR_LANES_FILE
}  // namespace portable
namespace avx2 = portable;
namespace avx512 = portable;
#endif

template <class Function>
Function of_widest_lanes(Function with_avx512, Function with_avx2, Function portably) {
  switch (widest_lanes()) {
    case LaneSet::avx512: return with_avx512;
    case LaneSet::avx2: return with_avx2;
    case LaneSet::portable: break;
  }
  return portably;
}
