// bisector segment
#include "job/segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "front.h"
#include "job/messages.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

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

void print_summary(Console& console, const SegmentJob& job, const JobFiles& files) {
  const SegmentResult& result = job.result;
  const double diagonal = job.diagonal;
  const auto worst = std::max_element(result.regions.begin(), result.regions.end(),
                                      [](const auto& a, const auto& b) { return a.max < b.max; });
  console.print(fmt::format("input      {}: {}", job.input, size_of(input_json(*job.surface))));
  console.print(fmt::format("regions    {}", describe_regions(result)));
  console.print(fmt::format("distance   rms {:.4g} % of the diagonal, at most {:.3g} % (region {}, {})",
                            100 * result.rms / diagonal, 100 * worst->max / diagonal, worst - result.regions.begin(),
                            name_of(type_of(worst->proxy))));
  if (job.options().smooth > 0)
    console.print(
        fmt::format("borders    {:.6g} long, {:.6g} before smoothing", result.border_after, result.border_before));
  if (job.polygons) console.print(fmt::format("polygons   {}", size_of(polygons_json(*job.polygons))));
  if (job.options().regularize)
    console.print(
        fmt::format("shared     {} of parameters", counted(result.relations.size(), "relation", "relations")));
  console.print(fmt::format("steps      {}, {}, {}, {}", counted(result.iterations, "iteration", "iterations"),
                            counted(result.insertions, "insertion", "insertions"),
                            counted(result.merges, "merge", "merges"),
                            counted(result.teleportations, "teleportation", "teleportations")));
  console.print(fmt::format("time       {:.2f} s", job.seconds["total"].get<double>()));
  if (files.common.verbose) print_seconds(console, job.seconds);
}

}  // namespace

Command add_segment(CLI::App& program) {
  return add_job(
      program,
      {"Divide a surface into planes, quadrics and tori.",
       "bisector segment IN -o OUT [--proxies N|--error E] [options]",
       "Each region is connected and close to one surface, whose type and parameters the report tells: a plane, a "
       "sphere, a cylinder, a cone, a torus or another quadric. Borders between regions are smoothed.\n"
       "With --json the surfaces are written with the loops that trim them, of which bisector-step makes faces for CAD "
       "systems. With --polygons planar regions become the polygons of a coarse mesh.",
       {{"bisector segment part.stl -o regions.ply --proxies 22 --preview regions.png",
         "Find 22 regions, and draw a picture of them."},
        {"bisector segment part.stl -o regions.obj --error 0.05 --report regions.json",
         "Find as few regions as keep the distance below 0.05 % of the diagonal."},
        {"bisector segment part.stl -o regions.ply --proxies 22 --regularize",
         "Let surfaces share axes, planes, radii and angles where the data allow."},
        {"bisector segment bunny.off -o regions.ply --proxies 28", "Divide a scan into 28 regions."}},
       "Files hold the regions as labels, groups or materials, and their colours where they can. Ctrl-C stops the "
       "run;\n"
       "nothing is written."},
      "write a report with type, parameters and error of each\n"
      "region: JSON, or a page with 3D views if FILE ends in\n"
      ".html; - for stdout",
      print_summary);
}

}  // namespace bisector::cli
