#include "voronoi/polygons.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/append_range.h"

namespace bisector {

void append_polygon(const Clipper& clipper, const SortedSeeds& seeds, Index triangle, Index slot,
                    RestrictedPolygons& out) {
  out.pairs.push_back({triangle, seeds.id[slot]});
  const std::size_t size = clipper.size(), begin = out.labels.size();
  out.labels.resize(begin + size);
  out.vertices.resize(begin + size);
  for (std::size_t e = 0, k = clipper.first_corner(); e < size; ++e, k = k + 1 == size ? 0 : k + 1) {
    const Index label = clipper.label(k);
    out.labels[begin + e] = is_edge(label) ? label : seeds.id[label];
    out.vertices[begin + e] = seeds.x[slot] + clipper.vertex(k);
  }
  out.offsets.push_back(begin + size);
}

void append_labels(const Facet& facet, const SortedSeeds& seeds, Index triangle, Index slot,
                   std::span<const Index> labels, RestrictedPolygons& out) {
  const auto key = [&](Index label) {
    return is_edge(label) ? std::uint64_t{facet.rank[label & ~kEdgeLabel]} : std::uint64_t{3} + seeds.id[label];
  };
  const auto first = std::min_element(labels.begin(), labels.end(), [&](Index a, Index b) { return key(a) < key(b); });
  const auto put = [&](auto begin, auto end) {
    for (; begin != end; ++begin) out.labels.push_back(is_edge(*begin) ? *begin : seeds.id[*begin]);
  };
  out.pairs.push_back({triangle, seeds.id[slot]});
  put(first, labels.end());
  put(labels.begin(), first);
  out.offsets.push_back(out.labels.size());
}

std::vector<std::size_t> first_polygons(const RestrictedPolygons& polygons, std::size_t triangles) {
  std::vector<std::size_t> begin(triangles + 1, 0);
  for (const auto& pair : polygons.pairs) ++begin[pair.triangle + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  return begin;
}

void append_polygons(const RestrictedPolygons& from, std::size_t begin, std::size_t end, RestrictedPolygons& out) {
  if (out.offsets.empty()) out.offsets.push_back(0);
  if (begin == end) return;
  append_range(out.pairs, from.pairs, begin, end);
  const std::size_t first = from.offsets[begin], last = from.offsets[end], before = out.labels.size();
  for (std::size_t p = begin; p < end; ++p) out.offsets.push_back(before + from.offsets[p + 1] - first);
  append_range(out.labels, from.labels, first, last);
  if (!from.vertices.empty()) append_range(out.vertices, from.vertices, first, last);
}

double polygon_area(const RestrictedPolygons& polygons, std::size_t polygon) {
  const std::size_t first = polygons.offsets[polygon], end = polygons.offsets[polygon + 1];
  const Vec3& apex = polygons.vertices[first];
  Vec3 sum;
  for (std::size_t e = first + 1; e + 1 < end; ++e)
    sum += cross(polygons.vertices[e] - apex, polygons.vertices[e + 1] - apex);
  return 0.5 * norm(sum);
}

Vec3 nearest_on_polygon(const RestrictedPolygons& polygons, std::size_t polygon, const Vec3& p) {
  const std::size_t first = polygons.offsets[polygon], end = polygons.offsets[polygon + 1];
  Vec3 nearest = polygons.vertices[first];
  for (std::size_t e = first + 1; e + 1 < end; ++e) {
    const Vec3 q = nearest_on_triangle(p, polygons.vertices[first], polygons.vertices[e], polygons.vertices[e + 1]);
    if (norm2(q - p) < norm2(nearest - p)) nearest = q;
  }
  return nearest;
}

}  // namespace bisector
