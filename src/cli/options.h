// The options that commands share, and how the words and numbers of the command line are read.
#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

#include "bisector/device.h"
#include "bisector/features.h"
#include "parsed_option.h"
#include "remesh/sizing.h"

namespace bisector::cli {

inline constexpr std::uint64_t kMostSeeds = 100'000'000;

struct CommonOptions {
  std::string report;    // file name, "-" for stdout, or empty
  unsigned threads = 0;  // 0: all cores
  bool quiet = false;
  bool verbose = false;
};

// Adds a subcommand with nothing but its help: `about` is one line, `footer` holds examples.
CLI::App* add_command(CLI::App& program, const char* name, const char* about, const char* usage, const char* footer);

// The help of the program or of a command, with its usage written out.
class Help : public CLI::Formatter {
 public:
  explicit Help(std::string usage);
  std::string make_usage(const CLI::App*, std::string) const override;
  std::string make_group(std::string name, bool is_positional, std::vector<const CLI::Option*> options) const override;

 private:
  std::string usage_;
};

// --- What a value may be ---

// Decimal digits only: CLI11 alone would read 010 as eight and skip over much else.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);
CLI::Validator number_below(double most);  // and at least 0
CLI::Validator number_above_zero();

// --- Options of several commands ---

CLI::Option* add_file(CLI::App* app, const char* name, std::string& path, const char* type, const char* help);
CLI::Option* add_device(CLI::App* app, DeviceRequest& device, const char* help);
void add_compute_options(CLI::App* app, ComputeOptions& options);
// --threads, --report with the help `about`, --quiet and --verbose.
void add_common_options(CLI::App* app, CommonOptions& options, const char* about);
CLI::Option* add_random_seed(CLI::App* app, std::uint64_t& random_seed, const char* help);
void add_edge_length(CLI::App* app, double& length, double& relative);
void add_edge_bounds(CLI::App* app, SizingOptions& sizing);
void add_iterations(CLI::App* app, int& iterations, const char* help);
void add_tolerance(CLI::App* app, double& tolerance, const char* help);
// "uniform", "lfs[:EXP]", "curvature[:EXP]" or "attribute:NAME": kind and exponent go to `sizing`, NAME to `attribute`.
void add_density(CLI::App* app, SizingOptions& sizing, std::string& attribute, const char* help);
// "auto", "none" or an angle in degrees.
void add_features(CLI::App* app, FeatureOptions& features, const char* help);
void add_feature_file(CLI::App* app, std::string& path);
void add_weld(CLI::App* app, double& tolerance);
struct WrapOption {
  bool on = false;
  double alpha = 0;  // 0: not given
};
void add_wrap(CLI::App* app, WrapOption& wrap);

// --- What options ask of each other ---

// Which options a command was given. An option that would change nothing is an error.
class Usage {
 public:
  explicit Usage(const CLI::App& app) : app_(app) {}
  bool given(const char* option) const { return app_.count(option) > 0; }
  // Throws CLI::ValidationError if the option was given.
  void refuse(const char* option, const char* why) const;

  // The checks below throw CLI::ValidationError, too.
  void check_number_of_vertices() const;  // -n, edge lengths and seeds of remesh and tet
  void check_edge_bounds(const SizingOptions& sizing) const;
  void check_uniform_density() const;
  // What belongs to vertices or triangles of the input is of no use to its wrap; so is an attribute's name.
  void check_wrap(const std::string& attribute) const;

 private:
  const CLI::App& app_;
};

}  // namespace bisector::cli
