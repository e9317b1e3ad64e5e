// A set of indices that is emptied at no cost.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/mesh.h"

namespace bisector {

// Each index bears the number of the round in which it was marked last.
class Marks {
 public:
  // Starts with no index below `size` marked.
  void begin(std::size_t size) {
    if (rounds_.size() != size || now_ == kNone - 1) {
      rounds_.assign(size, 0);
      now_ = 0;
    }
    ++now_;
  }
  // Marks k. False if it was marked already.
  bool mark(Index k) {
    if (rounds_[k] == now_) return false;
    rounds_[k] = now_;
    return true;
  }
  bool has(Index k) const { return rounds_[k] == now_; }

 private:
  std::vector<Index> rounds_;
  Index now_ = 0;
};

}  // namespace bisector
