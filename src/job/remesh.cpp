#include "job/remesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bisector/io.h"
#include "bisector/preview.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "io/files.h"
#include "job/inputs.h"
#include "job/messages.h"
#include "job/outputs.h"
#include "job/words.h"

namespace bisector::job {
namespace {

void require_sound(const RemeshResult& result) {
  if (result.untiled > 0)
    throw Error(fmt::format("the final diagram does not tile {} of the input; please report this as a bug",
                            counted(result.untiled, "triangle", "triangles")));
}

// The cells of too few seeds lie on the surface in a row.
void require_triangles(const RemeshResult& result, const TriangleMesh& surface) {
  if (!result.mesh.triangles.empty()) return;
  constexpr double kMost = 1e9;  // vertices
  const double area = fixed_sum(surface.triangles.size(), [&](std::size_t t) {
    const Triangle& v = surface.triangles[t];
    return 0.5 * norm(twice_area_normal(surface.vertices[v[0]], surface.vertices[v[1]], surface.vertices[v[2]]));
  });
  const double diagonal = bounding_box(surface).diagonal(), wide = area / diagonal;
  const double wanted = 2 / std::numbers::sqrt3 * area / (wide * wide);  // whose edges are as long as it is wide
  if (wanted < kMost) {
    const double digit = std::pow(10.0, std::floor(std::log10(wanted)) - 1);  // two of them say enough
    throw Error(
        fmt::format("the vertices are too few to span a triangle of this surface, which is about {:.2g} wide; "
                    "ask for some {:.0f}",
                    wide, digit * std::round(wanted / digit)));
  }
  throw Error(fmt::format("the surface is too narrow for triangles: {:.2g} wide at a length of {:.2g}; mend it", wide,
                          diagonal));
}

void warn_of_features(Journal& journal, const RemeshResult& result) {
  if (result.features.broken > 0)
    journal.warn(fmt::format("{} of {} are not chains of edges of the output; ask for more vertices",
                             result.features.broken,
                             counted(result.features.curves, "feature curve", "feature curves")));
  if (2 * result.features.seeds > result.mesh.vertices.size())
    journal.warn(
        fmt::format("features take {} of {}; for better triangles ask for more vertices, or for fewer features "
                    "(--features)",
                    result.features.seeds, counted(result.mesh.vertices.size(), "vertex", "vertices")));
}

void warn_of_topology(Journal& journal, const RemeshResult& result) {
  if (result.topology_matches && result.mesh.vertices.size() > result.wanted + result.wanted / 100)
    journal.warn(fmt::format("{} instead of {}: fewer did not give the input's topology and features",
                             counted(result.mesh.vertices.size(), "vertex", "vertices"), result.wanted));
  if (result.topology_matches) return;
  journal.warn(
      fmt::format("the output's topology ({}) is not the input's ({}); {}", describe(result.topology),
                  describe(result.input_topology),
                  result.input_topology.manifold ? "ask for more vertices" : "mend the input, or wrap it (--wrap)"));
}

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

// Both ascending.
std::vector<Index> united(std::vector<Index> a, const std::vector<Index>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end());
  a.erase(std::unique(a.begin(), a.end()), a.end());
  return a;
}

}  // namespace

std::vector<OutputKind> RemeshJob::outputs() const {
  return {{"output", "-o", "FILE", with_extensions("mesh to write", kMeshFormats), kMeshFormats, true},
          {"preview", "--preview", "FILE.png", "draw a picture of the result", {".png"}, false, false, "preview"},
          {"feature-output",
           "--feature-output",
           "FILE",
           "write the result's feature edges, as lines of two vertex\n"
           "numbers; an .obj output then holds them too, as lines l",
           {}},
          {"map",
           "--map",
           "FILE",
           "write where on the input each vertex of the result is:\n"
           "lines of a face, its triangle's three vertices and their\n"
           "weights",
           {},
           false,
           true}};
}

