// Remeshes a surface with about as many vertices as asked for. Usage: remesh IN OUT VERTICES
#include <bisector/error.h>
#include <bisector/io.h>
#include <bisector/remesh.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) try {
  if (argc != 4) return std::fputs("usage: remesh IN OUT VERTICES\n", stderr), 2;
  bisector::RemeshOptions options;
  options.vertices = std::strtoul(argv[3], nullptr, 10);
  bisector::Context context;
  context.warning = [](const std::string& line) { std::fprintf(stderr, "warning: %s\n", line.c_str()); };
  const bisector::RemeshResult result = bisector::remesh(bisector::read_mesh(argv[1], context), options, context);
  bisector::write_mesh(argv[2], result.mesh);
  std::printf("%zu vertices, %zu triangles; topology %s\n", result.mesh.vertices.size(), result.mesh.triangles.size(),
              result.topology_matches ? "as the input's" : "changed");
} catch (const bisector::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
