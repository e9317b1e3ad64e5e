// The subcommands, one source each: options, run, summary and report.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>
#include <string>
#include <vector>

#include "bisector/error.h"

namespace bisector::cli {

// A command line, and what it does.
struct Example {
  const char* line;
  const char* about;
};

// What is said of a command. Help has all but `description` and what examples do, the manual page has all.
struct CommandText {
  const char* about;  // one line
  const char* usage;
  const char* description;  // paragraphs, a line each
  std::vector<Example> examples;
  const char* notes = "";  // below the examples
};

// Some jobs of a batch are not done.
class JobsFailed : public Error {
 public:
  JobsFailed(const std::string& what, std::size_t count) : Error(what), jobs(count) {}
  std::size_t jobs;
};

// A subcommand whose options have been added to the program.
struct Command {
  CLI::App* app;
  CommandText text;
  // What options ask of each other; may be empty. Throws CLI::ValidationError.
  std::function<void()> check_usage;
  // The files that its options name as input; may be empty.
  std::function<std::vector<std::string>()> input_files;
  // Reads the input, calls the library, and writes and prints the result. Throws Error and Cancelled; then no output
  // was written, except for a check whose report tells what does not agree.
  std::function<void()> run;
  // Of errors, those of usage too; jobs that failed are counted by exit codes up to kMostJobs.
  int failure = 0;  // 0: those of the program
};
inline constexpr int kMostJobs = 100;

Command add_remesh(CLI::App& program);
Command add_remesh_parts(CLI::App& program);
Command add_rvd(CLI::App& program);
Command add_tet(CLI::App& program);
Command add_segment(CLI::App& program);
Command add_tree(CLI::App& program);
Command add_quality(CLI::App& program);
Command add_devices(CLI::App& program);
Command add_check(CLI::App& program);
Command add_batch(CLI::App& program);

}  // namespace bisector::cli
