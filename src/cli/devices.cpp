// bisector devices
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <string>

#include "bisector/device.h"
#include "commands.h"
#include "console.h"
#include "core/parallel.h"
#include "core/processor.h"
#include "front.h"
#include "job/devices.h"
#include "job/messages.h"
#include "job/outputs.h"

namespace bisector::cli {
namespace {

using namespace job;

struct DevicesCommand {
  std::string report;
};

void add_options(CLI::App* app, DevicesCommand& command) {
  add_file(app, "--report", command.report, "FILE",
           "write a report: JSON, or a page if FILE ends in .html;\n- for stdout", kReportFormats)
      ->group("Output");
}

std::string gibibytes(double bytes) { return fmt::format("{:.1f} GiB", bytes / 0x1p30); }

constexpr const char* kNoGpu =
    "gpu       none. One needs its driver (NVIDIA's, or mesa-vulkan-drivers for AMD and Intel) and the loader\n"
    "          (libvulkan1). A container needs NVIDIA_DRIVER_CAPABILITIES=all, libxext6 and libegl1, or --device\n"
    "          /dev/dri; users must be let at /dev/dri/render*. More is under \"devices\" in cli.md.";

std::string describe(const DeviceDescription& device) {
  std::string line = fmt::format(
      "vulkan:{}  {}: {}, driver {}, Vulkan {}, {} of memory, {}, uuid {}", device.index, device.name, device.kind,
      device.driver, device.api, gibibytes(static_cast<double>(device.memory)),
      device.features.empty() ? "no optional features" : fmt::format("features {}", fmt::join(device.features, " ")),
      device.uuid);
  if (!device.rejected.empty()) line += "; cannot be used: " + device.rejected;
  return line;
}

void run(const DevicesCommand& command) {
  check_outputs({report_output(command.report)}, {});
  const DeviceList list = list_devices();
  Console console(false, command.report == "-");
  console.print(fmt::format("cpu       {}: {}, {} of memory, double precision", processor_name(),
                            counted(thread_count(), "thread", "threads"), gibibytes(installed_memory())));
  for (const DeviceDescription& device : list.devices) console.print(describe(device));
  if (list.devices.empty()) console.print("vulkan    none: " + list.problem);
  if (!best_gpu(list)) console.print(kNoGpu);

  if (command.report.empty()) return require_printed();
  write_report(command.report, devices_report(list), {});
  console.print_written({command.report});
}

}  // namespace

Command add_devices(CLI::App& program) {
  const auto command = std::make_shared<DevicesCommand>();
  const CommandText text{
      "List what Bisector can compute on here.",
      "bisector devices [--report FILE]",
      "Lists the CPU, then each Vulkan device: the index and UUID by which --device takes it, name, kind, driver, "
      "Vulkan "
      "version, memory, the optional features that are used, and why it cannot be used if so. Where there is none it "
      "says why.\n"
      "Vulkan is looked for when the program runs; nothing else needs it. A GPU needs its driver, NVIDIA's or Mesa's, "
      "and the Vulkan loader.",
      {{"bisector devices", "List the devices."}}};
  CLI::App* app = add_command(program, "devices", text);
  add_options(app, *command);
  return {app, text, {}, {}, [=] { run(*command); }};
}

}  // namespace bisector::cli
