#include "job/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "bisector/error.h"
#include "core/geometry.h"
#include "core/stopwatch.h"
#include "job/inputs.h"
#include "job/messages.h"
#include "job/outputs.h"
#include "job/words.h"

namespace bisector::job {
namespace {

constexpr std::size_t kFewUnexplained = 20;  // one point in so many may be near no branch without a warning
constexpr double kTipMetres = 0.002;         // radius of the thinnest twigs where the file tells its unit

bool is_iges(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension == ".igs" || extension == ".iges";
}

// The unit of so many metres; nothing if there is none.
std::optional<IgesUnit> unit_of(double metres) {
  constexpr std::array<std::pair<double, IgesUnit>, 5> kUnits{{{1, IgesUnit::metre},
                                                               {0.3048, IgesUnit::foot},
                                                               {0.0254, IgesUnit::inch},
                                                               {0.01, IgesUnit::centimetre},
                                                               {0.001, IgesUnit::millimetre}}};
  constexpr double kEqual = 1e-5;  // survey feet are 2e-6 longer than feet
  for (const auto& [size, unit] : kUnits)
    if (std::abs(metres / size - 1) < kEqual) return unit;
  return {};
}

TreeJob::Measures measure(const std::vector<Vec3>& points, const TreeOptions& options, const TreeResult& tree,
                          const TriangleMesh& mesh, const Context& context) {
  TreeJob::Measures measures;
  std::vector<BranchSurface> surfaces;
  for (const TreeBranch& b : tree.branches) {
    measures.length += b.length;
    measures.fitted_length += b.fitted_length;
    measures.volume += b.volume;
    measures.area += b.area;
    measures.order = std::max(measures.order, b.order);
    measures.trunks += b.parent == kNone;
    surfaces.push_back(b.surface);
  }
  std::vector<Vec3> above;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].z < options.ground || (!tree.part.empty() && tree.part[i] != ScanPart::tree)) continue;
    if (!tree.leaf.empty() && tree.leaf[i]) continue;
    above.push_back(points[i]);
    measures.unassigned += tree.branch[i] == kNone;
  }
  const Box box = bounding_box(above);
  measures.height = box.hi.z - box.lo.z;
  if (!tree.tree.empty()) {  // what stands on a slope is no higher for that
    measures.height = 0;
    for (const ScannedTree& t : tree.trees) measures.height = std::max(measures.height, t.height);
  }
  measures.coverage = cover_points(above, surfaces, mesh, context);
  measures.bare = bare_area(mesh, above, 0.02 * measures.height);
  return measures;
}

Json branch_json(const TreeBranch& branch) {
  return {{"parent", branch.parent == kNone ? Json(nullptr) : Json(branch.parent)},
          {"order", branch.order},
          {"length", branch.length},
          {"fitted_length", branch.fitted_length},
          {"base_radius", branch.base_radius},
          {"tip_radius", branch.tip_radius},
          {"volume", branch.volume},
          {"area", branch.area},
          {"points", branch.points}};
}

Json scanned_tree_json(const ScannedTree& tree) {
  return {{"trunk", tree.trunk},
          {"base", {tree.base.x, tree.base.y, tree.base.z}},
          {"ground", std::isnan(tree.ground) ? Json(nullptr) : Json(tree.ground)},
          {"height", tree.height},
          {"points", tree.points},
          {"branches", tree.branches},
          {"length", tree.length},
          {"volume", tree.volume},
          {"area", tree.area},
          {"noise", tree.noise},
          {"exponent", tree.pipe_exponent},
          {"exponent_from", tree.pipe_fitted ? "points" : "default"}};
}

Json tree_seconds(const TreeSeconds& seconds) {
  return {{"total", seconds.total},       {"scene", seconds.scene},       {"graph", seconds.graph},
          {"clusters", seconds.clusters}, {"skeleton", seconds.skeleton}, {"refine", seconds.refine},
          {"surfaces", seconds.surfaces}, {"tree", seconds.total}};
}

void warn_of_points(Journal& journal, const TreeResult& tree, const TreeJob::Measures& measures) {
  if (tree.small_component_points > 0)
    journal.warn(fmt::format("{} in components too small for a tree left out; --components bridge joins them",
                             counted(tree.small_component_points, "point", "points")));
  if (tree.unexplained_points * kFewUnexplained > measures.coverage.size())
    journal.warn(fmt::format("{} are near no branch: leaves, or other things than the tree",
                             counted(tree.unexplained_points, "point", "points")));
}

}  // namespace

double share_of_height(const TreeJob::Measures& measures) {
  return share_within(measures.coverage, 0.01 * measures.height);
}

TreeJob::Ground TreeJob::parse_ground(const std::string& text) {
  Ground ground;
  ground.find = text == "auto";
  if (!ground.find && !(CLI::detail::lexical_cast(text, ground.height) && std::isfinite(ground.height)))
    throw Error("'" + text + "' is neither a height nor auto");
  return ground;
}

