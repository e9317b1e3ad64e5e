// Solids that lie on each other with faces are parted there, by no more than it takes.
#include "mesh/face_contacts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "core/geometry.h"
#include "support/models.h"
#include "support/scaled.h"

namespace bisector::test {
namespace {

constexpr double kRounding = 1e-5, kApart = 2e-6, kDepth = 4e-6;

TriangleMesh turned(TriangleMesh mesh, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  for (Vec3& p : mesh.vertices) {
    p = {c * p.x - s * p.y, s * p.x + c * p.y, p.z};
    p = {p.x, c * p.y - s * p.z, s * p.y + c * p.z};
  }
  return mesh;
}

// A prism over a regular polygon of radius 0.5, from z = 0 to `height`.
TriangleMesh prism(Index sides, double height) {
  TriangleMesh mesh;
  for (const double z : {0.0, height})
    for (Index k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      mesh.vertices.push_back({0.5 * std::cos(angle), 0.5 * std::sin(angle), z});
    }
  for (Index k = 0; k < sides; ++k) {
    const Index next = (k + 1) % sides;
    mesh.triangles.push_back({k, next, sides + next});
    mesh.triangles.push_back({k, sides + next, sides + k});
    if (k < 2) continue;
    mesh.triangles.push_back({0, k, k - 1});
    mesh.triangles.push_back({sides, sides + k - 1, sides + k});
  }
  return mesh;
}

// A plate [-1, 1]^2 x [0, 1] with a hole that the prism fits into; its walls are divided the other way.
TriangleMesh plate_around(Index sides) {
  TriangleMesh mesh = prism(sides, 1);
  mesh.triangles.clear();
  for (const double z : {0.0, 1.0})
    for (Index k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides, c = std::cos(angle), s = std::sin(angle);
      const double reach = 1 / std::max(std::abs(c), std::abs(s));
      mesh.vertices.push_back({reach * c, reach * s, z});
    }
  for (Index k = 0; k < sides; ++k) {
    const Index next = (k + 1) % sides, in = k, in_next = next, top = sides, out = 2 * sides;
    const auto quad = [&](Index a, Index b, Index c, Index d) {
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    };
    quad(in_next, in, top + in, top + in_next);
    quad(out + k, out + next, out + top + next, out + top + k);
    quad(top + in, out + top + k, out + top + next, top + in_next);
    quad(in, in_next, out + next, out + k);
  }
  return mesh;
}

struct Contact {
  std::string name;
  TriangleMesh mesh;
};

void PrintTo(const Contact& contact, std::ostream* out) { *out << contact.name; }

std::vector<Contact> flat_contacts() {
  const TriangleMesh plate = scaled(box(1), {3, 3, 0.5}), block = scaled(box(3), {0.7, 0.9, 0.8});
  const TriangleMesh on_plate = joined(plate, block, {1, 1, 0.5});
  // On the floor and against two walls at once.
  const TriangleMesh walls = joined(joined(plate, scaled(box(1), {0.25, 3, 2}), {-0.25, 0, 0.5}),
                                    scaled(box(1), {3, 0.25, 2}), {0, -0.25, 0.5});
  return {{"block_on_a_plate", on_plate},
          {"turned", turned(on_plate, 0.3)},
          {"block_in_a_corner", joined(walls, block, {0, 0, 0.5})},
          {"sunk_by_less_than_rounding", joined(plate, block, {1, 1, 0.5 - kDepth})}};
}

std::vector<Contact> curved_contacts() {
  return {{"plug_in_a_hole", joined(plate_around(32), prism(32, 2), {0, 0, -0.5})},
          {"plug_in_a_turned_hole", turned(joined(plate_around(32), prism(32, 2), {0, 0, -0.5}), 0.7)}};
}

class Faces : public testing::TestWithParam<Contact> {};

TEST_P(Faces, InContactArePartedByTheDistanceAskedFor) {
  const TriangleMesh& input = GetParam().mesh;
  ASSERT_GT(count_self_intersections(input), 0u);
  TriangleMesh open = input;
  EXPECT_GT(open_face_contacts(open, kRounding, kApart), 0u);
  EXPECT_EQ(count_self_intersections(open), 0u);
  EXPECT_EQ(open.triangles, input.triangles);
  double farthest = 0;
  for (std::size_t v = 0; v < input.vertices.size(); ++v)
    farthest = std::max(farthest, norm(open.vertices[v] - input.vertices[v]));
  EXPECT_GE(farthest, 0.45 * kApart);
  // Half of that and of the depth, from three faces at right angles at most.
  EXPECT_LE(farthest, std::sqrt(3.0) * 0.51 * (kApart + kDepth));
  EXPECT_EQ(open_face_contacts(open, 0.25 * kApart, 0.25 * kApart), 0u);
}

INSTANTIATE_TEST_SUITE_P(Flat, Faces, testing::ValuesIn(flat_contacts()), [](const auto& p) { return p.param.name; });
INSTANTIATE_TEST_SUITE_P(Curved, Faces, testing::ValuesIn(curved_contacts()),
                         [](const auto& p) { return p.param.name; });

class FlatFaces : public Faces {};

// However fine they are: without it two triangles of both faces intersect wherever they lie on each other.
TEST_P(FlatFaces, InContactDoNotIntersectInTheResult) {
  RemeshOptions options;
  options.vertices = 1200;
  const RemeshResult result = remesh(GetParam().mesh, options);
  EXPECT_EQ(count_self_intersections(result.mesh), 0u);
  EXPECT_TRUE(result.topology_matches);
  EXPECT_EQ(result.features.broken, 0u);
}

INSTANTIATE_TEST_SUITE_P(All, FlatFaces, testing::ValuesIn(flat_contacts()),
                         [](const auto& p) { return p.param.name; });

TEST(FaceContacts, LeaveWhatIsNoContact) {
  const TriangleMesh slab = scaled(box(1), {2, 2, 1});
  const std::vector<TriangleMesh> others = {
      joined(slab, slab, {0.5, 0.5, 1 + 4 * kRounding}),                  // apart
      joined(slab, slab, {0.5, 0.5, 1 - 4 * kRounding}),                  // into each other
      joined(slab, scaled(box(1), {1, 1, 2}), {0.5, 0.5, 0}),             // the same side of a plane
      joined(slab, box(1), {2, 2, 0}),                                    // along an edge
      joined(slab, slab, {2 - 0.5 * kRounding, 2 - 0.5 * kRounding, 1}),  // by less than rounding
      box(4)};
  for (std::size_t k = 0; k < others.size(); ++k) {
    TriangleMesh mesh = others[k];
    EXPECT_EQ(open_face_contacts(mesh, kRounding, kApart), 0u) << k;
    EXPECT_EQ(mesh.vertices, others[k].vertices) << k;
  }
}

}  // namespace
}  // namespace bisector::test
