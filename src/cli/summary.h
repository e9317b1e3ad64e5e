// Parts of the summaries that runs end with.
#pragma once

#include <string>

#include "bisector/device.h"
#include "bisector/quality.h"
#include "console.h"
#include "job/report.h"
#include "mesh/topology.h"

namespace bisector::cli {

const char* yes_no(bool b);
std::string size_of(const job::Json& mesh);  // "8 vertices, 12 faces"
void print_seconds(Console& console, const job::Json& seconds, const job::Json& device_seconds = nullptr);
// What computed, where that was not the CPU all along.
void print_device(Console& console, const BackendDescription& device);

void print_quality(Console& console, const QualityReport& quality);
// A line if any detail was merged or let go.
void print_detail(Console& console, const DetailResult& detail);

}  // namespace bisector::cli
