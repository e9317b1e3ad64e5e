// The command line as a front end of jobs.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "commands.h"
#include "console.h"
#include "job/job.h"

namespace bisector::cli {

struct CommonOptions {
  std::string report;  // file name, "-" for stdout, or empty
  bool quiet = false;
  bool verbose = false;
};

// What the program was started with, without its own name: reports have it.
void set_arguments(int argc, char** argv);

// Adds a subcommand with nothing but its help.
CLI::App* add_command(CLI::App& program, const char* name, const CommandText& text);

// The help of the program or of a command, with its usage written out.
class Help : public CLI::Formatter {
 public:
  explicit Help(std::string usage);
  std::string make_usage(const CLI::App*, std::string) const override;
  std::string make_group(std::string name, bool is_positional, std::vector<const CLI::Option*> options) const override;

 private:
  std::string usage_;
};

// --report with the help `about`, --quiet and --verbose.
void add_common_options(CLI::App* app, CommonOptions& options, const char* about);
// --memory: a size in bytes, in words such as 8GB.
void add_memory(CLI::App* app, std::uint64_t& bytes, const char* about);

// What a summary speaks of beside the job: the file that each output goes to, empty if it is not wanted.
struct JobFiles {
  std::uint64_t memory = 0;                    // bytes that the run may hold; 0: any
  std::map<std::string, std::string> outputs;  // by OutputKind::name
  CommonOptions common;
};

using PrintSummary = std::function<void(Console& console, const job::Job& job, const JobFiles& files)>;

// A command that reads, computes, writes and prints what a job says. `report_help` is that of --report.
Command add_job(CLI::App& program, std::shared_ptr<job::Job> job, const CommandText& text, const char* report_help,
                PrintSummary print_summary);

template <class AnyJob>
Command add_job(CLI::App& program, const CommandText& text, const char* report_help,
                void (*print_summary)(Console& console, const AnyJob& job, const JobFiles& files)) {
  const auto job = std::make_shared<AnyJob>();
  return add_job(program, job, text, report_help, [=](Console& console, const job::Job&, const JobFiles& files) {
    print_summary(console, *job, files);
  });
}

}  // namespace bisector::cli
