// A solid as the kernels read it.
#pragma once

#include <cstddef>
#include <vector>

#include "host/device/buffer.h"
#include "host/device/commands.h"
#include "voronoi/clip_tet.h"
#include "voronoi/solid.h"

namespace bisector::host {

// The power of two by which lengths are multiplied on the device: the diagonal is then near 2^16, so that second
// moments of all of a solid and of cells 2^-36 of its size are within the range of single precision.
double device_scale(const Solid& solid);

// What cells are clipped from, as the clipping reads it on either side: the tetrahedra in their order, or the enclosure
// alone.
struct DeviceSolid {
  // Throws DeviceError if there are more than a binding can span.
  DeviceSolid(Device& device, Commands& commands, const Solid& solid, bool whole, double scale, bool is_double,
              bool with_doubles);

  const Solid& solid;
  const bool whole;  // the enclosure alone
  std::vector<TetFrame> frames;
  std::vector<Index> vertices;  // that tetrahedra with volume use
  Buffer words;                 // in the backend's precision
  Buffer double_words;          // for the rung of double precision; may be empty
  Buffer meta;                  // what a batch notes in it, on the device, lies beside what is given once
  bool has_doubles;
};

}  // namespace bisector::host
