// Improvement of tetrahedral meshes and what it is made of: shapes and derivatives, exact orientation, local changes
// that keep a mesh valid, and the whole.
#include "tetmesh/improve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "bisector/error.h"
#include "core/geometry.h"
#include "core/orientation.h"
#include "mesh/tet_adjacency.h"
#include "mesh/tet_quality.h"
#include "support/models.h"
#include "tetmesh/insert_points.h"
#include "tetmesh/tet_edit.h"
#include "tetmesh/tet_insert.h"
#include "tetmesh/tet_shape.h"
#include "tetmesh/tet_swap.h"

namespace bisector::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Vec3 random_vector(SplitMix64& random) { return {random.range(-1, 1), random.range(-1, 1), random.range(-1, 1)}; }

std::array<Vec3, 4> corners_of(const TetMesh& mesh, std::size_t t) {
  std::array<Vec3, 4> p;
  for (std::size_t k = 0; k < 4; ++k) p[k] = mesh.vertices[mesh.tets[t][k]];
  return p;
}

void turn_positive(TetMesh& mesh) {
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = corners_of(mesh, t);
    if (orientation(a, b, c, d) < 0) std::swap(mesh.tets[t][0], mesh.tets[t][1]);
  }
}

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = corners_of(mesh, t);
    sum += dot(cross(b - a, c - a), d - a) / 6;
  }
  return sum;
}

double least_shape(const TetMesh& mesh) {
  double least = 1;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = corners_of(mesh, t);
    least = std::min(least, dihedral_shape(a, b, c, d));
  }
  return least;
}

// The facet with its least corner first, in the same turn.
Triangle turned(Triangle f) {
  std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
  return f;
}

Triangle sorted(Triangle f) {
  std::sort(f.begin(), f.end());
  return f;
}

// Facets on the boundary, counter-clockwise from outside, by the names in `source`.
std::set<Triangle> boundary_of(const TetMesh& mesh, const std::vector<Index>& source) {
  std::set<Triangle> facets;
  const auto adjacent = tet_adjacency(mesh.tets);
  for (std::size_t t = 0; t < adjacent.size(); ++t)
    for (int k = 0; k < 4; ++k)
      if (adjacent[t][k] == kNone) {
        Triangle f = facet_of(mesh.tets[t], k);
        for (Index& v : f) v = source[v];
        facets.insert(turned(f));
      }
  return facets;
}

std::vector<Index> own_names(const TetMesh& mesh) {
  std::vector<Index> names(mesh.vertices.size());
  for (Index v = 0; v < names.size(); ++v) names[v] = v;
  return names;
}

// Positive, conforming, and with opposite turns on either side of each inner facet.
void expect_valid(const TetMesh& mesh) {
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = corners_of(mesh, t);
    ASSERT_EQ(orientation(a, b, c, d), 1) << "tetrahedron " << t;
  }
  std::map<Triangle, int> sides;
  for (const Tetrahedron& tet : mesh.tets)
    for (int k = 0; k < 4; ++k) ASSERT_EQ(++sides[turned(facet_of(tet, k))], 1);
}

void expect_same_solid(const TetMesh& before, const TetImproveResult& result) {
  expect_valid(result.mesh);
  EXPECT_NEAR(volume(result.mesh), volume(before), 1e-12 * volume(before));
  EXPECT_EQ(boundary_of(before, own_names(before)), boundary_of(result.mesh, result.source));
  for (std::size_t v = 0; v < result.source.size(); ++v)
    EXPECT_TRUE(!v || result.source[v] == kNone || result.source[v - 1] < result.source[v]);
  std::set<Index> on_boundary;
  for (const Triangle& f : boundary_of(before, own_names(before))) on_boundary.insert(f.begin(), f.end());
  for (std::size_t v = 0; v < result.source.size(); ++v)
    EXPECT_TRUE(!on_boundary.count(result.source[v]) || result.mesh.vertices[v] == before.vertices[result.source[v]]);
  EXPECT_GE(least_shape(result.mesh), least_shape(before) * (1 - 1e-12));
}

// Tetrahedra from the triangles of a closed surface to `centre`, from which all of it is seen.
TetMesh coned(const TriangleMesh& surface, const Vec3& centre) {
  TetMesh mesh{surface.vertices, {}};
  const Index c = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.push_back(centre);
  for (const Triangle& f : surface.triangles) mesh.tets.push_back({c, f[0], f[1], f[2]});
  return mesh;
}

// A body-centred lattice inside, with nearest neighbours at distance h, each point shifted by up to `jitter` h.
std::vector<Vec3> lattice(double h, double jitter, double radius, const Vec3& centre = {}) {
  SplitMix64 random(5);
  std::vector<Vec3> points;
  const double a = 2 * h / std::sqrt(3.0);
  const int n = static_cast<int>(radius / a) + 2;
  for (int x = -n; x <= n; ++x)
    for (int y = -n; y <= n; ++y)
      for (int z = -n; z <= n; ++z)
        for (int half = 0; half < 2; ++half) {
          const Vec3 p = Vec3{a * (x + half / 2.0), a * (y + half / 2.0), a * (z + half / 2.0)} +
                         (jitter * h) * random_vector(random);
          if (norm(p) < radius) points.push_back(centre + p);
        }
  return points;
}

