#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <stdexcept>
#include <vector>

#include "bisector/error.h"
#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/single.h"
#include "core/stopwatch.h"
#include "core/words.h"

namespace bisector {
namespace {

TEST(Geometry, UnitVectorsHaveTheDirectionAndLength1) {
  const Vec3 a{3, -4, 12};
  EXPECT_NEAR(norm(unit(a)), 1, 1e-15);
  EXPECT_NEAR(dot(unit(a), a), 13, 1e-14);
  EXPECT_EQ(unit(Vec3{}), Vec3{});
}

// As plain conversions do not with g++ 12 at -O2.
TEST(Single, RoundsEachOfSeveralAtOnce) {
  const auto rounded = [](const Vec3& p) { return Vec3{to_single(p.x), to_single(p.y), to_single(p.z)}; };
  volatile double third = 1.0 / 3;
  const Vec3 p{third, 0.1 + third, 1e-50 * third}, q = rounded(p);
  for (int k = 0; k < 3; ++k) {
    const volatile float single = static_cast<float>(p[k]);
    EXPECT_EQ(q[k], single);
    EXPECT_NE(q[k], p[k]);
  }
}

TEST(Geometry, PerpendicularVectorsHaveLength1) {
  for (const Vec3& a : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{-1, 2, 3}, Vec3{5, 0.1, 0}}) {
    const Vec3 n = unit(a), u = perpendicular(n);
    EXPECT_NEAR(dot(n, u), 0, 1e-15);
    EXPECT_NEAR(norm(u), 1, 1e-15);
  }
}

TEST(Geometry, NearestPointsOfASegment) {
  const Vec3 a{0, 0, 0}, b{2, 0, 0};
  EXPECT_EQ(nearest_on_segment({1, 5, 0}, a, b), (Vec3{1, 0, 0}));
  EXPECT_EQ(nearest_on_segment({-1, 5, 0}, a, b), a);
  EXPECT_EQ(nearest_on_segment({3, 5, 0}, a, b), b);
  EXPECT_EQ(nearest_parameter({1, 5, 0}, a, b), 0.5);
  EXPECT_EQ(nearest_on_segment({1, 5, 0}, b, b), b);
}

TEST(Geometry, CounterClockwiseTrianglesFaceUpwards) {
  EXPECT_EQ(twice_area_normal({0, 0, 0}, {2, 0, 0}, {0, 3, 0}), (Vec3{0, 0, 6}));
  EXPECT_EQ(rounded_six_volume({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1);
}

TEST(Grouping, RowsKeepTheOrderOfTheirValues) {
  const Csr<int> rows = group_into_rows<int>(3, [](const auto& put) {
    put(2, 7);
    put(0, 5);
    put(2, 6);
  });
  EXPECT_EQ(rows.offsets, (std::vector<std::size_t>{0, 1, 1, 3}));
  EXPECT_EQ(rows.values, (std::vector<int>{5, 7, 6}));
}

TEST(Grouping, ByVertexAndByLabel) {
  const std::vector<Triangle> triangles{{0, 1, 2}, {2, 1, 3}};
  const Csr<std::size_t> at_vertices = items_at_vertices<std::size_t>(triangles, 5);
  EXPECT_EQ(at_vertices.offsets, (std::vector<std::size_t>{0, 1, 3, 5, 6, 6}));
  EXPECT_EQ(at_vertices.values, (std::vector<std::size_t>{0, 0, 1, 0, 1, 1}));

  const Csr<Index> of_labels = items_of_labels<Index>({1, 0, 1}, 2);
  EXPECT_EQ(of_labels.offsets, (std::vector<std::size_t>{0, 1, 3}));
  EXPECT_EQ(of_labels.values, (std::vector<Index>{1, 0, 2}));
}

enum class Fruit { apple, pear, quince };
constexpr auto kFruits = word_table<Fruit>({{Fruit::apple, "apple"}, {Fruit::pear, "pear"}});

TEST(Words, ParsesWhatItWrites) {
  for (const Fruit fruit : {Fruit::apple, Fruit::pear}) EXPECT_EQ(kFruits.parse(kFruits.word_of(fruit)), fruit);
  EXPECT_EQ(kFruits.list(), "apple, pear");
}

TEST(Words, UnknownWordsAndValuesAreRefused) {
  try {
    kFruits.parse("plum");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "'plum' is none of apple, pear");
  }
  EXPECT_THROW(kFruits.word_of(Fruit::quince), std::logic_error);
}

// Chains in random order make all threads hook the same few roots.
TEST(ConcurrentSets, AsManyCallsJoinAsThereAreSetsFewer) {
  constexpr std::size_t kItems = 20000, kLinks = 50000;
  std::vector<std::array<std::size_t, 2>> links;
  for (std::size_t k = 0; k < kLinks; ++k) {
    Random random(3, k);
    const std::size_t i = random.bits() % kItems, step = random.bits() % 3;
    links.push_back({i, (i + step) % kItems});
  }
  DisjointSets<> expected(kItems);
  std::size_t joins = 0;
  for (const auto& [i, j] : links) joins += expected.join(i, j);
  for (int round = 0; round < 10; ++round) {
    ConcurrentSets<std::size_t> sets(kItems);
    std::atomic<std::size_t> found{0};
    parallel_each(
        kLinks, [&](std::size_t k) { found += sets.join(links[k][0], links[k][1]); }, 16);
    ASSERT_EQ(found, joins);
    for (std::size_t i = 0; i < kItems; ++i) ASSERT_EQ(sets.root(i), expected.root(i));
  }
}

TEST(Stopwatch, LapsAddUp) {
  Stopwatch watch;
  const double first = watch.lap(), second = watch.lap();
  EXPECT_GE(first, 0);
  EXPECT_GE(second, 0);
  EXPECT_GE(watch.seconds(), first + second);
}

}  // namespace
}  // namespace bisector
