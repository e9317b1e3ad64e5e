// Which items hang together, as links between them become known (union-find; Tarjan 1975).
#pragma once

#include <algorithm>
#include <atomic>
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

// The same for links that many threads find. A root is hooked below a lower one by compare-and-swap; what another
// thread reads late is an ancestor still (Anderson and Woll 1991).
template <class I>
class ConcurrentSets {
 public:
  explicit ConcurrentSets(std::size_t n) : parent_(n) {
    for (std::size_t i = 0; i < n; ++i) parent_[i] = static_cast<I>(i);
  }

  // Makes one set of those that i and j are in; false if they were one already. Of all calls as many are true as there
  // are sets fewer, in whatever order they come.
  bool join(I i, I j) {
    for (;;) {
      i = root(i);
      j = root(j);
      if (i == j) return false;
      I high = std::max(i, j);
      if (at(high).compare_exchange_weak(high, std::min(i, j), std::memory_order_relaxed)) return true;
    }
  }

  // The lowest item of the set that i is in, while nothing is joined.
  I root(I i) {
    for (;;) {
      const I parent = at(i).load(std::memory_order_relaxed);
      if (parent == i) return i;
      const I above = at(parent).load(std::memory_order_relaxed);
      if (above != parent) at(i).store(above, std::memory_order_relaxed);
      i = above;
    }
  }

 private:
  std::atomic_ref<I> at(I i) { return std::atomic_ref<I>(parent_[i]); }

  std::vector<I> parent_;
};

}  // namespace bisector
