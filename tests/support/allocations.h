// Hostile counts must not be believed: the largest request for memory is watched.
#pragma once

#include <cstddef>

namespace bisector::test {

extern thread_local std::size_t largest_allocation;

}  // namespace bisector::test
