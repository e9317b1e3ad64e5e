// The topological ball property: against theory, against a complex welded from coordinates, and as what topology
// control ends in.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "cvt/multilevel.h"
#include "mesh/topology.h"
#include "remesh/feature_recovery.h"
#include "remesh/feature_seeds.h"
#include "remesh/remesh.h"
#include "remesh/sheets.h"
#include "remesh/topology_control.h"
#include "support/diagram.h"
#include "support/featured.h"
#include "support/models.h"
#include "support/run.h"
#include "voronoi/ball_property.h"

namespace bisector::test {
namespace {

struct Checked {
  Surface surface;
  Diagram diagram;
  BallReport report;

  Checked(const TriangleMesh& mesh, const std::vector<Vec3>& seeds)
      : surface(mesh), diagram(diagram_of(surface, seeds, NeighbourSource::nearest)),
        report(check_ball_property(surface, diagram.polygons)) {}
};

TriangleMesh scaled(TriangleMesh mesh, const Vec3& s, const Vec3& offset = {}) {
  for (Vec3& v : mesh.vertices) v = Vec3{s.x * v.x, s.y * v.y, s.z * v.z} + offset;
  return mesh;
}

// A ring of squares in the plane.
TriangleMesh annulus() {
  TriangleMesh mesh = grid_patch(12, 12);
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    const Vec3 c = (1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
    return std::abs(c.x - 6) < 3 && std::abs(c.y - 6) < 3;
  });
  return mesh;
}

// ---- The complex from coordinates: points that nearly coincide are one.

struct Shape {
  long long euler = 0;
  std::size_t components = 0, loops = 0;
  friend bool operator==(const Shape&, const Shape&) = default;
};

class Welded {
 public:
  explicit Welded(const RestrictedPolygons& polygons) : polygons_(polygons), id_(polygons.vertices.size()) {
    std::vector<std::size_t> order(id_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return polygons.vertices[a].x < polygons.vertices[b].x; });
    for (std::size_t k = 0; k < order.size(); ++k) {
      id_[order[k]] = order[k];
      for (std::size_t m = k; m-- > 0;) {
        const Vec3 d = polygons.vertices[order[k]] - polygons.vertices[order[m]];
        if (d.x > kWeld) break;
        if (norm2(d) <= kWeld * kWeld) id_[order[k]] = id_[order[m]];
      }
    }
  }

  Shape cell(Index i) const {
    std::set<std::size_t> vertices;
    std::map<Segment, int> edges;
    long long faces = 0;
    for_each_side([&](std::size_t p, std::size_t, const Segment& s, bool first) {
      if (polygons_.pairs[p].cell != i) return;
      faces += first;
      vertices.insert(s[0]);
      ++edges[s];
    });
    std::vector<Segment> all, once;
    for (const auto& [s, count] : edges) {
      all.push_back(s);
      if (count == 1) once.push_back(s);
    }
    for (const Segment& s : all) vertices.insert(s[1]);
    return {static_cast<long long>(vertices.size()) - static_cast<long long>(all.size()) + faces, parts(all),
            parts(once)};
  }

  // Euler characteristic, components and ends of what two cells share.
  Shape edge(Index i, Index j) const {
    std::set<Segment> segments;
    std::map<std::size_t, int> degree;
    for_each_side([&](std::size_t p, std::size_t e, const Segment& s, bool) {
      if (polygons_.pairs[p].cell == i && polygons_.labels[e] == j && segments.insert(s).second)
        for (std::size_t v : s) ++degree[v];
    });
    const auto ends = std::count_if(degree.begin(), degree.end(), [](const auto& d) { return d.second == 1; });
    return {static_cast<long long>(degree.size()) - static_cast<long long>(segments.size()),
            parts({segments.begin(), segments.end()}), static_cast<std::size_t>(ends)};
  }

  std::map<Triangle, std::size_t> triples() const {
    std::map<Triangle, std::set<std::size_t>> points;
    for (std::size_t p = 0; p < polygons_.pairs.size(); ++p) {
      const std::size_t first = polygons_.offsets[p], size = polygons_.offsets[p + 1] - first;
      for (std::size_t e = 0; e < size; ++e) {
        Triangle t{polygons_.pairs[p].cell, polygons_.labels[first + e],
                   polygons_.labels[first + (e + size - 1) % size]};
        if (is_edge(t[1]) || is_edge(t[2])) continue;
        std::sort(t.begin(), t.end());
        points[t].insert(id_[first + e]);
      }
    }
    std::map<Triangle, std::size_t> counts;
    for (const auto& [t, at] : points) counts[t] = at.size();
    return counts;
  }

