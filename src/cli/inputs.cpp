#include "inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "remesh/sizing.h"

namespace bisector::cli {
namespace {

// What is finer than its edges a mesh does not show. The triangles of a soup may lie upon each other, so that their
// area says little.
double default_alpha(const TriangleMesh& mesh, double edge) {
  constexpr double kFinest = 1.0 / 500, kCoarsest = 1.0 / 20;  // in diagonals of the bounding box
  const double diagonal = bounding_box(mesh.vertices).diagonal();
  return std::clamp(edge, kFinest * diagonal, kCoarsest * diagonal);
}

}  // namespace

std::vector<Vec3> read_seeds(const std::string& path, std::size_t count) {
  std::vector<Vec3> seeds = read_points(path);
  if (count != 0 && count != seeds.size())
    throw Error(fmt::format("{}: {} in the file, but -n asks for {}; leave -n out", path,
                            counted(seeds.size(), "seed", "seeds"), count));
  return seeds;
}

void leave_out_folds(const WrapOption& wrap, FeatureOptions& features) {
  if (wrap.on && features.mode == FeatureMode::automatic) features.mode = FeatureMode::none;
}

Json wrap_if_asked(const WrapOption& option, const TriangleMesh& mesh, std::size_t vertices, double edge_length,
                   bool tetrahedra, Console& console, TriangleMesh& wrapped) {
  if (!option.on) return nullptr;
  console.phase("wrapping");
  const SizingTarget target{edge_length > 0 ? 0 : vertices, edge_length};
  const double edge = compute_sizing(mesh, {}, target).unit_edge;
  const double alpha = option.alpha > 0 ? option.alpha : default_alpha(mesh, edge);
  // Both sides of a shell share the vertices, so its edges are longer than those of a mesh of the sheet.
  const double thickness = !tetrahedra ? 0 : edge_length > 0 ? edge : std::sqrt(2.0) * edge;
  WrapResult result = wrap(mesh, alpha, thickness, console.context());
  wrapped = std::move(result.mesh);
  if (thickness > 0 && 2 * result.offset >= thickness)
    console.warn(fmt::format(
        "--wrap: sheets with both sides outside became shells about an edge thick, {:.4g}, for tetrahedra to "
        "fit into them, and all of the wrap lies half of that outside; a larger ALPHA may close them",
        2 * result.offset));
  if (!mesh.labels.empty()) console.warn("--wrap: the input's face labels are lost, for the wrap has faces of its own");
  return {{"alpha", alpha},
          {"offset", result.offset},
          {"vertices", wrapped.vertices.size()},
          {"faces", wrapped.triangles.size()}};
}

}  // namespace bisector::cli
