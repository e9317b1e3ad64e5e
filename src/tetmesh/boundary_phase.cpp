#include "tetmesh/boundary_phase.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "backend/project.h"
#include "bisector/error.h"
#include "bisector/quality.h"
#include "core/stopwatch.h"
#include "mesh/topology.h"
#include "remesh/remesh.h"
#include "spatial/hilbert.h"

namespace bisector {
namespace {

using Kind = SeedPlace::Kind;

constexpr double kJointShare = 0.2;  // of the steps that the whole run is allowed
constexpr int kJointRounds = 3;      // with sites that join the boundary in between
constexpr int kLayoutSteps = 10;     // of the surface's own optimisation, to spread the sites along features
constexpr int kBoundarySteps = 30;   // likewise, before the boundary is extracted
// The solid counts as thin from so many cells at the boundary on, over the sites that its edge lengths ask for. Of a
// free CVT 0.9 to 1.2 times as many meet the boundary, and nearly all where the solid is two cells thick.
constexpr double kThin = 1.25;
constexpr std::size_t kFewestOnBoundary = 8;

// Vertices of an equilateral triangulation of the surface with the edge lengths aimed at.
double boundary_vertices(const Surface& surface, const SizedSolid& sized) {
  const TriangleMesh& mesh = surface.mesh;
  double count = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    double per_area = 0;
    for (const Index v : t) {
      const double h = sized.lengths.empty() ? sized.edge_length : sized.lengths[v];
      per_area += 2 / (3 * std::sqrt(3.0) * h * h);
    }
    count += 0.5 * norm(twice_area_normal(a, b, c)) * per_area;
  }
  return count;
}

// So many of the points, evenly along their spatial order.
std::vector<Vec3> thinned(const std::vector<Vec3>& points, std::size_t count) {
  const std::vector<Index> order = hilbert_order(points);
  std::vector<Vec3> kept;
  for (std::size_t k = 0; k < count; ++k) kept.push_back(points[order[k * points.size() / count]]);
  return kept;
}

// The free sites, those whose cells meet the boundary moved to it.
struct Split {
  std::vector<Vec3> on_boundary, inside;
};

Split split_at_boundary(CvtRun& sites) {
  const CellMoments& moments = sites.diagram(Want::triangles).moments;
  const std::vector<Vec3>& free = sites.seeds.positions();
  std::vector<Vec3> feet = free, normals;
  project_to_cells(sites.surface(), moments.triangles, {}, feet, normals);
  Split split;
  for (std::size_t i = 0; i < free.size(); ++i) {
    if (moments.triangles.size(i) == 0) split.inside.push_back(free[i]);
    else split.on_boundary.push_back(feet[i]);
  }
  return split;
}

RemeshResult remesh_boundary(TetRun& run, std::vector<Vec3> seeds, std::vector<SeedPlace> places, bool final_pass) {
  const Stopwatch watch;
  RemeshPlan plan;
  plan.seeds = std::move(seeds);
  plan.places = std::move(places);
  plan.iterations = final_pass ? kBoundarySteps : kLayoutSteps;
  plan.tolerance = run.options.tolerance;
  plan.topology = final_pass ? TopologyControl::enforce : TopologyControl::off;
  plan.min_angle = final_pass ? run.options.min_angle : 0;
  Context quiet = run.sites.context();
  quiet.progress = nullptr;
  // On a surface that stands in for it the boundary would not be as near to the input afterwards.
  const MakeBackend no_stand_ins;
  RemeshResult result = remesh(run.boundary, run.features, plan, quiet, final_pass ? no_stand_ins : run.make_backend);
  run.seconds_boundary += watch.seconds();
  return result;
}

// By all that remeshing of surfaces does: parts that are near to each other are moved apart, edges become shorter where
// results cross, and so on. It has no part in the sites inside, whose cells are pushed off it afterwards.
RemeshResult remesh_anew(TetRun& run, std::size_t vertices) {
  const Stopwatch watch;
  const Surface& boundary = run.boundary.surface();
  RemeshOptions options;
  options.vertices = vertices;
  options.weld = 0;
  options.features.mode = FeatureMode::none;
  const EdgeTable table = edge_table(boundary.mesh.triangles, boundary.mesh.vertices.size());
  for (const auto& edge : run.features.edges)
    if (std::binary_search(table.edges.begin(), table.edges.end(), edge)) options.features.given.push_back(edge);
  options.tolerance = run.options.tolerance;
  options.min_angle = run.options.min_angle;
  options.energy = Energy::constrained;
  options.compute = run.options.compute;
  options.random_seed = run.options.random_seed;
  if (!run.sized.lengths.empty()) {
    options.sizing.kind = DensityKind::attribute;
    options.sizing.attribute = run.sized.surface_density();
  }
  Context quiet = run.sites.context();
  quiet.progress = nullptr;
  RemeshResult result = remesh(boundary.mesh, options, quiet);
  run.seconds_boundary += watch.seconds();
  return result;
}

bool bounds_solid(const RemeshResult& surface) {
  return surface.topology.closed && surface.topology.manifold && count_self_intersections(surface.mesh) == 0;
}

// Sites inside whose cells have come to the boundary join it while that has fewer than `room`; where the solid is thin,
// all of them. True if any did.
bool join_boundary(CvtRun& sites, double room, bool thin) {
  const Csr<Index>& triangles = sites.diagram(Want::triangles).moments.triangles;
  const std::vector<Index> at_boundary = inner_sites_at_boundary(sites.seeds, triangles);
  const std::span<SeedPlace> places = sites.seeds.edit_places();
  const auto held =
      std::count_if(places.begin(), places.end(), [](const SeedPlace& place) { return place.kind != Kind::interior; });
  double left = room - static_cast<double>(held);
  bool any = false;
  for (const Index i : at_boundary) {
    if (left-- < 1 && !thin) break;
    places[i] = {};
    any = true;
  }
  return any;
}

}  // namespace

