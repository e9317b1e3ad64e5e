#include "job/region_json.h"

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "core/geometry.h"

namespace bisector::job {
namespace {

void add_parameters(Json& json, const Plane& plane) {
  const Vec3 foot = plane.offset * plane.normal;  // of the origin
  json["normal"] = point_json(plane.normal);
  json["offset"] = dot(plane.normal, foot);
}

void add_parameters(Json& json, const Sphere& sphere) {
  json["centre"] = point_json(sphere.centre);
  json["radius"] = sphere.radius;
}

void add_parameters(Json& json, const Cylinder& cylinder) {
  json["centre"] = point_json(cylinder.point);
  json["axis"] = point_json(cylinder.axis);
  json["radius"] = cylinder.radius;
}

void add_parameters(Json& json, const Cone& cone) {
  json["centre"] = point_json(cone.apex);
  json["axis"] = point_json(cone.axis);
  json["angle"] = kDegreesPerRadian * cone.angle;
}

void add_parameters(Json& json, const Torus& torus) {
  json["centre"] = point_json(torus.centre);
  json["axis"] = point_json(torus.axis);
  json["radius"] = torus.radius;
  json["minor_radius"] = torus.minor_radius;
}

void add_parameters(Json& json, const GeneralQuadric& quadric) {
  json["centre"] = point_json(quadric.centre);
  json["axes"] = {point_json(quadric.axes[0]), point_json(quadric.axes[1]), point_json(quadric.axes[2])};
  json["lengths"] = quadric.lengths;
}

}  // namespace

Json region_json(const SegmentRegion& region) {
  Json json{{"type", name_of(type_of(region.proxy))},
            {"triangles", region.triangles},
            {"area", region.area},
            {"rms", region.rms},
            {"max", region.max}};
  const std::optional<Quadric> quadric = quadric_of(region.proxy);
  json["coefficients"] = quadric ? Json(quadric->c) : Json(nullptr);
  std::visit([&](const auto& surface) { add_parameters(json, surface); }, region.proxy);
  return json;
}

namespace {

Json points_json(const std::vector<Index>& vertices, const TriangleMesh& mesh) {
  Json points = Json::array();
  for (const Index v : vertices) points.push_back(point_json(mesh.vertices[v]));
  return points;
}

Json index_json(Index region) { return region == kNone ? Json(nullptr) : Json(region); }

Json loop_json(const BorderLoop& loop, const TriangleMesh& mesh) {
  Json json{{"length", loop.length}, {"chains", Json::array()}};
  for (const ChainUse& use : loop.chains) json["chains"].push_back({{"chain", use.chain}, {"reversed", use.reversed}});
  json["vertices"] = loop.vertices;
  json["points"] = points_json(loop.vertices, mesh);
  return json;
}

Json chain_json(const BorderChain& chain, const TriangleMesh& mesh) {
  Json json{{"left", index_json(chain.left)},
            {"right", index_json(chain.right)},
            {"kind", name_of(chain.kind)},
            {"closed", chain.closed},
            {"length", chain.length}};
  if (chain.right != kNone) {
    json["surface_angle"] = chain.surface_angle;
    json["mesh_angle"] = chain.mesh_angle;
  }
  json["vertices"] = chain.vertices;
  json["points"] = points_json(chain.vertices, mesh);
  return json;
}

// Each pair of regions that meet, with the means over the chains between them.
Json adjacency_json(const RegionBorders& borders) {
  struct Meeting {
    std::vector<std::size_t> chains;
    double length = 0, surfaces = 0, triangles = 0;
  };
  std::map<std::array<Index, 2>, Meeting> meetings;
  for (std::size_t k = 0; k < borders.chains.size(); ++k) {
    const BorderChain& chain = borders.chains[k];
    if (chain.right == kNone) continue;
    Meeting& meeting = meetings[{chain.left, chain.right}];
    meeting.chains.push_back(k);
    meeting.length += chain.length;
    meeting.surfaces += chain.length * chain.surface_angle;
    meeting.triangles += chain.length * chain.mesh_angle;
  }
  Json json = Json::array();
  for (const auto& [regions, meeting] : meetings) {
    const double surfaces = meeting.length > 0 ? meeting.surfaces / meeting.length : 0;
    json.push_back({{"regions", regions},
                    {"kind", name_of(std::abs(surfaces) <= kTangentAngle ? ChainKind::tangent : ChainKind::sharp)},
                    {"length", meeting.length},
                    {"surface_angle", surfaces},
                    {"mesh_angle", meeting.length > 0 ? meeting.triangles / meeting.length : 0},
                    {"chains", meeting.chains}});
  }
  return json;
}

}  // namespace

Json trims_json(const std::string& input, const TriangleMesh& mesh, const SegmentResult& segmentation,
                const RegionBorders& borders) {
  Json json = start_report("segment");
  json["input"] = input;
  json["diagonal"] = bounding_box(mesh).diagonal();
  json["rms"] = segmentation.rms;
  json["regions"] = Json::array();
  for (std::size_t r = 0; r < segmentation.regions.size(); ++r) {
    const RegionOutline& outline = borders.regions[r];
    Json region = region_json(segmentation.regions[r]);
    region["same_sense"] = outline.same_sense;
    region["euler"] = outline.euler;
    region["has_outer"] = outline.has_outer;
    region["loops"] = Json::array();
    for (const BorderLoop& loop : outline.loops) region["loops"].push_back(loop_json(loop, mesh));
    json["regions"].push_back(std::move(region));
  }
  json["chains"] = Json::array();
  for (const BorderChain& chain : borders.chains) json["chains"].push_back(chain_json(chain, mesh));
  json["adjacency"] = adjacency_json(borders);
  return json;
}

}  // namespace bisector::job
