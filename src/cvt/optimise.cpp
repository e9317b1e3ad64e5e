#include "cvt/optimise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "checkpoint/bytes.h"
#include "core/stopwatch.h"
#include "cvt/host_descent.h"
#include "cvt/lbfgs.h"
#include "cvt/saved_step.h"

namespace bisector {
namespace {

constexpr double kArmijo = 1e-4;            // share of the slope's promise that a step must keep
constexpr double kFlatGradient = 1e-8;      // relative to the first; what is left is rounding
constexpr int kLineSearchTrials = 8;        // evaluations per step at most
constexpr std::size_t kDecreaseWindow = 5;  // steps over which the energy's fall is judged
constexpr std::size_t kMemory = 8;          // energies that a step is measured against if diagrams are localised

}  // namespace

// The iterates of one optimisation, with the run's seeds, diagram and normals while it lasts.
class Descent {
 public:
  Descent(CvtRun& run, const OptimiseOptions& options, SavedStep& saved)
      : run_(run), options_(options), saved_(saved), on_host_(run, options.constrained) {
    on_host_.now.seeds = std::move(run.seeds);
    on_host_.now.known = std::move(run.diagram_);
    on_host_.now.normals = std::move(run.normals_);
  }

  void minimise();

 private:
  SeedDescent& space() { return on_device_ ? static_cast<SeedDescent&>(*on_device_) : on_host_; }
  void start();
  void enter_device();
  void leave_device();
  bool advance();
  bool is_descent(double length) const;
  bool line_search();
  void accept();
  bool is_done() const;
  void go_on_without_device(const DeviceError& error);
  void hand_back();
  bool go_on();
  void begin();
  void keep_state() const;
  bool take_step();

