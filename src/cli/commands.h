// The subcommands, one source each: options, run, summary and report.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace bisector::cli {

// A subcommand whose options have been added to the program.
struct Command {
  CLI::App* app;
  // What options ask of each other; may be empty. Throws CLI::ValidationError.
  std::function<void()> check_usage;
  // Reads the input, calls the library, and writes and prints the result. Throws Error and Cancelled; then no output
  // was written, except for a check whose report tells what does not agree.
  std::function<void()> run;
};

Command add_remesh(CLI::App& program);
Command add_rvd(CLI::App& program);
Command add_tet(CLI::App& program);
Command add_segment(CLI::App& program);
Command add_tree(CLI::App& program);
Command add_quality(CLI::App& program);
Command add_devices(CLI::App& program);
Command add_check(CLI::App& program);

}  // namespace bisector::cli