TetMesh ball(int levels, double jitter) {
  const TriangleMesh surface = icosphere(levels);
  const Vec3 edge = surface.vertices[surface.triangles[0][0]] - surface.vertices[surface.triangles[0][1]];
  const double h = norm(edge);
  std::vector<Index> vertices;
  TetMesh mesh = insert_points(coned(surface, {}), lattice(h, jitter, 1 - 0.65 * h), vertices);
  return mesh;
}

TetMesh random_ball(int levels, std::size_t count) {
  SplitMix64 random(11);
  std::vector<Vec3> points;
  while (points.size() < count)
    if (const Vec3 p = random_vector(random); norm(p) < 0.9) points.push_back(p);
  std::vector<Index> vertices;
  return insert_points(coned(icosphere(levels), {}), points, vertices);
}

// --- Orientation ---

TEST(Orientation, IsExactNextToAPlane) {
  // d is off the plane of integer points by the last bit of a coordinate, so that rounded determinants don't tell.
  const Vec3 a{1, 1, 1}, b{3000001, 7, 11}, c{13, 2000003, 17};
  const Vec3 inside = a + 0.25 * (b - a) + 0.5 * (c - a);
  EXPECT_EQ(orientation(a, b, c, inside), 0);
  for (const double sign : {-1.0, 1.0}) {
    Vec3 d = inside;
    d.z = std::nextafter(d.z, sign * 1e30);
    EXPECT_EQ(orientation(a, b, c, d), static_cast<int>(sign));
    EXPECT_EQ(orientation(b, a, c, d), -static_cast<int>(sign));
    EXPECT_EQ(orientation(d, b, c, a), -static_cast<int>(sign));
  }
}

TEST(Orientation, SurvivesUnderflow) {
  const double s = 1e-150;  // volumes of 1e-450
  EXPECT_EQ(orientation({0, 0, 0}, {s, 0, 0}, {0, s, 0}, {0, 0, s}), 1);
  EXPECT_EQ(orientation({0, 0, 0}, {s, 0, 0}, {0, s, 0}, {s, s, 0}), 0);
  EXPECT_EQ(orientation({0, 0, 0}, {0, s, 0}, {s, 0, 0}, {0, 0, s}), -1);
}

// --- Shapes ---

