// devices: what can compute here.
#pragma once

#include "bisector/device.h"
#include "job/report.h"

namespace bisector::job {

double installed_memory();  // bytes; 0 if unknown
Json devices_report(const DeviceList& list);

}  // namespace bisector::job
