// What the benchmarks share: medians, lists on the command line, tables, the machine.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "bisector/core/types.h"

namespace bisector::bench {

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

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
};

// One line each: processor, cores and load; compiler; model.
std::string describe_machine();
std::string describe_model(const std::string& path, const TriangleMesh& mesh);

}  // namespace bisector::bench
