// Tetrahedral meshes of one solid by Bisector and by its peers at like numbers of vertices.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "bisector/tetmesh.h"
#include "common.h"
#include "core/parallel.h"
#include "mesh/tet_quality.h"
#include "mesh/tet_topology.h"
#include "mesh3.h"
#include "remesh/remesh.h"
#include "tetmesh/check_surface.h"
#if BISECTOR_TETGEN
#include "tetgen_pq.h"
#endif

namespace {

using namespace bisector;
using namespace bisector::bench;

constexpr int kTrials = 4;            // of a peer, to meet the number of vertices
constexpr double kNearEnough = 0.05;  // of the number

struct Options {
  std::string model = BISECTOR_DEFAULT_MODEL, density = "uniform", csv, json;
  std::vector<std::string> peers{"odt", "lloyd", "tetgen"};
  std::size_t vertices = 5000;
  std::uint64_t random_seed = 1;
  unsigned threads = 1;
};

struct Result {
  std::string name;
  TetMesh mesh;
  double seconds = 0;
};

TriangleMesh surface_of(const TetMesh& mesh) { return boundary_surface(mesh); }

// A mesher with an edge length, called until it gives the wanted number of vertices; the seconds are those of the last
// call.
template <class Mesher>
Result meet_count(const std::string& name, std::size_t wanted, double edge, const Mesher& mesher) {
  Result result{name, {}, 0};
  for (int trial = 0; trial < kTrials; ++trial) {
    const Stopwatch watch;
    result.mesh = mesher(edge);
    result.seconds = watch.seconds();
    const double ratio = static_cast<double>(result.mesh.vertices.size()) / static_cast<double>(wanted);
    std::fprintf(stderr, "%s: edge %g, %zu vertices, %.1f s\n", name.c_str(), edge, result.mesh.vertices.size(),
                 result.seconds);
    if (std::abs(ratio - 1) < kNearEnough) break;
    edge *= std::cbrt(ratio);
  }
  return result;
}

std::vector<std::string> row(const Result& result, const TriangleMesh& input, double rms_of_remesh,
                             double input_volume) {
  const TetQualityReport q = measure_tet_quality(result.mesh);
  const TriangleMesh boundary = surface_of(result.mesh);
  const QualityReport s = measure_quality(boundary);
  const DistanceReport d = measure_distance(boundary, input);
  std::vector<std::string> cells{
      result.name,
      std::to_string(result.mesh.vertices.size()),
      std::to_string(boundary.vertices.size()),
      std::to_string(result.mesh.tets.size()),
      std::to_string(q.inverted + q.zero_volume),
      fmt::format("{:.2f}", q.dihedral_min),
      fmt::format("{:.1f}", q.dihedral_max),
      fmt::format("{:.4f}", q.radius_ratio_mean),
      fmt::format("{:.3f}", q.radius_ratio_min),
      fmt::format("{:.2f}", s.theta_min),
      fmt::format("{:.2f}", s.theta_min_free),
      fmt::format("{:.4f}", d.rms),
      rms_of_remesh > 0 ? fmt::format("{:.2f}", d.rms / rms_of_remesh) : "",
      fmt::format("{:+.3f}", 100 * (q.volume / input_volume - 1)),
      s.topology.manifold && s.topology.closed ? fmt::format("{}", s.topology.euler) : "no manifold",
      fmt::format("{:.1f}", result.seconds)};
  return cells;
}

void run(const Options& options) {
  const TriangleMesh input = check_surface(read_mesh(options.model));
  const FeatureGraph features = detect_features(input);
  fmt::print("{}\n{}\n{} vertices, Bisector on {} thread{}\n\n", describe_machine(),
             describe_model(options.model, input), options.vertices, options.threads, options.threads == 1 ? "" : "s");

  TetOptions tet;
  tet.vertices = options.vertices;
  tet.random_seed = options.random_seed;
  tet.threads = options.threads;
  tet.compute.device.kind = DeviceRequest::Kind::cpu;
  if (options.density == "lfs") tet.sizing.field.kind = DensityKind::lfs;
  std::fprintf(stderr, "bisector\n");
  const Stopwatch watch;
  const TetResult ours = tetrahedralise(input, tet);
  std::vector<Result> results{{"Bisector", ours.mesh, watch.seconds()}};
  results[0].mesh.feature_edges = ours.mesh.feature_edges;

  // What remeshing the surface alone reaches with as many vertices.
  RemeshOptions remeshing;
  remeshing.vertices = ours.boundary_vertices;
  remeshing.sizing.kind = tet.sizing.field.kind;
  const RemeshResult surface = remesh(input, remeshing);
  const double rms = measure_distance(surface.mesh, input).rms;

  for (const std::string& peer : options.peers) {
    if (peer == "tetgen") {
#if BISECTOR_TETGEN
      const TriangleMesh boundary = surface_of(ours.mesh);
      results.push_back(meet_count("TetGen -pq", options.vertices, ours.edge_length,
                                   [&](double edge) { return tetgen_pq(boundary, edge); }));
#endif
    } else {
      results.push_back(meet_count("CGAL " + peer, options.vertices, ours.edge_length,
                                   [&](double edge) { return mesh_3(input, features, edge, peer); }));
    }
  }

  Table table;
  table.columns = {"mesher",
                   "vertices",
                   "boundary",
                   "tets",
                   "bad",
                   "dihedral_min",
                   "dihedral_max",
                   "radius_ratio_mean",
                   "radius_ratio_min",
                   "theta_min",
                   "theta_min_free",
                   "rms %",
                   "rms / remesh",
                   "volume %",
                   "Euler",
                   "s"};
  for (const Result& result : results)
    table.rows.push_back(row(result, input, result.name == "Bisector" ? rms : 0, ours.volume));
  fmt::print("{}\nremesh with as many boundary vertices: rms {:.4f} %\n", table.markdown(), rms);
  if (!options.csv.empty()) std::ofstream(options.csv) << table.csv();
  if (!options.json.empty()) std::ofstream(options.json) << table.json();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Tetrahedral meshes of one solid by Bisector, CGAL Mesh_3 and TetGen at like numbers of vertices."};
  Options options;
  app.add_option("MODEL", options.model, "closed surface");
  app.add_option("-n", options.vertices, "vertices");
  app.add_option("--density", options.density, "uniform or lfs, of Bisector")->check(CLI::IsMember({"uniform", "lfs"}));
  app.add_option("--peers", options.peers, "of odt, lloyd (CGAL Mesh_3) and tetgen")->delimiter(',');
  app.add_option("--random-seed", options.random_seed, "of Bisector");
  app.add_option("--threads", options.threads, "of Bisector; the peers have one");
  app.add_option("--csv", options.csv, "also write the table to this file");
  app.add_option("--json", options.json, "also write the table to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
