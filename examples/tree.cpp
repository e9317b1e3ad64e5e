// Reconstructs the branches of a leafless tree from a laser scan. Usage: tree SCAN OUT
#include <bisector/error.h>
#include <bisector/io.h>
#include <bisector/tree.h>

#include <cstdio>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fputs("usage: tree SCAN OUT\n", stderr), 2;
  const bisector::TreeResult tree = bisector::reconstruct_tree(bisector::read_points(argv[1]));
  bisector::write_tree(argv[2], tree, bisector::tree_mesh(tree));
  for (const bisector::TreeBranch& branch : tree.branches)
    if (branch.order < 2)
      std::printf("order %d: length %.3g, radius %.3g\n", branch.order, branch.length, branch.base_radius);
} catch (const bisector::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
