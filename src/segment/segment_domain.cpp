#include "segment/segment_domain.h"

#include <algorithm>

#include "bisector/error.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/joining.h"
#include "mesh/topology.h"

namespace bisector {

SegmentDomain make_segment_domain(const TriangleMesh& mesh) {
  SegmentDomain domain;
  std::vector<Vec3> used;
  used.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (const Index v : t) used.push_back(mesh.vertices[v]);
  const Box box = bounding_box(used);
  const Vec3 size = box.hi - box.lo;
  domain.scale = std::max({size.x, size.y, size.z});
  if (!(domain.scale > 0)) throw Error("the mesh has no area: all its vertices are at one point; check the export");
  domain.origin = box.lo + 0.5 * size;
  domain.vertices.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    domain.vertices[v] = (1 / domain.scale) * (mesh.vertices[v] - domain.origin);

  const std::size_t n = mesh.triangles.size();
  domain.triangles = join_equal_points(mesh);
  domain.graph = dual_graph(domain.triangles, mesh.vertices);
  orient(domain.triangles, domain.vertices.size());
  domain.normals.resize(n);
  domain.barycentres.resize(n);
  domain.areas.resize(n);
  domain.samples.resize(n);
  parallel_each(n, [&](std::size_t t) {
    const auto [a, b, c] = domain.triangles[t];
    const Vec3 &p = domain.vertices[a], &q = domain.vertices[b], &r = domain.vertices[c];
    const Vec3 twice = cross(q - p, r - p);
    const double length = norm(twice);
    domain.areas[t] = 0.5 * length;
    domain.normals[t] = length > 0 ? (1 / length) * twice : Vec3{};
    domain.barycentres[t] = (1.0 / 3) * (p + q + r);
    const Vec3& m = domain.barycentres[t];
    domain.samples[t] = {{p.x, q.x, r.x, m.x}, {p.y, q.y, r.y, m.y}, {p.z, q.z, r.z, m.z}, domain.areas[t]};
  });
  domain.area = fixed_sum(n, [&](std::size_t t) { return domain.areas[t]; });
  if (!(domain.area > 0)) throw Error("the mesh has no area: all its triangles are degenerate; check the export");
  domain.components = connected_parts(domain.graph);
  domain.component_count = 1 + *std::max_element(domain.components.begin(), domain.components.end());
  return domain;
}

}  // namespace bisector