TEST(TetShape, KnowsRegularAndRightAngledOnes) {
  const Vec3 a{1, 1, 1}, b{-1, 1, -1}, c{1, -1, -1}, d{-1, -1, 1};
  ASSERT_EQ(orientation(a, b, c, d), 1);
  const DihedralRange range = dihedral_range(a, b, c, d);
  EXPECT_NEAR(range.min, std::acos(1.0 / 3) / kDegree, 1e-12);
  EXPECT_NEAR(range.max, std::acos(1.0 / 3) / kDegree, 1e-12);
  EXPECT_NEAR(radius_ratio(a, b, c, d), 1, 1e-14);
  EXPECT_NEAR(radius_ratio(b, a, c, d), -1, 1e-14);
  EXPECT_NEAR(dihedral_shape(a, b, c, d), std::sqrt(8.0) / 3, 1e-14);
  EXPECT_EQ(dihedral_shape(b, a, c, d), 0);

  // A cube's corner: three right angles, and acos(1/sqrt 3) at the other edges. r_in = (3 - sqrt 3) / 6, R = sqrt 3 /
  // 2.
  const DihedralRange corner = dihedral_range({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(corner.max, 90, 1e-12);
  EXPECT_NEAR(corner.min, std::acos(1 / std::sqrt(3.0)) / kDegree, 1e-12);
  EXPECT_NEAR(radius_ratio({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), std::sqrt(3.0) - 1, 1e-14);

  // Four points on a square's corners, lifted in turn: a sliver has good facets and no volume.
  const double e = 1e-6;
  const DihedralRange sliver = dihedral_range({1, 0, e}, {0, 1, -e}, {0, -1, -e}, {-1, 0, e});
  EXPECT_LT(sliver.min, 1e-3);
  EXPECT_GT(sliver.max, 179.999);
}

TEST(TetShape, DerivativesAreThoseOfFiniteDifferences) {
  SplitMix64 random(7);
  int tried = 0;
  while (tried < 100) {
    Vec3 p[4];
    for (Vec3& x : p) x = random_vector(random);
    if (orientation(p[0], p[1], p[2], p[3]) < 0) std::swap(p[1], p[2]);
    if (dihedral_shape(p[0], p[1], p[2], p[3]) < 0.1) continue;
    ++tried;
    Vec3 gradient;
    EXPECT_NEAR(radius_ratio(p[0], p[1], p[2], p[3], gradient), radius_ratio(p[0], p[1], p[2], p[3]), 1e-13);
    const DihedralSines sines = dihedral_sines(p[0], p[1], p[2], p[3]);
    EXPECT_NEAR(*std::min_element(sines.value, sines.value + 6), dihedral_shape(p[0], p[1], p[2], p[3]), 1e-13);
    const double step = 1e-6;
    for (int k = 0; k < 3; ++k) {
      Vec3 lo = p[0], hi = p[0];
      lo[k] -= step;
      hi[k] += step;
      const double ratio = (radius_ratio(hi, p[1], p[2], p[3]) - radius_ratio(lo, p[1], p[2], p[3])) / (2 * step);
      EXPECT_NEAR(gradient[k], ratio, 1e-6 * (1 + norm(gradient)));
      const DihedralSines below = dihedral_sines(lo, p[1], p[2], p[3]), above = dihedral_sines(hi, p[1], p[2], p[3]);
      for (int e = 0; e < 6; ++e) {
        const double slope = (above.value[e] - below.value[e]) / (2 * step);
        EXPECT_NEAR(sines.gradient[e][k], slope, 1e-5 * (1 + norm(sines.gradient[e])));
      }
    }
  }
}

// --- Local changes ---

// n tetrahedra around the edge from (0, 0, -height) to (0, 0, height), vertices 0 and 1.
TetMesh spindle(int n, double height, std::uint64_t seed = 0) {
  SplitMix64 random(seed);
  TetMesh mesh{{{0, 0, -height}, {0, 0, height}}, {}};
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * k / n;
    const double r = seed ? random.range(0.7, 1.3) : 1;
    mesh.vertices.push_back({r * std::cos(angle), r * std::sin(angle), seed ? random.range(-0.2, 0.2) * height : 0});
    mesh.tets.push_back({0, 1, static_cast<Index>(2 + k), static_cast<Index>(2 + (k + 1) % n)});
  }
  return mesh;
}

// The same hull without that edge.
TetMesh halved(const TetMesh& spindle) {
  TetMesh mesh{spindle.vertices, {}};
  for (Index k = 3; k + 1 < mesh.vertices.size(); ++k) {
    mesh.tets.push_back({0, 2, k, k + 1});
    mesh.tets.push_back({2, k, k + 1, 1});
  }
  return mesh;
}

// The best shape of all triangulations of ring vertices i .. j, by trying them all.
double best_triangulation(const TetMesh& mesh, Index i, Index j) {
  if (j == i + 1) return 1;
  double best = 0;
  for (Index k = i + 1; k < j; ++k) {
    const auto& p = mesh.vertices;
    best = std::max(best, std::min({best_triangulation(mesh, i, k), best_triangulation(mesh, k, j),
                                    dihedral_shape(p[0], p[i], p[k], p[j]), dihedral_shape(p[i], p[k], p[j], p[1])}));
  }
  return best;
}

TEST(TetSwap, EdgeRemovalFindsTheBestOfAllTriangulations) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const int n = 3 + static_cast<int>(seed % 6);
    const TetMesh mesh = spindle(n, 1.5, seed);
    TetEdit edit(mesh);
    ASSERT_EQ(edit.tet(0).corners, mesh.tets[0]);
    const double best = best_triangulation(mesh, 2, static_cast<Index>(n + 1));
    TetSwap swap;
    ASSERT_EQ(find_edge_removal(edit, 0, swap), best > 0);
    EXPECT_EQ(swap.shape, best);
    EXPECT_EQ(swap.fresh.size(), 2u * (static_cast<std::size_t>(n) - 2));
    const double before = volume(mesh);
    ASSERT_TRUE(edit.replace(swap.old, swap.fresh));
    std::vector<Index> slots;
    const TetMesh after = edit.mesh(slots);
    expect_valid(after);
    EXPECT_NEAR(least_shape(after), swap.shape, 1e-12);
    EXPECT_NEAR(volume(after), before, 1e-12);
    EXPECT_EQ(boundary_of(after, slots), boundary_of(mesh, own_names(mesh)));
  }
}

TEST(TetSwap, ThreeTwoCuresALongEdgeAndTwoThreeAShortOne) {
  for (const double height : {3.0, 0.25}) {
    const TetMesh three = spindle(3, height), two = halved(three);
    const bool remove = height > 1;
    const TetMesh &poor = remove ? three : two, &good = remove ? two : three;
    ASSERT_GT(least_shape(good), least_shape(poor));
    TetEdit edit(poor);
    TetSwap swap;
    swap.shape = least_shape(poor);
    ASSERT_TRUE(remove ? find_edge_removal(edit, 0, swap) : find_face_removal(edit, 0, swap));
    EXPECT_NEAR(swap.shape, least_shape(good), 1e-12);
    EXPECT_EQ(swap.fresh.size(), good.tets.size());
    EXPECT_TRUE(edit.replace(swap.old, swap.fresh));
    // And from the good one there is no way back.
    TetEdit done(good);
    swap = {};
    swap.shape = least_shape(good);
    EXPECT_FALSE(find_edge_removal(done, 0, swap) || find_face_removal(done, 0, swap));
  }
}

