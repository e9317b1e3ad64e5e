#include "front.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/memory_limit.h"
#include "core/stopwatch.h"
#include "core/threads.h"
#include "io/files.h"
#include "job/outputs.h"

namespace bisector::cli {

namespace {

std::vector<std::string> arguments;

}  // namespace

void set_arguments(int argc, char** argv) { arguments.assign(argv + std::min(argc, 1), argv + argc); }

Help::Help(std::string usage) : usage_(std::move(usage)) {
  column_width(32);
  label("REQUIRED", "(required)");
  label("Positionals", "Arguments");
}

std::string Help::make_usage(const CLI::App*, std::string) const { return "\nUsage: " + usage_ + "\n\n"; }

// One blank line between groups, where CLI11 leaves two.
std::string Help::make_group(std::string name, bool is_positional, std::vector<const CLI::Option*> options) const {
  const std::string group = CLI::Formatter::make_group(name, is_positional, options).substr(1);
  return is_positional ? group + "\n" : group;
}

CLI::App* add_command(CLI::App& program, const char* name, const CommandText& text) {
  CLI::App* app = program.add_subcommand(name, text.about);
  std::string footer = text.examples.size() == 1 ? "Example:" : "Examples:";
  for (const Example& example : text.examples) footer += std::string("\n  ") + example.line;
  if (*text.notes) footer += std::string("\n\n") + text.notes;
  app->group("Commands")->footer(footer);
  app->formatter(std::make_shared<Help>(text.usage));
  app->get_help_ptr()->description("print this and exit")->group("Output");
  return app;
}

void add_common_options(CLI::App* app, CommonOptions& options, const char* about) {
  job::add_file(app, "--report", options.report, "FILE", about, job::kReportFormats)->group("Output");
  app->add_flag("--quiet", options.quiet, "print errors only")->group("Output");
  app->add_flag("--verbose", options.verbose, "print the seconds of each phase")->group("Output");
}

namespace {

// Bytes of a size such as 8GB, 1.5G or 500MB, in powers of 1024. Throws CLI::ValidationError.
std::uint64_t bytes_of(const std::string& size) {
  double number = 0;
  const auto [end, error] = std::from_chars(size.data(), size.data() + size.size(), number);
  std::string unit(end, static_cast<std::size_t>(size.data() + size.size() - end));
  unit.erase(0, unit.find_first_not_of(' '));
  for (char& c : unit) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (unit.ends_with("IB")) unit.erase(unit.size() - 2);
  else if (unit.ends_with('B')) unit.pop_back();
  constexpr std::string_view kPowers = "KMGT";
  const std::size_t power = unit.empty() ? 0 : kPowers.find(unit) + 1;
  const double bytes = std::ldexp(number, 10 * static_cast<int>(power));
  if (error != std::errc() || unit.size() > 1 || (power == 0 && !unit.empty()) || !(bytes >= 1 && bytes < 0x1p63))
    throw CLI::ValidationError(
        fmt::format("--memory {} is no size; give a number of bytes, or one with a unit, such as 8GB or 500MB", size));
  return static_cast<std::uint64_t>(bytes);
}

}  // namespace

void add_memory(CLI::App* app, std::uint64_t& bytes, const char* about) {
  app->add_option_function<std::string>(
         "--memory", [&bytes](const std::string& size) { bytes = bytes_of(size); }, about)
      ->type_name("SIZE")
      ->group("Computation");
}

namespace {

void compute(job::Job& job, Console& console) {
  try {
    job.compute(console.journal());
  } catch (const Cancelled&) {
    const std::string file = job.goes_on_from();
    if (!file.empty()) console.note(file + " has what was done; --resume goes on from it");
    throw;
  }
}

void run(job::Job& job, const JobFiles& files, const PrintSummary& print_summary) {
  const Stopwatch total;
  if (files.memory) limit_memory(files.memory);
  const std::string& report_path = files.common.report;
  const std::vector<job::OutputKind> kinds = job.outputs();
  std::vector<job::Output> outputs;
  for (const job::OutputKind& kind : kinds) outputs.push_back({files.outputs.at(kind.name), kind.extensions});
  if (outputs.empty()) outputs.push_back({});  // the report does not replace the input either
  outputs.push_back(job::report_output(report_path));
  outputs.push_back({job.checkpoint_file(), {}});  // it is removed once the others are written
  job::check_outputs(outputs, job.input_files());
  start_threads(job.threads);
  Console console(files.common.quiet, report_path == "-");
  job::Journal& journal = console.journal();

  journal.phase("reading " + job.input);
  end_at_interrupts(true);  // there is nothing to lose, and a pipe that nobody writes to would never open
  job.read(journal);
  end_at_interrupts(false);
  for (const job::OutputKind& kind : kinds)
    if (const std::string& path = files.outputs.at(kind.name); !path.empty())
      job.check_format(kind.name, path, journal);
  compute(job, console);
  job::Json report;
  view::Scene scene;
  if (!report_path.empty()) {
    report = job.report(journal);
    report["arguments"] = arguments;
  }
  if (job::is_page(report_path)) scene = job.scene(kinds.empty() ? "" : files.outputs.at(kinds.front().name));

  journal.phase("writing");
  FilesTogether together;
  for (const job::OutputKind& kind : kinds) {
    const Stopwatch writing;
    if (const std::string& path = files.outputs.at(kind.name); !path.empty())
      job.write(kind.name, path, journal.warnings());
    job::add_seconds(job.seconds, kind.seconds, writing.seconds());
  }
  job.seconds["total"] = total.seconds();
  if (!report_path.empty()) {
    report["seconds"] = job.seconds;
    job::write_report(report_path, report, journal.warnings(), scene);
  }
  stop_watching_interrupts();
  together.put_in_place();
  job.finish();
  print_summary(console, job, files);
  std::vector<std::string> written;
  for (const job::OutputKind& kind : kinds) written.push_back(files.outputs.at(kind.name));
  written.push_back(report_path);
  console.print_written(written);
  const auto is_file = [](const std::string& path) { return !path.empty() && path != "-"; };
  if (std::none_of(written.begin(), written.end(), is_file)) require_printed();
}

}  // namespace

Command add_job(CLI::App& program, std::shared_ptr<job::Job> job, const CommandText& text, const char* report_help,
                PrintSummary print_summary) {
  const auto files = std::make_shared<JobFiles>();
  CLI::App* app = add_command(program, job->command(), text);
  const job::InputKind input = job->input_kind();
  const std::string help = input.extensions.empty() ? input.help : job::with_extensions(input.help, input.extensions);
  job::add_file(app, input.name, job->input, "FILE", help.c_str(), input.extensions)->required();
  for (const job::OutputKind& kind : job->outputs())
    job::add_file(app, kind.option, files->outputs[kind.name], kind.type, kind.help.c_str(), kind.extensions)
        ->required(kind.required)
        ->group("Output");
  job->add_options(app);
  add_memory(app, files->memory,
             "end with an error before it holds more, such as 8GB;\n"
             "default: what the system gives");
  add_common_options(app, files->common, report_help);
  const auto check_usage = [=] {
    for (const auto& [name, path] : files->outputs)
      if (!path.empty()) job->plan(name, path);
    job->check_usage(job::Usage(*app));
  };
  const auto input_files = [=] {
    std::vector<std::string> names = job->input_files();
    std::erase(names, std::string());
    return names;
  };
  return {app, text, check_usage, input_files, [=] { run(*job, *files, print_summary); }};
}

}  // namespace bisector::cli
