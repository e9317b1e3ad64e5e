// Optimisations, and other steps that move a run's seeds, as steps of a checkpoint.
#pragma once

#include <optional>
#include <string>

#include "checkpoint/bytes.h"
#include "checkpoint/fingerprint.h"
#include "checkpoint/step_store.h"
#include "core/stopwatch.h"
#include "cvt/run.h"

namespace bisector {

void write_seeds(const PlacedSeeds& seeds, ByteWriter& out);
// Throws Error if a place is none on these curves.
PlacedSeeds read_seeds(const FeatureCurves& curves, ByteReader& in);

// The run's next step. Without a checkpoint nothing is kept or found.
class SavedStep {
 public:
  // `more`: numbers that the step's outcome hangs on beside the run's seeds and domain.
  template <class... Numbers>
  explicit SavedStep(CvtRun& run, const Numbers&... more) : run_(run), totals_(run.totals) {
    if (!run.context().checkpoint) return;
    store_ = &run.context().checkpoint->steps();
    Fingerprint start = start_of(run);
    (start.add(more), ...);
    key_ = store_->begin(start.value());
  }

  // Leaves the run as the step left it once, and what keep() was given then. Nothing if that is not known.
  std::optional<std::string> restore();
  // After the step. `outcome`: bytes of what it did beside moving seeds.
  void keep(const std::string& outcome = {});

  // Whether there is a checkpoint.
  bool is_kept() const { return store_ != nullptr; }
  bool state_is_due() const { return store_ && store_->state_is_due(); }
  std::optional<std::string> state() const;
  void keep_state(const std::string& bytes);
  // What the step has counted so far.
  void write_counts(ByteWriter& out) const;
  void read_counts(ByteReader& in);

 private:
  static Fingerprint start_of(const CvtRun& run);

  CvtRun& run_;
  StepStore* store_ = nullptr;
  StepKey key_;
  const RunTotals totals_;  // of the run before
  const Stopwatch watch_;
};

}  // namespace bisector
