// bisector quality
#include "job/quality.h"

#include <fmt/format.h>

#include <functional>
#include <string>

#include "front.h"
#include "summary.h"

namespace bisector::cli {
namespace {

using namespace job;

using Row = std::function<void(const char* name, const std::string& value, const char* meaning)>;

std::string number(double x) { return fmt::format("{:.6g}", x); }

void print_tets(Console& console, const TetQualityReport& q, const TetTopology& t, const Row& row) {
  row("dihedral_min", number(q.dihedral_min), "smallest dihedral angle, degrees");
  row("dihedral_min_mean", number(q.dihedral_min_mean), "average of each tetrahedron's smallest");
  row("dihedral_max", number(q.dihedral_max), "largest dihedral angle, degrees");
  row("radius_ratio_min", number(q.radius_ratio_min),
      "worst 3 r / R of inscribed and circumscribed sphere; 1 is regular");
  row("radius_ratio_mean", number(q.radius_ratio_mean), "average");
  row("volume", number(q.volume), "");
  row("volume_min", number(q.volume_min), "of a tetrahedron");
  row("inverted", fmt::to_string(q.inverted), "tetrahedra of negative volume");
  row("zero_volume", fmt::to_string(q.zero_volume), "tetrahedra without volume");
  row("tet_edge_min", number(q.edge_min), "shortest edge");
  row("tet_edge_ave", number(q.edge_ave), "");
  row("tet_edge_max", number(q.edge_max), "longest edge");
  row("conforming", yes_no(t.conforming), "facets shared by two tetrahedra on opposite sides");
  if (!t.conforming) {
    row("", fmt::to_string(t.overused_facets), "facets of more than two tetrahedra");
    row("", fmt::to_string(t.misoriented_facets), "facets of two tetrahedra on one side");
    row("", fmt::to_string(t.repeated_vertices), "vertices at the point of another");
  }
  if (t.unused_vertices > 0) row("unused_vertices", fmt::to_string(t.unused_vertices), "vertices of no tetrahedron");
  row("tet_components", fmt::to_string(t.components), "connected through facets");
  std::string line = "dihedral angles by 10 degrees, %:";
  std::size_t angles = 0;
  for (const std::size_t count : q.dihedral_counts) angles += count;
  for (const std::size_t count : q.dihedral_counts)
    line += fmt::format(" {:.2g}", angles ? 100 * static_cast<double>(count) / static_cast<double>(angles) : 0.0);
  console.print(line);
}

void print_summary(Console& console, const QualityJob& job, const JobFiles& files) {
  const QualityJob::Measures& measures = job.measures;
  const Json input = measured_size_json(job.mesh);
  const QualityReport& q = measures.quality;
  const MeshTopology& t = q.topology;
  const auto row = [&](const char* name, const std::string& value, const char* meaning = "") {
    console.print(fmt::format("{:<20}{:>14}{}{}", name, value, *meaning ? "   " : "", meaning));
  };
  console.print(job.input);
  row("vertices", fmt::to_string(input["vertices"].get<std::size_t>()));
  row("faces", fmt::to_string(input["faces"].get<std::size_t>()));
  if (input.contains("tets")) {
    row("tets", fmt::to_string(input["tets"].get<std::size_t>()));
    print_tets(console, measures.tets, measures.tet_topology, row);
    console.print("boundary");
  }
  row("q_min", number(q.q_min), "worst triangle quality; 1 is equilateral");
  row("q_ave", number(q.q_ave), "average");
  row("theta_min", number(q.theta_min), "smallest angle, degrees");
  row("theta_min_ave", number(q.theta_min_ave), "average of each triangle's smallest");
  row("theta_max", number(q.theta_max), "largest angle, degrees");
  row("theta_below_30", number(q.theta_below_30), "% of triangles with an angle below 30 degrees");
  row("q_min_free", number(q.q_min_free), "q_min of triangles with fewer than two feature edges");
  row("theta_min_free", number(q.theta_min_free), "smallest angle not between two feature edges");
  row("theta_max_free", number(q.theta_max_free), "largest angle not between two feature edges");
  row("theta_below_30_free", number(q.theta_below_30_free), "% of triangles with such an angle below 30 degrees");
  row("valence6", number(q.valence6), "share of interior vertices with six neighbours");
  row("edge_min", number(q.edge_min), "shortest edge");
  row("edge_ave", number(q.edge_ave));
  row("edge_max", number(q.edge_max), "longest edge");
  row("area", number(q.area));
  row("zero_area", fmt::to_string(q.zero_area), "triangles without area");
  row("manifold", yes_no(t.manifold));
  if (!t.manifold) {
    row("", fmt::to_string(t.non_manifold_edges), "non-manifold edges");
    row("", fmt::to_string(t.non_manifold_vertices), "non-manifold vertices");
  }
  row("closed", yes_no(t.closed));
  if (!t.closed) row("", fmt::to_string(t.boundary_edges), "boundary edges");
  row("oriented", yes_no(t.oriented), "neighbouring triangles agree");
  row("euler", fmt::to_string(t.euler), "Euler characteristic V - E + F");
  row("components", fmt::to_string(t.components));
  row("self_intersections", fmt::to_string(measures.self_intersections), "pairs of triangles");
  if (!job.reference_file.empty()) {
    console.print("two-sided distance to " + job.reference_file + ", % of its diagonal");
    row("distance_mean", number(measures.distance.mean));
    row("distance_rms", number(measures.distance.rms));
    row("distance_max", number(measures.distance.max), "Hausdorff distance, from below");
  }
  if (files.common.verbose) print_seconds(console, job.seconds);
}

}  // namespace

Command add_quality(CLI::App& program) {
  return add_job(program,
                 {"Measure angles, topology and distance to another mesh.",
                  "bisector quality MESH [--reference IN] [options]",
                  "Prints the quality of triangles, their angles and edge lengths, valences, topology and "
                  "self-intersections, and of tetrahedra their dihedral angles, radius ratios and volumes. Of "
                  "tetrahedra the boundary is measured like a surface, and distances are those of the boundaries.",
                  {{"bisector quality out.obj --reference bunny.off",
                    "Measure a mesh, and its distance to what it was made of."}}},
                 "write a report: JSON, or a page with 3D views if FILE\n"
                 "ends in .html; - for stdout",
                 print_summary);
}

}  // namespace bisector::cli
