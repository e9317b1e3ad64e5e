// Which points of a scan are wood, as far as their surroundings tell: branches are lines, leaves are not.
#pragma once

#include <vector>

#include "core/geometry.h"

namespace bisector {

// Whether each point lies on a line along which there are more points, within `tolerance`, than chance would put there
// (a contrario detection, Desolneux, Moisan and Morel, Meaningful alignments, IJCV 2000): the chance that a cell of the
// line is occupied is the share of the space around that is. Only points count that small steps lead to, and in a
// second round only those that the first has taken. Surfaces much larger than their points' spacing hold such lines
// too, patches of the size of leaves don't. Those that are not `asked` are taken. The same for any number of threads.
std::vector<char> points_on_lines(const std::vector<Vec3>& points, const std::vector<char>& asked, double tolerance);

}  // namespace bisector
