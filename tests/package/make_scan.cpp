// Writes the points of a small generated tree, a line each. Usage: make_scan OUT.xyz
#include <cstdio>

#include "support/tree_model.h"

int main(int, char** argv) {
  std::FILE* const out = std::fopen(argv[1], "w");
  if (!out) return 1;
  for (const bisector::Vec3& p : bisector::test::make_tree({.points = 6'000, .boughs = 3, .random_seed = 1}).points)
    std::fprintf(out, "%.17g %.17g %.17g\n", p.x, p.y, p.z);
  return std::fclose(out) == 0 ? 0 : 1;
}
