// What a run has computed so far, in a file. A run that was cut off goes on from it, to the same result.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "bisector/export.h"

namespace bisector {

class StepStore;

struct CheckpointOptions {
  double every = 60;    // seconds, at the least, between states of the optimiser within a step; 0: each is written
  bool resume = false;  // go on from the file, if it is there
};

// Context::checkpoint names one to a pipeline, for one run at a time. The result of each long step is appended to the
// file when the step has ended, and within a step the optimiser's state, also when the run is cancelled. Steps are
// known by what they start from, so a run with other input or options takes nothing from it. A file that cannot be
// written is a warning, and the run goes on without.
class BISECTOR_API Checkpoint {
 public:
  // `identity`: words or bytes that tell runs apart: their input and options. Throws Error if the file is there and not
  // to be resumed, is no checkpoint, is of another run or version, is in use by another process, or cannot be written.
  // What follows a record that is damaged or half written is left out.
  Checkpoint(const std::string& path, std::string_view identity, const CheckpointOptions& options = {});
  ~Checkpoint();
  Checkpoint(const Checkpoint&) = delete;
  Checkpoint& operator=(const Checkpoint&) = delete;

  // Whether there is nothing to go on from. Such a file is removed with the object.
  bool empty() const;
  // What it had to go on from when it was opened, in words.
  std::string found() const;
  // Removes the file, of a run that has ended.
  void remove();

  StepStore& steps() { return *steps_; }

 private:
  std::unique_ptr<StepStore> steps_;
};

}  // namespace bisector
