// Wall-clock time.
#pragma once

#include <chrono>

namespace bisector {

class Stopwatch {
 public:
  // Seconds since the stopwatch was made.
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  // Seconds since the last call, or since the stopwatch was made.
  double lap() {
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - lap_).count();
    lap_ = now;
    return seconds;
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now(), lap_ = start_;
};

}  // namespace bisector