 private:
  static constexpr double kWeld = 1e-9;
  using Segment = std::array<std::size_t, 2>;

  template <class Visit>
  void for_each_side(const Visit& visit) const {
    for (std::size_t p = 0; p < polygons_.pairs.size(); ++p) {
      const std::size_t first = polygons_.offsets[p], size = polygons_.offsets[p + 1] - first;
      for (std::size_t e = 0; e < size; ++e) {
        const std::size_t a = id_[first + e], b = id_[first + (e + 1) % size];
        visit(p, first + e, Segment{std::min(a, b), std::max(a, b)}, e == 0);
      }
    }
  }

  static std::size_t parts(const std::vector<Segment>& segments) {
    std::map<std::size_t, std::size_t> parent;
    const auto root = [&](std::size_t v) {
      while (parent[v] != v) v = parent[v];
      return v;
    };
    for (const Segment& s : segments)
      for (std::size_t v : s) parent.try_emplace(v, v);
    for (const Segment& s : segments) parent[root(s[0])] = root(s[1]);
    std::set<std::size_t> roots;
    for (const Segment& s : segments) roots.insert(root(s[0]));
    return roots.size();
  }

  const RestrictedPolygons& polygons_;
  std::vector<std::size_t> id_;
};

void expect_welded(const TriangleMesh& mesh, const std::vector<Vec3>& seeds) {
  const Checked c(mesh, seeds);
  const Welded welded(c.diagram.polygons);
  std::map<Index, Shape> cells;
  for (const BallReport::Cell& cell : c.report.cells) cells[cell.seed] = {cell.euler, cell.components, cell.loops};
  std::map<std::array<Index, 2>, Shape> edges;
  for (const BallReport::Edge& e : c.report.edges) edges[{e.a, e.b}] = {e.euler, e.components, e.ends};
  std::map<Triangle, std::size_t> vertices;
  for (const BallReport::Vertex& v : c.report.vertices) vertices[v.seeds] = v.places.size();
  std::set<std::array<Index, 2>> neighbours;
  for (std::size_t p = 0; p < c.diagram.polygons.pairs.size(); ++p)
    for (std::size_t e = c.diagram.polygons.offsets[p]; e < c.diagram.polygons.offsets[p + 1]; ++e)
      if (const Index i = c.diagram.polygons.pairs[p].cell, j = c.diagram.polygons.labels[e]; !is_edge(j) && i < j)
        neighbours.insert({i, j});
  EXPECT_EQ(c.report.edges_checked, neighbours.size());
  for (Index i = 0; i < seeds.size(); ++i) {
    const Shape shape = welded.cell(i), want = cells.count(i) ? cells[i] : Shape{1, 1, 1};
    EXPECT_TRUE(shape == want) << "cell " << i << ": " << shape.euler << ' ' << shape.components << ' ' << shape.loops;
  }
  for (const auto& [i, j] : neighbours) {
    const Shape shape = welded.edge(i, j), want = edges.count({i, j}) ? edges[{i, j}] : Shape{1, 1, 2};
    EXPECT_TRUE(shape == want) << "edge " << i << ' ' << j;
  }
  for (const auto& [t, count] : welded.triples()) EXPECT_EQ(count, vertices.count(t) ? vertices[t] : 1u);
}

TEST(BallProperty, IsThatOfTheWeldedComplex) {
  for (std::uint64_t k : {1u, 2u, 3u}) {
    for (std::size_t n : {4u, 9u, 30u, 80u}) {
      SCOPED_TRACE(testing::Message() << n << " seeds, " << k);
      expect_welded(icosphere(2), random_seeds(icosphere(2), n, k));
      expect_welded(torus(24, 16), random_seeds(torus(24, 16), n, k));
      const TriangleMesh plate = scaled(icosphere(2), {1, 0.8, 0.03});
      expect_welded(plate, random_seeds(plate, n, k));
    }
  }
}

// ---- Theory

