#include "backend/backend.h"

#include <stdexcept>

#include "bisector/error.h"
#include "voronoi/dual.h"

namespace bisector {

DeviceSeconds& operator+=(DeviceSeconds& a, const DeviceSeconds& b) {
  a.transfer += b.transfer;
  a.grid += b.grid;
  a.neighbours += b.neighbours;
  a.owners += b.owners;
  a.clip += b.clip;
  a.sort += b.sort;
  a.sum += b.sum;
  a.descent += b.descent;
  return a;
}

DiagramSeconds& operator+=(DiagramSeconds& a, const DiagramSeconds& b) {
  a.delaunay += b.delaunay;
  a.neighbours += b.neighbours;
  a.pairs += b.pairs;
  a.clip += b.clip;
  a.device += b.device;
  return a;
}

DeviceWork& operator+=(DeviceWork& a, const DeviceWork& b) {
  a.submits += b.submits;
  a.dispatches += b.dispatches;
  a.bytes_up += b.bytes_up;
  a.bytes_down += b.bytes_down;
  a.host_seconds += b.host_seconds;
  return a;
}

EvaluationReport Backend::evaluate(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  if (seeds.empty()) throw Error("there are no seeds; give at least one");
  const Want computed =
      (want & (Want::polygons | Want::polyhedra)) | (includes(want, Want::dual) ? Want::labels : Want::moments);
  if (!includes(offers_, computed)) throw std::logic_error("a backend of a surface was asked for polyhedra");
  const EvaluationReport report = compute(seeds, computed, diagram);
  if (!includes(computed, Want::labels)) diagram.polygons = {};
  if (!includes(computed, Want::polygons)) diagram.polygons.vertices = {};
  if (!includes(computed, Want::polyhedra)) diagram.polyhedra = {};
  if (includes(want, Want::dual)) diagram.dual = extract_dual(diagram.polygons);
  else diagram.dual = {};
  diagram.has = want | computed;
  return report;
}

}  // namespace bisector
