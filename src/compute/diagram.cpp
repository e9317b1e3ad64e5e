#include "bisector/diagram.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>

#include "bisector/error.h"
#include "compute/compute.h"
#include "core/geometry.h"
#include "core/magnitude.h"
#include "voronoi/clipped.h"
#include "voronoi/tiling.h"

namespace bisector {
namespace {

void check_indices(const TriangleMesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t])
      if (v >= mesh.vertices.size())
        throw Error(fmt::format("triangle {} names vertex {} of {}; correct the mesh", t, v, mesh.vertices.size()));
}

std::vector<DiagramCell> cells_of(const CellMoments& moments, const std::vector<Vec3>& seeds) {
  std::vector<DiagramCell> cells(seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments& m = moments.cells[i];
    cells[i] = {m.mass, m.mass > 0 ? seeds[i] + (1 / m.mass) * m.first : seeds[i], m.second};
  }
  return cells;
}

// What the two kinds of diagram have in common.
template <class Result>
Result result_of(const Backend& backend, const EvaluationReport& report, const Diagram& diagram,
                 const std::vector<Vec3>& seeds) {
  Result result;
  result.cells = cells_of(diagram.moments, seeds);
  result.mass = diagram.moments.mass;
  result.energy = diagram.moments.energy;
  result.mass_tolerance = backend.mass_tolerance();
  result.device = backend.description();
  result.certification = report.certification;
  result.seconds = report.seconds;
  return result;
}

}  // namespace

SurfaceDiagram compute_diagram(const TriangleMesh& mesh, const std::vector<double>& density,
                               const std::vector<Vec3>& seeds, const DiagramOptions& options, const Context& context) {
  require_moderate_model(mesh.vertices, "vertex");
  require_moderate(seeds, "seed");
  check_indices(mesh);
  const Surface surface(mesh, density);
  const std::unique_ptr<Backend> backend = make_backend(surface, options.compute, context);
  context.check();
  Diagram diagram;
  const EvaluationReport report = backend->evaluate(seeds, Want::polygons | Want::dual, diagram);
  SurfaceDiagram result = result_of<SurfaceDiagram>(*backend, report, diagram, seeds);
  result.surface_mass = surface.mass;
  result.untiled = count_untiled(surface, diagram.polygons);
  result.polygons = std::move(diagram.polygons);
  result.dual = std::move(diagram.dual);
  return result;
}

SolidDiagram compute_diagram(const TetMesh& mesh, const std::vector<double>& density, const std::vector<Vec3>& seeds,
                             const DiagramOptions& options, const Context& context) {
  require_moderate_model(mesh.vertices, "vertex");
  require_moderate(seeds, "seed");
  const Solid solid(mesh, density);
  const std::unique_ptr<SolidBackend> backend = make_backend(solid, options.compute, context);
  context.check();
  Diagram diagram;
  const EvaluationReport report = backend->evaluate(seeds, Want::polygons | Want::polyhedra | Want::dual, diagram);
  SolidDiagram result = result_of<SolidDiagram>(*backend, report, diagram, seeds);
  result.solid_mass = solid.mass;
  result.untiled = count_untiled(solid, diagram.polyhedra) + count_untiled(solid.boundary, diagram.polygons);
  result.dual_tets = dual_tets(diagram.polyhedra);
  result.boundary = solid.boundary.mesh.triangles;
  result.polyhedra = std::move(diagram.polyhedra);
  result.boundary_polygons = std::move(diagram.polygons);
  result.boundary_dual = std::move(diagram.dual);
  return result;
}

}  // namespace bisector