TEST(BallProperty, EulerCharacteristicsAddUp) {
  std::vector<SmallCase> cases = small_cases();
  for (std::uint64_t k = 0; k < 40; ++k) cases.push_back(integer_case(k));
  cases.push_back({"torus", torus(40, 24), random_seeds(torus(40, 24), 50, 1)});
  cases.push_back({"annulus", annulus(), random_seeds(annulus(), 7, 1)});
  cases.push_back({"box at its vertices", box(4), vertex_seeds(box(4))});
  cases.push_back({"box on a grid", box(4), grid_seeds(box(4), 4, 4, 4)});
  cases.push_back({"pages", pages(), random_seeds(pages(), 9, 2)});
  cases.push_back({"soup", soup(30, 4), random_seeds(soup(30, 4), 9, 2)});
  std::size_t compared = 0;
  for (const auto& [name, mesh, seeds] : cases) {
    SCOPED_TRACE(name);
    const Checked c(mesh, seeds);
    TriangleMesh whole = mesh;
    std::erase_if(whole.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    if (c.report.unread > 0) continue;
    ++compared;
    EXPECT_EQ(c.report.euler, topology_of(whole).euler);
  }
  EXPECT_GT(compared, cases.size() / 2);
}

// Edelsbrunner and Shah's theorem.
TEST(BallProperty, WhereItHoldsTheDualIsHomeomorphic) {
  std::size_t held = 0;
  for (const TriangleMesh& mesh : {icosphere(3), torus(40, 24), box(4), wavy_patch(24), annulus(), two_spheres()})
    for (std::size_t n : {12u, 40u, 150u, 500u})
      for (std::uint64_t k : {1u, 2u}) {
        const Checked c(mesh, random_seeds(mesh, n, k));
        if (!c.report.holds) continue;
        ++held;
        const MeshTopology input = topology_of(mesh);
        const Dual dual = extract_dual(c.diagram.polygons);
        const MeshTopology got = analyse_topology(dual.triangles, n);
        EXPECT_TRUE(same_topology(got, input));
        EXPECT_EQ(c.report.vertices_checked, dual.triangles.size());
      }
  EXPECT_GE(held, 10u);
}

TEST(BallProperty, HoldsForManySeedsOnASphere) {
  for (std::uint64_t k : {1u, 2u, 3u})
    EXPECT_TRUE(Checked(icosphere(4), random_seeds(icosphere(4), 300, k)).report.holds);
}

TEST(BallProperty, OneCellIsTheWholeSurface) {
  const auto alone = [](const TriangleMesh& mesh) {
    const Checked c(mesh, {{0.1, 0.2, 0.3}});
    EXPECT_FALSE(c.report.holds);
    EXPECT_TRUE(c.report.edges.empty() && c.report.vertices.empty());
    EXPECT_EQ(c.report.cells.size(), 1u);
    return c.report.cells.at(0);
  };
  const BallReport::Cell sphere = alone(icosphere(2)), ring = alone(torus(24, 16)), spheres = alone(two_spheres());
  EXPECT_EQ(sphere.euler, 2);
  EXPECT_EQ(sphere.loops, 0u);
  EXPECT_EQ(ring.euler, 0);
  EXPECT_EQ(ring.components, 1u);
  EXPECT_EQ(spheres.euler, 4);
  EXPECT_EQ(spheres.components, 2u);
  // A disk, but with all of the border.
  const BallReport::Cell disk = alone(grid_patch(4, 4));
  EXPECT_EQ(disk.euler, 1);
  EXPECT_EQ(disk.loops, 1u);
  EXPECT_EQ(disk.border_parts, 1u);
  EXPECT_EQ(disk.border_euler, 0);
  EXPECT_EQ(alone(annulus()).border_parts, 2u);
}

// Seeds around the ring cut the torus into tubes.
TEST(BallProperty, TubesAreFound) {
  std::vector<Vec3> seeds;
  for (int k = 0; k < 9; ++k) {
    const double a = 2 * std::numbers::pi * (k + 0.3) / 9;
    seeds.push_back({std::cos(a), std::sin(a), 0});
  }
  const Checked c(torus(48, 24), seeds);
  ASSERT_EQ(c.report.cells.size(), 9u);
  for (const BallReport::Cell& cell : c.report.cells) {
    EXPECT_EQ(cell.euler, 0);
    EXPECT_EQ(cell.components, 1u);
    EXPECT_EQ(cell.loops, 2u);
    EXPECT_EQ(cell.loop_parts.size(), 2u);
  }
  ASSERT_EQ(c.report.edges.size(), 9u);
  for (const BallReport::Edge& e : c.report.edges) {
    EXPECT_EQ(e.components, 1u);
    EXPECT_EQ(e.ends, 0u);
  }
  EXPECT_EQ(c.report.vertices_checked, 0u);
}

TEST(BallProperty, FourSeedsAreTooFewForATorus) {
  for (std::uint64_t k = 1; k < 9; ++k) {
    const Checked c(torus(40, 24), random_seeds(torus(40, 24), 4, k));
    EXPECT_FALSE(c.report.holds);
    EXPECT_FALSE(c.report.cells.empty() && c.report.edges.empty() && c.report.vertices.empty());
  }
}

// Seeds above a thin plate own what is below them too.
TEST(BallProperty, CellsOfTwoSheetsAreFound) {
  const TriangleMesh plate = scaled(box(8), {1, 1, 0.01});
  std::vector<Vec3> seeds;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) seeds.push_back({0.1 + 0.2 * i + 0.01 * j, 0.1 + 0.2 * j - 0.007 * i, 0.01});
  const Checked c(plate, seeds);
  std::size_t inner = 0;
  for (const BallReport::Cell& cell : c.report.cells) {
    const Vec3& x = seeds[cell.seed];
    if (std::min({x.x, x.y, 1 - x.x, 1 - x.y}) < 0.2) continue;
    ++inner;
    EXPECT_EQ(cell.components, 2u);
    EXPECT_EQ(cell.euler, 2);
    EXPECT_EQ(cell.loops, 2u);
    EXPECT_EQ(cell.parts.size(), 2u);
  }
  EXPECT_EQ(inner, 9u);
}