TEST(TetSwap, FaceRemovalUndoesEdgeRemoval) {
  for (const int n : {4, 5, 6}) {
    const TetMesh good = spindle(n, 0.5), poor = halved(good);
    ASSERT_GT(least_shape(good), least_shape(poor));
    bool found = false;
    for (Index t = 0; t < poor.tets.size() && !found; ++t) {
      TetEdit edit(poor);
      TetSwap swap;
      swap.shape = least_shape(poor);
      if (!find_face_removal(edit, t, swap) || swap.fresh.size() != good.tets.size()) continue;
      found = edit.replace(swap.old, swap.fresh);
      EXPECT_NEAR(swap.shape, least_shape(good), 1e-12);
    }
    EXPECT_TRUE(found) << n;
  }
}

TEST(TetSwap, ContractionDrawsAVertexIntoItsNeighbour) {
  // Two inner vertices next to each other make slivers that only the loss of one of them cures.
  TetMesh mesh = coned(icosphere(1), {});
  std::vector<Index> vertices;
  mesh = insert_points(mesh, {{0.01, 0.004, 0.003}}, vertices);
  ASSERT_NE(vertices[0], kNone);
  const double before = least_shape(mesh);
  TetEdit edit(mesh);
  bool contracted = false;
  for (Index t = 0; t < mesh.tets.size() && !contracted; ++t) {
    TetSwap swap;
    swap.shape = before;
    contracted = find_contraction(edit, t, swap) && edit.replace(swap.old, swap.fresh);
  }
  ASSERT_TRUE(contracted);
  std::vector<Index> slots;
  const TetMesh after = edit.mesh(slots);
  expect_valid(after);
  EXPECT_EQ(after.vertices.size(), mesh.vertices.size() - 1);
  EXPECT_GT(least_shape(after), 5 * before);
  EXPECT_NEAR(volume(after), volume(mesh), 1e-12);
}

TEST(TetInsert, CavitiesAreFilledByTheirPoint) {
  const TetMesh mesh = random_ball(2, 60);
  TetEdit edit(mesh);
  std::size_t found = 0;
  for (Index t = 0; t < mesh.tets.size(); t += 7) {
    for (const TetInsertion& insertion : find_insertions(edit, t)) {
      ++found;
      edit.begin();
      const Index v = edit.add_point(insertion.point);
      std::vector<Tetrahedron> fresh;
      for (const Triangle& f : insertion.facets) fresh.push_back({v, f[0], f[1], f[2]});
      ASSERT_TRUE(edit.replace(insertion.old, fresh));
      double least = 1;
      for (const Index s : edit.added()) least = std::min(least, edit.tet(s).shape);
      EXPECT_EQ(least, insertion.shape);
      edit.undo();
    }
  }
  EXPECT_GT(found, 50u);
}

using Content = std::map<Index, std::tuple<Tetrahedron, std::array<Index, 4>, double, int>>;
Content content(const TetEdit& edit) {
  Content tets;
  for (Index t = 0; t < edit.size(); ++t)
    if (const TetEdit::Tet& tet = edit.tet(t); tet.alive) tets[t] = {tet.corners, tet.across, tet.shape, tet.kept};
  return tets;
}

void expect_consistent(TetEdit& edit) {
  std::vector<std::set<Index>> at(edit.points());
  for (Index t = 0; t < edit.size(); ++t) {
    const TetEdit::Tet& tet = edit.tet(t);
    if (!tet.alive) continue;
    for (int k = 0; k < 4; ++k) {
      at[tet.corners[k]].insert(t);
      if (tet.across[k] == kNone) {
        EXPECT_TRUE(edit.kept(t, k));
        continue;
      }
      const TetEdit::Tet& other = edit.tet(tet.across[k]);
      ASSERT_TRUE(other.alive);
      const int back = static_cast<int>(std::find(other.across.begin(), other.across.end(), t) - other.across.begin());
      ASSERT_LT(back, 4);
      EXPECT_EQ(sorted(facet_of(tet.corners, k)), sorted(facet_of(other.corners, back)));
      EXPECT_EQ(edit.kept(t, k), edit.kept(tet.across[k], back));
    }
  }
  for (Index v = 0; v < edit.points(); ++v) {
    const std::vector<Index>& star = edit.star(v);
    EXPECT_EQ(std::set<Index>(star.begin(), star.end()), at[v]);
  }
}

TEST(TetEdit, UndoBringsBackWhatWas) {
  const TetMesh mesh = random_ball(2, 100);
  TetEdit edit(mesh);
  SplitMix64 random(3);
  std::size_t changes = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const auto before = content(edit);
    std::vector<Vec3> points;
    for (Index v = 0; v < edit.points(); ++v) points.push_back(edit.point(v));
    edit.begin();
    for (int k = 0; k < 12; ++k) {
      const Index t = static_cast<Index>(random.below(edit.size()));
      if (!edit.tet(t).alive) continue;
      TetSwap swap;
      const std::size_t kind = random.below(4);
      if (kind == 3) {
        const Index v = edit.tet(t).corners[random.below(4)];
        if (!edit.held(v)) changes += edit.move(v, edit.point(v) + 0.05 * random_vector(random));
      } else if (kind == 0   ? find_edge_removal(edit, t, swap)
                 : kind == 1 ? find_face_removal(edit, t, swap)
                             : find_contraction(edit, t, swap)) {
        changes += edit.replace(swap.old, swap.fresh);
      }
    }
    expect_consistent(edit);
    if (trial % 3 == 0) {
      edit.keep();
    } else {
      edit.undo();
      expect_consistent(edit);
      EXPECT_TRUE(content(edit) == before);
      ASSERT_EQ(edit.points(), points.size());
      for (Index v = 0; v < points.size(); ++v) EXPECT_EQ(edit.point(v), points[v]);
    }
  }
  EXPECT_GT(changes, 100u);
}

