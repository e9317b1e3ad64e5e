// How much memory a backend asks for at first. What turns out too small grows; tests ask for too little on purpose.
#pragma once

#include <cstddef>

namespace bisector::host {

struct Capacities {
  double batch_pairs = 1 << 17;                  // that a batch of facets or tetrahedra is expected to have
  std::size_t table = std::size_t{1} << 19;      // entries of the set of a batch's pairs; a power of two
  std::size_t proposals = std::size_t{1} << 20;  // of one batch
  std::size_t pairs = 0;                         // of all batches; 0: by what is expected
};

}  // namespace bisector::host
