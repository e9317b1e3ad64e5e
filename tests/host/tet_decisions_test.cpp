// The error bounds of kernels/tet_clipper.glsl against exact arithmetic: no decision that it holds to be certain is
// wrong, and no vertex is farther off than its slack.
//
// Needs a Vulkan device or skips what does; BISECTOR_TEST_DEVICE names one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/device/modules.h"
#include "host/passes/device_solid.h"
#include "host/passes/packing.h"
#include "mesh/tet_adjacency.h"
#include "support/models.h"
#include "voronoi/exact_tet.h"

namespace bisector::host {

extern const std::span<const Module> decision_modules;

namespace {

using test::SplitMix64;

constexpr std::size_t kTested = 6, kSeeds = 4 + kTested;  // of kernels/decisions_tet.comp
constexpr std::size_t kProblems = 4096;

struct Family {
  const char* name;
  double cell;        // of the tetrahedra's size
  double flatness;    // of the tetrahedra
  double nearness;    // of seeds to the sphere about the vertex that makes all decisions ties
  double offset;      // of everything, in sizes
  bool grid = false;  // everything at points of a grid, with exact ties
};

constexpr Family kFamilies[] = {
    {"cells as large", 1, 1, 0.3, 0},  {"small cells", 0.01, 1, 0.3, 0}, {"tiny cells", 1e-5, 1, 0.3, 0},
    {"large cells", 30, 1, 0.3, 0},    {"slivers", 1, 1e-3, 0.3, 0},     {"near ties", 0.3, 1, 1e-5, 0},
    {"nearer ties", 0.3, 1, 1e-10, 0}, {"far away", 0.1, 1, 0.1, 1e4},   {"far away, near ties", 0.1, 1, 1e-7, 1e4},
    {"grid", 1, 1, 0, 0, true}};

struct Problems {
  TetMesh mesh;
  std::vector<Vec3> seeds;
  std::vector<Index> vertices;  // of each problem the slot and three labels
  std::vector<char> left_out;
};

struct VertexPush {
  float residual;
  std::uint32_t count;
};

Problems make_problems(const Family& family, std::uint64_t number) {
  SplitMix64 random(number);
  const auto spread = [&] { return Vec3{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; };
  const auto direction = [&] {
    Vec3 u = spread();
    while (norm2(u) < 0.01 || norm2(u) > 1) u = spread();
    return (1 / norm(u)) * u;
  };
  const auto grid_point = [&] {
    const auto coordinate = [&] { return static_cast<double>(random.below(4)); };
    return Vec3{coordinate(), coordinate(), coordinate()};
  };
  Problems problems;
  for (std::size_t i = 0; i < kProblems; ++i) {
    const auto first = static_cast<Index>(problems.mesh.vertices.size());
    std::array<Vec3, 4> q;
    double volume = 0;
    while (std::abs(volume) < 1e-3) {
      for (Vec3& p : q) p = family.grid ? grid_point() : spread();
      volume = dot(q[1] - q[0], cross(q[2] - q[0], q[3] - q[0]));
    }
    if (volume < 0) std::swap(q[2], q[3]);
    for (Vec3& p : q) {
      p.z *= family.flatness;
      p += family.offset * Vec3{1, -0.7, 0.4};
      problems.mesh.vertices.push_back(p);
    }
    problems.mesh.tets.push_back({first, first + 1, first + 2, first + 3});
    // Facets 0 .. kind - 1 and bisectors meet in the vertex.
    const std::size_t kind = i % 4;
    double weights[4], sum = 0;
    for (std::size_t m = 0; m < 4; ++m) sum += weights[m] = m < kind ? 0 : random.range(0.1, 1);
    Vec3 vertex;
    for (std::size_t m = 0; m < 4; ++m) vertex += (weights[m] / sum) * q[m];
    const auto slot = static_cast<Index>(problems.seeds.size());
    for (std::size_t s = 0; s < kSeeds; ++s) {
      const double radius = family.cell * (1 + family.nearness * random.range(-1, 1));
      problems.seeds.push_back(family.grid ? grid_point() : vertex + radius * direction());
    }
    std::array<Index, 3> labels;
    std::array<Vec3, 3> outward;
    for (std::size_t e = 0; e < 3; ++e) {
      if (e < kind) {
        labels[e] = kFacetLabel | static_cast<Index>(e);
        const int* f = kFacetCorners[e];
        outward[e] = cross(q[f[1]] - q[f[0]], q[f[2]] - q[f[0]]);
      } else {
        labels[e] = slot + 1 + static_cast<Index>(e);
        outward[e] = problems.seeds[labels[e]] - problems.seeds[slot];
      }
    }
    // Counter-clockwise.
    const double determinant = dot(outward[0], cross(outward[1], outward[2]));
    if (determinant < 0) std::swap(labels[1], labels[2]);
    problems.left_out.push_back(
        std::abs(determinant) < 1e-12 * norm(outward[0]) * norm(outward[1]) * norm(outward[2]) || determinant == 0);
    problems.vertices.insert(problems.vertices.end(), {slot, labels[0], labels[1], labels[2]});
  }
  return problems;
}

Device* device() {
  static const std::unique_ptr<Device> opened = []() -> std::unique_ptr<Device> {
    register_modules(decision_modules);
    const char* named = std::getenv("BISECTOR_TEST_DEVICE");
    try {
      return Device::open(parse_device(named ? named : "vulkan"));
    } catch (const DeviceError&) {
      if (named) throw;
      return nullptr;
    }
  }();
  return opened.get();
}

struct Answers {
  std::vector<std::int32_t> sides;
  std::vector<double> places;
};

Answers ask(const Solid& solid, const Problems& problems, bool is_double) {
  Commands commands(*device());
  const double scale = device_scale(solid);
  const DeviceSolid device_solid(*device(), commands, solid, false, scale, is_double, false);
  RealWords words(is_double);
  std::vector<std::uint32_t> ids;
  double largest = 0;
  for (std::size_t slot = 0; slot < problems.seeds.size(); ++slot) {
    const Vec3& x = problems.seeds[slot];
    words.point(scale * x);
    ids.push_back(static_cast<std::uint32_t>(slot));
    for (int k = 0; k < 3; ++k) ids.push_back(low_word(x[k], scale, slot));
    largest = std::max({largest, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  }
  for (const Vec3& q : solid.mesh.vertices) largest = std::max({largest, std::abs(q.x), std::abs(q.y), std::abs(q.z)});
  Buffer seeds(*device()), id_words(*device()), vertices(*device()), sides(*device()), places(*device());
  upload(commands, seeds, words);
  upload(commands, id_words, ids);
  upload(commands, vertices, problems.vertices);
  Answers answers;
  answers.sides.resize(kTested * kProblems);
  std::vector<std::byte> bytes(4 * kProblems * words.size());
  sides.reserve(answers.sides.size() * sizeof(std::int32_t));
  places.reserve(bytes.size());
  const VertexPush push{is_double ? 0 : residual_of(largest * scale), static_cast<std::uint32_t>(kProblems)};
  commands.dispatch(kernel("decisions_tet", is_double),
                    {reads(seeds), reads(id_words), reads(device_solid.words), reads(device_solid.meta),
                     reads(vertices), writes(sides), writes(places)},
                    push, kProblems);
  commands.download(sides, 0, answers.sides.data(), answers.sides.size() * sizeof(std::int32_t));
  commands.download(places, 0, bytes.data(), bytes.size());
  commands.run();
  for (std::size_t k = 0; k < 4 * kProblems; ++k) {
    double value;
    float narrow;
    if (is_double) std::memcpy(&value, &bytes[k * sizeof value], sizeof value);
    else std::memcpy(&narrow, &bytes[k * sizeof narrow], sizeof narrow), value = static_cast<double>(narrow);
    answers.places.push_back(value / scale);
  }
  return answers;
}

struct DecisionCase {
  Family family;
  bool is_double;
};

void PrintTo(const DecisionCase& instance, std::ostream* out) { *out << instance.family.name; }

class TetDecisions : public testing::TestWithParam<DecisionCase> {};

TEST_P(TetDecisions, AreRightWhereTheyAreCertain) {
  const auto& [family, is_double] = GetParam();
  if (!device()) GTEST_SKIP() << "no Vulkan device";
  if (is_double && !device()->description().float64) GTEST_SKIP() << "no double precision";
  const Problems problems = make_problems(family, 51);
  const Solid solid(problems.mesh);
  const Answers answers = ask(solid, problems, is_double);
  std::size_t certain = 0, wrong = 0, beyond = 0, unsure = 0;
  double worst = 0;
  for (std::size_t i = 0; i < kProblems; ++i) {
    if (problems.left_out[i]) continue;
    const Index* names = &problems.vertices[4 * i];
    const Vec3 own = problems.seeds[names[0]];
    const auto& v = solid.mesh.tets[i];
    ExactTetFrame frame{{}, own, names[0]};
    double farthest = 0;
    for (std::size_t m = 0; m < 4; ++m) {
      frame.corners[m] = solid.mesh.vertices[v[m]];
      farthest = std::max(farthest, norm2(frame.corners[m] - own));
    }
    std::array<ExactPlane, 3> planes;
    bool repeated = false;
    for (std::size_t e = 0; e < 3; ++e) {
      const Index label = names[1 + e];
      planes[e] = is_facet(label) ? ExactPlane::tet_facet(static_cast<int>(label & 3))
                                  : ExactPlane::bisector(problems.seeds[label], label);
      repeated |= !is_facet(label) && problems.seeds[label] == own;
    }
    if (repeated) continue;
    const double slack = answers.places[4 * i + 3];
    if (slack >= 0) {
      const Vec3 exact = exact_vertex(frame, planes[0], planes[1], planes[2]);
      // A polyhedron's vertices lie in the tetrahedron.
      if (norm2(exact) > farthest) continue;
      for (int k = 0; k < 3; ++k) {
        const double error = std::abs(answers.places[4 * i + static_cast<std::size_t>(k)] - exact[k]);
        beyond += !(error <= slack);
        worst = std::max(worst, error / slack);
      }
    }
    for (std::size_t t = 0; t < kTested; ++t) {
      const Index other = names[0] + 4 + static_cast<Index>(t);
      const Vec3& x = problems.seeds[other];
      bool same = x == own;
      for (std::size_t e = 0; e < 3; ++e) same |= !is_facet(names[1 + e]) && problems.seeds[names[1 + e]] == x;
      if (same) continue;
      const int side = answers.sides[kTested * i + t];
      unsure += side == 0;
      if (side == 0) continue;
      ++certain;
      wrong += side != exact_side(frame, planes[0], planes[1], planes[2], ExactPlane::bisector(x, other));
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(beyond, 0u);
  // The test would be void if little were certified, which single precision cannot where all is closer to a tie than
  // its unit.
  if (is_double || family.grid || family.nearness > 1e-6) {
    EXPECT_GT(certain, kProblems / 8);
  }
  RecordProperty("unsure", std::to_string(unsure));
  RecordProperty("certain", std::to_string(certain));
  RecordProperty("worst", std::to_string(worst));
}

std::vector<DecisionCase> decision_cases() {
  std::vector<DecisionCase> cases;
  for (const Family& family : kFamilies)
    for (const bool is_double : {false, true}) cases.push_back({family, is_double});
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Bounds, TetDecisions, testing::ValuesIn(decision_cases()), [](const auto& instance) {
  std::string name = std::string(instance.param.is_double ? "double " : "single ") + instance.param.family.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
});

}  // namespace
}  // namespace bisector::host
