// One cold evaluation of the restricted Voronoi diagram, beside CGAL's Delaunay triangulation of the same seeds.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "bisector/io.h"
#include "common.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "delaunay_time.h"
#include "io/files.h"

namespace {

using namespace bisector;
using namespace bisector::bench;

constexpr std::size_t kMany = 500'000;  // seeds; from here on with half the repeats

struct Options {
  std::string model = BISECTOR_DEFAULT_MODEL, csv;
  std::vector<std::size_t> seeds{10, 100, 1'000, 10'000, 100'000, 1'000'000};
  std::vector<unsigned> threads{1, 2};
  std::vector<std::string> sources{"nearest", "delaunay"};
  std::size_t repeat = 5;
  DeviceOptions device;
  std::string json;
  bool alone = false;  // without the yardstick and the memory
  bool once = false;   // one evaluation of the first of each list and nothing else, for its memory
};

struct Run {
  double total = 0, gradient_norm = 0;
  Diagram diagram;
  EvaluationReport report;
};

// The seeds a little off, as they are between two steps of an optimisation.
std::vector<Vec3> moved(const Surface& surface, std::vector<Vec3> seeds) {
  const double step = 1e-3 * std::sqrt(surface.area / static_cast<double>(seeds.size()));
  for (Vec3& x : seeds) x += Vec3{step, -step, step};
  return seeds;
}

// From seeds to a gradient: on the CPU with nothing kept from before, on a device after a diagram of moved seeds, which
// has compiled its kernels and got its memory.
Run evaluate(const Surface& surface, const std::vector<Vec3>& seeds, NeighbourSource source, unsigned threads,
             Backend* device) {
  const ThreadLimit limit(threads);
  Run run;
  std::vector<Vec3> gradient(seeds.size());
  if (device && seeds.size() > 1) device->evaluate(moved(surface, seeds), Want::moments, run.diagram);
  const Stopwatch watch;
  if (device) {
    run.report = device->evaluate(seeds, Want::moments, run.diagram);
  } else {
    run.report = CpuBackend(surface, source).evaluate(seeds, Want::moments, run.diagram);
  }
  parallel_each(seeds.size(), [&](std::size_t i) { gradient[i] = -2.0 * run.diagram.moments.cells[i].first; });
  run.gradient_norm = std::sqrt(fixed_sum(seeds.size(), [&](std::size_t i) { return norm2(gradient[i]); }));
  const double missing = std::abs(run.diagram.moments.mass - surface.mass);
  run.total = watch.seconds();
  if (!(missing <= (device ? device->mass_tolerance() : 1e-12) * surface.mass))
    throw Error(fmt::format("{} seeds: the masses sum to {:.17g}, the area is {:.17g}", seeds.size(),
                            run.diagram.moments.mass, surface.mass));
  return run;
}

std::unique_ptr<Backend> device_of(const Surface& surface, const Options& options, NeighbourSource source) {
  return is_cpu(options.device.device) ? nullptr : make_device_backend(surface, options.device, source);
}

// Peak resident memory, in MiB, of a process that reads the model and evaluates once. Must come before the first loop
// of this process: a new process counts what its parent held.
double peak_memory(const Options& options, std::size_t seeds, const std::string& source, unsigned threads) {
  std::vector<std::string> words{"bench_evaluation",
                                 options.model,
                                 "--once",
                                 "--seeds",
                                 std::to_string(seeds),
                                 "--sources",
                                 source,
                                 "--threads",
                                 std::to_string(threads),
                                 "--device",
                                 word_of(options.device.device),
                                 "--precision",
                                 std::string(job::kPrecisionWords.word_of(options.device.precision))};
  if (!options.device.double_rung) words.insert(words.end(), {"--double-rung", "off"});
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    execv("/proc/self/exe", arguments.data());
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  if (child < 0 || wait4(child, &status, 0, &usage) != child || status != 0)
    throw Error("a process of its own to measure memory failed");
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// All runs of one combination of seeds, source and threads.
struct Series {
  std::string source;
  unsigned threads = 1;
  double memory = 0;
  std::vector<double> total, neighbours, owners, clip, ratio;
  double mass = 0, energy = 0;
  EvaluationReport last;
  double gradient_norm = 0;
  std::unique_ptr<Backend> device;  // none: the CPU

  void add(Run run, double delaunay) {
    const DiagramSeconds& phases = run.report.seconds;
    total.push_back(run.total);
    neighbours.push_back(phases.delaunay + phases.neighbours);
    owners.push_back(phases.pairs);
    clip.push_back(phases.clip);
    if (delaunay > 0) ratio.push_back(run.total / delaunay);
    if (gradient_norm != 0 && run.gradient_norm != gradient_norm)
      throw Error("the gradient differs from the last run's");
    gradient_norm = run.gradient_norm;
    mass = run.diagram.moments.mass;
    energy = run.diagram.moments.energy;
    last = run.report;
  }
};

void require_same(const Series& a, const Series& b) {
  if (a.mass != b.mass || a.energy != b.energy || a.gradient_norm != b.gradient_norm)
    throw Error(
        fmt::format("{} with {} threads and {} with {} threads differ", a.source, a.threads, b.source, b.threads));
}

std::string milliseconds(double seconds) { return fmt::format("{:.{}f}", 1e3 * seconds, seconds < 0.1 ? 2 : 0); }

void measure(const Surface& surface, const Options& options, std::size_t count, std::vector<Series> series,
             Table& table) {
  const std::vector<Vec3> seeds = random_seeds(surface.mesh, count);
  const std::size_t repeat = count < kMany ? options.repeat : (options.repeat + 1) / 2;
  std::vector<double> delaunay;
  for (Series& s : series) s.device = device_of(surface, options, job::kNeighbourWords.parse(s.source));
  for (std::size_t r = 0; r < repeat; ++r) {
    for (Series& s : series) {
      // Its own triangulation right before each: what slows one of the two slows the other.
      if (!options.alone) delaunay.push_back(delaunay_seconds(seeds));
      s.add(evaluate(surface, seeds, job::kNeighbourWords.parse(s.source), s.threads, s.device.get()),
            options.alone ? 0 : delaunay.back());
    }
    std::fprintf(stderr, "%zu seeds: round %zu of %zu\n", count, r + 1, repeat);
  }
  for (const Series& s : series) {
    require_same(s, series.front());
    // The first number of threads of the same source.
    const Series& base =
        *std::find_if(series.begin(), series.end(), [&](const Series& b) { return b.source == s.source; });
    const EvaluationReport& m = s.last;
    table.rows.push_back({std::to_string(count), s.source, std::to_string(s.threads), milliseconds(median(s.total)),
                          milliseconds(median(s.neighbours)), milliseconds(median(s.owners)),
                          milliseconds(median(s.clip)), options.alone ? "" : milliseconds(median(delaunay)),
                          options.alone ? "" : fmt::format("{:.2f}", median(s.ratio)),
                          fmt::format("{:.2f}", median(base.total) / median(s.total)),
                          options.alone ? "" : fmt::format("{:.0f}", s.memory), std::to_string(m.certification.pairs),
                          std::to_string(m.certification.uncertain), std::to_string(m.certification.wider),
                          fmt::format("{:.1e}", std::abs(s.mass - surface.mass) / surface.mass)});
    if (is_cpu(options.device.device)) continue;
    const DeviceSeconds& d = m.seconds.device;
    std::vector<std::string>& row = table.rows.back();
    row.insert(row.end(), {std::to_string(m.certification.doubled), std::to_string(m.certification.cpu)});
    for (const double seconds : {d.transfer, d.grid, d.neighbours, d.owners, d.clip, d.sort, d.sum})
      row.push_back(milliseconds(seconds));
    const DeviceWork& w = m.device_work;
    row.insert(row.end(), {milliseconds(w.host_seconds), std::to_string(w.submits), std::to_string(w.dispatches),
                           fmt::format("{:.1f}", 1e-6 * static_cast<double>(w.bytes_up)),
                           fmt::format("{:.1f}", 1e-6 * static_cast<double>(w.bytes_down))});
  }
}

void run(const Options& options) {
  if (options.once) {
    const ThreadLimit limit(options.threads.front());
    const Surface surface(read_mesh(options.model));
    const std::vector<Vec3> seeds = random_seeds(surface.mesh, options.seeds.front());
    const NeighbourSource source = job::kNeighbourWords.parse(options.sources.front());
    evaluate(surface, seeds, source, options.threads.front(), device_of(surface, options, source).get());
    return;
  }
  const std::string machine = describe_machine();
  std::vector<std::vector<Series>> all;
  for (std::size_t count : options.seeds) {
    all.emplace_back();
    for (const std::string& source : options.sources)
      for (unsigned threads : options.threads) {
        Series s;
        s.source = source;
        s.threads = threads;
        if (!options.alone) s.memory = peak_memory(options, count, source, threads);
        all.back().push_back(std::move(s));
      }
  }
  TriangleMesh mesh = read_mesh(options.model);
  fmt::print("{}\n{}\n", machine, describe_model(options.model, mesh));
  const Stopwatch preparing;
  const Surface surface(std::move(mesh));
  fmt::print("surface prepared once in {:.0f} ms, not counted below; times in ms, memory in MiB\n\n",
             1e3 * preparing.seconds());
  Table table{{"seeds", "source", "threads", "total", "neighbours", "owners", "clip", "CGAL", "ratio", "speed-up",
               "memory", "pairs", "uncertain", "wider", "mass error"},
              {}};
  if (!is_cpu(options.device.device)) {
    fmt::print("device: {}\n\n", describe_device(options.device));
    for (const char* name : {"doubled", "cpu", "d. transfer", "d. grid", "d. neighbours", "d. owners", "d. clip",
                             "d. sort", "d. sum", "host", "submits", "dispatches", "MB up", "MB down"})
      table.columns.push_back(name);
  }
  for (std::size_t k = 0; k < all.size(); ++k) measure(surface, options, options.seeds[k], std::move(all[k]), table);
  fmt::print("{}", table.markdown());
  if (!options.csv.empty()) write_file(options.csv, table.csv());
  if (!options.json.empty()) write_file(options.json, table.json());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Times one cold evaluation of a restricted Voronoi diagram beside CGAL's Delaunay triangulation."};
  app.add_option("MESH", options.model, "the surface; default: examples/smooth.off");
  app.add_option("--seeds", options.seeds, "counts, area-uniform random seeds")->delimiter(',');
  app.add_option("--repeat", options.repeat, "runs of each; half as many from 500,000 seeds on")
      ->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "numbers of threads")->delimiter(',')->check(CLI::Range(1, 1024));
  app.add_option("--sources", options.sources, job::kNeighbourWords.list())
      ->delimiter(',')
      ->check(job::parsed_by([](const std::string& word) { job::kNeighbourWords.parse(word); }));
  add_device_options(app, options.device);
  app.add_option("--csv", options.csv, "also write the table to this file");
  app.add_option("--json", options.json, "the same as JSON");
  app.add_flag("--alone", options.alone, "leave out CGAL and the memory, which take longer than all else");
  app.add_flag("--once", options.once)->group("");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_evaluation: %s\n", error.what());
    return 1;
  }
}
