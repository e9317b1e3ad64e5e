// The seeds of one evaluation on the device.
#pragma once

#include <functional>
#include <vector>

#include "host/device/buffer.h"
#include "host/device/commands.h"
#include "voronoi/neighbours.h"

namespace bisector::host {

class DeviceSeeds {
 public:
  explicit DeviceSeeds(Device& device) : given(device), order(device), words(device), doubles(device), ids(device) {}

  // Takes seeds into slots in a spatial order. They must stay where they are until the next call.
  void sort(const std::vector<Vec3>& seeds);
  // Takes seeds that keep the slots of the last ones. False if they are not as many, or slots are in no spatial order
  // any more: then they have to be sorted.
  bool follow(const std::vector<Vec3>& seeds);
  // Takes seeds that are in `given` already, as many as the last ones, and keep their slots. `fetch` brings their
  // positions if the host needs them.
  void take_resident(std::function<std::vector<Vec3>()> fetch);

  // How many slots there are, and how many seeds, of which some may be equal.
  std::size_t count() const { return sorted_.id.size(); }
  std::size_t given_count() const { return sorted_.slot.size(); }
  bool are_resident() const { return static_cast<bool>(fetch_); }
  const std::vector<Vec3>& positions() const;  // in the caller's order
  Index id(std::size_t slot) const { return sorted_.id[slot]; }
  Index slot(std::size_t id) const { return sorted_.slot[id]; }
  const std::vector<Index>& all_ids() const { return sorted_.id; }
  // As the CPU's passes need them. The first call since the seeds were taken is not for several threads at once.
  const SortedSeeds& on_host() const;

  double scale = 1;    // of lengths on the device
  double largest = 0;  // absolute coordinate on the device, of seeds and domain
  float residual = 0;  // what a difference of two positions may lack in single precision; 0 in double
  Buffer given;        // positions in the caller's order
  Buffer order;        // by slot: the caller's index
  Buffer words;        // positions by slot, in the backend's precision
  Buffer doubles;      // the same in double, for a backend in single precision that may use it
  Buffer ids;          // by slot: the caller's index, and the low words of the coordinates as doubles

 private:
  double step_between_slots(const std::vector<Vec3>& seeds) const;

  mutable const std::vector<Vec3>* seeds_ = nullptr;  // null: resident and not fetched yet
  std::function<std::vector<Vec3>()> fetch_;          // of resident seeds
  mutable std::vector<Vec3> fetched_;
  mutable SortedSeeds sorted_;  // `x` and `extent` are set when they are needed
  mutable bool on_host_ = false;
  double sorted_step_ = 0;  // between slots when they were sorted
};

}  // namespace bisector::host
