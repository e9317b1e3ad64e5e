// The totals of a diagram's cells, by the one rule of sums.
#pragma once

#include "core/parallel.h"
#include "voronoi/diagram.h"

namespace bisector {

// Sets the mass and the energy from the cells.
inline void set_totals(CellMoments& moments) {
  struct Totals {
    double mass = 0, energy = 0;
    Totals& operator+=(const Totals& b) {
      mass += b.mass;
      energy += b.energy;
      return *this;
    }
  };
  const Totals totals = fixed_sum<Totals>(moments.cells.size(), [&](std::size_t i) {
    return Totals{moments.cells[i].mass, moments.cells[i].second};
  });
  moments.mass = totals.mass;
  moments.energy = totals.energy;
}

}  // namespace bisector
