// Computes the Voronoi diagram of seeds restricted to a surface: which triangles each cell meets, how large the cells
// are, and the dual triangles. Usage: diagram IN SEEDS.xyz PAIRS.txt DUAL.off
#include <bisector/diagram.h>
#include <bisector/error.h>
#include <bisector/io.h>

#include <cstdio>
#include <fstream>

int main(int argc, char** argv) try {
  if (argc != 5) return std::fputs("usage: diagram IN SEEDS.xyz PAIRS.txt DUAL.off\n", stderr), 2;
  const bisector::TriangleMesh surface = bisector::read_mesh(argv[1]);
  const std::vector<bisector::Vec3> seeds = bisector::read_points(argv[2]);
  const bisector::SurfaceDiagram diagram = bisector::compute_diagram(surface, {}, seeds);

  std::ofstream pairs(argv[3]);
  for (const auto& pair : diagram.polygons.pairs) pairs << pair.triangle << ' ' << pair.cell << '\n';
  bisector::TriangleMesh dual;
  dual.vertices = seeds;
  dual.triangles = diagram.dual.triangles;
  bisector::write_mesh(argv[4], dual);
  std::printf("%zu cells of %zu pieces, area %.6g, energy %.6g; %zu dual triangles\n", diagram.cells.size(),
              diagram.polygons.pairs.size(), diagram.mass, diagram.energy, dual.triangles.size());
} catch (const bisector::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