void RemeshJob::add_options(CLI::App* app) {
  app->add_option("-n", options_.vertices, "vertices of the result, at least 4")
      ->type_name("N")
      ->transform(whole_number(4, kMostSeeds))
      ->group("Seeds");
  add_file(app, "--seeds", seeds_, "FILE.xyz",
           "start from these points (\"x y z\" lines) in one level;\n"
           "-n is then not needed")
      ->group("Seeds");
  add_random_seed(app, options_.random_seed, "another number, another start; default 1")->group("Seeds");
  add_edge_length(app, options_.edge_length, edge_length_relative_);
  add_density(app, options_.sizing, attribute_,
              "where triangles are smaller: uniform (default),\n"
              "lfs[:EXP] (local feature size to the power -EXP,\n"
              "default 2), curvature[:EXP] (the larger principal one,\n"
              "default 1) or attribute:NAME (a vertex property of a\n"
              "PLY file); edges are as long as density^(-1/4)");
  app->add_option("--gradation", options_.sizing.gradation,
                  "edge lengths change by at most so much per length;\n"
                  "0: no bound; default 0.2. Not for uniform density")
      ->type_name("G")
      ->check(number_below(10))
      ->group("Size");
  add_edge_bounds(app, options_.sizing);
  add_distance_options(app);
  add_features(app, options_.features,
               "sharp edges to keep: auto (default), none, or all with a\n"
               "dihedral deviation of so many degrees. Borders and\n"
               "non-manifold edges are always kept, edges between face\n"
               "labels unless none");
  add_words(app, "--detail", options_.detail, kDetailWords,
            "what is finer than the edges: auto (smaller edges where\n"
            "the vertices suffice, else merged; default), all (as many\n"
            "vertices as it takes) or off")
      ->group("Features");
  add_feature_file(app, feature_file_);
  add_file(app, "--keep-vertices", keep_vertices_, "FILE",
           "vertices of the input that stay where they are: indices,\n"
           "counted from 0")
      ->group("Features");
  add_file(app, "--keep-faces", keep_faces_, "FILE",
           "faces of the input that stay as they are, with their\n"
           "vertices: indices, counted from 0")
      ->group("Features");
  add_weld(app, weld_);
  add_wrap(app, wrap_);
  add_words(app, "--topology", options_.topology, kTopologyWords,
            "where the result's topology is not the input's:\n"
            "enforce (mend it; default), check (warn) or off")
      ->group("Optimisation");
  add_words(app, "--energy", options_.energy, kEnergyWords,
            "ccvt (seeds on the surface), rcvt (free) or auto (ccvt,\n"
            "without creases where the input is noise; default)")
      ->group("Optimisation");
  app->add_option("--min-angle", options_.min_angle,
                  "degrees that the last pass tries to get all angles\n"
                  "above; 0: no such pass; default 40")
      ->type_name("A")
      ->check(number_below(60))
      ->group("Optimisation");
  app->add_flag("--fit", options_.fit,
                "move the result's vertices off the surface, to where\n"
                "its triangles are nearest to the input")
      ->group("Optimisation");
  add_iterations(app, options_.iterations, "at most so many per level; default 100");
  add_tolerance(app, options_.tolerance,
                "end a level when the energy falls by less than this\n"
                "share per iteration; default 1e-6");
  app->add_option("--levels", options_.levels,
                  "coarse-to-fine levels, 1 to 8; default: as many as the\n"
                  "count allows, at most 3")
      ->type_name("N")
      ->transform(whole_number(1, 8))
      ->group("Optimisation");
  add_compute_options(app, options_.compute);
  add_threads(app, threads);
  saved_.add_options(app);
}

void RemeshJob::add_distance_options(CLI::App* app) {
  app->add_option("--distance-max", options_.distance_max,
                  "shorter edges where a point of result or input may be\n"
                  "farther from the other than this, in the mesh's unit")
      ->type_name("L")
      ->check(number_above_zero())
      ->group("Size");
  app->add_option("--distance-max-relative", distance_max_relative_,
                  "the same, in diagonals of the input's bounding box")
      ->type_name("R")
      ->check(number_above_zero())
      ->group("Size");
  app->add_option("--vertices-max", options_.most_vertices,
                  "ask for no more vertices for it; default: ten times as\n"
                  "many as without")
      ->type_name("N")
      ->transform(whole_number(4, kMostSeeds))
      ->group("Size");
}

