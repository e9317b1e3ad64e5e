#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "bisector/error.h"
#include "bisector/repair.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"

namespace bisector {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Points = std::vector<Kernel::Point_3>;
using Faces = std::vector<std::array<std::size_t, 3>>;

constexpr double kOffset = 1.0 / 30;        // of the wrap from the triangles, in alphas
constexpr double kLeastAlpha = 1.0 / 2000;  // in diagonals of the bounding box
constexpr double kShell = 2.5;        // offsets that a wrap is thick around a sheet, at most: two, but for its corners
constexpr double kShellShare = 0.01;  // of the area, from which on there are sheets; elsewhere a sharp edge is as thin

// CGAL calls this for each facet that it carves at.
class CancelVisitor : public CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
 public:
  explicit CancelVisitor(const Context& context) : context_(&context) {}
  template <class Wrapper, class Facet>
  void before_facet_treatment(const Wrapper&, const Facet&) {
    context_->check();
  }

 private:
  const Context* context_;
};

TriangleMesh alpha_wrap(const Points& points, const Faces& faces, double alpha, double offset, const Context& context) {
  CGAL::Surface_mesh<Kernel::Point_3> wrapped;
  CancelVisitor visitor(context);
  CGAL::alpha_wrap_3(points, faces, alpha, offset, wrapped, CGAL::parameters::default_values(),
                     CGAL::parameters::visitor(visitor));
  TriangleMesh result;
  for (const auto v : wrapped.vertices()) {
    const Kernel::Point_3& p = wrapped.point(v);
    result.vertices.push_back({p.x(), p.y(), p.z()});
  }
  for (const auto f : wrapped.faces()) {
    Triangle t{};
    int corner = 0;
    for (const auto v : wrapped.vertices_around_face(wrapped.halfedge(f))) t[corner++] = static_cast<Index>(v.idx());
    result.triangles.push_back(t);
  }
  return result;
}

double area_of(const TriangleMesh& mesh, const Triangle& t) {
  return 0.5 * norm(twice_area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
}

// Share of the area of a closed surface from whose triangles' barycentres it is not as far straight through the inside.
double share_thinner_than(const TriangleMesh& mesh, double thickness) {
  using Triangles = std::vector<Kernel::Triangle_3>;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
  Triangles triangles;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    triangles.emplace_back(Kernel::Point_3(a.x, a.y, a.z), Kernel::Point_3(b.x, b.y, b.z),
                           Kernel::Point_3(c.x, c.y, c.z));
  }
  Tree tree(triangles.cbegin(), triangles.cend());
  tree.build();
  std::vector<double> thin(triangles.size(), 0);
  double area = 0, thin_area = 0;
  for (const Triangle& t : mesh.triangles) area += area_of(mesh, t);
  parallel_each(triangles.size(), [&](std::size_t k) {
    const Triangle& t = mesh.triangles[k];
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const Vec3 middle = (1.0 / 3) * (a + b + c), through = middle - thickness * unit(twice_area_normal(a, b, c));
    const Kernel::Segment_3 segment({middle.x, middle.y, middle.z}, {through.x, through.y, through.z});
    std::vector<Triangles::const_iterator> met;
    tree.all_intersected_primitives(segment, std::back_inserter(met));
    const bool other = std::any_of(met.begin(), met.end(),
                                   [&](auto i) { return static_cast<std::size_t>(i - triangles.cbegin()) != k; });
    if (other) thin[k] = area_of(mesh, t);
  });
  for (const double x : thin) thin_area += x;
  return area > 0 ? thin_area / area : 0;
}

}  // namespace

WrapResult wrap(const TriangleMesh& mesh, double alpha, double thickness, const Context& context) {
  Points points;
  Faces faces;
  for (const Vec3& p : mesh.vertices) points.emplace_back(p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    // Nearest points of those that only exact numbers tell from a line are not numbers.
    if (collinear(a, b, c) || !std::isnormal(norm2(cross(b - a, c - a)))) continue;
    faces.push_back({t[0], t[1], t[2]});
  }
  if (faces.empty()) throw Error("no triangle has an area; there is nothing to wrap");
  const double least = kLeastAlpha * bounding_box(mesh).diagonal();
  if (!(alpha >= least && std::isfinite(alpha)))
    throw Error(fmt::format("{:.4g} is too small a radius for wrapping; it must be at least {:.4g}", alpha, least));
  if (!(thickness >= 0 && std::isfinite(thickness)))
    throw Error(fmt::format("{:.4g} is no thickness for a wrap's shells; give a length", thickness));
  WrapResult result;
  result.offset = kOffset * alpha;
  result.mesh = alpha_wrap(points, faces, alpha, result.offset, context);
  if (2 * result.offset < thickness && share_thinner_than(result.mesh, kShell * result.offset) > kShellShare) {
    result.offset = thickness / 2;
    result.mesh = alpha_wrap(points, faces, alpha, result.offset, context);
  }
  return result;
}

}  // namespace bisector