TEST(BallProperty, BordersCount) {
  // Two cells across a strip: disks that meet in a segment, but the dual would be a line.
  const TriangleMesh strip = grid_patch(8, 1);
  const Checked two(strip, {{2, 0.4, 0}, {6, 0.6, 0}});
  EXPECT_TRUE(two.report.cells.empty());
  ASSERT_EQ(two.report.edges.size(), 1u);
  EXPECT_EQ(two.report.edges[0].ends, 2u);
  EXPECT_EQ(two.report.edges[0].border_points, 2u);
  const Checked middle(strip, {{1, 0.4, 0}, {4, 0.5, 0}, {7, 0.6, 0}});
  ASSERT_EQ(middle.report.cells.size(), 1u);
  EXPECT_EQ(middle.report.cells[0].border_parts, 2u);
  EXPECT_EQ(middle.report.cells[0].euler, 1);
  // As many as it takes.
  EXPECT_TRUE(Checked(annulus(), random_seeds(annulus(), 400, 3)).report.holds);
  std::vector<Vec3> rows;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) rows.push_back({0.4 + 0.8 * i + 0.03 * (j % 3), 0.4 + 0.8 * j - 0.02 * (i % 4), 0});
  EXPECT_TRUE(Checked(grid_patch(4, 4), rows).report.holds);
}

// ---- Input that is not a plain surface

TEST(BallProperty, NonManifoldSheetsMayBeGlued) {
  const Checked c(pages(), random_seeds(pages(), 200, 1));
  EXPECT_FALSE(c.report.manifold);
  EXPECT_TRUE(c.report.cells.empty());
}

TEST(BallProperty, DuplicatedTrianglesMeetTwice) {
  const TriangleMesh mesh = duplicated_triangles();
  const Checked c(mesh, random_seeds(mesh, 30, 1));
  EXPECT_FALSE(c.report.holds);
  EXPECT_FALSE(c.report.vertices.empty());
}

