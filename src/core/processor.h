// The processor of this machine.
#pragma once

#include <string>

namespace bisector {

// As its maker calls it; "CPU" if unknown.
std::string processor_name();

}  // namespace bisector