  CvtRun& run_;
  const OptimiseOptions& options_;
  SavedStep& saved_;
  HostDescent on_host_;
  std::unique_ptr<ResidentDescent> on_device_;  // none: the iterate is on the host
  std::size_t entered_at_ = 0;                  // how many energies there were when it went to the device
  Lbfgs history_;
  StepResult next_;               // what the last step led to
  std::vector<double> energies_;  // of all iterates
  double energy_ = 0, gradient_norm_ = 0, first_norm_ = 0;
  int iteration_ = 0;
  bool restarted_ = false;
  bool moving_ = false;  // the iterate is no longer what it was before the step
};

void Descent::start() {
  moving_ = true;
  on_host_.start();
  energy_ = on_host_.now.moments().energy;
  gradient_norm_ = std::sqrt(square_of(on_host_.now.gradient));
  history_.clear();
}

// Stray parts are left out on the host, from labels.
void Descent::enter_device() {
  if (run_.localises()) return;
  const Iterate& now = on_host_.now;
  on_device_ = run_.backend().descend({now.seeds, run_.curves(), now.moments(), now.gradient,
                                       options_.constrained ? &now.normals : nullptr, history_.pairs()});
  entered_at_ = energies_.size();
}

void Descent::leave_device() {
  if (!on_device_) return;
  if (energies_.size() > entered_at_) {
    Iterate& now = on_host_.now;
    on_device_->bring_back(now.seeds, now.known.diagram.moments, now.gradient, now.normals);
    now.known.diagram.has = options_.constrained ? run_.backend().projected() : Want::moments;
    now.known.positions = now.seeds.positions();
    now.known.strays = 0;
  }
  on_device_.reset();
}

// Whether a step lowers the energy enough, of localised cells below the largest of the last (Grippo, Lampariello and
// Lucidi 1986); where rounding hides that, whether the slope says so: the approximate Wolfe
// condition (Hager and Zhang 2005, section 2).
bool Descent::is_descent(double length) const {
  // Where a stray part meets its cell or comes off, the energy of localised cells jumps.
  double before = energy_;
  if (run_.localises())
    before = *std::max_element(energies_.end() - static_cast<std::ptrdiff_t>(std::min(energies_.size(), kMemory)),
                               energies_.end());
  if (next_.energy <= before + kArmijo * length * next_.products.slope) return true;
  const double noise = run_.backend().energy_noise() * energy_;
  return noise > 0 && next_.energy <= energy_ + noise &&
         next_.products.next_slope <= (2 * kArmijo - 1) * next_.products.slope;
}

// Backtracks along the direction until the energy falls enough, by interpolation. False if no step was found.
bool Descent::line_search() {
  double length = 1;
  for (int trial = 0; trial < kLineSearchTrials; ++trial) {
    next_ = space().step(length, history_.free_pair());
    if (on_device_) run_.count(next_.report);
    if (next_.out_of_reach) return false;
    if (!run_.covers(next_.mass)) next_.energy = std::numeric_limits<double>::infinity();
    if (!(next_.products.slope < 0)) return false;
    if (is_descent(length)) return true;
    const double excess = next_.energy - energy_ - length * next_.products.slope;
    const double vertex = std::isfinite(excess) ? -0.5 * next_.products.slope * length * length / excess : 0;
    length = std::clamp(vertex, 0.1 * length, 0.5 * length);
  }
  return false;
}

// Goes to the point that the line search found. Where a cell has become empty there, its seed is put elsewhere, and the
// history says nothing about that.
void Descent::accept() {
  moving_ = true;
  ++run_.totals.iterations;
  space().accept();
  if (on_device_) on_host_.now.known.report = next_.report;
  history_.push(next_.products.sy, next_.products.ss, next_.products.yy);
  energy_ = next_.energy;
  gradient_norm_ = std::sqrt(next_.products.gradient_square);
  energies_.push_back(energy_);
  if (next_.empty > 0) {
    leave_device();
    start();
    energies_.back() = energy_;
    enter_device();
  }
  run_.context().report({options_.phase, iteration_ + 1, options_.iterations, energy_, gradient_norm_,
                         options_.done + options_.share * (iteration_ + 1) / options_.iterations});
}

// One step; false if there is none that helps.
bool Descent::advance() {
  history_.set_direction(space().vectors());
  if (line_search()) {
    restarted_ = false;
    accept();
    return true;
  }
  if (next_.out_of_reach) {
    leave_device();
    start();
    return true;
  }
  // Once from scratch along the gradient; if that finds nothing either, this is the minimum to rounding.
  if (restarted_) return false;
  restarted_ = true;
  history_.clear();
  return true;
}

bool Descent::is_done() const {
  if (gradient_norm_ <= kFlatGradient * first_norm_) return true;
  const std::size_t n = energies_.size();
  return n > kDecreaseWindow && energies_[n - 1 - kDecreaseWindow] - energies_[n - 1] <
                                    kDecreaseWindow * options_.tolerance * energies_[n - 1];
}

// From the seeds that the host knows, which are those of a few steps ago. Throws the error if the backend has nothing
// to go on with.
void Descent::go_on_without_device(const DeviceError& error) {
  if (on_device_) {
    const ResidentDescent::Kept& kept = on_device_->kept();
    on_host_.now.seeds = kept.seeds;
    const std::size_t left = entered_at_ + static_cast<std::size_t>(kept.accepted);
    const int lost = static_cast<int>(energies_.size() - left);
    energies_.resize(left);
    iteration_ -= lost;
    run_.totals.iterations -= lost;
    on_device_.reset();
  }
  run_.backend().give_up(error);
  on_host_.now.known = {};
  start();
  energies_.back() = energy_;
}

void Descent::hand_back() {
  leave_device();
  run_.adopt(std::move(on_host_.now.seeds), std::move(on_host_.now.known));
  run_.normals_ = std::move(on_host_.now.normals);
  run_.energy = energy_;
  run_.gradient_norm = gradient_norm_;
}

void Descent::begin() {
  start();
  energies_.assign(1, energy_);
  first_norm_ = gradient_norm_;
  enter_device();
}

// All that the next steps hang on, but for what the seeds determine. What a device has of it stays there.
void Descent::keep_state() const {
  if (on_device_) return;
  ByteWriter state;
  write_seeds(on_host_.now.seeds, state);
  state.put_all(on_host_.now.normals).put_all(energies_);
  state.put(energy_).put(gradient_norm_).put(first_norm_).put(iteration_).put(restarted_);
  saved_.write_counts(state);
  history_.write(state);
  on_host_.write_pairs(history_, state);
  saved_.keep_state(state.take());
}

// From the state that was kept, if there is one. It stays on the host, where the pairs are.
bool Descent::go_on() {
  const std::optional<std::string> kept = saved_.state();
  if (!kept) return false;
  ByteReader state(*kept);
  Iterate& now = on_host_.now;
  now.seeds = read_seeds(run_.curves(), state);
  state.get_all(now.normals);
  state.get_all(energies_);
  state.get(energy_);
  state.get(gradient_norm_);
  state.get(first_norm_);
  state.get(iteration_);
  state.get(restarted_);
  saved_.read_counts(state);
  history_.read(state);
  on_host_.read_pairs(history_, state);
  state.end();
  on_host_.go_on();
  if (now.moments().energy != energy_ || std::sqrt(square_of(now.gradient)) != gradient_norm_)
    throw Error("the checkpoint's seeds have another energy here; go on with the program that wrote it");
  return true;
}

// False if there is none that helps. A run that is cancelled meanwhile can go on from before it.
bool Descent::take_step() {
  if (saved_.state_is_due()) keep_state();
  moving_ = false;
  try {
    run_.context().check();
    return !is_done() && advance();
  } catch (const Cancelled&) {
    if (!moving_) keep_state();
    throw;
  }
}

void Descent::minimise() {
  if (!go_on()) begin();
  for (;;) {
    try {
      for (; iteration_ < options_.iterations; ++iteration_)
        if (!take_step()) break;
      return hand_back();
    } catch (const DeviceError& error) {
      go_on_without_device(error);
    }
  }
}

void optimise(CvtRun& run, const OptimiseOptions& options) {
  const Stopwatch watch;
  const DiagramSeconds before = run.totals.seconds;
  const int iterations = run.totals.iterations;
  SavedStep saved(run, options.iterations, options.tolerance, options.constrained);
  if (!saved.restore()) {
    Descent(run, options, saved).minimise();
    saved.keep();
  }
  run.add_work(run.totals.iterations - iterations);
  const DiagramSeconds& after = run.totals.seconds;
  run.totals.seconds_lbfgs += watch.seconds() - (after.delaunay - before.delaunay) -
                              (after.neighbours - before.neighbours) - (after.pairs - before.pairs) -
                              (after.clip - before.clip);
}

void optimise_with_stand_in(CvtRun& run, Backend* stand_in, OptimiseOptions options, double on_surface) {
  const auto last = static_cast<int>(std::ceil(on_surface * options.iterations));
  if (!stand_in || last == options.iterations) return optimise(run, options);
  Backend& own = run.backend();
  run.change_backend(*stand_in);
  options.iterations -= last;
  optimise(run, options);
  run.change_backend(own);
  options.iterations = last;
  if (last > 0) optimise(run, options);
}

CvtGradient complete(CvtRun& run, bool constrained) {
  const Diagram& diagram = run.diagram(constrained ? run.backend().projected() : Want::moments);
  if (constrained) {
    std::vector<Vec3> feet = run.seeds.positions();
    run.normals_.resize(feet.size());
    run.backend().project(diagram.moments, run.seeds.places(), feet, run.normals_);
  }
  CvtGradient gradient;
  gradient.vectors = gradient_of(diagram.moments.cells, run.seeds, run.curves(), constrained ? &run.normals_ : nullptr);
  if (constrained) gradient.normals = run.normals_;
  run.energy = run.covers(diagram.moments.mass) ? diagram.moments.energy : std::numeric_limits<double>::infinity();
  run.gradient_norm = std::sqrt(square_of(gradient.vectors));
  return gradient;
}

}  // namespace bisector
