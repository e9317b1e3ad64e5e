// The clipper's error bounds and filtered decisions against exact arithmetic, and the exact predicates against
// rationals and their own symmetries.
#include "voronoi/clip.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "support/models.h"
#include "support/rational.h"
#include "voronoi/error_bounds.h"
#include "voronoi/exact.h"

namespace bisector::test {
namespace {

Vec3 random_point(SplitMix64& random) { return {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; }

Vec3 random_direction(SplitMix64& random) {
  for (;;)
    if (const Vec3 p = random_point(random); norm2(p) > 0.01 && norm2(p) <= 1) return (1 / norm(p)) * p;
}

// --- Problems of one triangle of size about 1, and seeds ---

struct Problem {
  Vec3 corners[3];
  std::vector<Vec3> seeds;
};

enum class Shape { random, needle, cap };
enum class Seeding { random, cospherical, cocircular, grid, on_the_plane, over_the_plane, clustered, aligned, facing };

constexpr Shape kShapes[] = {Shape::random, Shape::needle, Shape::cap};
constexpr Seeding kSeedings[] = {Seeding::random,    Seeding::cospherical,  Seeding::cocircular,
                                 Seeding::grid,      Seeding::on_the_plane, Seeding::over_the_plane,
                                 Seeding::clustered, Seeding::aligned,      Seeding::facing};

Problem make_problem(SplitMix64& random, Shape shape, Seeding seeding, double thin, double jitter) {
  Problem p;
  const Vec3 u = random_direction(random), w = random_direction(random);
  const Vec3 n = cross(u, w), v = cross((1 / norm(n)) * n, u);
  p.corners[0] = 0.1 * random_point(random);
  switch (shape) {
    case Shape::random:
      p.corners[1] = random_point(random);
      p.corners[2] = random_point(random);
      break;
    case Shape::needle:
      p.corners[1] = p.corners[0] + u + 0.3 * thin * v;
      p.corners[2] = p.corners[0] + u + thin * v;
      break;
    case Shape::cap:
      p.corners[1] = p.corners[0] + u;
      p.corners[2] = p.corners[0] + random.unit() * u + thin * v;
      break;
  }
  const Vec3 a = p.corners[0], ab = p.corners[1] - a, ac = p.corners[2] - a;
  const Vec3 centre = a + 0.4 * ab + 0.3 * ac;
  const Vec3 normal = (1 / norm(cross(ab, ac))) * cross(ab, ac);
  const std::size_t count = 4 + random.below(20);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 noise = jitter * random_point(random);
    const double r = random.unit(), s = random.unit();
    switch (seeding) {
      case Seeding::random: p.seeds.push_back(a + r * ab + s * ac + 0.3 * random_point(random)); break;
      case Seeding::cospherical: p.seeds.push_back(centre + 0.5 * random_direction(random) + noise); break;
      case Seeding::cocircular: {
        const double phi = 6.3 * r;
        p.seeds.push_back(centre + 0.5 * (std::cos(phi) * u + std::sin(phi) * cross(normal, u)) + noise);
        break;
      }
      case Seeding::grid:
        p.seeds.push_back(centre +
                          0.25 * Vec3{static_cast<double>(i % 3) - 1, static_cast<double>(i / 3 % 3) - 1,
                                      static_cast<double>(i / 9) - 1} +
                          noise);
        break;
      case Seeding::on_the_plane: p.seeds.push_back(a + r * ab + s * ac + noise); break;
      case Seeding::over_the_plane: p.seeds.push_back(a + r * ab + s * ac + 20 * random.unit() * normal); break;
      case Seeding::clustered: p.seeds.push_back(centre + std::max(jitter, 1e-12) * random_point(random)); break;
      case Seeding::aligned: p.seeds.push_back(centre + (r - 0.5) * ab + noise); break;
      // Bisectors of the first that are all but parallel.
      case Seeding::facing: p.seeds.push_back(centre + (i ? 0.5 : -0.5) * u + noise); break;
    }
  }
  return p;
}

void place(Problem& p, double scale, const Vec3& at) {
  for (Vec3& q : p.corners) q = scale * (q + at);
  for (Vec3& x : p.seeds) x = scale * (x + at);
}

// --- Clipping in exact arithmetic only ---

struct ExactClipper {
  const SortedSeeds& seeds;
  const Facet& facet;
  Index slot;

