// What a caller passes down a pipeline: progress, warnings and cancellation. There are no global ones.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "bisector/error.h"

namespace bisector {

class Checkpoint;

struct Progress {
  std::string phase;   // "level 1/3", "on the surface", ...
  int iteration = 0;   // within the phase
  int iterations = 0;  // at most, within the phase
  double energy = 0;
  double gradient_norm = 0;
  double fraction = 0;  // of the whole run, in [0, 1], estimated
};

struct Context {
  std::function<void(const Progress&)> progress;    // may be empty
  std::function<void(const std::string&)> warning;  // one line each; may be empty
  const std::atomic<bool>* cancel = nullptr;        // may be null; polled at phase boundaries
  Checkpoint* checkpoint = nullptr;                 // may be null (bisector/checkpoint.h)

  void report(const Progress& p) const {
    if (progress) progress(p);
  }
  void warn(const std::string& line) const {
    if (warning) warning(line);
  }
  // Throws Cancelled if the caller asked to stop.
  void check() const {
    if (cancel && cancel->load(std::memory_order_relaxed)) throw Cancelled();
  }
};

}  // namespace bisector