TEST(TetEdit, RefusesWhatIsNoTiling) {
  const TetMesh three = spindle(3, 1), two = halved(three);
  const std::vector<Index> all{0, 1, 2};
  const auto refused = [&](std::vector<Tetrahedron> fresh, const TetMesh& mesh, const std::vector<Index>& old) {
    TetEdit edit(mesh);
    const auto before = content(edit);
    const bool replaced = edit.replace(old, fresh);
    EXPECT_TRUE(replaced || content(edit) == before);
    return !replaced;
  };
  EXPECT_FALSE(refused(two.tets, three, all));
  EXPECT_TRUE(refused({two.tets[0]}, three, all));               // a part
  EXPECT_TRUE(refused(two.tets, three, {0, 1}));                 // of something else
  EXPECT_TRUE(refused({two.tets[0], two.tets[0]}, three, all));  // the same twice
  std::vector<Tetrahedron> inverted = two.tets;
  std::swap(inverted[0][0], inverted[0][1]);
  EXPECT_TRUE(refused(inverted, three, all));

  TetMesh divided = three;
  divided.regions = {1, 1, 2};
  EXPECT_TRUE(refused(two.tets, divided, all));
  TetMesh marked = three;
  marked.boundary = {{0, 2, 1}};  // between the first and the last
  EXPECT_TRUE(refused(two.tets, marked, all));
  TetMesh feature = three;
  feature.feature_edges = {{1, 0}};
  EXPECT_TRUE(refused(two.tets, feature, all));
}

TEST(TetEdit, KnowsVerticesWhereTheBoundaryIsNoDisk) {
  // Two tetrahedra that share a vertex, and a third that shares a facet with the first.
  TetMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {1, 1, 1}},
               {{0, 1, 2, 3}, {0, 5, 4, 6}, {1, 3, 2, 7}}};
  turn_positive(mesh);
  TetEdit edit(mesh);
  EXPECT_FALSE(edit.on_boundary(0));
  for (const Index v : {1, 2, 3, 4, 5, 6, 7}) EXPECT_TRUE(edit.on_boundary(v)) << v;
  for (Index v = 0; v < 8; ++v) EXPECT_TRUE(edit.held(v));
}

// --- Points put into a mesh ---

TEST(InsertPoints, KeepsTheBoundaryAndTheOrder) {
  const TetMesh before = coned(box(4), {0.5, 0.5, 0.5});
  std::vector<Vec3> points{{2, 0.5, 0.5},   {0.3, 0.4, 0.6}, {0.5, 0.5, 0.5},
                           {0.3, 0.4, 0.6}, {0.3, 0.6, 0},   {0.5, 0, 0.5}};
  std::vector<Index> vertices;
  TetMesh after = insert_points(before, points, vertices);
  const Index first = static_cast<Index>(before.vertices.size());
  // Outside; the vertex that is there; one of the two at the same place; on a facet and an edge of the boundary.
  EXPECT_EQ(vertices[0], kNone);
  EXPECT_EQ(vertices[2], kNone);
  EXPECT_EQ(vertices[4], kNone);
  EXPECT_EQ(vertices[5], kNone);
  EXPECT_EQ(std::min(vertices[1], vertices[3]), first);
  EXPECT_EQ(std::max(vertices[1], vertices[3]), kNone);

  // A grid: points in facets and edges of the cone, and many on a sphere.
  points.clear();
  for (int x = 1; x < 8; ++x)
    for (int y = 1; y < 8; ++y)
      for (int z = 1; z < 8; ++z) points.push_back({x / 8.0, y / 8.0, z / 8.0});
  after = insert_points(before, points, vertices);
  expect_valid(after);
  EXPECT_NEAR(volume(after), 1, 1e-12);
  EXPECT_EQ(boundary_of(after, own_names(after)), boundary_of(before, own_names(before)));
  Index next = first;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i] == Vec3{0.5, 0.5, 0.5}) {
      EXPECT_EQ(vertices[i], kNone);
      continue;
    }
    ASSERT_EQ(vertices[i], next++);
    EXPECT_EQ(after.vertices[vertices[i]], points[i]);
  }
  for (Index v = 0; v < first; ++v) EXPECT_EQ(after.vertices[v], before.vertices[v]);
}

