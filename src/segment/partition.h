// The regions of a mesh with their proxies, and how to take changes to some of them back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

struct RegionFit {
  double energy = 0;       // sum of distance_to over the region
  bool invalid = false;    // the best quadric is no surface of its own (is_invalid)
  SurfaceMoments moments;  // of the region
  // Differs for every pair of a set of triangles and a proxy, so that costs can be kept by it.
  std::uint64_t version = 0;
};

// Work on some regions costs as much as these have triangles: nothing here is to be gone through as a whole but once.
struct Partition {
  std::vector<Index> labels;
  std::vector<double> distances;               // distance_to of each triangle and its region's proxy
  std::vector<std::vector<Index>> triangles;   // of each region, ascending
  std::vector<std::vector<Index>> neighbours;  // of each region those that share an edge with it, ascending
  std::vector<Proxy> proxies;                  // of each region
  std::vector<RegionFit> fits;                 // of each region
  std::vector<char> changed;  // of each region: whether its triangles or its proxy changed in the last step

  std::size_t count() const { return triangles.size(); }
  double energy() const;
  void resize(std::size_t count);

  // Sorted, without repetitions: the triangles of some regions.
  std::vector<Index> triangles_of(const std::vector<Index>& regions) const;
  // Gives regions the triangles that are labelled so. `among`: all of these, ascending, and no others.
  void relist(const std::vector<Index>& regions, const std::vector<Index>& among);
  // Before and after the triangles of regions change: takes them out of others' neighbours, and puts them back in.
  void disconnect(const std::vector<Index>& regions);
  void connect(const SegmentDomain& domain, const std::vector<Index>& regions);
};

// Keeps what regions were before they are changed. Regions added later, above those there were, need not be kept.
class PartitionUndo {
 public:
  explicit PartitionUndo(const Partition& partition) : count_(partition.count()), changed_(partition.changed) {}

  // To be called before a region's triangles, distances or proxy change; of several calls the first counts.
  void keep(const Partition& partition, Index region);
  void keep(const Partition& partition, const std::vector<Index>& regions);
  // What was kept by another one since, unless it was kept before.
  void add(PartitionUndo&& later);
  // The triangles that a region had, which was kept.
  const std::vector<Index>& triangles(Index region) const { return kept_[at_[region]].triangles; }
  // By how much the distances of all triangles of the regions that were kept have grown.
  double growth(const Partition& partition) const;
  // Takes back labels and distances only.
  void restore_labels(Partition& partition) const;
  void restore(const SegmentDomain& domain, Partition& partition);

 private:
  struct Kept {
    Index region;
    Proxy proxy;
    RegionFit fit;
    std::vector<Index> triangles;
    std::vector<double> distances;  // of these triangles
  };

  std::size_t count_;
  std::vector<char> changed_;
  std::vector<Kept> kept_;
  std::vector<Index> at_;  // of each region, its place in kept_
};

}  // namespace bisector
