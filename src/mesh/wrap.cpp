#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "bisector/error.h"
#include "bisector/repair.h"
#include "core/degenerate.h"
#include "core/geometry.h"

namespace bisector {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Points = std::vector<Kernel::Point_3>;
using Faces = std::vector<std::array<std::size_t, 3>>;

constexpr double kOffset = 1.0 / 30;        // of the wrap from the triangles, in alphas
constexpr double kLeastAlpha = 1.0 / 2000;  // in diagonals of the bounding box

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

}  // namespace

TriangleMesh wrap(const TriangleMesh& mesh, double alpha, const Context& context) {
  Points points;
  Faces faces;
  for (const Vec3& p : mesh.vertices) points.emplace_back(p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    if (collinear(a, b, c)) continue;
    faces.push_back({t[0], t[1], t[2]});
  }
  if (faces.empty()) throw Error("no triangle has an area; there is nothing to wrap");
  const double least = kLeastAlpha * bounding_box(mesh.vertices).diagonal();
  if (!(alpha >= least && std::isfinite(alpha)))
    throw Error(fmt::format("{:.4g} is too small a radius for wrapping; it must be at least {:.4g}", alpha, least));
  CGAL::Surface_mesh<Kernel::Point_3> wrapped;
  CancelVisitor visitor(context);
  CGAL::alpha_wrap_3(points, faces, alpha, kOffset * alpha, wrapped, CGAL::parameters::default_values(),
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

}  // namespace bisector