  ExactFrame frame() const {
    return {{facet.corners[0], facet.corners[1], facet.corners[2]}, seeds.x[slot], seeds.id[slot]};
  }
  ExactLine line(Index label) const {
    if (is_edge(label)) return ExactLine::edge(static_cast<int>(((label & ~kEdgeLabel) + 2) % 3));
    return ExactLine::bisector(seeds.x[label], seeds.id[label]);
  }
  // Labels of the polygon from the smallest on, by every other seed in turn.
  std::vector<Index> labels() const {
    std::vector<Index> polygon{kEdgeLabel | 0, kEdgeLabel | 1, kEdgeLabel | 2};
    for (Index j = 0; j < seeds.x.size() && !polygon.empty(); ++j) {
      if (j == slot) continue;
      const std::size_t n = polygon.size();
      std::vector<int> side(n);  // of the vertex where label k starts
      for (std::size_t k = 0; k < n; ++k)
        side[k] = exact_side(frame(), line(polygon[(k + n - 1) % n]), line(polygon[k]), line(j));
      std::vector<Index> kept;
      for (std::size_t k = 0; k < n; ++k) {
        // A label stays if either of its ends does; after the last one comes the new edge.
        if (side[k] > 0 || side[(k + 1) % n] > 0) kept.push_back(polygon[k]);
        if (side[k] > 0 && side[(k + 1) % n] < 0) kept.push_back(j);
      }
      polygon = kept;
    }
    if (!polygon.empty()) std::rotate(polygon.begin(), std::min_element(polygon.begin(), polygon.end()), polygon.end());
    return polygon;
  }
};

struct Tally {
  std::size_t vertices = 0, cells = 0, uncertain = 0, decisions = 0, certain = 0;
  double worst = 0;  // error over slack
  std::size_t beyond = 0, wrong = 0, different = 0;

