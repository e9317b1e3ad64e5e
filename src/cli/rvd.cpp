// bisector rvd
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "cells.h"
#include "commands.h"
#include "compute/compute.h"
#include "console.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "inputs.h"
#include "io/files.h"
#include "mesh/sampling.h"
#include "options.h"
#include "outputs.h"
#include "report.h"
#include "summary.h"
#include "voronoi/diagram.h"
#include "voronoi/tiling.h"

namespace bisector::cli {
namespace {

struct RvdCommand {
  std::string input, output, seeds, pairs, preview;
  std::size_t count = 0;
  std::uint64_t random_seed = 1;
  ComputeOptions compute;
  CommonOptions common;
};

void add_options(CLI::App* app, RvdCommand& command) {
  add_file(app, "IN", command.input, "FILE", "surface: .off, .obj, .ply or .stl")->required();
  add_file(app, "-o", command.output, "FILE.ply", "write the cells as coloured polygons")->group("Output");
  add_file(app, "--pairs", command.pairs, "FILE",
           "write \"face seed\" lines, one for each face (counted\n"
           "from 0 in the input) and cell that meet, sorted")
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the cells")->group("Output");
  add_file(app, "--seeds", command.seeds, "FILE.xyz", "the seeds, as \"x y z\" lines")->group("Seeds");
  app->add_option("-n", command.count, "so many random seeds instead")
      ->type_name("N")
      ->check(whole_number(1, kMostSeeds))
      ->group("Seeds");
  add_random_seed(app, command.random_seed, "another number, another start; default 1")->group("Seeds");
  add_compute_options(app, command.compute);
  add_common_options(app, command.common,
                     "write a JSON report with all cells and the restricted\n"
                     "Delaunay triangulation (rdt); - for stdout");
}

void check_usage(const RvdCommand& command, const Usage& usage) {
  if (command.seeds.empty() && command.count == 0)
    throw CLI::ValidationError("which seeds? give --seeds FILE.xyz or -n N");
  if (!command.seeds.empty() && usage.given("--random-seed"))
    throw CLI::ValidationError("--random-seed: seeds from a file are not random; leave one of the two out");
}

struct Computed {
  BackendDescription device;
  double mass_tolerance = 0;
  Diagram diagram;
  EvaluationReport evaluation;
};

Computed compute_diagram(Backend& backend, const std::vector<Vec3>& seeds) {
  Computed computed;
  computed.evaluation = backend.evaluate(seeds, Want::polygons | Want::dual, computed.diagram);
  computed.device = backend.description();
  computed.mass_tolerance = backend.mass_tolerance();
  if (const std::size_t untiled = count_untiled(backend.surface(), computed.diagram.polygons); untiled > 0)
    throw Error(fmt::format("the diagram does not tile {} of the input; please report this as a bug",
                            counted(untiled, "triangle", "triangles")));
  return computed;
}

Json cells_json(const CellMoments& moments, const std::vector<Vec3>& seeds) {
  Json cells = Json::array();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Moments& m = moments.cells[i];
    const Json centroid = m.mass > 0 ? point_json(seeds[i] + (1 / m.mass) * m.first) : Json(nullptr);
    cells.push_back({{"mass", m.mass}, {"centroid", centroid}, {"energy", m.second}});
  }
  return cells;
}

Json rdt_json(const Dual& dual) {
  std::vector<Triangle> triples = dual.triangles;
  for (Triangle& t : triples) std::sort(t.begin(), t.end());
  std::sort(triples.begin(), triples.end());
  return triples;
}

// Lines "face seed", sorted, each once.
std::string format_pairs(const RestrictedPolygons& polygons, const TriangleMesh& mesh) {
  std::vector<std::pair<Index, Index>> pairs;
  for (const auto& [triangle, cell] : polygons.pairs)
    pairs.emplace_back(mesh.face_of_triangle.empty() ? triangle : mesh.face_of_triangle[triangle], cell);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  fmt::memory_buffer text;
  for (const auto& [face, cell] : pairs) fmt::format_to(std::back_inserter(text), "{} {}\n", face, cell);
  return fmt::to_string(text);
}

std::vector<Vec3> rvd_seeds(const RvdCommand& command, const TriangleMesh& input) {
  if (!command.seeds.empty()) return read_seeds(command.seeds, command.count);
  std::vector<Vec3> seeds;
  for (const SurfaceSample& sample : sample_surface(input, command.count, command.random_seed))
    seeds.push_back(sample.point);
  return seeds;
}

void write_cells(const RvdCommand& command, const RestrictedPolygons& polygons, std::size_t seeds) {
  if (command.output.empty() && command.preview.empty()) return;
  const PolygonMesh cells = coloured_cells(polygons, seeds);
  if (!command.output.empty()) write_polygons(command.output, cells);
  if (command.preview.empty()) return;
  PreviewOptions picture;
  picture.edges = false;
  picture.outlines = seeds <= 30'000;  // beyond, cells have too few pixels
  picture.colours = cells.colours;
  write_preview(command.preview, cells.vertices, cells.polygons, picture);
}

Json rvd_report(const Computed& computed, const TriangleMesh& input, const std::vector<Vec3>& seeds,
                const Json& seconds) {
  Json report = start_report("rvd");
  report["device"] = device_json(computed.device);
  report["input"] = input_json(input);
  report["energy"] = computed.diagram.moments.energy;
  report["mass"] = computed.diagram.moments.mass;
  report["untiled"] = 0;  // a diagram that does not tile is not reported
  report["seconds"] = seconds;
  add_device(report, computed.device, computed.evaluation.seconds.device, computed.evaluation.device_work, 1);
  report["certification"] = certification_json(computed.evaluation.certification);
  report["cells"] = cells_json(computed.diagram.moments, seeds);
  report["rdt"] = rdt_json(computed.diagram.dual);
  return report;
}

void print_summary(Console& console, const RvdCommand& command, const Computed& computed, const TriangleMesh& input,
                   const Json& seconds) {
  const CellMoments& moments = computed.diagram.moments;
  const auto empty =
      std::count_if(moments.cells.begin(), moments.cells.end(), [](const Moments& m) { return m.mass == 0; });
  console.print(fmt::format("input      {}: {}", command.input, size_of(input_json(input))));
  console.print(
      fmt::format("cells      {}, {} of them empty; energy {:.6e}", moments.cells.size(), empty, moments.energy));
  console.print(fmt::format("pairs      {} of a cell and a triangle, {} decided in exact arithmetic",
                            computed.evaluation.certification.pairs, computed.evaluation.certification.cpu));
  console.print(fmt::format("dual       {}", counted(computed.diagram.dual.triangles.size(), "triangle", "triangles")));
  print_device(console, computed.device);
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose)
    print_seconds(console, seconds, device_seconds_json(computed.device, computed.evaluation.seconds.device));
  console.print_written({command.output, command.preview, command.pairs, command.common.report});
}