// A cap on an edge is no crack: the same as with the triangle below divided there.
TEST(BallProperty, CollinearTrianglesLeaveNoCrack) {
  TriangleMesh cap{
      {{0, 0, 0}, {4, 0, 0}, {8, 0, 0}, {4, 5, 0}, {4, -5, 0}}, {{0, 1, 3}, {1, 2, 3}, {0, 4, 2}, {0, 2, 1}}, {}};
  TriangleMesh divided = cap;
  divided.triangles = {{0, 1, 3}, {1, 2, 3}, {0, 4, 1}, {4, 2, 1}};
  // The same through a chain of collinear triangles, with a vertex that no other triangle uses.
  TriangleMesh chain = cap;
  chain.vertices.push_back({2, 0, 0});
  chain.triangles = {{0, 1, 3}, {1, 2, 3}, {0, 4, 2}, {0, 2, 5}, {5, 2, 1}, {0, 5, 1}};
  for (std::uint64_t k = 0; k < 40; ++k) {
    const std::vector<Vec3> seeds = random_seeds(divided, 3 + k % 20, k);
    const Checked want(divided, seeds);
    for (const TriangleMesh& mesh : {cap, chain}) {
      const Checked got(mesh, seeds);
      EXPECT_EQ(got.report.unread, 0u);
      EXPECT_EQ(got.report.euler, 1);
      EXPECT_EQ(got.report.holds, want.report.holds);
      ASSERT_EQ(got.report.cells.size(), want.report.cells.size());
      ASSERT_EQ(got.report.edges.size(), want.report.edges.size());
      for (std::size_t i = 0; i < got.report.cells.size(); ++i) {
        EXPECT_EQ(got.report.cells[i].seed, want.report.cells[i].seed);
        EXPECT_EQ(got.report.cells[i].border_parts, want.report.cells[i].border_parts);
        for (const auto& part : got.report.cells[i].parts)
          for (std::size_t p : part) EXPECT_EQ(got.diagram.polygons.pairs.at(p).cell, got.report.cells[i].seed);
      }
      for (std::size_t i = 0; i < got.report.edges.size(); ++i)
        EXPECT_EQ(got.report.edges[i].ends, want.report.edges[i].ends);
    }
  }
}

TEST(BallProperty, TiesAreNoFailures) {
  // Cells of seeds on a grid in a plane are squares; where four meet, one of two vertices has an edge of no length.
  const TriangleMesh patch = grid_patch(8, 8);
  const Checked c(patch, grid_seeds(patch, 8, 8, 1));
  EXPECT_TRUE(c.report.holds);
  EXPECT_EQ(c.report.euler, 1);
  const Checked corners(icosphere(2), vertex_seeds(icosphere(2)));
  EXPECT_TRUE(corners.report.holds);
}

TEST(BallProperty, DoesNotDependOnThreads) {
  const TriangleMesh mesh = scaled(torus(60, 36), {1, 1, 0.05});
  const std::vector<Vec3> seeds = random_seeds(mesh, 400, 3);
  std::vector<BallReport> reports;
  for (unsigned threads : {1u, 2u}) {
    const ThreadLimit limit(threads);
    reports.push_back(Checked(mesh, seeds).report);
  }
  ASSERT_FALSE(reports[0].holds);
  ASSERT_EQ(reports[0].cells.size(), reports[1].cells.size());
  for (std::size_t i = 0; i < reports[0].cells.size(); ++i) {
    EXPECT_EQ(reports[0].cells[i].seed, reports[1].cells[i].seed);
    EXPECT_EQ(reports[0].cells[i].parts, reports[1].cells[i].parts);
    EXPECT_EQ(reports[0].cells[i].loop_parts, reports[1].cells[i].loop_parts);
  }
  ASSERT_EQ(reports[0].edges.size(), reports[1].edges.size());
  for (std::size_t i = 0; i < reports[0].edges.size(); ++i)
    EXPECT_EQ(reports[0].edges[i].parts, reports[1].edges[i].parts);
}

// ---- Topology control

// Squares that cross along a line. Whoever owns a point of that line owns it on both.
TEST(Sheets, CrossingSheetsGetAVertexEach) {
  const TriangleMesh flat = scaled(grid_patch(8, 8), {0.125, 0.125, 1}, {0, 0, 0.31});
  TriangleMesh upright = flat;
  for (Vec3& v : upright.vertices) v = {0.43 + 0.1 * (v.z - v.y), v.x, v.y};
  const TriangleMesh mesh = joined(flat, upright);
  const std::vector<Vec3> seeds = random_seeds(mesh, 600, 1);
  Checked c(mesh, seeds);
  ASSERT_FALSE(c.report.holds);
  std::vector<Vec3> vertices = seeds;
  ASSERT_TRUE(divide_cells(c.surface, c.report, std::numeric_limits<double>::infinity(), c.diagram.polygons, vertices));
  EXPECT_GT(vertices.size(), seeds.size());
  EXPECT_EQ(count_untiled(c.surface, c.diagram.polygons), 0u);
  const BallReport report = check_ball_property(c.surface, c.diagram.polygons);
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(report.cells_checked, vertices.size());
  for (const BallReport::Cell& cell : report.cells) EXPECT_EQ(cell.components, 1u);
  for (std::size_t i = seeds.size(); i < vertices.size(); ++i) {
    const Vec3& p = vertices[i];
    EXPECT_LT(std::min(std::abs(p.z - 0.31), std::abs(p.x - 0.43 - 0.1 * (0.31 - p.z))), 1e-12);
  }
  // What does not touch is not divided.
  Checked spheres(scaled(two_spheres(), {1, 1, 1}), {{0, 0, 0}});
  std::vector<Vec3> one{{0, 0, 0}};
  EXPECT_FALSE(divide_cells(spheres.surface, spheres.report, 0.01, spheres.diagram.polygons, one));
  EXPECT_TRUE(divide_cells(spheres.surface, spheres.report, std::numeric_limits<double>::infinity(),
                           spheres.diagram.polygons, one));
  EXPECT_EQ(one.size(), 2u);
}

