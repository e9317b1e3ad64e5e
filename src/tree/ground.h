// The ground of a scan: a surface above every place that lies below everything else.
#pragma once

#include <cstdint>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"

namespace bisector {

// Heights at the corners of square cells, bilinear between them; outside it goes on as at the border.
struct HeightField {
  double x = 0, y = 0;  // of the first corner
  double cell = 0;      // its width
  std::size_t columns = 0, rows = 0;
  std::vector<double> heights;  // by rows; rows * columns

  double at(double px, double py) const;
};

struct Ground {
  bool found = false;
  std::vector<char> is_ground;  // of each point: the ground's, or below it
  HeightField surface;
  double noise = 0;  // standard deviation of its points off the surface
};

// The lowest points of cells, coarse ones first, carry a thin plate whose weights are one-sided: what rises above it
// counts less and less (Kraus and Pfeifer, Determination of terrain models in wooded areas with airborne laser scanner
// data, ISPRS J. 53, 1998; coarse to fine as Pfeifer, Stadler and Briese 2001). At the end all points near the plate
// carry it, and those that are off it by no more than the noise are the ground's. There is a ground only if such points
// fill a connected area of many cells, as a thin layer: of a scan whose ground is cut off, or cells where crowns are
// the lowest that is seen, nothing is taken.
//
// `classes`: of a LAS file; those of class 2 are the ground then, and only they. Empty: unknown. `points` are distinct
// or not, z is up. The same for any number of threads.
Ground find_ground(const std::vector<Vec3>& points, const std::vector<std::uint8_t>& classes,
                   const Context& context = {});

}  // namespace bisector