void RemeshJob::check_usage(const Usage& usage) {
  usage.check_number_of_vertices();
  saved_.check_usage(usage);
  usage.check_wrap(attribute_);
  if (usage.given("--seeds")) {
    for (const char* option : {"--edge-min", "--edge-max"})
      usage.refuse(option, "seeds from a file have their own number; leave one of the two out");
    usage.refuse("--detail", "edges are as long as seeds from a file make them; leave one of the two out");
    if (options_.levels > 1) throw CLI::ValidationError("--levels: seeds from a file imply one level");
  }
  const SizingOptions& sizing = options_.sizing;
  usage.check_edge_bounds(sizing);
  const double length = options_.edge_length;
  if (length > 0 && (length < sizing.min_edge || (sizing.max_edge > 0 && length > sizing.max_edge)))
    throw CLI::ValidationError("--edge-length is not between --edge-min and --edge-max");
  if (sizing.kind == DensityKind::uniform) usage.check_uniform_density();
  check_distance(usage);
  if (usage.given("--seeds"))
    usage.refuse("--keep-faces",
                 "seeds are of the whole surface and leave no room for kept faces; leave one of the two out");
  if (options_.energy == Energy::restricted && options_.min_angle > 0)
    usage.refuse("--min-angle", "seeds have to be on the surface for that; leave out --energy rcvt");
}

void RemeshJob::check_distance(const Usage& usage) const {
  const bool wanted = usage.given("--distance-max") || usage.given("--distance-max-relative");
  if (usage.given("--distance-max"))
    usage.refuse("--distance-max-relative", "the distance is given by --distance-max; leave one of the two out");
  if (!wanted) return usage.refuse("--vertices-max", "it is for --distance-max; leave it out, or give that as well");
  if (options_.most_vertices > 0 && options_.most_vertices < options_.vertices)
    throw CLI::ValidationError("--vertices-max is less than -n");
  if (!usage.given("--seeds")) return;
  for (const char* option : {"--distance-max", "--distance-max-relative"})
    usage.refuse(option, "seeds from a file have their own number; leave one of the two out");
}

void RemeshJob::keep() {
  options_.keep_vertices =
      read_kept(keep_vertices_, given.keep_vertices, surface->vertices.size(), "vertex", "--keep-vertices");
  // Faces of more than three corners were split.
  const std::vector<Index>& faces_of = surface->face_of_triangle;
  const std::size_t triangles = surface->triangles.size();
  const std::size_t faces =
      faces_of.empty() ? triangles : std::size_t{*std::max_element(faces_of.begin(), faces_of.end())} + 1;
  const std::vector<Index> kept = read_kept(keep_faces_, given.keep_faces, faces, "face", "--keep-faces");
  // What the file itself says is to stay; of a wrap nothing is.
  const RequiredElements required = given.mesh || wrap_.on ? RequiredElements{} : read_required(input);
  options_.keep_vertices = united(std::move(options_.keep_vertices), required.vertices);
  options_.keep_edges = required.edges;
  if (wrap_.on && !(kept.empty() && options_.keep_vertices.empty()))
    throw Error("--wrap: a wrap has other vertices than its input; keep none of them, or leave --wrap out");
  for (Index t = 0; t < triangles; ++t)
    if (std::binary_search(kept.begin(), kept.end(), face_of(t)) ||
        std::binary_search(required.triangles.begin(), required.triangles.end(), t))
      options_.keep_triangles.push_back(t);
}

// What the options say, with the files that they name.
void RemeshJob::complete_options() {
  if (!attribute_.empty()) options_.sizing.attribute = read_density(input, attribute_, given, surface->vertices.size());
  if (!feature_file_.empty()) options_.features.given = read_feature_edges(feature_file_, *surface);
  if (edge_length_relative_ > 0) options_.edge_length = edge_length_relative_ * bounding_box(*surface).diagonal();
  if (distance_max_relative_ > 0) options_.distance_max = distance_max_relative_ * bounding_box(*surface).diagonal();
  if (weld_ >= 0) options_.weld = weld_;
  keep();
  leave_out_folds(wrap_, options_.features);
  options_.threads = threads;
  if (given.seeds || !seeds_.empty()) {
    options_.seeds = read_seeds(seeds_, given, options_.vertices);
    options_.vertices = options_.seeds.size();
  }
}

