// bisector rvd
#include "job/rvd.h"

#include <fmt/format.h>

#include <algorithm>

#include "front.h"
#include "job/messages.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

void print_summary(Console& console, const RvdJob& job, const JobFiles& files) {
  const CellMoments& moments = job.diagram.moments;
  const auto empty =
      std::count_if(moments.cells.begin(), moments.cells.end(), [](const Moments& m) { return m.mass == 0; });
  console.print(fmt::format("input      {}: {}", job.input, size_of(size_json(job.domain))));
  console.print(
      fmt::format("cells      {}, {} of them empty; energy {:.6e}", moments.cells.size(), empty, moments.energy));
  console.print(fmt::format(
      "pairs      {} of a cell and a {}, {} decided in exact arithmetic", job.evaluation.certification.pairs,
      job.domain.tets ? "triangle of the boundary" : "triangle", job.evaluation.certification.cpu));
  console.print(fmt::format("dual       {}", counted(job.diagram.dual.triangles.size(), "triangle", "triangles")));
  print_device(console, job.device);
  console.print(fmt::format("time       {:.2f} s", job.seconds["total"].get<double>()));
  if (files.common.verbose)
    print_seconds(console, job.seconds, device_seconds_json(job.device, job.evaluation.seconds.device));
}

}  // namespace

Command add_rvd(CLI::App& program) {
  return add_job(program,
                 {"Compute one restricted Voronoi diagram of a surface, or a clipped one of a solid.",
                  "bisector rvd IN --seeds FILE.xyz|-n N [-o CELLS.ply|CELLS.vtu] [options]",
                  "The surface, or the solid that tetrahedra fill, is divided among the seeds by nearness, without "
                  "optimising them. The report has the "
                  "mass, centroid and energy of each cell and the restricted Delaunay triangulation.\n"
                  "Ties are decided by the seeds' order, so that the diagram is a function of mesh and seeds alone; "
                  "that its cells tile the surface is checked.",
                  {{"bisector rvd bunny.off -n 500 -o cells.ply --preview cells.png",
                    "Write and draw the cells of 500 random seeds."},
                   {"bisector rvd part.msh -n 500 -o cells.vtu", "Write the cells of seeds in a solid as polyhedra."},
                   {"bisector rvd bunny.off --seeds points.xyz --report -",
                    "Print the cells' figures and the dual of given seeds as JSON."}}},
                 "write a report with all cells and the restricted\n"
                 "Delaunay triangulation (rdt): JSON, or a page with 3D\n"
                 "views if FILE ends in .html; - for stdout",
                 print_summary);
}

}  // namespace bisector::cli
