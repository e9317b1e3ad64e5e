#include "features/placed_seeds.h"

#include <gtest/gtest.h>

#include "bisector/error.h"

namespace bisector::test {
namespace {

using Kind = SeedPlace::Kind;

// Seed i lies at (i, 0, 0), and its place names corner i.
PlacedSeeds numbered(Index count) {
  PlacedSeeds seeds;
  for (Index i = 0; i < count; ++i) seeds.add({double(i), 0, 0}, {i % 2 ? Kind::fixed : Kind::surface, kNone, i, 0});
  return seeds;
}

void expect_parallel(const PlacedSeeds& seeds) {
  ASSERT_EQ(seeds.positions().size(), seeds.places().size());
  for (std::size_t i = 0; i < seeds.size(); ++i)
    if (seeds.place(i).corner != kNone) {
      EXPECT_EQ(static_cast<double>(seeds.place(i).corner), seeds.position(i).x) << i;
    }
}

TEST(PlacedSeedsTest, AddingAndRemovingKeepPlacesParallel) {
  PlacedSeeds seeds = numbered(6);
  seeds.remove(std::vector<Index>{0, 4});
  seeds.add(std::vector<Vec3>{{9, 9, 9}, {8, 8, 8}});
  ASSERT_EQ(seeds.size(), 6u);
  expect_parallel(seeds);
  EXPECT_TRUE(seeds.on_surface(4));
  EXPECT_EQ(seeds.place(5).corner, kNone);
  seeds.remove(std::vector<char>{1, 0, 0, 0, 0, 1});
  ASSERT_EQ(seeds.size(), 4u);
  expect_parallel(seeds);
  EXPECT_EQ(seeds.position(0).x, 2);
  seeds.add(numbered(3));
  EXPECT_EQ(seeds.size(), 7u);
  expect_parallel(seeds);
}

TEST(PlacedSeedsTest, PlacesAreOneForEachSeedOrNone) {
  const std::vector<Vec3> points(3);
  EXPECT_EQ(PlacedSeeds(points, std::vector<SeedPlace>{}).places().size(), 3u);
  EXPECT_EQ(PlacedSeeds(points, SeedPlace{Kind::interior}).kind(2), Kind::interior);
  EXPECT_THROW(PlacedSeeds(points, std::vector<SeedPlace>(2)), Error);
}

}  // namespace
}  // namespace bisector::test
