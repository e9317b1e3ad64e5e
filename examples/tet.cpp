// Fills a closed surface with tetrahedra of about as many vertices as asked for. Usage: tet IN OUT VERTICES
#include <bisector/error.h>
#include <bisector/io.h>
#include <bisector/tetmesh.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) try {
  if (argc != 4) return std::fputs("usage: tet IN OUT VERTICES\n", stderr), 2;
  bisector::TetOptions options;
  options.vertices = std::strtoul(argv[3], nullptr, 10);
  const bisector::TetResult result = bisector::tetrahedralise(bisector::read_mesh(argv[1]), options);
  bisector::write_tet_mesh(argv[2], result.mesh);
  std::printf("%zu vertices, %zu tetrahedra; smallest dihedral angle %.1f degrees\n", result.mesh.vertices.size(),
              result.mesh.tets.size(), result.improved.after.dihedral_min);
} catch (const bisector::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
