// bisector batch
#include "batch/batch.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.h"
#include "compute/compute.h"
#include "console.h"
#include "front.h"
#include "job/messages.h"
#include "job/options.h"
#include "program.h"

namespace bisector::cli {
namespace {

using namespace batch;

// As GNU parallel has it: codes up to 100 count failed jobs.
constexpr int kBatchFailed = 255;
constexpr std::size_t kMostNamed = 10;  // failed jobs in an error message

struct BatchCommand {
  std::string jobs, shard;
  BatchOptions options;
  bool quiet = false;
};

// Sets the shard from "INDEX/COUNT". Throws CLI::ValidationError.
void check_usage(BatchCommand& command) {
  if (command.shard.empty()) return;
  std::size_t index = 0, count = 0;
  int end = 0;
  const bool read = std::sscanf(command.shard.c_str(), "%zu/%zu%n", &index, &count, &end) == 2 &&
                    static_cast<std::size_t>(end) == command.shard.size();
  if (!read || count < 1 || index >= count)
    throw CLI::ValidationError(
        fmt::format("--shard {} is not INDEX/COUNT with an INDEX from 0 to COUNT - 1", command.shard));
  command.options.shard = index;
  command.options.shards = count;
}

// Takes each job through the command line's own checks, so that a wrong word is found before any job runs. Sets what
// the jobs read.
void check_jobs(const std::string& path, std::vector<BatchJob>& jobs, const std::string& folder) {
  for (BatchJob& job : jobs) {
    Program program = make_program();
    try {
      program.app->parse(std::vector<std::string>(job.words.rbegin(), job.words.rend()));
      for (const Command& command : program.commands) {
        if (!command.app->parsed()) continue;
        if (command.check_usage) command.check_usage();
        job.inputs = command.input_files();
      }
    } catch (const CLI::ParseError& error) {
      throw Error(fmt::format("{}: line {}: {}; see bisector {} --help", path, job.line, error.what(), job.words[0]));
    }
  }
  check_files(path, jobs, folder);
}

void run(BatchCommand command) {
  if (ranks_of_run())
    throw Error(
        "a batch runs each job as a process of its own, not on ranks; start it without mpirun, or on each machine with "
        "a --shard of its own");
  end_at_interrupts(true);  // as of a pipe that nobody writes to
  std::vector<BatchJob> jobs = read_jobs(command.jobs);
  end_at_interrupts(false);
  check_jobs(command.jobs, jobs, command.options.folder);
  if (command.options.program.empty()) command.options.program = std::filesystem::read_symlink("/proc/self/exe");
  Console console(command.quiet, false);
  std::size_t ended = 0;
  const BatchResult result =
      run_batch(jobs, command.options, watch_interrupts(), [&](const BatchJob& job, const job::Json& record) {
        std::string line =
            fmt::format("{:>5}  {:<8} {:>8.1f} s {:>7.0f} MiB  {}", ++ended, record["status"].get<std::string>(),
                        record["seconds"].get<double>(), record["memory_mib"].get<double>(), job.name);
        if (record.contains("message")) line += ": " + record["message"].get<std::string>();
        console.print(job::one_line(line));
      });
  const std::size_t failed = result.failed.size();
  const std::string all = job::counted(result.jobs, "job", "jobs");
  console.print(fmt::format("{} of {} done, {} of them before; {}/summary.html shows all", result.jobs - failed, all,
                            result.done_before, command.options.folder));
  if (failed == 0) return;
  std::vector<std::string> named(result.failed.begin(),
                                 result.failed.begin() + static_cast<std::ptrdiff_t>(std::min(failed, kMostNamed)));
  if (failed > kMostNamed) named.push_back("...");
  throw JobsFailed(fmt::format("{} of {} failed: {}; see {}/summary.html", failed, all, fmt::join(named, ", "),
                               command.options.folder),
                   failed);
}

void add_options(CLI::App* app, BatchCommand& command) {
  BatchOptions& options = command.options;
  app->add_option("jobs", command.jobs,
                  "a JSON object on each line: \"command\", \"input\", \"output\"\n"
                  "and options by name (cli.md, \"batch\")")
      ->type_name("JOBS.jsonl")
      ->required();
  app->add_option("-o", options.folder, "folder for records, logs and the summary")
      ->type_name("FOLDER")
      ->required()
      ->group("Output");
  app->add_option("--jobs", options.at_once, "so many at a time, each on its part of the cores; default 1")
      ->type_name("N")
      ->transform(job::whole_number(1, 4096))
      ->group("Computation");
  app->add_option("--timeout", options.limits.seconds, "end a job that takes longer; default: none")
      ->type_name("SECONDS")
      ->check(job::number_above_zero())
      ->group("Computation");
  add_memory(app, options.limits.memory, "end a job that holds more, such as 8GB or 500MB;\ndefault: none");
  app->add_option("--shard", command.shard, "run each COUNT-th job only, from the INDEX-th on, counted\nfrom 0")
      ->type_name("INDEX/COUNT")
      ->group("Computation");
  app->add_flag("--retry", options.retry, "run jobs again that were run and are not done")->group("Computation");
  app->add_option("--program", options.program,
                  "what runs each job in place of bisector: it is given the\n"
                  "job's arguments")
      ->type_name("FILE")
      ->check(CLI::ExistingFile)
      ->group("Computation");
  app->add_flag("--quiet", command.quiet, "print errors only")->group("Output");
}

}  // namespace

Command add_batch(CLI::App& program) {
  const auto command = std::make_shared<BatchCommand>();
  const CommandText text{
      "Run many jobs, each as a process of its own.",
      "bisector batch JOBS.jsonl -o FOLDER [options]",
      "A job that crashes, hangs or eats memory costs nothing but itself. FOLDER/NAME.json says what became of each, "
      "with its report, FOLDER/NAME.log has what it printed, and summary.json, summary.csv and summary.html have all "
      "in a table.\n"
      "Jobs that have been run are not run again when the batch is started again, unless their line or a file that "
      "they read has changed since.",
      {{"bisector batch jobs.jsonl -o results --jobs 4 --timeout 600 --memory 8GB",
        "Run all, four at a time, ten minutes and 8 GB each."},
       {"bisector batch jobs.jsonl -o results --shard 3/16",
        "Run the fourth of sixteen parts, on a machine of a cluster."}},
      "The exit code is the number of jobs that failed, 100 if there are more, and 255 for an error of the batch."};
  CLI::App* app = add_command(program, "batch", text);
  add_options(app, *command);
  return {app, text, [=] { check_usage(*command); }, {}, [=] { run(*command); }, kBatchFailed};
}

}  // namespace bisector::cli
