// The subcommands: each reads its input, calls the library, and writes and prints the result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "remesh/remesh.h"
#include "segment/segment.h"
#include "bisector/tetmesh.h"
#include "tree/tree.h"

namespace bisector::cli {

struct CommonOptions {
  std::string report;       // file name, "-" for stdout, or empty
  unsigned threads = 0;     // 0: all cores
  bool quiet = false;
  bool verbose = false;
};

// What computes diagrams, as the words of the command line.
struct ComputeWords {
  std::string device = "auto";
  std::string precision = "auto";
  std::string neighbours = "auto";
};

// "uniform", "lfs[:EXP]", "curvature[:EXP]" or "attribute:NAME": kind and exponent. Throws Error for anything else.
SizingOptions parse_density(const std::string& word);
// The NAME of "attribute:NAME", else empty.
std::string density_attribute(const std::string& word);

// "auto", "none" or an angle in degrees. Throws Error for anything else.
FeatureOptions parse_features(const std::string& word);

// "auto", "single" or "double".
Precision parse_precision(const std::string& word);

struct RemeshCommand {
  std::string input, output, seeds, preview;
  std::string topology = "enforce", energy = "auto";
  std::string density = "uniform", features = "auto", feature_file, feature_output;
  double edge_length_relative = 0;  // of the input's diagonal; 0: not given
  double weld = -1;                 // not given
  RemeshOptions options;
  ComputeWords compute;
  CommonOptions common;
};

struct RvdCommand {
  std::string input, output, seeds, pairs, preview;
  std::size_t count = 0;
  std::uint64_t random_seed = 1;
  ComputeWords compute;
  CommonOptions common;
};

struct TetCommand {
  std::string input, output, seeds, boundary, preview;
  std::string density = "uniform", sizes, features = "auto", feature_file;
  double edge_length_relative = 0;  // of the input's diagonal; 0: not given
  double weld = -1;                 // not given
  TetOptions options;
  ComputeWords compute;
  CommonOptions common;
};

struct SegmentCommand {
  std::string input, output, preview;
  std::string surfaces = "all", start = "merging";
  SegmentOptions options;
  CommonOptions common;
};

struct TreeCommand {
  std::string input, output, skeleton, labels, preview;
  std::string components = "bridge", unit = "m";
  TreeOptions options;
  CommonOptions common;
};

struct QualityCommand {
  std::string mesh, reference;
  CommonOptions common;
};

struct DevicesCommand {
  std::string report;
};

struct CheckCommand {
  std::string device = "auto", precision = "auto";
  CommonOptions common;
};

// All throw Error and Cancelled; then no output was written, except for a check whose report tells what does not agree.
void run(const RemeshCommand& command);
void run(const RvdCommand& command);
void run(const TetCommand& command);
void run(const SegmentCommand& command);
void run(const TreeCommand& command);
void run(const QualityCommand& command);
void run(const DevicesCommand& command);
void run(const CheckCommand& command);

}  // namespace bisector::cli
