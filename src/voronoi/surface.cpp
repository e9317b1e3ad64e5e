#include "voronoi/surface.h"

#include <algorithm>
#include <string>

#include "bisector/error.h"
#include "core/parallel.h"
#include "spatial/hilbert.h"
#include "voronoi/exact.h"

namespace bisector {

// The normal as rounded products where these are far from cancelling, else from its exact value.
Vec3 facet_normal(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a;
  Vec3 n = cross(u, v);
  const double largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  const double scale = norm(u) * norm(v);
  if (!(largest > 0.1 * scale)) n = exact_normal(a, b, c);
  const double m = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  if (m == 0) return {};
  n = {n.x / m, n.y / m, n.z / m};
  const double length = norm(n);
  return {n.x / length, n.y / length, n.z / length};
}

Surface::Surface(TriangleMesh given, std::vector<double> given_density)
    : mesh(std::move(given)), density(std::move(given_density)) {
  if (!density.empty() && density.size() != mesh.vertices.size())
    throw Error("density has " + std::to_string(density.size()) + " values for " +
                std::to_string(mesh.vertices.size()) + " vertices; give one per vertex");
  for (std::size_t v = 0; v < density.size(); ++v)
    if (!(density[v] > 0 && density[v] < 1e100))
      throw Error("density at vertex " + std::to_string(v) + " is not positive and finite; correct it");

  std::vector<Vec3> normals(mesh.triangles.size());
  parallel_each(normals.size(), [&](std::size_t t) {
    const Triangle& v = mesh.triangles[t];
    normals[t] = facet_normal(mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]);
  });
  std::vector<Vec3> centres;
  std::vector<Index> kept;
  std::vector<char> used(mesh.vertices.size(), 0);
  for (Index t = 0; t < mesh.triangles.size(); ++t) {
    if (normals[t] == Vec3{}) continue;
    const Triangle& v = mesh.triangles[t];
    centres.push_back(mesh.vertices[v[0]] + mesh.vertices[v[1]] + mesh.vertices[v[2]]);
    kept.push_back(t);
    for (Index corner : v) used[corner] = 1;
  }
  if (kept.empty()) throw Error("the mesh has no triangle with area; there is nothing to mesh");

  std::vector<Vec3> points;
  std::vector<Index> of_point;
  for (Index v = 0; v < used.size(); ++v)
    if (used[v]) {
      points.push_back(mesh.vertices[v]);
      of_point.push_back(v);
    }
  box = bounding_box(points);
  std::vector<Index> place_of(mesh.vertices.size(), kNone);
  for (Index k : hilbert_order(points)) {
    place_of[of_point[k]] = static_cast<Index>(used_vertices.size());
    used_vertices.push_back(of_point[k]);
  }

  facet_of.assign(mesh.triangles.size(), kNone);
  const std::vector<Index> order = hilbert_order(centres);
  facets.resize(order.size());
  summaries.resize(order.size());
  if (!density.empty()) densities.resize(order.size());
  parallel_each(order.size(), [&](std::size_t place) {
    const Index t = kept[order[place]];
    const Triangle& v = mesh.triangles[t];
    Facet& f = facets[place];
    FacetSummary& summary = summaries[place];
    summary.triangle = t;
    f.normal = normals[t];
    std::array<std::array<Index, 3>, 3> edges;
    for (unsigned char m = 0; m < 3; ++m) {
      f.corners[m] = mesh.vertices[v[m]];
      summary.vertex[m] = place_of[v[m]];
      const unsigned char next = static_cast<unsigned char>((m + 1) % 3);
      f.origin[m] = v[m] < v[next] ? m : next;
      edges[m] = {std::min(v[m], v[next]), std::max(v[m], v[next]), m};
    }
    const double twice_area = dot(f.normal, cross(f.corners[1] - f.corners[0], f.corners[2] - f.corners[0]));
    double at[3] = {1, 1, 1};
    if (!density.empty()) {
      FacetDensity& d = densities[place];
      for (int m = 0; m < 3; ++m) at[m] = d.at[m] = density[v[m]];
      // The area of a facet that is all but collinear may come out as nothing.
      if (twice_area != 0)
        d.gradient = (1 / twice_area) * cross(f.normal, (at[1] - at[0]) * (f.corners[0] - f.corners[2]) +
                                                            (at[2] - at[0]) * (f.corners[1] - f.corners[0]));
    }
    f.anchor = static_cast<unsigned char>(std::min_element(v.begin(), v.end()) - v.begin());
    const Vec3 origin = summary.anchor = f.corners[f.anchor];
    summary.moments = triangle_moments(f.corners[0] - origin, f.corners[1] - origin, f.corners[2] - origin, at[0],
                                       at[1], at[2], 0.5 * twice_area);
    std::sort(edges.begin(), edges.end());
    for (unsigned char r = 0; r < 3; ++r) f.rank[edges[r][2]] = r;
    facet_of[t] = static_cast<Index>(place);
  });
  area = fixed_sum(facets.size(), [&](std::size_t k) {
    const Facet& f = facets[k];
    return 0.5 * dot(f.normal, cross(f.corners[1] - f.corners[0], f.corners[2] - f.corners[0]));
  });
  mass = fixed_sum(facets.size(), [&](std::size_t k) { return summaries[k].moments.mass; });
}

SurfacePart part_of(const Surface& whole, std::vector<Index> triangles) {
  SurfacePart part;
  std::vector<Index> vertex(whole.mesh.vertices.size(), kNone);
  for (const Index t : triangles)
    for (const Index v : whole.mesh.triangles[t]) vertex[v] = 0;
  for (std::size_t v = 0; v < vertex.size(); ++v) {
    if (vertex[v] == kNone) continue;
    vertex[v] = static_cast<Index>(part.mesh.vertices.size());
    part.mesh.vertices.push_back(whole.mesh.vertices[v]);
    if (!whole.density.empty()) part.density.push_back(whole.density[v]);
  }
  for (const Index t : triangles) {
    const auto& [a, b, c] = whole.mesh.triangles[t];
    part.mesh.triangles.push_back({vertex[a], vertex[b], vertex[c]});
  }
  part.triangle = std::move(triangles);
  return part;
}

}  // namespace bisector
