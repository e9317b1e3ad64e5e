// bisector quality
#include <fmt/format.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "bisector/io.h"
#include "bisector/quality.h"
#include "commands.h"
#include "console.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "options.h"
#include "outputs.h"
#include "report.h"
#include "summary.h"

namespace bisector::cli {
namespace {

struct QualityCommand {
  std::string mesh, reference;
  CommonOptions common;
};

void add_options(CLI::App* app, QualityCommand& command) {
  add_file(app, "MESH", command.mesh, "FILE",
           "surface to measure: .off, .obj, .ply or .stl; or\n"
           "tetrahedra: .mesh, .msh, .vtk or .vtu")
      ->required();
  add_file(app, "--reference", command.reference, "IN", "also measure the two-sided distance to this mesh")
      ->group("Output");
  add_common_options(app, command.common, "write a JSON report; - for stdout");
}

struct QualityMeasures {
  QualityReport quality;
  std::size_t self_intersections = 0;
  DistanceReport distance;  // if there is a reference
  TetQualityReport tets;    // if there are tetrahedra; then the others are the boundary's
  TetTopology tet_topology;
};

// A surface, or tetrahedra and their boundary.
struct MeasuredMesh {
  TetMesh tets;
  TriangleMesh surface;
};

MeasuredMesh read_measured(const std::string& path, const Context& context) {
  if (!is_tet_format(path)) return {{}, read_mesh(path, context)};
  MeasuredMesh mesh{read_tet_mesh(path, context), {}};
  mesh.surface = mesh.tets.tets.empty() ? surface_of_marks(mesh.tets) : boundary_surface(mesh.tets);
  return mesh;
}

Json size_json(const MeasuredMesh& mesh) {
  return mesh.tets.tets.empty() ? input_json(mesh.surface) : cli::size_json(mesh.tets);
}

using Row = std::function<void(const char* name, const std::string& value, const char* meaning)>;

std::string number(double x) { return fmt::format("{:.6g}", x); }

void print_tets(Console& console, const TetQualityReport& q, const TetTopology& t, const Row& row) {
  row("dihedral_min", number(q.dihedral_min), "smallest dihedral angle, degrees");
  row("dihedral_min_mean", number(q.dihedral_min_mean), "average of each tetrahedron's smallest");
  row("dihedral_max", number(q.dihedral_max), "largest dihedral angle, degrees");
  row("radius_ratio_min", number(q.radius_ratio_min),
      "worst 3 r / R of inscribed and circumscribed sphere; 1 is regular");
  row("radius_ratio_mean", number(q.radius_ratio_mean), "average");
  row("volume", number(q.volume), "");
  row("volume_min", number(q.volume_min), "of a tetrahedron");
  row("inverted", fmt::to_string(q.inverted), "tetrahedra of negative volume");
  row("zero_volume", fmt::to_string(q.zero_volume), "tetrahedra without volume");
  row("tet_edge_min", number(q.edge_min), "shortest edge");
  row("tet_edge_ave", number(q.edge_ave), "");
  row("tet_edge_max", number(q.edge_max), "longest edge");
  row("conforming", yes_no(t.conforming), "facets shared by two tetrahedra on opposite sides");
  if (!t.conforming) {
    row("", fmt::to_string(t.overused_facets), "facets of more than two tetrahedra");
    row("", fmt::to_string(t.misoriented_facets), "facets of two tetrahedra on one side");
    row("", fmt::to_string(t.repeated_vertices), "vertices at the point of another");
  }
  if (t.unused_vertices > 0) row("unused_vertices", fmt::to_string(t.unused_vertices), "vertices of no tetrahedron");
  row("tet_components", fmt::to_string(t.components), "connected through facets");
  std::string line = "dihedral angles by 10 degrees, %:";
  std::size_t angles = 0;
  for (const std::size_t count : q.dihedral_counts) angles += count;
  for (const std::size_t count : q.dihedral_counts)
    line += fmt::format(" {:.2g}", angles ? 100 * static_cast<double>(count) / static_cast<double>(angles) : 0.0);
  console.print(line);
}

void print_quality(Console& console, const QualityCommand& command, const QualityMeasures& measures,
                   const Json& input) {
  const QualityReport& q = measures.quality;
  const MeshTopology& t = q.topology;
  const auto row = [&](const char* name, const std::string& value, const char* meaning = "") {
    console.print(fmt::format("{:<20}{:>14}{}{}", name, value, *meaning ? "   " : "", meaning));
  };
  console.print(command.mesh);
  row("vertices", fmt::to_string(input["vertices"].get<std::size_t>()));
  row("faces", fmt::to_string(input["faces"].get<std::size_t>()));
  if (input.contains("tets")) {
    row("tets", fmt::to_string(input["tets"].get<std::size_t>()));
    print_tets(console, measures.tets, measures.tet_topology, row);
    console.print("boundary");
  }
  row("q_min", number(q.q_min), "worst triangle quality; 1 is equilateral");
  row("q_ave", number(q.q_ave), "average");
  row("theta_min", number(q.theta_min), "smallest angle, degrees");
  row("theta_min_ave", number(q.theta_min_ave), "average of each triangle's smallest");
  row("theta_max", number(q.theta_max), "largest angle, degrees");
  row("theta_below_30", number(q.theta_below_30), "% of triangles with an angle below 30 degrees");
  row("q_min_free", number(q.q_min_free), "q_min of triangles with fewer than two feature edges");
  row("theta_min_free", number(q.theta_min_free), "smallest angle not between two feature edges");
  row("theta_max_free", number(q.theta_max_free), "largest angle not between two feature edges");
  row("theta_below_30_free", number(q.theta_below_30_free), "% of triangles with such an angle below 30 degrees");
  row("valence6", number(q.valence6), "share of interior vertices with six neighbours");
  row("edge_min", number(q.edge_min), "shortest edge");
  row("edge_ave", number(q.edge_ave));
  row("edge_max", number(q.edge_max), "longest edge");
  row("area", number(q.area));
  row("zero_area", fmt::to_string(q.zero_area), "triangles without area");
  row("manifold", yes_no(t.manifold));
  if (!t.manifold) {
    row("", fmt::to_string(t.non_manifold_edges), "non-manifold edges");
    row("", fmt::to_string(t.non_manifold_vertices), "non-manifold vertices");
  }
  row("closed", yes_no(t.closed));
  if (!t.closed) row("", fmt::to_string(t.boundary_edges), "boundary edges");
  row("oriented", yes_no(t.oriented), "neighbouring triangles agree");
  row("euler", fmt::to_string(t.euler), "Euler characteristic V - E + F");
  row("components", fmt::to_string(t.components));
  row("self_intersections", fmt::to_string(measures.self_intersections), "pairs of triangles");
  if (command.reference.empty()) return;
  console.print("two-sided distance to " + command.reference + ", % of its diagonal");
  row("distance_mean", number(measures.distance.mean));
  row("distance_rms", number(measures.distance.rms));
  row("distance_max", number(measures.distance.max), "Hausdorff distance, from below");
}

void run(const QualityCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{}, report_output(report_path)}, {command.mesh, command.reference});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");
  const Context context = console.context();

