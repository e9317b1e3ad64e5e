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

// Uniform on the tetrahedron: the gaps that three numbers leave in [0, 1]. A linear density is the mixture of its corners'
// shares, and the density of corner k alone is Dirichlet(.., 2, ..): four numbers leave five gaps, and k takes two.
std::array<double, 4> weights_of(Random& random, const double* density) {
  std::array<double, 4> u{};
  std::array<double, 4> w{};
  if (!density) {
    for (int k = 0; k < 3; ++k) u[k] = random.uniform();
    std::sort(u.begin(), u.begin() + 3);
    return {u[0], u[1] - u[0], u[2] - u[1], 1 - u[2]};
  }
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
    const Vec3 p = mesh.vertices[a];
    const double volume =
        std::abs(dot(mesh.vertices[b] - p, cross(mesh.vertices[c] - p, mesh.vertices[d] - p)));
    sum += density.empty() ? volume : volume * (density[a] + density[b] + density[c] + density[d]);
    sums[k] = sum;
  }
  if (!(sum > 0)) throw Error("sampling: the solid has no volume; check the mesh");
  std::vector<Vec3> points(count);
  parallel_each(count, [&](std::size_t i) {
    Random random(random_seed, i);
    const double at = (static_cast<double>(i) + random.uniform()) / static_cast<double>(count) * sum;
    const std::size_t k = std::min(static_cast<std::size_t>(std::upper_bound(sums.begin(), sums.end(), at) - sums.begin()),
                                   sums.size() - 1);
    const Tetrahedron& tet = mesh.tets[order[k]];
    double rho[4];
    for (int m = 0; m < 4 && !density.empty(); ++m) rho[m] = density[tet[m]];
    const std::array<double, 4> w = weights_of(random, density.empty() ? nullptr : rho);
    Vec3 p;
    for (int m = 0; m < 4; ++m) p += w[m] * mesh.vertices[tet[m]];
    points[i] = p;
  });
  return points;
}

}  // namespace bisector
