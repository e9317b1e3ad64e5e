// What descents keep on a device, all in double precision: vectors of three reals for each seed by the caller's index,
// and numbers.
#ifndef BISECTOR_KERNELS_LAYOUT_DESCENT_H
#define BISECTOR_KERNELS_LAYOUT_DESCENT_H

#include "types.h"

LAYOUT_BEGIN

// Numbers: the coefficient of each pair of L-BFGS, the factor gamma of the diagonal, and the sums that a step leads to.
LAYOUT_CONSTANT uint kMostPairs = 16;
LAYOUT_CONSTANT uint kGammaAt = 16;
LAYOUT_CONSTANT uint kSumsAt = 17;
LAYOUT_CONSTANT uint kMassSum = 0;
LAYOUT_CONSTANT uint kEnergySum = 1;
LAYOUT_CONSTANT uint kSlopeSum = 2;      // of the gradient along the direction
LAYOUT_CONSTANT uint kNextSlopeSum = 3;  // of the next gradient along it
LAYOUT_CONSTANT uint kGradientSum = 4;   // squared length of the next gradient
LAYOUT_CONSTANT uint kSySum = 5;         // products of the pair
LAYOUT_CONSTANT uint kSsSum = 6;
LAYOUT_CONSTANT uint kYySum = 7;
LAYOUT_CONSTANT uint kEmptySum = 8;  // empty cells of seeds that may be anywhere on the surface
LAYOUT_CONSTANT uint kStepSums = 9;
LAYOUT_CONSTANT uint kNumbers = 26;

// Sums of blocks that finish_sums.comp makes one of: a block of blocks.
LAYOUT_CONSTANT uint kMostToFinish = 1024;

// What a direction is changed by, and what it is multiplied with then.
LAYOUT_CONSTANT uint kNoUpdate = 0;
LAYOUT_CONSTANT uint kNegateUpdate = 1;  // direction := -v
LAYOUT_CONSTANT uint kAddUpdate = 2;     // direction += coefficient v
LAYOUT_CONSTANT uint kWeighUpdate = 3;   // direction_i *= w_i
LAYOUT_CONSTANT uint kScaleUpdate = 4;   // direction_i *= gamma w_i
LAYOUT_CONSTANT uint kNoProduct = 0;
LAYOUT_CONSTANT uint kDotProduct = 1;     // v . direction
LAYOUT_CONSTANT uint kWeighedSquare = 2;  // sum |v_i|^2 w_i

// What becomes of sums.
LAYOUT_CONSTANT uint kStoreSums = 0;
LAYOUT_CONSTANT uint kCoefficientSum = 1;  // coefficient := -(before + factor sum)
LAYOUT_CONSTANT uint kGammaSum = 2;        // gamma := factor / sum

// Words of a segment of a feature curve, twin of CurveSegment in src/features/curves.h.
LAYOUT_CONSTANT uint kSegmentWords = 16;
LAYOUT_CONSTANT uint kSegmentToAt = 3;
LAYOUT_CONSTANT uint kSegmentAlongAt = 6;
LAYOUT_CONSTANT uint kSegmentTangentAt = 9;
LAYOUT_CONSTANT uint kSegmentStartAt = 12;
LAYOUT_CONSTANT uint kSegmentEndAt = 13;
LAYOUT_CONSTANT uint kSegmentPerLengthAt = 14;
LAYOUT_CONSTANT uint kSegmentPerSquareAt = 15;

// Where a seed may be: a curve's number, or one of these. Of a curve: its first segment, the one after its last, and
// whether it is closed.
LAYOUT_CONSTANT uint kOnSurface = 0xffffffffu;
LAYOUT_CONSTANT uint kFixed = 0xfffffffeu;
LAYOUT_CONSTANT uint kCurveWords = 3;

// Bits of what is out of the device's reach.
LAYOUT_CONSTANT uint kFarSeeds = 1;
LAYOUT_CONSTANT uint kLongLoops = 2;

LAYOUT_END

#endif
