// Inputs that several commands read.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bisector/mesh.h"

namespace bisector::cli {

// `count`: how many the command line asks for, or 0. Throws Error if the file has another number.
std::vector<Vec3> read_seeds(const std::string& path, std::size_t count);

}  // namespace bisector::cli
