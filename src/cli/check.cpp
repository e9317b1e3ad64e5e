// bisector check
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "check/device_check.h"
#include "commands.h"
#include "console.h"
#include "core/stopwatch.h"
#include "core/threads.h"
#include "front.h"
#include "job/messages.h"
#include "job/outputs.h"
#include "job/words.h"

namespace bisector::cli {
namespace {

using namespace job;

struct CheckCommand {
  DeviceRequest device;
  Precision precision = Precision::automatic;
  unsigned threads = 0;
  CommonOptions common;
};

void add_options(CLI::App* app, CheckCommand& command) {
  add_device(app, command.device,
             "what to check: auto (the best GPU; default), cpu (against\n"
             "itself), vulkan, vulkan:INDEX or vulkan:UUID");
  add_words(app, "--precision", command.precision, kPrecisionWords,
            "auto (both, where the device has double), single or double")
      ->group("Computation");
  add_threads(app, command.threads);
  add_common_options(app, command.common,
                     "write a report with one row for each case: JSON, or a\npage if FILE ends in .html; - for stdout");
}

// The best GPU where the request leaves the choice open.
DeviceRequest choose_device(const DeviceRequest& request) {
  if (request.kind != DeviceRequest::Kind::automatic) return request;
  const DeviceList list = list_devices();
  if (const auto gpu = best_gpu(list)) return *gpu;
  if (list.devices.empty()) throw Error(fmt::format("there is no GPU to check: {}", list.problem));
  throw Error("there is no GPU to check; --device vulkan checks what 'bisector devices' lists");
}

std::string differences(const DeviceCheckRow& row) {
  if (row.passed) return row.parity.bitwise ? "equal" : "same";
  if (!row.parity.same_pairs) return "PAIRS";
  if (!row.parity.same_labels) return "LABELS";
  if (!row.parity.same_dual) return "DUAL";
  return row.repeats ? "ERROR" : "REPEAT";
}

void print_head(Console& console) {
  console.print(
      fmt::format("{:<10} {:<10} {:<9} {:<7} {:>6} {:>7}  {:<7} {:>8} {:>8} {:>8} {:>8}  "
                  "{:>9} {:>6} {:>6}  {:>8} {:>8}",
                  "model", "seeds", "neighbors", "prec.", "seeds", "pairs", "result", "mass", "centroid", "energy",
                  "sum", "uncertain", "double", "cpu", "seconds", "CPU s"));
}

double uncertain_share(const Certification& certification) {
  return static_cast<double>(certification.uncertain) /
         static_cast<double>(std::max<std::size_t>(certification.pairs, 1));
}

void print_row(Console& console, const DeviceCheckRow& row) {
  const Parity& p = row.parity;
  const Certification& c = row.certification;
  console.print(
      fmt::format("{:<10} {:<10} {:<9} {:<7} {:>6} {:>7}  {:<7} {:>8.1e} {:>8.1e} {:>8.1e} {:>8.1e}  "
                  "{:>8.3f}% {:>6} {:>6}  {:>8.4f} {:>8.4f}",
                  row.model, row.seeds, kNeighbourWords.word_of(row.neighbours), row.device.precision, row.seed_count,
                  c.pairs, differences(row), p.mass_error, p.centroid_error, p.energy_error, p.sum_error,
                  100 * uncertain_share(c), c.doubled, c.cpu, row.seconds, row.cpu_seconds));
}

Json row_json(const DeviceCheckRow& row) {
  const Parity& p = row.parity;
  Json json{{"model", row.model},
            {"seeds", row.seeds},
            {"neighbors", kNeighbourWords.word_of(row.neighbours)},
            {"precision", row.device.precision},
            {"triangles", row.triangles},
            {"seed_count", row.seed_count},
            {"passed", row.passed},
            {"same_pairs", p.same_pairs},
            {"same_labels", p.same_labels},
            {"same_dual", p.same_dual},
            {"bitwise", p.bitwise},
            {"repeats", row.repeats},
            {"mass_error", p.mass_error},
            {"centroid_error", p.centroid_error},
            {"energy_error", p.energy_error},
            {"sum_error", p.sum_error},
            {"uncertain_share", uncertain_share(row.certification)},
            {"certification", certification_json(row.certification)},
            {"seconds", row.seconds},
            {"cpu_seconds", row.cpu_seconds}};
  if (row.tets) json["tets"] = row.tets;
  return json;
}

Json check_report(const std::vector<DeviceCheckRow>& rows, std::size_t failed, double seconds) {
  Json report = start_report("check");
  report["device"] = device_json(rows.back().device);
  report["passed"] = failed == 0;
  report["seconds"] = {{"total", seconds}};
  report["rows"] = Json::array();
  for (const DeviceCheckRow& row : rows) report["rows"].push_back(row_json(row));
  return report;
}

void run(const CheckCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{}, report_output(report_path)}, {});
  start_threads(command.threads);
  Console console(command.common.quiet, report_path == "-");
  const DeviceRequest device = choose_device(command.device);

  console.journal().phase("making models");
  const Context context = console.journal().context();
  bool first = true;
  const auto rows = check_device(device, command.precision, context, [&](const DeviceCheckRow& row) {
    if (std::exchange(first, false)) {
      console.print(fmt::format("{} ({}) against the CPU: results, worst relative errors, shares of exact work, times",
                                row.device.name, row.device.kind));
      print_head(console);
    }
    print_row(console, row);
  });

  const auto failed = static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const DeviceCheckRow& row) { return !row.passed; }));
  const std::string cases = counted(rows.size(), "case", "cases");
  if (!report_path.empty())
    write_report(report_path, check_report(rows, failed, total.seconds()), console.journal().warnings());
  if (failed > 0) {
    console.print(fmt::format("FAILED: {} of {} do not agree with the CPU", failed, cases));
    throw Error(fmt::format("{} of {} do not agree with the CPU; do not compute on this device, and please report this",
                            failed, cases));
  }
  console.print(fmt::format("passed: {}, all as the CPU has them; {:.1f} s", cases, total.seconds()));
  console.print_written({report_path});
  if (report_path.empty()) require_printed();
}

}  // namespace

Command add_check(CLI::App& program) {
  const auto command = std::make_shared<CheckCommand>();
  const CommandText text{
      "Compare a device's diagrams with the CPU's.",
      "bisector check [--device DEVICE] [options]",
      "Computes restricted Voronoi diagrams of small generated surfaces and clipped ones of small solids, with random, "
      "optimised, clustered and gridded seeds and seeds at the vertices, on a device and on the CPU, and compares "
      "them. "
      "It takes seconds on a GPU.",
      {{"bisector check", "Check the best GPU."},
       {"bisector check --device vulkan:1 --precision single --report check.json",
        "Check one device in single precision, and write a report."}},
      "Prints one line for each case, and exits with 1 if any does not agree."};
  CLI::App* app = add_command(program, "check", text);
  add_options(app, *command);
  return {app, text, {}, {}, [=] { run(*command); }};
}

}  // namespace bisector::cli