void expect_mended(const TriangleMesh& mesh, const RemeshResult& result) {
  const MeshTopology want = topology_of(mesh), got = topology_of(result.mesh);
  EXPECT_TRUE(result.ball_property);
  EXPECT_TRUE(result.faults.empty());
  EXPECT_TRUE(result.topology_matches);
  EXPECT_TRUE(got.manifold);
  EXPECT_EQ(got.closed, want.closed);
  EXPECT_EQ(got.euler, want.euler);
  EXPECT_EQ(got.components, want.components);
  EXPECT_EQ(result.untiled, 0u);
}

struct Start {
  std::string name;
  TriangleMesh mesh;
  std::size_t seeds;
};

std::vector<Start> starts() {
  return {{"torus_4", torus(40, 24), 4},
          {"two_spheres_4", two_spheres(), 4},
          {"annulus_4", annulus(), 4},
          {"box_5", box(4), 5},
          {"plate_40", scaled(box(4), {1, 1, 0.02}), 40},
          {"lens_30", scaled(icosphere(4), {1, 1, 0.02}), 30},
          {"needle_10", scaled(icosphere(3), {0.03, 0.03, 1}), 10},
          {"thin_ring_30", scaled(torus(60, 36), {1, 1, 0.1}), 30},
          {"crossing_spheres_120", joined(icosphere(2), scaled(icosphere(2), {1, 1, 1}, {0.7, 0.3, 0.2})), 120}};
}

void PrintTo(const Start& start, std::ostream* out) { *out << start.name; }

class Mending : public testing::TestWithParam<Start> {};

TEST_P(Mending, EndsWithTheProperty) {
  const auto& [name, mesh, seeds] = GetParam();
  RemeshOptions options;
  for (Energy energy : {Energy::constrained, Energy::restricted}) {
    options.energy = energy;
    options.seeds = random_seeds(mesh, seeds, 5);
    expect_mended(mesh, remesh(mesh, options));
  }
}

TEST_P(Mending, IsReproducible) {
  const auto& [name, mesh, seeds] = GetParam();
  RemeshOptions options;
  options.seeds = random_seeds(mesh, seeds, 6);
  options.threads = 1;
  const TriangleMesh one = remesh(mesh, options).mesh;
  options.threads = 2;
  const TriangleMesh two = remesh(mesh, options).mesh;
  EXPECT_TRUE(one.triangles == two.triangles);
  EXPECT_TRUE(same_bits(one.vertices, two.vertices));
}

INSTANTIATE_TEST_SUITE_P(Topology, Mending, testing::ValuesIn(starts()),
                         [](const auto& instance) { return instance.param.name; });

TEST(TopologyControlTest, ADensityThatShunsThinPartsDoesNotUndoIt) {
  const TriangleMesh lens = scaled(icosphere(4), {1, 1, 0.05});
  std::vector<double> density;
  for (const Vec3& v : lens.vertices) density.push_back(std::pow(1e-3 + v.z * v.z * 400, 2));
  const Surface surface(lens, density);
  CpuBackend backend(surface, NeighbourSource::nearest);
  RemeshOptions options;
  options.vertices = 200;
  expect_mended(lens, remesh(backend, {}, plan_of(options)));
}

