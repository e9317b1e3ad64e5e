// Mending of bad angles and broken curves in the mesh: what must be gone afterwards, and what must stay.
#include "remesh/mend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "backend/cpu_backend.h"
#include "bisector/quality.h"
#include "core/random.h"
#include "cvt/run.h"
#include "mesh/topology.h"
#include "remesh/feature_recovery.h"
#include "remesh/topology_control.h"
#include "support/models.h"
#include "support/optimised.h"
#include "voronoi/dual.h"

namespace bisector::test {
namespace {

using Kind = SeedPlace::Kind;

std::array<Index, 2> edge_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

// A good mesh of a surface, to be spoilt.
struct Remeshed {
  Remeshed(const TriangleMesh& input, std::size_t count, int iterations, const FeatureGraph& graph = {})
      : surface(input), backend(surface, NeighbourSource::nearest), curves(graph, surface.mesh.vertices),
        trace(surface, curves), run(backend, curves, context) {
    place_and_optimise(run, trace, count, iterations);
    const Diagram& diagram = run.diagram(run.traced() | Want::dual);
    mesh = dual_mesh(run.seeds.positions(), diagram.dual);
    places = run.seeds.places();
    if (curves.size() > 0) mesh.feature_edges = check_features(trace, curves, places, diagram).edges;
    EXPECT_EQ(mesh.vertices.size(), run.seeds.size());
    if (!input.labels.empty())
      for (const Index t : diagram.dual.mesh_triangle) mesh.labels.push_back(input.labels[t]);
    topology = analyse_topology(mesh.triangles, mesh.vertices.size());
  }

  // Moves vertices of the surface most of the way to one of their neighbours.
  void dent(std::size_t count) {
    SplitMix64 random(7);
    const Csr<Index> neighbours = vertex_neighbours(mesh.triangles, mesh.vertices.size());
    for (std::size_t k = 0; k < count; ++k) {
      Index v;
      do v = static_cast<Index>(random.below(mesh.vertices.size()));
      while (places[v].kind != Kind::surface);
      const Vec3 &from = mesh.vertices[v], to = mesh.vertices[*neighbours.begin(v)];
      mesh.vertices[v] = nearest_of_all(surface, from + 0.75 * (to - from));
    }
  }

  // `broken`: curves; afterwards those that still are.
  MendReport mend(std::vector<Index>& broken) {
    const Diagram& diagram = run.diagram(run.traced() | Want::dual);
    const Csr<Index> rings = vertex_neighbours(diagram.dual.triangles, run.seeds.size());
    const CellMap map(surface, run.seeds.positions(), diagram.moments.triangles, rings);
    std::vector<Index> owners(mesh.vertices.size());
    for (Index v = 0; v < owners.size(); ++v) owners[v] = v;
    MendMesh result{mesh, places, owners, broken};
    if (count_self_intersections(mesh) > 0) result.may_cross = 0;
    const MendReport report = mend_angles(map, curves, trace, {40, 91, run.seeds.size()}, result, context);
    number = result.number;
    return report;
  }
  MendReport mend() {
    std::vector<Index> none;
    return mend(none);
  }

  // The topology is that of the dual, and vertices are where they may be.
  void expect_sound() const {
    ASSERT_EQ(places.size(), mesh.vertices.size());
    EXPECT_TRUE(same_topology(analyse_topology(mesh.triangles, mesh.vertices.size()), topology));
    EXPECT_EQ(count_self_intersections(mesh), 0u);
    const double wanted = static_cast<double>(run.seeds.size()), count = static_cast<double>(mesh.vertices.size());
    EXPECT_LE(std::abs(count - wanted), wanted / 200);
    for (std::size_t v = 0; v < places.size(); ++v) {
      const SeedPlace& place = places[v];
      EXPECT_LE(norm(nearest_of_all(surface, mesh.vertices[v]) - mesh.vertices[v]), 1e-12);
      if (place.corner != kNone) {
        EXPECT_EQ(mesh.vertices[v], curves.corner(place.corner));
      } else if (place.kind == Kind::curve) {
        EXPECT_EQ(mesh.vertices[v], curves.point(place.curve, place.position));
      }
    }
    // Edges of the mesh, and as many as make one chain of each curve.
    std::set<std::array<Index, 2>> edges;
    for (const Triangle& t : mesh.triangles)
      for (int m = 0; m < 3; ++m) edges.insert(edge_of(t[m], t[(m + 1) % 3]));
    std::size_t inner = 0;
    for (const SeedPlace& place : places) inner += place.curve != kNone;
    EXPECT_EQ(mesh.feature_edges.size(), inner + curves.size());
    for (const auto& edge : mesh.feature_edges) EXPECT_TRUE(edges.count(edge));
  }