void RemeshJob::plan(std::string_view output, const std::string&) {
  if (output == "feature-output") wants_feature_edges_ = true;
  if (output == "map") wants_map_ = true;
}

void RemeshJob::read(Journal& journal) {
  const Stopwatch reading;
  surface = read_surface(input, given.mesh, journal);
  require_meshable(input, {surface, nullptr});
  io_ = reading.seconds();
  complete_options();
  wrapped_ = wrap_if_asked(wrap_, *surface, options_.vertices, options_.edge_length, false, journal, wrap_mesh_);
}

void RemeshJob::check_format(std::string_view output, const std::string& path, Journal& journal) const {
  if (output != "output") return;
  warn_of_lost_attributes(path, *surface, attribute_, journal);
  if (remeshed_surface().labels.empty()) return;
  const std::string lost = lost_labels(path, !remeshed_surface().label_names.empty(), "the input's");
  if (!lost.empty()) journal.warn(lost);
}

Fingerprint RemeshJob::fingerprint() const {
  Fingerprint all = fingerprint_of(remeshed_surface());
  all.add_all(options_.seeds).add_all(options_.sizing.attribute).add_all(options_.features.given);
  all.add_all(options_.keep_vertices).add_all(options_.keep_edges).add_all(options_.keep_triangles);
  return all;
}

void RemeshJob::compute(Journal& journal) {
  journal.phase("preparing");
  Context context = journal.context();
  saved_.open(fingerprint(), journal, context);
  result = remesh(remeshed_surface(), options_, context);
  require_sound(result);
  require_triangles(result, *surface);
  warn_of_features(journal, result);
  if (options_.topology != TopologyControl::off) warn_of_topology(journal, result);
  if (result.distance.upper > options_.distance_max)
    journal.warn(fmt::format(
        "the distance to the input is at least {:.6g} and at most {:.6g}, where {:.6g} was asked for; {}",
        result.distance.lower, result.distance.upper, options_.distance_max,
        result.wanted >= result.distance.most_vertices
            ? fmt::format("{} were not enough, give --vertices-max more", counted(result.wanted, "vertex", "vertices"))
            : "shorter edges alone do not bring it down"));
  seconds = remesh_seconds(result.seconds);
  const Stopwatch measuring;
  quality = measure_quality(result.mesh);
  seconds["quality"] = measuring.seconds();
  carry(journal);
  seconds["io"] = io_;
}

void RemeshJob::carry(Journal& journal) {
  const Stopwatch carrying;
  result.mesh.material_files = surface->material_files;
  if (wrapped_.is_null()) result.mesh.label_materials = surface->label_materials;
  if (wants_map_ || !surface->attributes.empty()) {
    journal.phase("carrying attributes");
    map_ = map_to_surface(result.mesh.vertices, *surface, journal.context());
    carry_attributes(*surface, map_, result.mesh, journal.context());
  }
  seconds["attributes"] = carrying.seconds();
}

// Faces are those of the file, which may have had more than three corners.
std::string RemeshJob::map_text() const {
  std::string text = "# face, three of its vertices, their weights: of each vertex of the result\n";
  for (std::size_t v = 0; v < map_.triangles.size(); ++v) {
    const Index t = map_.triangles[v];
    const Triangle& corners = surface->triangles[t];
    const std::array<double, 3>& w = map_.weights[v];
    text += fmt::format("{} {} {} {} {} {} {}\n", face_of(t), corners[0], corners[1], corners[2], w[0], w[1], w[2]);
  }
  return text;
}

