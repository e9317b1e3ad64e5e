// bisector tree
#include "job/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "front.h"
#include "job/messages.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

std::string tree_line(std::size_t number, const ScannedTree& tree) {
  return fmt::format("tree {:<5} {} at ({:.6g}, {:.6g}, {:.6g}), height {:.4g}, {}, volume {:.4g}", number,
                     counted(tree.points, "point", "points"), tree.base.x, tree.base.y, tree.base.z, tree.height,
                     counted(tree.branches, "branch", "branches"), tree.volume);
}

void print_summary(Console& console, const TreeJob& job, const JobFiles& files) {
  const std::vector<Vec3>& points = job.cloud.points;
  const TreeResult& tree = job.result;
  const TreeJob::Measures& measures = job.measures;
  console.print(fmt::format("input      {}: {} in {}{}", job.input, counted(points.size(), "point", "points"),
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
  console.print(fmt::format("time       {:.2f} s", job.seconds["total"].get<double>()));
  if (files.common.verbose) print_seconds(console, job.seconds);
}

}  // namespace

Command add_tree(CLI::App& program) {
  return add_job(
      program,
      {"Reconstruct the branches of a tree from a laser scan.",
       "bisector tree POINTS -o OUT [options]",
       "The skeleton follows the shortest paths along the points; radii are fitted to the points around it, and follow "
       "the pipe model where there are too few. Each branch is a closed surface whose root reaches to its parent's "
       "axis, as triangles or as a B-spline surface. The report has lengths, radii, orders and volumes.\n"
       "With --scene ground and walls are left out and several trees are told from each other.",
       {{"bisector tree scan.xyz -o tree.obj --report tree.json --preview tree.png",
         "Make triangles with a group for each branch, a report and a picture."},
        {"bisector tree scan.ply -o tree.igs --unit mm --skeleton skeleton.ply",
         "Make B-spline surfaces of a scan in millimetres, and write the branches' axes."},
        {"bisector tree street.las -o trees.obj --scene --cylinders trees.csv",
         "Tell the trees of a street from each other, and write their branches as cylinders."}},
       "POINTS is .las (not compressed), .ply, .pcd, .pts or, with any other name, lines\n"
       "\"x y z\"; z is up. Ctrl-C stops the run; nothing is written."},
      "write a report with branches, volume, distances of the\n"
      "points and timings: JSON, or a page with 3D views if\n"
      "FILE ends in .html; - for stdout",
      print_summary);
}

}  // namespace bisector::cli
