#include "bisector/region_borders.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bisector/error.h"
#include "bisector/repair.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "mesh/half_edges.h"
#include "mesh/joining.h"
#include "segment/border_loops.h"
#include "segment/surface_normal.h"

namespace bisector {
namespace {

constexpr double kFlatShare = 0.99;  // of the area that must face the same way as the mean

void check_labels(const TriangleMesh& mesh, const SegmentResult& segmentation) {
  if (segmentation.labels.size() != mesh.triangles.size())
    throw Error(fmt::format("the segmentation is of {} triangles, the mesh has {}; give the mesh that was segmented",
                            segmentation.labels.size(), mesh.triangles.size()));
  for (const Index label : segmentation.labels)
    if (label >= segmentation.regions.size())
      throw Error(
          fmt::format("a triangle is in region {}, but there are {} regions; give the segmentation as it was "
                      "returned",
                      label, segmentation.regions.size()));
}

class Measurer {
 public:
  Measurer(const std::vector<Vec3>& vertices, const SegmentResult& segmentation, FollowedBorders followed)
      : vertices_(vertices), segmentation_(segmentation), followed_(std::move(followed)), borders_(followed_.borders) {
    twice_normals_.reserve(borders_.triangles.size());
    for (const auto& [a, b, c] : borders_.triangles)
      twice_normals_.push_back(twice_area_normal(vertices[a], vertices[b], vertices[c]));
  }

  RegionBorders measured() {
    const std::size_t count = borders_.regions.size();
    const Csr<Index> triangles = items_of_labels<Index>(segmentation_.labels, count);
    for (std::size_t r = 0; r < count; ++r) borders_.regions[r].same_sense = find_sense(r, triangles);
    for (std::size_t k = 0; k < borders_.chains.size(); ++k) measure_chain(k);
    for (std::size_t r = 0; r < count; ++r) sort_loops(r, triangles);
    return std::move(borders_);
  }

 private:
  bool find_sense(std::size_t region, const Csr<Index>& triangles) const {
    const Primitive& surface = segmentation_.regions[region].proxy;
    double along = 0;
    for (const Index* t = triangles.begin(region); t != triangles.end(region); ++t) {
      const auto& [a, b, c] = borders_.triangles[*t];
      const Vec3 barycentre = (1.0 / 3) * (vertices_[a] + vertices_[b] + vertices_[c]);
      const Vec3 normal = surface_normal(surface, foot_point(surface, barycentre));
      along += std::copysign(norm(twice_normals_[*t]), dot(normal, twice_normals_[*t]));
    }
    return along >= 0;
  }

  // Of the surface near p, on the side that the region's triangles face.
  Vec3 facing_normal(Index region, const Vec3& p) const {
    const Primitive& surface = segmentation_.regions[region].proxy;
    const Vec3 normal = surface_normal(surface, foot_point(surface, p));
    return borders_.regions[region].same_sense ? normal : -normal;
  }

  // Between normals on the left and the right of an edge, in radians.
  static double angle_between(const Vec3& left, const Vec3& right, const Vec3& along) {
    return std::atan2(dot(cross(left, right), along), dot(left, right));
  }

  void measure_chain(std::size_t number) {
    BorderChain& chain = borders_.chains[number];
    double surfaces = 0, triangles = 0;
    for (const std::size_t h : followed_.half_edges[number]) {
      const Vec3& p = vertices_[origin(borders_.triangles, h)];
      const Vec3& q = vertices_[origin(borders_.triangles, next_half_edge(h))];
      const double length = norm(q - p);
      chain.length += length;
      if (chain.right == kNone) continue;
      const Vec3 along = unit(q - p);
      // At the vertices, for between them edges are off curved surfaces.
      for (const Vec3& end : {p, q})
        surfaces +=
            0.5 * length * angle_between(facing_normal(chain.left, end), facing_normal(chain.right, end), along);
      triangles += length * angle_between(twice_normals_[h / 3], twice_normals_[followed_.twins.twin[h] / 3], along);
    }
    if (chain.right == kNone || !(chain.length > 0)) return;
    chain.surface_angle = kDegreesPerRadian * surfaces / chain.length;
    chain.mesh_angle = kDegreesPerRadian * triangles / chain.length;
    if (std::abs(chain.surface_angle) <= kTangentAngle) chain.kind = ChainKind::tangent;
  }

  void sort_loops(std::size_t region, const Csr<Index>& triangles) {
    RegionOutline& outline = borders_.regions[region];
    for (BorderLoop& loop : outline.loops)
      for (const ChainUse& use : loop.chains) loop.length += borders_.chains[use.chain].length;
    std::stable_sort(outline.loops.begin(), outline.loops.end(),
                     [](const BorderLoop& a, const BorderLoop& b) { return a.length > b.length; });
    Vec3 mean;
    for (const Index* t = triangles.begin(region); t != triangles.end(region); ++t) mean += twice_normals_[*t];
    if (!is_flat(mean, region, triangles)) return;
    const auto point_of = [&](Index v) -> const Vec3& { return vertices_[v]; };
    const auto runs_around = [&](const BorderLoop& loop) {
      return dot(twice_vector_area(loop.vertices, point_of), mean) > 0;
    };
    if (std::count_if(outline.loops.begin(), outline.loops.end(), runs_around) != 1) return;
    const auto outer = std::find_if(outline.loops.begin(), outline.loops.end(), runs_around);
    std::rotate(outline.loops.begin(), outer, outer + 1);
    outline.has_outer = true;
  }

  bool is_flat(const Vec3& mean, std::size_t region, const Csr<Index>& triangles) const {
    double with = 0, against = 0;
    for (const Index* t = triangles.begin(region); t != triangles.end(region); ++t)
      (dot(twice_normals_[*t], mean) > 0 ? with : against) += norm(twice_normals_[*t]);
    return with >= kFlatShare * (with + against);
  }

  const std::vector<Vec3>& vertices_;
  const SegmentResult& segmentation_;
  FollowedBorders followed_;
  RegionBorders& borders_;
  std::vector<Vec3> twice_normals_;  // of the triangles, of twice their area's length
};

}  // namespace

const char* name_of(ChainKind kind) {
  switch (kind) {
    case ChainKind::sharp: return "sharp";
    case ChainKind::tangent: return "tangent";
    case ChainKind::border: return "border";
    case ChainKind::non_manifold: return "non_manifold";
  }
  return "";
}

RegionBorders region_borders(const TriangleMesh& mesh, const SegmentResult& segmentation) {
  check_labels(mesh, segmentation);
  std::vector<Triangle> triangles = join_equal_points(mesh);
  orient(triangles, mesh.vertices.size());
  FollowedBorders followed =
      follow_borders(triangles, mesh.vertices.size(), segmentation.labels, segmentation.regions.size());
  followed.borders.triangles = std::move(triangles);
  return Measurer(mesh.vertices, segmentation, std::move(followed)).measured();
}

}  // namespace bisector
