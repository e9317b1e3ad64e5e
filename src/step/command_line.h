// The command line of bisector-step.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <string>
#include <vector>

namespace bisector::step {

struct Unit {
  const char* word;
  const char* name;  // OpenCASCADE's
  double millimetres;
};
inline constexpr Unit kUnits[] = {
    {"mm", "MM", 1}, {"cm", "CM", 10}, {"m", "M", 1000}, {"in", "INCH", 25.4}, {"ft", "FT", 304.8}};
inline const std::vector<std::string> kFormats{".step", ".stp", ".iges", ".igs"};

struct Options {
  std::string input, output, unit = "mm";
  double tolerance = 0;
};

// `options` have to live as long.
std::unique_ptr<CLI::App> make_command_line(Options& options);

}  // namespace bisector::step
