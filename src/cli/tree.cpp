#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "io/mesh_io.h"
#include "tree/coverage.h"
#include "tree/tree.h"
#include "tree/tree_io.h"
#include "commands.h"
#include "common.h"
#include "console.h"
#include "outputs.h"
#include "report.h"

namespace bisector::cli {
namespace {

// Of all branches together, and of the points.
struct Measures {
  double length = 0, volume = 0, area = 0, height = 0;
  int order = 0;
  std::size_t trunks = 0, unassigned = 0;
  std::vector<PointCoverage> coverage;  // of the points above the ground
};

Measures measure(const std::vector<Vec3>& points, const TreeOptions& options, const TreeResult& tree,
                 const TriangleMesh& mesh) {
  Measures measures;
  std::vector<BranchSurface> surfaces;
  for (const TreeBranch& b : tree.branches) {
    measures.length += b.length;
    measures.volume += b.volume;
    measures.area += b.area;
    measures.order = std::max(measures.order, b.order);
    measures.trunks += b.parent == kNone;
    surfaces.push_back(b.surface);
  }
  std::vector<Vec3> above;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].z < options.ground) continue;
    above.push_back(points[i]);
    measures.unassigned += tree.branch[i] == kNone;
  }
  const Box box = bounding_box(above);
  measures.height = box.hi.z - box.lo.z;
  measures.coverage = cover_points(above, surfaces, mesh);
  return measures;
}

double share_of_height(const Measures& measures) { return share_within(measures.coverage, 0.01 * measures.height); }

Json branch_json(const TreeBranch& branch) {
  return {{"parent", branch.parent == kNone ? Json(nullptr) : Json(branch.parent)},
          {"order", branch.order},
          {"length", branch.length},
          {"base_radius", branch.base_radius},
          {"tip_radius", branch.tip_radius},
          {"volume", branch.volume},
          {"area", branch.area},
          {"points", branch.points}};
}

Json tree_report(const std::vector<Vec3>& points, const TreeResult& tree, const Measures& measures) {
  Json report = start_report("tree");
  report["input"] = {{"points", points.size()},
                     {"ground_points", tree.ground_points},
                     {"duplicate_points", tree.duplicate_points},
                     {"small_component_points", tree.small_component_points},
                     {"unassigned_points", measures.unassigned},
                     {"components", tree.components},
                     {"bridges", tree.bridges},
                     {"height", measures.height},
                     {"noise", tree.noise}};
  report["clusters"] = {{"count", tree.clusters}, {"cylinders", tree.fixed_clusters}};
  report["tree"] = {{"trunks", measures.trunks},       {"branches", tree.branches.size()},
                    {"order", measures.order},         {"nodes", tree.skeleton.size()},
                    {"length", measures.length},       {"volume", measures.volume},
                    {"area", measures.area}};
  report["coverage"] = {{"within_1_radius", share_within_radii(measures.coverage, 1)},
                        {"within_2_radii", share_within_radii(measures.coverage, 2)},
                        {"within_1_percent_of_height", share_of_height(measures)}};
  report["branches"] = Json::array();
  for (const TreeBranch& branch : tree.branches) report["branches"].push_back(branch_json(branch));
  report["seconds"] = nullptr;
  return report;
}

Json tree_seconds(const TreeSeconds& seconds) {
  return {{"total", seconds.total},       {"graph", seconds.graph},   {"clusters", seconds.clusters},
          {"skeleton", seconds.skeleton}, {"refine", seconds.refine}, {"surfaces", seconds.surfaces},
          {"tree", seconds.total}};
}

void warn_of_points(Console& console, const TreeResult& tree, const Measures& measures) {
  if (tree.small_component_points > 0)
    console.warn(fmt::format("{} in components too small for a tree left out; --components bridge joins them",
                             counted(tree.small_component_points, "point", "points")));
  const std::size_t others = measures.unassigned - std::min(measures.unassigned, tree.small_component_points);
  if (others > 0) console.warn(fmt::format("{} belong to no branch", counted(others, "point", "points")));
}

void print_summary(Console& console, const TreeCommand& command, const std::vector<Vec3>& points, const TreeResult& tree,
                   const Measures& measures, const Json& seconds) {
  console.print(fmt::format("input      {}: {} in {}{}", command.input, counted(points.size(), "point", "points"),
                            counted(tree.components, "component", "components"),
                            tree.ground_points > 0 ? fmt::format("; {} below the ground left out", tree.ground_points) : ""));
  console.print(fmt::format("clusters   {}, {} of them cylinders; noise {:.3g}", tree.clusters, tree.fixed_clusters,
                            tree.noise));
  console.print(fmt::format("tree       {} of order 0 to {}; {} in all", counted(tree.branches.size(), "branch", "branches"),
                            measures.order, fmt::format("length {:.4g}, volume {:.4g}, area {:.4g}", measures.length,
                                                        measures.volume, measures.area)));
  console.print(fmt::format("points     {:.1f} % within 1 % of the height of the surface, {:.1f} % within a radius, {:.1f} % "
                            "within two",
                            100 * share_of_height(measures), 100 * share_within_radii(measures.coverage, 1),
                            100 * share_within_radii(measures.coverage, 2)));
  console.print(fmt::format("time       {:.2f} s", seconds["total"].get<double>()));
  if (command.common.verbose) print_seconds(console, seconds);
  console.print_written({command.output, command.skeleton, command.labels, command.preview, command.common.report});
}

IgesUnit parse_unit(const std::string& word) {
  return word == "mm"   ? IgesUnit::millimetre
         : word == "cm" ? IgesUnit::centimetre
         : word == "in" ? IgesUnit::inch
                        : IgesUnit::metre;
}

}  // namespace

void run(const TreeCommand& command) {
  const Stopwatch total;
  const std::string& report_path = command.common.report;
  check_outputs({{command.output, kTreeFormats}, {command.skeleton, {".ply"}}, {command.labels, {".ply"}},
                 {command.preview, {".png"}}, report_output(report_path)},
                {command.input});
  const ThreadLimit limit(command.common.threads);
  Console console(command.common.quiet, report_path == "-");

  console.phase("reading " + command.input);
  const Stopwatch reading;
  const std::vector<Vec3> points = read_points(command.input);
  double io = reading.seconds();

  TreeOptions options = command.options;
  options.components = command.components == "separate" ? TreeComponents::separate : TreeComponents::bridge;
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
  write_tree(command.output, tree, mesh, parse_unit(command.unit));
  if (!command.skeleton.empty()) write_skeleton(command.skeleton, tree);
  if (!command.labels.empty()) write_tree_labels(command.labels, points, tree);
  io += writing.seconds();
  const Stopwatch drawing;
  if (!command.preview.empty()) write_tree_preview(command.preview, points, tree, mesh);
  seconds["preview"] = drawing.seconds();
  seconds["io"] = io;
  seconds["total"] = total.seconds();
  if (!report_path.empty()) {
    Json report = tree_report(points, tree, measures);
    report["seconds"] = seconds;
    write_report(report_path, report);
  }
  print_summary(console, command, points, tree, measures, seconds);
}

}  // namespace bisector::cli
