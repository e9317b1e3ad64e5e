// Regions of a segmentation, their surfaces and borders as JSON.
#pragma once

#include <string>

#include "bisector/region_borders.h"
#include "bisector/segment.h"
#include "job/report.h"

namespace bisector::job {

// Type, parameters and errors of a region's surface.
Json region_json(const SegmentRegion& region);

// What --json writes: regions with the loops that trim their surfaces, chains of border edges, and which regions meet.
Json trims_json(const std::string& input, const TriangleMesh& mesh, const SegmentResult& segmentation,
                const RegionBorders& borders);

}  // namespace bisector::job
