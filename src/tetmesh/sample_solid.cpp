#include "tetmesh/sample_solid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bisector/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "spatial/hilbert.h"

namespace bisector {
namespace {

// Barycentric coordinates of a uniform point: the lengths of the four gaps that three numbers leave in [0, 1].
std::array<double, 4> uniform_weights(Random& random) {
  std::array<double, 3> u{};
  for (double& x : u) x = random.uniform();
  std::sort(u.begin(), u.end());
  return {u[0], u[1] - u[0], u[2] - u[1], 1 - u[2]};
}

// Barycentric coordinates of a point with a density that is linear between the corners' values. That is the mixture of
// four densities, each 1 at one corner and 0 at the others, with the corners' values as weights. A point of the one of
// corner k is made of the five gaps that four numbers leave in [0, 1]: corner k has the sum of two of them (a Dirichlet
// distribution).
std::array<double, 4> linear_weights(Random& random, const std::array<double, 4>& density) {
  std::array<double, 4> u{}, w{};
  double pick = random.uniform() * (density[0] + density[1] + density[2] + density[3]);
  std::size_t k = 0;
  while (k < 3 && pick >= density[k]) pick -= density[k++];
  for (double& x : u) x = random.uniform();
  std::sort(u.begin(), u.end());
  w[k] = u[1];
  w[(k + 1) % 4] = u[2] - u[1];
  w[(k + 2) % 4] = u[3] - u[2];
  w[(k + 3) % 4] = 1 - u[3];
  return w;
}

}  // namespace

std::vector<Vec3> sample_solid(const TetMesh& mesh, std::size_t count, std::uint64_t random_seed,
                               const std::vector<double>& density) {
  std::vector<Vec3> centres(mesh.tets.size());
  for (std::size_t t = 0; t < centres.size(); ++t) {
    for (Index v : mesh.tets[t]) centres[t] += mesh.vertices[v];
    centres[t] *= 0.25;
  }
  const std::vector<Index> order = hilbert_order(centres);
  std::vector<double> sums(order.size());
  double sum = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto [a, b, c, d] = mesh.tets[order[k]];
    const double volume =
        std::abs(rounded_six_volume(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], mesh.vertices[d]));
    sum += density.empty() ? volume : volume * (density[a] + density[b] + density[c] + density[d]);
    sums[k] = sum;
  }
  if (!(sum > 0)) throw Error("sampling: the solid has no volume; check the mesh");
  std::vector<Vec3> points(count);
  parallel_each(count, [&](std::size_t i) {
    Random random(random_seed, i);
    const double at = (static_cast<double>(i) + random.uniform()) / static_cast<double>(count) * sum;
    const std::size_t k = std::min(
        static_cast<std::size_t>(std::upper_bound(sums.begin(), sums.end(), at) - sums.begin()), sums.size() - 1);
    const Tetrahedron& tet = mesh.tets[order[k]];
    const std::array<double, 4> w =
        density.empty() ? uniform_weights(random)
                        : linear_weights(random, {density[tet[0]], density[tet[1]], density[tet[2]], density[tet[3]]});
    Vec3 p;
    for (int m = 0; m < 4; ++m) p += w[m] * mesh.vertices[tet[m]];
    points[i] = p;
  });
  return points;
}

}  // namespace bisector