  Tally& operator+=(const Tally& b) {
    vertices += b.vertices, cells += b.cells, uncertain += b.uncertain, decisions += b.decisions, certain += b.certain;
    worst = std::max(worst, b.worst);
    beyond += b.beyond, wrong += b.wrong, different += b.different;
    return *this;
  }
};

std::vector<Index> labels_of(const Clipper& clipper) {
  std::vector<Index> labels;
  for (std::size_t k = 0; k < clipper.size(); ++k) labels.push_back(clipper.label(k));
  if (!labels.empty()) std::rotate(labels.begin(), std::min_element(labels.begin(), labels.end()), labels.end());
  return labels;
}

// Clips every cell of the problem; `all`: also repeats each clipping in exact arithmetic.
Tally check(const Problem& problem, bool all) {
  Tally tally;
  std::optional<Surface> surface;
  try {
    surface.emplace(TriangleMesh{{problem.corners[0], problem.corners[1], problem.corners[2]}, {{0, 1, 2}}, {}});
  } catch (const std::exception&) {
    return tally;  // collinear after rounding
  }
  const Facet& facet = surface->facets[0];
  const SortedSeeds seeds = sort_seeds(problem.seeds);
  Neighbours neighbours;
  neighbours.build(seeds, NeighbourSource::nearest);
  Clipper clipper;
  clipper.reset(seeds);
  clipper.begin(*surface, 0);
  for (Index slot = 0; slot < seeds.x.size(); ++slot) {
    const ExactClipper exact{seeds, facet, slot};
    const bool found = clipper.clip(neighbours, slot);
    tally.cells += found;
    tally.uncertain += clipper.uncertain();
    if (all && labels_of(clipper) != exact.labels()) ++tally.different;
    if (!found) continue;
    const std::size_t n = clipper.size();
    for (std::size_t k = 0; k < n; ++k) {
      const ExactLine before = exact.line(clipper.label((k + n - 1) % n)), after = exact.line(clipper.label(k));
      const Vec3 rounded = exact_vertex(exact.frame(), before, after);
      // The exact vertex is rounded itself: its quotient, and numerator and denominator before.
      const double largest = max_coordinate(clipper.vertex(k) - rounded) + 3 * kUnit * max_coordinate(rounded);
      ++tally.vertices;
      if (!(largest <= clipper.slack(k))) ++tally.beyond;
      tally.worst = std::max(tally.worst, largest / clipper.slack(k));
      // What the slack certifies about a seed that was not asked about.
      const Index other = (slot + 1) % static_cast<Index>(seeds.x.size());
      if (other == slot) continue;
      ++tally.decisions;
      const Vec3 d = seeds.x[other] - seeds.x[slot];
      const double along = dot(clipper.vertex(k), d);
      const double doubt = clipper.slack(k) * taxicab(d);
      const BisectorLimits limits(0.5 * norm2(d));
      const int side = along + doubt < limits.before ? 1 : along - doubt > limits.behind ? -1 : 0;
      if (side == 0) continue;
      ++tally.certain;
      bool on_bisector = clipper.label(k) == other || clipper.label((k + n - 1) % n) == other;
      if (on_bisector || side != exact_side(exact.frame(), before, after, exact.line(other))) ++tally.wrong;
    }
  }
  return tally;
}

struct Setting {
  const char* name;
  double scale;
  double distance;  // from the origin, in sizes
};

class ClipBounds : public testing::TestWithParam<Setting> {};

TEST_P(ClipBounds, HoldForEveryVertexAndDecision) {
  const auto& [name, scale, distance] = GetParam();
  constexpr double kThin[] = {0.3, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
  constexpr double kJitter[] = {0, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2};
  SplitMix64 random(static_cast<std::uint64_t>(scale * 1e9) + static_cast<std::uint64_t>(distance));
  Tally tally;
  int round = 0;
  while (tally.vertices < 150'000) {
    ++round;
    for (Shape shape : kShapes)
      for (Seeding seeding : kSeedings) {
        Problem p = make_problem(random, shape, seeding, kThin[random.below(std::size(kThin))],
                                 kJitter[random.below(std::size(kJitter))]);
        const Vec3 at = distance * random_direction(random);
        place(p, scale, at);
        tally += check(p, round % 4 == 0);
      }
  }
  EXPECT_EQ(tally.beyond, 0u);
  EXPECT_EQ(tally.wrong, 0u);
  EXPECT_EQ(tally.different, 0u);
  std::cout << "  " << tally.vertices << " vertices of " << tally.cells << " cells (" << tally.uncertain
            << " uncertain): largest error " << tally.worst << " of the slack; " << tally.certain << " of "
            << tally.decisions << " decisions certain\n";
}

INSTANTIATE_TEST_SUITE_P(Clip, ClipBounds,
                         testing::Values(Setting{"unit", 1, 0}, Setting{"away", 1, 1}, Setting{"afar", 1, 1e3},
                                         Setting{"remote", 1, 1e6}, Setting{"tiny", 1e-6, 0},
                                         Setting{"tiny_remote", 1e-6, 1e6}, Setting{"huge", 1e6, 0},
                                         Setting{"huge_remote", 1e6, 1e6}),
                         [](const auto& instance) { return instance.param.name; });

// Of seeds near and far from the origin, beside each other, and so near that their products underflow.
TEST(Clip, LimitsAreOnBothSidesOfTheExactBisector) {
  SplitMix64 random(5);
  for (int k = 0; k < 20000; ++k) {
    const double scale = std::pow(10.0, random.range(-170, 40)), apart = std::pow(10.0, random.range(-12, 1));
    const Vec3 x = scale * random_point(random), y = x + (scale * apart) * random_point(random);
    const mpq_class squared = exact_squared_distance(x, y);
    if (squared == 0) continue;
    const BisectorLimits limits(0.5 * norm2(y - x));
    ASSERT_LT(mpq_class(limits.before), squared / 2) << "scale " << scale << ", apart " << apart;
    ASSERT_GT(mpq_class(limits.behind), squared / 2) << "scale " << scale << ", apart " << apart;
  }
}

// Coordinates that are small integers: nearly every decision is a tie.
TEST(Clip, IntegerProblemsAreClippedAsInExactArithmetic) {
  SplitMix64 random(5);
  const auto point = [&] {
    return Vec3{static_cast<double>(random.below(5)), static_cast<double>(random.below(5)),
                static_cast<double>(random.below(5))};
  };
  Tally tally;
  for (int trial = 0; trial < 3000; ++trial) {
    Problem p;
    for (Vec3& q : p.corners) q = point();
    const std::size_t count = 1 + random.below(20);
    for (std::size_t i = 0; i < count; ++i) p.seeds.push_back(point());
    tally += check(p, true);
  }
  EXPECT_EQ(tally.beyond, 0u);
  EXPECT_EQ(tally.wrong, 0u);
  EXPECT_EQ(tally.different, 0u);
}

// --- Exact predicates ---

using Rational = mpq_class;
using RationalRow = std::array<Rational, 3>;

RationalRow rational_row(const ExactFrame& frame, const ExactLine& line) {
  RationalRow row;
  for (int m = 0; m < 3; ++m) {
    auto& r = row[static_cast<std::size_t>(m)];
    if (line.corner >= 0) {
      r = m == line.corner ? 1 : 0;
      continue;
    }
    r = 0;
    for (int k = 0; k < 3; ++k) {
      const Rational q = frame.corners[m][k], e = q - line.seed[k], f = q - frame.seed[k];
      r += e * e - f * f;
    }
  }
  return row;
}

RationalRow cross(const RationalRow& a, const RationalRow& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The vertices of a random problem's cells with their frames, for whatever is to be checked about them.
template <class Visit>
void each_vertex(std::uint64_t random_seed, int problems, const Visit& visit) {
  SplitMix64 random(random_seed);
  for (int trial = 0; trial < problems; ++trial) {
    Problem p = make_problem(random, kShapes[random.below(3)], kSeedings[random.below(std::size(kSeedings))],
                             std::pow(10, -6 * random.unit()), std::pow(10, -16 * random.unit()));
    place(p, std::pow(10, random.range(-6, 6)), std::pow(10, 6 * random.unit()) * random_direction(random));
    std::optional<Surface> surface;
    try {
      surface.emplace(TriangleMesh{{p.corners[0], p.corners[1], p.corners[2]}, {{0, 1, 2}}, {}});
    } catch (const std::exception&) {
      continue;
    }
    const SortedSeeds seeds = sort_seeds(p.seeds);
    for (Index slot = 0; slot < seeds.x.size(); ++slot) {
      const ExactClipper exact{seeds, surface->facets[0], slot};
      const std::vector<Index> labels = exact.labels();
      for (std::size_t k = 0; k < labels.size(); ++k)
        visit(exact, labels[(k + labels.size() - 1) % labels.size()], labels[k]);
    }
  }
}

TEST(Exact, VertexIsTheRoundedQuotient) {
  each_vertex(11, 400, [](const ExactClipper& exact, Index before, Index after) {
    const ExactFrame frame = exact.frame();
    const Vec3 got = exact_vertex(frame, exact.line(before), exact.line(after));
    const RationalRow at = cross(rational_row(frame, exact.line(before)), rational_row(frame, exact.line(after)));
    const Rational denominator = at[0] + at[1] + at[2];
    ASSERT_GT(sgn(denominator), 0);
    for (int k = 0; k < 3; ++k) {
      Rational want = 0;
      for (int m = 0; m < 3; ++m)
        want += at[static_cast<std::size_t>(m)] * (Rational(frame.corners[m][k]) - Rational(frame.seed[k]));
      want /= denominator;
      const Rational error = abs(Rational(got[k]) - want), bound = 0x1p-51 * abs(want);
      EXPECT_TRUE(error <= bound) << got[k] << " for " << want.get_d();
    }
  });
}

TEST(Exact, SideIsTheSignOfTheDeterminantWhereThatIsNotZero) {
  std::size_t checked = 0;
  each_vertex(12, 400, [&](const ExactClipper& exact, Index before, Index after) {
    const ExactFrame frame = exact.frame();
    const RationalRow at = cross(rational_row(frame, exact.line(before)), rational_row(frame, exact.line(after)));
    for (Index j = 0; j < exact.seeds.x.size(); ++j) {
      if (j == exact.slot || j == before || j == after) continue;
      const RationalRow row = rational_row(frame, exact.line(j));
      const int want = sgn(Rational(row[0] * at[0] + row[1] * at[1] + row[2] * at[2]));
      if (want == 0) continue;
      ++checked;
      EXPECT_EQ(exact_side(frame, exact.line(before), exact.line(after), exact.line(j)), want);
    }
  });
  EXPECT_GT(checked, 10'000u);
}

TEST(Exact, CornersAreAntisymmetricAndTiesGoToTheLowerIndex) {
  SplitMix64 random(13);
  const auto point = [&] {
    return Vec3{static_cast<double>(random.below(4)), static_cast<double>(random.below(4)),
                static_cast<double>(random.below(4))};
  };
  for (int trial = 0; trial < 20'000; ++trial) {
    const Vec3 q = point(), x = point(), y = point();
    const Index i = static_cast<Index>(random.below(9)), j = i + 1 + static_cast<Index>(random.below(9));
    EXPECT_EQ(exact_side(q, x, i, y, j), -exact_side(q, y, j, x, i));
    EXPECT_EQ(exact_side(q, x, j, y, i), -exact_side(q, y, i, x, j));
    const double difference = norm2(q - y) - norm2(q - x);  // exact
    const int sign = difference > 0 ? 1 : difference < 0 ? -1 : 0;
    EXPECT_EQ(exact_side(q, x, i, y, j), sign ? sign : 1);
    EXPECT_EQ(exact_side(q, x, j, y, i), sign ? sign : -1);
  }
  // Cancellation that doubles lose.
  const Vec3 q{0x1p60, 1, 0};
  EXPECT_EQ(exact_side(q, {-1, 0, 0}, 0, {-1, 0x1p-60, 0}, 1), -1);
  EXPECT_EQ(exact_side(q, {-1, 0x1p-60, 0}, 0, {-1, 0, 0}, 1), 1);
}

// A corner of the triangle as the meeting of two of its edges decides as the corner itself.
TEST(Exact, CornersDecideAlikeInBothForms) {
  SplitMix64 random(14);
  const auto point = [&] {
    return Vec3{static_cast<double>(random.below(4)), static_cast<double>(random.below(4)),
                static_cast<double>(random.below(4))};
  };
  for (int trial = 0; trial < 10'000; ++trial) {
    const Vec3 a = point(), b = point(), c = point(), x = point(), y = point();
    if (cross(b - a, c - a) == Vec3{}) continue;
    const Index i = static_cast<Index>(random.below(2)), j = 1 - i;
    const ExactFrame frame{{a, b, c}, x, i};
    for (int m = 0; m < 3; ++m)
      EXPECT_EQ(
          exact_side(frame, ExactLine::edge((m + 1) % 3), ExactLine::edge((m + 2) % 3), ExactLine::bisector(y, j)),
          exact_side(frame.corners[m], x, i, y, j));
  }
}

// A vertex belongs to its two (three) cells alike: whichever of them asks about another seed gets the same answer.
TEST(Exact, AVertexDecidesAlikeFromEveryCellItTouches) {
  SplitMix64 random(15);
  const auto point = [&] {
    return Vec3{static_cast<double>(random.below(4)), static_cast<double>(random.below(4)),
                static_cast<double>(random.below(4))};
  };
  std::size_t on_edges = 0, inside = 0, ties = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    const Vec3 corners[3] = {point(), point(), point()};
    if (cross(corners[1] - corners[0], corners[2] - corners[0]) == Vec3{}) continue;
    Vec3 x[4];
    for (Vec3& p : x) p = point();
    std::array<Index, 4> id{0, 1, 2, 3};
    for (std::size_t k = 4; k > 1; --k) std::swap(id[k - 1], id[random.below(k)]);
    const auto frame = [&](int i) {
      return ExactFrame{{corners[0], corners[1], corners[2]}, x[i], id[static_cast<std::size_t>(i)]};
    };
    const auto line = [&](int i) { return ExactLine::bisector(x[i], id[static_cast<std::size_t>(i)]); };
    const auto turn = [&](const ExactFrame& f, const ExactLine& a, const ExactLine& b) {
      const RationalRow at = cross(rational_row(f, a), rational_row(f, b));
      return sgn(Rational(at[0] + at[1] + at[2]));
    };
    const auto owner = [&](const Vec3& q, int i, int j) {
      return exact_side(q, x[i], id[static_cast<std::size_t>(i)], x[j], id[static_cast<std::size_t>(j)]);
    };
    const auto tie = [&](const ExactFrame& f, const ExactLine& a, const ExactLine& b, const ExactLine& c) {
      const RationalRow at = cross(rational_row(f, a), rational_row(f, b)), row = rational_row(f, c);
      return sgn(Rational(row[0] * at[0] + row[1] * at[1] + row[2] * at[2])) == 0;
    };
    // Type B: where the bisector of 0 and 1 crosses the edge from corner 0 to corner 1, towards 1.
    const ExactLine edge = ExactLine::edge(2);
    if (owner(corners[0], 0, 1) > 0 && owner(corners[1], 0, 1) < 0) {
      ++on_edges;
      const int side = exact_side(frame(0), edge, line(1), line(2));
      ties += tie(frame(0), edge, line(1), line(2));
      EXPECT_EQ(side, exact_side(frame(1), line(0), edge, line(2)));
      // From the triangle on the other side of the edge, whose third corner is another.
      const Vec3 apex = point();
      if (!(cross(corners[1] - corners[0], apex - corners[0]) == Vec3{})) {
        ExactFrame across = frame(0);
        across.corners[0] = corners[1];
        across.corners[1] = corners[0];
        across.corners[2] = apex;
        EXPECT_EQ(side, exact_side(across, line(1), edge, line(2)));
      }
    }
    // Type C: the meeting of the cells 0, 1 and 2, on the side where the bisectors turn left.
    const int sense = turn(frame(0), line(1), line(2));
    if (sense == 0) continue;
    ++inside;
    const int i = 0, j = sense > 0 ? 1 : 2, k = sense > 0 ? 2 : 1;
    const int side = exact_side(frame(i), line(j), line(k), line(3));
    ties += tie(frame(i), line(j), line(k), line(3));
    EXPECT_EQ(side, exact_side(frame(j), line(k), line(i), line(3)));
    EXPECT_EQ(side, exact_side(frame(k), line(i), line(j), line(3)));
    EXPECT_NE(side, 0);
  }
  EXPECT_GT(on_edges, 1000u);
  EXPECT_GT(inside, 1000u);
  EXPECT_GT(ties, 1000u);
}

// Four seeds around a square's middle: the tie goes to the heaviest pair across.
TEST(Exact, FourCocircularSeedsAreSplitByTheLowestIndex) {
  const Vec3 corners[3] = {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}};
  const Vec3 around[4] = {{1, 1, 0}, {3, 1, 0}, {3, 3, 0}, {1, 3, 0}};
  for (Index lowest = 0; lowest < 4; ++lowest) {
    const auto id = [&](Index k) { return (k + 4 - lowest) % 4; };
    const Index next = (lowest + 1) % 4, across = (lowest + 2) % 4, last = (lowest + 3) % 4;
    // The heaviest cell grows over the middle: the vertex of the three others belongs to it, from each of their cells.
    const ExactFrame frame{{corners[0], corners[1], corners[2]}, around[next], id(next)};
    EXPECT_EQ(exact_side(frame, ExactLine::bisector(around[across], id(across)),
                         ExactLine::bisector(around[last], id(last)), ExactLine::bisector(around[lowest], id(lowest))),
              -1);
  }
}

TEST(Exact, NormalIsZeroOnlyForCollinearCorners) {
  EXPECT_EQ(exact_normal({0, 0, 0}, {1, 1, 1}, {3, 3, 3}), Vec3{});
  EXPECT_EQ(exact_normal({1, 2, 3}, {1, 2, 3}, {5, 5, 5}), Vec3{});
  EXPECT_EQ(exact_normal({0, 0, 0}, {8, 0, 0}, {0, 8, 0}), (Vec3{0, 0, 64}));
  const double tiny = 0x1p-52;
  EXPECT_FALSE(exact_normal({1, 1, 1}, {2, 2, 2}, {3, 3, 3 + 2 * tiny}) == Vec3{});
  EXPECT_EQ(exact_normal({0, 0, 0}, {0x1p60, 1, 0}, {0x1p60, 1 + tiny, 0}), (Vec3{0, 0, 0x1p8}));
}

}  // namespace
}  // namespace bisector::test
