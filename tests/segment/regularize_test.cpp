#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>
#include <vector>

#include "bisector/segment.h"
#include "segment/regularize.h"
#include "segment/segment_domain.h"
#include "support/csg.h"
#include "support/models.h"
#include "support/tree_growth.h"

namespace bisector::test {
namespace {

// Patches of surfaces with noise along their normals, a region each.
struct Scene {
  TriangleMesh mesh;
  std::vector<Index> labels;
  std::vector<Primitive> primitives;  // true ones
  SplitMix64 random{7};
  double noise = 0;

  // A patch of n x n vertices at place(s, t), moved along normal(s, t).
  template <class Place, class Normal>
  void add(const Primitive& primitive, const Place& place, const Normal& normal) {
    constexpr Index n = 24;
    const auto first = static_cast<Index>(mesh.vertices.size());
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j) {
        const double s = i / (n - 1.0), t = j / (n - 1.0);
        mesh.vertices.push_back(place(s, t) + noise * gaussian(random) * normal(s, t));
      }
    for (Index i = 0; i + 1 < n; ++i)
      for (Index j = 0; j + 1 < n; ++j) {
        const Index a = first + i * n + j, b = a + n;
        mesh.triangles.push_back({a, b, b + 1});
        mesh.triangles.push_back({a, b + 1, a + 1});
        labels.insert(labels.end(), 2, static_cast<Index>(primitives.size()));
      }
    primitives.push_back(primitive);
  }

  // A third of a cylinder, of length 2 from a point on.
  void add_cylinder(const Vec3& point, const Vec3& direction, double r) {
    const Vec3 axis = (1 / norm(direction)) * direction;
    const auto [u, v] = frame_across(axis);
    const auto out = [u = u, v = v](double s) { return std::cos(2 * s) * u + std::sin(2 * s) * v; };
    add(
        make_cylinder(point, axis, r), [=](double s, double t) { return point + 2 * t * axis + r * out(s); },
        [=](double s, double) { return out(s); });
  }
  void add_plane(const Vec3& corner, const Vec3& normal) {
    const Vec3 n = (1 / norm(normal)) * normal;
    const auto [u, v] = frame_across(n);
    add(
        make_plane(n, dot(n, corner)), [=, u = u, v = v](double s, double t) { return corner + s * u + t * v; },
        [=](double, double) { return n; });
  }

