#include "inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/repair.h"
#include "core/geometry.h"

namespace bisector::cli {
namespace {

// What is finer than its edges a mesh does not show. The triangles of a soup may lie upon each other, so that no more
// than the area of the bounding box counts.
double default_alpha(const TriangleMesh& mesh, std::size_t vertices, double edge_length) {
  constexpr double kFinest = 1.0 / 500, kCoarsest = 1.0 / 20;  // in diagonals of the bounding box
  const Box box = bounding_box(mesh.vertices);
  const Vec3 side = box.hi - box.lo;
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * norm(twice_area_normal(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]));
  area = std::min(area, 2 * (side.x * side.y + side.y * side.z + side.z * side.x));
  const double length =
      edge_length > 0 ? edge_length : std::sqrt(2 / std::numbers::sqrt3 * area / static_cast<double>(vertices));
  return std::clamp(length, kFinest * box.diagonal(), kCoarsest * box.diagonal());
}

}  // namespace

std::vector<Vec3> read_seeds(const std::string& path, std::size_t count) {
  std::vector<Vec3> seeds = read_points(path);
  if (count != 0 && count != seeds.size())
    throw Error(fmt::format("{}: {} in the file, but -n asks for {}; leave -n out", path,
                            counted(seeds.size(), "seed", "seeds"), count));
  return seeds;
}

Json wrap_if_asked(const WrapOption& option, const TriangleMesh& mesh, std::size_t vertices, double edge_length,
                   Console& console, TriangleMesh& wrapped) {
  if (!option.on) return nullptr;
  console.phase("wrapping");
  const double alpha = option.alpha > 0 ? option.alpha : default_alpha(mesh, vertices, edge_length);
  wrapped = wrap(mesh, alpha, console.context());
  if (!mesh.labels.empty()) console.warn("--wrap: the input's face labels are lost, for the wrap has faces of its own");
  return {{"alpha", alpha}, {"vertices", wrapped.vertices.size()}, {"faces", wrapped.triangles.size()}};
}

}  // namespace bisector::cli
