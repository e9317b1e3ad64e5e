#include "mesh/sampling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/parallel.h"
#include "core/random.h"

namespace bisector {

namespace {

void check_density(const TriangleMesh& mesh, const std::vector<double>& density) {
  if (!density.empty() && density.size() != mesh.vertices.size())
    throw Error("sampling: " + std::to_string(density.size()) + " densities for " +
                std::to_string(mesh.vertices.size()) + " vertices; give one per vertex");
  for (std::size_t v = 0; v < density.size(); ++v)
    if (!(std::isfinite(density[v]) && density[v] >= 0))
      throw Error("sampling: the density of vertex " + std::to_string(v) + " is no positive number; mend the density");
}

// Running sums of the triangles' integrals of density, up to the common factor 1/3.
std::vector<double> cumulative_mass(const TriangleMesh& mesh, const std::vector<double>& density) {
  std::vector<double> sums(mesh.triangles.size());
  double sum = 0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const double area = triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    sum += density.empty() ? area : area * (density[t[0]] + density[t[1]] + density[t[2]]);
    sums[i] = sum;
  }
  return sums;
}

// Uniform on the triangle: the three gaps that two uniform numbers leave in [0, 1].
std::array<double, 3> uniform_weights(Random& random) {
  double u = random.uniform(), v = random.uniform();
  if (v < u) std::swap(u, v);
  return {u, v - u, 1 - v};
}

// Density proportional to the weight of one corner k, Dirichlet(2, 1, 1): three numbers leave four gaps, k takes two.
// A linear density is the mixture of its corners' shares.
std::array<double, 3> linear_weights(Random& random, double d0, double d1, double d2) {
  const double pick = random.uniform() * (d0 + d1 + d2);
  const int k = pick < d0 ? 0 : pick < d0 + d1 ? 1 : 2;
  std::array<double, 3> u{random.uniform(), random.uniform(), random.uniform()};
  std::sort(u.begin(), u.end());
  std::array<double, 3> weights;
  weights[k] = u[1];
  weights[(k + 1) % 3] = u[2] - u[1];
  weights[(k + 2) % 3] = 1 - u[2];
  return weights;
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t random_seed,
                                          const std::vector<double>& density) {
  check_density(mesh, density);
  const std::vector<double> mass = cumulative_mass(mesh, density);
  if (mass.empty() || !(mass.back() > 0)) throw Error("sampling: the surface has no area; check the mesh");

  std::vector<SurfaceSample> samples(count);
  parallel_each(count, [&](std::size_t i) {
    Random random(random_seed, i);
    const double at = random.uniform() * mass.back();
    auto found = std::upper_bound(mass.begin(), mass.end(), at);
    // A product may be rounded up to the sum itself, as where that is the least number there is.
    if (found == mass.end()) found = std::lower_bound(mass.begin(), mass.end(), at);
    const auto triangle = static_cast<Index>(found - mass.begin());
    const auto [a, b, c] = mesh.triangles[triangle];
    const auto w =
        density.empty() ? uniform_weights(random) : linear_weights(random, density[a], density[b], density[c]);
    samples[i] = {w[0] * mesh.vertices[a] + w[1] * mesh.vertices[b] + w[2] * mesh.vertices[c], triangle};
  });
  return samples;
}

}  // namespace bisector
