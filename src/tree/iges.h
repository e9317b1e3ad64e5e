// B-spline surfaces as IGES 5.3, which CAD systems read (Initial Graphics Exchange Specification 5.3, 1996).
#pragma once

#include <string>
#include <vector>

#include "bisector/tree.h"

namespace bisector {

// One B-spline surface (entity 128, not rational) for each branch, clamped around the axis too, with its name (property
// 406, form 15). Numbers have as many of 17 digits as it takes to read back the same bits. The dates in the file are
// 1 January 1970, so that the same surfaces give the same file. Throws Error for no surfaces, numbers of surfaces and
// names that differ, names that are empty or not of printable ASCII, control points that are not finite, more than
// 9,999,999 lines, and if the file cannot be written.
void write_iges(const std::string& path, const std::vector<BranchSurface>& surfaces,
                const std::vector<std::string>& names, IgesUnit unit = IgesUnit::metre);

}  // namespace bisector
