#include "features/candidates.h"

#include <algorithm>

namespace bisector {

namespace {

// Of one curve, however long it is in steps.
constexpr double kMostSamples = 1e5;

}  // namespace

bool is_loop(const FeatureCurve& curve) { return curve.closed || curve.vertices.front() == curve.vertices.back(); }

std::vector<Index> reversed_vertices(std::vector<Index> vertices) {
  std::reverse(vertices.begin(), vertices.end());
  return vertices;
}

double length_of(const std::vector<Index>& chain, bool closed, const std::vector<Vec3>& vertices) {
  double length = 0;
  for (std::size_t k = 1; k < chain.size(); ++k) length += norm(vertices[chain[k]] - vertices[chain[k - 1]]);
  return closed ? length + norm(vertices[chain.front()] - vertices[chain.back()]) : length;
}

std::vector<double> arc_lengths(const std::vector<Index>& chain, const std::vector<Vec3>& vertices) {
  std::vector<double> at(chain.size(), 0);
  for (std::size_t k = 1; k < chain.size(); ++k) at[k] = at[k - 1] + norm(vertices[chain[k]] - vertices[chain[k - 1]]);
  return at;
}

std::vector<std::vector<Index>> divided(const std::vector<Index>& chain, const std::vector<std::size_t>& at) {
  std::vector<std::vector<Index>> parts;
  std::size_t begin = 0;
  const auto end_at = [&](std::size_t k) {
    parts.emplace_back(chain.begin() + static_cast<std::ptrdiff_t>(begin),
                       chain.begin() + static_cast<std::ptrdiff_t>(k + 1));
    begin = k;
  };
  for (const std::size_t k : at) end_at(k);
  end_at(chain.size() - 1);
  return parts;
}

std::vector<Sample> samples_of(const Candidate& candidate, const std::vector<Vec3>& vertices, double step) {
  const std::vector<Index>& chain = candidate.curve.vertices;
  const std::size_t segments = chain.size() - (candidate.curve.closed ? 0 : 1);
  step = std::max(step, length_of(chain, candidate.curve.closed, vertices) / kMostSamples);
  std::vector<Sample> samples;
  double at = 0, next = 0.5 * step;
  for (std::size_t k = 0; k < segments; ++k) {
    const Vec3 &a = vertices[chain[k]], &b = vertices[chain[(k + 1) % chain.size()]];
    const double length = norm(b - a);
    for (; next < at + length; next += step) samples.push_back({a + ((next - at) / length) * (b - a), next});
    at += length;
  }
  if (samples.empty()) samples.push_back({0.5 * (vertices[chain.front()] + vertices[chain.back()]), 0.5 * at});
  return samples;
}

}  // namespace bisector
