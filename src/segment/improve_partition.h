// More, fewer and better placed regions: insertion, merging, deletion and teleportation (thesis 2.3.2; Cohen-Steiner,
// Alliez and Desbrun 2004).
#pragma once

#include <cstddef>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "segment/lloyd.h"

namespace bisector {

class PartitionEditor {
 public:
  explicit PartitionEditor(Lloyd& lloyd, int iterations) : lloyd_(lloyd), iterations_(iterations) {}

  // Adds a region about the triangle that is farthest from its proxy, in an invalid region or else the one of most
  // energy (thesis, "Proxy insertion"), and iterates. False: every region is a single triangle or exact.
  bool insert_farthest(Partition& partition);
  // Merges the pair of neighbours that costs least if that is below half the largest energy of a region and the union
  // has a valid proxy (thesis, "Proxy merging"), and iterates.
  bool merge_redundant(Partition& partition);
  // Divides the region that gains most by it, and others that gain nearly as much and are no neighbours of one that is
  // divided: at most `most`, and only until the energy is likely to be `enough`. Then iterates. False: none gains.
  bool divide_best(Partition& partition, std::size_t most, double enough);
  // Removes the region that costs least, and others elsewhere that cost hardly more: at most `most`, while the energy
  // stays at most so large. Iterates a little. False: none can go.
  bool remove_cheapest(Partition& partition, std::size_t most, double most_energy);
  // Moves regions from where they are hardly missed to where they gain most, as long as the energy falls.
  void teleport(Partition& partition);

  std::size_t insertions = 0, merges = 0, deletions = 0, teleportations = 0;

 private:
  struct Division {
    double gain = 0;
    std::vector<Index> part;  // the triangles of the new region
    std::array<Proxy, 2> proxies;
    std::array<Index, 2> seeds{};
  };
  struct Removal {
    double cost = 0;
    Index region = kNone, into = kNone;  // kNone: shared out among the neighbours
  };

  // Labels and distances of all triangles for trials in one region.
  struct Trial {
    std::vector<Index> labels;
    std::vector<double> distances;
    std::size_t evaluations = 0;
  };

  const Division& division(const Partition& partition, Index region) const;
  // Finds the divisions of all regions that are not known yet.
  void find_divisions(const Partition& partition);
  Division find_division(const Partition& partition, Index region, Trial& trial) const;
  // Lloyd's iteration in one region from the division's proxies and seeds, as long as it gains.
  void divide(const Partition& partition, Index region, int steps, Division& division, Trial& trial) const;
  // `distances`: room for one of each triangle.
  double merging_cost(const Partition& partition, Index a, Index b, std::vector<double>& distances,
                      std::size_t& evaluations) const;
  double deletion_cost(const Partition& partition, Index region, std::size_t& evaluations) const;
  std::vector<Removal> removals(const Partition& partition);  // the cheapest first
  // Removals must not touch each other's regions, nor the neighbours of one that is shared out.
  Partition without(const Partition& partition, const std::vector<Removal>& removals);
  Partition divided(const Partition& partition, const std::vector<Index>& regions);

  Lloyd& lloyd_;
  int iterations_;
  std::unordered_map<std::uint64_t, Division> divisions_;              // by version
  std::map<std::pair<std::uint64_t, std::uint64_t>, double> merging_;  // by versions, the lower first
};

}  // namespace bisector
