// A whole remesh with default options, beside CGAL's Delaunay triangulation of 100,000 random seeds of the same
// surface.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/quality.h"
#include "common.h"
#include "core/parallel.h"
#include "delaunay_time.h"
#include "io/files.h"
#include "remesh/remesh.h"

namespace {

using namespace bisector;
using namespace bisector::bench;

constexpr std::size_t kYardstick = 100'000;  // seeds

struct Options {
  std::string model = BISECTOR_DEFAULT_MODEL, csv;
  std::vector<std::uint64_t> random_seeds{1};
  RemeshOptions remesh;
  std::size_t repeat = 3;
  DeviceOptions device;
  std::string json;
};

struct Series {
  std::uint64_t random_seed = 1;
  std::vector<double> total, diagram, ratio;
  RemeshResult last;
};

void run(Options options) {
  const std::string machine = describe_machine();
  const TriangleMesh mesh = read_mesh(options.model);
  const std::vector<Vec3> seeds = random_seeds(mesh, kYardstick);
  fmt::print("{}\n{}\n{} vertices, threads: {}; times in s\n\n", machine, describe_model(options.model, mesh),
             options.remesh.vertices, options.remesh.threads);

  std::vector<Series> all;
  for (std::uint64_t random_seed : options.random_seeds) all.push_back({random_seed, {}, {}, {}, {}});
  std::vector<double> delaunay;
  for (std::size_t r = 0; r < options.repeat; ++r)
    for (Series& s : all) {
      options.remesh.random_seed = s.random_seed;
      const double before = delaunay_seconds(seeds);
      const Stopwatch watch;
      const ThreadLimit limit(options.remesh.threads);
      const Surface surface(mesh);
      const auto backend = make_device_backend(surface, options.device, NeighbourSource::nearest);
      s.last = remesh(*backend, {}, plan_of(options.remesh), {}, [&](const Surface& other) {
        return make_device_backend(other, options.device, NeighbourSource::nearest);
      });
      s.total.push_back(watch.seconds());
      const double after = delaunay_seconds(seeds);
      const DiagramSeconds& phases = s.last.seconds.diagrams;
      s.diagram.push_back(phases.delaunay + phases.neighbours + phases.pairs + phases.clip);
      s.ratio.push_back(s.total.back() / (0.5 * (before + after)));
      delaunay.insert(delaunay.end(), {before, after});
      std::fprintf(stderr, "random seed %llu: round %zu of %zu\n", static_cast<unsigned long long>(s.random_seed),
                   r + 1, options.repeat);
    }

  Table table{{"random seed", "total", "in diagrams", "CGAL 100 k", "ratio", "evaluations", "q_ave", "q_min",
               "theta_min_ave", "theta_min", "theta_below_30", "valence6", "distance_rms", "topology"},
              {}};
  for (const Series& s : all) {
    const QualityReport q = measure_quality(s.last.mesh);
    table.rows.push_back({std::to_string(s.random_seed), fmt::format("{:.2f}", median(s.total)),
                          fmt::format("{:.2f}", median(s.diagram)), fmt::format("{:.3f}", median(delaunay)),
                          fmt::format("{:.2f}", median(s.ratio)), std::to_string(s.last.evaluations),
                          fmt::format("{:.4f}", q.q_ave), fmt::format("{:.3f}", q.q_min),
                          fmt::format("{:.2f}", q.theta_min_ave), fmt::format("{:.1f}", q.theta_min),
                          fmt::format("{:.3g}", q.theta_below_30), fmt::format("{:.3f}", q.valence6),
                          fmt::format("{:.4f}", measure_distance(s.last.mesh, mesh).rms),
                          s.last.topology_matches ? "as input" : "differs"});
  }
  fmt::print("{}", table.markdown());
  if (!options.csv.empty()) write_file(options.csv, table.csv());
  if (!options.json.empty()) write_file(options.json, table.json());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.remesh.vertices = 10'000;
  options.remesh.threads = 1;
  CLI::App app{"Times a whole default remesh beside CGAL's Delaunay triangulation of 100,000 random seeds."};
  app.add_option("MESH", options.model, "the surface; default: examples/smooth.off");
  app.add_option("-n", options.remesh.vertices, "vertices of the result")->check(CLI::Range(4, 100'000'000));
  app.add_option("--repeat", options.repeat, "runs of each")->check(CLI::Range(1, 1000));
  app.add_option("--random-seeds", options.random_seeds, "random starts")->delimiter(',');
  add_device_options(app, options.device);
  app.add_option("--json", options.json, "the same as JSON");
  app.add_option("--threads", options.remesh.threads, "of the remesh; 0: all cores")->check(CLI::Range(0, 1024));
  app.add_option("--csv", options.csv, "also write the table to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_remesh: %s\n", error.what());
    return 1;
  }
}