JointReport joint_phase(TetRun& run, const BoundaryShare& share, SolidBackend* stand_in) {
  Split split = split_at_boundary(run.sites);
  // With no more sites on the boundary than that, tetrahedra inside and at the boundary are alike, and something is
  // left inside.
  const double room = boundary_vertices(run.solid.surface(), run.sized) + share.surplus;
  const auto met = static_cast<double>(split.on_boundary.size());
  const JointReport report{split.on_boundary.size(), share.thin || met > kThin * room};
  if (run.options.seeds.empty() && met > room)
    split.on_boundary =
        thinned(split.on_boundary, std::max(kFewestOnBoundary, static_cast<std::size_t>(std::llround(room))));
  run.sites.seeds = with_boundary(remesh_boundary(run, std::move(split.on_boundary), {}, false), split.inside);
  if (stand_in) run.sites.change_backend(*stand_in);
  for (int round = 0; round < kJointRounds; ++round) {
    optimise_sites(run, "with the boundary", kJointShare / kJointRounds, true);
    if (round + 1 < kJointRounds && !join_boundary(run.sites, room, report.thin) && round > 0) break;
  }
  run.sites.change_backend(run.solid);
  return report;
}

RemeshResult finish_boundary(TetRun& run) {
  PlacedSeeds on_boundary = run.sites.seeds;
  std::vector<char> inside(on_boundary.size(), 0);
  for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = on_boundary.kind(i) == Kind::interior;
  on_boundary.remove(inside);
  const std::size_t count = on_boundary.size();
  RemeshResult surface = remesh_boundary(run, on_boundary.positions(), on_boundary.places(), true);
  // Where sheets meet at a small angle, another pass may mend what one leaves, with more vertices.
  if (bounds_solid(surface)) return surface;
  surface = remesh_boundary(run, surface.mesh.vertices, surface.places, true);
  if (bounds_solid(surface)) return surface;
  surface = remesh_anew(run, count);
  if (bounds_solid(surface)) return surface;
  const std::size_t crossings = count_self_intersections(surface.mesh);
  if (crossings > 0)
    throw Error(fmt::format(
        "the boundary of the result crosses itself at {} pairs of triangles: parts are thinner than its edges; "
        "ask for more vertices",
        crossings));
  throw Error(
      "the boundary of the result is not a closed manifold: parts are thinner than its edges; ask for more vertices");
}

}  // namespace bisector
