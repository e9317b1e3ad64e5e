// The last rung: what a device could not certify, in exact arithmetic on the CPU.
#pragma once

#include <vector>

#include "core/parallel.h"
#include "host/passes/seeds.h"
#include "voronoi/neighbours.h"

namespace bisector::host {

class ExactRung {
 public:
  // `in_solid`: seeds lie in space, not on a surface.
  explicit ExactRung(bool in_solid) : in_solid_(in_solid) {}

  // For new seeds. Lists come from `neighbours` if given, else they are grown on demand.
  void begin(const DeviceSeeds& seeds, const Neighbours* neighbours);
  // The slots that own the points.
  std::vector<Index> owners(const std::vector<Vec3>& points);
  // Neighbours that can answer Neighbours::nearest_to(). The first call is not for several threads at once; what
  // for_each() visits may make others.
  const Neighbours& neighbours();
  // Calls visit(k, clipper) for k < count, with a clipper (voronoi/clip.h, clip_tet.h) that knows the seeds, in
  // parallel.
  template <class Clipper, class Visit>
  void for_each(std::size_t count, const Visit& visit, std::size_t chunk = 64) {
    const Neighbours& near = neighbours();
    const SortedSeeds& seeds = seeds_->on_host();
    parallel_chunks(count, chunk, [&](std::size_t, std::size_t begin, std::size_t end) {
      Clipper clipper;
      if constexpr (requires { clipper.reset(seeds, near); }) clipper.reset(seeds, near);
      else clipper.reset(seeds);
      for (std::size_t k = begin; k < end; ++k) visit(k, clipper);
    });
  }

 private:
  bool in_solid_;
  const DeviceSeeds* seeds_ = nullptr;
  const Neighbours* given_ = nullptr;
  Neighbours own_;
  bool built_ = false;
};

}  // namespace bisector::host
