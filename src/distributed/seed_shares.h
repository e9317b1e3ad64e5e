// Which seeds each rank knows.
#pragma once

#include <string>
#include <vector>

#include "core/geometry.h"

namespace bisector {

// Kept by the rank that has all seeds.
class SeedShares {
 public:
  // The message for a rank that needs all seeds in `box` enlarged by `halo`. Those of the last time are sent again, at
  // their new positions, as long as they serve.
  std::string share(int rank, const Box& box, double halo, const std::vector<Vec3>& seeds);
  // The seeds that each rank has, ascending.
  std::vector<std::vector<Index>> all() const;

 private:
  struct Share {
    std::vector<Index> seeds;
    std::vector<char> has;  // of each seed
  };
  std::vector<Share> shares_;
};

}  // namespace bisector
