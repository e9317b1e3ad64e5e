#include "step/trims.h"

#include <fmt/format.h>

#include <array>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bisector/error.h"
#include "segment/primitive.h"

namespace bisector::step {
namespace {

using Json = nlohmann::json;

Vec3 point_of(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

// A quadric's polynomial says everything, but the canonical form is kept as it was classified.
GeneralQuadric general_quadric_of(const Json& json, SurfaceType type) {
  GeneralQuadric quadric;
  quadric.type = type;
  quadric.polynomial.c = json.at("coefficients").get<std::array<double, 10>>();
  quadric.centre = point_of(json.at("centre"));
  for (std::size_t k = 0; k < 3; ++k) quadric.axes[k] = point_of(json.at("axes").at(k));
  quadric.lengths = json.at("lengths").get<std::array<double, 3>>();
  return quadric;
}

Primitive surface_of(const Json& json) {
  const auto type = json.at("type").get<std::string>();
  if (type == "plane") return make_plane(point_of(json.at("normal")), json.at("offset").get<double>());
  if (type == "sphere") return make_sphere(point_of(json.at("centre")), json.at("radius").get<double>());
  if (type == "cylinder")
    return make_cylinder(point_of(json.at("centre")), point_of(json.at("axis")), json.at("radius").get<double>());
  if (type == "cone")
    return make_cone(point_of(json.at("centre")), point_of(json.at("axis")),
                     kRadiansPerDegree * json.at("angle").get<double>());
  if (type == "torus")
    return make_torus(point_of(json.at("centre")), point_of(json.at("axis")), json.at("radius").get<double>(),
                      json.at("minor_radius").get<double>());
  for (int k = static_cast<int>(SurfaceType::ellipsoid); k <= static_cast<int>(SurfaceType::plane_pair); ++k)
    if (type == name_of(static_cast<SurfaceType>(k))) return general_quadric_of(json, static_cast<SurfaceType>(k));
  throw Error(fmt::format("surfaces of type '{}' are unknown", type));
}

Region region_of(const Json& json) {
  Region region;
  region.surface = surface_of(json);
  region.same_sense = json.at("same_sense").get<bool>();
  region.has_outer = json.at("has_outer").get<bool>();
  region.area = json.at("area").get<double>();
  region.rms = json.at("rms").get<double>();
  for (const Json& loop : json.at("loops")) {
    std::vector<Use>& uses = region.loops.emplace_back();
    for (const Json& use : loop.at("chains"))
      uses.push_back({use.at("chain").get<Index>(), use.at("reversed").get<bool>()});
  }
  return region;
}

Chain chain_of(const Json& json) {
  Chain chain;
  chain.vertices = json.at("vertices").get<std::vector<Index>>();
  for (const Json& point : json.at("points")) chain.points.push_back(point_of(point));
  chain.closed = json.at("closed").get<bool>();
  for (const char* side : {"left", "right"})
    if (!json.at(side).is_null()) chain.regions.push_back(json.at(side).get<Index>());
  if (chain.vertices.size() < 2 || chain.points.size() != chain.vertices.size())
    throw Error("a chain has fewer than two vertices, or other than one point for each");
  return chain;
}

void check_indices(const Trims& trims) {
  for (const Chain& chain : trims.chains)
    for (const Index region : chain.regions)
      if (region >= trims.regions.size()) throw Error(fmt::format("there is no region {}", region));
  for (const Region& region : trims.regions)
    for (const std::vector<Use>& loop : region.loops)
      for (const Use& use : loop)
        if (use.chain >= trims.chains.size()) throw Error(fmt::format("there is no chain {}", use.chain));
}

}  // namespace

Trims read_trims(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw Error(path + ": cannot be opened; check the name and its permissions");
  try {
    const Json json = Json::parse(file);
    Trims trims;
    trims.diagonal = json.at("diagonal").get<double>();
    for (const Json& region : json.at("regions")) trims.regions.push_back(region_of(region));
    for (const Json& chain : json.at("chains")) trims.chains.push_back(chain_of(chain));
    check_indices(trims);
    return trims;
  } catch (const std::exception& error) {
    throw Error(fmt::format("{}: {}; write the file with bisector segment --json", path, error.what()));
  }
}

}  // namespace bisector::step
