// What bisector-tetgen answers.
#pragma once

#include <string>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct TetgenReply {
  std::vector<Vec3> points;
  std::vector<Tetrahedron> tets;
};

// Throws Error if the bytes are not a whole answer of this version, or name points that are not there.
TetgenReply parse_reply(const std::string& bytes);

}  // namespace bisector
