// The cells that own points: mesh vertices and samples.
#pragma once

#include <vector>

#include "host/passes/exact_rung.h"
#include "host/passes/neighbour_pass.h"
#include "host/passes/seeds.h"

namespace bisector::host {

class OwnerPass {
 public:
  OwnerPass(Device& device, bool is_double);

  // Records the upload of new points. Their owners are looked for from scratch at first.
  void set_points(Commands& commands, std::vector<Vec3> points, double scale);
  // Forgets the last owners, whose slots no longer mean the same seeds.
  void forget() { from_scratch_ = true; }
  // Records the search. With `report`, points without a certain owner are listed; else they are left with none.
  void record(Commands& commands, const DeviceSeeds& seeds, const SeedTree& tree, const Buffer& counters, bool report);
  // Once that has run: finds the owners of the `uncertain` points that were listed in exact arithmetic, and records
  // their upload.
  void complete(Commands& commands, std::size_t uncertain, ExactRung& exact);

  const Buffer& owners() const { return owners_; }

 private:
  bool double_;
  std::vector<Vec3> points_;
  Buffer positions_;
  Buffer owners_;  // the last ones are where the search for the next begins
  Buffer uncertain_, found_;
  bool from_scratch_ = true;
};

}  // namespace bisector::host
