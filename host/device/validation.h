// Validation layers, for tests: BISECTOR_VULKAN_VALIDATION=1 enables them, 2 synchronisation and GPU-assisted checks
// too.
#pragma once

#include <cstddef>

namespace bisector::host {

// Warnings and errors of the validation layers so far, each of which was printed to stderr.
std::size_t validation_messages();

}  // namespace bisector::host
