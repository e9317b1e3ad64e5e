#include "job/tet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "bisector/attributes.h"
#include "bisector/io.h"
#include "bisector/preview.h"
#include "core/geometry.h"
#include "core/stopwatch.h"
#include "io/tet_formats.h"
#include "job/messages.h"
#include "job/outputs.h"
#include "job/words.h"
#include "mesh/tet_topology.h"
#include "remesh/topology_control.h"

namespace bisector::job {
namespace {

// Degrees; a mesh with a dihedral angle below this is warned of.
constexpr double kPoorDihedral = 8;

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

// The surface of a solid on its vertices, with the interfaces between its regions.
std::shared_ptr<const TriangleMesh> walls_of(const Domain& domain) {
  if (!domain.tets) return domain.surface;
  std::vector<Triangle> facets = wall_facets(*domain.tets);
  if (facets.size() == domain.surface->triangles.size()) return domain.surface;
  return std::make_shared<const TriangleMesh>(TriangleMesh{domain.tets->vertices, std::move(facets)});
}

TriangleMesh boundary_mesh(const TetMesh& mesh) {
  TriangleMesh surface;
  surface.vertices = mesh.vertices;
  surface.triangles = mesh.boundary;
  surface.feature_edges = mesh.feature_edges;
  return surface;
}

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

Json regions_json(const TetResult& result) {
  Json list = Json::array();
  for (const TetRegion& region : result.regions) {
    list.push_back({{"region", region.region}});
    const auto name = result.mesh.region_names.find(region.region);
    if (name != result.mesh.region_names.end()) list.back()["name"] = name->second;
    list.back()["tets"] = region.tets;
    list.back()["volume"] = region.volume;
    list.back()["volume_input"] = region.input_volume;
  }
  return {{"interface_triangles", result.interface_triangles}, {"list", list}};
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

void warn_of(Journal& journal, const TetOptions& options, const TetResult& result, const TetJob::Measures& measures) {
  const FeatureResult& features = result.boundary.features;
  if (features.broken > 0)
    journal.warn(fmt::format("{} of {} are not chains of edges of the output; ask for more vertices", features.broken,
                             counted(features.curves, "feature curve", "feature curves")));
  if (!same_topology(measures.topology.boundary, result.input_topology))
    journal.warn(fmt::format("the boundary's topology ({}) is not the input's ({}); ask for more vertices",
                             describe(measures.topology.boundary), describe(result.input_topology)));
  if (options.min_dihedral > kPoorDihedral && measures.tets.dihedral_min < kPoorDihedral)
    journal.warn(
        fmt::format("a dihedral angle is {:.2f} degrees only: the boundary has acute edges or parts thinner than its "
                    "edges; ask for more vertices",
                    measures.tets.dihedral_min));
  const std::size_t count = result.mesh.vertices.size();
  if (std::max(count, result.wanted) - std::min(count, result.wanted) > result.wanted / 20)
    journal.warn(fmt::format("{} instead of {}: {}", counted(count, "vertex", "vertices"), result.wanted,
                             count > result.wanted ? "the boundary's shape and good angles took as many"
                                                   : "no more fitted inside the boundary"));
}

}  // namespace

std::vector<OutputKind> TetJob::outputs() const {
  return {{"output", "-o", "FILE", with_extensions("mesh to write", kTetFormats), kTetFormats, true},
          {"boundary", "--boundary", "FILE", with_extensions("also write the boundary's triangles", kMeshFormats),
           kMeshFormats},
          {"preview",
           "--preview",
           "FILE.png",
           "draw a picture of the result, cut open",
           {".png"},
           false,
           false,
           "preview"}};
}

void TetJob::add_options(CLI::App* app) {
  app->add_option("-n", options_.vertices, "vertices of the result, about; at least 8")
      ->type_name("N")
      ->transform(whole_number(8, kMostSeeds))
      ->group("Seeds");
  add_file(app, "--seeds", seeds_, "FILE.xyz",
           "start from these points (\"x y z\" lines) inside the\n"
           "solid; -n is then not needed")
      ->group("Seeds");
  add_random_seed(app, options_.random_seed, "another number, another start; default 1")->group("Seeds");
  add_edge_length(app, options_.edge_length, edge_length_relative_);
  add_density(app, options_.sizing.field, attribute_,
              "where tetrahedra are smaller: uniform (default),\n"
              "lfs[:EXP] or curvature[:EXP] of the boundary, with the\n"
              "edge lengths that 'bisector remesh' has for them, or\n"
              "attribute:NAME (of the input's vertices; edges are as\n"
              "long as its power -1/5)");
  add_file(app, "--sizes", sizes_, "FILE[:NAME]",
           "edge lengths at the vertices of a mesh (.vtk, .vtu with\n"
           "point data NAME; .mesh, .meshb with a .sol beside it),\n"
           "instead of a density; -n makes them a matter of\n"
           "proportion")
      ->group("Size");
  app->add_option("--gradation", options_.sizing.field.gradation,
                  "edge lengths grow by at most so much per length into\n"
                  "the solid; default 0.2. Not for uniform density")
      ->type_name("G")
      ->check(number_below(10))
      ->group("Size");
  add_edge_bounds(app, options_.sizing.field);
  add_features(app, options_.features,
               "sharp edges to keep: auto (default), none, or all with a\n"
               "dihedral deviation of so many degrees. Edges between face\n"
               "labels are kept unless none");
  add_words(app, "--detail", options_.detail, kDetailWords,
            "what is finer than the boundary's edges: auto (smaller\n"
            "edges where the vertices suffice, else merged; default),\n"
            "all (as many vertices as it takes) or off")
      ->group("Features");
  add_feature_file(app, feature_file_);
  add_weld(app, weld_);
  add_wrap(app, wrap_);
  app->add_flag("--regions", options_.enclosed_regions,
                "fill each part of space that the surface encloses, also\n"
                "inside others, as a region of its own; the walls between\n"
                "are kept and shared")
      ->group("Features");
  app->add_option("--min-angle", options_.min_angle,
                  "degrees that all angles of the boundary's triangles\n"
                  "should exceed; 0: as they are; default 40")
      ->type_name("A")
      ->check(number_below(60))
      ->group("Optimisation");
  app->add_option("--min-dihedral", options_.min_dihedral,
                  "degrees that all dihedral angles should exceed; 0: keep\n"
                  "slivers; default 30")
      ->type_name("A")
      ->check(number_below(55))
      ->group("Optimisation");
  app->add_option("--order", order_,
                  "1 (straight edges; default) or 2: a node on each edge,\n"
                  "those of the boundary on the surface (.msh, .vtu)")
      ->type_name("N")
      ->transform(whole_number(1, 2))
      ->group("Size");
  add_iterations(app, options_.iterations, "steps, of which each phase may make a share; default 100");
  add_tolerance(app, options_.tolerance,
                "end a phase when the energy falls by less than this\n"
                "share per iteration; default 1e-6");
  add_compute_options(app, options_.compute);
  add_threads(app, threads);
  saved_.add_options(app);
}

void TetJob::check_usage(const Usage& usage) {
  usage.check_number_of_vertices();
  saved_.check_usage(usage);
  usage.check_wrap(attribute_);
  if (usage.given("--wrap")) usage.refuse("--regions", "a wrap encloses one region only; leave one of the two out");
  if (usage.given("--sizes")) usage.refuse("--density", "sizes come from --sizes; leave one of the two out");
  const SizingOptions& sizing = options_.sizing.field;
  if (usage.given("--gradation") && sizing.gradation == 0)
    throw CLI::ValidationError("--gradation: sizes inside a solid grow from its boundary; it must not be 0");
  usage.check_edge_bounds(sizing);
  if (sizing.kind == DensityKind::uniform && !usage.given("--sizes")) usage.check_uniform_density();
}

std::vector<std::string> TetJob::input_files() const {
  const std::string sizes = split_sizes(sizes_).first;
  std::vector<std::string> files{input, seeds_, feature_file_, sizes};
  if (!attribute_.empty()) files.push_back(io::solution_beside(input));
  files.push_back(io::solution_beside(sizes));
  return files;
}

void TetJob::complete_options() {
  if (!attribute_.empty())
    options_.sizing.field.attribute = read_density(input, attribute_, given, domain.surface->vertices.size());
  if (!given.sizes.lengths.empty()) options_.sizing.sizes = given.sizes;
  else if (!sizes_.empty()) options_.sizing.sizes = read_sizes(sizes_);
  if (!feature_file_.empty()) options_.features.given = read_feature_edges(feature_file_, *walls_);
  if (edge_length_relative_ > 0)
    options_.edge_length = edge_length_relative_ * bounding_box(*domain.surface).diagonal();
  if (weld_ >= 0) options_.weld = weld_;
  leave_out_folds(wrap_, options_.features);
  options_.threads = threads;
  if (given.seeds || !seeds_.empty()) {
    options_.seeds = read_seeds(seeds_, given, options_.vertices);
    options_.vertices = options_.seeds.size();
  }
}

void TetJob::read(Journal& journal) {
  const Stopwatch reading;
  domain = read_domain(input, given.mesh, false, journal);
  require_meshable(input, domain);
  if (domain.tets && options_.enclosed_regions)
    throw Error(
        "--regions: it is for surfaces, and tetrahedra have regions of their own, which are kept; leave it out");
  walls_ = walls_of(domain);
  if (!given.mesh && !read_required(input).empty())
    journal.warn(fmt::format("{}: what the file requires to stay as it is is meshed anew; only remesh keeps that",
                             std::filesystem::path(input).filename().string()));
  complete_options();
  io_ = reading.seconds();
  wrapped_ = wrap_if_asked(wrap_, *domain.surface, options_.vertices, options_.edge_length, true, journal, wrap_mesh_);
}

void TetJob::check_format(std::string_view output, const std::string& path, Journal& journal) const {
  if (output != "output") return;
  const std::vector<std::string> holders = extensions_that(&FileFormat::writes_second_order);
  if (order_ == 2 && std::find(holders.begin(), holders.end(), extension_of(path)) == holders.end())
    throw Error(fmt::format("{}: {} files are not written with nodes on edges (--order 2); write {}", path,
                            extension_of(path), listed(holders)));
  warn_of_lost_attributes(path, domain, attribute_, journal);
}

void TetJob::carry(Journal& journal) {
  const Stopwatch carrying;
  const Context context = journal.context();
  TetMesh& mesh = result.mesh;
  if (!(domain.tets ? domain.tets->attributes : domain.surface->attributes).empty()) {
    journal.phase("carrying attributes");
    if (domain.tets) carry_attributes(*domain.tets, map_to_solid(mesh.vertices, *domain.tets, context), mesh, context);
    else carry_attributes(*domain.surface, map_to_surface(mesh.vertices, *domain.surface, context), mesh, context);
  }
  seconds["attributes"] = carrying.seconds();
}

// The features that the boundary's feature edges follow are among those of the surface that was filled.
void TetJob::curve(Journal& journal) {
  const Stopwatch curving;
  if (order_ == 2) {
    journal.phase("placing nodes on edges");
    order = second_order(result.mesh, walls(), detect_features(walls(), options_.features).edges, &curved_,
                         journal.context());
  }
  seconds["second_order"] = curving.seconds();
}

Fingerprint TetJob::fingerprint() const {
  Fingerprint all = !wrapped_.is_null() ? fingerprint_of(wrap_mesh_)
                    : domain.tets       ? fingerprint_of(*domain.tets)
                                        : fingerprint_of(*domain.surface);
  all.add_all(options_.seeds).add_all(options_.sizing.field.attribute).add_all(options_.features.given);
  all.add_all(options_.sizing.sizes.points).add_all(options_.sizing.sizes.lengths);
  return all;
}

void TetJob::compute(Journal& journal) {
  Context context = journal.context();
  saved_.open(fingerprint(), journal, context);
  result = !wrapped_.is_null() ? tetrahedralise(wrap_mesh_, options_, context)
           : domain.tets       ? tetrahedralise(*domain.tets, options_, context)
                               : tetrahedralise(*domain.surface, options_, context);
  if (result.untiled > 0)
    throw Error(fmt::format("the final diagram does not tile {} of the input; please report this as a bug",
                            counted(result.untiled, "tetrahedron or triangle", "tetrahedra or triangles")));
  seconds = tet_seconds(result.seconds);
  const Stopwatch measuring;
  measures.tets = measure_tet_quality(result.mesh);
  measures.boundary = measure_quality(boundary_mesh(result.mesh));
  measures.topology = analyse_tet_topology(result.mesh);
  seconds["quality"] = measuring.seconds();
  carry(journal);
  curve(journal);
  seconds["io"] = io_;
  warn_of(journal, options_, result, measures);
}

Json TetJob::report(Journal& journal) {
  const Stopwatch measuring;
  Json report = start_report(command());
  report["device"] = device_json(result.device);
  report["input"] = size_json(domain);
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
  journal.phase("measuring the distance of the boundary to the input");
  add_distance(report["quality"], measure_distance(boundary_mesh(result.mesh), *walls_, journal.context()));
  report["quality"]["volume_input"] = result.volume;
  report["topology"] = topology_json(measures.topology.boundary);
  add_tets(report["topology"], measures.topology);
  report["topology"]["matches_input"] = same_topology(measures.topology.boundary, result.input_topology);
  report["topology"]["ball_property"] = result.boundary.ball_property;
  if (!result.regions.empty()) report["regions"] = regions_json(result);
  report["features"] = features_json(result.boundary.features, result.mesh.feature_edges.size());
  report["detail"] = detail_json(result.detail, result.boundary.features.curves);
  report["attributes"] = attributes_json(result.mesh.attributes);
  if (order_ == 2)
    report["second_order"] = {{"nodes", order.nodes.size()},
                              {"boundary_nodes", curved_.boundary_nodes},
                              {"curved", curved_.curved},
                              {"held_back", curved_.held_back},
                              {"node_distance_mean", curved_.node_distance_mean},
                              {"node_distance_max", curved_.node_distance_max},
                              {"middle_distance_mean", curved_.middle_distance_mean},
                              {"middle_distance_max", curved_.middle_distance_max},
                              {"jacobian_min", curved_.jacobian_min}};
  report["sizing"] = {
      {"wanted", result.wanted}, {"edge_length", result.edge_length}, {"boundary_vertices", result.boundary_vertices}};
  report["conform"] = {{"delaunay", result.delaunay},
                       {"steiner_points", result.steiner_points},
                       {"refused_sites", result.refused_sites}};
  if (options_.min_dihedral > 0) report["improved"] = improved_json(result.improved);
  if (!wrapped_.is_null()) report["wrap"] = wrapped_;
  add_seconds(seconds, "quality", measuring.seconds());
  return report;
}

view::Scene TetJob::scene(const std::string& output) {
  view::Scene scene;
  scene.models = {domain.tets ? view::solid_model("Input", input, *domain.tets, domain.surface->triangles)
                              : view::surface_model("Input", input, *domain.surface),
                  view::solid_model("Result", output, result.mesh, boundary_facets(result.mesh.tets))};
  view::measure_shapes(scene);
  view::measure_distances(scene);
  std::vector<std::int32_t> regions;
  if (domain.tets) regions = domain.tets->regions;
  view::add_labels(scene, {"region", "Region", "", view::Element::tet}, {regions, result.mesh.regions});
  return scene;
}

void TetJob::write(std::string_view output, const std::string& path, const std::vector<std::string>&) {
  if (output == "output") write_tet_mesh(path, result.mesh, order);
  else if (output == "boundary") write_mesh(path, boundary_surface(result.mesh));
  else write_tet_preview(path, result.mesh);
}

std::vector<ArrayView> TetJob::arrays() {
  const TetMesh& mesh = result.mesh;
  return {array_of("vertices", mesh.vertices),      array_of("tets", mesh.tets),
          array_of("faces", mesh.boundary),         array_of("regions", mesh.regions),
          array_of("labels", mesh.boundary_labels), array_of("feature_edges", mesh.feature_edges),
          array_of("node_edges", order.edges),      array_of("edge_nodes", order.nodes)};
}

}  // namespace bisector::job
