// How the terms of a cell are added.
#pragma once

#include <algorithm>
#include <vector>

#include "voronoi/moments.h"

namespace bisector {

// The rule of all sums over a cell: terms in ascending index of triangle or tetrahedron, by blocks of 32, the blocks'
// sums likewise.
class FixedTreeSum {
 public:
  void add(const Moments& term) {
    if (count_ % kSumBlock == 0) blocks_.push_back(term);
    else blocks_.back() += term;
    ++count_;
  }
  Moments finish() {
    for (std::size_t n = blocks_.size(); n > 1;) {
      std::size_t kept = 0;
      for (std::size_t begin = 0; begin < n; begin += kSumBlock) {
        Moments sum = blocks_[begin];
        for (std::size_t k = begin + 1; k < std::min(n, begin + kSumBlock); ++k) sum += blocks_[k];
        blocks_[kept++] = sum;
      }
      n = kept;
    }
    const Moments sum = blocks_.empty() ? Moments{} : blocks_[0];
    blocks_.clear();
    count_ = 0;
    return sum;
  }

 private:
  static constexpr std::size_t kSumBlock = 32;

  std::size_t count_ = 0;
  std::vector<Moments> blocks_;
};

}  // namespace bisector
