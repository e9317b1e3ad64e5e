// bisector tet
#include "job/tet.h"

#include <fmt/format.h>

#include "front.h"
#include "job/messages.h"
#include "remesh/topology_control.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

void print_summary(Console& console, const TetJob& job, const JobFiles& files) {
  const TetResult& result = job.result;
  const TetJob::Measures& measures = job.measures;
  const TetQualityReport& q = measures.tets;
  console.print(fmt::format("input      {}: {}", job.input, size_of(size_json(job.domain))));
  console.print(fmt::format("output     {}: {}", files.outputs.at("output"), size_of(size_json(result.mesh))));
  console.print(fmt::format(
      "quality    dihedral angles {:.2f} to {:.2f} degrees; radius ratio {:.4f} on average, {:.4f} at least",
      q.dihedral_min, q.dihedral_max, q.radius_ratio_mean, q.radius_ratio_min));
  console.print(fmt::format("boundary   {} in {}; theta_min {:.2f} degrees, q_min {:.4f}, q_ave {:.4f}",
                            counted(result.boundary_vertices, "vertex", "vertices"),
                            counted(result.mesh.boundary.size(), "triangle", "triangles"), measures.boundary.theta_min,
                            measures.boundary.q_min, measures.boundary.q_ave));
  const bool same = same_topology(measures.topology.boundary, result.input_topology);
  console.print(fmt::format("topology   {}{}", describe(measures.topology.boundary),
                            same ? "; as the input" : "; NOT as the input"));
  console.print(
      fmt::format("volume     {:.6g}, {:+.3g} % of the input's", q.volume, 100 * (q.volume / result.volume - 1)));
  if (result.interface_triangles > 0)
    console.print(fmt::format("regions    {}, with {} between them", result.regions.size(),
                              counted(result.interface_triangles, "triangle", "triangles")));
  const FeatureResult& features = result.boundary.features;
  if (features.curves > 0)
    console.print(fmt::format("features   {} of {} kept, {}", features.curves - features.broken,
                              counted(features.curves, "curve", "curves"),
                              counted(features.corners, "corner", "corners")));
  print_detail(console, result.detail);
  print_device(console, result.device);
  console.print(fmt::format("time       {:.2f} s", job.seconds["total"].get<double>()));
  if (files.common.verbose)
    print_seconds(console, job.seconds, device_seconds_json(result.device, result.seconds.diagrams.device));
}

}  // namespace

Command add_tet(CLI::App& program) {
  return add_job(
      program,
      {"Make a high-quality tetrahedral mesh of a solid.",
       "bisector tet IN -o OUT -n N|--edge-length L [options]",
       "The vertices are the seeds of a centroidal Voronoi tessellation of the solid, with a boundary like that which "
       "bisector remesh makes; slivers are then removed, so that dihedral angles are at least 30 degrees as a rule.\n"
       "A surface must be closed, manifold and free of self-intersections; others can be wrapped with --wrap. It may "
       "have several parts, beside or inside each other; a part inside an odd number of others is a cavity. With "
       "--regions each part of space that it encloses is filled, and it may branch where several meet. Surfaces are "
       "filled by TetGen in a process of its own, bisector-tetgen. Regions of tetrahedra are kept: the triangles "
       "between two are shared by them.",
       {{"bisector tet bunny.off -o out.msh -n 10000", "Fill a surface with tetrahedra of about 10,000 vertices."},
        {"bisector tet part.stl -o out.vtu --edge-length 0.5 --report out.json",
         "Make edges half a unit long, and write figures on angles and volumes."},
        {"bisector tet coarse.mesh -o fine.mesh -n 50000 --sizes sizes.vtu:h",
         "Mesh a solid anew, with the edge lengths h that another mesh has."}},
       "Meshes are read and written by extension. Ctrl-C stops the run; nothing is written."},
      "write a report with quality, distance of the boundary to\n"
      "the input and timings: JSON, or a page with 3D views if\n"
      "FILE ends in .html; - for stdout",
      print_summary);
}

}  // namespace bisector::cli
