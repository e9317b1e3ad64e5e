// Uniform hashed grids over the seeds, on the device (kernels/grid.glsl).
#pragma once

#include <cstdint>

#include "host/device/commands.h"
#include "host/passes/scan.h"
#include "kernels/layout/push.h"
#include "voronoi/neighbours.h"

namespace bisector::host {

class SeedGrid {
 public:
  explicit SeedGrid(Device& device) : ends_(device), slots_(device) {}

  // Chooses cells of about `cell` (a length on the host) for the seeds and reserves memory; not while commands are
  // recorded.
  void plan(const SortedSeeds& seeds, double cell, double scale, Scan& scan);
  // Records the sorting of the seeds into buckets.
  void record(Commands& commands, const Buffer& seeds, bool is_double, Scan& scan);

  const GridPush& push() const { return push_; }
  const Buffer& ends() const { return ends_; }
  const Buffer& slots() const { return slots_; }

 private:
  GridPush push_{};
  Buffer ends_, slots_;
};

// About how far apart seeds lie, if they lie on a surface, or else in a solid: the median for a sample. It depends on
// the seeds alone, not on what was computed before.
double typical_spacing(const std::vector<Vec3>& seeds, bool in_solid);

}  // namespace bisector::host
