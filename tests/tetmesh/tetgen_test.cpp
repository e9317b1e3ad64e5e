// From closed surfaces to tetrahedra that keep them: what is refused, what is kept, and what happens when TetGen fails.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/orientation.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "support/models.h"
#include "tetmesh/carve.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/conform.h"

namespace bisector::test {
namespace {

TriangleMesh moved(TriangleMesh mesh, double scale, const Vec3& by, bool turn = false) {
  for (Vec3& p : mesh.vertices) p = scale * p + by;
  if (turn)
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

void expect_error(const std::function<void()>& body, const std::string& part) {
  try {
    body();
    ADD_FAILURE() << "no error: " << part;
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_NE(what.find(part), std::string::npos) << what;
  }
}

std::vector<Triangle> rotated(std::vector<Triangle> triangles) {
  for (Triangle& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

// Positive tetrahedra that tile the inside of `surface` and whose boundary is exactly it.
void expect_fills(const TetMesh& mesh, const TriangleMesh& surface, std::size_t flat = 0) {
  const TetQualityReport quality = measure_tet_quality(mesh);
  EXPECT_EQ(quality.inverted, 0u);
  EXPECT_EQ(quality.zero_volume, flat);
  const double volume = enclosed_volume(surface);
  EXPECT_NEAR(quality.volume, volume, 1e-10 * volume);
  EXPECT_TRUE(analyse_tet_topology(mesh).conforming);
  EXPECT_EQ(rotated(boundary_facets(mesh.tets)), rotated(surface.triangles));
  ASSERT_GE(mesh.vertices.size(), surface.vertices.size());
  EXPECT_EQ(std::memcmp(mesh.vertices.data(), surface.vertices.data(), surface.vertices.size() * sizeof(Vec3)), 0);
}

std::vector<Vec3> points_in_ball(std::size_t n, double radius, std::uint64_t random_seed) {
  SplitMix64 random(random_seed);
  std::vector<Vec3> points;
  while (points.size() < n) {
    const Vec3 p{random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)};
    if (norm2(p) < 1) points.push_back(radius * p);
  }
  return points;
}

TEST(CheckSurface, OrientsNestedShells) {
  // A ball with a cavity in which a ball floats, and a box beside, all turned at random.
  const std::vector<TriangleMesh> shells{moved(icosphere(2), 1, {}), moved(icosphere(2), 0.5, {0.1, 0, 0}),
                                         moved(icosphere(1), 0.25, {0.1, 0, 0}), moved(box(2), 1, {2, 0, 0})};
  double volume = 0;
  for (std::size_t s = 0; s < 4; ++s) volume += (s == 1 ? -1 : 1) * enclosed_volume(shells[s]);
  for (int turns = 0; turns < 16; ++turns) {
    TriangleMesh mesh;
    for (std::size_t s = 0; s < 4; ++s) mesh = joined(mesh, moved(shells[s], 1, {}, turns >> s & 1));
    std::swap(mesh.triangles[5][0], mesh.triangles[5][1]);
    const TriangleMesh checked = check_surface(mesh);
    EXPECT_TRUE(analyse_topology(checked.triangles, checked.vertices.size()).oriented);
    EXPECT_NEAR(enclosed_volume(checked), volume, 1e-12);
  }
}

// Shells whose vertices share coordinates, so that rays meet edges and vertices.
TEST(CheckSurface, OrientsShellsAlignedWithTheirRays) {
  TriangleMesh mesh = moved(box(4), 4, {});
  double volume = 64;
  for (int x = 0; x < 2; ++x)
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < 2; ++z) {
        mesh = joined(mesh, moved(box(1), 1, {0.5 + 2.0 * x, 0.5 + 2.0 * y, 0.5 + 2.0 * z}));
        mesh = joined(mesh, moved(box(2), 0.5, {0.75 + 2.0 * x, 0.75 + 2.0 * y, 0.75 + 2.0 * z}, (x + y + z) % 2));
        volume -= 1 - 0.125;
      }
  const TriangleMesh checked = check_surface(mesh);
  EXPECT_EQ(checked.vertices.size(), mesh.vertices.size());
  EXPECT_NEAR(enclosed_volume(checked), volume, 1e-12);
}

TEST(CheckSurface, MergesEqualVertices) {
  const TriangleMesh ball = icosphere(1);
  TriangleMesh soup;
  for (const Triangle& t : ball.triangles) {
    const auto n = static_cast<Index>(soup.vertices.size());
    for (const Index v : t) soup.vertices.push_back(ball.vertices[v]);
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  const TriangleMesh checked = check_surface(soup);
  EXPECT_EQ(checked.triangles.size(), ball.triangles.size());
  EXPECT_NEAR(enclosed_volume(checked), enclosed_volume(ball), 1e-12);
}

TEST(CheckSurface, RefusesWhatBoundsNoSolid) {
  TriangleMesh open = icosphere(1);
  open.triangles[7] = open.triangles.back();
  open.triangles.pop_back();
  const TriangleMesh ball = icosphere(1);
  expect_error([&] { check_surface(open); }, "3 edges have one triangle (");
  expect_error([&] { check_surface({}); }, "no triangles");
  expect_error([&] { check_surface(pages()); }, "not closed");
  TriangleMesh flat = ball;
  flat.triangles.push_back({3, 4, 4});
  expect_error([&] { check_surface(flat); }, "1 triangle without area (80)");
  TriangleMesh far = ball;
  far.triangles.push_back({3, 4, 99});
  expect_error([&] { check_surface(far); }, "index 99 is out of range");
  TriangleMesh nan = ball;
  nan.vertices[4].z = std::nan("");
  expect_error([&] { check_surface(nan); }, "vertex 4");
  // Two cubes that share an edge, a vertex, or overlap.
  const TriangleMesh cube = box(1);
  expect_error([&] { check_surface(joined(cube, moved(cube, 1, {1, 1, 0}))); }, "1 edge has more than two triangles (");
  expect_error([&] { check_surface(joined(cube, moved(cube, 1, {1, 1, 1}))); }, "touches itself at 1 vertex (");
  expect_error([&] { check_surface(joined(cube, moved(cube, 1, {0.25, 0.375, 0.5}))); }, "intersects itself");
  expect_error([&] { check_surface(joined(cube, moved(cube, 0.5, {0.125, 0.25, 0.5}))); }, "intersects itself");
  expect_error([&] { check_surface(joined(cube, moved(cube, 0.5, {0.25, 1, 0.25}))); }, "intersects itself");
  // A Klein bottle's grid: closed, manifold, one-sided; placed so that only its topology can be refused before its
  // crossings.
  TriangleMesh klein;
  const int n = 6;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) klein.vertices.push_back({i + 0.1 * j, j * j + 0.3 * i, 0.7 * i * j});
  const auto at = [n](int i, int j) { return static_cast<Index>((i % n) * n + (i < n ? j % n : (2 * n - j) % n)); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      klein.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      klein.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  expect_error([&] { check_surface(klein); }, "one side only");
}

TEST(Carve, KeepsTheInsideOfFacets) {
  // Two tetrahedra on a common facet.
  const std::vector<Tetrahedron> tets{{0, 1, 2, 3}, {1, 2, 3, 4}};
  const std::vector<Tetrahedron> one{{0, 1, 2, 3}};
  EXPECT_EQ(carve({{0, 1, 2, 3}, {4, 2, 1, 3}}, boundary_facets(one)).tets, one);
  const Carved missing = carve(one, {{0, 1, 2}, {0, 2, 4}});
  EXPECT_EQ(missing.missing, (std::vector<Index>{0, 1}));
  EXPECT_TRUE(missing.tets.empty());
  EXPECT_EQ(carve(tets, {}).tets.size(), 0u);
}

class Tetgen : public ::testing::Test {
 protected:
  void SetUp() override {
    if (find_tetgen().empty()) GTEST_SKIP() << "built without TetGen";
  }
};

TEST_F(Tetgen, KeepsSurfaces) {
  TriangleMesh plate = box(8);
  for (Vec3& p : plate.vertices) p.z *= 0x1p-30;
  for (const TriangleMesh& surface : {box(1), box(4), icosphere(3), torus(24, 12), two_spheres(), plate}) {
    const TriangleMesh checked = check_surface(surface);
    const TetgenResult result = tetgen_tets(checked);
    expect_fills(result.mesh, checked, result.zero_volume);
    EXPECT_EQ(result.mesh.boundary, checked.triangles);
    EXPECT_EQ(result.mesh.vertices.size(), checked.vertices.size() + result.steiner_points);
  }
}

TEST_F(Tetgen, LeavesCavitiesEmptyAndNumbersParts) {
  TriangleMesh surface = joined(icosphere(2), moved(icosphere(2), 0.5, {0.1, 0, 0}));
  surface = check_surface(joined(surface, moved(icosphere(1), 0.25, {0.1, 0, 0})));
  const TetgenResult result = tetgen_tets(surface);
  expect_fills(result.mesh, surface, result.zero_volume);
  const TetTopology topology = analyse_tet_topology(result.mesh);
  EXPECT_EQ(topology.components, 2u);
  EXPECT_EQ(topology.unused_vertices, 0u);
  ASSERT_EQ(result.mesh.regions.size(), result.mesh.tets.size());
  for (std::size_t i = 0; i < result.mesh.tets.size(); ++i) {
    const bool floating = norm(result.mesh.vertices[result.mesh.tets[i][0]] - Vec3{0.1, 0, 0}) < 0.3;
    EXPECT_EQ(result.mesh.regions[i],
              floating == (norm(result.mesh.vertices[result.mesh.tets[0][0]] - Vec3{0.1, 0, 0}) < 0.3) ? 1 : 2);
  }
}

TEST_F(Tetgen, KeepsUnusedVerticesAndMarks) {
  TriangleMesh surface = icosphere(2);
  surface.vertices.insert(surface.vertices.begin() + 10, Vec3{0.01, 0.02, 0.03});
  for (Triangle& t : surface.triangles)
    for (Index& v : t) v += v >= 10;
  surface.labels.assign(surface.triangles.size(), 3);
  surface.feature_edges = {{0, 1}};
  const TetgenResult result = tetgen_tets(surface);
  expect_fills(result.mesh, surface, result.zero_volume);
  const TetTopology topology = analyse_tet_topology(result.mesh);
  EXPECT_EQ(topology.unused_vertices, 1u);
  EXPECT_EQ(result.mesh.boundary_labels, surface.labels);
  EXPECT_EQ(result.mesh.feature_edges, surface.feature_edges);
}

TEST_F(Tetgen, RunsRepeat) {
  const TriangleMesh surface = torus(24, 12);
  EXPECT_EQ(tetgen_tets(surface).mesh.tets, tetgen_tets(surface).mesh.tets);
}

TEST_F(Tetgen, RealModels) {
  for (const char* name : {"anchor.off", "fandisk.off"}) {
    const std::string path = shared_model(name);
    if (path.empty()) GTEST_SKIP() << name << " is not there";
    const TriangleMesh surface = check_surface(read_mesh(path));
    const TetgenResult result = tetgen_tets(surface);
    expect_fills(result.mesh, surface, result.zero_volume);
  }
}

TEST_F(Tetgen, BadSurfacesEndInErrors) {
  const TriangleMesh cube = box(1);
  TetgenOptions options;
  options.time_limit = 0.3;  // TetGen does not end on some of them
  for (const TriangleMesh& bad : {joined(cube, moved(cube, 1, {0.25, 0.375, 0.5})), grid_patch(3, 3), wavy_patch(4),
                                  single_triangle(), soup(40, 3), needles(), duplicated_triangles(), TriangleMesh{}})
    expect_error([&] { tetgen_tets(bad, options); }, "");
  TriangleMesh nan = cube;
  nan.vertices[2].x = std::nan("");
  expect_error([&] { tetgen_tets(nan); }, "vertex 2");
}

// Stands in for a TetGen that fails in some way.
class FailingTetgen : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("bisector-tetgen-" + std::to_string(::getpid()));
  }
  void TearDown() override { std::filesystem::remove(path_); }
  TetgenOptions does(const std::string& body) {
    std::ofstream(path_) << "#!/bin/sh\n" << body << "\n";
    std::filesystem::permissions(path_, std::filesystem::perms::owner_all);
    return {10, path_.string()};
  }
  std::filesystem::path path_;
};

TEST_F(FailingTetgen, EachFailureIsOneLine) {
  const TriangleMesh surface = icosphere(3);
  const auto run = [&](const TetgenOptions& options) { return [&surface, options] { tetgen_tets(surface, options); }; };
  expect_error(run(does("kill -SEGV $$")), "crashed");
  expect_error(run(does("echo first; echo 'what it said'; kill -ABRT $$")), "what it said");
  expect_error(run(does("kill -KILL $$")), "memory");
  expect_error(run(does("cat > /dev/null; exit 96")), "memory");
  expect_error(run(does("exit 67")), "intersects itself");
  expect_error(run(does("exit 66")), "code 2");
  expect_error(run(does("exit 3")), "code 3");
  expect_error(run(does("cat > /dev/null; echo nonsense >&0; exit 0")), "incomplete");
  expect_error(run(does("yes | head -c 3000000; exit 66")), "code 2");
  expect_error(run({10, "/nonexistent/tetgen"}), "cannot be started");
  TetgenOptions slow = does("sleep 30");
  slow.time_limit = 0.2;
  const auto start = std::chrono::steady_clock::now();
  expect_error(run(slow), "took longer");
  std::atomic<bool> cancel = false;
  Context context;
  context.cancel = &cancel;
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    cancel = true;
  });
  EXPECT_THROW(tetgen_tets(surface, does("sleep 30"), context), Cancelled);
  later.join();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
}

