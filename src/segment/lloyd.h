// Lloyd's iteration for regions and their proxies (thesis 2.3.2).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "segment/flood.h"
#include "segment/partition.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

struct FittedProxy {
  Proxy proxy;
  RegionFit fit;
};

// What a run counts.
struct SegmentCounts {
  int iterations = 0;
  std::size_t evaluations = 0, insertions = 0, merges = 0, deletions = 0, teleportations = 0;
  std::uint64_t versions = 0;
  std::vector<std::vector<double>> energies;  // of each Lloyd iteration, after each step

  void add(const SegmentCounts& others);
};

class Lloyd {
 public:
  Lloyd(const SegmentDomain& domain, SegmentSurfaces surfaces, const Context& context)
      : domain_(domain), surfaces_(surfaces), context_(context), flooding_(domain), moves_(domain) {}

  // Regions and proxies for labels 0 .. count - 1.
  Partition fit(std::vector<Index> labels, std::size_t count);
  // Fits some regions of a partition anew.
  void fit(const std::vector<Index>& regions, Partition& partition);
  // The best proxy for some triangles, of which these are the moments; `old`, where there is one, if none has less
  // energy. `distances`, of all triangles, are read for `old` and written. `tori`: whether to try those, which are
  // dear. Adds the distances that were taken to `evaluations`; the version is the caller's to give. May be called for
  // several regions at once.
  FittedProxy refit(const std::vector<Index>& triangles, const SurfaceMoments& moments, const Proxy* old,
                    std::vector<double>& distances, std::size_t& evaluations, bool tori = true) const;
  // Flooding and fitting, at most so many times, as long as the energy falls. It falls at each step: a flooding that
  // would raise it is replaced by moves of single triangles at borders, and a proxy is exchanged only for a better one.
  // Regions that neither changed nor border on such are left out. `fresh`: where the regions may not have found their
  // places yet, they are flooded at first and now and then; otherwise only where moves at borders gain little.
  void iterate(Partition& partition, int iterations, bool fresh = true);
  // The same with one flooding only, and moves at borders after that; gives up where steps as large as the last would
  // not bring the energy below `goal`. `undo` takes it back.
  void try_out(Partition& partition, int iterations, double goal, PartitionUndo& undo);
  // The one of some triangles, at least one, that is nearest its proxy by the distances of all.
  Index seed(const std::vector<Index>& triangles, const std::vector<double>& distances) const;
  // Shares out some triangles among regions, from these regions' seeds; lists stay as they are.
  void flood(const std::vector<Index>& regions, const std::vector<Index>& triangles, Partition& partition);

  const SegmentDomain& domain() const { return domain_; }
  const Context& context() const { return context_; }
  SegmentSurfaces surfaces() const { return surfaces_; }
  SegmentCounts counts;

 private:
  // `undo`: of a caller who may take the step back.
  bool step(Partition& partition, bool flooding, PartitionUndo* undo = nullptr);
  // Moves the borders of the regions that changed and of those around. Returns the regions whose triangles may have
  // changed, ascending.
  std::vector<Index> move_borders(Partition& partition, bool flooding, PartitionUndo& undo);
  // Fits some regions at once; `refit_one` gives a region's proxy and adds to its evaluations.
  template <class Refit>
  void refit_all(const std::vector<Index>& regions, Partition& partition, const Refit& refit_one);

  const SegmentDomain& domain_;
  SegmentSurfaces surfaces_;
  const Context& context_;
  Flooding flooding_;
  BorderMoves moves_;
};

}  // namespace bisector
