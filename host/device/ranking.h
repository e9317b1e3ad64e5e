// Which of the devices is best.
#pragma once

#include "bisector/device.h"

namespace bisector::host {

// Whether to prefer `a`: discrete before integrated, virtual, other and software ones, then the one with more memory.
bool better(const DeviceDescription& a, const DeviceDescription& b);

// The best device that is no software and not rejected; null if there is none.
const DeviceDescription* best_gpu(const DeviceList& list);

}  // namespace bisector::host
