#include "support/allocations.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace bisector::test {

thread_local std::size_t largest_allocation = 0;

}  // namespace bisector::test

using bisector::test::largest_allocation;

// Inlined, gcc takes them for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  largest_allocation = std::max(largest_allocation, size);
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  largest_allocation = std::max(largest_allocation, size);
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
