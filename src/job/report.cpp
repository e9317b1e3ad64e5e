#include "job/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "bisector/error.h"
#include "bisector/io.h"
#include "io/files.h"
#include "job/outputs.h"
#include "view/page.h"

namespace bisector::job {
namespace {

std::string dumped(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

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

std::string page_title(const Json& report, const view::Scene& scene) {
  std::string title = "bisector " + report["command"].get<std::string>();
  if (scene.models.empty()) return title;
  title += ": " + std::filesystem::path(scene.models.front().file).filename().string();
  return title;
}

}  // namespace

Json start_report(const char* command) {
  return {{"command", command}, {"version", BISECTOR_VERSION}, {"warnings", Json::array()}};
}

Json device_json(const BackendDescription& device) {
  Json json{{"name", device.name}, {"kind", device.kind}, {"precision", device.precision}};
  if (!device.fallback.empty()) json["fallback"] = device.fallback;
  return json;
}

Json device_seconds_json(const BackendDescription& device, const DeviceSeconds& seconds) {
  if ((device.kind == "cpu" && device.fallback.empty()) || device.kind == "ranks") return nullptr;
  return {{"transfer", seconds.transfer}, {"grid", seconds.grid},      {"neighbours", seconds.neighbours},
          {"owners", seconds.owners},     {"clip", seconds.clip},      {"sort", seconds.sort},
          {"sum", seconds.sum},           {"descent", seconds.descent}};
}

Json seconds_json(const DiagramSeconds& seconds) {
  return {{"delaunay", seconds.delaunay},
          {"neighbors", seconds.neighbours},
          {"pairs", seconds.pairs},
          {"clip", seconds.clip}};
}

void add_device(Json& report, const BackendDescription& device, const DeviceSeconds& seconds, const DeviceWork& work,
                int evaluations) {
  Json json = device_seconds_json(device, seconds);
  if (json.is_null()) return;
  report["device_seconds"] = std::move(json);
  const double n = std::max(evaluations, 1);
  report["device_work"] = {{"submits", static_cast<double>(work.submits) / n},
                           {"dispatches", static_cast<double>(work.dispatches) / n},
                           {"bytes_up", static_cast<double>(work.bytes_up) / n},
                           {"bytes_down", static_cast<double>(work.bytes_down) / n},
                           {"host_seconds", work.host_seconds / n}};
}

Json input_json(const TriangleMesh& mesh) {
  const std::size_t faces =
      mesh.face_of_triangle.empty() ? mesh.triangles.size() : std::size_t{mesh.face_of_triangle.back()} + 1;
  return {{"vertices", mesh.vertices.size()}, {"faces", faces}};
}

Json output_json(const TriangleMesh& mesh) {
  return {{"vertices", mesh.vertices.size()}, {"faces", mesh.triangles.size()}};
}

Json attributes_json(const std::vector<Attribute>& attributes) {
  Json list = Json::array();
  for (const Attribute& attribute : attributes)
    list.push_back({{"name", attribute.name},
                    {"of", attribute.site == Attribute::Site::vertex    ? "vertices"
                           : attribute.site == Attribute::Site::element ? "elements"
                                                                        : "corners"},
                    {"components", attribute.components}});
  return list;
}

Json size_json(const TetMesh& mesh) {
  return {{"vertices", mesh.vertices.size()}, {"faces", mesh.boundary.size()}, {"tets", mesh.tets.size()}};
}

Json certification_json(const Certification& certification) {
  return {{"pairs", certification.pairs},
          {"uncertain", certification.uncertain},
          {"wider", certification.wider},
          {"double", certification.doubled},
          {"cpu", certification.cpu}};
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
          {"q_min_free", quality.q_min_free},
          {"theta_min_free", quality.theta_min_free},
          {"theta_max_free", quality.theta_max_free},
          {"theta_below_30_free", quality.theta_below_30_free},
          {"valence6", quality.valence6},
          {"edge_min", quality.edge_min},
          {"edge_ave", quality.edge_ave},
          {"edge_max", quality.edge_max},
          {"area", quality.area},
          {"zero_area", quality.zero_area}};
}

void add_tets(Json& quality, const TetQualityReport& tets) {
  quality["dihedral_min"] = tets.dihedral_min;
  quality["dihedral_max"] = tets.dihedral_max;
  quality["dihedral_min_mean"] = tets.dihedral_min_mean;
  quality["dihedral_counts"] = tets.dihedral_counts;
  quality["radius_ratio_min"] = tets.radius_ratio_min;
  quality["radius_ratio_mean"] = tets.radius_ratio_mean;
  quality["volume"] = tets.volume;
  quality["volume_min"] = tets.volume_min;
  quality["inverted"] = tets.inverted;
  quality["zero_volume"] = tets.zero_volume;
  quality["tet_edge_min"] = tets.edge_min;
  quality["tet_edge_ave"] = tets.edge_ave;
  quality["tet_edge_max"] = tets.edge_max;
}

void add_tets(Json& topology, const TetTopology& tets) {
  topology["conforming"] = tets.conforming;
  topology["tet_components"] = tets.components;
  topology["overused_facets"] = tets.overused_facets;
  topology["misoriented_facets"] = tets.misoriented_facets;
  topology["repeated_vertices"] = tets.repeated_vertices;
  topology["unused_vertices"] = tets.unused_vertices;
}

void add_distance(Json& quality, const DistanceReport& distance) {
  quality["distance_mean"] = distance.mean;
  quality["distance_rms"] = distance.rms;
  quality["distance_max"] = distance.max;
  quality["distance_rms_to_reference"] = distance.rms_to_reference;
  quality["distance_rms_from_reference"] = distance.rms_from_reference;
}

Json detail_json(const DetailResult& detail, std::size_t curves) {
  return {{"width", detail.width},
          {"resolved", curves},
          {"merged", detail.merged},
          {"let_go", detail.let_go},
          {"vertices", detail.vertices}};
}

Json features_json(const FeatureResult& features, std::size_t edges) {
  const FeatureDistance& d = features.distance;
  return {{"curves", features.curves},
          {"corners", features.corners},
          {"broken", features.broken},
          {"edges", edges},
          {"vertices", features.seeds},
          {"distance_vertices", d.vertices},
          {"distance_max", std::max(d.to_reference, d.from_reference)}};
}

Json point_json(const Vec3& p) {
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return nullptr;
  return Json::array({p.x, p.y, p.z});
}

void add_seconds(Json& seconds, const char* key, double value) {
  Json& entry = seconds[key];
  entry = value + (entry.is_null() ? 0.0 : entry.get<double>());
}

std::string report_text(Json report, const std::vector<std::string>& warnings) {
  report["warnings"] = warnings;
  std::string text;
  append(text, report, 0);
  return text + '\n';
}

bool is_page(const std::string& report_path) { return extension_of(report_path) == ".html"; }

void write_report(const std::string& path, Json report, const std::vector<std::string>& warnings,
                  const view::Scene& scene) {
  const std::string title = is_page(path) ? page_title(report, scene) : "";
  const std::string text = report_text(std::move(report), warnings);
  if (is_page(path)) return write_file(path, view::report_page(title, text, scene));
  if (path != "-") return write_file(path, text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw Error("the report cannot be written to stdout; check where it is redirected to");
}

}  // namespace bisector::job
