// bisector remesh-parts
#include "job/remesh_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "front.h"
#include "job/messages.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

void print_summary(Console& console, const RemeshPartsJob& job, const JobFiles& files) {
  const PartsResult& result = job.result;
  console.print(fmt::format("input      {}: {}, {}", job.input, counted(result.input_vertices, "vertex", "vertices"),
                            counted(result.input_triangles, "face", "faces")));
  console.print(fmt::format("output     {}: {}", files.outputs.at("output"), size_of(output_json(result.mesh))));
  print_quality(console, job.quality);
  console.print(fmt::format("topology   {}", describe(result.topology)));
  console.print(fmt::format("energy     {:.6e} after {} iterations, {} of them on the whole surface", result.energy,
                            result.iterations, result.iterations_on_all));
  std::size_t most = 0;
  double memory = 0;
  for (const PartFigures& rank : result.ranks) {
    most = std::max(most, rank.facets);
    memory = std::max(memory, static_cast<double>(rank.memory));
  }
  console.print(fmt::format("ranks      {}; of one at most {} and {:.0f} MiB", result.ranks.size(),
                            counted(most, "face", "faces"), memory / (1 << 20)));
  console.print(fmt::format("time       {:.2f} s", job.seconds["total"].get<double>()));
  if (files.common.verbose) print_seconds(console, job.seconds, nullptr);
}

}  // namespace

Command add_remesh_parts(CLI::App& program) {
  return add_job(
      program,
      {"Make a triangle mesh of a surface that is too large for one process.",
       "mpirun -n RANKS bisector remesh-parts IN.ply -o OUT -n N [options]",
       "Each rank of MPI reads and holds a part of the surface only. Seeds find their places on a surface of far fewer "
       "triangles first, then on the surface itself. Edges are of one length; sharp edges are not looked for, nothing "
       "is mended, and the topology is not compared. The result is the same for any number of ranks.",
       {{"mpirun -n 4 bisector remesh-parts scan.ply -o out.ply -n 1000000",
         "Remesh with a million vertices, in four processes."}},
       "All ranks have to find the file under its name."},
      "write a report with quality, timings and what each rank\n"
      "had to hold: JSON, or a page with 3D views if FILE ends\n"
      "in .html; - for stdout",
      print_summary);
}

}  // namespace bisector::cli