std::vector<OutputKind> TreeJob::outputs() const {
  return {
      {"output", "-o", "FILE",
       with_extensions("surfaces to write", kMeshFormats) + ";\n" + with_extensions("B-splines", kIgesFormats),
       kTreeFormats, true},
      {"skeleton", "--skeleton", "FILE.ply", "also write the branches' axes with radii", {".ply"}},
      {"cylinders",
       "--cylinders",
       "FILE.csv",
       "also write the branches as cylinders, in the columns of\nTreeQSM",
       {".csv"}},
      {"labels", "--labels", "FILE.ply", "also write the points with the branch that each is of", {".ply"}},
      {"preview", "--preview", "FILE.png", "draw points and surfaces side by side", {".png"}, false, false, "preview"}};
}

void TreeJob::add_options(CLI::App* app) {
  add_words(app, "--unit", unit_, kUnitWords,
            "of the points, for .igs: mm, cm, m, in or ft; default: what\na LAS file says, else m")
      ->group("Output");
  add_parsed(app, "--ground", ground_, parse_ground,
             "leave out points with z below Z; auto: the ground is\n"
             "found, sloping or not, and left out with low plants",
             {"auto"})
      ->type_name("Z|auto")
      ->group("Scan");
  app->add_flag("--scene", options_.scene,
                "several trees with ground and walls: leave out the\n"
                "ground, walls and low plants, and make each tree for itself")
      ->group("Scan");
  add_words(app, "--components", options_.components, kComponentWords,
            "parts of the scan that are apart: bridge (join them over\n"
            "their gaps; default) or separate (a tree each)")
      ->group("Scan");
  add_words(app, "--leaves", options_.leaves, kLeafWords,
            "keep (all points are wood; default) or apart (told\nfrom wood by their surroundings and left out)")
      ->group("Scan");
  app->add_option("--tip-radius", options_.tip_radius,
                  "of the thinnest twigs, in the points' unit;\ndefault: 0.0003 of the largest extent")
      ->type_name("R")
      ->check(number_above_zero())
      ->group("Radii");
  app->add_option("--clusters", options_.clusters, "at most so many; default: as many as it takes")
      ->type_name("N")
      ->transform(whole_number(1, kMostSeeds))
      ->group("Clusters");
  app->add_option("--delta", options_.delta,
                  "split clusters whose points are farther, rms, from a\n"
                  "cylinder, in the largest extent; default 0.004")
      ->type_name("D")
      ->check(number_above_zero())
      ->group("Clusters");
  app->add_option("--max-cluster-points", options_.max_cluster_points, "split clusters of more points too")
      ->type_name("M")
      ->transform(whole_number(24, kMostSeeds))
      ->group("Clusters");
  add_threads(app, threads);
}

void TreeJob::check_usage(const Usage& usage) {
  if (usage.given("--unit") && !output_name_.empty() && !is_iges(output_name_))
    throw CLI::ValidationError("--unit: only .igs files tell a unit; leave it out");
  if (options_.scene && options_.components == TreeComponents::separate)
    throw CLI::ValidationError("--components: --scene tells the trees from each other; leave out separate");
  if (options_.scene && ground_.find)
    throw CLI::ValidationError("--ground: --scene finds the ground by itself; leave out auto");
  has_unit_ = usage.given("--unit");
}

// Of the coordinates: as asked for, or as the file says.
IgesUnit TreeJob::unit() const { return has_unit_ || cloud.unit == 0 ? unit_ : unit_of(cloud.unit).value_or(unit_); }

void TreeJob::read(Journal& journal) {
  const Stopwatch reading;
  if (given.mesh) {
    cloud.points = given.mesh->surface ? given.mesh->surface->vertices : given.mesh->points;
  } else {
    cloud = read_point_cloud(input, journal.context());
  }
  io_ = reading.seconds();
}

void TreeJob::plan(std::string_view output, const std::string& name) {
  if (output == "output") output_name_ = name;
}

void TreeJob::check_format(std::string_view output, const std::string& path, Journal& journal) const {
  if (output != "output" || !is_iges(path) || has_unit_ || cloud.unit == 0 || unit_of(cloud.unit)) return;
  journal.warn(fmt::format("{}: IGES has no unit of {:.6g} m, so the file says metres; scale it where it is read", path,
                           cloud.unit));
}

void TreeJob::compute(Journal& journal) {
  options_.ground = ground_.height;
  options_.find_ground = ground_.find;
  options_.classes = cloud.classification;
  if (options_.tip_radius == 0 && cloud.unit > 0) options_.tip_radius = kTipMetres / cloud.unit;
  result = reconstruct_tree(cloud.points, options_, journal.context());
  const Stopwatch meshing;
  mesh = tree_mesh(result, journal.context());
  mesh.unit = cloud.unit;
  seconds = tree_seconds(result.seconds);
  seconds["mesh"] = meshing.seconds();
  journal.phase("measuring the distance of the points");
  const Stopwatch measuring;
  measures = measure(cloud.points, options_, result, mesh, journal.context());
  seconds["quality"] = measuring.seconds();
  seconds["io"] = io_;
  warn_of_points(journal, result, measures);
}

