#include "commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "core/parallel.h"
#include "compute/compute.h"
#include "io/mesh_io.h"
#include "preview/preview.h"
#include "mesh/sampling.h"
#include "io/tet_io.h"
#include "voronoi/dual.h"
#include "voronoi/tiling.h"
#include "cells.h"
#include "common.h"
#include "console.h"
#include "outputs.h"
#include "report.h"

namespace bisector::cli {
namespace {

// --- remesh ---

RemeshOptions remesh_options(const RemeshCommand& command, const TriangleMesh& input) {
  RemeshOptions options = command.options;
  const SizingOptions density = parse_density(command.density);
  options.sizing.kind = density.kind;
  options.sizing.exponent = density.exponent;
  if (const std::string name = density_attribute(command.density); !name.empty())
    options.sizing.attribute = read_vertex_attribute(command.input, name);
  options.features = parse_features(command.features);
  if (!command.feature_file.empty()) options.features.given = read_feature_edges(command.feature_file, input);
  if (command.edge_length_relative > 0)
    options.edge_length = command.edge_length_relative * bounding_box(input.vertices).diagonal();
  if (command.weld >= 0) options.weld = command.weld;
  options.threads = command.common.threads;
  options.compute = compute_options(command.compute);
  options.energy = command.energy == "rcvt"   ? Energy::restricted
                   : command.energy == "ccvt" ? Energy::constrained
                                              : Energy::automatic;
  options.topology = command.topology == "enforce" ? TopologyControl::enforce
                     : command.topology == "check" ? TopologyControl::check
                                                   : TopologyControl::off;
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
  console.warn(fmt::format("{}: {} files hold no face labels, the input's are lost; write .ply or .obj", output, extension));
}

void warn_of_features(Console& console, const RemeshResult& result) {
  if (result.features.broken > 0)
    console.warn(fmt::format("{} of {} are not chains of edges of the output; ask for more vertices",
                             result.features.broken, counted(result.features.curves, "feature curve", "feature curves")));
  if (2 * result.features.seeds > result.mesh.vertices.size())
    console.warn(fmt::format("features take {} of {}; for better triangles ask for more vertices, or for fewer features "
                             "(--features)", result.features.seeds,
                             counted(result.mesh.vertices.size(), "vertex", "vertices")));
}

void warn_of_topology(Console& console, const RemeshResult& result) {
  if (result.topology_matches && result.mesh.vertices.size() > result.wanted + result.wanted / 100)
    console.warn(fmt::format("{} instead of {}: fewer did not give the input's topology and features",
                             counted(result.mesh.vertices.size(), "vertex", "vertices"), result.wanted));
  if (result.topology_matches) return;
  console.warn(fmt::format("the output's topology ({}) is not the input's ({}); {}", describe(result.topology),
                           describe(result.input_topology),
                           result.input_topology.manifold ? "ask for more vertices" : "mend the input"));
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
  return {{"merged_vertices", welded.merged_vertices}, {"split_edges", welded.split_edges},
          {"removed_triangles", welded.degenerate_triangles + welded.duplicate_triangles},
          {"border_edges_before", welded.border_before}, {"border_edges_after", welded.border_after}};
}

Json remesh_report(Console& console, const RemeshResult& result, const QualityReport& quality,
                   const TriangleMesh& input, const RemeshOptions& options) {
  Json report = start_report("remesh");
  report["device"] = device_json(result.device);
  report["input"] = input_json(input);
  report["output"] = output_json(result.mesh);
  report["iterations"] = result.iterations;
  report["evaluations"] = result.evaluations;
  report["energy"] = result.energy;
  report["gradient_norm"] = result.gradient_norm;
  report["seconds"] = nullptr;
  add_device_seconds(report, result.device, result.seconds.diagrams.device);
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
  report["sizing"] = {{"wanted", result.wanted}, {"edge_length", result.edge_length}};
  report["noisy"] = result.noisy;
  report["weld"] = weld_json(result.welded);
  if (options.min_angle > 0 && options.energy != Energy::restricted && !result.noisy)
    report["improved"] = {{"made", result.improved.made}, {"inserted", result.improved.inserted},
                          {"removed", result.improved.removed}, {"missed", result.improved.missed}};
  if (options.fit)
    report["fit"] = {{"iterations", result.fitted.iterations}, {"damped", result.fitted.damped},
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
  if (result.noisy) console.print("noise      seeds were left off the surface, whose normals are noise at this edge length");
  console.print(fmt::format("energy     {:.6e} after {} iterations", result.energy, result.iterations));
  print_device(console, result.device);
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose)
    print_seconds(console, seconds, device_seconds_json(result.device, result.seconds.diagrams.device));
  console.print_written({command.output, command.preview, command.feature_output, command.common.report});
}

// --- rvd ---

struct Diagram {
  BackendDescription device;
  double mass_tolerance = 0;
  CellMoments moments;
  RestrictedPolygons polygons;
  Dual dual;
};

Diagram compute_diagram(Backend& backend, const std::vector<Vec3>& seeds) {
  Diagram diagram;
  backend.evaluate(seeds, diagram.moments, diagram.polygons);
  diagram.device = backend.description();
  diagram.mass_tolerance = backend.mass_tolerance();
  if (const std::size_t untiled = count_untiled(backend.surface(), diagram.polygons); untiled > 0)
    throw Error(fmt::format("the diagram does not tile {} of the input; please report this as a bug",
                            counted(untiled, "triangle", "triangles")));
  diagram.dual = extract_dual(diagram.polygons);
  return diagram;
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

Json rvd_report(const Diagram& diagram, const TriangleMesh& input, const std::vector<Vec3>& seeds, const Json& seconds) {
  Json report = start_report("rvd");
  report["device"] = device_json(diagram.device);
  report["input"] = input_json(input);
  report["energy"] = diagram.moments.energy;
  report["mass"] = diagram.moments.mass;
  report["untiled"] = 0;  // a diagram that does not tile is not reported
  report["seconds"] = seconds;
  add_device_seconds(report, diagram.device, diagram.moments.seconds.device);
  report["certification"] = certification_json(diagram.moments.certification);
  report["cells"] = cells_json(diagram.moments, seeds);
  report["rdt"] = rdt_json(diagram.dual);
  return report;
}

void print_summary(Console& console, const RvdCommand& command, const Diagram& diagram, const TriangleMesh& input,
                   const Json& seconds) {
  const CellMoments& moments = diagram.moments;
  const auto empty = std::count_if(moments.cells.begin(), moments.cells.end(),
                                   [](const Moments& m) { return m.mass == 0; });
  console.print(fmt::format("input      {}: {}", command.input, size_of(input_json(input))));
  console.print(fmt::format("cells      {}, {} of them empty; energy {:.6e}", moments.cells.size(), empty,
                            moments.energy));
  console.print(fmt::format("pairs      {} of a cell and a triangle, {} decided in exact arithmetic",
                            moments.certification.pairs, moments.certification.cpu));
  console.print(fmt::format("dual       {}", counted(diagram.dual.triangles.size(), "triangle", "triangles")));
  print_device(console, diagram.device);
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose)
    print_seconds(console, seconds, device_seconds_json(diagram.device, moments.seconds.device));
  console.print_written({command.output, command.preview, command.pairs, command.common.report});
}

// --- quality ---

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
  row("radius_ratio_min", number(q.radius_ratio_min), "worst 3 r / R of inscribed and circumscribed sphere; 1 is regular");
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

}  // namespace

SizingOptions parse_density(const std::string& word) {
  SizingOptions options;
  const std::size_t colon = word.find(':');
  const std::string kind = word.substr(0, colon), rest = colon == std::string::npos ? "" : word.substr(colon + 1);
  const Error wrong("'" + word + "' is none of uniform, lfs[:EXP], curvature[:EXP], attribute:NAME");
  if (kind == "attribute" && !rest.empty()) {
    options.kind = DensityKind::attribute;
    return options;
  }
  if (word == "uniform") return options;
  if (kind != "lfs" && kind != "curvature") throw wrong;
  options.kind = kind == "lfs" ? DensityKind::lfs : DensityKind::curvature;
  if (colon == std::string::npos) return options;
  const auto [stop, error] = std::from_chars(rest.data(), rest.data() + rest.size(), options.exponent);
  if (error != std::errc{} || stop != rest.data() + rest.size() || !(options.exponent > 0 && options.exponent <= 8))
    throw Error("'" + word + "': the exponent is not a number above 0 and at most 8");
  return options;
}

std::string density_attribute(const std::string& word) {
  const std::string prefix = "attribute:";
  return word.rfind(prefix, 0) == 0 ? word.substr(prefix.size()) : "";
}

FeatureOptions parse_features(const std::string& word) {
  FeatureOptions options;
  if (word == "auto") return options;
  if (word == "none") {
    options.mode = FeatureMode::none;
    return options;
  }
  options.mode = FeatureMode::degrees;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), options.angle);
  if (error != std::errc{} || stop != word.data() + word.size() || !(options.angle > 0 && options.angle < 180))
    throw Error("'" + word + "' is none of auto, none, or degrees above 0 and below 180");
  return options;
}

