// Divides a mesh into the planes, quadrics and tori that it is made of, moves its vertices onto them and writes a group
// of faces for each. Usage: segment IN OUT.obj ERROR, where ERROR is in percent of the bounding box's diagonal
#include <bisector/error.h>
#include <bisector/io.h>
#include <bisector/segment.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) try {
  if (argc != 4) return std::fputs("usage: segment IN OUT.obj ERROR\n", stderr), 2;
  bisector::SegmentOptions options;
  options.error = std::strtod(argv[3], nullptr);
  options.project = true;
  bisector::TriangleMesh mesh = bisector::read_mesh(argv[1]);
  const bisector::SegmentResult result = bisector::segment(mesh, options);

  bisector::WriteOptions groups{"region"};
  for (const bisector::SegmentRegion& region : result.regions) {
    groups.names.emplace_back(bisector::name_of(bisector::type_of(region.proxy)));
    std::printf("%-22s %6zu triangles, rms distance %.3g\n", groups.names.back().c_str(), region.triangles, region.rms);
  }
  mesh.vertices = result.projected;
  mesh.labels.assign(result.labels.begin(), result.labels.end());
  bisector::write_mesh(argv[2], mesh, groups);
} catch (const bisector::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