TEST(InsertPoints, AreDelaunayWhereTheBoundaryAllows) {
  // Around an inner point that is far from the boundary compared with its neighbours.
  SplitMix64 random(2);
  std::vector<Vec3> points;
  for (int k = 0; k < 300; ++k) points.push_back(0.5 * random_vector(random));
  std::vector<Index> vertices;
  const TetMesh mesh = insert_points(coned(icosphere(2), {0.01, 0.02, 0.03}), points, vertices);
  expect_valid(mesh);
  std::size_t inner = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = corners_of(mesh, t);
    const Vec3 u = b - a, v = c - a, w = d - a;
    const Vec3 centre =
        a + (0.5 / dot(u, cross(v, w))) * (norm2(u) * cross(v, w) + norm2(v) * cross(w, u) + norm2(w) * cross(u, v));
    const double radius = norm(centre - a);
    if (norm(centre) + radius > 0.85) continue;
    ++inner;
    for (const Vec3& p : mesh.vertices) EXPECT_GE(norm(p - centre), radius * (1 - 1e-9));
  }
  EXPECT_GT(inner, 300u);
}

TEST(InsertPoints, RefusesNumbersThatAreNone) {
  std::vector<Index> vertices;
  EXPECT_THROW(insert_points(coned(icosphere(0), {}), {{0, std::nan(""), 0}}, vertices), Error);
}

// --- Improvement ---

TEST(ImproveTets, ReachesItsGoalInABall) {
  const TetMesh mesh = ball(3, 0.1);
  const TetImproveResult result = improve_tets(mesh);
  expect_same_solid(mesh, result);
  EXPECT_LT(result.report.before.dihedral_min, 5);  // or there is nothing to show
  EXPECT_GE(result.report.after.dihedral_min, 30);
  EXPECT_GE(result.report.after.radius_ratio_mean, 0.88);
  EXPECT_LE(result.report.after.dihedral_max, 150);
}

TEST(ImproveTets, HelpsRandomPointsToo) {
  const TetMesh mesh = random_ball(3, 300);
  const TetImproveResult result = improve_tets(mesh);
  expect_same_solid(mesh, result);
  EXPECT_GE(result.report.after.dihedral_min, 14);
  EXPECT_GT(result.report.after.radius_ratio_mean, result.report.before.radius_ratio_mean + 0.1);
}

TEST(ImproveTets, KeepsTheEdgesOfABox) {
  std::vector<Index> vertices;
  const TetMesh mesh = insert_points(coned(box(4), {0.5, 0.5, 0.5}),
                                     {{0.3, 0.3, 0.3},
                                      {0.7, 0.3, 0.3},
                                      {0.3, 0.7, 0.3},
                                      {0.3, 0.3, 0.7},
                                      {0.7, 0.7, 0.3},
                                      {0.7, 0.3, 0.7},
                                      {0.3, 0.7, 0.7},
                                      {0.7, 0.7, 0.7}},
                                     vertices);
  const TetImproveResult result = improve_tets(mesh);
  expect_same_solid(mesh, result);
  EXPECT_GE(result.report.after.dihedral_min, 20);
}

TEST(ImproveTets, LeavesWhatTheBoundaryFixes) {
  // One flat tetrahedron alone.
  const TetMesh flat{{{1, 0, 1e-3}, {0, 1, -1e-3}, {-1, 0, 1e-3}, {0, -1, -1e-3}}, {{0, 2, 1, 3}}};
  TetMesh one = flat;
  turn_positive(one);
  TetImproveResult result = improve_tets(one);
  EXPECT_EQ(result.mesh.tets, one.tets);
  EXPECT_EQ(result.mesh.vertices, one.vertices);
  expect_same_solid(one, result);
}

TEST(ImproveTets, SwapsAwaySliversUnderFlatEdgesOfTheBoundary) {
  // Two facets of the boundary in one plane but for a little, a sliver below them, and its inner edge in two more
  // tetrahedra.
  TetMesh mesh{{{1, 0, 0}, {0, 1, 0.02}, {-1, 0, 0}, {0, -1, 0.02}, {0, 0, -1}},
               {{0, 2, 1, 3}, {0, 2, 3, 4}, {2, 0, 1, 4}}};
  turn_positive(mesh);
  const TetImproveResult result = improve_tets(mesh);
  expect_same_solid(mesh, result);
  EXPECT_LT(result.report.before.dihedral_min, 5);
  EXPECT_GT(result.report.after.dihedral_min, 45);
  EXPECT_EQ(result.mesh.vertices, mesh.vertices);
}

TEST(ImproveTets, AddsVerticesWhereNothingElseHelps) {
  // All vertices on the boundary: from one of them the others are seen under small angles.
  TetMesh mesh{icosphere(2).vertices, {}};
  for (const Triangle& f : icosphere(2).triangles)
    if (f[0] && f[1] && f[2]) mesh.tets.push_back({0, f[0], f[1], f[2]});
  TetImproveOptions options;
  options.insertions = 0;
  const TetImproveResult without = improve_tets(mesh, options);
  options.insertions = 1;
  const TetImproveResult with = improve_tets(mesh, options);
  expect_same_solid(mesh, without);
  expect_same_solid(mesh, with);
  EXPECT_EQ(without.mesh.vertices.size(), mesh.vertices.size());
  EXPECT_GT(with.report.insertions, 0u);
  EXPECT_LE(with.report.insertions, mesh.vertices.size());
  EXPECT_GT(with.report.after.dihedral_min, 2 * without.report.after.dihedral_min);
}

