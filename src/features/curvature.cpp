#include "features/curvature.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "mesh/half_edges.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

constexpr double kLargestGrowth = 1.5;  // of the radius, by the least one asked for
constexpr double kFlat = 1e-10;         // area by squared longest edge below which a triangle has no normal of its own

// A mesh as the walk over it reads it; half-edge 3 t + k runs from corner k of triangle t to the next.
struct Walk {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<Vec3> normals;  // unit; of flat triangles that of a neighbour
  std::vector<double> areas;
  std::vector<Index> across;  // triangle beyond each half-edge, or kNone where the walk ends
  std::vector<char> turned;   // the triangle beyond runs along the half-edge in the same direction
  std::vector<double> bend;   // signed angle between the normals, positive where convex, by squared length
};

Vec3 corner(const Walk& walk, std::size_t half_edge) {
  return walk.points[walk.triangles[half_edge / 3][half_edge % 3]];
}

// Flat triangles take the normal of the neighbour through which they are reached first.
void lend_normals(Walk& walk, const std::vector<char>& flat) {
  std::vector<Index> queue;
  for (Index t = 0; t < walk.triangles.size(); ++t)
    if (!flat[t]) queue.push_back(t);
  std::vector<char> done(flat.size());
  for (std::size_t t = 0; t < flat.size(); ++t) done[t] = !flat[t];
  for (std::size_t i = 0; i < queue.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const std::size_t h = 3 * std::size_t{queue[i]} + k;
      const Index other = walk.across[h];
      if (other == kNone || done[other]) continue;
      done[other] = 1;
      walk.normals[other] = walk.turned[h] ? -walk.normals[queue[i]] : walk.normals[queue[i]];
      queue.push_back(other);
    }
}

Walk prepare(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& sharp, double scale) {
  Walk walk;
  walk.triangles = mesh.triangles;
  walk.points.resize(mesh.vertices.size());
  parallel_each(walk.points.size(), [&](std::size_t v) { walk.points[v] = scale * mesh.vertices[v]; });
  const std::size_t n = mesh.triangles.size();
  walk.normals.resize(n);
  walk.areas.resize(n);
  std::vector<char> flat(n);
  parallel_each(n, [&](std::size_t t) {
    const Vec3 a = corner(walk, 3 * t), b = corner(walk, 3 * t + 1), c = corner(walk, 3 * t + 2);
    walk.areas[t] = triangle_area(a, b, c);
    flat[t] = !(walk.areas[t] > kFlat * std::max({norm2(b - a), norm2(c - b), norm2(a - c)}));
    if (flat[t]) return;
    const Vec3 normal = twice_area_normal(a, b, c);
    walk.normals[t] = (1 / norm(normal)) * normal;
  });

  walk.across.assign(3 * n, kNone);
  walk.turned.assign(3 * n, 0);
  const EdgeTable table = edge_table(mesh.triangles, mesh.vertices.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const auto [a, b] = table.edges[e];
    if (table.half_edges.size(e) != 2 || a == b) continue;
    if (std::binary_search(sharp.begin(), sharp.end(), table.edges[e])) continue;
    const std::size_t g = table.half_edges.begin(e)[0], h = table.half_edges.begin(e)[1];
    walk.across[g] = static_cast<Index>(h / 3);
    walk.across[h] = static_cast<Index>(g / 3);
    walk.turned[g] = walk.turned[h] = mesh.triangles[g / 3][g % 3] == mesh.triangles[h / 3][h % 3];
  }
  lend_normals(walk, flat);
  walk.bend.assign(3 * n, 0);
  parallel_each(3 * n, [&](std::size_t h) {
    if (walk.across[h] == kNone) return;
    const Vec3 direction = corner(walk, next_half_edge(h)) - corner(walk, h);
    const double length = norm(direction);
    if (!(length > 0)) return;
    const Vec3 &m = walk.normals[h / 3], other = walk.normals[walk.across[h]];
    const Vec3 n2 = walk.turned[h] ? -other : other;
    walk.bend[h] = std::atan2(dot(direction, cross(m, n2)) / length, dot(m, n2)) / (length * length);
  });
  return walk;
}

