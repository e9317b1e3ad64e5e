// The last rung: what a device could not certify, in exact arithmetic on the CPU.
#pragma once

#include <vector>

#include "bisector/voronoi/clip.h"
#include "bisector/voronoi/neighbours.h"
#include "bisector/voronoi/surface.h"

namespace bisector::host {

struct ExactPolygon {
  bool empty = true;
  Moments moments;
  std::vector<Index> labels;  // in cyclic order: slots or facet edges
};

class ExactRung {
 public:
  explicit ExactRung(const Surface& surface) : surface_(surface) {}

  // For new seeds. Lists come from `neighbours` if given, else they are grown on demand from a few times `spacing`.
  void begin(const SortedSeeds& seeds, const Neighbours* neighbours, double spacing);
  // The slots that own the sites.
  std::vector<Index> owners(const std::vector<Index>& sites);
  // The parts of facets that lie in cells, for entries (facet, slot).
  struct Item {
    Index facet, slot;
  };
  std::vector<ExactPolygon> clip(const std::vector<Item>& items);
  // Neighbours that can answer Neighbours::nearest_to().
  const Neighbours& neighbours();

 private:
  const Surface& surface_;
  const SortedSeeds* seeds_ = nullptr;
  const Neighbours* given_ = nullptr;
  Neighbours own_;
  double spacing_ = 0;
  bool built_ = false;
};

}  // namespace bisector::host
