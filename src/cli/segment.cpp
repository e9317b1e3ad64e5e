// bisector segment
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "bisector/quality.h"
#include "bisector/region_borders.h"
#include "bisector/segment.h"
#include "cells.h"
#include "commands.h"
#include "console.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "options.h"
#include "outputs.h"
#include "region_json.h"
#include "report.h"
#include "segment/dual_graph.h"
#include "segment/polygonise.h"
#include "summary.h"
#include "words.h"

namespace bisector::cli {
namespace {

using Colour = std::array<unsigned char, 3>;

struct SegmentCommand {
  std::string input, output, preview, trims, polygons;
  SegmentOptions options;
  PolygoniseOptions polygonise;
  bool triangulate = false;
  CommonOptions common;
};

void add_options(CLI::App* app, SegmentCommand& command) {
  SegmentOptions& options = command.options;
  add_file(app, "IN", command.input, "FILE", "surface: .off, .obj, .ply or .stl")->required();
  add_file(app, "-o", command.output, "FILE", "mesh to write, with the region of each triangle")
      ->required()
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw a picture of the regions")->group("Output");
  add_file(app, "--json", command.trims, "FILE.json",
           "write the regions' surfaces with the loops that trim\n"
           "them and the regions beside these")
      ->group("Output");
  add_file(app, "--polygons", command.polygons, "FILE",
           "write a coarse mesh with a polygon for each plane:\n"
           ".obj, .ply or .off")
      ->group("Output");
  app->add_option("--chord", command.polygonise.chord,
                  "with --polygons: borders are divided where they are\n"
                  "off a chord by more than R times its length;\n"
                  "default 0.2")
      ->type_name("R")
      ->check(number_above_zero())
      ->group("Output");
  app->add_flag("--triangulate", command.triangulate, "with --polygons: divide the polygons into triangles")
      ->group("Output");
  app->add_flag("--project", options.project, "move the vertices onto the surfaces found")->group("Output");
  app->add_option("--proxies", options.proxies, "so many regions")
      ->type_name("N")
      ->check(whole_number(1, kMostSeeds))
      ->group("Regions");
  app->add_option("--error", options.error,
                  "as few regions as keep the root mean square distance to\n"
                  "their surfaces below E percent of the bounding box's\n"
                  "diagonal; default 0.1")
      ->type_name("E")
      ->check(number_above_zero())
      ->group("Regions");
  add_words(app, "--surfaces", options.surfaces, kSurfaceWords,
            "what a region may be: planes, quadrics (planes too), or\n"
            "all (tori too; default)")
      ->group("Regions");
  add_words(app, "--start", options.start, kStartWords,
            "merging (of small pieces, the cheapest first; default),\n"
            "insertion (of one region after the other where the error\n"
            "is largest) or random (all regions at random triangles)")
      ->group("Regions");
  add_random_seed(app, options.random_seed, "another number, another random start; default 1")->group("Regions");
  app->add_option("--iterations", options.iterations, "Lloyd steps at most, each time; default 30")
      ->type_name("N")
      ->check(whole_number(0, 100'000))
      ->group("Regions");
  app->add_flag("--regularize", options.regularize,
                "parallel and perpendicular axes, coincident axes and\n"
                "planes, equal radii and angles, where the data allow")
      ->group("Regions");
  app->add_option("--smooth", options.smooth,
                  "weight of the borders' length, over that which the\n"
                  "distances left suggest; 0: borders are left as they are;\n"
                  "default 1")
      ->type_name("LAMBDA")
      ->check(number_below(1e6))
      ->group("Borders");
  app->add_option("--fuzzy-rings", options.fuzzy_rings,
                  "triangles up to so many steps from a border may change\n"
                  "sides; default as many as it takes")
      ->type_name("K")
      ->check(whole_number(1, 1000))
      ->group("Borders");
  add_common_options(app, command.common,
                     "write a JSON report with type, parameters and error of\n"
                     "each region; - for stdout");
}

void check_usage(const SegmentCommand& command, const Usage& usage) {
  if (usage.given("--proxies") && usage.given("--error"))
    throw CLI::ValidationError("--proxies and --error: give one of them");
  if (command.options.start != SegmentStart::random && usage.given("--random-seed"))
    throw CLI::ValidationError("--random-seed: only --start random is; add that or leave it out");
  for (const char* option : {"--chord", "--triangulate"})
    if (command.polygons.empty() && usage.given(option))
      throw CLI::ValidationError(std::string(option) + ": only --polygons has polygons; add that or leave it out");
  if (command.options.smooth == 0 && usage.given("--fuzzy-rings"))
    throw CLI::ValidationError("--fuzzy-rings: borders are not smoothed with --smooth 0; leave one of the two out");
}

void warn_of_format(Console& console, const std::string& output) {
  const std::string extension = extension_of(output);
  if (extension == ".ply" || extension == ".obj") return;
  console.warn(
      fmt::format("{}: {} files hold no face labels, the regions are lost; write .ply or .obj", output, extension));
}

// The input's triangles, labelled by region and moved where that was asked for.
TriangleMesh labelled_mesh(const TriangleMesh& input, const SegmentResult& result) {
  TriangleMesh mesh{result.projected.empty() ? input.vertices : result.projected, input.triangles};
  mesh.labels.assign(result.labels.begin(), result.labels.end());
  mesh.feature_edges = input.feature_edges;
  return mesh;
}

std::vector<Colour> region_colours(const TriangleMesh& mesh, const SegmentResult& result) {
  const DualGraph graph = dual_graph(mesh);
  std::vector<std::array<Index, 2>> meeting;
  for (std::size_t t = 0; t < result.labels.size(); ++t)
    for (const Index* u = graph.neighbours.begin(t); u != graph.neighbours.end(t); ++u)
      if (result.labels[*u] < result.labels[t]) meeting.push_back({result.labels[t], result.labels[*u]});
  std::sort(meeting.begin(), meeting.end());
  meeting.erase(std::unique(meeting.begin(), meeting.end()), meeting.end());
  return contrasting_colours(meeting, result.regions.size());
}

std::vector<std::string> region_names(const SegmentResult& result) {
  std::vector<std::string> names;
  for (const SegmentRegion& region : result.regions) names.push_back(name_of(type_of(region.proxy)));
  return names;
}

// Of faces with these labels.
template <class Label>
std::vector<Colour> face_colours(const std::vector<Label>& labels, const std::vector<Colour>& of_regions) {
  std::vector<Colour> colours;
  colours.reserve(labels.size());
  for (const Label label : labels) colours.push_back(of_regions[static_cast<std::size_t>(label)]);
  return colours;
}

// PLY has the regions' colours too, which only meshes of polygons hold.
void write_regions(const std::string& path, const TriangleMesh& mesh, const SegmentResult& result,
                   const std::vector<Colour>& of_regions) {
  const GroupNames names{"region", region_names(result)};
  if (extension_of(path) != ".ply") return write_mesh(path, mesh, names);
  write_polygons(path,
                 {mesh.vertices,
                  rows_of(mesh.triangles),
                  {mesh.labels.begin(), mesh.labels.end()},
                  face_colours(mesh.labels, of_regions),
                  mesh.feature_edges},
                 names);
}

void write_regions(const std::string& path, const PolygonisedMesh& mesh, const SegmentResult& result,
                   const std::vector<Colour>& of_regions) {
  write_polygons(path, {mesh.vertices, mesh.polygons, mesh.labels, face_colours(mesh.labels, of_regions)},
                 {"region", region_names(result)});
}

PolygonisedMesh polygonise(Console& console, const SegmentCommand& command, const TriangleMesh& mesh,
                           const SegmentResult& result, const RegionBorders& borders) {
  console.phase("making polygons");
  PolygonisedMesh polygons = bisector::polygonise(mesh, result, borders, command.polygonise);
  const auto curved = std::count_if(result.regions.begin(), result.regions.end(), [](const SegmentRegion& region) {
    return type_of(region.proxy) != SurfaceType::plane;
  });
  if (curved > 0)
    console.warn(fmt::format("{}: {} no plane, and triangles are kept there; --surfaces planes gives polygons only",
                             command.polygons, counted(static_cast<std::size_t>(curved), "region is", "regions are")));
  if (polygons.folded > 0)
    console.warn(
        fmt::format("{}: {} not lie flat with few corners and became triangles; more proxies or a smaller "
                    "--chord help",
                    command.polygons, counted(polygons.folded, "region does", "regions do")));
  if (polygons.self_intersections > 0)
    console.warn(fmt::format(
        "{}: {}; where the input's do not, more proxies or a smaller --chord help", command.polygons,
        counted(polygons.self_intersections, "pair of triangles intersects", "pairs of triangles intersect")));
  return polygons;
}

// "plane" to "planes", "plane_pair" to "plane pairs", "torus" to "tori".
std::string counted_type(std::size_t n, const std::string& type) {
  std::string one = type;
  std::replace(one.begin(), one.end(), '_', ' ');
  const std::string many = one == "torus" ? "tori" : one + "s";
  return counted(n, one.c_str(), many.c_str());
}

// "22: 10 planes, 5 cylinders, ...", the most frequent first.
std::string describe_regions(const SegmentResult& result) {
  std::map<std::string, std::size_t> counts;
  for (const SegmentRegion& region : result.regions) ++counts[name_of(type_of(region.proxy))];
  std::vector<std::pair<std::string, std::size_t>> types(counts.begin(), counts.end());
  std::stable_sort(types.begin(), types.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text = fmt::format("{}: ", result.regions.size());
  for (const auto& [type, n] : types) text += (&type == &types.front().first ? "" : ", ") + counted_type(n, type);
  return text;
}

Json relation_json(const SegmentRelation& relation) {
  Json json{{"kind", name_of(relation.kind)}, {"regions", relation.regions}};
  if (relation.kind == RelationKind::perpendicular) json["others"] = relation.others;
  if (relation.kind == RelationKind::equal_radius) json["radius"] = relation.value;
  if (relation.kind == RelationKind::equal_angle) json["angle"] = kDegreesPerRadian * relation.value;
  return json;
}

Json segmentation_json(const SegmentResult& result, double diagonal) {
  Json json{{"rms", result.rms},
            {"rms_percent", 100 * result.rms / diagonal},
            {"rms_before", result.rms_before},
            {"smooth", result.smooth},
            {"border_before", result.border_before},
            {"border_after", result.border_after},
            {"iterations", result.iterations},
            {"insertions", result.insertions},
            {"merges", result.merges},
            {"teleportations", result.teleportations},
            {"deletions", result.deletions},
            {"evaluations", result.evaluations},
            {"energies", result.energies}};
  json["regions"] = Json::array();
  for (const SegmentRegion& region : result.regions) json["regions"].push_back(region_json(region));
  json["relations"] = Json::array();
  for (const SegmentRelation& relation : result.relations) json["relations"].push_back(relation_json(relation));
  return json;
}

Json segment_report(Console& console, const SegmentResult& result, const TriangleMesh& mesh, const TriangleMesh& input,
                    double diagonal) {
  Json report = start_report("segment");
  report["input"] = input_json(input);
  report["output"] = output_json(mesh);
  report["segmentation"] = segmentation_json(result, diagonal);
  if (!result.projected.empty()) {
    console.phase("measuring the distance to the input");
    Json quality = quality_json(measure_quality(mesh));
    add_distance(quality, measure_distance(mesh, input));
    report["quality"] = std::move(quality);
  }
  return report;
}

Json polygons_json(const PolygonisedMesh& polygons) {
  return {{"vertices", polygons.vertices.size()},
          {"faces", polygons.polygons.rows()},
          {"triangles", polygons.triangulated.triangles.size()},
          {"divided", polygons.divided},
          {"folded", polygons.folded},
          {"self_intersections", polygons.self_intersections}};
}

Json segment_seconds(const SegmentSeconds& seconds) {
  return {{"total", seconds.total},     {"start", seconds.start},       {"lloyd", seconds.lloyd},
          {"improve", seconds.improve}, {"classify", seconds.classify}, {"smooth", seconds.smooth},
          {"project", seconds.project}, {"segment", seconds.total}};
}

void print_summary(Console& console, const SegmentCommand& command, const SegmentResult& result,
                   const std::optional<PolygonisedMesh>& polygons, const TriangleMesh& input, double diagonal,
                   const Json& seconds) {
  const auto worst = std::max_element(result.regions.begin(), result.regions.end(),
                                      [](const auto& a, const auto& b) { return a.max < b.max; });
  console.print(fmt::format("input      {}: {}", command.input, size_of(input_json(input))));
  console.print(fmt::format("regions    {}", describe_regions(result)));
  console.print(fmt::format("distance   rms {:.4g} % of the diagonal, at most {:.3g} % (region {}, {})",
                            100 * result.rms / diagonal, 100 * worst->max / diagonal, worst - result.regions.begin(),
                            name_of(type_of(worst->proxy))));
  if (command.options.smooth > 0)
    console.print(
        fmt::format("borders    {:.6g} long, {:.6g} before smoothing", result.border_after, result.border_before));
  if (polygons) console.print(fmt::format("polygons   {}", size_of(polygons_json(*polygons))));
  if (command.options.regularize)
    console.print(
        fmt::format("shared     {} of parameters", counted(result.relations.size(), "relation", "relations")));
  console.print(fmt::format("steps      {}, {}, {}, {}", counted(result.iterations, "iteration", "iterations"),
                            counted(result.insertions, "insertion", "insertions"),
                            counted(result.merges, "merge", "merges"),
                            counted(result.teleportations, "teleportation", "teleportations")));
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose) print_seconds(console, seconds);
  console.print_written({command.output, command.polygons, command.trims, command.preview, command.common.report});
}

void run(const SegmentCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{command.output, kMeshFormats},
                 {command.preview, {".png"}},
                 {command.trims, {".json"}},
                 {command.polygons, kPolygonFormats},
                 report_output(report_path)},
                {command.input});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");
  const Context context = console.context();

  console.phase("reading " + command.input);
  const Stopwatch reading;
  const TriangleMesh input = read_mesh(command.input, context);
  warn_of_format(console, command.output);
  double io = reading.seconds();

  console.phase("segmenting");
  const SegmentResult result = segment(input, command.options, context);
  const TriangleMesh mesh = labelled_mesh(input, result);
  const std::vector<Colour> colours = region_colours(mesh, result);
  const double diagonal = bounding_box(input.vertices).diagonal();

  const Stopwatch polygonising;
  RegionBorders borders;
  if (!command.polygons.empty() || !command.trims.empty()) borders = region_borders(mesh, result);
  std::optional<PolygonisedMesh> polygons;
  if (!command.polygons.empty()) polygons = polygonise(console, command, mesh, result, borders);
  const double polygon_seconds = polygonising.seconds();

  const Stopwatch measuring;
  Json report;
  if (!report_path.empty()) report = segment_report(console, result, mesh, input, diagonal);
  if (!report_path.empty() && polygons) report["polygons"] = polygons_json(*polygons);
  Json seconds = segment_seconds(result.seconds);
  seconds["polygons"] = polygon_seconds;
  seconds["quality"] = measuring.seconds();

  console.phase("writing " + command.output);
  stop_watching_interrupts();
  const Stopwatch writing;
  write_regions(command.output, mesh, result, colours);
  if (polygons && command.triangulate) write_regions(command.polygons, polygons->triangulated, result, colours);
  else if (polygons) write_regions(command.polygons, *polygons, result, colours);
  if (!command.trims.empty())
    write_report(command.trims, trims_json(command.input, mesh, result, borders), console.warnings());
  io += writing.seconds();
  const Stopwatch drawing;
  if (!command.preview.empty()) {
    PreviewOptions picture;
    picture.edges = false;
    picture.outlines = true;
    picture.colours = face_colours(mesh.labels, colours);
    write_preview(command.preview, mesh, picture);
  }
  seconds["preview"] = drawing.seconds();
  seconds["io"] = io;
  seconds["total"] = total.seconds();
  if (!report_path.empty()) {
    report["seconds"] = seconds;
    write_report(report_path, report, console.warnings());
  }
  print_summary(console, command, result, polygons, input, diagonal, seconds);
}

}  // namespace

Command add_segment(CLI::App& program) {
  const auto command = std::make_shared<SegmentCommand>();
  CLI::App* app = add_command(program, "segment", "Divide a surface into planes, quadrics and tori.",
                              "bisector segment IN -o OUT [--proxies N|--error E] [options]",
                              "Examples:\n"
                              "  bisector segment part.stl -o regions.ply --proxies 22 --preview regions.png\n"
                              "  bisector segment part.stl -o regions.obj --error 0.05 --report regions.json\n"
                              "  bisector segment part.stl -o regions.ply --proxies 22 --regularize\n"
                              "  bisector segment bunny.off -o regions.ply --proxies 28\n\n"
                              ".ply and .obj files hold the regions, as face labels and colours and as groups. Ctrl-C "
                              "stops the run; nothing is\n"
                              "written.");
  add_options(app, *command);
  return {app, [=] { check_usage(*command, Usage(*app)); }, [=] { run(*command); }};
}

}  // namespace bisector::cli
