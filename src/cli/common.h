// What the commands share: words to options, and parts of summaries and reports.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "compute/compute.h"
#include "remesh/remesh.h"
#include "commands.h"
#include "console.h"
#include "report.h"

namespace bisector::cli {

ComputeOptions compute_options(const ComputeWords& words);
Json seconds_json(const DiagramSeconds& seconds);
const char* yes_no(bool b);
std::string size_of(const Json& mesh);  // "8 vertices, 12 faces"
std::string describe(const MeshTopology& topology);
void print_seconds(Console& console, const Json& seconds, const Json& device_seconds = nullptr);
// What computed, where that was not the CPU all along.
void print_device(Console& console, const BackendDescription& device);
// `count`: how many the command line asks for, or 0. Throws Error if the file has another number.
std::vector<Vec3> read_seeds(const std::string& path, std::size_t count);
Json features_json(const FeatureResult& features, std::size_t edges);

}  // namespace bisector::cli