Precision parse_precision(const std::string& word) {
  return word == "single" ? Precision::single : word == "double" ? Precision::double_ : Precision::automatic;
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
  const RemeshOptions options = remesh_options(command, input);
  warn_of_labels(console, input, command.output);
  double io = reading.seconds();

  console.phase("preparing");
  const RemeshResult result = remesh(input, options, context);
  require_sound(result);
  warn_of_features(console, result);
  if (options.topology != TopologyControl::off) warn_of_topology(console, result);

  const Stopwatch measuring;
  const QualityReport quality = measure_quality(result.mesh);
  Json report;
  if (!report_path.empty()) report = remesh_report(console, result, quality, input, options);
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
    write_report(report_path, report);
  }
  print_summary(console, command, result, quality, input_json(input), seconds);
}

void run(const RvdCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{command.output, {".ply"}}, {command.preview, {".png"}}, {command.pairs, {}}, report_output(report_path)},
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
  const std::unique_ptr<Backend> backend = make_backend(surface, compute_options(command.compute), console.context());
  const Stopwatch computing;
  const Diagram diagram = compute_diagram(*backend, seeds);
  const double computed = computing.seconds();
  if (std::abs(diagram.moments.mass - surface.mass) > diagram.mass_tolerance * surface.mass)
    console.warn(fmt::format("the masses of the cells sum to {}, the area is {}", diagram.moments.mass, surface.mass));

  console.phase("writing");
  stop_watching_interrupts();
  const Stopwatch writing;
  write_cells(command, diagram.polygons, seeds.size());
  if (!command.pairs.empty()) write_file(command.pairs, format_pairs(diagram.polygons, input));
  io += writing.seconds();

  const DiagramSeconds& phases = diagram.moments.seconds;
  Json seconds{{"total", total.seconds()}};
  seconds.update(seconds_json(phases));
  seconds["extract"] = computed - (phases.delaunay + phases.neighbours + phases.pairs + phases.clip);
  seconds["io"] = io;
  if (!report_path.empty()) write_report(report_path, rvd_report(diagram, input, seeds, seconds));
  print_summary(console, command, diagram, input, seconds);
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
    write_report(report_path, report);
  }
  print_quality(console, command, measures, size_json(measured));
  if (command.common.verbose) print_seconds(console, seconds);
  console.print_written({report_path});
}

}  // namespace bisector::cli
