// More, fewer and better placed regions: insertion, merging, deletion and teleportation (thesis 2.3.2; Cohen-Steiner,
// Alliez and Desbrun 2004).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "core/parallel.h"
#include "segment/flood.h"
#include "segment/lloyd.h"

namespace bisector {

class PartitionEditor {
 public:
  // `most_evaluations`: of distances, from which on there are no further teleportations.
  PartitionEditor(Lloyd& lloyd, int iterations, std::size_t most_evaluations);

  // Adds a region about the triangle that is farthest from its proxy, in an invalid region or else the one of most
  // energy (thesis, "Proxy insertion"), and iterates. False: every region is a single triangle or exact.
  bool insert_farthest(Partition& partition);
  // Merges the pair of neighbours that costs least if that is below half the largest energy of a region and the union
  // has a valid proxy (thesis, "Proxy merging"), and iterates.
  bool merge_redundant(Partition& partition);
  // Divides the region that gains most by it, and others that gain nearly as much and are no neighbours of one that is
  // divided: at most `most`, and only until the energy is likely to be `enough`. Where none gains, those of most
  // energy. Then iterates. False: every region is a single triangle or exact.
  bool divide_best(Partition& partition, std::size_t most, double enough);
  // Removes the region that costs least, and others elsewhere that cost hardly more: at most `most`, while the energy
  // stays at most so large. Iterates a little. False: none can go.
  bool remove_cheapest(Partition& partition, std::size_t most, double most_energy);
  // Moves regions from where they are hardly missed to where they gain most, as long as the energy falls.
  void teleport(Partition& partition);

 private:
  struct Division {
    double gain = 0;          // not positive where each division raises the energy
    std::vector<Index> part;  // the triangles of the new region
    std::array<Proxy, 2> proxies;
    std::array<Index, 2> seeds{};
  };
  struct Removal {
    double cost = 0;
    Index region = kNone, into = kNone;  // kNone: shared out among the neighbours
  };

  // Of one deletion: its neighbours' versions and what it costs with them.
  struct Deletion {
    std::vector<std::uint64_t> around;
    double cost = 0;
  };
  using Versions = std::pair<std::uint64_t, std::uint64_t>;
  struct VersionsHash {
    std::size_t operator()(const Versions& v) const { return v.first * 0x9e3779b97f4a7c15u ^ v.second; }
  };

  // Room for trials in one region, as large as the mesh; each thread has its own.
  struct Trial {
    explicit Trial(const SegmentDomain& domain)
        : labels(domain.triangles.size(), kBlocked), distances(labels.size()), flooding(domain) {}
    static constexpr Index kBlocked = 2;  // label of what is outside the region
    std::vector<Index> labels;
    std::vector<double> distances;
    Flooding flooding;
    std::size_t evaluations = 0;
  };

  const Division& division(const Partition& partition, Index region) const;
  // Finds the divisions that are not known yet: of regions that may gain `least`, and where that is 0, in descending
  // order of what they may gain, until no other can gain nearly as much as the best. Returns the gains of those that
  // are known, the largest first.
  std::vector<std::pair<double, Index>> best_divisions(const Partition& partition, double least);
  void find_divisions(const Partition& partition, const std::vector<Index>& regions);
  Division find_division(const Partition& partition, Index region, Trial& trial) const;
  // Lloyd's iteration in one region from the division's proxies and seeds, as long as it gains.
  void improve_division(const Partition& partition, Index region, int steps, Division& division, Trial& trial) const;
  double merging_cost(const Partition& partition, Index a, Index b, Trial& trial) const;
  double deletion_cost(const Partition& partition, Index region, std::size_t& evaluations) const;
  std::vector<Removal> removals(const Partition& partition);  // the cheapest first
  // Forgets what is known of other regions than those of the partition, once that is most of it.
  void forget_others(const Partition& partition);
  // Removals must not touch each other's regions, nor the neighbours of one that is shared out.
  void remove(const std::vector<Removal>& removals, Partition& partition, PartitionUndo& undo);
  void share_out(const std::vector<Index>& deleted, Partition& partition, std::vector<Index>& grown);
  void divide(const std::vector<Index>& regions, Partition& partition, PartitionUndo& undo);

  Lloyd& lloyd_;
  int iterations_;
  std::size_t most_evaluations_;
  ThreadLocal<Trial> trials_;
  std::unordered_map<std::uint64_t, Division> divisions_;        // by version
  std::unordered_map<std::uint64_t, Deletion> deletions_;        // by version
  std::unordered_map<Versions, double, VersionsHash> mergings_;  // by versions, the lower first
};

}  // namespace bisector
