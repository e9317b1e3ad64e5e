#include "tree/polyline.h"

namespace bisector {

std::vector<Vec3> resample_polyline(const std::vector<Vec3>& line, std::size_t count) {
  const double length = polyline_length(line);
  std::vector<Vec3> out{line.front()};
  std::size_t k = 0;
  double before = 0;  // length up to segment k
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const double at = length * static_cast<double>(i) / static_cast<double>(count - 1);
    while (k + 2 < line.size() && before + norm(line[k + 1] - line[k]) < at) {
      before += norm(line[k + 1] - line[k]);
      ++k;
    }
    const double segment = norm(line[k + 1] - line[k]);
    const double t = segment > 0 ? std::clamp((at - before) / segment, 0.0, 1.0) : 0.0;
    out.push_back(line[k] + t * (line[k + 1] - line[k]));
  }
  out.push_back(line.back());
  return out;
}

}  // namespace bisector
