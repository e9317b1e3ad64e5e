#include "bisector/quality.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/magnitude.h"
#include "core/parallel.h"
#include "core/random.h"
#include "spatial/nearest.h"

namespace bisector {

namespace {

// The triangles that have an area: their running areas, and a tree over them.
class Surface {
 public:
  Surface(const TriangleMesh& mesh, const std::string& name) {
    const auto corners = [&](std::size_t i) {
      const Triangle& t = mesh.triangles[i];
      return std::array{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    };
    std::vector<double> areas(mesh.triangles.size());
    parallel_each(areas.size(), [&](std::size_t i) {
      const auto [a, b, c] = corners(i);
      areas[i] = triangle_area(a, b, c);
    });
    std::vector<char> used(mesh.vertices.size(), 0);
    double area = 0;
    for (std::size_t i = 0; i < areas.size(); ++i) {
      if (!(areas[i] > 0)) continue;
      area += areas[i];
      areas_.push_back(area);
      corners_.push_back(corners(i));
      for (const Index v : mesh.triangles[i]) used[v] = 1;
    }
    if (corners_.empty()) throw Error("distance: the " + name + " has no area; check the mesh");
    for (std::size_t v = 0; v < used.size(); ++v)
      if (used[v]) vertices_.push_back(mesh.vertices[v]);
    nearest_.emplace(mesh);
  }

  const std::vector<Vec3>& vertices() const { return vertices_; }

  // One uniform point in the k-th of n parts of equal area.
  Vec3 sample(std::size_t k, std::size_t n, std::uint64_t random_seed) const {
    Random random(random_seed, k);
    const double at = (static_cast<double>(k) + random.uniform()) / static_cast<double>(n) * areas_.back();
    const auto found = std::upper_bound(areas_.begin(), areas_.end() - 1, at);
    const std::array<Vec3, 3>& p = corners_[static_cast<std::size_t>(found - areas_.begin())];
    double u = random.uniform(), v = random.uniform();
    if (v < u) std::swap(u, v);
    return u * p[0] + (v - u) * p[1] + (1 - v) * p[2];
  }

  double squared_distance(const Vec3& p) const { return norm2(p - nearest_->nearest(p).point); }

 private:
  std::vector<double> areas_;
  std::vector<std::array<Vec3, 3>> corners_;
  std::vector<Vec3> vertices_;
  std::optional<NearestOnMesh> nearest_;
};

struct OneSided {
  double mean = 0, rms = 0, max = 0;
};

OneSided measure_one_side(const Surface& from, const Surface& to, std::size_t samples, std::uint64_t random_seed,
                          const Context& context) {
  const std::size_t vertices = from.vertices().size();
  std::vector<double> squared(samples + vertices);
  parallel_each(squared.size(), [&](std::size_t i) {
    context.check();
    squared[i] = to.squared_distance(i < samples ? from.sample(i, samples, random_seed) : from.vertices()[i - samples]);
  });
  OneSided side;
  side.max = std::sqrt(*std::max_element(squared.begin(), squared.end()));
  if (samples > 0) {
    const auto n = static_cast<double>(samples);
    side.mean = fixed_sum(samples, [&](std::size_t i) { return std::sqrt(squared[i]); }) / n;
    side.rms = std::sqrt(fixed_sum(samples, [&](std::size_t i) { return squared[i]; }) / n);
  }
  return side;
}

}  // namespace

DistanceReport measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference, std::size_t samples,
                                std::uint64_t random_seed, const Context& context) {
  require_moderate(mesh.vertices, "vertex");
  require_moderate(reference.vertices, "vertex of the reference");
  const Surface ours(mesh, "mesh");
  context.check();
  const Surface theirs(reference, "reference");
  const OneSided to = measure_one_side(ours, theirs, samples, random_seed, context);
  const OneSided from = measure_one_side(theirs, ours, samples, random_seed, context);
  const double percent = 100 / bounding_box(theirs.vertices()).diagonal();
  DistanceReport report;
  report.mean = percent * std::max(to.mean, from.mean);
  report.rms = percent * std::max(to.rms, from.rms);
  report.max = percent * std::max(to.max, from.max);
  report.rms_to_reference = percent * to.rms;
  report.rms_from_reference = percent * from.rms;
  report.samples = samples;
  return report;
}

DistanceReport measure_distance(const TriangleMesh& mesh, const TriangleMesh& reference, const Context& context) {
  return measure_distance(mesh, reference, kDistanceSamples, 1, context);
}

}  // namespace bisector
