#include "segment/partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>
#include <vector>

#include "segment/coarsen.h"
#include "segment/improve_partition.h"
#include "segment/lloyd.h"
#include "segment/merge_regions.h"
#include "support/csg.h"
#include "support/models.h"

namespace bisector::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Lists, neighbours, distances and energies are what labels and proxies say.
void expect_consistent(const SegmentDomain& domain, const Partition& partition) {
  std::vector<std::set<Index>> neighbours(partition.count());
  std::vector<std::vector<Index>> triangles(partition.count());
  for (Index t = 0; t < partition.labels.size(); ++t) {
    const Index r = partition.labels[t];
    ASSERT_LT(r, partition.count());
    triangles[r].push_back(t);
    const double distance = distance_to(domain, t, partition.proxies[r]);
    EXPECT_NEAR(partition.distances[t], distance, 1e-9 * distance + 1e-20);
    for (const Index* n = domain.graph.neighbours.begin(t); n != domain.graph.neighbours.end(t); ++n)
      if (partition.labels[*n] != r) neighbours[r].insert(partition.labels[*n]);
  }
  EXPECT_EQ(triangles, partition.triangles);
  for (Index r = 0; r < partition.count(); ++r) {
    EXPECT_EQ(std::vector<Index>(neighbours[r].begin(), neighbours[r].end()), partition.neighbours[r]);
    double energy = 0;
    for (const Index t : triangles[r]) energy += partition.distances[t];
    EXPECT_NEAR(energy, partition.fits[r].energy, 1e-12 * energy);
    EXPECT_NEAR(sum_of_moments(domain, triangles[r]).area(), partition.fits[r].moments.area(), 1e-9);
  }
}

struct Example {
  explicit Example(std::size_t regions)
      : domain(make_segment_domain(csg_part(2000, 1e-3, 1).mesh)), lloyd(domain, SegmentSurfaces::all, context),
        editor(lloyd, 30, 1000 * domain.triangles.size()),
        partition(lloyd.fit(merge_into_planes(domain, regions, kInfinity, context), regions)) {}

  Context context;
  SegmentDomain domain;
  Lloyd lloyd;
  PartitionEditor editor;
  Partition partition;
};

TEST(Partition, StaysConsistentWhileItIsChanged) {
  Example run(12);
  expect_consistent(run.domain, run.partition);
  run.lloyd.iterate(run.partition, 30);
  expect_consistent(run.domain, run.partition);
  ASSERT_TRUE(run.editor.divide_best(run.partition, 4, 0));
  expect_consistent(run.domain, run.partition);
  const double before = run.partition.energy();
  run.editor.teleport(run.partition);
  expect_consistent(run.domain, run.partition);
  EXPECT_LE(run.partition.energy(), before);
  const std::size_t count = run.partition.count();
  ASSERT_TRUE(run.editor.remove_cheapest(run.partition, 3, kInfinity));
  expect_consistent(run.domain, run.partition);
  EXPECT_LT(run.partition.count(), count);
  EXPECT_GE(run.partition.count() + 3, count);
}

TEST(Partition, UndoTakesEverythingBack) {
  Example run(12);
  run.lloyd.iterate(run.partition, 30);
  const Partition before = run.partition;
  // Removals that would let the energy grow are refused after they were tried.
  EXPECT_FALSE(run.editor.remove_cheapest(run.partition, 3, before.energy() * (1 - 1e-6)));
  PartitionUndo undo(run.partition);
  undo.keep(run.partition, Index{0});
  run.partition.changed.assign(run.partition.count(), 1);
  run.lloyd.try_out(run.partition, 5, 0, undo);
  undo.restore(run.domain, run.partition);
  EXPECT_EQ(run.partition.labels, before.labels);
  EXPECT_EQ(run.partition.distances, before.distances);
  EXPECT_EQ(run.partition.energy(), before.energy());
  expect_consistent(run.domain, run.partition);
}

TEST(Coarsened, ClustersHaveTheMomentsOfTheirTriangles) {
  const SegmentDomain fine = make_segment_domain(csg_part(4000, 0, 1).mesh);
  const CoarseDomain coarse = coarsened(fine, 1000);
  const std::size_t count = coarse.domain.triangles.size();
  EXPECT_LE(count, 2000u);
  const std::vector<Index> parts = connected_parts(fine.graph, coarse.cluster_of);
  EXPECT_EQ(1 + *std::max_element(parts.begin(), parts.end()), count);
  std::vector<std::vector<Index>> triangles(count);
  for (Index t = 0; t < coarse.cluster_of.size(); ++t) triangles[coarse.cluster_of[t]].push_back(t);
  for (Index c = 0; c < count; ++c) {
    const SurfaceMoments sum = sum_of_moments(fine, triangles[c]), own = coarse.domain.moments(c, sum.origin);
    for (std::size_t k = 0; k < sum.m.size(); ++k) EXPECT_NEAR(own.m[k], sum.m[k], 1e-12);
    // Four samples give the exact integral of the squared distance to a plane.
    const PlaneFit plane = fit_plane(sum);
    EXPECT_NEAR(distance_to(coarse.domain, c, Proxy::of(plane_quadric(plane.normal, plane.offset))),
                plane.squared_distance, 1e-12);
  }
  // Two clusters are neighbours if two of their triangles are.
  std::set<std::pair<Index, Index>> expected, found;
  for (Index t = 0; t < coarse.cluster_of.size(); ++t)
    for (const Index* n = fine.graph.neighbours.begin(t); n != fine.graph.neighbours.end(t); ++n)
      if (coarse.cluster_of[t] != coarse.cluster_of[*n]) expected.emplace(coarse.cluster_of[t], coarse.cluster_of[*n]);
  const auto& neighbours = coarse.domain.graph.neighbours;
  for (Index c = 0; c < count; ++c)
    for (const Index* n = neighbours.begin(c); n != neighbours.end(c); ++n) found.emplace(c, *n);
  EXPECT_EQ(found, expected);
}

TEST(Coarsened, NoClusterCrossesASharpCrease) {
  // A cube of coplanar triangles: each cluster is flat.
  const SegmentDomain fine = make_segment_domain(box(16));
  const CoarseDomain coarse = coarsened(fine, 300);
  EXPECT_LE(coarse.domain.triangles.size(), 600u);
  for (const SurfaceMoments& moments : coarse.domain.clusters)
    EXPECT_LT(fit_plane(moments).squared_distance, 1e-12 * moments.area());
}

}  // namespace
}  // namespace bisector::test
