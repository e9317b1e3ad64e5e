// bisector remesh
#include <fmt/format.h>

#include <memory>
#include <string>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "bisector/quality.h"
#include "bisector/remesh.h"
#include "commands.h"
#include "console.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "inputs.h"
#include "options.h"
#include "outputs.h"
#include "report.h"
#include "summary.h"
#include "words.h"

namespace bisector::cli {
namespace {

struct RemeshCommand {
  std::string input, output, seeds, preview;
  std::string attribute;  // of the input's vertices, a density
  std::string feature_file, feature_output;
  double edge_length_relative = 0;  // of the input's diagonal; 0: not given
  double weld = -1;                 // not given
  WrapOption wrap;
  RemeshOptions options;
  CommonOptions common;
};

void add_options(CLI::App* app, RemeshCommand& command) {
  add_file(app, "IN", command.input, "FILE", "surface to remesh")->required();
  add_file(app, "-o", command.output, "FILE", "mesh to write")->required()->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the result")->group("Output");
  app->add_option("-n", command.options.vertices, "vertices of the result, at least 4")
      ->type_name("N")
      ->check(whole_number(4, kMostSeeds))
      ->group("Seeds");
  add_file(app, "--seeds", command.seeds, "FILE.xyz",
           "start from these points (\"x y z\" lines) in one level;\n"
           "-n is then not needed")
      ->group("Seeds");
  add_random_seed(app, command.options.random_seed, "another number, another start; default 1")->group("Seeds");
  add_edge_length(app, command.options.edge_length, command.edge_length_relative);
  add_density(app, command.options.sizing, command.attribute,
              "where triangles are smaller: uniform (default),\n"
              "lfs[:EXP] (local feature size to the power -EXP,\n"
              "default 2), curvature[:EXP] (the larger principal one,\n"
              "default 1) or attribute:NAME (a vertex property of a\n"
              "PLY file); edges are as long as density^(-1/4)");
  app->add_option("--gradation", command.options.sizing.gradation,
                  "edge lengths change by at most so much per length;\n"
                  "0: no bound; default 0.2. Not for uniform density")
      ->type_name("G")
      ->check(number_below(10))
      ->group("Size");
  add_edge_bounds(app, command.options.sizing);
  add_features(app, command.options.features,
               "sharp edges to keep: auto (default), none, or all with a\n"
               "dihedral deviation of so many degrees. Borders and\n"
               "non-manifold edges are always kept, edges between face\n"
               "labels unless none");
  add_words(app, "--detail", command.options.detail, kDetailWords,
            "what is finer than the edges: auto (smaller edges where\n"
            "the vertices suffice, else merged; default), all (as many\n"
            "vertices as it takes) or off")
      ->group("Features");
  add_feature_file(app, command.feature_file);
  add_file(app, "--feature-output", command.feature_output, "FILE",
           "write the result's feature edges likewise; .ply and .obj\n"
           "outputs hold them too")
      ->group("Features");
  add_weld(app, command.weld);
  add_wrap(app, command.wrap);
  add_words(app, "--topology", command.options.topology, kTopologyWords,
            "where the result's topology is not the input's:\n"
            "enforce (mend it; default), check (warn) or off")
      ->group("Optimisation");
  add_words(app, "--energy", command.options.energy, kEnergyWords,
            "ccvt (seeds on the surface), rcvt (free) or auto (ccvt\n"
            "unless the input is noise at this edge length; default)")
      ->group("Optimisation");
  app->add_option("--min-angle", command.options.min_angle,
                  "degrees that the last pass tries to get all angles\n"
                  "above; 0: no such pass; default 40")
      ->type_name("A")
      ->check(number_below(60))
      ->group("Optimisation");
  app->add_flag("--fit", command.options.fit,
                "move the result's vertices off the surface, to where\n"
                "its triangles are nearest to the input")
      ->group("Optimisation");
  add_iterations(app, command.options.iterations, "at most so many per level; default 100");
  add_tolerance(app, command.options.tolerance,
                "end a level when the energy falls by less than this\n"
                "share per iteration; default 1e-6");
  app->add_option("--levels", command.options.levels,
                  "coarse-to-fine levels, 1 to 8; default: as many as the\n"
                  "count allows, at most 3")
      ->type_name("N")
      ->check(whole_number(1, 8))
      ->group("Optimisation");
  add_compute_options(app, command.options.compute);
  add_common_options(app, command.common,
                     "write a JSON report with quality, distance to the\n"
                     "input and timings; - for stdout");
}

// What options ask of each other: an option that would change nothing is an error.
void check_usage(const RemeshCommand& command, const Usage& usage) {
  usage.check_number_of_vertices();
  usage.check_wrap(command.attribute);
  if (usage.given("--seeds")) {
    for (const char* option : {"--edge-min", "--edge-max"})
      usage.refuse(option, "seeds from a file have their own number; leave one of the two out");
    usage.refuse("--detail", "edges are as long as seeds from a file make them; leave one of the two out");
    if (command.options.levels > 1) throw CLI::ValidationError("--levels: seeds from a file imply one level");
  }
  const SizingOptions& sizing = command.options.sizing;
  usage.check_edge_bounds(sizing);
  const double length = command.options.edge_length;
  if (length > 0 && (length < sizing.min_edge || (sizing.max_edge > 0 && length > sizing.max_edge)))
    throw CLI::ValidationError("--edge-length is not between --edge-min and --edge-max");
  if (sizing.kind == DensityKind::uniform) usage.check_uniform_density();
  if (command.options.energy == Energy::restricted && command.options.min_angle > 0)
    usage.refuse("--min-angle", "seeds have to be on the surface for that; leave out --energy rcvt");
}

// What the options say, with the files that they name.
RemeshOptions remesh_options(const RemeshCommand& command, const TriangleMesh& input) {
  RemeshOptions options = command.options;
  if (!command.attribute.empty()) options.sizing.attribute = read_vertex_attribute(command.input, command.attribute);
  if (!command.feature_file.empty()) options.features.given = read_feature_edges(command.feature_file, input);
  if (command.edge_length_relative > 0)
    options.edge_length = command.edge_length_relative * bounding_box(input.vertices).diagonal();
  if (command.weld >= 0) options.weld = command.weld;
  leave_out_folds(command.wrap, options.features);
  options.threads = command.common.threads;
  if (!command.seeds.empty()) {
    options.seeds = read_seeds(command.seeds, options.vertices);
    options.vertices = options.seeds.size();
  }
  return options;
}

void require_sound(const RemeshResult& result) {
  if (result.untiled > 0)
    throw Error(fmt::format("the final diagram does not tile {} of the input; please report this as a bug",
                            counted(result.untiled, "triangle", "triangles")));
  if (result.mesh.triangles.empty())
    throw Error("the seeds are too few to span a triangle of this surface; ask for more vertices");
}

void warn_of_labels(Console& console, const TriangleMesh& input, const std::string& output) {
  const std::string extension = extension_of(output);
  if (input.labels.empty() || extension == ".ply" || extension == ".obj") return;
  console.warn(
      fmt::format("{}: {} files hold no face labels, the input's are lost; write .ply or .obj", output, extension));
}

void warn_of_features(Console& console, const RemeshResult& result) {
  if (result.features.broken > 0)
    console.warn(fmt::format("{} of {} are not chains of edges of the output; ask for more vertices",
                             result.features.broken,
                             counted(result.features.curves, "feature curve", "feature curves")));
  if (2 * result.features.seeds > result.mesh.vertices.size())
    console.warn(
        fmt::format("features take {} of {}; for better triangles ask for more vertices, or for fewer features "
                    "(--features)",
                    result.features.seeds, counted(result.mesh.vertices.size(), "vertex", "vertices")));
}

void warn_of_topology(Console& console, const RemeshResult& result) {
  if (result.topology_matches && result.mesh.vertices.size() > result.wanted + result.wanted / 100)
    console.warn(fmt::format("{} instead of {}: fewer did not give the input's topology and features",
                             counted(result.mesh.vertices.size(), "vertex", "vertices"), result.wanted));
  if (result.topology_matches) return;
  console.warn(
      fmt::format("the output's topology ({}) is not the input's ({}); {}", describe(result.topology),
                  describe(result.input_topology),
                  result.input_topology.manifold ? "ask for more vertices" : "mend the input, or wrap it (--wrap)"));
}

// Everything but the seconds, whose place is kept.
Json faults_json(const RemeshResult& result) {
  Json faults = Json::array();
  for (const TopologyFault& fault : result.faults) {
    Json vertices = Json::array();
    for (Index v : fault.seeds) vertices.push_back(v == kNone ? Json(nullptr) : Json(v));
    faults.push_back({{"vertices", vertices}, {"position", point_json(fault.position)}, {"what", fault.what}});
  }
  return faults;
}

Json weld_json(const WeldResult& welded) {
  return {{"merged_vertices", welded.merged_vertices},
          {"split_edges", welded.split_edges},
          {"removed_triangles", welded.degenerate_triangles + welded.duplicate_triangles},
          {"border_edges_before", welded.border_before},
          {"border_edges_after", welded.border_after}};
}

Json remesh_report(Console& console, const RemeshResult& result, const QualityReport& quality,
                   const TriangleMesh& input, const Json& wrapped, const RemeshOptions& options) {
  Json report = start_report("remesh");
  report["device"] = device_json(result.device);
  report["input"] = input_json(input);
  report["output"] = output_json(result.mesh);
  report["iterations"] = result.iterations;
  report["evaluations"] = result.evaluations;
  report["energy"] = result.energy;
  report["gradient_norm"] = result.gradient_norm;
  report["seconds"] = nullptr;
  add_device(report, result.device, result.seconds.diagrams.device, result.device_work, result.evaluations);
  report["certification"] = certification_json(result.certification);
  report["quality"] = quality_json(quality);
  console.phase("measuring the distance to the input");
  add_distance(report["quality"], measure_distance(result.mesh, input));
  console.phase("looking for self-intersections");
  report["quality"]["self_intersections"] = count_self_intersections(result.mesh);
  report["topology"] = topology_json(result.topology);
  report["topology"]["matches_input"] = result.topology_matches;
  report["topology"]["ball_property"] = result.ball_property;
  report["topology"]["divided"] = result.divided;
  report["topology"]["faults"] = faults_json(result);
  report["features"] = features_json(result.features, result.mesh.feature_edges.size());
  report["detail"] = detail_json(result.detail, result.features.curves);
  report["sizing"] = {{"wanted", result.wanted}, {"edge_length", result.edge_length}};
  report["noisy"] = result.noisy;
  report["weld"] = weld_json(result.welded);
  if (!wrapped.is_null()) report["wrap"] = wrapped;
  if (options.min_angle > 0 && options.energy != Energy::restricted && !result.noisy)
    report["improved"] = {{"made", result.improved.made},
                          {"inserted", result.improved.inserted},
                          {"removed", result.improved.removed},
                          {"missed", result.improved.missed}};
  if (options.fit)
    report["fit"] = {{"iterations", result.fitted.iterations},
                     {"damped", result.fitted.damped},
                     {"restored", result.fitted.restored}};
  return report;
}

Json remesh_seconds(const RemeshSeconds& seconds) {
  Json json{{"total", seconds.total}};
  json.update(seconds_json(seconds.diagrams));
  json["lbfgs"] = seconds.lbfgs;
  json["extract"] = seconds.extract;
  json["prepare"] = seconds.prepare;
  json["features"] = seconds.features;
  json["topology"] = seconds.topology;
  json["improve"] = seconds.improve;
  json["fit"] = seconds.fit;
  json["remesh"] = seconds.total;
  return json;
}

void print_summary(Console& console, const RemeshCommand& command, const RemeshResult& result,
                   const QualityReport& quality, const Json& input, const Json& seconds) {
  console.print(fmt::format("input      {}: {}", command.input, size_of(input)));
  console.print(fmt::format("output     {}: {}", command.output, size_of(output_json(result.mesh))));
  console.print(fmt::format("quality    q_min {:.4f}, theta_min {:.2f} degrees; theta_below_30 {:.3g} %", quality.q_min,
                            quality.theta_min, quality.theta_below_30));
  console.print(fmt::format("           q_ave {:.4f}, theta_min_ave {:.2f} degrees; valence6 {:.1f} %", quality.q_ave,
                            quality.theta_min_ave, 100 * quality.valence6));
  console.print(fmt::format("topology   {}{}", describe(result.topology),
                            result.topology_matches ? "; as the input" : "; NOT as the input"));
  if (result.features.curves > 0)
    console.print(fmt::format("features   {} of {} kept, {}", result.features.curves - result.features.broken,
                              counted(result.features.curves, "curve", "curves"),
                              counted(result.features.corners, "corner", "corners")));
  print_detail(console, result.detail);
  if (result.noisy)
    console.print("noise      seeds were left off the surface, whose normals are noise at this edge length");
  console.print(fmt::format("energy     {:.6e} after {} iterations", result.energy, result.iterations));
  print_device(console, result.device);
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose)
    print_seconds(console, seconds, device_seconds_json(result.device, result.seconds.diagrams.device));
  console.print_written({command.output, command.preview, command.feature_output, command.common.report});
}

void run(const RemeshCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{command.output, kMeshFormats},
                 {command.preview, {".png"}},
                 {command.feature_output, {}},
                 report_output(report_path)},
                {command.input, command.seeds, command.feature_file});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");
  const Context context = console.context();

  console.phase("reading " + command.input);
  const Stopwatch reading;
  const TriangleMesh input = read_mesh(command.input, context);
  double io = reading.seconds();
  const RemeshOptions options = remesh_options(command, input);
  TriangleMesh wrap;
  const Json wrapped = wrap_if_asked(command.wrap, input, options.vertices, options.edge_length, false, console, wrap);
  const TriangleMesh& surface = wrapped.is_null() ? input : wrap;
  warn_of_labels(console, surface, command.output);

  console.phase("preparing");
  const RemeshResult result = remesh(surface, options, context);
  require_sound(result);
  warn_of_features(console, result);
  if (options.topology != TopologyControl::off) warn_of_topology(console, result);

  const Stopwatch measuring;
  const QualityReport quality = measure_quality(result.mesh);
  Json report;
  if (!report_path.empty()) report = remesh_report(console, result, quality, input, wrapped, options);
  Json seconds = remesh_seconds(result.seconds);
  seconds["quality"] = measuring.seconds();

  console.phase("writing " + command.output);
  stop_watching_interrupts();
  const Stopwatch writing;
  write_mesh(command.output, result.mesh);
  if (!command.feature_output.empty()) write_feature_edges(command.feature_output, result.mesh.feature_edges);
  io += writing.seconds();
  const Stopwatch drawing;
  if (!command.preview.empty()) write_preview(command.preview, result.mesh);
  seconds["preview"] = drawing.seconds();
  seconds["io"] = io;
  seconds["total"] = total.seconds();
  if (!report_path.empty()) {
    report["seconds"] = seconds;
    write_report(report_path, report, console.warnings());
  }
  print_summary(console, command, result, quality, input_json(input), seconds);
}

}  // namespace

Command add_remesh(CLI::App& program) {
  const auto command = std::make_shared<RemeshCommand>();
  CLI::App* app = add_command(
      program, "remesh", "Make a high-quality triangle mesh of a surface.",
      "bisector remesh IN -o OUT -n N|--edge-length L [options]",
      "Examples:\n"
      "  bisector remesh bunny.off -o out.obj -n 10000\n"
      "  bisector remesh part.stl -o out.ply -n 5000 --report out.json --preview out.png\n"
      "  bisector remesh part.stl -o out.ply --edge-length 0.5 --features 30\n\n"
      "Meshes are read and written by extension: .off, .obj, .ply, .stl. Ctrl-C stops the run; nothing is written.");
  add_options(app, *command);
  return {app, [=] { check_usage(*command, Usage(*app)); }, [=] { run(*command); }};
}

}  // namespace bisector::cli
