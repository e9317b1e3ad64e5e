#include "cvt/run.h"

#include <cmath>
#include <utility>

#include "voronoi/dual.h"
#include "voronoi/localise.h"

namespace bisector {
namespace {

void add_dual(Diagram& diagram) {
  diagram.dual = extract_dual(diagram.polygons);
  diagram.has = diagram.has | Want::dual;
}

void remove_strays(const Surface& surface, DiagramOfSeeds& known) {
  known.strays = 0;
  Diagram& diagram = known.diagram;
  if (!includes(diagram.has, Want::polygons)) return;
  known.strays = localise_cells(surface, known.positions, diagram.polygons);
  if (known.strays > 0 && includes(diagram.has, Want::dual)) add_dual(diagram);
}

}  // namespace

void CvtRun::localise(bool on) {
  if (localised_ == on) return;
  localised_ = on;
  if (on && !diagram_.positions.empty()) remove_strays(surface(), diagram_);
  if (!on && diagram_.strays > 0) diagram_ = {};
}

void CvtRun::evaluate(const std::vector<Vec3>& positions, Want want, DiagramOfSeeds& known) {
  // The dual is read off here, when stray parts are gone, and not by the backend.
  const bool wants_dual = includes(want, Want::dual);
  const Want computed = wants_dual ? (want & Want::polyhedra) | Want::polygons : want;
  if (known.positions != positions || !includes(known.diagram.has, computed)) {
    known.positions.clear();
    known.report = backend_->evaluate(positions, computed, known.diagram);
    known.positions = positions;
    if (localised_) remove_strays(surface(), known);
    ++totals.evaluations;
    totals.seconds += known.report.seconds;
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
