#include "backend/backend.h"

#include <stdexcept>

#include "backend/project.h"
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

const Surface& Backend::surface() const {
  if (!surface_) throw std::logic_error("the surface of this backend is in no one place");
  return *surface_;
}

EvaluationReport Backend::evaluate(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) {
  if (seeds.empty()) throw Error("there are no seeds; give at least one");
  if (!(mass_ > 0)) throw Error("the area or volume is too small for numbers; mend the mesh, or scale it");
  const bool reads_dual = includes(want, Want::dual) && !includes(offers_, Want::dual);
  const Want computed = reads_dual ? (want & (Want::polygons | Want::polyhedra)) | Want::labels : want;
  if (!includes(offers_, computed)) throw std::logic_error("a backend of a surface was asked for polyhedra");
  const EvaluationReport report = compute(seeds, computed, diagram);
  if (!includes(computed, Want::labels)) diagram.polygons = {};
  if (!includes(computed, Want::polygons)) diagram.polygons.vertices = {};
  if (!includes(computed, Want::polyhedra)) diagram.polyhedra = {};
  if (reads_dual) diagram.dual = extract_dual(diagram.polygons);
  else if (!includes(want, Want::dual)) diagram.dual = {};
  diagram.has = want | computed;
  return report;
}

void Backend::project(const CellMoments& cells, std::span<const SeedPlace> places, std::span<Vec3> seeds,
                      std::vector<Vec3>& normals) {
  project_to_cells(surface(), cells.triangles, places, seeds, normals);
}

}  // namespace bisector