TEST(Conform, DelaunayWhereTheBoundaryIsDelaunay) {
  const TriangleMesh ball = icosphere(3);
  const std::vector<Vec3> points = points_in_ball(2000, 0.85, 2);
  const ConformingTets result = conforming_tets(ball, points);
  EXPECT_TRUE(result.delaunay);
  EXPECT_EQ(result.missing + result.steiner_points, 0u);
  expect_fills(result.mesh, ball);
  EXPECT_EQ(result.mesh.vertices.size(), ball.vertices.size() + points.size());
  EXPECT_EQ(analyse_tet_topology(result.mesh).unused_vertices, 0u);
  // No vertex lies in a circumsphere: the centre is at the same distance from the corners and no nearer to any vertex.
  for (std::size_t i = 0; i < result.mesh.tets.size(); i += 97) {
    const Tetrahedron& t = result.mesh.tets[i];
    const Vec3 o = result.mesh.vertices[t[0]], u = result.mesh.vertices[t[1]] - o, v = result.mesh.vertices[t[2]] - o,
               w = result.mesh.vertices[t[3]] - o;
    const Vec3 centre =
        (0.5 / dot(u, cross(v, w))) * (norm2(u) * cross(v, w) + norm2(v) * cross(w, u) + norm2(w) * cross(u, v));
    for (const Vec3& p : result.mesh.vertices) EXPECT_GE(norm(p - o - centre), norm(centre) * (1 - 1e-9));
  }
}

