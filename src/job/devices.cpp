#include "job/devices.h"

#include <unistd.h>

#include "core/parallel.h"
#include "core/processor.h"

namespace bisector::job {
namespace {

Json cpu_entry() {
  return {{"name", processor_name()},
          {"kind", "cpu"},
          {"precision", "double"},
          {"threads", thread_count()},
          {"memory", installed_memory()}};
}

Json device_entry(const DeviceDescription& device) {
  Json entry{
      {"name", device.name},        {"kind", device.kind},     {"precision", device.float64 ? "double" : "single"},
      {"index", device.index},      {"uuid", device.uuid},     {"driver", device.driver},
      {"api", device.api},          {"memory", device.memory}, {"float64", device.float64},
      {"features", device.features}};
  if (!device.rejected.empty()) entry["rejected"] = device.rejected;
  return entry;
}

}  // namespace

double installed_memory() {
  const long pages = sysconf(_SC_PHYS_PAGES), page_size = sysconf(_SC_PAGE_SIZE);
  return pages > 0 && page_size > 0 ? static_cast<double>(pages) * static_cast<double>(page_size) : 0;
}

Json devices_report(const DeviceList& list) {
  Json report = start_report("devices");
  report["devices"] = Json::array({cpu_entry()});
  for (const DeviceDescription& device : list.devices) report["devices"].push_back(device_entry(device));
  if (list.devices.empty()) report["problem"] = list.problem;
  return report;
}

}  // namespace bisector::job
