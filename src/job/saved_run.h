// The options of a run that can be cut off and go on: --checkpoint, --checkpoint-every and --resume.
#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <string>

#include "bisector/checkpoint.h"
#include "bisector/context.h"
#include "checkpoint/fingerprint.h"
#include "job/journal.h"
#include "job/options.h"

namespace bisector::job {

class SavedRun {
 public:
  void add_options(CLI::App* app);
  // Throws CLI::ValidationError.
  void check_usage(const Usage& usage);

  // Before what takes long, if a checkpoint is asked for: opens it and names it in `context`. `input`: of all that the
  // run reads. Notes what a run that is resumed finds. Throws Error.
  void open(const Fingerprint& input, Journal& journal, Context& context);
  const std::string& wanted_path() const { return path_; }
  // The file, if there is something in it to go on from.
  std::string path() const;
  // Once the results are in their files.
  void remove();

 private:
  std::string path_;
  CheckpointOptions options_;
  std::string words_;  // of the options that the result hangs on
  std::unique_ptr<Checkpoint> checkpoint_;
};

// Of a surface's or a solid's geometry and marks.
Fingerprint fingerprint_of(const TriangleMesh& mesh);
Fingerprint fingerprint_of(const TetMesh& mesh);

}  // namespace bisector::job
