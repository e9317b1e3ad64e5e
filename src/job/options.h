// The options that commands share, and how the words and numbers of the command line are read.
#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bisector/device.h"
#include "bisector/features.h"
#include "job/parsed_option.h"
#include "remesh/sizing.h"

namespace bisector::job {

inline constexpr std::uint64_t kMostSeeds = 100'000'000;

// --- What a value may be ---

// Decimal digits only: CLI11 alone would read 010 as eight and skip over much else. To be used with transform(), for it
// takes zeros in front away.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);
CLI::Validator number_below(double most);  // and at least 0
CLI::Validator number_above_zero();

// --- Options of several commands ---

// `extensions`: of the files that the option takes, with the dot; empty: any name.
CLI::Option* add_file(CLI::App* app, const char* name, std::string& path, const char* type, const char* help,
                      std::vector<std::string> extensions = {});
CLI::Option* add_device(CLI::App* app, DeviceRequest& device, const char* help);
void add_compute_options(CLI::App* app, ComputeOptions& options);
void add_threads(CLI::App* app, unsigned& threads);
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
  // `in_memory`: options that stand for files whose contents were given instead.
  explicit Usage(const CLI::App& app, std::set<std::string> in_memory = {})
      : app_(app), in_memory_(std::move(in_memory)) {}
  bool given(const char* option) const {
    return in_memory_.count(option) > 0 || (app_.get_option_no_throw(option) && app_.count(option) > 0);
  }
  // The options that were given and that results hang on, with their values: not files to write, nor what computes.
  std::string words_of_result() const;
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
  std::set<std::string> in_memory_;
};

}  // namespace bisector::job
