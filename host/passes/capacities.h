// How much memory a backend asks for at first. What turns out too small grows; tests ask for too little on purpose.
#pragma once

#include <cstddef>

namespace bisector::host {

// 0: by what is expected, within what the device has.
struct Capacities {
  double batch_pairs = 0;     // that a batch of facets or tetrahedra is expected to have
  std::size_t table = 0;      // entries of the set of a batch's pairs; a power of two
  std::size_t proposals = 0;  // of one batch
  std::size_t flagged = 0;    // pairs of one batch in each list of those that climb a rung
  std::size_t pairs = 0;      // of all batches
  std::size_t at_once = 0;    // pairs that one dispatch clips at most
  std::size_t wide = 0;       // entries of wider lists of neighbours
};

}  // namespace bisector::host