Json RemeshJob::report(Journal& journal) {
  const Stopwatch measuring;
  Json report = start_report(command());
  report["device"] = device_json(result.device);
  report["input"] = input_json(*surface);
  report["output"] = output_json(result.mesh);
  report["iterations"] = result.iterations;
  report["evaluations"] = result.evaluations;
  report["energy"] = result.energy;
  report["gradient_norm"] = result.gradient_norm;
  report["seconds"] = nullptr;
  add_device(report, result.device, result.seconds.diagrams.device, result.device_work, result.evaluations);
  report["certification"] = certification_json(result.certification);
  report["quality"] = quality_json(quality);
  journal.phase("measuring the distance to the input");
  add_distance(report["quality"], measure_distance(result.mesh, *surface, journal.context()));
  journal.phase("looking for self-intersections");
  report["quality"]["self_intersections"] = count_self_intersections(result.mesh, journal.context());
  report["topology"] = topology_json(result.topology);
  report["topology"]["matches_input"] = result.topology_matches;
  report["topology"]["ball_property"] = result.ball_property;
  report["topology"]["divided"] = result.divided;
  report["topology"]["faults"] = faults_json(result);
  if (!result.kept.empty())
    report["kept"] = {{"vertices", result.kept.size() - static_cast<std::size_t>(
                                                            std::count(result.kept.begin(), result.kept.end(), kNone))},
                      {"faces", result.kept_triangles}};
  if (options_.distance_max > 0)
    report["distance"] = {{"wanted", options_.distance_max},
                          {"lower", result.distance.lower},
                          {"upper", result.distance.upper},
                          {"runs", result.distance.runs},
                          {"vertices_max", result.distance.most_vertices}};
  report["features"] = features_json(result.features, result.mesh.feature_edges.size());
  report["detail"] = detail_json(result.detail, result.features.curves);
  report["attributes"] = attributes_json(result.mesh.attributes);
  report["sizing"] = {{"wanted", result.wanted}, {"edge_length", result.edge_length}};
  report["noisy"] = result.noisy;
  report["weld"] = weld_json(result.welded);
  if (!wrapped_.is_null()) report["wrap"] = wrapped_;
  if (options_.min_angle > 0 && options_.energy != Energy::restricted) {
    report["improved"] = {{"made", result.improved.made},
                          {"inserted", result.improved.inserted},
                          {"removed", result.improved.removed},
                          {"missed", result.improved.missed}};
    report["mended"] = {{"bad", result.mended.bad},
                        {"made", result.mended.made},
                        {"inserted", result.mended.inserted},
                        {"removed", result.mended.removed}};
  }
  if (options_.fit || result.noisy)
    report["fit"] = {{"iterations", result.fitted.iterations},
                     {"damped", result.fitted.damped},
                     {"restored", result.fitted.restored}};
  add_seconds(seconds, "quality", measuring.seconds());
  return report;
}

view::Scene RemeshJob::scene(const std::string& output) {
  view::Scene scene;
  scene.models = {view::surface_model("Input", input, *surface), view::surface_model("Result", output, result.mesh)};
  view::measure_shapes(scene);
  view::measure_distances(scene);
  view::add_labels(scene, {"label", "Face label", "", view::Element::triangle}, {surface->labels, result.mesh.labels});
  return scene;
}

void RemeshJob::write(std::string_view output, const std::string& path, const std::vector<std::string>&) {
  WriteOptions options;
  options.lines = wants_feature_edges_;
  if (output == "output") write_mesh(path, result.mesh, options);
  else if (output == "preview") write_preview(path, result.mesh);
  else if (output == "map") write_file(path, map_text());
  else write_feature_edges(path, result.mesh.feature_edges);
}

std::vector<ArrayView> RemeshJob::arrays() {
  map_faces_.clear();
  if (wants_map_)
    for (const Index t : map_.triangles) map_faces_.push_back(face_of(t));
  return {array_of("vertices", result.mesh.vertices),
          array_of("faces", result.mesh.triangles),
          array_of("labels", result.mesh.labels),
          array_of("feature_edges", result.mesh.feature_edges),
          array_of("kept", result.kept),
          array_of("map_faces", map_faces_),
          {"map_weights", ArrayView::Type::double_, map_.weights.data(), map_faces_.size(), 3}};
}

}  // namespace bisector::job
