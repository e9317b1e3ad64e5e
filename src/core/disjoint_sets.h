// Which items hang together, as links between them become known (union-find; Tarjan 1975).
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace bisector {

// Sets of the items 0 to n - 1, each at first by itself.
template <class I = std::size_t>
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) {
    for (std::size_t i = 0; i < n; ++i) parent_[i] = static_cast<I>(i);
  }

  // The lowest item of the set that i is in.
  I root(I i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  bool is_root(I i) const { return parent_[i] == i; }

  // Makes one set of those that i and j are in; false if they were one already.
  bool join(I i, I j) {
    i = root(i);
    j = root(j);
    parent_[std::max(i, j)] = std::min(i, j);
    return i != j;
  }

 private:
  std::vector<I> parent_;
};

}  // namespace bisector
