#include "mesh/locate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/grouping.h"

namespace bisector {
namespace {

constexpr double kMostCells = 512;  // of the grid, in each direction
constexpr double kTiny = 1e-300;    // length in place of 0, so that nothing is divided by it

// The barycentric coordinates of p; all are -infinity if the tetrahedron has no volume.
std::array<double, 4> barycentric(const TetMesh& mesh, const Tetrahedron& tet, const Vec3& p) {
  const Vec3 v[4] = {mesh.vertices[tet[0]], mesh.vertices[tet[1]], mesh.vertices[tet[2]], mesh.vertices[tet[3]]};
  const double whole = rounded_six_volume(v[0], v[1], v[2], v[3]), none = -std::numeric_limits<double>::infinity();
  if (whole == 0) return {none, none, none, none};
  return {rounded_six_volume(p, v[1], v[2], v[3]) / whole, rounded_six_volume(v[0], p, v[2], v[3]) / whole,
          rounded_six_volume(v[0], v[1], p, v[3]) / whole, rounded_six_volume(v[0], v[1], v[2], p) / whole};
}

}  // namespace

TetLocator::TetLocator(const TetMesh& mesh) : mesh_(mesh), box_(bounding_box(mesh.vertices)), size_{1, 1, 1} {
  const Vec3 extent = box_.hi - box_.lo;
  const double volume = std::max(extent.x, kTiny) * std::max(extent.y, kTiny) * std::max(extent.z, kTiny);
  const double longest = std::max({extent.x, extent.y, extent.z});
  const auto tets = static_cast<double>(std::max<std::size_t>(1, mesh.tets.size()));
  width_ = std::max({std::cbrt(volume / tets), longest / kMostCells, kTiny});
  for (int k = 0; k < 3; ++k) size_[k] = std::max(1, static_cast<int>(std::ceil(extent[k] / width_)));
  const auto for_each_cell = [&](const Tetrahedron& tet, const auto& visit) {
    Box box{mesh.vertices[tet[0]], mesh.vertices[tet[0]]};
    for (Index v : tet)
      for (int k = 0; k < 3; ++k) {
        box.lo[k] = std::min(box.lo[k], mesh.vertices[v][k]);
        box.hi[k] = std::max(box.hi[k], mesh.vertices[v][k]);
      }
    const auto from = cell_of(box.lo), to = cell_of(box.hi);
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x) visit((static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x);
  };
  const std::size_t cells = static_cast<std::size_t>(size_[0]) * size_[1] * size_[2];
  tets_ = group_into_rows<Index>(cells, [&](const auto& put) {
    for (Index t = 0; t < mesh.tets.size(); ++t) for_each_cell(mesh.tets[t], [&](std::size_t c) { put(c, t); });
  });
}

std::array<int, 3> TetLocator::cell_of(const Vec3& p) const {
  std::array<int, 3> cell;
  for (int k = 0; k < 3; ++k)
    cell[k] = static_cast<int>(std::clamp((p[k] - box_.lo[k]) / width_, 0.0, static_cast<double>(size_[k] - 1)));
  return cell;
}

std::array<double, 4> TetLocator::weights(Index tet, const Vec3& p) const {
  return barycentric(mesh_, mesh_.tets[tet], p);
}

Index TetLocator::nearest(const Vec3& p) const {
  const auto centre = cell_of(p);
  Index best = 0;
  double deepest = -std::numeric_limits<double>::infinity();
  const int most = std::max({size_[0], size_[1], size_[2]});
  // Once a tetrahedron was found one more ring is searched: what lies in the next cells may be nearer.
  for (int ring = 0, last = most; ring <= last; ++ring) {
    for (int z = centre[2] - ring; z <= centre[2] + ring; ++z)
      for (int y = centre[1] - ring; y <= centre[1] + ring; ++y)
        for (int x = centre[0] - ring; x <= centre[0] + ring; ++x) {
          if (std::max({std::abs(x - centre[0]), std::abs(y - centre[1]), std::abs(z - centre[2])}) != ring) continue;
          if (x < 0 || y < 0 || z < 0 || x >= size_[0] || y >= size_[1] || z >= size_[2]) continue;
          const std::size_t c = (static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x;
          for (const Index* t = tets_.begin(c); t != tets_.end(c); ++t) {
            const std::array<double, 4> w = barycentric(mesh_, mesh_.tets[*t], p);
            const double d = *std::min_element(w.begin(), w.end());
            if (d > deepest) {
              deepest = d;
              best = *t;
            }
          }
        }
    if (deepest >= 0) return best;
    if (deepest > -std::numeric_limits<double>::infinity() && last == most) last = ring + 1;
  }
  return best;
}

}  // namespace bisector
