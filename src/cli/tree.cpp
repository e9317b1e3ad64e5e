// bisector tree
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/tree.h"
#include "commands.h"
#include "console.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "options.h"
#include "outputs.h"
#include "report.h"
#include "summary.h"
#include "tree/coverage.h"
#include "words.h"

namespace bisector::cli {
namespace {

constexpr std::size_t kFewUnexplained = 20;  // one point in so many may be near no branch without a warning
constexpr double kTipMetres = 0.002;         // radius of the thinnest twigs where the file tells its unit

// Where the ground is: below a height, or where it is found.
struct GroundOption {
  double height = -std::numeric_limits<double>::infinity();
  bool find = false;
};

GroundOption parse_ground(const std::string& text) {
  GroundOption ground;
  ground.find = text == "auto";
  if (!ground.find && !(CLI::detail::lexical_cast(text, ground.height) && std::isfinite(ground.height)))
    throw Error("'" + text + "' is neither a height nor auto");
  return ground;
}

struct TreeCommand {
  std::string input, output, skeleton, cylinders, labels, preview;
  IgesUnit unit = IgesUnit::metre;
  bool has_unit = false;  // asked for
  GroundOption ground;
  TreeOptions options;
  CommonOptions common;
};

void add_options(CLI::App* app, TreeCommand& command) {
  add_file(app, "POINTS", command.input, "FILE", "points of a tree's surface")->required();
  add_file(app, "-o", command.output, "FILE", "surfaces to write: .obj, .ply, .off, .stl, or as B-splines\n.igs")
      ->required()
      ->group("Output");
  add_file(app, "--skeleton", command.skeleton, "FILE.ply", "also write the branches' axes with radii")
      ->group("Output");
  add_file(app, "--cylinders", command.cylinders, "FILE.csv",
           "also write the branches as cylinders, in the columns of\nTreeQSM")
      ->group("Output");
  add_file(app, "--labels", command.labels, "FILE.ply", "also write the points with the branch that each is of")
      ->group("Output");
  add_file(app, "--preview", command.preview, "FILE.png", "draw points and surfaces side by side")->group("Output");
  add_words(app, "--unit", command.unit, kUnitWords,
            "of the points, for .igs: mm, cm, m, in or ft; default: what\na LAS file says, else m")
      ->group("Output");
  add_parsed(app, "--ground", command.ground, parse_ground,
             "leave out points with z below Z; auto: the ground is\n"
             "found, sloping or not, and left out with low plants")
      ->type_name("Z|auto")
      ->group("Scan");
  app->add_flag("--scene", command.options.scene,
                "several trees with ground and walls: leave out the\n"
                "ground, walls and low plants, and make each tree for itself")
      ->group("Scan");
  add_words(app, "--components", command.options.components, kComponentWords,
            "parts of the scan that are apart: bridge (join them over\n"
            "their gaps; default) or separate (a tree each)")
      ->group("Scan");
  add_words(app, "--leaves", command.options.leaves, kLeafWords,
            "keep (all points are wood; default) or apart (told\nfrom wood by their surroundings and left out)")
      ->group("Scan");
  app->add_option("--tip-radius", command.options.tip_radius,
                  "of the thinnest twigs, in the points' unit;\ndefault: 0.0003 of the largest extent")
      ->type_name("R")
      ->check(number_above_zero())
      ->group("Radii");
  app->add_option("--clusters", command.options.clusters, "at most so many; default: as many as it takes")
      ->type_name("N")
      ->check(whole_number(1, kMostSeeds))
      ->group("Clusters");
  app->add_option("--delta", command.options.delta,
                  "split clusters whose points are farther, rms, from a\n"
                  "cylinder, in the largest extent; default 0.004")
      ->type_name("D")
      ->check(number_above_zero())
      ->group("Clusters");
  app->add_option("--max-cluster-points", command.options.max_cluster_points, "split clusters of more points too")
      ->type_name("M")
      ->check(whole_number(24, kMostSeeds))
      ->group("Clusters");
  add_common_options(app, command.common,
                     "write a JSON report with branches, volume, distances of\n"
                     "the points and timings; - for stdout");
}

bool is_iges(const TreeCommand& command) {
  const std::string extension = extension_of(command.output);
  return extension == ".igs" || extension == ".iges";
}

void check_usage(const TreeCommand& command, const Usage& usage) {
  if (usage.given("--unit") && !is_iges(command))
    throw CLI::ValidationError("--unit: only .igs files tell a unit; leave it out");
  if (command.options.scene && command.options.components == TreeComponents::separate)
    throw CLI::ValidationError("--components: --scene tells the trees from each other; leave out separate");
  if (command.options.scene && command.ground.find)
    throw CLI::ValidationError("--ground: --scene finds the ground by itself; leave out auto");
}

// Of the coordinates: as asked for, or as the file says, which is `metres` (0: nothing).
IgesUnit unit_of_output(const TreeCommand& command, double metres, Console& console) {
  constexpr std::array<std::pair<double, IgesUnit>, 5> kUnits{{{1, IgesUnit::metre},
                                                               {0.3048, IgesUnit::foot},
                                                               {0.0254, IgesUnit::inch},
                                                               {0.01, IgesUnit::centimetre},
                                                               {0.001, IgesUnit::millimetre}}};
  constexpr double kEqual = 1e-5;  // survey feet are 2e-6 longer than feet
  if (command.has_unit || metres == 0) return command.unit;
  for (const auto& [size, unit] : kUnits)
    if (std::abs(metres / size - 1) < kEqual) return unit;
  if (is_iges(command))
    console.warn(fmt::format("{}: IGES has no unit of {:.6g} m, so the file says metres; scale it where it is read",
                             command.output, metres));
  return command.unit;
}

// Of all branches together, and of the points.
struct Measures {
  double length = 0, fitted_length = 0, volume = 0, area = 0, height = 0;
  int order = 0;
  std::size_t trunks = 0, unassigned = 0;
  std::vector<PointCoverage> coverage;  // of the points that are not left out
  double bare = 0;                      // share of the surface farther than 2 % of the height from them
};

Measures measure(const std::vector<Vec3>& points, const TreeOptions& options, const TreeResult& tree,
                 const TriangleMesh& mesh) {
  Measures measures;
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
  measures.coverage = cover_points(above, surfaces, mesh);
  measures.bare = bare_area(mesh, above, 0.02 * measures.height);
  return measures;
}

double share_of_height(const Measures& measures) { return share_within(measures.coverage, 0.01 * measures.height); }

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

Json tree_report(const PointCloud& cloud, const TreeResult& tree, const Measures& measures) {
  Json report = start_report("tree");
  report["input"] = {{"points", cloud.points.size()},
                     {"unit", cloud.unit > 0 ? Json(cloud.unit) : Json(nullptr)},
                     {"ground_points", tree.ground_points},
                     {"ground_noise", tree.ground_noise},
                     {"walls", tree.walls},
                     {"wall_points", tree.wall_points},
                     {"low_plant_points", tree.low_plant_points},
                     {"stray_points", tree.stray_points},
                     {"duplicate_points", tree.duplicate_points},
                     {"small_component_points", tree.small_component_points},
                     {"unassigned_points", measures.unassigned},
                     {"leaf_points", tree.leaf_points},
                     {"unexplained_points", tree.unexplained_points},
                     {"components", tree.components},
                     {"bridges", tree.bridges},
                     {"height", measures.height},
                     {"noise", tree.noise}};
  report["clusters"] = {{"count", tree.clusters}, {"cylinders", tree.fixed_clusters}};
  report["tree"] = {{"trunks", measures.trunks},     {"branches", tree.branches.size()}, {"order", measures.order},
                    {"nodes", tree.skeleton.size()}, {"length", measures.length},        {"volume", measures.volume},
                    {"area", measures.area}};
  report["coverage"] = {{"within_1_radius", share_within_radii(measures.coverage, 1)},
                        {"within_2_radii", share_within_radii(measures.coverage, 2)},
                        {"within_1_percent_of_height", share_of_height(measures)},
                        {"surface_beyond_2_percent_of_height", measures.bare}};
  report["radii"] = {{"fitted_length", measures.fitted_length},
                     {"exponent", tree.pipe_exponent},
                     {"exponent_from", tree.pipe_fitted ? "points" : "default"}};
  report["trees"] = Json::array();
  for (const ScannedTree& t : tree.trees) report["trees"].push_back(scanned_tree_json(t));
  report["branches"] = Json::array();
  for (const TreeBranch& branch : tree.branches) report["branches"].push_back(branch_json(branch));
  report["seconds"] = nullptr;
  return report;
}

Json tree_seconds(const TreeSeconds& seconds) {
  return {{"total", seconds.total},       {"scene", seconds.scene},       {"graph", seconds.graph},
          {"clusters", seconds.clusters}, {"skeleton", seconds.skeleton}, {"refine", seconds.refine},
          {"surfaces", seconds.surfaces}, {"tree", seconds.total}};
}

void warn_of_points(Console& console, const TreeResult& tree, const Measures& measures) {
  if (tree.small_component_points > 0)
    console.warn(fmt::format("{} in components too small for a tree left out; --components bridge joins them",
                             counted(tree.small_component_points, "point", "points")));
  if (tree.unexplained_points * kFewUnexplained > measures.coverage.size())
    console.warn(fmt::format("{} are near no branch: leaves, or other things than the tree",
                             counted(tree.unexplained_points, "point", "points")));
}

std::string tree_line(std::size_t number, const ScannedTree& tree) {
  return fmt::format("tree {:<5} {} at ({:.6g}, {:.6g}, {:.6g}), height {:.4g}, {}, volume {:.4g}", number,
                     counted(tree.points, "point", "points"), tree.base.x, tree.base.y, tree.base.z, tree.height,
                     counted(tree.branches, "branch", "branches"), tree.volume);
}

void print_summary(Console& console, const TreeCommand& command, const std::vector<Vec3>& points,
                   const TreeResult& tree, const Measures& measures, const Json& seconds) {
  console.print(fmt::format("input      {}: {} in {}{}", command.input, counted(points.size(), "point", "points"),
                            counted(tree.components, "component", "components"),
                            tree.part.empty() && tree.ground_points > 0
                                ? fmt::format("; {} below the ground left out", tree.ground_points)
                                : ""));
  if (!tree.part.empty())
    console.print(fmt::format("left out   {} of the ground, {} of {}, {} of low plants, {} strays", tree.ground_points,
                              tree.wall_points, counted(tree.walls, "wall", "walls"), tree.low_plant_points,
                              tree.stray_points));
  console.print(
      fmt::format("clusters   {}, {} of them cylinders; noise {:.3g}", tree.clusters, tree.fixed_clusters, tree.noise));
  for (std::size_t t = 0; !tree.tree.empty() && t < tree.trees.size(); ++t) console.print(tree_line(t, tree.trees[t]));
  console.print(fmt::format(
      "tree       {} of order 0 to {}; {} in all", counted(tree.branches.size(), "branch", "branches"), measures.order,
      fmt::format("length {:.4g}, volume {:.4g}, area {:.4g}", measures.length, measures.volume, measures.area)));
  console.print(
      fmt::format("points     {:.1f} % within 1 % of the height of the surface, {:.1f} % within a radius, {:.1f} % "
                  "within two",
                  100 * share_of_height(measures), 100 * share_within_radii(measures.coverage, 1),
                  100 * share_within_radii(measures.coverage, 2)));
  console.print(fmt::format(
      "surface    {:.1f} % farther than 2 % of the height from all points; radii rest on points "
      "along {:.1f} % of the length, else on the pipe model with p = {:.2f}",
      100 * measures.bare, 100 * measures.fitted_length / std::max(measures.length, 1e-300), tree.pipe_exponent));
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose) print_seconds(console, seconds);
  console.print_written(
      {command.output, command.skeleton, command.cylinders, command.labels, command.preview, command.common.report});
}

void run(const TreeCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{command.output, kTreeFormats},
                 {command.skeleton, {".ply"}},
                 {command.cylinders, {".csv"}},
                 {command.labels, {".ply"}},
                 {command.preview, {".png"}},
                 report_output(report_path)},
                {command.input});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");

  console.phase("reading " + command.input);
  const Stopwatch reading;
  const PointCloud cloud = read_point_cloud(command.input, console.context());
  const std::vector<Vec3>& points = cloud.points;
  double io = reading.seconds();

  TreeOptions options = command.options;
  options.ground = command.ground.height;
  options.find_ground = command.ground.find;
  options.classes = cloud.classification;
  if (options.tip_radius == 0 && cloud.unit > 0) options.tip_radius = kTipMetres / cloud.unit;
  const TreeResult tree = reconstruct_tree(points, options, console.context());
  const Stopwatch meshing;
  const TriangleMesh mesh = tree_mesh(tree);
  Json seconds = tree_seconds(tree.seconds);
  seconds["mesh"] = meshing.seconds();

  console.phase("measuring the distance of the points");
  const Stopwatch measuring;
  const Measures measures = measure(points, options, tree, mesh);
  seconds["quality"] = measuring.seconds();
  warn_of_points(console, tree, measures);

  console.phase("writing " + command.output);
  stop_watching_interrupts();
  const Stopwatch writing;
  write_tree(command.output, tree, mesh, unit_of_output(command, cloud.unit, console));
  if (!command.skeleton.empty()) write_skeleton(command.skeleton, tree);
  if (!command.cylinders.empty()) write_cylinders(command.cylinders, tree);
  if (!command.labels.empty()) write_tree_labels(command.labels, points, tree);
  io += writing.seconds();
  const Stopwatch drawing;
  if (!command.preview.empty()) write_tree_preview(command.preview, points, tree, mesh);
  seconds["preview"] = drawing.seconds();
  seconds["io"] = io;
  seconds["total"] = total.seconds();
  if (!report_path.empty()) {
    Json report = tree_report(cloud, tree, measures);
    report["seconds"] = seconds;
    write_report(report_path, report, console.warnings());
  }
  print_summary(console, command, points, tree, measures, seconds);
}

}  // namespace

Command add_tree(CLI::App& program) {
  const auto command = std::make_shared<TreeCommand>();
  CLI::App* app = add_command(program, "tree", "Reconstruct the branches of a tree from a laser scan.",
                              "bisector tree POINTS -o OUT [options]",
                              "Examples:\n"
                              "  bisector tree scan.xyz -o tree.obj --report tree.json --preview tree.png\n"
                              "  bisector tree scan.ply -o tree.igs --unit mm --skeleton skeleton.ply\n"
                              "  bisector tree street.las -o trees.obj --scene --cylinders trees.csv\n\n"
                              "POINTS is .las (not compressed), .ply, .pcd, .pts or, with any other name, lines\n"
                              "\"x y z\"; z is up. Ctrl-C stops the run; nothing is written.");
  add_options(app, *command);
  return {app,
          [=] {
            check_usage(*command, Usage(*app));
            command->has_unit = Usage(*app).given("--unit");
          },
          [=] { run(*command); }};
}

}  // namespace bisector::cli
