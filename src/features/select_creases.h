// Which creases stay where they run beside each other.
#pragma once

#include <cstddef>
#include <vector>

#include "features/candidates.h"
#include "features/kept_curves.h"

namespace bisector {

struct SelectedCreases {
  std::vector<Candidate> curves;
  KeptCurves points;     // of these
  std::size_t gone = 0;  // candidates of which nothing stays
};

// A curve that comes back to its corner is one if it is longer than so many widths.
inline constexpr double kLoopWidths = 3;

// A curve runs beside itself where it is nearer than this part of the way along it: where it turns back at less than
// 17 degrees.
inline constexpr double kHairpin = 0.15;

// Of creases within `width` of each other (simplify_features) the heavier stays; candidates that are no creases stay
// all. `vertices` must outlive the result. `neighbours` are the vertices at the other ends of each vertex's edges, or
// empty.
SelectedCreases select_creases(std::vector<Candidate> candidates, const std::vector<Vec3>& vertices, double width,
                               const Csr<Index>& neighbours);

}  // namespace bisector