  Surface surface;
  CpuBackend backend;
  FeatureCurves curves;
  FeatureTrace trace;
  Context context;
  CvtRun run;
  TriangleMesh mesh;
  std::vector<SeedPlace> places;
  MeshTopology topology;
  std::vector<Index> number;
};

double smallest_free_angle(const TriangleMesh& mesh) { return measure_quality(mesh).theta_min_free; }

TEST(Mend, LeavesGoodMeshesAlone) {
  Remeshed good(icosphere(4), 500, 60);
  const TriangleMesh before = good.mesh;
  ASSERT_GT(smallest_free_angle(before), 30);
  const MendReport report = good.mend();
  EXPECT_EQ(report.bad, 0u);
  EXPECT_EQ(report.made, 0u);
  EXPECT_EQ(good.mesh.triangles, before.triangles);
  EXPECT_EQ(good.mesh.vertices, before.vertices);
  EXPECT_TRUE(good.number.empty());
}

// Vertices of the outer one of two spheres that went through the inner one.
TEST(Mend, TakesTrianglesThatDoNotCross) {
  TriangleMesh inner = icosphere(4);
  for (Vec3& p : inner.vertices) p = 0.9 * p;
  Remeshed crossing(joined(icosphere(4), inner), 1600, 60);
  ASSERT_GT(smallest_free_angle(crossing.mesh), 30);
  ASSERT_EQ(count_self_intersections(crossing.mesh), 0u);
  int pushed = 0;
  for (std::size_t v = 0; v < crossing.mesh.vertices.size() && pushed < 3; v += 7)
    if (Vec3& p = crossing.mesh.vertices[v]; norm(p) > 0.95) {
      p = 0.89 * p;
      ++pushed;
    }
  ASSERT_GT(count_self_intersections(crossing.mesh), 0u);
  const MendReport report = crossing.mend();
  EXPECT_GT(report.made, 0u);
  EXPECT_GE(smallest_free_angle(crossing.mesh), 30);
  EXPECT_EQ(count_self_intersections(crossing.mesh), 0u);
}

TEST(Mend, MakesBadAnglesGood) {
  for (const TriangleMesh& surface : {icosphere(4), torus(60, 40)}) {
    Remeshed spoilt(surface, 1200, 40);
    spoilt.dent(8);
    const TriangleMesh before = spoilt.mesh;
    ASSERT_LT(smallest_free_angle(before), 25);
    const MendReport report = spoilt.mend();
    EXPECT_GT(report.bad, 0u);
    EXPECT_GT(report.made, 0u);
    EXPECT_GE(smallest_free_angle(spoilt.mesh), 30);
    EXPECT_EQ(spoilt.mesh.vertices.size(), before.vertices.size() + report.inserted - report.removed);
    spoilt.expect_sound();
    // What is far from a dent stays as it is.
    ASSERT_EQ(spoilt.number.size(), before.vertices.size());
    std::size_t same = 0, gone = 0;
    for (std::size_t v = 0; v < before.vertices.size(); ++v) {
      gone += spoilt.number[v] == kNone;
      same += spoilt.number[v] != kNone && spoilt.mesh.vertices[spoilt.number[v]] == before.vertices[v];
    }
    EXPECT_EQ(gone, report.removed);
    EXPECT_GT(same, before.vertices.size() / 2);
  }
}

TEST(Mend, MakesTheBestOfWhatIsBadAllOver) {
  Remeshed random(icosphere(4), 600, 0);
  const double below = measure_quality(random.mesh).theta_below_30_free;
  const MendReport report = random.mend();
  EXPECT_GT(report.bad, random.mesh.triangles.size() / 20);
  EXPECT_LT(measure_quality(random.mesh).theta_below_30_free, 0.25 * below);
  random.expect_sound();
}

// A cube with a label for each side.
TriangleMesh labelled_cube() {
  TriangleMesh cube = box(8);
  for (const Triangle& t : cube.triangles) {
    const Vec3 n = cross(cube.vertices[t[1]] - cube.vertices[t[0]], cube.vertices[t[2]] - cube.vertices[t[0]]);
    for (int k = 0; k < 3; ++k)
      if (std::abs(n[k]) > 0.5 * norm(n)) cube.labels.push_back(2 * k + (n[k] > 0));
  }
  EXPECT_EQ(cube.labels.size(), cube.triangles.size());
  return cube;
}

TEST(Mend, KeepsCurvesAndLabels) {
  const TriangleMesh cube = labelled_cube();
  Remeshed spoilt(cube, 1500, 40, detect_features(cube));
  ASSERT_EQ(spoilt.curves.size(), 12u);
  spoilt.expect_sound();
  spoilt.dent(10);
  ASSERT_LT(smallest_free_angle(spoilt.mesh), 25);
  EXPECT_GT(spoilt.mend().made, 0u);
  EXPECT_GE(smallest_free_angle(spoilt.mesh), 30);
  spoilt.expect_sound();
  ASSERT_EQ(spoilt.mesh.labels.size(), spoilt.mesh.triangles.size());
  for (std::size_t k = 0; k < spoilt.mesh.triangles.size(); ++k) {
    const Triangle& t = spoilt.mesh.triangles[k];
    const std::vector<Vec3>& x = spoilt.mesh.vertices;
    const Vec3 n = cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]);
    const int axis = spoilt.mesh.labels[k] / 2;
    EXPECT_GT(spoilt.mesh.labels[k] % 2 ? n[axis] : -n[axis], 0.99 * norm(n));
  }
}