// The boundary, its marks, and all points but those refused, in order, as vertices.
void expect_conforms(const ConformingTets& result, const TriangleMesh& boundary, const std::vector<Vec3>& points) {
  expect_fills(result.mesh, boundary);
  EXPECT_EQ(result.mesh.boundary, boundary.triangles);
  EXPECT_EQ(result.mesh.boundary_labels, boundary.labels);
  EXPECT_EQ(result.mesh.feature_edges, boundary.feature_edges);
  EXPECT_EQ(result.delaunay, result.missing == 0);
  std::vector<Vec3> vertices;
  for (Index i = 0; i < points.size(); ++i)
    if (!std::binary_search(result.refused.begin(), result.refused.end(), i)) vertices.push_back(points[i]);
  const std::size_t first = boundary.vertices.size();
  ASSERT_EQ(result.mesh.vertices.size(), first + vertices.size() + result.steiner_points);
  for (std::size_t k = 0; k < vertices.size(); ++k) EXPECT_EQ(result.mesh.vertices[first + k], vertices[k]);
  for (std::size_t v = first; v < result.mesh.vertices.size(); ++v) {
    const bool used = std::any_of(result.mesh.tets.begin(), result.mesh.tets.end(),
                                  [&](const Tetrahedron& t) { return std::find(t.begin(), t.end(), v) != t.end(); });
    EXPECT_TRUE(used) << v;
  }
}