  console.phase("reading " + command.mesh);
  const Stopwatch reading;
  const MeasuredMesh measured = read_measured(command.mesh, context);
  const TriangleMesh& mesh = measured.surface;
  MeasuredMesh reference;
  if (!command.reference.empty()) reference = read_measured(command.reference, context);
  Json seconds{{"total", 0.0}, {"io", reading.seconds()}};

  const Stopwatch measuring;
  QualityMeasures measures;
  measures.quality = measure_quality(mesh);
  const bool solid = !measured.tets.tets.empty();
  if (solid) {
    measures.tets = measure_tet_quality(measured.tets);
    measures.tet_topology = analyse_tet_topology(measured.tets);
  }
  console.phase("looking for self-intersections");
  measures.self_intersections = count_self_intersections(mesh);
  if (!command.reference.empty()) {
    console.phase("measuring the distance to " + command.reference);
    measures.distance = measure_distance(mesh, reference.surface);
  }
  console.phase("done");
  seconds["quality"] = measuring.seconds();
  seconds["total"] = total.seconds();

  if (!report_path.empty()) {
    stop_watching_interrupts();
    Json report = start_report("quality");
    report["input"] = size_json(measured);
    if (!command.reference.empty()) report["reference"] = size_json(reference);
    report["seconds"] = seconds;
    Json quality = quality_json(measures.quality);
    if (solid) add_tets(quality, measures.tets);
    quality["self_intersections"] = measures.self_intersections;
    if (!command.reference.empty()) add_distance(quality, measures.distance);
    report["quality"] = std::move(quality);
    report["topology"] = topology_json(measures.quality.topology);
    if (solid) add_tets(report["topology"], measures.tet_topology);
    write_report(report_path, report, console.warnings());
  }
  print_quality(console, command, measures, size_json(measured));
  if (command.common.verbose) print_seconds(console, seconds);
  console.print_written({report_path});
}

}  // namespace

Command add_quality(CLI::App& program) {
  const auto command = std::make_shared<QualityCommand>();
  CLI::App* app = add_command(program, "quality", "Measure angles, topology and distance to another mesh.",
                              "bisector quality MESH [--reference IN] [options]",
                              "Example:\n"
                              "  bisector quality out.obj --reference bunny.off");
  add_options(app, *command);
  return {app, {}, [=] { run(*command); }};
}

}  // namespace bisector::cli