TEST(Mend, RecoversBrokenCurves) {
  const TriangleMesh cube = labelled_cube();
  Remeshed spoilt(cube, 700, 40, detect_features(cube));
  // Edges of three curves are flipped, as they are where other cells are nearer to the curve.
  const std::vector<std::array<Index, 2>> edges = spoilt.mesh.feature_edges;
  std::vector<Index> broken;
  for (std::size_t k = 0; k < edges.size() && broken.size() < 3; k += 20) {
    const auto [a, b] = edges[k];
    const Index curve = spoilt.places[a].curve != kNone ? spoilt.places[a].curve : spoilt.places[b].curve;
    if (curve == kNone || std::find(broken.begin(), broken.end(), curve) != broken.end()) continue;
    std::vector<std::size_t> at;
    std::vector<Index> apex;
    std::vector<Triangle>& triangles = spoilt.mesh.triangles;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const Triangle& v = triangles[t];
      if (std::count(v.begin(), v.end(), a) + std::count(v.begin(), v.end(), b) < 2) continue;
      const int m = v[0] == a ? 0 : v[1] == a ? 1 : 2;
      const bool forward = v[(m + 1) % 3] == b;  // a, b, apex
      at.insert(forward ? at.begin() : at.end(), t);
      apex.insert(forward ? apex.begin() : apex.end(), v[forward ? (m + 2) % 3 : (m + 1) % 3]);
    }
    ASSERT_EQ(at.size(), 2u);
    triangles[at[0]] = {a, apex[1], apex[0]};
    triangles[at[1]] = {apex[1], b, apex[0]};
    std::erase(spoilt.mesh.feature_edges, edges[k]);
    broken.push_back(curve);
  }
  ASSERT_EQ(broken.size(), 3u);
  std::sort(broken.begin(), broken.end());
  const MendReport report = spoilt.mend(broken);
  EXPECT_TRUE(broken.empty());
  EXPECT_GE(report.made, 3u);
  EXPECT_GE(smallest_free_angle(spoilt.mesh), 30);
  spoilt.expect_sound();
}

}  // namespace
}  // namespace bisector::test