TEST(TopologyControlTest, CheckReportsAndChangesNothing) {
  const TriangleMesh mesh = torus(40, 24);
  RemeshOptions options;
  options.seeds = random_seeds(mesh, 6, 2);
  options.iterations = 0;
  options.energy = Energy::restricted;
  options.topology = TopologyControl::check;
  options.min_angle = 0;
  const RemeshResult result = remesh(mesh, options);
  EXPECT_FALSE(result.ball_property);
  EXPECT_EQ(result.divided, 0u);
  ASSERT_FALSE(result.faults.empty());
  for (const TopologyFault& f : result.faults) {
    ASSERT_FALSE(f.seeds.empty());
    EXPECT_TRUE(std::find(options.seeds.begin(), options.seeds.end(), f.position) != options.seeds.end());
    EXPECT_TRUE(f.seeds[0] == kNone || result.mesh.vertices[f.seeds[0]] == f.position);
    EXPECT_FALSE(f.what.empty());
  }
}

TEST(TopologyControlTest, SeedsThatAreNotFreeStay) {
  const TriangleMesh lens = scaled(icosphere(4), {1, 1, 0.06});
  const Surface surface(lens);
  CpuBackend backend(surface, NeighbourSource::nearest);
  FreeRun free(backend, random_seeds(lens, 500, 4));
  CvtRun& run = free.run;
  OptimiseOptions options;
  options.constrained = true;
  options.iterations = 30;
  optimise(run, options);
  std::map<Index, Vec3> fixed;
  for (Index i = 0; i < run.seeds.size(); ++i) {
    run.seeds.edit_places()[i] = {i % 3 ? SeedPlace::Kind::surface : SeedPlace::Kind::fixed, kNone, i, 0};
    if (i % 3 == 0) fixed[i] = run.seeds.position(i);
  }
  const TopologyOutcome outcome =
      enforce_topology(run, FeatureTrace(surface, run.curves()), topology_of(lens), options);
  EXPECT_TRUE(outcome.ball.holds);
  EXPECT_GT(outcome.inserted, 0u);
  // The energy is that of the seeds.
  EXPECT_EQ(run.energy, diagram_of(surface, run.seeds.positions(), NeighbourSource::nearest).moments.energy);
  std::size_t found = 0;
  for (std::size_t i = 0; i < run.seeds.size(); ++i)
    if (run.seeds.kind(i) == SeedPlace::Kind::fixed) {
      ++found;
      EXPECT_LT(norm(run.seeds.position(i) - fixed.at(run.seeds.place(i).corner)), 1e-12);
    }
  EXPECT_EQ(found, fixed.size());
}

// A double cone with a sharp rim.
TriangleMesh double_cone(double height) {
  constexpr Index kRim = 48;
  TriangleMesh mesh;
  for (Index k = 0; k < kRim; ++k) {
    const double angle = 2 * std::numbers::pi * k / kRim;
    mesh.vertices.push_back({std::cos(angle), std::sin(angle), 0});
  }
  mesh.vertices.push_back({0, 0, height});
  mesh.vertices.push_back({0, 0, -height});
  for (Index k = 0; k < kRim; ++k) {
    mesh.triangles.push_back({k, (k + 1) % kRim, kRim});
    mesh.triangles.push_back({(k + 1) % kRim, k, kRim + 1});
  }
  return mesh;
}

// Seeds on the creases of a mesh, and others at random, after 30 steps.
struct CreasedRun {
  CreasedRun(const TriangleMesh& mesh, std::size_t count)
      : surface(mesh), backend(surface, NeighbourSource::nearest), curves(sharp_graph(mesh), mesh.vertices),
        measure(surface, curves), trace(surface, curves), scale(measure.scale(count)), run(backend, curves, context) {
    run.seeds = seeds_on_features(curves, measure, scale);
    run.seeds.add(random_seeds(mesh, count - run.seeds.size(), 3));
    options.constrained = true;
    options.iterations = 30;
    optimise(run, options);
  }

  bool recover() { return recover_features(run, trace, measure, scale, options).broken.empty(); }
  TopologyOutcome enforce() { return enforce_topology(run, trace, topology_of(surface.mesh), options); }
  bool has_all_curves() {
    const Diagram& diagram = run.diagram(Want::polygons | Want::dual);
    return check_features(trace, curves, run.seeds.places(), diagram).broken.empty();
  }

  const Surface surface;
  CpuBackend backend;
  const FeatureCurves curves;
  const CurveMeasure measure;
  const FeatureTrace trace;
  const double scale;
  const Context context;
  CvtRun run;
  OptimiseOptions options;
};

