#include "common.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "backend/cpu_backend.h"
#include "host/passes/vulkan_backend.h"
#include "mesh/sampling.h"

namespace bisector::bench {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

std::vector<Vec3> random_seeds(const TriangleMesh& mesh, std::size_t count) {
  std::vector<Vec3> seeds;
  for (const SurfaceSample& sample : sample_surface(mesh, count, 1)) seeds.push_back(sample.point);
  return seeds;
}

namespace {

// In quotes, with `escape` before each quote in the text and before each of itself.
std::string quoted(const std::string& text, const std::string& escape) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || escape[0] == c) result += escape;
    result += c;
  }
  return result + '"';
}

}  // namespace

std::string Table::markdown() const {
  std::vector<std::size_t> width;
  for (const std::string& name : columns) width.push_back(name.size());
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  std::string text;
  const auto line = [&](const std::vector<std::string>& cells) {
    text += '|';
    for (std::size_t c = 0; c < cells.size(); ++c) text += fmt::format(" {:>{}} |", cells[c], width[c]);
    text += '\n';
  };
  line(columns);
  text += '|';
  for (std::size_t w : width) text += std::string(w + 1, '-') + ":|";
  text += '\n';
  for (const auto& row : rows) line(row);
  return text;
}

std::string Table::csv() const {
  std::string text;
  const auto line = [&](const std::vector<std::string>& cells) {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const bool plain = cells[c].find_first_of(",\"") == std::string::npos;
      text += (c ? "," : "") + (plain ? cells[c] : quoted(cells[c], "\""));
    }
    text += '\n';
  };
  line(columns);
  for (const auto& row : rows) line(row);
  return text;
}

std::string Table::json() const {
  std::string text = "[";
  for (const auto& row : rows) {
    text += text.size() > 1 ? ",\n {" : "\n {";
    for (std::size_t c = 0; c < row.size(); ++c)
      text += fmt::format("{}{}: {}", c ? ", " : "", quoted(columns[c], "\\"), quoted(row[c], "\\"));
    text += '}';
  }
  return text + "\n]\n";
}

void add_device_options(CLI::App& app, DeviceOptions& options) {
  static const std::map<std::string, bool> kSwitch{{"on", true}, {"off", false}};
  add_device(app, options.device);
  job::add_words(&app, "--precision", options.precision, job::kPrecisionWords, job::kPrecisionWords.list().c_str());
  app.add_option("--double-rung", options.double_rung, "on, off: of single precision")
      ->transform(CLI::CheckedTransformer(kSwitch));
  app.add_option("--at-once", options.at_once, "pairs that one dispatch clips at most; default: by the device's speed")
      ->check(CLI::PositiveNumber);
}

void add_device(CLI::App& app, DeviceRequest& device) {
  job::add_parsed(&app, "--device", device, parse_device, "cpu, vulkan, vulkan:INDEX or vulkan:UUID",
                  {"cpu", "vulkan", "vulkan:"});
}

std::unique_ptr<Backend> make_device_backend(const Surface& surface, const DeviceOptions& options,
                                             NeighbourSource source) {
  if (is_cpu(options.device)) return std::make_unique<CpuBackend>(surface, source);
  host::VulkanOptions vulkan;
  vulkan.precision = options.precision;
  vulkan.neighbours = source;
  vulkan.double_rung = options.double_rung;
  vulkan.capacities.at_once = options.at_once;
  return host::make_vulkan_backend(surface, host::Device::open(options.device), vulkan);
}

std::string describe_device(const DeviceOptions& options) {
  if (is_cpu(options.device)) return "the CPU";
  const DeviceDescription device = host::Device::open(options.device)->description();
  return fmt::format("{} ({}), driver {}, Vulkan {}", device.name, device.kind, device.driver, device.api);
}

std::string describe_machine() {
  std::string processor = "unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) {
      const std::size_t begin = line.find_first_not_of(" \t:", 10);
      if (begin != std::string::npos) processor = line.substr(begin);
      break;
    }
  double load = 0;
  getloadavg(&load, 1);
  return fmt::format("{}, {} cores, load {:.2f} before the start; compiler {}", processor,
                     std::thread::hardware_concurrency(), load, __VERSION__);
}

std::string describe_model(const std::string& path, const TriangleMesh& mesh) {
  return fmt::format("model {}: {} vertices, {} triangles", std::filesystem::path(path).stem().string(),
                     mesh.vertices.size(), mesh.triangles.size());
}

}  // namespace bisector::bench
