#include "summary.h"

#include <fmt/format.h>

#include "job/messages.h"

namespace bisector::cli {
namespace {

using namespace job;

void print_phases(Console& console, const char* title, const Json& seconds) {
  std::string line = fmt::format("{:<10}", title);
  for (const auto& [phase, value] : seconds.items()) line += fmt::format(" {} {:.3f} ", phase, value.get<double>());
  console.print(line);
}

}  // namespace

const char* yes_no(bool b) { return b ? "yes" : "no"; }

std::string size_of(const Json& mesh) {
  std::string size = counted(mesh["vertices"], "vertex", "vertices") + ", " + counted(mesh["faces"], "face", "faces");
  if (mesh.contains("tets")) size += ", " + counted(mesh["tets"], "tetrahedron", "tetrahedra");
  return size;
}

void print_seconds(Console& console, const Json& seconds, const Json& device_seconds) {
  print_phases(console, "seconds", seconds);
  if (!device_seconds.is_null()) print_phases(console, "on device", device_seconds);
}

void print_device(Console& console, const BackendDescription& device) {
  if (device.kind != "cpu") console.print(fmt::format("device     {}, {} precision", device.name, device.precision));
  else if (!device.fallback.empty()) console.print(fmt::format("device     {}; {}", device.name, device.fallback));
}

void print_quality(Console& console, const QualityReport& quality) {
  console.print(fmt::format("quality    q_min {:.4f}, theta_min {:.2f} degrees; theta_below_30 {:.3g} %", quality.q_min,
                            quality.theta_min, quality.theta_below_30));
  console.print(fmt::format("           q_ave {:.4f}, theta_min_ave {:.2f} degrees; valence6 {:.1f} %", quality.q_ave,
                            quality.theta_min_ave, 100 * quality.valence6));
}

void print_detail(Console& console, const DetailResult& detail) {
  if (detail.merged + detail.let_go == 0) return;
  console.print(
      fmt::format("detail     finer than {:.4g}: {} merged, {} let go{}", detail.width,
                  counted(detail.merged, "curve", "curves"), detail.let_go,
                  detail.vertices > 0 ? fmt::format("; {} vertices would show all", detail.vertices) : std::string()));
}

}  // namespace bisector::cli
