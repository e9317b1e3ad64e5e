// A run: the domain's backend, the seeds, the diagram of exactly those seeds, and what all its evaluations cost.
#pragma once

#include <memory>
#include <vector>

#include "backend/backend.h"
#include "bisector/context.h"
#include "features/placed_seeds.h"
#include "voronoi/diagram.h"
#include "voronoi/localise.h"

namespace bisector {

struct RunTotals {
  int iterations = 0;   // accepted steps of the optimiser
  int evaluations = 0;  // diagrams computed
  double work = 0;      // of steps, see CvtRun::step_work()
  DiagramSeconds seconds;
  DeviceWork device_work;
  double seconds_lbfgs = 0;  // of the optimiser outside the diagrams
};

RunTotals& operator+=(RunTotals& a, const RunTotals& b);

// A diagram, how it came about, and the positions it is of.
struct DiagramOfSeeds {
  Diagram diagram;
  EvaluationReport report;
  std::vector<Vec3> positions;  // empty: there is no diagram yet
  std::size_t strays = 0;       // cells that had pieces apart from their seed, if these are left out
};

class CvtRun {
 public:
  // All must outlive the run. `curves` are those that places refer to.
  CvtRun(Backend& backend, const FeatureCurves& curves, const Context& context)
      : home_(backend), backend_(&backend), curves_(curves), context_(context) {}

  Backend& backend() const { return *backend_; }
  // The surface, or the boundary of the solid.
  const Surface& surface() const { return backend_->surface(); }
  const FeatureCurves& curves() const { return curves_; }
  // Whether there are feature curves or corners for seeds to be on.
  bool has_features() const { return !curves_.graph().edges.empty() || !curves_.graph().corners.empty(); }
  // What of a diagram the curves are traced on: where there are none, nobody asks where the polygons are.
  Want traced() const { return curves_.size() > 0 ? Want::polygons : Want::labels; }
  const Context& context() const { return context_; }

  // Free to be changed: a diagram is only used for the positions that it was computed for.
  PlacedSeeds seeds;
  RunTotals totals;
  // Of the seeds as the optimiser left them last, or complete() found them.
  double energy = 0;
  double gradient_norm = 0;

  // The diagram of the seeds as they are, with what is wanted of it. It is computed if the last one was of other
  // positions, or lacks something. The reference is good until the next call that computes one.
  const Diagram& diagram(Want want = Want::moments);
  // Whether diagrams are those of cells without stray parts (voronoi/localise.h).
  void localise(bool on);
  bool localises() const { return localised_; }
  // How many cells have such parts, or had them where they are left out, with the seeds as they are.
  std::size_t strays();
  // How the last diagram of the run's seeds was certified.
  const Certification& certification() const { return diagram_.report.certification; }
  // The diagram of the seeds as they are, to be kept beside a copy of them.
  DiagramOfSeeds take_diagram(Want want = Want::moments);
  // Sets seeds whose diagram is known.
  void adopt(PlacedSeeds placed, DiagramOfSeeds diagram);
  // Brings a diagram kept elsewhere up to date, and counts the evaluation if that takes one.
  void evaluate(const std::vector<Vec3>& positions, Want want, DiagramOfSeeds& diagram);
  // Of one step: the facets and three times the seeds, and three times that where stray parts are left out, about what
  // its diagram takes.
  double step_work() const;
  // Counts so many steps. Unlike evaluations work is the same in a run that goes on from a checkpoint.
  void add_work(int steps) { totals.work += steps * step_work(); }
  // Whether a diagram covers the domain: the masses of its cells sum, to `mass`, to the domain's. One that does not is
  // never used.
  bool covers(double mass) const;
  // Goes on with another backend, whose domain may be another. All but the first need to live only while they are used.
  void change_backend(Backend& backend);

 private:
  friend class Descent;
  friend class SavedStep;
  friend struct CvtGradient complete(CvtRun& run, bool constrained);

  void count(const EvaluationReport& report);
  Localiser& localiser();
  void leave_out_strays(DiagramOfSeeds& known);

  Backend& home_;  // the first
  Backend* backend_;
  const FeatureCurves& curves_;
  const Context& context_;
  DiagramOfSeeds diagram_;
  bool localised_ = false;
  // Once there was need of them: for the first backend's surface, and for another's while that is used.
  std::unique_ptr<Localiser> at_home_, elsewhere_;
  // Of the surface where each seed was put last. A seed that owns no triangle keeps the one it had.
  std::vector<Vec3> normals_;
};

}  // namespace bisector
