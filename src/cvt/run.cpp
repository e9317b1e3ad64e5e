#include "cvt/run.h"

#include <cmath>
#include <utility>

#include "core/stopwatch.h"
#include "voronoi/dual.h"

namespace bisector {
namespace {

// How many times the work of a diagram that one without stray parts takes.
constexpr double kLocalisedWork = 3;

void add_dual(Diagram& diagram) {
  diagram.dual = extract_dual(diagram.polygons);
  diagram.has = diagram.has | Want::dual;
}

}  // namespace

RunTotals& operator+=(RunTotals& a, const RunTotals& b) {
  a.iterations += b.iterations;
  a.evaluations += b.evaluations;
  a.work += b.work;
  a.seconds += b.seconds;
  a.device_work += b.device_work;
  a.seconds_lbfgs += b.seconds_lbfgs;
  return a;
}

void CvtRun::localise(bool on) {
  if (localised_ == on) return;
  localised_ = on;
  if (!on) {
    if (diagram_.strays > 0) diagram_ = {};
  } else if (includes(diagram_.diagram.has, Want::labels)) {
    leave_out_strays(diagram_);
  } else {
    diagram_ = {};
  }
}

Localiser& CvtRun::localiser() {
  std::unique_ptr<Localiser>& here = backend_ == &home_ ? at_home_ : elsewhere_;
  if (!here) here = std::make_unique<Localiser>(surface());
  return *here;
}

void CvtRun::leave_out_strays(DiagramOfSeeds& known) {
  const Stopwatch watch;
  known.strays = localiser().localise(known.positions, known.diagram);
  if (known.strays > 0 && includes(known.diagram.has, Want::dual)) add_dual(known.diagram);
  known.report.seconds.clip += watch.seconds();
  totals.seconds.clip += watch.seconds();
}

std::size_t CvtRun::strays() {
  const Diagram& now = diagram(Want::labels);
  return localised_ ? diagram_.strays : localiser().count_strays(diagram_.positions, now);
}

void CvtRun::count(const EvaluationReport& report) {
  ++totals.evaluations;
  totals.seconds += report.seconds;
  totals.device_work += report.device_work;
}

void CvtRun::evaluate(const std::vector<Vec3>& positions, Want want, DiagramOfSeeds& known) {
  // The dual is read off here, when stray parts are gone, and not by the backend.
  const bool wants_dual = includes(want, Want::dual);
  Want computed = want & (Want::polygons | Want::polyhedra);
  if (wants_dual || localised_) computed = computed | Want::labels;
  if (known.positions != positions || !includes(known.diagram.has, computed)) {
    known.positions.clear();
    known.report = backend_->evaluate(positions, computed, known.diagram);
    known.positions = positions;
    known.strays = 0;
    count(known.report);
    if (localised_) leave_out_strays(known);
  }
  if (wants_dual && !includes(known.diagram.has, Want::dual)) add_dual(known.diagram);
}

const Diagram& CvtRun::diagram(Want want) {
  evaluate(seeds.positions(), want, diagram_);
  return diagram_.diagram;
}

DiagramOfSeeds CvtRun::take_diagram(Want want) {
  diagram(want);
  return std::exchange(diagram_, {});
}

void CvtRun::adopt(PlacedSeeds placed, DiagramOfSeeds known) {
  seeds = std::move(placed);
  diagram_ = std::move(known);
  // It may be from before sheets turned out to cross.
  if (!localised_ && diagram_.strays > 0) diagram_ = {};
}

double CvtRun::step_work() const {
  return (localised_ ? kLocalisedWork : 1) * static_cast<double>(backend_->facet_count() + 3 * seeds.size());
}

bool CvtRun::covers(double mass) const {
  const double total = backend_->mass();
  return std::abs(mass - total) <= backend_->mass_tolerance() * total;
}

void CvtRun::change_backend(Backend& backend) {
  if (&backend == backend_) return;
  diagram_ = {};
  elsewhere_.reset();
  backend_ = &backend;
}

}  // namespace bisector
