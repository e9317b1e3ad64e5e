#include "core/threads.h"

#include <pthread.h>

#include <oneapi/tbb/info.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "core/parallel.h"

namespace bisector {
namespace {

// For all to arrive; what has not by then is not waited for, for TBB does not promise that it comes.
constexpr std::chrono::milliseconds kPatience{200};

// Threads that wait until all are there.
class Crowd {
 public:
  ~Crowd() {
    {
      const std::lock_guard lock(mutex_);
      leave_ = true;
    }
    left_.notify_all();
    for (const pthread_t thread : threads_) pthread_join(thread, nullptr);
  }
  // Returns an error number.
  int add(std::size_t stack) {
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, stack);
    pthread_t thread{};
    const int error = pthread_create(&thread, &attributes, wait_in, this);
    pthread_attr_destroy(&attributes);
    if (error == 0) threads_.push_back(thread);
    return error;
  }

 private:
  static void* wait_in(void* crowd) {
    auto* self = static_cast<Crowd*>(crowd);
    std::unique_lock lock(self->mutex_);
    self->left_.wait(lock, [&] { return self->leave_; });
    return nullptr;
  }

  std::vector<pthread_t> threads_;
  std::mutex mutex_;
  std::condition_variable left_;
  bool leave_ = false;
};

void start() {
  // Of more than cores TBB makes no use.
  const unsigned threads = std::min(thread_count(), static_cast<unsigned>(tbb::info::default_concurrency()));
  if (threads < 2) return;
  {
    const std::size_t stack = tbb::global_control::active_value(tbb::global_control::thread_stack_size);
    Crowd crowd;
    for (unsigned k = 1; k < threads; ++k)
      if (const int error = crowd.add(stack))
        throw std::system_error(error, std::generic_category(), "a thread cannot be started");
  }
  // There is room for them, so TBB gets its own.
  std::atomic<unsigned> arrived = 0;
  const auto until = std::chrono::steady_clock::now() + kPatience;
  detail::for_each_chunk(threads, [&](std::size_t) {
    ++arrived;
    while (arrived < threads && std::chrono::steady_clock::now() < until) std::this_thread::yield();
  });
}

}  // namespace

void start_threads() {
  static std::once_flag started;
  std::call_once(started, start);
}

void start_threads(unsigned limit) {
  static const ThreadLimit* const for_good = new ThreadLimit(limit);
  static_cast<void>(for_good);
  start_threads();
}

}  // namespace bisector
