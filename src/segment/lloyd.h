// Lloyd's iteration for regions and their proxies (thesis 2.3.2).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

struct RegionProxy {
  Proxy proxy;
  double energy = 0;       // sum of distance_to over the region
  bool invalid = false;    // the best quadric is no surface of its own (is_invalid)
  SurfaceMoments moments;  // of the region
  std::uint64_t version =
      0;  // differs for every pair of a set of triangles and a proxy, so that costs can be kept by it
};

struct Partition {
  std::vector<Index> labels;
  std::vector<double> distances;  // distance_to of each triangle and its region's proxy
  std::vector<RegionProxy> regions;
  std::vector<char> changed;  // of each region: whether its triangles or its proxy changed in the last step
  Csr<Index> triangles;       // of each region

  double energy() const;
};

// What a run counts.
struct SegmentCounts {
  int iterations = 0;
  std::size_t evaluations = 0;
  std::uint64_t versions = 0;
  std::vector<std::vector<double>> energies;  // of each Lloyd iteration, after each step
};

class Lloyd {
 public:
  Lloyd(const SegmentDomain& domain, SegmentSurfaces surfaces, const Context& context)
      : domain_(domain), surfaces_(surfaces), context_(context) {}

  // Regions and proxies for labels 0 .. count - 1. Regions of the same triangles as one of `known` take its proxy.
  Partition fit(std::vector<Index> labels, std::size_t count, const Partition* known = nullptr);
  // The best proxy for some triangles, of which these are the moments; `old`, where there is one, if none has less
  // energy. `distances`, of all triangles, are read for `old` and written. `tori`: whether to try those, which are
  // dear. Adds the distances that were taken to `evaluations`; the version is the caller's to give. May be called for
  // several regions at once.
  RegionProxy refit(const Index* begin, const Index* end, const SurfaceMoments& moments, const RegionProxy* old,
                    std::vector<double>& distances, std::size_t& evaluations, bool tori = true) const;
  // Flooding and fitting, at most so many times, as long as the energy falls. It falls at each step: a flooding that
  // would raise it is replaced by moves of single triangles at borders, and a proxy is exchanged only for a better one.
  // Regions that neither changed nor border on such are left out.
  void iterate(Partition& partition, int iterations);
  // The same with one flooding only, and moves at borders after that; gives up where steps as large as the last would
  // not bring the energy below `goal`.
  void try_out(Partition& partition, int iterations, double goal);
  // The triangle of a region nearest its proxy.
  Index seed(const Partition& partition, Index region) const;
  std::vector<Proxy> proxies(const Partition& partition) const;

  const SegmentDomain& domain() const { return domain_; }
  const Context& context() const { return context_; }
  SegmentSurfaces surfaces() const { return surfaces_; }
  SegmentCounts counts;

 private:
  bool step(Partition& partition, bool flooding);
  // Fits some regions at once; `refit_one` gives a region's proxy and adds to its evaluations.
  template <class Refit>
  void refit_all(const std::vector<Index>& regions, Partition& partition, const Refit& refit_one);

  const SegmentDomain& domain_;
  SegmentSurfaces surfaces_;
  const Context& context_;
};

}  // namespace bisector