TEST(ImproveTets, KeepsRegionsMarksAndFeatures) {
  TetMesh mesh = random_ball(2, 120);
  // Regions by the side of each tetrahedron's centre: a ragged interface. One more inner facet and inner edge are
  // marked.
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const auto [a, b, c, d] = corners_of(mesh, t);
    mesh.regions.push_back((a + b + c + d).x > 0 ? 7 : -2);
  }
  const auto adjacent = tet_adjacency(mesh.tets);
  std::size_t chosen = mesh.tets.size();
  for (std::size_t t = 0; t < mesh.tets.size() && chosen == mesh.tets.size(); ++t)
    if (adjacent[t][0] != kNone && mesh.regions[adjacent[t][0]] == mesh.regions[t]) chosen = t;
  ASSERT_LT(chosen, mesh.tets.size());
  mesh.boundary = {facet_of(mesh.tets[chosen], 0)};
  mesh.boundary_labels = {42};
  mesh.feature_edges = {{mesh.tets[chosen / 2][0], mesh.tets[chosen / 2][1]}};
  const auto interface_of = [](const TetMesh& m, const std::vector<Index>& names) {
    std::set<std::pair<Triangle, std::int32_t>> facets;
    const auto across = tet_adjacency(m.tets);
    for (std::size_t t = 0; t < across.size(); ++t)
      for (int k = 0; k < 4; ++k)
        if (across[t][k] != kNone && m.regions[across[t][k]] != m.regions[t]) {
          Triangle f = facet_of(m.tets[t], k);
          for (Index& v : f) v = names[v];
          facets.insert({turned(f), m.regions[t]});
        }
    return facets;
  };
  const auto volume_of = [](const TetMesh& m, std::int32_t region) {
    TetMesh part{m.vertices, {}};
    for (std::size_t t = 0; t < m.tets.size(); ++t)
      if (m.regions[t] == region) part.tets.push_back(m.tets[t]);
    return volume(part);
  };

  const TetImproveResult result = improve_tets(mesh);
  expect_same_solid(mesh, result);
  EXPECT_GT(result.report.after.radius_ratio_mean, result.report.before.radius_ratio_mean);
  ASSERT_FALSE(interface_of(mesh, own_names(mesh)).empty());
  EXPECT_EQ(interface_of(mesh, own_names(mesh)), interface_of(result.mesh, result.source));
  for (const std::int32_t region : {7, -2}) EXPECT_NEAR(volume_of(result.mesh, region), volume_of(mesh, region), 1e-12);

  ASSERT_EQ(result.mesh.boundary.size(), 1u);
  EXPECT_EQ(result.mesh.boundary_labels, mesh.boundary_labels);
  std::size_t found = 0;
  for (const Tetrahedron& t : result.mesh.tets)
    for (int k = 0; k < 4; ++k) found += sorted(facet_of(t, k)) == sorted(result.mesh.boundary[0]);
  EXPECT_EQ(found, 2u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(result.source[result.mesh.boundary[0][k]], mesh.boundary[0][k]);
    EXPECT_EQ(result.mesh.vertices[result.mesh.boundary[0][k]], mesh.vertices[mesh.boundary[0][k]]);
  }
  const auto [p, q] = result.mesh.feature_edges.at(0);
  EXPECT_TRUE(std::any_of(result.mesh.tets.begin(), result.mesh.tets.end(), [&](const Tetrahedron& t) {
    return std::count(t.begin(), t.end(), p) && std::count(t.begin(), t.end(), q);
  }));
  EXPECT_EQ(result.source[p], mesh.feature_edges[0][0]);
  EXPECT_EQ(result.source[q], mesh.feature_edges[0][1]);
}

