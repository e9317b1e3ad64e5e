#include "job/saved_run.h"

namespace bisector::job {

void SavedRun::add_options(CLI::App* app) {
  add_file(app, "--checkpoint", path_, "FILE",
           "keep in a file what has been computed; it is removed when\n"
           "the results are written")
      ->group("Checkpoint");
  app->add_option("--checkpoint-every", options_.every,
                  "seconds between states of the optimiser in it; default 60.\n"
                  "Ended steps are kept always")
      ->type_name("SECONDS")
      ->check(number_below(1e100))
      ->group("Checkpoint");
  app->add_flag("--resume", options_.resume, "go on from the checkpoint, if it is there, to the same result")
      ->group("Checkpoint");
}

void SavedRun::check_usage(const Usage& usage) {
  for (const char* option : {"--checkpoint-every", "--resume"})
    if (!usage.given("--checkpoint"))
      usage.refuse(option, "it is for --checkpoint; leave it out, or give that as well");
  words_ = usage.words_of_result();
}

void SavedRun::open(const Fingerprint& input, Journal& journal, Context& context) {
  if (path_.empty()) return;
  checkpoint_ = std::make_unique<Checkpoint>(path_, words_ + std::to_string(input.value()), options_);
  context.checkpoint = checkpoint_.get();
  if (options_.resume) journal.note(path_ + " has " + checkpoint_->found());
}

std::string SavedRun::path() const { return checkpoint_ && !checkpoint_->empty() ? path_ : ""; }

void SavedRun::remove() {
  if (checkpoint_) checkpoint_->remove();
}

Fingerprint fingerprint_of(const TriangleMesh& mesh) {
  Fingerprint fingerprint;
  return fingerprint.add_all(mesh.vertices).add_all(mesh.triangles).add_all(mesh.labels).add_all(mesh.feature_edges);
}

Fingerprint fingerprint_of(const TetMesh& mesh) {
  Fingerprint fingerprint;
  fingerprint.add_all(mesh.vertices).add_all(mesh.tets).add_all(mesh.regions);
  return fingerprint.add_all(mesh.boundary).add_all(mesh.boundary_labels).add_all(mesh.feature_edges);
}

}  // namespace bisector::job