// Near a rim the seeds of one side own pieces of the other. Those put there for that must not cut the rim.
TEST(TopologyControlTest, CurvesStay) {
  for (const double height : {0.05, 0.1, 0.2})
    for (const std::size_t count : {60, 120, 240}) {
      SCOPED_TRACE(fmt::format("{} {}", height, count));
      CreasedRun creased(double_cone(height), count);
      ASSERT_EQ(creased.curves.size(), 1u);
      ASSERT_TRUE(creased.recover());
      const TopologyOutcome outcome = creased.enforce();
      EXPECT_TRUE(outcome.ball.holds);
      EXPECT_GT(outcome.inserted, 0u);
      EXPECT_TRUE(creased.has_all_curves());
    }
}

// A pointed leaf: two bulging sides between the same two creases, which end at the tip.
TriangleMesh leaf(double width, double height) {
  constexpr Index kPieces = 8;  // of a side
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}};
  for (Index k = 0; k < 2 * kPieces; ++k) {
    const double y = 1 - 2 * (k % kPieces) / static_cast<double>(kPieces), side = k < kPieces ? 1 : -1;
    mesh.vertices.push_back({1, side * width * y, side * height * (1 - y * y)});
  }
  for (Index k = 0; k < 2 * kPieces; ++k) {
    const Index a = 2 + k, b = 2 + (k + 1) % (2 * kPieces);
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({1, a, b});
  }
  return mesh;
}

// The cell of the tip lies between those of the first seeds of both creases, and these meet on either side, unless a
// seed on the surface comes between. Nearer to the tip than they are it would cut a crease.
TEST(TopologyControlTest, TipsGetSeedsBesideTheFirstOfTheirCurves) {
  for (const double width : {0.1, 0.2, 0.3})
    for (const std::size_t count : {60, 120, 240}) {
      SCOPED_TRACE(fmt::format("{} {}", width, count));
      CreasedRun creased(leaf(width, 0.6 * width), count);
      ASSERT_TRUE(creased.recover());
      EXPECT_TRUE(creased.enforce().ball.holds);
      EXPECT_TRUE(creased.has_all_curves());
    }
}

// Thin ears and trunk, genus 3; legs that touch and cross.
TEST(TopologyControlTest, RealModelsGrowFromFourSeeds) {
  for (const char* name : {"elephant.off", "camel.off"}) {
    const std::string path = shared_model(name);
    if (path.empty()) GTEST_SKIP() << "no shared models";
    SCOPED_TRACE(name);
    const TriangleMesh mesh = read_mesh(path);
    RemeshOptions options;
    options.seeds = initial_seeds(Surface(mesh), 4, 1);
    expect_mended(mesh, remesh(mesh, options));
  }
}

// Where nearly every cell has parts of many triangles, more seeds do not help, and none is left.
TEST(TopologyControlTest, ADenseSoupGetsNoSeedsInVain) {
  const TriangleMesh mesh = soup(800, 7);
  const Surface surface(mesh);
  CpuBackend backend(surface, NeighbourSource::nearest);
  FreeRun free(backend, random_seeds(mesh, 200, 3));
  OptimiseOptions options;
  options.constrained = true;
  options.iterations = 10;
  optimise(free.run, options);
  const TopologyOutcome outcome =
      enforce_topology(free.run, FeatureTrace(surface, free.curves), topology_of(mesh), options);
  EXPECT_GT(outcome.rounds, 0);
  EXPECT_FALSE(outcome.ball.holds);
  EXPECT_GT(outcome.ball.cells.size(), 100u);
  EXPECT_EQ(free.seeds().size(), 200u);
}

// Leaves a fiftieth as thick as they are long, with so few seeds that no number of more beside them mends all.
TEST(TopologyControlTest, AsManySeedsStayWhereThePropertyIsNotToBeHad) {
  std::size_t failed = 0;
  for (const double width : {0.2, 0.3})
    for (const std::size_t count : {60, 120}) {
      SCOPED_TRACE(fmt::format("{} {}", width, count));
      CreasedRun creased(leaf(width, 0.02), count);
      if (creased.enforce().ball.holds) continue;
      ++failed;
      EXPECT_LE(creased.run.seeds.size(), count + count / 100);
    }
  EXPECT_GT(failed, 0u);
}

}  // namespace
}  // namespace bisector::test
