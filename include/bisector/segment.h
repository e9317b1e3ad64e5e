// Variational segmentation of a mesh into regions of planes, quadrics and tori (Yan Dong-Ming, Variational Shape
// Segmentation and Mesh Generation, 2010, chapter 2).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "bisector/context.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

enum class SurfaceType {
  plane,
  sphere,
  cylinder,  // circular
  cone,      // circular
  torus,
  // General quadrics:
  ellipsoid,
  elliptic_paraboloid,
  hyperbolic_paraboloid,
  one_sheet_hyperboloid,
  two_sheet_hyperboloid,
  elliptic_cone,
  elliptic_cylinder,
  hyperbolic_cylinder,
  parabolic_cylinder,
  plane_pair  // two real planes, parallel or not
};

// In lower case, words joined by '_', as in reports.
BISECTOR_API const char* name_of(SurfaceType type);

// The zero set of c0 + c1 x + c2 y + c3 z + c4 x^2 + c5 xy + c6 xz + c7 y^2 + c8 yz + c9 z^2. A plane has c4 = ... = c9
// = 0. The scale of c is of no meaning.
struct Quadric {
  std::array<double, 10> c{};
};

// Axes and normals of all surfaces have length 1.
struct Plane {
  Vec3 normal{0, 0, 1};
  double offset = 0;  // dot(normal, p) = offset
};

struct Sphere {
  Vec3 centre;
  double radius = 0;
};

struct Cylinder {
  Vec3 point;  // of the axis, the one nearest the origin
  Vec3 axis{0, 0, 1};
  double radius = 0;
};

struct Cone {
  Vec3 apex;
  Vec3 axis{0, 0, 1};  // points into the nappe with most of the data
  double angle = 0;    // half the opening, radians
};

struct Torus {
  Vec3 centre;
  Vec3 axis{0, 0, 1};
  double radius = 0;        // of the circle that the tube's centre runs along
  double minor_radius = 0;  // of the tube
};

// A quadric of another type, in canonical form: an equation in x, y, z along `axes` from `centre`, with lengths a, b, c
// (0 where the equation has none).
//   ellipsoid, hyperboloids      x^2/a^2 + y^2/b^2 + z^2/c^2 = 1, a >= b >= c; x^2/a^2 + y^2/b^2 - z^2/c^2 = +-1, a >=
//   b elliptic cone                x^2/a^2 + y^2/b^2 = z^2, c = 1: ratios paraboloids                  x^2/(2a) +-
//   y^2/(2b) = z: radii of curvature at the vertex elliptic, hyperbolic, parabolic cylinder  x^2/a^2 +- y^2/b^2 = 1,
//   x^2/(2a) = z (rulings along y) plane pair                   x^2/a^2 = y^2/b^2, a^2 + b^2 = 1: ratios; or parallel
//   ones x^2 = a^2
struct GeneralQuadric {
  SurfaceType type = SurfaceType::ellipsoid;  // ellipsoid to plane_pair
  Quadric polynomial;                         // with a gradient of about length 1 on the surface
  Vec3 centre;  // of symmetry, or the vertex of a paraboloid, or a point of a cylinder's axis
  std::array<Vec3, 3> axes{};
  std::array<double, 3> lengths{};
};

using Primitive = std::variant<Plane, Sphere, Cylinder, Cone, Torus, GeneralQuadric>;

BISECTOR_API SurfaceType type_of(const Primitive& primitive);

// The surface's polynomial, with a gradient of about length 1 on the surface; a torus has none of second degree.
BISECTOR_API std::optional<Quadric> quadric_of(const Primitive& primitive);

// Distance to the surface: exact for plane, sphere, cylinder, cone (both nappes) and torus; for general quadrics
// Taubin's second-order approximation (1993), which lies between 0 and the exact one.
BISECTOR_API double distance(const Primitive& primitive, const Vec3& p);