Json TreeJob::report(Journal&) {
  Json report = start_report(command());
  report["input"] = {{"points", cloud.points.size()},
                     {"unit", cloud.unit > 0 ? Json(cloud.unit) : Json(nullptr)},
                     {"ground_points", result.ground_points},
                     {"ground_noise", result.ground_noise},
                     {"walls", result.walls},
                     {"wall_points", result.wall_points},
                     {"low_plant_points", result.low_plant_points},
                     {"stray_points", result.stray_points},
                     {"duplicate_points", result.duplicate_points},
                     {"small_component_points", result.small_component_points},
                     {"unassigned_points", measures.unassigned},
                     {"leaf_points", result.leaf_points},
                     {"unexplained_points", result.unexplained_points},
                     {"components", result.components},
                     {"bridges", result.bridges},
                     {"height", measures.height},
                     {"noise", result.noise}};
  report["clusters"] = {{"count", result.clusters}, {"cylinders", result.fixed_clusters}};
  report["tree"] = {{"trunks", measures.trunks}, {"branches", result.branches.size()},
                    {"order", measures.order},   {"nodes", result.skeleton.size()},
                    {"length", measures.length}, {"volume", measures.volume},
                    {"area", measures.area}};
  report["coverage"] = {{"within_1_radius", share_within_radii(measures.coverage, 1)},
                        {"within_2_radii", share_within_radii(measures.coverage, 2)},
                        {"within_1_percent_of_height", share_of_height(measures)},
                        {"surface_beyond_2_percent_of_height", measures.bare}};
  report["radii"] = {{"fitted_length", measures.fitted_length},
                     {"exponent", result.pipe_exponent},
                     {"exponent_from", result.pipe_fitted ? "points" : "default"}};
  report["trees"] = Json::array();
  for (const ScannedTree& t : result.trees) report["trees"].push_back(scanned_tree_json(t));
  report["branches"] = Json::array();
  for (const TreeBranch& branch : result.branches) report["branches"].push_back(branch_json(branch));
  report["seconds"] = nullptr;
  return report;
}

view::Scene TreeJob::scene(const std::string& output) {
  view::Measure branch{"branch", "Branch", "", view::Element::triangle};
  view::Measure order{"order", "Order of the branch", "", view::Element::triangle};
  int orders = 0;
  for (std::size_t b = 0; b < result.branches.size(); ++b) {
    branch.names.push_back(fmt::to_string(b));
    orders = std::max(orders, result.branches[b].order + 1);
  }
  for (int k = 0; k < orders; ++k) order.names.push_back(k == 0 ? "0, trunks" : fmt::to_string(k));
  view::Scene scene;
  scene.models = {{"Scan", input, cloud.points}, view::surface_model("Branches", output, mesh)};
  const auto add = [&](std::size_t model, std::size_t n, const auto& branch_of) {
    std::vector<double> branches(n, std::numeric_limits<double>::quiet_NaN()), orders_of = branches;
    for (std::size_t i = 0; i < n; ++i) {
      const auto b = static_cast<Index>(branch_of(i));
      if (b == kNone) continue;
      branches[i] = b;
      orders_of[i] = result.branches[b].order;
    }
    view::add_groups(scene, model, order, std::move(orders_of));
    view::add_groups(scene, model, branch, std::move(branches));
  };
  add(0, cloud.points.size(), [&](std::size_t i) { return result.branch[i]; });
  add(1, mesh.labels.size(), [&](std::size_t i) { return mesh.labels[i]; });
  return scene;
}

void TreeJob::write(std::string_view output, const std::string& path, const std::vector<std::string>&) {
  if (output == "output") write_tree(path, result, mesh, unit());
  else if (output == "skeleton") write_skeleton(path, result);
  else if (output == "cylinders") write_cylinders(path, result);
  else if (output == "labels") write_tree_labels(path, cloud.points, result);
  else write_tree_preview(path, cloud.points, result, mesh);
}

std::vector<ArrayView> TreeJob::arrays() {
  const auto number = [](Index i) { return i == kNone ? std::int32_t{-1} : static_cast<std::int32_t>(i); };
  if (node_positions_.empty()) {
    for (const TreeNode& node : result.skeleton) {
      node_positions_.push_back(node.position);
      node_radii_.push_back(node.radius);
      node_parents_.push_back(number(node.parent));
      node_branches_.push_back(number(node.branch));
    }
    for (const Index branch : result.branch) point_branches_.push_back(number(branch));
  }
  return {array_of("vertices", mesh.vertices),       array_of("faces", mesh.triangles),
          array_of("labels", mesh.labels),           array_of("nodes", node_positions_),
          array_of("node_radii", node_radii_),       array_of("node_parents", node_parents_),
          array_of("node_branches", node_branches_), array_of("point_branches", point_branches_)};
}

}  // namespace bisector::job
