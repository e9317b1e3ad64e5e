// bisector remesh
#include "job/remesh.h"

#include <fmt/format.h>

#include "front.h"
#include "job/messages.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

void print_summary(Console& console, const RemeshJob& job, const JobFiles& files) {
  const RemeshResult& result = job.result;
  console.print(fmt::format("input      {}: {}", job.input, size_of(input_json(*job.surface))));
  console.print(fmt::format("output     {}: {}", files.outputs.at("output"), size_of(output_json(result.mesh))));
  print_quality(console, job.quality);
  console.print(fmt::format("topology   {}{}", describe(result.topology),
                            result.topology_matches ? "; as the input" : "; NOT as the input"));
  if (result.features.curves > 0)
    console.print(fmt::format("features   {} of {} kept, {}", result.features.curves - result.features.broken,
                              counted(result.features.curves, "curve", "curves"),
                              counted(result.features.corners, "corner", "corners")));
  print_detail(console, result.detail);
  if (result.distance.upper > 0)
    console.print(fmt::format("distance   to the input and back at most {:.6g}, at least {:.6g}; {} with shorter edges",
                              result.distance.upper, result.distance.lower,
                              counted(static_cast<std::size_t>(result.distance.runs), "run", "runs")));
  if (result.noisy)
    console.print(
        "noise      normals are noise at this edge length: no creases were looked for, and the result was fitted");
  console.print(fmt::format("energy     {:.6e} after {} iterations", result.energy, result.iterations));
  print_device(console, result.device);
  console.print(fmt::format("time       {:.2f} s", job.seconds["total"].get<double>()));
  if (files.common.verbose)
    print_seconds(console, job.seconds, device_seconds_json(result.device, result.seconds.diagrams.device));
}

}  // namespace

Command add_remesh(CLI::App& program) {
  return add_job(
      program,
      {"Make a high-quality triangle mesh of a surface.",
       "bisector remesh IN -o OUT -n N|--edge-length L [options]",
       "The vertices of the result are the seeds of a centroidal Voronoi tessellation of the surface, so its triangles "
       "are close to equilateral and evenly sized, or sized by a density. Sharp edges, borders and borders between "
       "face labels are kept as chains of edges, and the topology is the input's.\n"
       "The input may be what scanners and CAD systems leave: cracks that rounding made are closed, and soups, open "
       "sheets and surfaces that cross themselves become a closed manifold with --wrap.\n"
       "The result has the number of vertices asked for, but for those that features and topology add.",
       {{"bisector remesh bunny.off -o out.obj -n 10000", "Remesh with 10,000 vertices."},
        {"bisector remesh part.stl -o out.ply -n 5000 --report out.json --preview out.png",
         "Remesh a CAD part, write figures on its quality and draw a picture."},
        {"bisector remesh part.stl -o out.ply --edge-length 0.5 --features 30",
         "Make edges half a unit long, and keep all edges that are sharper than 30 degrees."}},
       "Meshes are read and written by extension. Ctrl-C stops the run; nothing is written."},
      "write a report with quality, distance to the input and\n"
      "timings: JSON, or a page with 3D views if FILE ends in\n"
      ".html; - for stdout",
      print_summary);
}

}  // namespace bisector::cli