// The nearest point of the surface; one of them where several are equally near, p itself if the surface has no real
// point.
BISECTOR_API Vec3 foot_point(const Primitive& primitive, const Vec3& p);

enum class SegmentSurfaces {
  planes,
  quadrics,  // planes and quadrics
  all        // tori too
};

enum class SegmentStart {
  merging,    // small planar regions merged pairwise, the cheapest first; the same for every random seed
  insertion,  // one region, others inserted one by one where the error is largest
  random      // all regions at once about random triangles, others inserted where needed
};

struct SegmentOptions {
  std::size_t proxies = 0;  // regions wanted, or 0: as many as `error` takes
  double error = 0.1;  // without `proxies`: root mean square distance to the proxies at most, percent of the diagonal
                       // of the vertices' bounding box
  SegmentSurfaces surfaces = SegmentSurfaces::all;
  SegmentStart start = SegmentStart::merging;
  int iterations = 30;      // Lloyd steps at most, each time
  double smooth = 1;        // weight of the borders' length, over that which the distances left suggest; 0: borders are
                            // left as they are. Less of it is used where the root mean square distance would grow by
                            // more than 5 percent
  int fuzzy_rings = 0;      // triangles so many steps from a border may change sides; 0: as many as it takes
  bool regularize = false;  // let planes, spheres, cylinders, cones and tori share parameters where the data allow
  bool project = false;     // move the vertices onto the proxies
  std::uint64_t random_seed = 1;  // of the random start
};

struct SegmentRegion {
  Primitive proxy;
  std::size_t triangles = 0;
  double area = 0;
  double rms = 0;  // root mean square distance from vertices and barycentres to the proxy, a length
  double max = 0;  // the largest of these distances, triangles of no area left out
};

// What SegmentOptions::regularize made equal.
enum class RelationKind {
  parallel,       // normals of planes and axes
  perpendicular,  // those of `regions` to those of `others`
  coaxial,        // axes in one line
  coplanar,
  equal_radius,  // of spheres and cylinders, and the radius or minor radius of tori
  equal_angle    // of cones
};

// In lower case, words joined by '_', as in reports.
BISECTOR_API const char* name_of(RelationKind kind);

struct SegmentRelation {
  RelationKind kind = RelationKind::parallel;
  std::vector<Index> regions, others;  // ascending; a torus whose two radii are equal to others' counts twice
  double value = 0;                    // the radius, a length, or the angle, radians
};

struct SegmentSeconds {
  double start = 0, lloyd = 0, improve = 0, smooth = 0, classify = 0, project = 0, total = 0;
};

struct SegmentResult {
  std::vector<Index> labels;           // region of each triangle, in descending order of area
  std::vector<SegmentRegion> regions;  // connected through edges, each of at least one triangle
  double rms = 0;                      // over the whole mesh, a length
  // The sum of squared distances times areas, of the mesh scaled to unit longest side, before and after each step of
  // each Lloyd iteration.
  std::vector<std::vector<double>> energies;
  int iterations = 0;  // Lloyd steps in all
  std::size_t insertions = 0, merges = 0, teleportations = 0, deletions = 0;
  std::size_t evaluations = 0;                 // distances of a triangle to a proxy
  double border_before = 0, border_after = 0;  // length of the borders between regions before and after smoothing
  double rms_before = 0;                       // before smoothing, a length
  double smooth = 0;                           // the weight that borders were smoothed with
  std::vector<SegmentRelation> relations;      // with SegmentOptions::regularize
  std::vector<Vec3> projected;  // the vertices on the proxies, with SegmentOptions::project; shared ones averaged
  SegmentSeconds seconds;
};

// Any mesh: open, non-manifold, of several components (each needs a region of its own), with triangles of no area.
// Throws Error for a mesh without area and options out of range. Fewer proxies than components or more than triangles
// are a warning: there are as many regions as components, or as triangles.
BISECTOR_API SegmentResult segment(const TriangleMesh& mesh, const SegmentOptions& options,
                                   const Context& context = {});

}  // namespace bisector
