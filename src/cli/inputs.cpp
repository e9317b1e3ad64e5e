#include "inputs.h"

#include <fmt/format.h>

#include <algorithm>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "remesh/sizing.h"

namespace bisector::cli {
namespace {

// What is finer than its edges a mesh does not show. The triangles of a soup may lie upon each other, so that their
// area says little.
double default_alpha(const TriangleMesh& mesh, std::size_t vertices, double edge_length) {
  constexpr double kFinest = 1.0 / 500, kCoarsest = 1.0 / 20;  // in diagonals of the bounding box
  const double diagonal = bounding_box(mesh.vertices).diagonal();
  const SizingTarget target{edge_length > 0 ? 0 : vertices, edge_length};
  return std::clamp(compute_sizing(mesh, {}, target).unit_edge, kFinest * diagonal, kCoarsest * diagonal);
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
                   Console& console, TriangleMesh& wrapped) {
  if (!option.on) return nullptr;
  console.phase("wrapping");
  const double alpha = option.alpha > 0 ? option.alpha : default_alpha(mesh, vertices, edge_length);
  wrapped = wrap(mesh, alpha, console.context());
  if (!mesh.labels.empty()) console.warn("--wrap: the input's face labels are lost, for the wrap has faces of its own");
  return {{"alpha", alpha}, {"vertices", wrapped.vertices.size()}, {"faces", wrapped.triangles.size()}};
}

}  // namespace bisector::cli
