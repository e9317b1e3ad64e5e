// What an evaluation on a device starts with, whatever its domain: the seeds on the device in a spatial order, and
// lists of their neighbours.
#pragma once

#include <functional>
#include <memory>

#include "backend/backend.h"
#include "host/passes/exact_rung.h"
#include "host/passes/neighbour_pass.h"
#include "host/passes/scan.h"
#include "host/passes/seeds.h"
#include "host/passes/vulkan_backend.h"
#include "kernels/layout/counters.h"
#include "kernels/layout/pairs.h"

namespace bisector::host {

// The precision that a backend computes in, and whether single precision may hand work to the double kernels.
struct Precisions {
  bool is_double, double_rung;
};
// Throws DeviceError if double precision is asked for and the device lacks it.
Precisions choose_precisions(const Device& device, Precision asked, bool double_rung);

class SeedStage {
 public:
  // `box` is the domain's; `in_solid`: seeds lie in space, not on a surface.
  SeedStage(std::shared_ptr<Device> device, const Precisions& precisions, const VulkanOptions& options, double scale,
            const Box& box, bool in_solid);

  // Whether all seeds have coordinates that single precision can square. To be asked before begin().
  bool within_reach(const std::vector<Vec3>& seeds);
  // Takes new seeds; those as many as the last ones keep their slots as long as their order in space is good enough.
  void begin(const std::vector<Vec3>& seeds);
  // The same for seeds that are in `seeds.given` already, as many as the last ones; `fetch` brings them if they are
  // needed on the host. No coordinate may be larger than `seeds.largest`.
  void begin_resident(const std::function<std::vector<Vec3>()>& fetch);
  // Sees to it that the next evaluation of resident seeds finds slots for so many, in a spatial order for these
  // positions.
  void renew_slots(const std::vector<Vec3>& seeds);
  // Records the upload, and the search for lists if they are not from the host.
  void record();
  // Whether slots mean other seeds than in the last evaluation.
  bool sorted_anew() const { return !followed_; }
  // To be called once what was recorded has run. If seeds that kept their slots have come to coincide, sorts all anew
  // and returns false: then all has to be recorded again.
  bool keeps_slots(const Counters& counters);
  // Runs what is recorded and reads the counters behind those of work.
  Counters run_counted();
  // Sets the step masses that are negative, for the device does not know them.
  void complete_step_masses(CellMoments& moments);

  BackendDescription description() const;
  Device& device() { return *device_; }
  bool is_double() const { return double_; }
  bool has_double_rung() const { return double_rung_; }
  bool delaunay() const { return source_ == NeighbourSource::delaunay; }
  double lists_seconds() const { return lists_seconds_; }  // on the host

 private:
  bool given_as_doubles() const { return double_ || double_rung_; }
  std::size_t given_bytes(std::size_t count) const;
  void place_seeds();
  void upload_seeds();

  std::shared_ptr<Device> device_;
  bool double_, double_rung_;
  NeighbourSource source_;
  Box box_;
  bool followed_ = false, order_uploaded_ = false;
  bool distinct_ = false;           // no two slots are of equal seeds
  bool renewed_ = false;            // slots mean other seeds than in the last evaluation
  std::vector<Vec3> brought_back_;  // resident seeds that had to be sorted
  double lists_seconds_ = 0;
  Neighbours rings_;

 public:
  // What the passes work with.
  Commands commands;
  Scan scan;
  Buffer counters;
  DeviceSeeds seeds;
  NeighbourPass neighbours;
  ExactRung exact;
};

}  // namespace bisector::host