// Any program that BISECTOR_TETGEN names, while this lives.
class TetgenAt {
 public:
  explicit TetgenAt(const char* path) {
    if (const char* now = std::getenv("BISECTOR_TETGEN")) before_ = now;
    ::setenv("BISECTOR_TETGEN", path, 1);
  }
  ~TetgenAt() { before_.empty() ? ::unsetenv("BISECTOR_TETGEN") : ::setenv("BISECTOR_TETGEN", before_.c_str(), 1); }

 private:
  std::string before_;
};

// Points so close behind the wall of a cavity that a sphere through a triangle's corners without its point in it holds
// vertices of the wall opposite. Without them the Delaunay tetrahedra conform, so TetGen is not called.
TEST(Conform, PointsBehindTheBoundaryComeLast) {
  const TetgenAt nowhere("/nonexistent/tetgen");
  TriangleMesh ball = check_surface(joined(icosphere(3), moved(icosphere(2), 0.5, {})));
  ball.vertices.insert(ball.vertices.begin() + 10, Vec3{0.01, 0.02, 0.03});  // of no triangle
  for (Triangle& t : ball.triangles)
    for (Index& v : t) v += v >= 10;
  ball.labels.resize(ball.triangles.size());
  for (std::size_t t = 0; t < ball.labels.size(); ++t) ball.labels[t] = static_cast<std::int32_t>(t % 5);
  ball.feature_edges = {{ball.triangles[7][0], ball.triangles[7][1]}};
  std::vector<Vec3> points;
  for (const Vec3& p : points_in_ball(400, 0.9, 3))
    if (norm(p) > 0.6) points.push_back(p);
  const std::size_t far = points.size();
  for (const std::size_t t : {3u, 7u, 200u, 201u, 300u}) {
    const Triangle& c = ball.triangles[icosphere(3).triangles.size() + t];
    points.push_back((1.001 / 3) * (ball.vertices[c[0]] + ball.vertices[c[1]] + ball.vertices[c[2]]));
  }
  const ConformingTets result = conforming_tets(ball, points);
  EXPECT_GE(result.missing, points.size() - far);
  EXPECT_EQ(result.steiner_points, 0u);
  EXPECT_TRUE(result.refused.empty());
  expect_conforms(result, ball, points);
  EXPECT_EQ(conforming_tets(ball, points).mesh.tets, result.mesh.tets);
}

