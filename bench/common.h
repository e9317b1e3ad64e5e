// What the benchmarks share: medians, lists on the command line, tables, the machine.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "compute/compute.h"
#include "core/geometry.h"
#include "core/stopwatch.h"
#include "job/parsed_option.h"
#include "job/words.h"

namespace bisector::bench {

// The middle value, or the mean of the two; 0 if there are none.
double median(std::vector<double> values);

// Area-uniform, the same for the same count.
std::vector<Vec3> random_seeds(const TriangleMesh& mesh, std::size_t count);

// Cells as text, with the names of the columns. Numbers print as they are given.
struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;

  std::string markdown() const;
  std::string csv() const;
  std::string json() const;  // an array of objects; all values are strings
};

// One line each: processor, cores and load; compiler; model.
std::string describe_machine();
// A device and how it computes, from the command line.
struct DeviceOptions {
  DeviceRequest device{.kind = DeviceRequest::Kind::cpu};
  Precision precision = Precision::automatic;
  bool double_rung = true;  // whether single precision hands uncertain pairs to double precision
  std::size_t at_once = 0;  // pairs that one dispatch clips at most; 0: by the device's speed
};

// --device
void add_device(CLI::App& app, DeviceRequest& device);
// --device, --precision, --double-rung and --at-once
void add_device_options(CLI::App& app, DeviceOptions& options);
inline bool is_cpu(const DeviceRequest& device) { return device.kind == DeviceRequest::Kind::cpu; }

// Throws Error and DeviceError as bisector::make_backend() does. Not for an automatic request.
std::unique_ptr<Backend> make_device_backend(const Surface& surface, const DeviceOptions& options,
                                             NeighbourSource source);
std::string describe_device(const DeviceOptions& options);

std::string describe_model(const std::string& path, const TriangleMesh& mesh);

}  // namespace bisector::bench
