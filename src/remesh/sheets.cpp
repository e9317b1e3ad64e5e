#include "remesh/sheets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "backend/project.h"

namespace bisector {
namespace {

using Corners = std::array<Vec3, 3>;

// A component as triangles, with its area centroid.
struct Sheet {
  std::vector<Corners> triangles;
  std::vector<std::size_t> polygons;
  Vec3 centroid;
};

Sheet sheet_of(const Surface& surface, const RestrictedPolygons& diagram, const std::vector<std::size_t>& polygons) {
  Sheet sheet;
  sheet.polygons = polygons;
  double area = 0;
  Vec3 sum;
  for (const std::size_t p : polygons) {
    const Vec3& normal = surface.facets[surface.facet_of[diagram.pairs[p].triangle]].normal;
    const Vec3& apex = diagram.vertices[diagram.offsets[p]];
    for (std::size_t e = diagram.offsets[p] + 1; e + 1 < diagram.offsets[p + 1]; ++e) {
      const Vec3 &b = diagram.vertices[e], &c = diagram.vertices[e + 1];
      const double a = dot(normal, cross(b - apex, c - apex));
      area += a;
      sum += (a / 3) * (apex + b + c);
      sheet.triangles.push_back({apex, b, c});
    }
  }
  sheet.centroid = area > 0 ? (1 / area) * sum : sheet.triangles.front()[0];
  return sheet;
}

Vec3 nearest_on(const Sheet& sheet, const Vec3& p) {
  double best = std::numeric_limits<double>::infinity();
  Vec3 nearest;
  for (const auto& [a, b, c] : sheet.triangles) {
    const Vec3 q = nearest_on_triangle(p, a, b, c);
    if (const double d = norm2(q - p); d < best) {
      best = d;
      nearest = q;
    }
  }
  return nearest;
}

// Whether an edge of s passes through t.
bool pierces(const Corners& s, const Corners& t) {
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &p = s[k], &q = s[(k + 1) % 3];
    const double a = dot(n, p - t[0]), b = dot(n, q - t[0]);
    if (!((a < 0 && b > 0) || (a > 0 && b < 0))) continue;
    const Vec3 x = p + (a / (a - b)) * (q - p);
    if (dot(n, cross(t[1] - t[0], x - t[0])) >= 0 && dot(n, cross(t[2] - t[1], x - t[1])) >= 0 &&
        dot(n, cross(t[0] - t[2], x - t[2])) >= 0)
      return true;
  }
  return false;
}

// Whether two sheets cross, or a corner of one lies nearer to the other than the distance given.
bool touch(const Sheet& a, const Sheet& b, double distance) {
  const double squared = distance * distance;
  for (const Corners& s : a.triangles)
    for (const Corners& t : b.triangles) {
      if (pierces(s, t) || pierces(t, s)) return true;
      for (std::size_t k = 0; k < 3; ++k)
        if (norm2(nearest_on_triangle(s[k], t[0], t[1], t[2]) - s[k]) < squared ||
            norm2(nearest_on_triangle(t[k], s[0], s[1], s[2]) - t[k]) < squared)
          return true;
    }
  return false;
}

// The cells by triangle again in ascending order, after some have changed their index.
void sort_pairs(RestrictedPolygons& polygons) {
  std::vector<std::size_t> order(polygons.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto &x = polygons.pairs[a], &y = polygons.pairs[b];
    return x.triangle != y.triangle ? x.triangle < y.triangle : x.cell < y.cell;
  });
  RestrictedPolygons sorted;
  sorted.pairs.reserve(order.size());
  sorted.offsets.reserve(order.size() + 1);
  sorted.labels.reserve(polygons.labels.size());
  sorted.vertices.reserve(polygons.vertices.size());
  for (const std::size_t p : order) {
    sorted.pairs.push_back(polygons.pairs[p]);
    for (std::size_t e = polygons.offsets[p]; e < polygons.offsets[p + 1]; ++e) {
      sorted.labels.push_back(polygons.labels[e]);
      sorted.vertices.push_back(polygons.vertices[e]);
    }
    sorted.offsets.push_back(sorted.labels.size());
  }
  polygons = std::move(sorted);
}

}  // namespace

bool divide_cells(const Surface& surface, const BallReport& report, double gap, RestrictedPolygons& polygons,
                  std::vector<Vec3>& seeds) {
  const std::size_t given = seeds.size();
  std::vector<Index> renamed(polygons.pairs.size(), kNone);
  for (const BallReport::Cell& c : report.cells) {
    std::vector<Sheet> sheets;
    for (const auto& part : c.parts)
      if (!part.empty()) sheets.push_back(sheet_of(surface, polygons, part));
    if (sheets.size() < 2) continue;
    const Vec3 seed = seeds[c.seed];
    double radius2 = 0;
    for (const Sheet& s : sheets)
      for (const Corners& t : s.triangles)
        for (const Vec3& p : t) radius2 = std::max(radius2, norm2(p - seed));
    const auto nearer = [&](const Sheet& a, const Sheet& b) {
      return norm2(nearest_on(a, seed) - seed) < norm2(nearest_on(b, seed) - seed);
    };
    std::iter_swap(sheets.begin(), std::min_element(sheets.begin(), sheets.end(), nearer));
    bool divide = gap == std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < sheets.size(); ++a)
      for (std::size_t b = a + 1; b < sheets.size(); ++b)
        divide = divide || touch(sheets[a], sheets[b], gap * std::sqrt(radius2));
    if (!divide) continue;
    for (std::size_t k = 1; k < sheets.size(); ++k) {
      for (const std::size_t p : sheets[k].polygons) renamed[p] = static_cast<Index>(seeds.size());
      seeds.push_back(nearest_on(sheets[k], sheets[k].centroid));
    }
  }
  if (seeds.size() == given) return false;
  // A cell has one polygon on a triangle, so that its name is the same for all its neighbours there.
  for (std::size_t begin = 0, end = 0; begin < renamed.size(); begin = end) {
    while (end < renamed.size() && polygons.pairs[end].triangle == polygons.pairs[begin].triangle) ++end;
    for (std::size_t p = begin; p < end; ++p) {
      if (renamed[p] == kNone) continue;
      for (std::size_t e = polygons.offsets[begin]; e < polygons.offsets[end]; ++e)
        if (polygons.labels[e] == polygons.pairs[p].cell) polygons.labels[e] = renamed[p];
      polygons.pairs[p].cell = renamed[p];
    }
  }
  sort_pairs(polygons);
  return true;
}

}  // namespace bisector
