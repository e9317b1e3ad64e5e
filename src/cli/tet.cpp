// bisector tet
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "bisector/quality.h"
#include "bisector/tetmesh.h"
#include "commands.h"
#include "console.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "inputs.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "options.h"
#include "outputs.h"
#include "remesh/topology_control.h"
#include "report.h"
#include "summary.h"
#include "words.h"

namespace bisector::cli {
namespace {

// Degrees; a mesh with a dihedral angle below this is warned of.
constexpr double kPoorDihedral = 8;

struct TetCommand {
  std::string input, output, seeds, boundary, preview;
  std::string attribute;  // of the input's vertices, a density
  std::string sizes, feature_file;
  double edge_length_relative = 0;  // of the input's diagonal; 0: not given
  double weld = -1;                 // not given
  WrapOption wrap;
  TetOptions options;
  CommonOptions common;
};

void add_options(CLI::App* app, TetCommand& command) {
  add_file(app, "IN", command.input, "FILE", "closed surface or tetrahedral mesh")->required();
  add_file(app, "-o", command.output, "FILE", "mesh to write: .mesh, .msh or .vtu")->required()->group("Output");
  add_file(app, "--boundary", command.boundary, "FILE",
           "also write the boundary's triangles: .off, .obj, .ply\nor .stl")
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the result, cut open")->group("Output");
  app->add_option("-n", command.options.vertices, "vertices of the result, about; at least 8")
      ->type_name("N")
      ->check(whole_number(8, kMostSeeds))
      ->group("Seeds");
  add_file(app, "--seeds", command.seeds, "FILE.xyz",
           "start from these points (\"x y z\" lines) inside the\n"
           "solid; -n is then not needed")
      ->group("Seeds");
  add_random_seed(app, command.options.random_seed, "another number, another start; default 1")->group("Seeds");
  add_edge_length(app, command.options.edge_length, command.edge_length_relative);
  add_density(app, command.options.sizing.field, command.attribute,
              "where tetrahedra are smaller: uniform (default),\n"
              "lfs[:EXP] or curvature[:EXP] of the boundary, with the\n"
              "edge lengths that 'bisector remesh' has for them, or\n"
              "attribute:NAME (of the input's vertices; edges are as\n"
              "long as its power -1/5)");
  add_file(app, "--sizes", command.sizes, "FILE[:NAME]",
           "edge lengths at the vertices of a mesh (.vtk, .vtu with\n"
           "point data NAME; .mesh with a .sol beside it), instead\n"
           "of a density; -n makes them a matter of proportion")
      ->group("Size");
  app->add_option("--gradation", command.options.sizing.field.gradation,
                  "edge lengths grow by at most so much per length into\n"
                  "the solid; default 0.2. Not for uniform density")
      ->type_name("G")
      ->check(number_below(10))
      ->group("Size");
  add_edge_bounds(app, command.options.sizing.field);
  add_features(app, command.options.features,
               "sharp edges to keep: auto (default), none, or all with a\n"
               "dihedral deviation of so many degrees. Edges between face\n"
               "labels are kept unless none");
  add_words(app, "--detail", command.options.detail, kDetailWords,
            "what is finer than the boundary's edges: auto (smaller\n"
            "edges where the vertices suffice, else merged; default),\n"
            "all (as many vertices as it takes) or off")
      ->group("Features");
  add_feature_file(app, command.feature_file);
  add_weld(app, command.weld);
  add_wrap(app, command.wrap);
  app->add_option("--min-angle", command.options.min_angle,
                  "degrees that all angles of the boundary's triangles\n"
                  "should exceed; 0: as they are; default 40")
      ->type_name("A")
      ->check(number_below(60))
      ->group("Optimisation");
  app->add_option("--min-dihedral", command.options.min_dihedral,
                  "degrees that all dihedral angles should exceed; 0: keep\n"
                  "slivers; default 30")
      ->type_name("A")
      ->check(number_below(55))
      ->group("Optimisation");
  add_iterations(app, command.options.iterations, "steps, of which each phase may make a share; default 100");
  add_tolerance(app, command.options.tolerance,
                "end a phase when the energy falls by less than this\n"
                "share per iteration; default 1e-6");
  add_compute_options(app, command.options.compute);
  add_common_options(app, command.common,
                     "write a JSON report with quality, distance of the\n"
                     "boundary to the input and timings; - for stdout");
}

void check_usage(const TetCommand& command, const Usage& usage) {
  usage.check_number_of_vertices();
  usage.check_wrap(command.attribute);
  if (usage.given("--sizes")) usage.refuse("--density", "sizes come from --sizes; leave one of the two out");
  const SizingOptions& sizing = command.options.sizing.field;
  if (usage.given("--gradation") && sizing.gradation == 0)
    throw CLI::ValidationError("--gradation: sizes inside a solid grow from its boundary; it must not be 0");
  usage.check_edge_bounds(sizing);
  if (sizing.kind == DensityKind::uniform && !usage.given("--sizes")) usage.check_uniform_density();
}

struct Input {
  bool solid = false;
  TriangleMesh surface;  // of a solid its boundary, with all of its vertices
  TetMesh tets;
};

Input read_input(const std::string& path, const Context& context) {
  Input input;
  if (is_tet_format(path)) {
    input.tets = read_tet_mesh(path, context);
    input.solid = !input.tets.tets.empty();
    if (input.solid) {
      input.surface.vertices = input.tets.vertices;
      input.surface.triangles = boundary_facets(input.tets.tets);
    } else {
      input.surface = surface_of_marks(input.tets);
    }
  } else {
    input.surface = read_mesh(path, context);
  }
  return input;
}

Json input_json(const Input& input) {
  if (!input.solid) return cli::input_json(input.surface);
  return {{"vertices", input.tets.vertices.size()},
          {"faces", input.surface.triangles.size()},
          {"tets", input.tets.tets.size()}};
}

// Path and name in "FILE" or "FILE:NAME".
std::pair<std::string, std::string> split_sizes(const std::string& word) {
  const std::size_t colon = word.rfind(':');
  std::error_code error;
  if (colon == std::string::npos || colon + 1 == word.size() || std::filesystem::exists(word, error)) return {word, ""};
  return {word.substr(0, colon), word.substr(colon + 1)};
}

SizeSamples read_sizes(const std::string& word) {
  const auto [path, name] = split_sizes(word);
  const TetMesh mesh = read_tet_mesh(path);
  return {mesh.vertices, read_tet_attribute(path, name), mesh.tets};
}

TetOptions tet_options(const TetCommand& command, const Input& input) {
  TetOptions options = command.options;
  if (!command.attribute.empty())
    options.sizing.field.attribute = is_tet_format(command.input)
                                         ? read_tet_attribute(command.input, command.attribute)
                                         : read_vertex_attribute(command.input, command.attribute);
  if (!command.sizes.empty()) options.sizing.sizes = read_sizes(command.sizes);
  if (!command.feature_file.empty()) options.features.given = read_feature_edges(command.feature_file, input.surface);
  if (command.edge_length_relative > 0)
    options.edge_length = command.edge_length_relative * bounding_box(input.surface.vertices).diagonal();
  if (command.weld >= 0) options.weld = command.weld;
  leave_out_folds(command.wrap, options.features);
  options.threads = command.common.threads;
  if (!command.seeds.empty()) {
    options.seeds = read_seeds(command.seeds, options.vertices);
    options.vertices = options.seeds.size();
  }
  return options;
}

TriangleMesh boundary_mesh(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  surface.triangles = mesh.boundary;
  surface.feature_edges = mesh.feature_edges;
  return surface;
}

struct Measures {
  TetQualityReport tets;
  QualityReport boundary;
  TetTopology topology;
};

Json improved_json(const TetImproveReport& improved) {
  const auto shapes = [](const TetShapes& s) -> Json {
    return {{"dihedral_min", s.dihedral_min},
            {"dihedral_max", s.dihedral_max},
            {"radius_ratio_min", s.radius_ratio_min},
            {"radius_ratio_mean", s.radius_ratio_mean},
            {"below_goal", s.below}};
  };
  return {{"rounds", improved.rounds},
          {"edge_removals", improved.edge_removals},
          {"face_removals", improved.face_removals},
          {"contractions", improved.contractions},
          {"insertions", improved.insertions},
          {"moves", improved.moves},
          {"before", shapes(improved.before)},
          {"after", shapes(improved.after)}};
}

Json tet_report(Console& console, const TetCommand& command, const TetResult& result, const Measures& measures,
                const Input& input, const Json& wrapped) {
  Json report = start_report("tet");
  report["device"] = device_json(result.device);
  report["input"] = input_json(input);
  report["output"] = size_json(result.mesh);
  report["background"] = {{"tets", result.background_tets}};
  report["iterations"] = result.iterations;
  report["evaluations"] = result.evaluations;
  report["energy"] = result.energy;
  report["gradient_norm"] = result.gradient_norm;
  report["seconds"] = nullptr;
  add_device(report, result.device, result.seconds.diagrams.device, result.device_work, result.evaluations);
  report["certification"] = certification_json(result.certification);
  report["quality"] = quality_json(measures.boundary);
  add_tets(report["quality"], measures.tets);
  console.phase("measuring the distance of the boundary to the input");
  add_distance(report["quality"], measure_distance(boundary_mesh(result.mesh), input.surface));
  report["quality"]["volume_input"] = result.volume;
  report["topology"] = topology_json(measures.topology.boundary);
  add_tets(report["topology"], measures.topology);
  report["topology"]["matches_input"] = same_topology(measures.topology.boundary, result.input_topology);
  report["topology"]["ball_property"] = result.boundary.ball_property;
  report["features"] = features_json(result.boundary.features, result.mesh.feature_edges.size());
  report["detail"] = detail_json(result.detail, result.boundary.features.curves);
  report["sizing"] = {
      {"wanted", result.wanted}, {"edge_length", result.edge_length}, {"boundary_vertices", result.boundary_vertices}};
  report["conform"] = {{"delaunay", result.delaunay},
                       {"steiner_points", result.steiner_points},
                       {"refused_sites", result.refused_sites}};
  if (command.options.min_dihedral > 0) report["improved"] = improved_json(result.improved);
  if (!wrapped.is_null()) report["wrap"] = wrapped;
  return report;
}

Json tet_seconds(const TetSeconds& seconds) {
  Json json{{"total", seconds.total}};
  json.update(seconds_json(seconds.diagrams));
  json["lbfgs"] = seconds.lbfgs;
  json["extract"] = seconds.extract;
  json["background"] = seconds.background;
  json["prepare"] = seconds.prepare;
  json["boundary"] = seconds.boundary;
  json["improve"] = seconds.improve;
  json["tet"] = seconds.total;
  return json;
}

void print_summary(Console& console, const TetCommand& command, const TetResult& result, const Measures& measures,
                   const Json& input, const Json& seconds) {
  const TetQualityReport& q = measures.tets;
  console.print(fmt::format("input      {}: {}", command.input, size_of(input)));
  console.print(fmt::format("output     {}: {}", command.output, size_of(size_json(result.mesh))));
  console.print(fmt::format(
      "quality    dihedral angles {:.2f} to {:.2f} degrees; radius ratio {:.4f} on average, {:.4f} at least",
      q.dihedral_min, q.dihedral_max, q.radius_ratio_mean, q.radius_ratio_min));
  console.print(fmt::format("boundary   {} in {}; theta_min {:.2f} degrees, q_min {:.4f}, q_ave {:.4f}",
                            counted(result.boundary_vertices, "vertex", "vertices"),
                            counted(result.mesh.boundary.size(), "triangle", "triangles"), measures.boundary.theta_min,
                            measures.boundary.q_min, measures.boundary.q_ave));
  const bool same = same_topology(measures.topology.boundary, result.input_topology);
  console.print(fmt::format("topology   {}{}", describe(measures.topology.boundary),
                            same ? "; as the input" : "; NOT as the input"));
  console.print(
      fmt::format("volume     {:.6g}, {:+.3g} % of the input's", q.volume, 100 * (q.volume / result.volume - 1)));
  const FeatureResult& features = result.boundary.features;
  if (features.curves > 0)
    console.print(fmt::format("features   {} of {} kept, {}", features.curves - features.broken,
                              counted(features.curves, "curve", "curves"),
                              counted(features.corners, "corner", "corners")));
  print_detail(console, result.detail);
  print_device(console, result.device);
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose)
    print_seconds(console, seconds, device_seconds_json(result.device, result.seconds.diagrams.device));
  console.print_written({command.output, command.boundary, command.preview, command.common.report});
}

void warn_of(Console& console, const TetCommand& command, const TetResult& result, const Measures& measures) {
  const FeatureResult& features = result.boundary.features;
  if (features.broken > 0)
    console.warn(fmt::format("{} of {} are not chains of edges of the output; ask for more vertices", features.broken,
                             counted(features.curves, "feature curve", "feature curves")));
  if (!same_topology(measures.topology.boundary, result.input_topology))
    console.warn(fmt::format("the boundary's topology ({}) is not the input's ({}); ask for more vertices",
                             describe(measures.topology.boundary), describe(result.input_topology)));
  if (command.options.min_dihedral > kPoorDihedral && measures.tets.dihedral_min < kPoorDihedral)
    console.warn(
        fmt::format("a dihedral angle is {:.2f} degrees only: the boundary has acute edges or parts thinner than its "
                    "edges; ask for more vertices",
                    measures.tets.dihedral_min));
  const std::size_t count = result.mesh.vertices.size();
  if (std::max(count, result.wanted) - std::min(count, result.wanted) > result.wanted / 20)
    console.warn(fmt::format("{} instead of {}: {}", counted(count, "vertex", "vertices"), result.wanted,
                             count > result.wanted ? "the boundary's shape and good angles took as many"
                                                   : "no more fitted inside the boundary"));
}

void run(const TetCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{command.output, kTetFormats},
                 {command.boundary, kMeshFormats},
                 {command.preview, {".png"}},
                 report_output(report_path)},
                {command.input, command.seeds, command.feature_file, split_sizes(command.sizes).first});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");
  const Context context = console.context();

  console.phase("reading " + command.input);
  const Stopwatch reading;
  const Input input = read_input(command.input, context);
  const TetOptions options = tet_options(command, input);
  double io = reading.seconds();
  TriangleMesh wrap;
  const Json wrapped =
      wrap_if_asked(command.wrap, input.surface, options.vertices, options.edge_length, true, console, wrap);

  const TetResult result = !wrapped.is_null() ? tetrahedralise(wrap, options, context)
                           : input.solid      ? tetrahedralise(input.tets, options, context)
                                              : tetrahedralise(input.surface, options, context);
  if (result.untiled > 0)
    throw Error(fmt::format("the final diagram does not tile {} of the input; please report this as a bug",
                            counted(result.untiled, "tetrahedron or triangle", "tetrahedra or triangles")));

  const Stopwatch measuring;
  Measures measures;
  measures.tets = measure_tet_quality(result.mesh);
  measures.boundary = measure_quality(boundary_mesh(result.mesh));
  measures.topology = analyse_tet_topology(result.mesh);
  warn_of(console, command, result, measures);
  Json report;
  if (!report_path.empty()) report = tet_report(console, command, result, measures, input, wrapped);
  Json seconds = tet_seconds(result.seconds);
  seconds["quality"] = measuring.seconds();

  console.phase("writing " + command.output);
  stop_watching_interrupts();
  const Stopwatch writing;
  write_tet_mesh(command.output, result.mesh);
  if (!command.boundary.empty()) write_mesh(command.boundary, boundary_surface(result.mesh));
  io += writing.seconds();
  const Stopwatch drawing;
  if (!command.preview.empty()) write_tet_preview(command.preview, result.mesh);
  seconds["preview"] = drawing.seconds();
  seconds["io"] = io;
  seconds["total"] = total.seconds();
  if (!report_path.empty()) {
    report["seconds"] = seconds;
    write_report(report_path, report, console.warnings());
  }
  print_summary(console, command, result, measures, input_json(input), seconds);
}

}  // namespace

Command add_tet(CLI::App& program) {
  const auto command = std::make_shared<TetCommand>();
  CLI::App* app = add_command(program, "tet", "Make a high-quality tetrahedral mesh of a solid.",
                              "bisector tet IN -o OUT -n N|--edge-length L [options]",
                              "Examples:\n"
                              "  bisector tet bunny.off -o out.msh -n 10000\n"
                              "  bisector tet part.stl -o out.vtu --edge-length 0.5 --report out.json\n"
                              "  bisector tet coarse.mesh -o fine.mesh -n 50000 --sizes sizes.vtu:h\n\n"
                              "The input is a closed surface (.off, .obj, .ply, .stl) or tetrahedra (.mesh, .msh, "
                              ".vtk, .vtu). Ctrl-C stops the run;\n"
                              "nothing is written.");
  add_options(app, *command);
  return {app, [=] { check_usage(*command, Usage(*app)); }, [=] { run(*command); }};
}

}  // namespace bisector::cli