  // Relations, and the surfaces in the domain's coordinates.
  std::vector<SegmentRelation> regularized(std::vector<Primitive>& found) const {
    const SegmentDomain domain = make_segment_domain(mesh);
    found.clear();
    for (const Primitive& p : primitives)
      found.push_back(from_local(p, (-1 / domain.scale) * domain.origin, 1 / domain.scale));
    return regularize(domain, labels, found);
  }
};

bool holds(const std::vector<SegmentRelation>& relations, RelationKind kind, Index a, Index b) {
  return std::any_of(relations.begin(), relations.end(), [&](const SegmentRelation& r) {
    const auto in = [](const std::vector<Index>& list, Index i) {
      return std::find(list.begin(), list.end(), i) != list.end();
    };
    if (r.kind != kind) return false;
    if (kind != RelationKind::perpendicular) return in(r.regions, a) && in(r.regions, b);
    return (in(r.regions, a) && in(r.others, b)) || (in(r.regions, b) && in(r.others, a));
  });
}

TEST(Regularize, EqualParametersBecomeEqual) {
  for (const double noise : {0.0, 2e-3}) {
    SCOPED_TRACE(noise);
    Scene scene;
    scene.noise = noise;
    const Vec3 axis{1, 2, 3}, across = cross(axis, {0, 1, 1});
    scene.add_cylinder({0, 0, 0}, axis, 1);
    scene.add_cylinder({4, 0, 0}, axis, 1);
    scene.add_cylinder({0, 5, 0}, across, 0.5);
    scene.add_plane({-4, 0, 0}, axis);
    scene.add_cylinder(axis, axis, 0.7);
    std::vector<Primitive> found;
    const auto relations = scene.regularized(found);
    for (const auto& [a, b] : {std::pair<Index, Index>{0, 1}, {0, 3}, {1, 4}})
      EXPECT_TRUE(holds(relations, RelationKind::parallel, a, b)) << a << " " << b;
    EXPECT_TRUE(holds(relations, RelationKind::perpendicular, 0, 2));
    EXPECT_TRUE(holds(relations, RelationKind::coaxial, 0, 4));
    EXPECT_TRUE(holds(relations, RelationKind::equal_radius, 0, 1));
    EXPECT_FALSE(holds(relations, RelationKind::coaxial, 0, 1));
    EXPECT_FALSE(holds(relations, RelationKind::equal_radius, 0, 2));
    EXPECT_FALSE(holds(relations, RelationKind::equal_radius, 0, 4));
    const auto cylinder = [&](std::size_t i) { return std::get<Cylinder>(found[i]); };
    EXPECT_EQ(cylinder(0).radius, cylinder(1).radius);
    EXPECT_EQ(norm(cross(cylinder(0).axis, cylinder(1).axis)), 0);
    EXPECT_EQ(norm(cross(cylinder(0).axis, std::get<Plane>(found[3]).normal)), 0);
    EXPECT_LE(std::abs(dot(cylinder(0).axis, cylinder(2).axis)), 1e-15);
    EXPECT_LE(norm(cylinder(0).point - cylinder(4).point), 1e-14);
  }
}

// What differs by more than the noise stays apart: by ten standard deviations, and without noise by very little.
TEST(Regularize, DifferentParametersStayApart) {
  for (const double noise : {0.0, 2e-3}) {
    SCOPED_TRACE(noise);
    const double difference = noise > 0 ? 10 * noise : 1e-4;
    Scene scene;
    scene.noise = noise;
    const Vec3 axis{1, 2, 3};
    scene.add_cylinder({0, 0, 0}, axis, 1);
    scene.add_cylinder({4, 0, 0}, axis + difference * Vec3{-6, 3, 0}, 1 + difference);
    scene.add_plane({-4, 0, 0}, {0.2, -0.3, 1});
    scene.add_plane(Vec3{-4, 3, 0.9 + 3 * difference}, {0.2, -0.3, 1});
    std::vector<Primitive> found;
    const auto relations = scene.regularized(found);
    EXPECT_FALSE(holds(relations, RelationKind::equal_radius, 0, 1));
    EXPECT_FALSE(holds(relations, RelationKind::parallel, 0, 1));
    EXPECT_TRUE(holds(relations, RelationKind::parallel, 2, 3));
    EXPECT_FALSE(holds(relations, RelationKind::coplanar, 2, 3));
  }
}

TEST(Regularize, FindsCoplanarFaces) {
  Scene scene;
  scene.noise = 2e-3;
  scene.add_plane({-4, 0, 0}, {0.2, -0.3, 1});
  scene.add_plane(Vec3{-4, 3, 0.9}, {0.2, -0.3, 1});
  std::vector<Primitive> found;
  const auto relations = scene.regularized(found);
  EXPECT_TRUE(holds(relations, RelationKind::coplanar, 0, 1));
  EXPECT_EQ(std::abs(std::get<Plane>(found[0]).offset), std::abs(std::get<Plane>(found[1]).offset));
}

// Directions, radii and places at random have nothing in common.
TEST(Regularize, FindsNothingInRandomSurfaces) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE(seed);
    Scene scene;
    scene.noise = 1e-3;
    scene.random = SplitMix64(seed);
    for (int i = 0; i < 8; ++i) {
      const auto draw = [&] {
        return Vec3{scene.random.unit() - 0.5, scene.random.unit() - 0.5, scene.random.unit() - 0.5};
      };
      const Vec3 point = 20.0 * draw(), axis = draw();
      scene.add_cylinder(point, axis, 0.5 + scene.random.unit());
    }
    std::vector<Primitive> found;
    EXPECT_TRUE(scene.regularized(found).empty());
  }
}

// A noisy block's faces become parallel in pairs and at right angles, and stay as near to their data.
TEST(Regularize, ABlocksFacesBecomeRight) {
  const CsgModel model = csg_part(6000, 1e-3, 2);
  SegmentOptions options;
  options.proxies = model.primitives.size();
  options.regularize = true;
  const SegmentResult result = segment(model.mesh, options);
  const std::vector<Index> regions = matching_regions(model, result.labels);
  std::vector<Index> faces;
  for (std::size_t k = 0; k < regions.size(); ++k)
    if (std::holds_alternative<Plane>(model.primitives[k]) && model.areas[k] > 1) faces.push_back(regions[k]);
  ASSERT_EQ(faces.size(), 6u);
  for (const Index a : faces)
    for (const Index b : faces) {
      if (a >= b) continue;
      const auto* p = std::get_if<Plane>(&result.regions[a].proxy);
      const auto* q = std::get_if<Plane>(&result.regions[b].proxy);
      ASSERT_TRUE(p && q);
      const double cosine = std::abs(dot(p->normal, q->normal));
      EXPECT_TRUE(cosine <= 1e-15 || norm(cross(p->normal, q->normal)) == 0) << a << " " << b << " " << cosine;
    }
  EXPECT_LE(result.rms, 1.05 * result.rms_before);
}

}  // namespace
}  // namespace bisector::test
