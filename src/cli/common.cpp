#include "common.h"

#include <fmt/format.h>

#include <algorithm>

#include "io/mesh_io.h"

namespace bisector::cli {
namespace {

void print_phases(Console& console, const char* title, const Json& seconds) {
  std::string line = fmt::format("{:<10}", title);
  for (const auto& [phase, value] : seconds.items()) line += fmt::format(" {} {:.3f} ", phase, value.get<double>());
  console.print(line);
}

}  // namespace

ComputeOptions compute_options(const ComputeWords& words) {
  return {words.device, parse_precision(words.precision),
          words.neighbours == "delaunay" ? NeighbourSource::delaunay : NeighbourSource::nearest};
}

Json seconds_json(const DiagramSeconds& seconds) {
  return {{"delaunay", seconds.delaunay},
          {"neighbors", seconds.neighbours},
          {"pairs", seconds.pairs},
          {"clip", seconds.clip}};
}

const char* yes_no(bool b) { return b ? "yes" : "no"; }

std::string size_of(const Json& mesh) {
  std::string size = counted(mesh["vertices"], "vertex", "vertices") + ", " + counted(mesh["faces"], "face", "faces");
  if (mesh.contains("tets")) size += ", " + counted(mesh["tets"], "tetrahedron", "tetrahedra");
  return size;
}

std::string describe(const MeshTopology& topology) {
  return fmt::format("{}, {}, {}, {}, Euler characteristic {}", topology.manifold ? "manifold" : "not manifold",
                     topology.closed ? "closed" : "open", topology.oriented ? "oriented" : "not oriented",
                     counted(topology.components, "component", "components"), topology.euler);
}

void print_seconds(Console& console, const Json& seconds, const Json& device_seconds) {
  print_phases(console, "seconds", seconds);
  if (!device_seconds.is_null()) print_phases(console, "on device", device_seconds);
}

void print_device(Console& console, const BackendDescription& device) {
  if (device.kind != "cpu")
    console.print(fmt::format("device     {}, {} precision", device.name, device.precision));
  else if (!device.fallback.empty())
    console.print(fmt::format("device     {}; {}", device.name, device.fallback));
}

std::vector<Vec3> read_seeds(const std::string& path, std::size_t count) {
  std::vector<Vec3> seeds = read_points(path);
  if (count != 0 && count != seeds.size())
    throw Error(fmt::format("{}: {} in the file, but -n asks for {}; leave -n out", path,
                            counted(seeds.size(), "seed", "seeds"), count));
  return seeds;
}

Json features_json(const FeatureResult& features, std::size_t edges) {
  const FeatureDistance& d = features.distance;
  return {{"curves", features.curves}, {"corners", features.corners}, {"broken", features.broken}, {"edges", edges},
          {"vertices", features.seeds}, {"distance_vertices", d.vertices}, {"distance_max", std::max(d.to_reference, d.from_reference)}};
}

}  // namespace bisector::cli
