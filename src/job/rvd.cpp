#include "job/rvd.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bisector/preview.h"
#include "compute/compute.h"
#include "core/magnitude.h"
#include "core/stopwatch.h"
#include "io/files.h"
#include "job/cells.h"
#include "job/inputs.h"
#include "job/messages.h"
#include "mesh/sampling.h"
#include "tetmesh/sample_solid.h"
#include "voronoi/clipped.h"
#include "voronoi/tiling.h"

namespace bisector::job {
namespace {

Json cells_json(const CellMoments& moments, const std::vector<Vec3>& seeds) {
  Json cells = Json::array();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments& m = moments.cells[i];
    const Json centroid = m.mass > 0 ? point_json(seeds[i] + (1 / m.mass) * m.first) : Json(nullptr);
    cells.push_back({{"mass", m.mass}, {"centroid", centroid}, {"energy", m.second}});
  }
  return cells;
}

std::vector<Triangle> sorted_dual(const Dual& dual) {
  std::vector<Triangle> triples = dual.triangles;
  for (Triangle& t : triples) std::sort(t.begin(), t.end());
  std::sort(triples.begin(), triples.end());
  return triples;
}

// Face and cell, sorted, each once.
std::vector<std::array<Index, 2>> face_pairs(const RestrictedPolygons& polygons, const TriangleMesh& mesh) {
  std::vector<std::array<Index, 2>> pairs;
  for (const auto& [triangle, cell] : polygons.pairs)
    pairs.push_back({mesh.face_of_triangle.empty() ? triangle : mesh.face_of_triangle[triangle], cell});
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace

std::vector<OutputKind> RvdJob::outputs() const {
  return {{"output",
           "-o",
           "FILE",
           "write the cells as coloured polygons (.ply), of\n"
           "tetrahedra those of the boundary, or as polyhedra (.vtu)",
           {".ply", ".vtu"}},
          {"pairs",
           "--pairs",
           "FILE",
           "write \"face seed\" lines, one for each face (counted\n"
           "from 0 in the input), or tetrahedron, and cell that meet,\n"
           "sorted",
           {}},
          {"preview", "--preview", "FILE.png", "draw a picture of the cells", {".png"}}};
}

void RvdJob::add_options(CLI::App* app) {
  add_file(app, "--seeds", seeds_file_, "FILE.xyz", "the seeds, as \"x y z\" lines")->group("Seeds");
  app->add_option("-n", count_, "so many random seeds instead")
      ->type_name("N")
      ->transform(whole_number(1, kMostSeeds))
      ->group("Seeds");
  add_random_seed(app, random_seed_, "another number, another start; default 1")->group("Seeds");
  add_compute_options(app, compute_);
  add_threads(app, threads);
}

void RvdJob::check_usage(const Usage& usage) {
  const bool has_seeds = usage.given("--seeds");
  if (!has_seeds && count_ == 0) throw CLI::ValidationError("which seeds? give --seeds FILE.xyz or -n N");
  if (has_seeds && usage.given("--random-seed"))
    throw CLI::ValidationError("--random-seed: seeds from a file are not random; leave one of the two out");
}

void RvdJob::read(Journal& journal) {
  const Stopwatch reading;
  domain = read_domain(input, given.mesh, false, journal);
  require_meshable(input, domain);
  if (given.seeds || !seeds_file_.empty()) {
    seeds = read_seeds(seeds_file_, given, count_);
  } else if (domain.tets) {
    seeds = sample_solid(*domain.tets, count_, random_seed_);
  } else {
    for (const SurfaceSample& sample : sample_surface(*domain.surface, count_, random_seed_))
      seeds.push_back(sample.point);
  }
  require_moderate(seeds, "seed");
  io_ = reading.seconds();
}

void RvdJob::check_format(std::string_view output, const std::string& path, Journal&) const {
  if (output == "output" && !domain.tets && extension_of(path) == ".vtu")
    throw Error(path + ": cells on a surface are polygons; write .ply");
}

void RvdJob::check_mass(double mass, double tolerance, const char* what, Journal& journal) const {
  if (std::abs(diagram.moments.mass - mass) > tolerance * mass)
    journal.warn(fmt::format("the masses of the cells sum to {}, the {} is {}", diagram.moments.mass, what, mass));
}

void RvdJob::note_seconds(double computing) {
  const DiagramSeconds& phases = evaluation.seconds;
  seconds.update(seconds_json(phases));
  seconds["extract"] = computing - (phases.delaunay + phases.neighbours + phases.pairs + phases.clip);
  seconds["io"] = io_;
}

void RvdJob::compute(Journal& journal) {
  journal.phase("computing the diagram");
  if (domain.tets) compute_solid(journal);
  else compute_surface(journal);
}

void RvdJob::compute_surface(Journal& journal) {
  const Surface surface(*domain.surface);
  const std::unique_ptr<Backend> backend = make_backend(surface, compute_, journal.context());
  const Stopwatch computing;
  evaluation = backend->evaluate(seeds, Want::polygons | Want::dual, diagram);
  device = backend->description();
  if (const std::size_t untiled = count_untiled(surface, diagram.polygons); untiled > 0)
    throw Error(fmt::format("the diagram does not tile {} of the input; please report this as a bug",
                            counted(untiled, "triangle", "triangles")));
  note_seconds(computing.seconds());
  check_mass(surface.mass, backend->mass_tolerance(), "area", journal);
}

void RvdJob::compute_solid(Journal& journal) {
  const Solid solid(*domain.tets);
  const std::unique_ptr<SolidBackend> backend = make_backend(solid, compute_, journal.context());
  const Stopwatch computing;
  evaluation = backend->evaluate(seeds, Want::polygons | Want::polyhedra | Want::dual, diagram);
  device = backend->description();
  const std::size_t untiled = count_untiled(solid, diagram.polyhedra) + count_untiled(solid.boundary, diagram.polygons);
  if (untiled > 0)
    throw Error(fmt::format("the diagram does not tile {} of the input; please report this as a bug",
                            counted(untiled, "cell or triangle", "cells or triangles")));
  note_seconds(computing.seconds());
  dual_tets_ = dual_tets(diagram.polyhedra);
  check_mass(solid.mass, backend->mass_tolerance(), "volume", journal);
}

const ClippedPolyhedra& RvdJob::pieces() {
  if (!pieces_.pairs.empty()) return pieces_;
  const Solid solid(*domain.tets);
  Diagram cut;
  ClippedVoronoi(solid, SolidCells::clipped).evaluate(seeds, NeighbourSource::nearest, Want::polyhedra, cut);
  if (const std::size_t untiled = count_untiled(solid, cut.polyhedra); untiled > 0)
    throw Error(fmt::format("the cells do not tile {} of the input; please report this as a bug",
                            counted(untiled, "tetrahedron", "tetrahedra")));
  pieces_ = std::move(cut.polyhedra);
  return pieces_;
}

std::vector<std::array<Index, 2>> RvdJob::element_pairs() {
  if (!domain.tets) return face_pairs(diagram.polygons, *domain.surface);
  std::vector<std::array<Index, 2>> pairs;
  for (const auto& [tet, cell] : pieces().pairs) pairs.push_back({tet, cell});
  return pairs;
}

const PolygonMesh& RvdJob::cells() {
  if (cells_.labels.empty()) cells_ = coloured_cells(diagram.polygons, seeds.size());
  return cells_;
}

Json RvdJob::report(Journal&) {
  Json report = start_report(command());
  report["device"] = device_json(device);
  report["input"] = size_json(domain);
  report["energy"] = diagram.moments.energy;
  report["mass"] = diagram.moments.mass;
  report["untiled"] = 0;  // a diagram that does not tile is not reported
  report["seconds"] = nullptr;
  add_device(report, device, evaluation.seconds.device, evaluation.device_work, 1);
  report["certification"] = certification_json(evaluation.certification);
  report["cells"] = cells_json(diagram.moments, seeds);
  report["rdt"] = sorted_dual(diagram.dual);
  if (domain.tets) report["dual_tets"] = dual_tets_;
  return report;
}

// The cells in the place of the input, cut up as they are, and the dual.
view::Scene RvdJob::scene(const std::string&) {
  view::Scene scene;
  scene.models = {{"Dual", "", seeds, diagram.dual.triangles}};
  view::measure_shapes(scene);

  view::Model divided{"Cells", input, cells().vertices};
  divided.edges = false;
  view::Measure groups{"cell", "Cell", "", view::Element::triangle};
  for (std::size_t i = 0; i < seeds.size(); ++i) groups.names.push_back(fmt::to_string(i));
  groups.colours.resize(seeds.size());
  std::vector<double> cell_of;
  for (std::size_t k = 0; k < cells().polygons.rows(); ++k) {
    const Index* const corner = cells().polygons.begin(k);
    groups.colours[cells().labels[k]] = cells().colours[k];
    for (std::size_t i = 2; i < cells().polygons.size(k); ++i) {
      divided.triangles.push_back({corner[0], corner[i - 1], corner[i]});
      cell_of.push_back(cells().labels[k]);
    }
  }
  scene.models.insert(scene.models.begin(), std::move(divided));
  view::add_groups(scene, 0, groups, std::move(cell_of));
  return scene;
}

void RvdJob::write(std::string_view output, const std::string& path, const std::vector<std::string>&) {
  if (output == "output" && extension_of(path) == ".vtu") return write_polyhedra(path, polyhedra_of(pieces()));
  if (output == "output") return write_polygons(path, cells());
  if (output == "pairs") {
    fmt::memory_buffer text;
    for (const auto& [face, cell] : element_pairs()) fmt::format_to(std::back_inserter(text), "{} {}\n", face, cell);
    return write_file(path, fmt::to_string(text));
  }
  PreviewOptions picture;
  picture.edges = false;
  picture.outlines = seeds.size() <= 30'000;  // beyond, cells have too few pixels
  picture.colours = cells().colours;
  write_preview(path, cells().vertices, cells().polygons, picture);
}

std::vector<ArrayView> RvdJob::arrays() {
  if (masses_.empty()) {
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      const Moments& m = diagram.moments.cells[i];
      constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
      masses_.push_back(m.mass);
      energies_.push_back(m.second);
      centroids_.push_back(m.mass > 0 ? seeds[i] + (1 / m.mass) * m.first : Vec3{kNan, kNan, kNan});
    }
    rdt_ = sorted_dual(diagram.dual);
    pairs_ = element_pairs();
    cell_offsets_.assign(cells().polygons.offsets.begin(), cells().polygons.offsets.end());
  }
  return {array_of("seeds", seeds),
          array_of("masses", masses_),
          array_of("centroids", centroids_),
          array_of("energies", energies_),
          array_of("rdt", rdt_),
          array_of("dual_tets", dual_tets_),
          array_of("pairs", pairs_),
          array_of("polygon_vertices", cells().vertices),
          array_of("polygon_offsets", cell_offsets_),
          array_of("polygon_cells", cells().labels)};
}

}  // namespace bisector::job