void run(const RvdCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs(
      {{command.output, {".ply"}}, {command.preview, {".png"}}, {command.pairs, {}}, report_output(report_path)},
      {command.input, command.seeds});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");

  console.phase("reading " + command.input);
  const Stopwatch reading;
  const TriangleMesh input = read_mesh(command.input, console.context());
  const std::vector<Vec3> seeds = rvd_seeds(command, input);
  double io = reading.seconds();

  console.phase("computing the diagram");
  const Surface surface(input);
  const std::unique_ptr<Backend> backend = make_backend(surface, command.compute, console.context());
  const Stopwatch computing;
  const Computed computed = compute_diagram(*backend, seeds);
  const double computing_seconds = computing.seconds();
  const Diagram& diagram = computed.diagram;
  if (std::abs(diagram.moments.mass - surface.mass) > computed.mass_tolerance * surface.mass)
    console.warn(fmt::format("the masses of the cells sum to {}, the area is {}", diagram.moments.mass, surface.mass));

  console.phase("writing");
  stop_watching_interrupts();
  const Stopwatch writing;
  write_cells(command, diagram.polygons, seeds.size());
  if (!command.pairs.empty()) write_file(command.pairs, format_pairs(diagram.polygons, input));
  io += writing.seconds();

  const DiagramSeconds& phases = computed.evaluation.seconds;
  Json seconds{{"total", total.seconds()}};
  seconds.update(seconds_json(phases));
  seconds["extract"] = computing_seconds - (phases.delaunay + phases.neighbours + phases.pairs + phases.clip);
  seconds["io"] = io;
  if (!report_path.empty()) write_report(report_path, rvd_report(computed, input, seeds, seconds), console.warnings());
  print_summary(console, command, computed, input, seconds);
}

}  // namespace

Command add_rvd(CLI::App& program) {
  const auto command = std::make_shared<RvdCommand>();
  CLI::App* app = add_command(program, "rvd", "Compute one restricted Voronoi diagram of a surface.",
                              "bisector rvd IN --seeds FILE.xyz|-n N [-o CELLS.ply] [options]",
                              "Examples:\n"
                              "  bisector rvd bunny.off -n 500 -o cells.ply --preview cells.png\n"
                              "  bisector rvd bunny.off --seeds points.xyz --report -");
  add_options(app, *command);
  return {app, [=] { check_usage(*command, Usage(*app)); }, [=] { run(*command); }};
}

}  // namespace bisector::cli
