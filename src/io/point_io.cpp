#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "bisector/io.h"
#include "io/mesh_formats.h"
#include "io/point_formats.h"
#include "io/text.h"

namespace bisector {

namespace io {

constexpr std::size_t kShortestPoint = 6;  // bytes of a line

PointCloud read_xyz(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, '#');
  PointCloud cloud;
  while (in.next_line()) cloud.points.push_back(in.point());
  if (cloud.points.empty()) in.fail("there is no point at all; give one \"x y z\" a line");
  return cloud;
}

// Scans one after the other, each with its number of points on a line of its own.
PointCloud read_pts(const std::string& path, std::string_view bytes) {
  TextReader in(path, bytes, 0);
  PointCloud cloud;
  std::size_t count = 0, count_line = 0;
  while (in.next_line()) {
    TextReader ahead = in;
    ahead.word();
    if (ahead.at_word())
      in.fail(count_line == 0
                  ? "a .pts file begins with a line with its number of points; name it .xyz if it has none"
                  : fmt::format("there are more points than the {} of line {}; mend the count", count, count_line));
    count = in.count("points");
    count_line = in.line();
    if (cloud.points.empty()) cloud.points.reserve(std::min(count, in.remaining() / kShortestPoint + 1));
    for (std::size_t i = 0; i < count; ++i) {
      if (!in.next_line()) in.fail_truncated(fmt::format("{} of the {} points of line {}", i, count, count_line));
      Vec3 p;
      for (int k = 0; k < 3; ++k) {
        p[k] = in.number();
        if (const char* flaw = coordinate_flaw(p[k])) in.fail(flaw);
        if (k == 0 && !in.at_word())
          in.fail(fmt::format("a line of one number, after {} of the {} points of line {}; mend the count", i, count,
                              count_line));
      }
      cloud.points.push_back(p);
    }
  }
  if (cloud.points.empty()) in.fail("there is no point at all; export the file with points");
  return cloud;
}

}  // namespace io

PointCloud read_point_cloud(const std::string& path, const Context& context) {
  const std::string extension = io::lower_extension(path);
  const std::string bytes = io::read_bytes(path);
  PointCloud cloud;
  if (extension == ".ply") cloud.points = io::read_ply_points(path, bytes);
  else if (extension == ".las" || extension == ".laz") cloud = io::read_las(path, bytes, context);
  else if (extension == ".pcd") cloud = io::read_pcd(path, bytes, context);
  else if (extension == ".pts") cloud = io::read_pts(path, bytes);
  else cloud = io::read_xyz(path, bytes);
  if (cloud.points.size() >= kNone)
    io::fail(path, fmt::format("{} points are too many; split the scan", cloud.points.size()));
  return cloud;
}

std::vector<Vec3> read_points(const std::string& path) { return read_point_cloud(path).points; }

}  // namespace bisector
