// A program that runs beside this one, in a group of its own with all that it starts, and under limits.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/stopwatch.h"

namespace bisector::batch {

struct Limits {
  double seconds = 0;        // of a run; 0: none
  std::uint64_t memory = 0;  // bytes that it and what it started may hold in memory together; 0: any
};

enum class Ending { done, failed, crashed, timeout, memory };

struct Outcome {
  Ending ending = Ending::done;
  int exit_code = 0;              // of one that was not killed
  int signal = 0;                 // that it was killed by
  double seconds = 0;             // of the wall clock
  std::uint64_t most_memory = 0;  // bytes
};

class Child {
 public:
  // Both streams of output go to a file. Throws Error if the program cannot be started.
  Child(const std::vector<std::string>& words, const std::string& log, const Limits& limits);
  // Kills it and what it started, if it still runs.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Looks after it: whether it has ended. To be called often, for that is how limits are kept.
  bool has_ended();
  // Asks it to end; kills it if it does not within seconds.
  void stop();
  // Once it has ended.
  const Outcome& outcome() const { return outcome_; }

 private:
  void enforce();
  void end_with(int status);

  Limits limits_;
  pid_t id_ = -1;  // and of its group; -1 once it has ended
  Stopwatch watch_;
  double stopped_ = -1;  // when it was asked to end, in seconds of the watch
  bool over_memory_ = false, over_time_ = false;
  Outcome outcome_;
};

// Waits until a child ends or for some time, whichever comes first.
void wait_for_children(double seconds);

}  // namespace bisector::batch
