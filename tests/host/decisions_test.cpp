// The error bounds of the kernels against exact arithmetic: no decision that kernels/clipper.glsl holds to be certain
// is wrong, no corner is farther off than its slack, and arithmetic is what the bounds were derived from. Then what all
// bounds rest on: that no module lets its arithmetic be fused.
//
// Needs a Vulkan device or skips what does; BISECTOR_TEST_DEVICE names one. BISECTOR_TEST_DECISIONS: how many, 1e7
// without it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "host/device/commands.h"
#include "host/device/modules.h"
#include "host/passes/device_surface.h"
#include "host/passes/packing.h"
#include "kernels/layout/push.h"
#include "support/models.h"
#include "voronoi/exact.h"
#include "voronoi/surface.h"

namespace bisector::host {

extern const std::span<const Module> decision_modules;

namespace {

using test::SplitMix64;

// --- Problems: a facet, a corner of a cell on it, and seeds about as far from that corner as the cell's own ---

constexpr std::size_t kTested = 8, kSeeds = 3 + kTested;  // of kernels/decisions.comp

struct Problem {
  Vec3 corners[3];
  Vec3 seeds[kSeeds];  // the cell's own, two that its corner's lines may be those of, and the tested ones
};

enum class Directions {
  spread,     // seeds in all directions from the corner
  steep,      // the corner's lines nearly parallel
  upright,    // seeds near the facet's normal through one another
  clustered,  // seeds that are far closer together than to the corner
  grid,       // everything at points of a grid, with exact ties
};

struct Family {
  const char* name;
  double scale = 1;                     // of all lengths
  double offset = 0;                    // from the origin, in sizes of the surface
  std::array<double, 2> facet{-2, 0};   // decimal logarithms: size of the facet in that of the surface,
  std::array<double, 2> cell{-1, 0};    // distance of the seeds in that of the facet,
  std::array<double, 2> thin{-0.5, 0};  // and height of the facet over its length
  Directions directions = Directions::spread;
  double lift = 0;  // share of problems whose seeds are straight over the facet
};

const std::vector<Family>& families() {
  static const std::vector<Family> all{
      {.name = "common"},
      {.name = "tiny_facets", .facet = {-5, -3}, .cell = {0, 2}},
      {.name = "large_facets", .facet = {-1, 0}, .cell = {-4, -1}},
      {.name = "needles", .cell = {-3, 0}, .thin = {-8, -1}},
      {.name = "steep", .directions = Directions::steep},
      {.name = "steep_on_large_facets", .facet = {-1, 0}, .cell = {-4, -1}, .directions = Directions::steep},
      {.name = "upright", .cell = {-2, 0}, .directions = Directions::upright},
      {.name = "far_from_the_surface", .cell = {0, 2}, .lift = 1},
      {.name = "clustered", .cell = {-3, 0}, .directions = Directions::clustered},
      {.name = "grid", .facet = {-0.5, 0}, .directions = Directions::grid},
      {.name = "grid_away", .offset = 8, .facet = {-0.5, 0}, .directions = Directions::grid},
      {.name = "small", .scale = 1e-6, .lift = 0.2},
      {.name = "big", .scale = 1e6, .lift = 0.2},
      {.name = "away", .offset = 1, .facet = {-3, 0}, .cell = {-3, 0}},
      {.name = "afar", .offset = 1e3, .facet = {-3, 0}, .cell = {-3, 0}, .lift = 0.2},
      {.name = "remote", .offset = 1e6, .facet = {-3, 0}, .cell = {-3, 0}, .lift = 0.2},
      {.name = "remote_steep", .offset = 1e6, .facet = {-1, 0}, .cell = {-2, 0}, .directions = Directions::steep},
      {.name = "remote_upright", .offset = 1e6, .facet = {-1, 0}, .cell = {-2, 0}, .directions = Directions::upright},
      {.name = "remote_clusters",
       .offset = 1e6,
       .facet = {-1, 0},
       .cell = {-1, 0},
       .directions = Directions::clustered},
      {.name = "remote_needles", .scale = 1e-6, .offset = 1e5, .cell = {-2, 0}, .thin = {-6, -1}},
  };
  return all;
}

Vec3 random_point(SplitMix64& random) { return {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; }

Vec3 direction(SplitMix64& random) {
  for (;;)
    if (const Vec3 p = random_point(random); norm2(p) > 0.01 && norm2(p) <= 1) return (1 / norm(p)) * p;
}

double power(SplitMix64& random, const std::array<double, 2>& range) {
  return std::pow(10, random.range(range[0], range[1]));
}

// 0 one time in eight, else of either sign and of any magnitude from 1e-17 to 0.1.
double imbalance(SplitMix64& random) {
  if (random.below(8) == 0) return 0;
  return (random.below(2) ? 1 : -1) * power(random, {-17, -1});
}

// What kind of corner: two edges of the facet, an edge and a bisector, two bisectors.
struct Corner {
  int edges = 0;           // 2, 1 or 0
  unsigned char edge = 0;  // the edge, or the facet's corner
};

void make_grid(SplitMix64& random, Problem& p) {
  const auto point = [&] {
    const auto coordinate = [&] { return 0.25 * (static_cast<double>(random.below(5)) - 2); };
    const double x = coordinate(), y = coordinate();
    return Vec3{x, y, coordinate()};
  };
  for (Vec3& q : p.corners) q = point();
  for (Vec3& x : p.seeds) x = point();
  // Rectangles are what seeds on a grid form.
  Vec3 *s = p.seeds, lo = s[0], hi = s[1];
  if (random.below(2)) {
    const int k = static_cast<int>(random.below(3)), l = (k + 1) % 3;
    s[1] = s[2] = s[3] = lo;
    s[1][k] = hi[k];
    s[2][l] = hi[l];
    s[3][k] = hi[k];
    s[3][l] = hi[l];
    std::swap(s[3], s[random.below(3)]);
  }
}

Problem make_problem(SplitMix64& random, const Family& family, const Corner& corner) {
  Problem p;
  if (family.directions == Directions::grid) {
    make_grid(random, p);
  } else {
    const Vec3 e = direction(random), n = unit(cross(e, direction(random))), f = cross(n, e);
    const double size = power(random, family.facet), thin = power(random, family.thin);
    const Vec3 middle = 0.5 * (1 - size) * random_point(random);
    const double shift = random.unit();
    p.corners[0] = middle - 0.4 * size * e;
    p.corners[1] = middle + 0.4 * size * e + 0.1 * thin * size * random.unit() * f;
    p.corners[2] = middle + size * ((0.8 * shift - 0.4) * e + 0.8 * thin * f);
    if (random.below(2)) std::swap(p.corners[1], p.corners[2]);
    const unsigned turn = static_cast<unsigned>(random.below(3));
    std::rotate(p.corners, p.corners + turn, p.corners + 3);
    // The corner: on edges, close to them, or in the middle.
    double share[3];
    for (double& s : share) s = random.below(3) ? random.unit() + 0.01 : power(random, {-9, -1});
    if (corner.edges == 1) share[(corner.edge + 2) % 3] = 0;
    if (corner.edges == 2) share[(corner.edge + 1) % 3] = share[(corner.edge + 2) % 3] = 0;
    const double sum = share[0] + share[1] + share[2];
    const Vec3 v = (share[0] / sum) * p.corners[0] + (share[1] / sum) * p.corners[1] + (share[2] / sum) * p.corners[2];
    const double r = power(random, family.cell) * size;
    const bool lifted = random.unit() < family.lift;
    const double tilt = power(random, {-8, -1});
    const Vec3 up = unit(n + tilt * direction(random));
    const Vec3 first = lifted ? unit(n + power(random, {-2, 0}) * direction(random)) : direction(random);
    const auto around = [&](double most) { return unit(first + power(random, {-6, most}) * direction(random)); };
    const auto along_normal = [&](const Vec3& d) { return unit(d - 2 * dot(d, up) * up); };
    Vec3 to[kSeeds];
    to[0] = first;
    for (std::size_t k = 1; k < kSeeds; ++k) to[k] = lifted ? around(-1) : direction(random);
    switch (family.directions) {
      case Directions::steep:
        if (random.below(2)) to[2] = unit(to[1] + power(random, {-6, -1}) * direction(random));
        else {
          const Vec3 t = unit(cross(first, direction(random)));
          const double angle = power(random, {-4, 0});
          to[1] = unit(first + angle * t);
          to[2] = unit(first - angle * random.range(0.5, 2) * t + power(random, {-6, -1}) * direction(random));
        }
        break;
      case Directions::upright:
        for (std::size_t k = 1; k < kSeeds; ++k)
          if (random.below(2)) to[k] = along_normal(to[k - 1]);
        break;
      case Directions::clustered:
        for (std::size_t k = 1; k < kSeeds; ++k)
          if (random.below(4)) to[k] = around(-1);
        break;
      default: break;
    }
    for (std::size_t k = 0; k < kSeeds; ++k) p.seeds[k] = v + r * to[k];
    for (std::size_t k = 3; k < kSeeds; ++k)
      p.seeds[k] = random.below(4) ? v + r * (1 + imbalance(random)) * to[k] : v + r * random.range(0.3, 2) * to[k];
  }
  const Vec3 at = family.offset * Vec3{1, -0.7, 0.4};
  for (Vec3& q : p.corners) q = family.scale * (q + at);
  for (Vec3& x : p.seeds) x = family.scale * (x + at);
  return p;
}

// --- A filter in extended precision, for exact arithmetic is slow ---

struct Approximate {
  long double value = 0, error = 0;
};

constexpr long double kEpsilon = std::numeric_limits<long double>::epsilon();

Approximate operator*(const Approximate& a, const Approximate& b) {
  const long double value = a.value * b.value, size_a = std::abs(a.value), size_b = std::abs(b.value);
  return {value, 2 * (size_a * b.error + size_b * a.error + a.error * b.error + kEpsilon * std::abs(value))};
}

Approximate operator+(const Approximate& a, const Approximate& b) {
  const long double value = a.value + b.value;
  return {value, (1 + 8 * kEpsilon) * (a.error + b.error) + kEpsilon * std::abs(value)};
}

Approximate operator-(const Approximate& a, const Approximate& b) { return a + Approximate{-b.value, b.error}; }

using Row = std::array<Approximate, 3>;

Approximate difference(double a, double b) {
  const long double value = static_cast<long double>(a) - b;
  return {value, kEpsilon * std::abs(value)};
}

Row row_of(const ExactFrame& frame, const ExactLine& line) {
  Row row;
  for (int m = 0; m < 3; ++m) {
    Approximate& r = row[static_cast<std::size_t>(m)];
    if (line.corner >= 0) {
      r.value = m == line.corner;
      continue;
    }
    for (int k = 0; k < 3; ++k)
      r = r + difference(line.seed[k], frame.seed[k]) *
                  (difference(line.seed[k], frame.corners[m][k]) + difference(frame.seed[k], frame.corners[m][k]));
  }
  return row;
}

Row cross(const Row& a, const Row& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Approximate dot(const Row& a, const Row& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// --- The device's answers ---

struct Answers {
  std::vector<std::int32_t> sides;
  std::vector<std::array<double, 4>> places;
};

struct Batch {
  const Family* family = nullptr;
  std::vector<Problem> problems;
  std::vector<Corner> kinds;
  std::vector<Index> ids;                     // of the seeds
  std::vector<std::array<Index, 4>> corners;  // facet, slot, labels; facet kNone: to be left out
  std::vector<Row> shares;                    // the corner in barycentric coordinates, up to a factor
};

constexpr std::size_t kBatch = 1 << 15;

ExactFrame frame_of(const Batch& batch, std::size_t i) {
  const Problem& p = batch.problems[i];
  return {{p.corners[0], p.corners[1], p.corners[2]}, p.seeds[0], batch.ids[kSeeds * i]};
}

ExactLine line_of(const Batch& batch, std::size_t i, Index label) {
  if (is_edge(label)) return ExactLine::edge(static_cast<int>(((label & ~kEdgeLabel) + 2) % 3));
  return ExactLine::bisector(batch.problems[i].seeds[label - kSeeds * i], batch.ids[label]);
}

Batch make_batch(const Family& family, std::uint64_t number) {
  Batch batch;
  batch.family = &family;
  batch.problems.resize(kBatch);
  batch.kinds.resize(kBatch);
  batch.corners.assign(kBatch, {kNone, 0, 0, 0});
  batch.shares.resize(kBatch);
  for (std::size_t s = 0; s < kBatch * kSeeds; ++s) batch.ids.push_back(static_cast<Index>(s * 0x9e3779b1u));
  parallel_each(
      kBatch,
      [&](std::size_t i) {
        SplitMix64 random((number << 32) + i);
        Corner& kind = batch.kinds[i];
        kind.edges = static_cast<int>((random.below(7) + 1) / 3);  // 0: 2/7, 1: 3/7, 2: 2/7
        kind.edge = static_cast<unsigned char>(random.below(3));
        batch.problems[i] = make_problem(random, family, kind);
        const auto slot = static_cast<Index>(kSeeds * i);
        Index before = slot + 1, after = slot + 2;
        if (kind.edges) after = kEdgeLabel | kind.edge;
        if (kind.edges == 2) before = kEdgeLabel | (kind.edge + 2u) % 3;
        const ExactFrame frame = frame_of(batch, i);
        Row shares = cross(row_of(frame, line_of(batch, i, before)), row_of(frame, line_of(batch, i, after)));
        long double sum = shares[0].value + shares[1].value + shares[2].value;
        if (sum < 0) {
          std::swap(before, after);
          sum = -sum;
          for (Approximate& s : shares) s.value = -s.value;
        }
        // The clipping only meets corners on the facet.
        for (const Approximate& s : shares)
          if (!(s.value >= -1e-3L * sum)) return;
        batch.corners[i] = {0, slot, before, after};
        batch.shares[i] = shares;
      },
      256);
  return batch;
}

struct DecisionPush {
  std::uint32_t facet_base;
  float residual;
  std::uint32_t count;
};

// Where the reals of a download go.
std::vector<double> widened(const std::vector<std::byte>& bytes, bool is_double) {
  std::vector<double> reals(bytes.size() / (is_double ? sizeof(double) : sizeof(float)));
  if (is_double) {
    std::memcpy(reals.data(), bytes.data(), bytes.size());
  } else {
    std::vector<float> narrow(reals.size());
    std::memcpy(narrow.data(), bytes.data(), bytes.size());
    std::copy(narrow.begin(), narrow.end(), reals.begin());
  }
  return reals;
}

// All as host/passes/vulkan_backend.cpp does it.
Answers ask(Device& device, const Surface& surface, const Batch& batch, bool is_double) {
  Commands commands(device);
  const double scale = device_scale(surface);
  const std::vector<FacetChunk> facets = upload_facets(device, commands, surface, scale, is_double);
  if (facets.size() != 1) throw DeviceError("too many facets for one buffer");
  RealWords words(is_double);
  std::vector<std::uint32_t> ids;
  double largest = 0;
  for (std::size_t i = 0; i < kBatch; ++i)
    for (std::size_t k = 0; k < kSeeds; ++k) {
      const std::size_t slot = kSeeds * i + k;
      const Vec3& x = batch.problems[i].seeds[k];
      ids.push_back(batch.ids[slot]);
      for (int c = 0; c < 3; ++c) {
        ids.push_back(low_word(x[c], scale, slot));
        largest = std::max(largest, std::abs(x[c]));
      }
      words.point(scale * x);
    }
  for (const Vec3& corner : {surface.box.lo, surface.box.hi})
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(corner[c]));
  Buffer seeds(device), id_words(device), corners(device), sides(device), places(device);
  upload(commands, seeds, words);
  upload(commands, id_words, ids);
  upload(commands, corners, batch.corners);
  sides.reserve(kBatch * kTested * sizeof(std::int32_t));
  std::vector<std::byte> bytes(kBatch * 4 * words.size());
  places.reserve(bytes.size());
  const DecisionPush push{0, is_double ? 0 : residual_of(largest * scale), kBatch};
  commands.dispatch(kernel("decisions", is_double),
                    {reads(seeds), reads(id_words), reads(facets[0].words), reads(facets[0].meta), reads(corners),
                     writes(sides), writes(places)},
                    push, kBatch);
  Answers answers;
  answers.sides.resize(kBatch * kTested);
  commands.download(sides, 0, answers.sides.data(), answers.sides.size() * sizeof(std::int32_t));
  commands.download(places, 0, bytes.data(), bytes.size());
  commands.run();
  const std::vector<double> reals = widened(bytes, is_double);
  answers.places.resize(kBatch);
  for (std::size_t i = 0; i < kBatch; ++i)
    for (std::size_t c = 0; c < 4; ++c) answers.places[i][c] = reals[4 * i + c] / scale;
  return answers;
}

struct Tally {
  std::size_t corners = 0, uncertain_corners = 0, beyond = 0;
  std::size_t decisions = 0, unsure = 0, ties = 0, wrong = 0, exact = 0;
  double worst = 0;  // error of a corner over its slack, where lines were met
  double tightest =
      1e300;  // distance of the exact corner from a bisector over the error of the product that certifies it

  Tally& operator+=(const Tally& b) {
    corners += b.corners, uncertain_corners += b.uncertain_corners, beyond += b.beyond;
    decisions += b.decisions, unsure += b.unsure, ties += b.ties, wrong += b.wrong, exact += b.exact;
    worst = std::max(worst, b.worst);
    tightest = std::min(tightest, b.tightest);
    return *this;
  }
};

// Adds what one precision answered about problem i; `truth` holds the exact signs that were found already, or 0.
void judge(const Batch& batch, std::size_t i, const Answers& answers, const Vec3& vertex,
           std::array<int, kTested>& truth, Tally& tally) {
  const auto& [facet, slot, before, after] = batch.corners[i];
  const ExactFrame frame = frame_of(batch, i);
  const auto& [x, y, z, slack] = answers.places[i];
  const bool certain = slack >= 0;
  ++tally.corners;
  if (certain) {
    const double error = std::max({std::abs(x - vertex.x), std::abs(y - vertex.y), std::abs(z - vertex.z)});
    if (!(error <= slack)) ++tally.beyond;
    if (!is_edge(before) || !is_edge(after)) tally.worst = std::max(tally.worst, error / slack);
  } else {
    ++tally.uncertain_corners;
  }
  for (std::size_t t = 0; t < kTested; ++t) {
    const Vec3& c = batch.problems[i].seeds[3 + t];
    if (c == frame.seed || c == batch.problems[i].seeds[1] || c == batch.problems[i].seeds[2]) continue;
    ++tally.decisions;
    const int side = answers.sides[kTested * i + t];
    if (side == 0) {
      ++tally.unsure;
      continue;
    }
    tally.ties += std::abs(side) == 2;
    if (truth[t] == 0) {
      const ExactLine line = ExactLine::bisector(c, batch.ids[slot + 3 + t]);
      const Approximate d = dot(row_of(frame, line), batch.shares[i]);
      if (std::abs(d.value) > d.error) {
        truth[t] = d.value > 0 ? 1 : -1;
      } else {
        ++tally.exact;
        truth[t] = exact_side(frame, line_of(batch, i, before), line_of(batch, i, after), line);
      }
    }
    if ((side > 0) != (truth[t] > 0)) ++tally.wrong;
    if (std::abs(side) == 1 && slack > 0) {
      const Vec3 to = c - frame.seed;
      const double margin = std::abs(0.5 * norm2(to) - bisector::dot(vertex, to));
      const double taxicab = std::abs(to.x) + std::abs(to.y) + std::abs(to.z);
      tally.tightest = std::min(tally.tightest, margin / (slack * taxicab));
    }
  }
}

// The device, or a reason why there is none.
struct Opened {
  std::unique_ptr<Device> device;
  std::string problem;
};

const Opened& opened() {
  static const Opened once = [] {
    register_modules(decision_modules);
    const char* named = std::getenv("BISECTOR_TEST_DEVICE");
    try {
      return Opened{Device::open(parse_device(named ? named : "vulkan")), {}};
    } catch (const DeviceError& error) {
      if (named) throw;
      return Opened{nullptr, error.what()};
    }
  }();
  return once;
}

class Decisions : public testing::Test {
 protected:
  void SetUp() override {
    if (!opened().device) GTEST_SKIP() << opened().problem;
  }
  Device& device() { return *opened().device; }
  bool has_double() { return device().description().float64; }
};

TEST_F(Decisions, AreRightWhereTheyAreCertain) {
  const char* given = std::getenv("BISECTOR_TEST_DECISIONS");
  const double wanted = given ? std::atof(given) : 1e7;
  std::map<std::string, std::array<Tally, 2>> tallies;
  std::array<Tally, 2> all;
  std::uint64_t number = 1;
  // Whole rounds of families.
  while (static_cast<double>(all[0].decisions) < wanted) {
    for (const Family& family : families()) {
      Batch batch = make_batch(family, number++);
      // The surface: all facets with vertices of their own, whose numbers are in any order within a facet.
      TriangleMesh mesh;
      constexpr Index kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
      mesh.vertices.resize(3 * kBatch);
      for (std::size_t i = 0; i < kBatch; ++i) {
        Triangle triangle;
        for (std::size_t m = 0; m < 3; ++m) {
          triangle[m] = static_cast<Index>(3 * i + kOrders[i % 6][m]);
          mesh.vertices[triangle[m]] = batch.problems[i].corners[m];
        }
        mesh.triangles.push_back(triangle);
      }
      const Surface surface(std::move(mesh));
      std::vector<char> left_out(kBatch);
      for (std::size_t i = 0; i < kBatch; ++i) {
        auto& [facet, slot, before, after] = batch.corners[i];
        left_out[i] = facet == kNone || surface.facet_of[i] == kNone;
        facet = 0;
        if (!left_out[i]) facet = surface.facet_of[i];
      }
      std::array<std::optional<Answers>, 2> answers;
      answers[0] = ask(device(), surface, batch, false);
      if (has_double()) answers[1] = ask(device(), surface, batch, true);
      constexpr std::size_t kChunk = 512;
      std::vector<std::array<Tally, 2>> parts(kBatch / kChunk);
      parallel_chunks(kBatch, kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          if (left_out[i]) continue;
          const auto& [facet, slot, before, after] = batch.corners[i];
          const Vec3 vertex = exact_vertex(frame_of(batch, i), line_of(batch, i, before), line_of(batch, i, after));
          std::array<int, kTested> truth{};
          for (std::size_t d = 0; d < 2; ++d)
            if (answers[d]) judge(batch, i, *answers[d], vertex, truth, parts[chunk][d]);
        }
      });
      for (const auto& part : parts)
        for (std::size_t d = 0; d < 2; ++d) {
          tallies[family.name][d] += part[d];
          all[d] += part[d];
        }
    }
  }
  const auto percent = [](std::size_t a, std::size_t b) {
    return 100.0 * static_cast<double>(a) / static_cast<double>(b);
  };
  const auto show = [&](const std::string& name, const Tally& t, const char* precision) {
    std::printf(
        "  %-22s %s %9zu decisions: unsure %5.1f%%, ties %5.1f%%, wrong %zu; %8zu corners: %5.1f%% uncertain, beyond "
        "%zu, "
        "error/slack %.3f; margin/bound from %.3f\n",
        name.c_str(), precision, t.decisions, percent(t.unsure, t.decisions), percent(t.ties, t.decisions), t.wrong,
        t.corners, percent(t.uncertain_corners, t.corners), t.beyond, t.worst, t.tightest);
  };
  for (std::size_t d = 0; d < 2; ++d) {
    if (d == 1 && !has_double()) break;
    const char* precision = d ? "double" : "single";
    for (const Family& family : families()) {
      const Tally& t = tallies[family.name][d];
      show(family.name, t, precision);
      EXPECT_EQ(t.wrong, 0u) << family.name << " " << precision;
      EXPECT_EQ(t.beyond, 0u) << family.name << " " << precision;
      // The test would be void if little were certified.
      EXPECT_LT(percent(t.unsure, t.decisions), 99.5) << family.name << " " << precision;
    }
    show("all", all[d], precision);
    EXPECT_GE(static_cast<double>(all[d].decisions), wanted);
    RecordProperty(std::string(precision) + "_decisions", std::to_string(all[d].decisions));
    RecordProperty(std::string(precision) + "_unsure", std::to_string(all[d].unsure));
    RecordProperty(std::string(precision) + "_wrong", std::to_string(all[d].wrong));
  }
}

// --- Arithmetic ---

std::vector<double> compute(Device& device, const RealWords& numbers, std::size_t count, bool is_double) {
  Commands commands(device);
  Buffer input(device), output(device);
  upload(commands, input, numbers);
  std::vector<std::byte> bytes(count * numbers.size());
  output.reserve(bytes.size());
  commands.dispatch(kernel("arithmetic", is_double), {reads(input), writes(output)},
                    CountPush{static_cast<std::uint32_t>(count)}, count);
  commands.download(output, 0, bytes.data(), bytes.size());
  commands.run();
  return widened(bytes, is_double);
}

TEST_F(Decisions, ReciprocalsAreRoundedCorrectly) {
  if (!has_double()) GTEST_SKIP() << "no double precision";
  constexpr std::size_t kRound = 1 << 20, kRounds = 10;
  SplitMix64 random(1);
  std::size_t different = 0;
  for (std::size_t round = 0; round < kRounds; ++round) {
    std::vector<double> given;
    RealWords words(true);
    words.reserve(kRound);
    for (std::size_t i = 0; i < kRound; ++i) {
      double m = 1 + random.unit();
      const double few = std::ldexp(static_cast<double>(random.below(1 << 12)), -52);
      switch (i % 8) {
        case 0: m = 1 + few; break;
        case 1: m = 2 - std::ldexp(1, -52) - few; break;
        case 2: m = 1 + std::ldexp(1, -1 - static_cast<int>(random.below(52))); break;
        case 3: m = 2 - std::ldexp(1, -static_cast<int>(random.below(52)) - 1); break;
        case 4:
          m = 1 + std::ldexp(static_cast<double>(random.below(1 << 26)), -26) +
              few * static_cast<double>(random.below(2));
          break;
        // Reciprocals of these lie close to half way: m (y + half a place) is near 1.
        case 5:
          m = std::min(1.9999999999999998,
                       std::max(1.0, 1 / (0.5 + std::ldexp(static_cast<double>(random.below(1 << 20)), -21))));
          break;
        default: break;
      }
      const int exponent = static_cast<int>(random.below(i % 5 == 0 ? 2001 : 81)) - (i % 5 == 0 ? 1000 : 40);
      given.push_back((random.below(2) ? 1 : -1) * std::ldexp(m, exponent));
      words.number(given.back());
    }
    const std::vector<double> found = compute(device(), words, kRound, true);
    for (std::size_t i = 0; i < kRound; ++i) {
      const double right = 1 / given[i];
      if (std::memcmp(&found[i], &right, sizeof right) != 0 && ++different < 5)
        ADD_FAILURE() << "1 / " << given[i] << " (" << std::hexfloat << given[i] << ") is " << found[i] << ", not "
                      << right;
    }
  }
  EXPECT_EQ(different, 0u);
}

// What begin_facet() says of them.
TEST_F(Decisions, PairsHoldWhatTheyShould) {
  constexpr std::size_t kRound = 1 << 18;
  SplitMix64 random(2);
  double worst = 0;
  for (const double distance : {0.0, 1.0, 1e3, 1e6, 1e9}) {
    std::vector<std::array<Vec3, 3>> given;
    RealWords words(false);
    words.reserve(kRound * 18);
    double farthest = 0;
    for (std::size_t i = 0; i < kRound; ++i) {
      const Vec3 at = 512 * distance * direction(random), b = at + 512 * power(random, {-6, 0}) * random_point(random);
      Vec3 a = b + 512 * power(random, {-12, 0}) * random_point(random), v = direction(random);
      // Products that all but cancel.
      if (i % 2) v = unit(bisector::cross(a - b, v));
      if (!(norm2(v) > 0.5)) v = {1, 0, 0};
      given.push_back({v, a, b});
      for (const Vec3& p : given.back()) words.point(p);
      for (int k = 0; k < 3; ++k) farthest = std::max({farthest, std::abs(a[k]), std::abs(b[k])});
    }
    const double residual = residual_of(farthest);
    const std::vector<double> found = compute(device(), words, kRound, false);
    for (std::size_t i = 0; i < kRound; ++i) {
      const auto& [v, a, b] = given[i];
      long double right = 0;
      double largest = 0;
      for (int k = 0; k < 3; ++k) {
        right += static_cast<long double>(v[k]) * (static_cast<long double>(a[k]) - b[k]);
        largest = std::max(largest, std::abs(a[k] - b[k]));
      }
      const double error =
          std::abs(static_cast<double>(found[i] - right)) - 0x1p-23 * std::abs(static_cast<double>(right));
      worst = std::max(worst, error / (4e-12 * largest + 4 * residual));
    }
  }
  std::printf("  largest error %.3f of the bound\n", worst);
  EXPECT_LE(worst, 1);
}

// --- Modules ---

constexpr std::uint32_t kOpExtInst = 12, kOpCapability = 17, kOpDecorate = 71;
constexpr std::uint32_t kNoContraction = 42, kFloat64 = 10, kFma = 50;

std::string opcode_name(std::uint32_t op) {
  switch (op) {
    case 129: return "OpFAdd";
    case 131: return "OpFSub";
    case 133: return "OpFMul";
    case 142: return "OpVectorTimesScalar";
    case 143: return "OpMatrixTimesScalar";
    case 144: return "OpVectorTimesMatrix";
    case 145: return "OpMatrixTimesVector";
    case 146: return "OpMatrixTimesMatrix";
    case 148: return "OpDot";
    default: return {};
  }
}

// What a module does that none may do.
std::vector<std::string> faults_of(const Module& module) {
  std::vector<std::string> faults;
  std::set<std::uint32_t> exact;
  for (const bool arithmetic : {false, true})
    for (std::size_t at = 5; at < module.words.size();) {
      const std::uint32_t op = module.words[at] & 0xffff, length = module.words[at] >> 16;
      if (length == 0) return {"is no SPIR-V"};
      const auto word = [&](std::size_t k) { return module.words[at + k]; };
      if (!arithmetic) {
        if (op == kOpDecorate && word(2) == kNoContraction) exact.insert(word(1));
        if (op == kOpCapability && word(1) == kFloat64 && module.name.ends_with("_single"))
          faults.push_back("declares Float64");
        if (op == 6035 || op == 5614 || op == 5615) faults.push_back("has floating-point atomics");
      } else if (op == kOpExtInst && word(4) == kFma) {
        faults.push_back("calls fma");
      } else if (const std::string name = opcode_name(op); !name.empty() && !exact.contains(word(2))) {
        faults.push_back(name + " %" + std::to_string(word(2)) + " may be contracted");
      }
      at += length;
    }
  return faults;
}

TEST(Modules, ArithmeticIsNotContracted) {
  std::size_t modules = 0;
  for (const Module& module : kernel_modules) {
    if (module.name.starts_with("selftest")) continue;
    ++modules;
    for (const std::string& fault : faults_of(module)) ADD_FAILURE() << module.name << ": " << fault;
  }
  EXPECT_GT(modules, 20u);
}

// The check finds what it looks for.
TEST(Modules, ContractionIsFound) {
  constexpr std::uint32_t kWords[] = {0x07230203,
                                      0x10500,
                                      0,
                                      9,
                                      0,
                                      2u << 16 | kOpCapability,
                                      kFloat64,
                                      3u << 16 | kOpDecorate,
                                      3,
                                      kNoContraction,
                                      5u << 16 | 133,
                                      1,
                                      3,
                                      2,
                                      2,  // decorated
                                      5u << 16 | 129,
                                      1,
                                      4,
                                      3,
                                      2,  // not
                                      7u << 16 | 6035,
                                      1,
                                      5,
                                      2,
                                      2,
                                      2,
                                      2};
  EXPECT_EQ(faults_of({"x_single", kWords}), (std::vector<std::string>{"declares Float64", "has floating-point atomics",
                                                                       "OpFAdd %4 may be contracted"}));
  EXPECT_EQ(faults_of({"x_double", kWords}).size(), 2u);
}

}  // namespace
}  // namespace bisector::host
