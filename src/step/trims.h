// What `bisector segment --json` wrote, read back.
#pragma once

#include <string>
#include <vector>

#include "bisector/segment.h"
#include "core/geometry.h"

namespace bisector::step {

struct Use {
  Index chain = 0;
  bool reversed = false;
};

struct Region {
  Primitive surface;
  bool same_sense = true;
  bool has_outer = false;  // the first loop is, and the region can be laid flat
  double area = 0, rms = 0;
  std::vector<std::vector<Use>> loops;
};

struct Chain {
  std::vector<Index> vertices;
  std::vector<Vec3> points;
  bool closed = false;
  std::vector<Index> regions;  // one or two
};

struct Trims {
  std::vector<Region> regions;
  std::vector<Chain> chains;
  double diagonal = 0;
};

// Throws Error, naming the file and the key, for what is no such file.
Trims read_trims(const std::string& path);

}  // namespace bisector::step
