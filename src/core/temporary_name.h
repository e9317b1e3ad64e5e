// Names for files that are written before they get their own.
#pragma once

#include <string>

namespace bisector {

// ".bisector-" and 128 random bits, so that no file has it yet: neither one of another thread, of another machine on
// the same file system, nor one that a killed process with this one's number left. Throws std::system_error where the
// system has no random numbers.
std::string temporary_name();

}  // namespace bisector
