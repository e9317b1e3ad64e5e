// The seeds of one evaluation on the device.
#pragma once

#include <vector>

#include "host/device/buffer.h"
#include "host/device/commands.h"
#include "voronoi/neighbours.h"

namespace bisector::host {

struct DeviceSeeds {
  explicit DeviceSeeds(Device& device) : words(device), doubles(device), ids(device) {}

  SortedSeeds sorted;
  double scale = 1;    // of lengths on the device
  float residual = 0;  // what a difference of two positions may lack in single precision; 0 in double
  Buffer words;        // positions by slot, in the backend's precision
  Buffer doubles;      // the same in double, for a backend in single precision that may use it
  Buffer ids;          // by slot: the caller's index, and the low words of the coordinates as doubles

  std::size_t count() const { return sorted.x.size(); }
};

}  // namespace bisector::host
