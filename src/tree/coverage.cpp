#include "tree/coverage.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bisector/error.h"
#include "core/parallel.h"
#include "mesh/sampling.h"
#include "spatial/kd_tree.h"
#include "spatial/nearest.h"

namespace bisector {
namespace {

constexpr std::size_t kAreaSamples = 20'000;
constexpr std::size_t kAxisSamples = 100;  // intervals of the axis' parameter

void check_labels(const TriangleMesh& mesh, std::size_t surfaces) {
  if (mesh.labels.size() != mesh.triangles.size())
    throw Error(
        fmt::format("coverage: {} labels for {} triangles; give one each", mesh.labels.size(), mesh.triangles.size()));
  for (const std::int32_t label : mesh.labels)
    if (label < 0 || static_cast<std::size_t>(label) >= surfaces)
      throw Error(fmt::format("coverage: label {} with {} surfaces; give each triangle its surface", label, surfaces));
}

// Points along each axis, one after the other.
std::vector<Vec3> sample_axes(const std::vector<BranchSurface>& surfaces) {
  std::vector<Vec3> samples(surfaces.size() * (kAxisSamples + 1));
  parallel_each(
      surfaces.size(),
      [&](std::size_t b) {
        for (std::size_t k = 0; k <= kAxisSamples; ++k)
          samples[b * (kAxisSamples + 1) + k] = surfaces[b].axis.point(static_cast<double>(k) / kAxisSamples);
      },
      8);
  return samples;
}

double radius_near(const BranchSurface& surface, const Vec3* axis, const Vec3& p) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k <= kAxisSamples; ++k)
    if (const double d = norm2(axis[k] - p); d < least) {
      least = d;
      best = k;
    }
  return surface.radius(static_cast<double>(best) / kAxisSamples);
}

template <class Condition>
double share(const std::vector<PointCoverage>& points, const Condition& condition) {
  if (points.empty()) return 0;
  return static_cast<double>(std::count_if(points.begin(), points.end(), condition)) /
         static_cast<double>(points.size());
}

}  // namespace

std::vector<PointCoverage> cover_points(const std::vector<Vec3>& points, const std::vector<BranchSurface>& surfaces,
                                        const TriangleMesh& mesh, const Context& context) {
  check_labels(mesh, surfaces.size());
  context.check();
  const NearestOnMesh nearest(mesh);
  const std::vector<Vec3> axes = sample_axes(surfaces);
  std::vector<PointCoverage> covered(points.size());
  parallel_each(points.size(), [&](std::size_t p) {
    context.check();
    const NearestPoint foot = nearest.nearest(points[p]);
    const auto branch = static_cast<std::size_t>(mesh.labels[foot.triangle]);
    covered[p] = {norm(foot.point - points[p]), static_cast<Index>(branch),
                  radius_near(surfaces[branch], &axes[branch * (kAxisSamples + 1)], foot.point)};
  });
  return covered;
}

double share_within(const std::vector<PointCoverage>& points, double distance) {
  return share(points, [&](const PointCoverage& p) { return p.distance <= distance; });
}

double share_within_radii(const std::vector<PointCoverage>& points, double radii) {
  return share(points, [&](const PointCoverage& p) { return p.distance <= radii * p.radius; });
}

double bare_area(const TriangleMesh& mesh, const std::vector<Vec3>& points, double distance) {
  const PointSet set{points};
  const KdTree tree(3, set);
  const std::vector<SurfaceSample> samples = sample_surface(mesh, kAreaSamples, 1);
  std::vector<char> bare(samples.size(), 0);
  parallel_each(samples.size(), [&](std::size_t k) {
    const double at[3] = {samples[k].point.x, samples[k].point.y, samples[k].point.z};
    Index nearest = 0;
    double squared = 0;
    tree.knnSearch(at, 1, &nearest, &squared);
    bare[k] = squared > distance * distance;
  });
  return static_cast<double>(std::count(bare.begin(), bare.end(), 1)) / static_cast<double>(kAreaSamples);
}

}  // namespace bisector
