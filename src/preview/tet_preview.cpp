#include "bisector/preview.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/colour.h"
#include "core/geometry.h"
#include "mesh/tet_adjacency.h"

namespace bisector {
namespace {

constexpr std::array<unsigned char, 3> kOutside{176, 196, 222}, kInside{238, 196, 112};
constexpr double kFlat = 0.3;  // depth by width below which the cut runs across instead
constexpr double kFirstHue = 0.11;

// Of the cut through each tetrahedron.
std::vector<std::array<unsigned char, 3>> colours_inside(const TetMesh& mesh) {
  std::vector<std::int32_t> regions = mesh.regions;
  std::sort(regions.begin(), regions.end());
  regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
  std::vector<std::array<unsigned char, 3>> colours(mesh.tets.size(), kInside);
  if (regions.size() < 2) return colours;
  for (std::size_t t = 0; t < colours.size(); ++t) {
    const auto rank = std::lower_bound(regions.begin(), regions.end(), mesh.regions[t]) - regions.begin();
    const std::array<double, 3> shares = shares_of_hue(kFirstHue + spread_hue(static_cast<double>(rank)));
    for (std::size_t k = 0; k < 3; ++k) colours[t][k] = static_cast<unsigned char>(110 + 135 * shares[k]);
  }
  return colours;
}

}  // namespace

void write_tet_preview(const std::string& path, const TetMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  const Vec3 extent = box.hi - box.lo, middle = 0.5 * (box.lo + box.hi);
  const int axis = extent.z < kFlat * extent.x ? 0 : 2;
  std::vector<char> shown(mesh.tets.size());
  for (std::size_t t = 0; t < shown.size(); ++t) {
    double sum = 0;
    for (Index v : mesh.tets[t]) sum += mesh.vertices[v][axis];
    shown[t] = 0.25 * sum <= middle[axis];
  }
  const auto adjacent = tet_adjacency(mesh.tets);
  const std::vector<std::array<unsigned char, 3>> inside = colours_inside(mesh);
  Csr<Index> facets;
  PreviewOptions options;
  for (std::size_t t = 0; t < shown.size(); ++t) {
    if (!shown[t]) continue;
    for (int k = 0; k < 4; ++k) {
      const Index across = adjacent[t][static_cast<std::size_t>(k)];
      if (across != kNone && shown[across]) continue;
      for (Index v : facet_of(mesh.tets[t], k)) facets.values.push_back(v);
      facets.offsets.push_back(facets.values.size());
      options.colours.push_back(across == kNone ? kOutside : inside[t]);
    }
  }
  write_preview(path, mesh.vertices, facets, options);
}

}  // namespace bisector
