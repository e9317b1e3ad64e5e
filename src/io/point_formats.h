// Readers of scans.
#pragma once

#include <string>
#include <string_view>

#include "bisector/context.h"
#include "bisector/io.h"

namespace bisector::io {

// Of a whole file, already in memory; the path is for messages. Coordinates are finite and at most 1e100.
PointCloud read_xyz(const std::string& path, std::string_view bytes);
PointCloud read_pts(const std::string& path, std::string_view bytes);
PointCloud read_pcd(const std::string& path, std::string_view bytes, const Context& context);
PointCloud read_las(const std::string& path, std::string_view bytes, const Context& context);

// What a coordinate system says of its units, in metres; 0: nothing.
struct SystemUnits {
  double horizontal = 0, vertical = 0;
  bool degrees = false;  // x and y are angles
};

// From the keys of GeoTIFF (GeoKeyDirectoryTag) with the numbers that they point to (GeoDoubleParamsTag).
SystemUnits units_of_geo_keys(std::string_view keys, std::string_view doubles);

// From well-known text (WKT), version 1 or 2.
SystemUnits units_of_wkt(std::string_view text);

}  // namespace bisector::io
