// Diagrams of a surface that ranks of MPI share: what each rank has, sends and takes. Started by mpirun.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "bisector/io.h"
#include "common.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "distributed/distributed_backend.h"
#include "mpi/mpi_communicator.h"

namespace {

using namespace bisector;
using namespace bisector::bench;

struct Options {
  std::string model = BISECTOR_DEFAULT_MODEL;
  std::size_t seeds = 1'000'000;
  unsigned threads = 1;
};

// The last of some diagrams of seeds that move by a fiftieth of their spacing, and the first.
void measure(Ranks& ranks, const Options& options) {
  const ThreadLimit limit(options.threads);
  const TriangleMesh mesh = read_mesh(options.model);
  std::vector<Vec3> seeds = random_seeds(mesh, options.seeds);
  const Surface surface(mesh);
  const double spacing = std::sqrt(surface.area / static_cast<double>(options.seeds)), step = 0.02 * spacing;
  DistributedBackend backend(surface, NeighbourSource::nearest, ranks);
  Table table{{"diagram", "rank", "facets", "seeds at home", "seeds of the halo", "halo in spacings", "rounds",
               "MB sent", "CPU s", "peak MiB"},
              {}};
  Diagram diagram;
  for (int round = 0; round < 3; ++round) {
    backend.evaluate(seeds, Want::moments, diagram);
    for (Vec3& x : seeds) x += Vec3{step, -step, step};
    if (round == 1) continue;
    const std::vector<PartFigures> figures = backend.figures();
    for (std::size_t r = 0; r < figures.size(); ++r) {
      const PartFigures& f = figures[r];
      table.rows.push_back(
          {round == 0 ? "first" : "next", std::to_string(r), std::to_string(f.facets), std::to_string(f.home_seeds),
           std::to_string(f.halo_seeds), fmt::format("{:.1f}", f.halo / spacing), std::to_string(f.rounds),
           fmt::format("{:.2f}", static_cast<double>(f.bytes_sent) / 1e6), fmt::format("{:.2f}", f.cpu_seconds),
           fmt::format("{:.0f}", static_cast<double>(f.memory) / 1048576)});
    }
  }
  std::printf("%s, %zu seeds, %d ranks, threads of each: %u\n\n%s", options.model.c_str(), options.seeds, ranks.size(),
              options.threads, table.markdown().c_str());
}

int run(int argc, char** argv, Ranks& ranks) {
  Options options;
  CLI::App app("Diagrams of a surface that ranks of MPI share");
  app.add_option("model", options.model, "surface");
  app.add_option("--seeds", options.seeds, "their number");
  app.add_option("--threads", options.threads, "of each rank");
  try {
    app.parse(argc, argv);
    measure(ranks, options);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_ranks: %s\n", error.what());
    return 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  mpi::MpiCommunicator communicator;
  Ranks ranks(communicator);
  if (!ranks.is_root()) {
    serve(ranks);
    return 0;
  }
  const int code = run(argc, argv, ranks);
  end_serving(ranks);
  return code;
}
