// Ranks that share a surface: who has what, halos, failures. Diagrams and runs of theirs are also those of the parity
// suites.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <new>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/remesh.h"
#include "compute/compute.h"
#include "core/random.h"
#include "distributed/distributed_backend.h"
#include "distributed/regions.h"
#include "support/diagram.h"
#include "support/models.h"
#include "support/run.h"
#include "support/thread_ranks.h"

namespace bisector::test {
namespace {

std::vector<Vec3> random_points(std::size_t count, std::uint64_t seed) {
  SplitMix64 random(seed);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = {random.range(-1, 1), random.range(-2, 2), random.range(0, 1)};
  return points;
}

bool is_in(const Box& box, const Vec3& p) {
  for (int k = 0; k < 3; ++k)
    if (p[k] < box.lo[k] || p[k] >= box.hi[k]) return false;
  return true;
}

TEST(Regions, ShareTheWeightAndFillSpace) {
  const std::vector<Vec3> points = random_points(20'000, 1);
  std::vector<double> weights;
  for (const Vec3& p : points) weights.push_back(p.y > 1 ? 10 : 1);
  const double whole = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (const int count : {1, 2, 3, 7, 16}) {
    SCOPED_TRACE(count);
    const Regions regions(points, weights, count);
    std::vector<double> shares(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < points.size(); ++i)
      shares[static_cast<std::size_t>(regions.at(points[i]))] += weights[i];
    for (const double share : shares) EXPECT_NEAR(share, whole / count, 0.01 * whole / count);
    for (const Vec3& p : random_points(1000, 2)) {
      const Vec3 anywhere = 3 * p;
      for (int r = 0; r < count; ++r) EXPECT_EQ(is_in(regions.box(r), anywhere), regions.at(anywhere) == r);
    }
    EXPECT_EQ(Regions(regions.nodes()).at(points[0]), regions.at(points[0]));
  }
}

// Points that no plane can part stay together, and the ranks that get none still have a region.
TEST(Regions, PointsAtOnePlace) {
  std::vector<Vec3> points(50, Vec3{1, 1, 1});
  points.push_back({2, 1, 1});
  const Regions regions(points, std::vector<double>(points.size(), 1), 5);
  for (const Vec3& p : random_points(100, 3)) {
    int found = 0;
    for (int r = 0; r < 5; ++r) found += is_in(regions.box(r), 5 * p);
    EXPECT_EQ(found, 1);
  }
}

// Seeds on the grid that the surface's vertices are on: nearly every decision is a tie, also where regions meet.
std::vector<Vec3> grid_seeds(int n) {
  std::vector<Vec3> seeds;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) seeds.push_back({i * 1.0 / n, j * 1.0 / n, (i + j) % 2 == 0 ? 0.0 : 1.0 / n});
  return seeds;
}

TriangleMesh flat_grid(int n) {
  TriangleMesh mesh;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) mesh.vertices.push_back({i * 1.0 / n, j * 1.0 / n, 0});
  const auto at = [n](int i, int j) { return static_cast<Index>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

class RankCounts : public testing::TestWithParam<std::size_t> {};

INSTANTIATE_TEST_SUITE_P(Distributed, RankCounts, testing::Values(1, 2, 3, 7));

TEST_P(RankCounts, TiesAreTheCpus) {
  const Surface surface(flat_grid(16));
  ThreadRanks ranks(GetParam());
  DistributedBackend backend(surface, NeighbourSource::nearest, ranks.root());
  for (const int n : {4, 8, 16, 32})
    expect_same_diagram(diagram_of(backend, grid_seeds(n)),
                        diagram_of(surface, grid_seeds(n), NeighbourSource::nearest));
}

// Seeds that move, come and go between diagrams, on few large and on many small facets.
TEST_P(RankCounts, SeedsThatMoveComeAndGo) {
  for (const TriangleMesh& mesh : {torus(60, 40), box(2)}) {
    const Surface surface(mesh);
    ThreadRanks ranks(GetParam());
    DistributedBackend backend(surface, NeighbourSource::nearest, ranks.root());
    SplitMix64 random(5);
    std::vector<Vec3> seeds = random_seeds(mesh, 2000, 4);
    for (int step = 0; step < 6; ++step) {
      SCOPED_TRACE(step);
      expect_same_diagram(diagram_of(backend, seeds), diagram_of(surface, seeds, NeighbourSource::nearest));
      for (Vec3& x : seeds) x += 0.01 * Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
      if (step == 2) seeds.erase(seeds.begin() + 100, seeds.begin() + 150);
      if (step == 3) seeds.insert(seeds.begin() + 10, {seeds[7], seeds[0] + Vec3{0.01, 0, 0}});
      if (step == 4) seeds.resize(5);
    }
  }
}

// Every rank has about its share of the facets and seeds, and knows no more than a strip beyond.
TEST_P(RankCounts, RanksHaveTheirShare) {
  const std::size_t ranks = GetParam();
  const TriangleMesh mesh = torus(200, 120);
  const Surface surface(mesh);
  ThreadRanks threads(ranks);
  DistributedBackend backend(surface, NeighbourSource::nearest, threads.root());
  const std::vector<Vec3> seeds = random_seeds(mesh, 20'000, 6);
  Diagram diagram;
  backend.evaluate(seeds, Want::moments, diagram);
  std::size_t facets = 0, home = 0;
  for (const PartFigures& part : backend.figures()) {
    facets += part.facets;
    home += part.home_seeds;
    EXPECT_NEAR(static_cast<double>(part.facets * ranks), static_cast<double>(surface.facets.size()),
                0.4 * static_cast<double>(surface.facets.size()));
    EXPECT_LT(part.halo_seeds, seeds.size() / 6);
    EXPECT_LT(part.halo, 12 * std::sqrt(surface.area / static_cast<double>(seeds.size())));
  }
  EXPECT_EQ(facets, surface.facets.size());
  EXPECT_EQ(home, seeds.size());
}

// A whole run through what remesh() computes with.
TEST_P(RankCounts, ARunIsTheCpus) {
  const TriangleMesh mesh = box(3);
  RemeshOptions options;
  options.vertices = 300;
  const RemeshResult reference = remesh(mesh, options);
  ThreadRanks ranks(GetParam());
  set_ranks(&ranks.root());
  const RemeshResult found = remesh(mesh, options);
  set_ranks(nullptr);
  EXPECT_TRUE(same_bits(found.mesh.vertices, reference.mesh.vertices));
  EXPECT_EQ(found.mesh.triangles, reference.mesh.triangles);
  EXPECT_NE(found.device.name.find(std::to_string(GetParam()) + " rank"), std::string::npos);
}

// --- Failures ---

// Fails instead of its k-th exchange.
class FailingCommunicator : public ThreadCommunicator {
 public:
  FailingCommunicator(Exchange& exchange, std::size_t rank, int when)
      : ThreadCommunicator(exchange, rank), when_(when) {}
  std::vector<std::string> exchange(std::vector<std::string> to) override {
    if (when_-- == 0) throw std::bad_alloc();
    return ThreadCommunicator::exchange(std::move(to));
  }
  bool has_failed() const { return when_ < 0; }

 private:
  int when_;
};

// Wherever a rank runs out of memory, rank 0 is told, nobody waits for ever, and the next diagram is right.
TEST(Ranks, AFailureIsHeardOfByAll) {
  const TriangleMesh mesh = torus(20, 12);
  const Surface surface(mesh);
  const std::vector<Vec3> seeds = random_seeds(mesh, 200, 8);
  const Diagram reference = diagram_of(surface, seeds, NeighbourSource::nearest);
  int failures = 0;
  for (const std::size_t failing : {0, 1}) {
    for (int when = 0; when < 40; ++when) {
      SCOPED_TRACE(when);
      Exchange exchange(2);
      FailingCommunicator root(exchange, 0, failing == 0 ? when : 1000), other(exchange, 1, failing == 1 ? when : 1000);
      Ranks ranks(root);
      std::thread thread([&] {
        Ranks others(other);
        serve(others);
      });
      const auto attempt = [&] {
        DistributedBackend backend(surface, NeighbourSource::nearest, ranks);
        expect_same_diagram(diagram_of(backend, seeds), reference);
      };
      for (int attempts = 0; attempts < 2; ++attempts) try {
          attempt();
        } catch (const RankFailed& error) {
          EXPECT_NE(std::string(error.what()).find("rank 1: not enough memory"), std::string::npos) << error.what();
          ++failures;
        } catch (const std::bad_alloc&) {
          EXPECT_EQ(failing, 0u);
          ++failures;
        }
      end_serving(ranks);
      thread.join();
    }
  }
  EXPECT_GE(failures, 20);
}

}  // namespace
}  // namespace bisector::test
