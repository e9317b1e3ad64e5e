// The one place that decides how loops are scheduled. Chunks never depend on the number of threads, and sums follow a
// fixed tree, so results are the same bit for bit however many cores take part.
#pragma once

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#if defined(__SANITIZE_THREAD__)
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#endif

namespace bisector {

// Limits the threads of all loops while it lives; 0 means all cores.
class ThreadLimit {
 public:
  explicit ThreadLimit(unsigned threads)
      : control_(tbb::global_control::max_allowed_parallelism,
                 threads ? threads : tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)) {}

 private:
  tbb::global_control control_;
};

inline unsigned thread_count() {
  return static_cast<unsigned>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

namespace detail {
#if defined(__SANITIZE_THREAD__)
// TBB's own library is not instrumented, and the thread sanitizer reports its hand-overs as races; plain threads show
// the races between bodies and nothing else.
template <class Body>
void for_each_chunk(std::size_t chunks, const Body& body) {
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::once_flag first_failure;
  const auto work = [&] {
    try {
      for (std::size_t c; (c = next++) < chunks;) body(c);
    } catch (...) {
      std::call_once(first_failure, [&] { failure = std::current_exception(); });
    }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 1; t < thread_count(); ++t) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}
#else
template <class Body>
[[gnu::noinline]] void run_chunk(const Body& body, std::size_t c) {
  body(c);
}

template <class Body>
void for_each_chunk(std::size_t chunks, const Body& body) {
  // TBB would ask for threads all the same, and start them once a limit of one has ended.
  if (thread_count() == 1)
    for (std::size_t c = 0; c < chunks; ++c) run_chunk(body, c);
  else tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) { run_chunk(body, c); });
}
#endif
}  // namespace detail

// Calls body(chunk, begin, end) for every chunk of `size` consecutive items of [0, n).
template <class Body>
void parallel_chunks(std::size_t n, std::size_t size, const Body& body) {
  const std::size_t chunks = (n + size - 1) / size;
  if (chunks <= 1) {
    if (n) body(std::size_t{0}, std::size_t{0}, n);
    return;
  }
  detail::for_each_chunk(chunks, [&](std::size_t c) { body(c, c * size, std::min(n, (c + 1) * size)); });
}

// Calls body(i) for every i of [0, n).
template <class Body>
void parallel_each(std::size_t n, const Body& body, std::size_t grain = 1024) {
  parallel_chunks(n, grain, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

// Sum of term(i) over [0, n) by the one rule of sums: blocks of 32 terms in order, the blocks' sums likewise, until one
// is left. T is a number or has +=. It is the value T{} if there are no terms.
template <class T = double, class Term>
T fixed_sum(std::size_t n, const Term& term) {
  constexpr std::size_t kBlock = 32;
  const auto block_sum = [](std::size_t begin, std::size_t end, const auto& at) {
    T sum = at(begin);
    for (std::size_t i = begin + 1; i < end; ++i) sum += at(i);
    return sum;
  };
  std::vector<T> sums((n + kBlock * kBlock - 1) / (kBlock * kBlock));
  parallel_chunks(n, kBlock * kBlock, [&](std::size_t c, std::size_t begin, std::size_t end) {
    const auto block = [&](std::size_t k) {
      const std::size_t first = begin + k * kBlock;
      return block_sum(first, std::min(end, first + kBlock), term);
    };
    sums[c] = block_sum(0, (end - begin + kBlock - 1) / kBlock, block);
  });
  while (sums.size() > 1) {
    const std::size_t blocks = (sums.size() + kBlock - 1) / kBlock;
    for (std::size_t k = 0; k < blocks; ++k)
      sums[k] = block_sum(k * kBlock, std::min(sums.size(), (k + 1) * kBlock), [&](std::size_t i) { return sums[i]; });
    sums.resize(blocks);
  }
  return sums.empty() ? T{} : sums[0];
}

// Sorts by a strict total order.
template <class T, class Less>
void sort_in_parallel(std::vector<T>& values, const Less& less) {
#if defined(__SANITIZE_THREAD__)
  std::sort(values.begin(), values.end(), less);
#else
  if (thread_count() == 1) std::sort(values.begin(), values.end(), less);
  else tbb::parallel_sort(values.begin(), values.end(), less);
#endif
}

template <class T>
using ThreadLocal = tbb::enumerable_thread_specific<T>;

}  // namespace bisector