TEST(ImproveTets, SlidesVerticesOnTheirSurfaceOnly) {
  const TetMesh mesh = random_ball(2, 100);
  const std::set<Triangle> boundary = boundary_of(mesh, own_names(mesh));
  std::set<Index> on_sphere;
  for (const Triangle& f : boundary) on_sphere.insert(f.begin(), f.end());
  TetImproveOptions options;
  options.goal = 45;
  options.slide.min_angle = 40;
  options.slide.max_turn = 5;
  const Index still = *on_sphere.begin();
  options.slide.project = [&](Index v, const Vec3& wanted) {
    EXPECT_TRUE(on_sphere.count(v));
    return v == still ? mesh.vertices[v] : (1 / norm(wanted)) * wanted;
  };
  const TetImproveResult result = improve_tets(mesh, options);
  expect_valid(result.mesh);
  EXPECT_EQ(boundary_of(result.mesh, result.source), boundary);
  EXPECT_GE(least_shape(result.mesh), least_shape(mesh) * (1 - 1e-12));
  std::size_t moved = 0;
  std::vector<Index> place(mesh.vertices.size(), kNone);
  for (Index v = 0; v < result.source.size(); ++v)
    if (result.source[v] != kNone) place[result.source[v]] = v;
  for (const Index v : on_sphere) {
    ASSERT_NE(place[v], kNone);
    EXPECT_NEAR(norm(result.mesh.vertices[place[v]]), 1, 1e-14);
    moved += !(result.mesh.vertices[place[v]] == mesh.vertices[v]);
  }
  EXPECT_GT(moved, 0u);
  EXPECT_EQ(result.mesh.vertices[place[still]], mesh.vertices[still]);
  for (const Triangle& f : boundary) {
    Vec3 p[3], q[3];
    for (int k = 0; k < 3; ++k) {
      p[k] = mesh.vertices[f[k]];
      q[k] = result.mesh.vertices[place[f[k]]];
    }
    const auto angle = [](const Vec3* x) {
      double least = 180;
      for (int k = 0; k < 3; ++k) {
        const Vec3 u = x[(k + 1) % 3] - x[k], v = x[(k + 2) % 3] - x[k];
        least = std::min(least, std::atan2(norm(cross(u, v)), dot(u, v)) / kDegree);
      }
      return least;
    };
    EXPECT_GE(angle(q), std::min(40.0, angle(p)) - 1e-9);
    const Vec3 m = cross(p[1] - p[0], p[2] - p[0]), n = cross(q[1] - q[0], q[2] - q[0]);
    EXPECT_LE(std::atan2(norm(cross(m, n)), dot(m, n)) / kDegree, 5 + 1e-9);
  }
}

TEST(ImproveTets, RepeatsItself) {
  const TetMesh mesh = random_ball(2, 200);
  const TetImproveResult a = improve_tets(mesh), b = improve_tets(mesh);
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.tets, b.mesh.tets);
  EXPECT_EQ(a.source, b.source);
}

TEST(ImproveTets, DoesNotDependOnScale) {
  const TetMesh mesh = random_ball(2, 100);
  const TetImproveResult plain = improve_tets(mesh);
  for (const double scale : {0x1p-60, 0x1p60}) {
    TetMesh scaled = mesh;
    for (Vec3& v : scaled.vertices) v *= scale;
    const TetImproveResult result = improve_tets(scaled);
    EXPECT_EQ(result.mesh.tets, plain.mesh.tets);
    for (std::size_t v = 0; v < plain.mesh.vertices.size(); ++v)
      EXPECT_EQ(result.mesh.vertices[v], scale * plain.mesh.vertices[v]);
  }
}

TEST(ImproveTets, StopsWhenAsked) {
  const TetMesh mesh = random_ball(2, 100);
  std::atomic<bool> cancel = false;
  Context context;
  context.cancel = &cancel;
  int reports = 0;
  double fraction = 0;
  context.progress = [&](const Progress& p) {
    EXPECT_GE(p.fraction, fraction);
    EXPECT_LE(p.fraction, 1);
    fraction = p.fraction;
    cancel = ++reports == 3;
  };
  EXPECT_THROW(improve_tets(mesh, {}, context), Cancelled);
  EXPECT_EQ(reports, 3);
}

TEST(ImproveTets, RefusesBadInput) {
  const TetMesh good = spindle(4, 1);
  EXPECT_NO_THROW(improve_tets(good));
  EXPECT_NO_THROW(improve_tets(TetMesh{}));
  const auto message = [](const TetMesh& mesh, TetImproveOptions options = {}) -> std::string {
    try {
      improve_tets(mesh, options);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  TetMesh mesh = good;
  std::swap(mesh.tets[2][0], mesh.tets[2][1]);
  EXPECT_NE(message(mesh).find("tetrahedron 2"), std::string::npos);
  mesh = good;
  mesh.tets[3][1] = 99;
  EXPECT_NE(message(mesh).find("vertex 99"), std::string::npos);
  mesh = good;
  mesh.vertices[1].y = std::numeric_limits<double>::infinity();
  EXPECT_NE(message(mesh).find("vertex 1"), std::string::npos);
  mesh = good;
  mesh.regions = {1, 2};
  EXPECT_NE(message(mesh).find("2 regions"), std::string::npos);
  mesh = good;
  mesh.boundary = {{0, 1, 77}};
  EXPECT_NE(message(mesh).find("marked triangle 0"), std::string::npos);
  mesh = good;
  mesh.feature_edges = {{0, 77}};
  EXPECT_NE(message(mesh).find("feature edge 0"), std::string::npos);
  mesh = good;
  mesh.tets.push_back(mesh.tets[0]);
  EXPECT_NE(message(mesh).find("more than two"), std::string::npos);
  TetImproveOptions options;
  for (const double goal : {0.0, 61.0, std::nan("")}) {
    options.goal = goal;
    EXPECT_NE(message(good, options).find("goal"), std::string::npos);
  }
  options = {};
  options.insertions = -1;
  EXPECT_NE(message(good, options).find("new vertices"), std::string::npos);
}

}  // namespace
}  // namespace bisector::test
