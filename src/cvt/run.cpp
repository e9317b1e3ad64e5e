#include "cvt/run.h"

#include <cmath>
#include <utility>

#include "voronoi/dual.h"
#include "voronoi/localise.h"

namespace bisector {
namespace {

void remove_strays(const Surface& surface, DiagramOfSeeds& known) {
  known.strays = 0;
  Diagram& diagram = known.diagram;
  if (!includes(diagram.has, Want::polygons)) return;
  known.strays = localise_cells(surface, known.positions, diagram.polygons);
  if (known.strays > 0 && includes(diagram.has, Want::dual)) diagram.dual = extract_dual(diagram.polygons);
}

}  // namespace

void CvtRun::localise(bool on) {
  if (localised_ == on) return;
  localised_ = on;
  if (on && !diagram_.positions.empty()) remove_strays(surface(), diagram_);
  if (!on && diagram_.strays > 0) diagram_ = {};
}

void CvtRun::evaluate(const std::vector<Vec3>& positions, Want want, DiagramOfSeeds& known) {
  const bool known_seeds = known.positions == positions;
  if (known_seeds && includes(known.diagram.has, Want::polygons) && !includes(known.diagram.has, Want::dual) &&
      includes(want, Want::dual)) {
    known.diagram.dual = extract_dual(known.diagram.polygons);
    known.diagram.has = known.diagram.has | Want::dual;
  }
  if (known_seeds && includes(known.diagram.has, want)) return;
  known.positions.clear();
  known.report = backend_->evaluate(positions, want, known.diagram);
  known.positions = positions;
  if (localised_) remove_strays(surface(), known);
  ++totals.evaluations;
  totals.seconds += known.report.seconds;
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
}

bool CvtRun::covers(const Diagram& diagram) const {
  const double total = backend_->mass();
  return std::abs(diagram.moments.mass - total) <= backend_->mass_tolerance() * total;
}

void CvtRun::change_backend(Backend& backend) {
  if (&backend != backend_) diagram_ = {};
  backend_ = &backend;
}

}  // namespace bisector