// Schoenhardt's polyhedron, which has no tetrahedra without a Steiner point.
TriangleMesh twisted_prism() {
  TriangleMesh prism;
  const double c = std::cos(std::acos(-1.0) / 6), s = 0.5;
  prism.vertices = {{1, 0, 0}, {-s, c, 0}, {-s, -c, 0}, {c, s, 1}, {-c, s, 1}, {0, -1, 1}};
  prism.triangles = {{0, 2, 1}, {3, 4, 5}};
  for (Index k = 0; k < 3; ++k) {
    const Index a = k, b = (k + 1) % 3, top = 3 + k, next = 3 + (k + 1) % 3;
    prism.triangles.push_back({a, b, next});
    prism.triangles.push_back({a, next, top});
  }
  return prism;
}

TEST(Conform, TetgenWhereBoundaryVerticesAreInTheWay) {
  if (find_tetgen().empty()) GTEST_SKIP() << "built without TetGen";
  const TriangleMesh prism = check_surface(twisted_prism());
  const std::vector<Vec3> points{{0.05, 0.02, 0.5}, {0.1, 0.1, 0.2}, {-0.1, 0.05, 0.8}, {5, 0, 0}};
  const ConformingTets result = conforming_tets(prism, points);
  EXPECT_GT(result.missing, 0u);
  EXPECT_GT(result.steiner_points, 0u);
  EXPECT_EQ(result.refused, std::vector<Index>{3});
  expect_conforms(result, prism, points);
  EXPECT_EQ(conforming_tets(prism, points).mesh.tets, result.mesh.tets);
  expect_conforms(conforming_tets(prism, {}), prism, {});
  const TetgenAt nowhere("/nonexistent/tetgen");
  expect_error([&] { conforming_tets(prism, points); }, "cannot be started");
}

TEST(Conform, PointsThatAreNotInsideAreLeftOut) {
  const TriangleMesh ball = icosphere(2);
  const std::vector<Vec3> points{{0, 0, 0}, {2, 0, 0}, {0.5, 0, 0}, {0, 3, 0}};
  const ConformingTets result = conforming_tets(ball, points);
  EXPECT_EQ(result.refused, (std::vector<Index>{1, 3}));
  expect_conforms(result, ball, points);
}

TEST(Conform, BadPoints) {
  const TriangleMesh ball = icosphere(2);
  expect_error([&] { conforming_tets(ball, {{0.25, 0, 0}, {0.25, 0, 0}}); }, "the same point");
  expect_error([&] { conforming_tets(ball, {ball.vertices[3]}); }, "the same point");
  expect_error([&] { conforming_tets(ball, {{0, std::nan(""), 0}}); }, "not finite");
}

}  // namespace
}  // namespace bisector::test
