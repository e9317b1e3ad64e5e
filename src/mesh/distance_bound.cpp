#include "bisector/distance_bound.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "bisector/error.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/used_vertices.h"
#include "spatial/nearest.h"

namespace bisector {
namespace {

constexpr double kRounding = 1e-13;  // of the size of both surfaces, by which distances may be off
constexpr std::size_t kGrain = 64;   // triangles at once
// No point of a triangle is farther from its nearest corner than this part of its longest edge: 1 / sqrt(3), rounded
// up.
constexpr double kCover = 0.577351;

void check_coordinates(const TriangleMesh& mesh) {
  for (const Triangle& t : mesh.triangles)
    for (const Index v : t)
      if (v >= mesh.vertices.size() || !std::isfinite(norm2(mesh.vertices[v])))
        throw Error(fmt::format("distance: vertex {} is missing or not finite; mend the mesh", v));
}

// The surface that distances are measured to.
class Target {
 public:
  explicit Target(const TriangleMesh& mesh) : mesh_(mesh), nearest_(mesh) {}

  NearestPoint nearest(const Vec3& p, const NearestPoint& hint) const { return nearest_.nearest(p, hint); }
  NearestPoint nearest(const Vec3& p) const { return nearest_.nearest(p); }
  double distance_to(Index triangle, const Vec3& p) const {
    const auto [a, b, c] = mesh_.triangles[triangle];
    return norm(p - nearest_on_triangle(p, mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]));
  }

 private:
  const TriangleMesh& mesh_;
  NearestOnMesh nearest_;
};

struct Corner {
  Vec3 point;
  NearestPoint near;
  double distance = 0;
};

// Bounds the distance over one triangle.
class Divider {
 public:
  Divider(const Target& target, double enough, double gap) : target_(target), enough_(enough), gap_(gap) {}

  TriangleDistance run(const std::array<Vec3, 3>& corners) {
    found_ = {};
    std::array<Corner, 3> part;
    part[0] = corner_at(corners[0], target_.nearest(corners[0]));
    for (std::size_t k = 1; k < 3; ++k) part[k] = corner_at(corners[k], target_.nearest(corners[k], part[0].near));
    divide(part);
    return found_;
  }

 private:
  Corner corner_at(const Vec3& p, const NearestPoint& near) {
    const Corner corner{p, near, norm(p - near.point)};
    if (corner.distance > found_.lower || found_.nearest == kNone) {
      found_.lower = corner.distance;
      found_.farthest = p;
      found_.nearest = near.triangle;
    }
    return corner;
  }

  // Over the part, by the triangle nearest to one of its corners or to its centre, and by its size.
  double bound(const std::array<Corner, 3>& part) const {
    double square = 0, farthest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      square = std::max(square, norm2(part[(k + 1) % 3].point - part[k].point));
      farthest = std::max(farthest, part[k].distance);
    }
    double least = farthest + kCover * std::sqrt(square);
    const auto try_triangle = [&](Index triangle) {
      double most = 0;
      for (const Corner& corner : part) most = std::max(most, target_.distance_to(triangle, corner.point));
      least = std::min(least, most);
    };
    for (const Corner& corner : part)
      if (least > accepted()) try_triangle(corner.near.triangle);
    if (least <= accepted()) return least;
    const Vec3 centre = (1.0 / 3) * (part[0].point + part[1].point + part[2].point);
    try_triangle(target_.nearest(centre, part[0].near).triangle);
    return least;
  }

  // An upper bound that needs no better one.
  double accepted() const { return std::max(enough_, found_.lower + gap_); }

  void divide(const std::array<Corner, 3>& part) {
    const double most = bound(part);
    if (most <= accepted()) {
      found_.upper = std::max({found_.upper, found_.lower, most});
      return;
    }
    std::size_t longest = 0;
    double square = -1;
    for (std::size_t k = 0; k < 3; ++k)
      if (const double s = norm2(part[(k + 1) % 3].point - part[k].point); s > square) {
        square = s;
        longest = k;
      }
    const Corner &a = part[longest], &b = part[(longest + 1) % 3], &c = part[(longest + 2) % 3];
    const Vec3 middle = 0.5 * (a.point + b.point);
    const Corner m = corner_at(middle, target_.nearest(middle, a.near));
    divide({a, m, c});
    divide({m, b, c});
  }

  const Target& target_;
  double enough_, gap_;
  TriangleDistance found_;
};

double size_of(const TriangleMesh& mesh) {
  const Box box = bounding_box(mesh);
  return std::max(norm(box.lo), norm(box.hi)) + box.diagonal();
}

// The largest distance of a corner.
double corner_distance(const TriangleMesh& from, const Target& to) {
  const std::vector<char> used = mark_used_vertices(from.triangles, from.vertices.size());
  std::vector<double> distances(used.size(), 0);
  parallel_each(used.size(), [&](std::size_t v) {
    if (used[v]) distances[v] = norm(from.vertices[v] - to.nearest(from.vertices[v]).point);
  });
  return distances.empty() ? 0 : *std::max_element(distances.begin(), distances.end());
}

std::vector<TriangleDistance> bound_all(const TriangleMesh& from, const Target& to, double enough, double gap,
                                        double rounding, const Context& context) {
  std::vector<TriangleDistance> found(from.triangles.size());
  parallel_each(
      found.size(),
      [&](std::size_t t) {
        context.check();
        const auto [a, b, c] = from.triangles[t];
        found[t] = Divider(to, enough, gap).run({from.vertices[a], from.vertices[b], from.vertices[c]});
        found[t].upper += rounding;
      },
      kGrain);
  return found;
}

// The least gap that rounding leaves, or the one asked for.
double gap_of(double gap, double rounding) {
  if (!(gap > 0)) throw Error(fmt::format("distance: the gap {:g} between bounds must be positive; correct it", gap));
  return std::max(gap, rounding);
}

}  // namespace

std::vector<TriangleDistance> bound_distances(const TriangleMesh& from, const TriangleMesh& to, double enough,
                                              double gap, const Context& context) {
  check_coordinates(from);
  check_coordinates(to);
  const double rounding = kRounding * std::max(size_of(from), size_of(to));
  return bound_all(from, Target(to), enough, gap_of(gap, rounding), rounding, context);
}

// Parts that are no farther off than some corner is need no closer look.
HausdorffBounds bound_hausdorff_distance(const TriangleMesh& mesh, const TriangleMesh& reference, double gap,
                                         const Context& context) {
  check_coordinates(mesh);
  check_coordinates(reference);
  const double rounding = kRounding * std::max(size_of(mesh), size_of(reference));
  gap = gap_of(gap, rounding);
  const Target ours(mesh), theirs(reference);
  HausdorffBounds bounds;
  bounds.lower = std::max(corner_distance(mesh, theirs), corner_distance(reference, ours));
  for (const bool back : {false, true})
    for (const TriangleDistance& found :
         bound_all(back ? reference : mesh, back ? ours : theirs, bounds.lower + gap, gap, rounding, context)) {
      bounds.lower = std::max(bounds.lower, found.lower);
      bounds.upper = std::max(bounds.upper, found.upper);
    }
  return bounds;
}

}  // namespace bisector
