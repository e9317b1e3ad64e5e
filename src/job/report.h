// Reports of runs: JSON, or a page that shows it. Their keys are a stable contract.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "core/geometry.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "view/scene.h"

namespace bisector::job {

using Json = nlohmann::ordered_json;

// Command and version, and room for the warnings.
Json start_report(const char* command);
Json device_json(const BackendDescription& device);
// Null where no device took part.
Json device_seconds_json(const BackendDescription& device, const DeviceSeconds& seconds);
Json seconds_json(const DiagramSeconds& seconds);
void add_device(Json& report, const BackendDescription& device, const DeviceSeconds& seconds, const DeviceWork& work,
                int evaluations);
Json input_json(const TriangleMesh& mesh);  // faces as in the file
Json output_json(const TriangleMesh& mesh);
Json attributes_json(const std::vector<Attribute>& attributes);
Json size_json(const TetMesh& mesh);  // faces: marked triangles
Json certification_json(const Certification& certification);
Json topology_json(const MeshTopology& topology);
Json quality_json(const QualityReport& quality);
// The keys of tetrahedra, beside those of their boundary.
void add_tets(Json& quality, const TetQualityReport& tets);
void add_tets(Json& topology, const TetTopology& tets);
void add_distance(Json& quality, const DistanceReport& distance);
Json features_json(const FeatureResult& features, std::size_t edges);
Json detail_json(const DetailResult& detail, std::size_t curves);
// A point, or null if a coordinate is not finite.
Json point_json(const Vec3& p);

// Adds to an entry of a report's seconds, which may not be there yet.
void add_seconds(Json& seconds, const char* key, double value);

// The report with the run's warnings, as text.
std::string report_text(Json report, const std::vector<std::string>& warnings);
// Whether a report goes to an HTML page, which shows a scene, too.
bool is_page(const std::string& report_path);
// Writes that to a file, or to stdout if the path is "-". Throws Error.
void write_report(const std::string& path, Json report, const std::vector<std::string>& warnings,
                  const view::Scene& scene = {});

}  // namespace bisector::job
