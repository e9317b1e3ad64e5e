#include "job/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "bisector/quality.h"
#include "core/geometry.h"
#include "core/grouping.h"
#include "core/stopwatch.h"
#include "job/cells.h"
#include "job/inputs.h"
#include "job/messages.h"
#include "job/outputs.h"
#include "job/region_json.h"
#include "job/words.h"
#include "mesh/joining.h"
#include "segment/dual_graph.h"
#include "segment/polygonise.h"

namespace bisector::job {
namespace {

using Colour = std::array<unsigned char, 3>;

// The input's triangles, labelled by region and moved where that was asked for.
TriangleMesh labelled_mesh(const TriangleMesh& input, const SegmentResult& result) {
  TriangleMesh mesh{result.projected.empty() ? input.vertices : result.projected, input.triangles};
  mesh.labels.assign(result.labels.begin(), result.labels.end());
  mesh.feature_edges = input.feature_edges;
  mesh.unit = input.unit;
  return mesh;
}

std::vector<Colour> region_colours(const TriangleMesh& mesh, const SegmentResult& result) {
  const DualGraph graph = dual_graph(join_equal_points(mesh), mesh.vertices);
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

// In PLY meshes of polygons alone hold the regions' colours.
void write_regions(const std::string& path, const TriangleMesh& mesh, const SegmentResult& result,
                   const std::vector<Colour>& of_regions) {
  const WriteOptions names{"region", region_names(result), of_regions};
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

Json segment_seconds(const SegmentSeconds& seconds) {
  return {{"total", seconds.total},     {"start", seconds.start},       {"lloyd", seconds.lloyd},
          {"improve", seconds.improve}, {"classify", seconds.classify}, {"smooth", seconds.smooth},
          {"project", seconds.project}, {"segment", seconds.total}};
}

}  // namespace

Json polygons_json(const PolygonisedMesh& polygons) {
  return {{"vertices", polygons.vertices.size()},
          {"faces", polygons.polygons.rows()},
          {"triangles", polygons.triangulated.triangles.size()},
          {"divided", polygons.divided},
          {"folded", polygons.folded},
          {"self_intersections", polygons.self_intersections}};
}

std::vector<OutputKind> SegmentJob::outputs() const {
  return {{"output", "-o", "FILE", with_extensions("mesh to write, with the region of each triangle", kMeshFormats),
           kMeshFormats, true},
          {"preview", "--preview", "FILE.png", "draw a picture of the regions", {".png"}, false, false, "preview"},
          {"json",
           "--json",
           "FILE.json",
           "write the regions' surfaces with the loops that trim\n"
           "them and the regions beside these",
           {".json"}},
          {"polygons", "--polygons", "FILE",
           with_extensions("write a coarse mesh with a polygon for each plane", kPolygonFormats), kPolygonFormats,
           false, true}};
}

void SegmentJob::add_options(CLI::App* app) {
  app->add_option("--chord", polygonise_.chord,
                  "with --polygons: borders are divided where they are\n"
                  "off a chord by more than R times its length;\n"
                  "default 0.2")
      ->type_name("R")
      ->check(number_above_zero())
      ->group("Output");
  app->add_flag("--triangulate", triangulate_, "with --polygons: divide the polygons into triangles")->group("Output");
  app->add_flag("--project", options_.project, "move the vertices onto the surfaces found")->group("Output");
  app->add_option("--proxies", options_.proxies, "so many regions")
      ->type_name("N")
      ->transform(whole_number(1, kMostSeeds))
      ->group("Regions");
  app->add_option("--error", options_.error,
                  "as few regions as keep the root mean square distance to\n"
                  "their surfaces below E percent of the bounding box's\n"
                  "diagonal; default 0.1")
      ->type_name("E")
      ->check(number_above_zero())
      ->group("Regions");
  add_words(app, "--surfaces", options_.surfaces, kSurfaceWords,
            "what a region may be: planes, quadrics (planes too), or\n"
            "all (tori too; default)")
      ->group("Regions");
  add_words(app, "--start", options_.start, kStartWords,
            "merging (of small pieces, the cheapest first; default),\n"
            "insertion (of one region after the other where the error\n"
            "is largest) or random (all regions at random triangles)")
      ->group("Regions");
  add_random_seed(app, options_.random_seed, "another number, another random start; default 1")->group("Regions");
  app->add_option("--iterations", options_.iterations, "Lloyd steps at most, each time; default 30")
      ->type_name("N")
      ->transform(whole_number(0, 100'000))
      ->group("Regions");
  app->add_flag("--regularize", options_.regularize,
                "parallel and perpendicular axes, coincident axes and\n"
                "planes, equal radii and angles, where the data allow")
      ->group("Regions");
  app->add_option("--smooth", options_.smooth,
                  "weight of the borders' length, over that which the\n"
                  "distances left suggest; 0: borders are left as they are;\n"
                  "default 1")
      ->type_name("LAMBDA")
      ->check(number_below(1e6))
      ->group("Borders");
  app->add_option("--fuzzy-rings", options_.fuzzy_rings,
                  "triangles up to so many steps from a border may change\n"
                  "sides; default as many as it takes")
      ->type_name("K")
      ->transform(whole_number(1, 1000))
      ->group("Borders");
  add_threads(app, threads);
}

void SegmentJob::check_usage(const Usage& usage) {
  if (usage.given("--proxies") && usage.given("--error"))
    throw CLI::ValidationError("--proxies and --error: give one of them");
  if (options_.start != SegmentStart::random && usage.given("--random-seed"))
    throw CLI::ValidationError("--random-seed: only --start random is; add that or leave it out");
  for (const char* option : {"--chord", "--triangulate"})
    if (!usage.given("--polygons") && usage.given(option))
      throw CLI::ValidationError(std::string(option) + ": only --polygons has polygons; add that or leave it out");
  if (options_.smooth == 0 && usage.given("--fuzzy-rings"))
    throw CLI::ValidationError("--fuzzy-rings: borders are not smoothed with --smooth 0; leave one of the two out");
}

void SegmentJob::plan(std::string_view output, const std::string& name) {
  if (output == "polygons") polygons_name_ = name;
}

void SegmentJob::read(Journal& journal) {
  const Stopwatch reading;
  surface = read_surface(input, given.mesh, journal);
  require_meshable(input, {surface, nullptr});
  io_ = reading.seconds();
}

void SegmentJob::check_format(std::string_view output, const std::string& path, Journal& journal) const {
  if (output != "output") return;
  const std::string lost = lost_labels(path, false, "the regions");
  if (!lost.empty()) journal.warn(lost);
}

void SegmentJob::compute(Journal& journal) {
  journal.phase("segmenting");
  result = segment(*surface, options_, journal.context());
  mesh = labelled_mesh(*surface, result);
  colours_ = region_colours(mesh, result);
  diagonal = bounding_box(*surface).diagonal();
  seconds = segment_seconds(result.seconds);
  const Stopwatch polygonising;
  if (!polygons_name_.empty()) polygonise(journal);
  seconds["polygons"] = polygonising.seconds();
  seconds["quality"] = 0.0;
  seconds["io"] = io_;
}

const RegionBorders& SegmentJob::borders() {
  if (!borders_) borders_ = region_borders(mesh, result);
  return *borders_;
}

void SegmentJob::polygonise(Journal& journal) {
  journal.phase("making polygons");
  polygons = bisector::polygonise(mesh, result, borders(), polygonise_);
  const auto curved = std::count_if(result.regions.begin(), result.regions.end(), [](const SegmentRegion& region) {
    return type_of(region.proxy) != SurfaceType::plane;
  });
  if (curved > 0)
    journal.warn(fmt::format("{}: {} no plane, and triangles are kept there; --surfaces planes gives polygons only",
                             polygons_name_, counted(static_cast<std::size_t>(curved), "region is", "regions are")));
  if (polygons->folded > 0)
    journal.warn(
        fmt::format("{}: {} not lie flat with few corners and became triangles; more proxies or a smaller "
                    "--chord help",
                    polygons_name_, counted(polygons->folded, "region does", "regions do")));
  if (polygons->self_intersections > 0)
    journal.warn(fmt::format(
        "{}: {}; where the input's do not, more proxies or a smaller --chord help", polygons_name_,
        counted(polygons->self_intersections, "pair of triangles intersects", "pairs of triangles intersect")));
}

Json SegmentJob::report(Journal& journal) {
  const Stopwatch measuring;
  Json report = start_report(command());
  report["input"] = input_json(*surface);
  report["output"] = output_json(mesh);
  report["segmentation"] = segmentation_json(result, diagonal);
  if (!result.projected.empty()) {
    journal.phase("measuring the distance to the input");
    Json quality = quality_json(measure_quality(mesh));
    add_distance(quality, measure_distance(mesh, *surface, journal.context()));
    report["quality"] = std::move(quality);
  }
  if (polygons) report["polygons"] = polygons_json(*polygons);
  report["seconds"] = nullptr;
  add_seconds(seconds, "quality", measuring.seconds());
  return report;
}

view::Scene SegmentJob::scene(const std::string& output) {
  view::Measure region{"region", "Region", "", view::Element::triangle};
  for (std::string name : region_names(result)) {
    std::replace(name.begin(), name.end(), '_', ' ');
    region.names.push_back(fmt::format("{} {}", region.names.size(), name));
  }
  region.colours = colours_;
  view::Scene scene;
  scene.models = {view::surface_model("Input", input, *surface), view::surface_model("Regions", output, mesh)};
  scene.models[1].edges = false;
  view::add_groups(scene, 1, region, {mesh.labels.begin(), mesh.labels.end()});
  view::measure_shapes(scene);
  if (!result.projected.empty()) view::measure_distances(scene);
  return scene;
}

void SegmentJob::write(std::string_view output, const std::string& path, const std::vector<std::string>& warnings) {
  if (output == "output") return write_regions(path, mesh, result, colours_);
  if (output == "json") return write_report(path, trims_json(input, mesh, result, borders()), warnings);
  if (output == "polygons") {
    if (!polygons) throw Error(path + ": there are no polygons; ask for them before the run (--polygons)");
    if (triangulate_) write_regions(path, polygons->triangulated, result, colours_);
    else write_regions(path, *polygons, result, colours_);
    return;
  }
  PreviewOptions picture;
  picture.edges = false;
  picture.outlines = true;
  picture.colours = face_colours(mesh.labels, colours_);
  write_preview(path, mesh, picture);
}

std::vector<ArrayView> SegmentJob::arrays() {
  std::vector<ArrayView> views{array_of("vertices", mesh.vertices), array_of("faces", mesh.triangles),
                               array_of("labels", mesh.labels), array_of("feature_edges", mesh.feature_edges)};
  if (!polygons) return views;
  const Csr<Index>& rows = polygons->polygons;
  polygon_offsets_.assign(rows.offsets.begin(), rows.offsets.end());
  views.push_back(array_of("polygon_vertices", polygons->vertices));
  views.push_back(array_of("polygon_offsets", polygon_offsets_));
  views.push_back(array_of("polygon_corners", rows.values));
  views.push_back(array_of("polygon_labels", polygons->labels));
  return views;
}

}  // namespace bisector::job
