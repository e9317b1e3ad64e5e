// Which instructions for several numbers at once are used.
//
// A source that has functions for them defines BISECTOR_LANES_FILE, the file they are in, and includes
// core/each_lanes.inl; what the file defines is then there in the namespaces avx512, avx2 and portable. All give the
// same bits.
#pragma once

namespace bisector {

enum class LaneSet { portable, avx2, avx512 };

// The widest set that this processor has, or the limit if that is less.
LaneSet widest_lanes();
// For tests.
void limit_lanes(LaneSet limit);

}  // namespace bisector
