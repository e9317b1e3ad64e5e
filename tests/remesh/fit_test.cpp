// Fitting a mesh to the surface that it was made from: known optima, and what must never get worse.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/sampling.h"
#include "remesh/fit.h"
#include "spatial/nearest.h"
#include "support/models.h"

namespace bisector::test {
namespace {

TriangleMesh scaled(TriangleMesh mesh, double by) {
  for (Vec3& v : mesh.vertices) v *= by;
  return mesh;
}

TriangleMesh moved(TriangleMesh mesh, const Vec3& by) {
  for (Vec3& v : mesh.vertices) v += by;
  return mesh;
}

TriangleMesh reversed(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

// The worst triangles of a generated mesh are many, so that its own smallest angle as the bound would stop all of it.
FitOptions with_bounds(double angle, double quality) {
  FitOptions options;
  options.min_angle = angle;
  options.min_quality = quality;
  return options;
}

TriangleMesh tetrahedron() {  // inscribed in the unit sphere
  const double c = 1 / std::numbers::sqrt3;
  return {{{c, c, c}, {c, -c, -c}, {-c, c, -c}, {-c, -c, c}}, {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}, {}};
}

// The wavy patch without its waves inside the border.
TriangleMesh flattened(TriangleMesh patch) {
  for (Vec3& v : patch.vertices)
    if (v.x > 0 && v.x < 1 && v.y > 0 && v.y < 1) v.z = 0;
  return patch;
}

// Mean over the area of the signed distance to the unit sphere.
double mean_height(const TriangleMesh& mesh) {
  const std::vector<SurfaceSample> samples = sample_surface(mesh, 100'000, 3);
  double sum = 0;
  for (const SurfaceSample& s : samples) sum += norm(s.point) - 1;
  return sum / static_cast<double>(samples.size());
}

double sum_of_squares(const FitReport::Distance& d) {
  return d.to_reference * d.to_reference + d.from_reference * d.from_reference;
}

std::size_t differences(const TriangleMesh& a, const TriangleMesh& b) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < a.vertices.size(); ++v)
    if (!(a.vertices[v] == b.vertices[v])) ++count;
  return count;
}

TEST(Fit, InscribedSphereReachesTheBestOffset) {
  // A chord triangle with corners on the sphere, barycentric coordinates b and circumradius r lies (3 r^2 / 2) s below
  // it, where s = b0 b1 + b1 b2 + b2 b0 has mean 1/4 and mean square 1/15. An offset can take the mean away and leaves
  // the standard deviation: sqrt(1/15 - 1/16) / sqrt(1/15) = 1/4 of the root mean square, if all triangles are
  // equilateral and alike. The icosphere's are not quite.
  const TriangleMesh sphere = icosphere(6);
  TriangleMesh mesh = icosphere(3);
  const double inscribed = measure_distance(mesh, sphere, 40'000).rms, depth = mean_height(mesh);
  const FitReport report = fit_to_surface(sphere, mesh, with_bounds(50, 0.8));
  const double fitted = measure_distance(mesh, sphere, 40'000).rms;
  EXPECT_GT(fitted, 0.24 * inscribed);
  EXPECT_LT(fitted, 0.29 * inscribed);
  EXPECT_LT(depth, 0);
  EXPECT_LT(std::abs(mean_height(mesh)), 0.03 * std::abs(depth));
  EXPECT_NEAR(report.before.to_reference, inscribed, 0.02 * inscribed);
  // The fit knows its own samples best.
  const double seen = std::max(report.after.to_reference, report.after.from_reference);
  EXPECT_LT(seen, 1.02 * fitted);
  EXPECT_GT(seen, 0.9 * fitted);
}

TEST(Fit, TetrahedronInASphereGrows) {
  const TriangleMesh sphere = icosphere(3);
  TriangleMesh mesh = tetrahedron();
  const double before = measure_distance(mesh, sphere, 5000).rms;
  fit_to_surface(sphere, mesh, with_bounds(55, 0.9));
  EXPECT_LT(measure_distance(mesh, sphere, 5000).rms, 0.75 * before);
  EXPECT_GE(measure_quality(mesh).theta_min, 55);
}

TEST(Fit, LeavesWhatIsOnTheSurface) {
  TriangleMesh plane = grid_patch(6, 6), other = grid_patch(12, 12);  // tilted, with vertices that could slide within
  SplitMix64 random(2);
  for (Vec3& v : plane.vertices)
    if (v.x > 0 && v.x < 6 && v.y > 0 && v.y < 6) v += {random.range(-0.3, 0.3), random.range(-0.3, 0.3), 0};
  for (Vec3& v : other.vertices) v *= 0.5;
  for (TriangleMesh* mesh : {&plane, &other})
    for (Vec3& v : mesh->vertices) v.z = 0.3 * v.x - 0.7 * v.y + 5;
  const std::vector<std::array<TriangleMesh, 2>> cases{
      {other, plane}, {plane, plane}, {box(4), box(4)}, {torus(12, 8), torus(12, 8)}};
  for (const auto& [reference, start] : cases) {
    TriangleMesh mesh = start;
    EXPECT_EQ(fit_to_surface(reference, mesh).iterations, 0);
    EXPECT_EQ(differences(mesh, start), 0u);
  }
}

TEST(Fit, PlaneIsRecoveredFromNoise) {
  const TriangleMesh plane = grid_patch(12, 12);
  TriangleMesh mesh = grid_patch(12, 12);
  SplitMix64 random(5);
  for (Vec3& v : mesh.vertices)
    if (v.x > 0 && v.x < 12 && v.y > 0 && v.y < 12) v.z = random.range(-0.05, 0.05);
  const double before = measure_distance(mesh, plane, 20'000).rms;
  FitOptions options;
  options.iterations = 5;
  fit_to_surface(plane, mesh, options);
  EXPECT_LT(measure_distance(mesh, plane, 20'000).rms, 1e-3 * before);
}

TEST(Fit, FollowsScaleExactlyAndTranslation) {
  const TriangleMesh sphere = torus(64, 40), coarse = torus(17, 11);
  TriangleMesh fitted = coarse, large = scaled(coarse, 0x1p40), far = moved(coarse, {3, -7, 11});
  fit_to_surface(sphere, fitted);
  fit_to_surface(scaled(sphere, 0x1p40), large);
  fit_to_surface(moved(sphere, {3, -7, 11}), far);
  EXPECT_EQ(differences(large, scaled(fitted, 0x1p40)), 0u);
  EXPECT_GT(differences(fitted, coarse), 0u);
  for (std::size_t v = 0; v < fitted.vertices.size(); ++v)
    EXPECT_LT(norm(far.vertices[v] - (fitted.vertices[v] + Vec3{3, -7, 11})), 1e-6);
}

TEST(Fit, FixedAndBorderVerticesStay) {
  const TriangleMesh patch = wavy_patch(64), coarse = wavy_patch(8);
  TriangleMesh mesh = coarse;
  FitOptions options;
  options.fixed.assign(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 3) options.fixed[v] = 1;
  fit_to_surface(patch, mesh, options);
  std::size_t free = 0, stayed = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& p = coarse.vertices[v];
    const bool border = p.x <= 0 || p.x >= 1 || p.y <= 0 || p.y >= 1;
    const bool same = mesh.vertices[v] == p;
    if (border || options.fixed[v]) {
      EXPECT_TRUE(same) << v;
    } else {
      ++free;
      if (same) ++stayed;
    }
  }
  EXPECT_LT(stayed, free);
}

TEST(Fit, KeepsQualityWhereTheFreeStepWouldNot) {
  TriangleMesh waves = wavy_patch(48);
  for (Vec3& v : waves.vertices) v.z *= 8;
  const TriangleMesh flat = flattened(wavy_patch(12));
  const QualityReport before = measure_quality(flat);
  TriangleMesh unguarded = flat, guarded = flat;
  fit_to_surface(waves, unguarded, with_bounds(0, 0));
  const FitReport report = fit_to_surface(waves, guarded);
  EXPECT_LT(measure_quality(unguarded).theta_min, 0.9 * before.theta_min);
  const QualityReport after = measure_quality(guarded);
  EXPECT_GE(after.theta_min, before.theta_min - 1e-9);
  EXPECT_GE(after.q_min, before.q_min - 1e-12);
  EXPECT_GT(report.damped, 0u);
  EXPECT_LT(sum_of_squares(report.after), sum_of_squares(report.before));

  // The caller's bounds replace the mesh's own.
  const FitOptions loose = with_bounds(0.8 * before.theta_min, 0.8 * before.q_min);
  TriangleMesh between = flat;
  const FitReport looser = fit_to_surface(waves, between, loose);
  EXPECT_GE(measure_quality(between).theta_min, *loose.min_angle - 1e-9);
  EXPECT_GE(measure_quality(between).q_min, *loose.min_quality - 1e-12);
  EXPECT_LT(sum_of_squares(looser.after), sum_of_squares(report.after));
}

TEST(Fit, DistanceNeverRises) {
  const std::vector<std::array<TriangleMesh, 2>> cases{{icosphere(4), icosphere(1)},
                                                       {torus(60, 40), torus(7, 5)},
                                                       {box(8), icosphere(2)},
                                                       {wavy_patch(40), flattened(wavy_patch(9))},
                                                       {two_spheres(), icosphere(1)}};
  for (const auto& [reference, start] : cases) {
    std::vector<double> energies;
    Context context;
    context.progress = [&](const Progress& p) { energies.push_back(p.energy); };
    FitOptions options;
    options.tolerance = 0;
    options.iterations = 15;
    TriangleMesh mesh = start;
    const FitReport report = fit_to_surface(reference, mesh, options, context);
    ASSERT_FALSE(energies.empty());
    EXPECT_TRUE(std::is_sorted(energies.rbegin(), energies.rend()));
    EXPECT_LE(sum_of_squares(report.after), sum_of_squares(report.before));
    options.iterations = 0;  // what the next fit sees first is what this one saw last, up to the samples' weights
    EXPECT_NEAR(fit_to_surface(reference, mesh, options).before.from_reference, report.after.from_reference,
                1e-9 * report.after.from_reference);
  }
}

TEST(Fit, SheetsOfAThinPlateKeepToTheirOwnSide) {
  // Two curved sheets, nearer to each other than the middles of the outer one's triangles are to it: three quarters of
  // the square of a circumradius of about 0.33, halved.
  constexpr double kInner = 0.97;
  const TriangleMesh sphere = icosphere(5), coarse = icosphere(1);
  const TriangleMesh outer = sphere, inner = reversed(scaled(sphere, kInner));
  TriangleMesh mesh = joined(coarse, reversed(scaled(coarse, kInner)));
  fit_to_surface(joined(outer, inner), mesh, with_bounds(40, 0.7));
  const std::size_t half = coarse.vertices.size();
  TriangleMesh out = coarse, in = reversed(coarse);
  std::copy(mesh.vertices.begin(), mesh.vertices.begin() + half, out.vertices.begin());
  std::copy(mesh.vertices.begin() + half, mesh.vertices.end(), in.vertices.begin());
  EXPECT_EQ(count_self_intersections(mesh), 0u);
  const double before = measure_distance(coarse, sphere, 20'000).rms;
  EXPECT_LT(measure_distance(out, outer, 20'000).rms, 0.35 * before);
  EXPECT_LT(measure_distance(in, inner, 20'000).rms, 0.35 * before);
}

TEST(Fit, SurfacesThatFaceAwayPullNowhere) {
  const TriangleMesh sphere = icosphere(3), start = tetrahedron();
  TriangleMesh mesh = start;
  fit_to_surface(reversed(sphere), mesh, with_bounds(55, 0.9));
  for (std::size_t v = 0; v < 4; ++v) EXPECT_LT(norm(mesh.vertices[v] - start.vertices[v]), 1e-9);
}

TEST(Fit, ShapesDoNotSuffer) {
  const auto bumpy = [](TriangleMesh mesh) {
    for (Vec3& v : mesh.vertices) {
      const Vec3 u = (1 / norm(v)) * v;
      v = (1 + 0.03 * std::sin(9 * u.x) * std::sin(8 * u.y + 1) * std::sin(7 * u.z + 2)) * u;
    }
    return mesh;
  };
  const TriangleMesh reference = bumpy(icosphere(5));
  TriangleMesh mesh = bumpy(icosphere(3));
  const QualityReport before = measure_quality(mesh);
  const FitReport report = fit_to_surface(reference, mesh);
  EXPECT_GT(report.iterations, 1);
  const QualityReport after = measure_quality(mesh);
  EXPECT_GE(after.theta_min_ave, before.theta_min_ave);
  EXPECT_GE(after.q_ave, before.q_ave);
}

TEST(Fit, MakesNoIntersections) {
  // A plate just above a vertex of an inscribed sphere, nearer than the best offset of the vertex.
  const TriangleMesh sphere = icosphere(5), coarse = icosphere(1);
  TriangleMesh plate;
  const Vec3 up = coarse.vertices[0];
  const Vec3 side = (1 / norm(cross(up, {1, 0, 0}))) * cross(up, {1, 0, 0}), other = cross(side, up);
  for (const Vec3& d : {side + other, other - side, -side - other, side - other})
    plate.vertices.push_back(1.01 * up + 0.3 * d);
  plate.triangles = {{0, 1, 2}, {0, 2, 3}};
  const TriangleMesh start = joined(coarse, plate);
  ASSERT_EQ(count_self_intersections(start), 0u);
  TriangleMesh mesh = start, alone = coarse;
  fit_to_surface(sphere, alone, with_bounds(40, 0.7));
  ASSERT_GT(dot(alone.vertices[0], up), 1.01);
  const FitReport report = fit_to_surface(joined(sphere, plate), mesh, with_bounds(40, 0.7));
  EXPECT_GT(report.restored, 0u);
  EXPECT_LT(report.restored, coarse.vertices.size() / 2);
  EXPECT_EQ(count_self_intersections(mesh), 0u);
  EXPECT_LT(sum_of_squares(report.after), sum_of_squares(report.before));
}

TEST(Fit, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh reference = torus(90, 60), coarse = torus(40, 25);
  const auto fit = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    TriangleMesh mesh = coarse;
    fit_to_surface(reference, mesh);
    return mesh;
  };
  const TriangleMesh one = fit(1);
  EXPECT_GT(differences(one, coarse), 0u);
  for (const unsigned threads : {2u, 3u, 8u}) EXPECT_EQ(differences(fit(threads), one), 0u);
}

TEST(Fit, TakesAnyInput) {
  const TriangleMesh sphere = icosphere(1);
  for (const TriangleMesh& odd : {single_triangle(), pages(), soup(20, 4), duplicated_triangles(), needles(),
                                  collinear_among_good(), reversed(sphere)}) {
    TriangleMesh mesh = odd, body = sphere;
    const FitReport one = fit_to_surface(sphere, mesh), other = fit_to_surface(odd, body);
    for (const FitReport& report : {one, other}) EXPECT_LE(sum_of_squares(report.after), sum_of_squares(report.before));
    for (const TriangleMesh& m : {mesh, body})
      for (const Vec3& v : m.vertices) EXPECT_TRUE(std::isfinite(norm2(v)));
  }
}

TEST(Fit, RefusesWhatItCannotUse) {
  const TriangleMesh sphere = icosphere(2);
  TriangleMesh mesh = icosphere(1), flat = collinear_among_good();
  flat.triangles = {flat.triangles[1]};
  EXPECT_THROW(fit_to_surface(flat, mesh), Error);
  const TriangleMesh before = flat;
  EXPECT_EQ(fit_to_surface(sphere, flat).iterations, 0);
  EXPECT_EQ(flat.vertices, before.vertices);
  FitOptions options;
  options.fixed.assign(3, 1);
  EXPECT_THROW(fit_to_surface(sphere, mesh, options), Error);

  const std::atomic<bool> cancel = true;
  Context context;
  context.cancel = &cancel;
  EXPECT_THROW(fit_to_surface(sphere, mesh, {}, context), Cancelled);
  EXPECT_EQ(differences(mesh, icosphere(1)), 0u);
}

TEST(Nearest, HintsChangeNothing) {
  const TriangleMesh mesh = collinear_among_good(), sphere = icosphere(3);
  for (const TriangleMesh* m : {&mesh, &sphere}) {
    const NearestOnMesh nearest(*m);
    SplitMix64 random(8);
    for (int i = 0; i < 200; ++i) {
      const Vec3 p{random.range(-2, 2), random.range(-2, 2), random.range(-2, 2)};
      const NearestPoint found = nearest.nearest(p);
      for (Index t = 0; t < std::min<std::size_t>(m->triangles.size(), 20); ++t) {
        const NearestPoint hinted = nearest.nearest(p, {m->vertices[m->triangles[t][0]], t});
        EXPECT_NEAR(norm(hinted.point - p), norm(found.point - p), 1e-12);
      }
    }
  }
}

TEST(SelfIntersections, AreFound) {
  // Two triangles cross; a third, in between by index, has no area, and a fourth touches nothing.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0},  {1, 1, -1}, {1, 1, 1},
                   {5, 5, 1}, {9, 9, 9}, {10, 9, 9}, {9, 10, 9}};
  mesh.triangles = {{6, 7, 8}, {0, 1, 2}, {0, 1, 1}, {3, 4, 5}};
  const std::vector<std::array<Index, 2>> expected{{1, 3}};
  EXPECT_EQ(find_self_intersections(mesh), expected);
  EXPECT_EQ(count_self_intersections(mesh), 1u);
  EXPECT_TRUE(find_self_intersections(icosphere(2)).empty());
}

}  // namespace
}  // namespace bisector::test
