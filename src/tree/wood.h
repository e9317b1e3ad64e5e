// Which points of a scan are wood, as far as their surroundings tell: branches are lines, leaves are not.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// Whether a line through each of `asked` has more points along it, within `tolerance`, than chance would put there (a
// contrario detection, Desolneux, Moisan and Morel, Meaningful alignments, IJCV 2000): the chance that cells along a
// line are occupied is the share of those that are, of all around the point. Surfaces much larger than the distance of
// their points hold such lines too, patches of the size of leaves don't. The same for any number of threads.
std::vector<char> points_on_lines(const std::vector<Vec3>& points, const std::vector<char>& asked, double tolerance);

}  // namespace bisector