// The window r^2 - |p|^2 over the ball of radius r about the origin makes a tensor that hardly shows which edges the
// ball's border happens to cut. Its integral over a segment:
double window_on_segment(const Vec3& a, const Vec3& b, double squared_radius) {
  const Vec3 d = b - a;
  const double aa = norm2(a), bb = norm2(b), dd = norm2(d);
  if (aa <= squared_radius && bb <= squared_radius) return (squared_radius - (aa + bb + dot(a, b)) / 3) * std::sqrt(dd);
  const double ad = dot(a, d), root = ad * ad - dd * (aa - squared_radius);
  if (!(root > 0)) return 0;
  const double from = std::max(0.0, (-ad - std::sqrt(root)) / dd), to = std::min(1.0, (-ad + std::sqrt(root)) / dd);
  if (!(from < to)) return 0;
  const Vec3 p = a + from * d, q = a + to * d;
  return (squared_radius - (norm2(p) + norm2(q) + dot(p, q)) / 3) * (to - from) * std::sqrt(dd);
}

struct Vec2 {
  double x, y;
};

double dot(const Vec2& a, const Vec2& b) { return a.x * b.x + a.y * b.y; }
double cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }

// Over what a disk about the origin has in common with the triangle of the origin, a and b, signed.
double window_on_wedge(const Vec2& a, const Vec2& b, double disk) {
  const auto sector = [&](const Vec2& p, const Vec2& q) {
    return 0.25 * disk * disk * std::atan2(cross(p, q), dot(p, q));
  };
  const Vec2 d{b.x - a.x, b.y - a.y};
  const double dd = dot(d, d), ad = dot(a, d);
  if (!(dd > 0)) return 0;
  const double root = ad * ad - dd * (dot(a, a) - disk);
  if (!(root > 0)) return sector(a, b);
  const double from = std::clamp((-ad - std::sqrt(root)) / dd, 0.0, 1.0);
  const double to = std::clamp((-ad + std::sqrt(root)) / dd, 0.0, 1.0);
  if (!(from < to)) return sector(a, b);
  const Vec2 p{a.x + from * d.x, a.y + from * d.y}, q{a.x + to * d.x, a.y + to * d.y};
  double sum = 0.5 * cross(p, q) * (disk - (dot(p, p) + dot(q, q) + dot(p, q)) / 6);
  if (from > 0) sum += sector(a, p);
  if (to < 1) sum += sector(q, b);
  return sum;
}

// Over a triangle given relative to the ball's centre.
double window_on_triangle(const std::array<Vec3, 3>& p, const Vec3& normal, double area, double squared_radius) {
  if (!(area > 0)) return 0;
  if (norm2(p[0]) <= squared_radius && norm2(p[1]) <= squared_radius && norm2(p[2]) <= squared_radius)
    return area * (squared_radius - (norm2(p[0] + p[1]) + norm2(p[1] + p[2]) + norm2(p[2] + p[0])) / 12);
  const double height = dot(p[0], normal), disk = squared_radius - height * height;
  if (!(disk > 0)) return 0;
  const Vec3 edge = p[1] - p[0];
  const Vec3 u = (1 / norm(edge)) * edge, w = cross(normal, u);
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = p[k], &b = p[(k + 1) % 3];
    sum += window_on_wedge({dot(a, u), dot(a, w)}, {dot(b, u), dot(b, w)}, disk);
  }
  return std::clamp(sum, 0.0, area * squared_radius);
}

struct Curvature {
  double min = 0, max = 0;
  Vec3 min_direction, max_direction;
};

// The measure's tensor has the curvature across a direction as its value along it.
Curvature decompose(const Vec3& normal, const std::array<double, 6>& t) {
  const Vec3 u = perpendicular(normal), w = cross(normal, u);
  const auto product = [&](const Vec3& a, const Vec3& b) {
    return a.x * (t[0] * b.x + t[1] * b.y + t[2] * b.z) + a.y * (t[1] * b.x + t[3] * b.y + t[4] * b.z) +
           a.z * (t[2] * b.x + t[4] * b.y + t[5] * b.z);
  };
  const double uu = product(u, u), uw = product(u, w), ww = product(w, w);
  const double mean = 0.5 * (uu + ww), radius = std::hypot(0.5 * (uu - ww), uw);
  const double angle = 0.5 * std::atan2(2 * uw, uu - ww);
  Curvature c;
  c.min = mean - radius;
  c.max = mean + radius;
  c.min_direction = std::cos(angle) * u + std::sin(angle) * w;
  c.max_direction = cross(normal, c.min_direction);
  return c;
}

struct Visited {
  std::vector<Index> stamp;  // of each triangle
  Index current = 0;
  std::vector<std::pair<Index, double>> sector;  // triangles and their orientation relative to the first, +-1
};

