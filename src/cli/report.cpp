#include "report.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "bisector/core/error.h"
#include "bisector/core/parallel.h"
#include "bisector/mesh/io.h"

namespace bisector::cli {
namespace {

std::string dumped(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// Objects are spread over lines, and so are arrays of objects or arrays, one element a line: a report reads well, and
// the rows of a large one stay rows.
void append(std::string& out, const Json& value, std::size_t indent) {
  const bool rows = value.is_array() && !value.empty() && value.front().is_structured();
  if (!rows && (!value.is_object() || value.empty())) {
    out += dumped(value);
    return;
  }
  const std::string margin(indent + 2, ' ');
  const char* separator = "\n";
  out += rows ? '[' : '{';
  for (const auto& item : value.items()) {
    out += separator + margin;
    if (rows) {
      out += dumped(item.value());
    } else {
      out += dumped(Json(item.key())) + ": ";
      append(out, item.value(), indent + 2);
    }
    separator = ",\n";
  }
  out += '\n' + std::string(indent, ' ') + (rows ? ']' : '}');
}

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name"))
      if (const std::size_t begin = line.find_first_not_of(" \t:", 10); begin != std::string::npos)
        return line.substr(begin);
  return "CPU";
}

}  // namespace

Device cpu_device() {
  const long pages = sysconf(_SC_PHYS_PAGES), page_size = sysconf(_SC_PAGE_SIZE);
  const double memory = pages > 0 && page_size > 0 ? static_cast<double>(pages) * static_cast<double>(page_size) : 0;
  return {processor_name(), thread_count(), memory};
}

Json start_report(const char* command) { return {{"command", command}, {"version", BISECTOR_VERSION}}; }

Json device_json(const Device& device) { return {{"name", device.name}, {"kind", "cpu"}, {"precision", "double"}}; }

Json input_json(const TriangleMesh& mesh) {
  const std::size_t faces =
      mesh.face_of_triangle.empty() ? mesh.triangles.size() : std::size_t{mesh.face_of_triangle.back()} + 1;
  return {{"vertices", mesh.vertices.size()}, {"faces", faces}};
}

Json output_json(const TriangleMesh& mesh) {
  return {{"vertices", mesh.vertices.size()}, {"faces", mesh.triangles.size()}};
}

Json certification_json(const Certification& certification) {
  return {{"pairs", certification.pairs},
          {"uncertain", certification.uncertain},
          {"wider", certification.wider},
          {"double", 0},
          {"cpu", certification.uncertain}};
}

Json topology_json(const MeshTopology& topology) {
  return {{"manifold", topology.manifold},
          {"closed", topology.closed},
          {"oriented", topology.oriented},
          {"euler", topology.euler},
          {"components", topology.components},
          {"boundary_edges", topology.boundary_edges},
          {"non_manifold_edges", topology.non_manifold_edges},
          {"non_manifold_vertices", topology.non_manifold_vertices}};
}

Json quality_json(const QualityReport& quality) {
  return {{"q_min", quality.q_min},
          {"q_ave", quality.q_ave},
          {"theta_min", quality.theta_min},
          {"theta_min_ave", quality.theta_min_ave},
          {"theta_below_30", quality.theta_below_30},
          {"theta_max", quality.theta_max},
          {"valence6", quality.valence6},
          {"edge_min", quality.edge_min},
          {"edge_ave", quality.edge_ave},
          {"edge_max", quality.edge_max},
          {"area", quality.area},
          {"zero_area", quality.zero_area}};
}

void add_distance(Json& quality, const DistanceReport& distance) {
  quality["distance_mean"] = distance.mean;
  quality["distance_rms"] = distance.rms;
  quality["distance_max"] = distance.max;
  quality["distance_rms_to_reference"] = distance.rms_to_reference;
  quality["distance_rms_from_reference"] = distance.rms_from_reference;
}

Json point_json(const Vec3& p) {
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return nullptr;
  return Json::array({p.x, p.y, p.z});
}

void write_report(const std::string& path, const Json& report) {
  std::string text;
  append(text, report, 0);
  text += '\n';
  if (path != "-") return write_file(path, text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw Error("the report cannot be written to stdout; check where it is redirected to");
}

}  // namespace bisector::cli