// Curvature of the part of the surface around a vertex that can be walked to from one of its triangles.
Curvature measure_sector(const Walk& walk, const Vec3& centre, Index start, double radius, Visited& visited) {
  const double squared_radius = radius * radius;
  visited.sector.assign(1, {start, 1.0});
  visited.stamp[start] = visited.current;
  std::array<double, 6> tensor{};
  Vec3 normal;
  double mass = 0;
  for (std::size_t i = 0; i < visited.sector.size(); ++i) {
    const auto [t, sign] = visited.sector[i];
    const std::size_t first = 3 * std::size_t{t};
    const std::array<Vec3, 3> p{corner(walk, first) - centre, corner(walk, first + 1) - centre,
                                corner(walk, first + 2) - centre};
    const double inside = window_on_triangle(p, walk.normals[t], walk.areas[t], squared_radius);
    mass += inside;
    normal += sign * inside * walk.normals[t];
    for (int k = 0; k < 3; ++k) {
      const std::size_t h = first + k;
      const Index other = walk.across[h];
      if (other == kNone) continue;
      const Vec3 edge = p[(k + 1) % 3] - p[k];
      const double length = window_on_segment(p[k], p[(k + 1) % 3], squared_radius);
      // Points of no extent join flat triangles to what lies beyond them.
      if (!(length > 0) && !(norm2(edge) == 0 && norm2(p[k]) < squared_radius)) continue;
      if (visited.stamp[other] != visited.current) {
        visited.stamp[other] = visited.current;
        visited.sector.emplace_back(other, walk.turned[h] ? -sign : sign);
      }
      if (!(length > 0)) continue;
      // Either side contributes one half.
      const double weight = 0.5 * sign * walk.bend[h] * length;
      tensor[0] += weight * edge.x * edge.x;
      tensor[1] += weight * edge.x * edge.y;
      tensor[2] += weight * edge.x * edge.z;
      tensor[3] += weight * edge.y * edge.y;
      tensor[4] += weight * edge.y * edge.z;
      tensor[5] += weight * edge.z * edge.z;
    }
  }
  const double length = norm(normal);
  if (!(mass > 0) || !(length > 0)) return {};
  for (double& x : tensor) x /= mass;
  return decompose((1 / length) * normal, tensor);
}

double magnitude_of(double min, double max) { return std::max(std::abs(min), std::abs(max)); }

}  // namespace

double PrincipalCurvatures::magnitude(std::size_t vertex) const { return magnitude_of(min[vertex], max[vertex]); }

PrincipalCurvatures principal_curvatures(const TriangleMesh& mesh, const std::vector<std::array<Index, 2>>& sharp,
                                         double radius, double least) {
  const std::size_t n = mesh.vertices.size();
  PrincipalCurvatures result;
  result.min.assign(n, 0);
  result.max.assign(n, 0);
  result.min_direction.assign(n, {});
  result.max_direction.assign(n, {});
  const double diagonal = bounding_box(mesh).diagonal();
  if (!(diagonal > 0)) return result;
  int exponent = 0;
  std::frexp(diagonal, &exponent);
  const double scale = std::ldexp(1.0, -exponent);  // so that squares of areas stay in range
  std::vector<std::array<Index, 2>> barred = sharp;
  std::sort(barred.begin(), barred.end());
  const Walk walk = prepare(mesh, barred, scale);

  const Csr<Index> around = items_at_vertices<Index>(mesh.triangles, n);
  ThreadLocal<Visited> visits;
  parallel_each(
      n,
      [&](std::size_t v) {
        double area = 0;
        std::size_t count = 0;
        for (const Index* t = around.begin(v); t != around.end(v); ++t)
          if (walk.areas[*t] > 0) {
            area += walk.areas[*t];
            ++count;
          }
        if (count == 0) return;
        const double edge = std::sqrt(4 / std::sqrt(3.0) * area / static_cast<double>(count));
        const double reach = std::clamp(scale * least, radius * edge, kLargestGrowth * radius * edge);
        Visited& visited = visits.local();
        visited.stamp.resize(mesh.triangles.size(), 0);
        ++visited.current;
        bool first = true;
        for (const Index* t = around.begin(v); t != around.end(v); ++t) {
          if (visited.stamp[*t] == visited.current) continue;
          const Curvature c = measure_sector(walk, walk.points[v], *t, reach, visited);
          if (!first && !(magnitude_of(c.min, c.max) > magnitude_of(result.min[v], result.max[v]))) continue;
          first = false;
          result.min[v] = c.min;
          result.max[v] = c.max;
          result.min_direction[v] = c.min_direction;
          result.max_direction[v] = c.max_direction;
        }
        result.min[v] *= scale;
        result.max[v] *= scale;
      },
      64);
  return result;
}

}  // namespace bisector
