// How many pairs climb which rung of certification, time and memory: for each kind of seeds and precision in a process
// of its own.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "backend/cpu_backend.h"
#include "bisector/error.h"
#include "bisector/io.h"
#include "common.h"
#include "core/geometry.h"
#include "io/files.h"
#include "mesh/sampling.h"

namespace {

using namespace bisector;
using namespace bisector::bench;

constexpr std::size_t kMany = 500'000;  // seeds; from here on only the first evaluation

struct Options {
  std::vector<std::string> models{BISECTOR_DEFAULT_MODEL};
  std::string csv, json;
  std::size_t seeds = 100'000;
  std::vector<std::string> patterns{"random", "graded", "patch", "grid", "dyadic"},
      rungs{"double", "single", "single-only"};
  DeviceOptions device;
  bool once = false;  // the first of each list, in this process
};

// Layers through the bounding box, as many in each direction as give about that many seeds. If they are dyadic, they
// lie at whole multiples of powers of two, so that far more ties are exact, and may reach beyond the box.
std::vector<Vec3> grid_seeds(const TriangleMesh& mesh, std::size_t count, bool dyadic) {
  const int n = std::max(2, static_cast<int>(std::lround(std::cbrt(static_cast<double>(count)))));
  Box box = bounding_box(mesh.vertices);
  for (int k = 0; k < 3 && dyadic; ++k) {
    const double extent = box.hi[k] - box.lo[k];
    double spacing = extent > 0 ? std::exp2(std::ceil(std::log2(extent / (n - 1)))) : 1;
    while (spacing * (std::floor(box.lo[k] / spacing) + n - 1) < box.hi[k]) spacing *= 2;
    box.lo[k] = spacing * std::floor(box.lo[k] / spacing);
    box.hi[k] = box.lo[k] + spacing * (n - 1);
  }
  std::vector<Vec3> seeds;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        const std::array<int, 3> at{i, j, k};
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
          p[axis] = box.lo[axis] + (box.hi[axis] - box.lo[axis]) * at[static_cast<std::size_t>(axis)] / (n - 1);
        seeds.push_back(p);
      }
  return seeds;
}

// Random seeds whose spacing grows thirtyfold along x, or is a tenth of the rest's in a ball around a vertex, a tenth
// of the diagonal in radius.
std::vector<Vec3> uneven_seeds(const TriangleMesh& mesh, std::size_t count, bool patch) {
  const Box box = bounding_box(mesh.vertices);
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) {
    const double along = (v[0] - box.lo[0]) / (box.hi[0] - box.lo[0]);
    const bool inside = norm(v - mesh.vertices.front()) < 0.1 * norm(box.hi - box.lo);
    const double spacing = patch ? (inside ? 0.1 : 1) : std::pow(30, along);
    density.push_back(1 / (spacing * spacing));
  }
  std::vector<Vec3> seeds;
  for (const SurfaceSample& sample : sample_surface(mesh, count, 1, density)) seeds.push_back(sample.point);
  return seeds;
}

std::vector<Vec3> seeds_of(const TriangleMesh& mesh, std::size_t count, const std::string& pattern) {
  if (pattern == "random") return random_seeds(mesh, count);
  if (pattern == "graded" || pattern == "patch") return uneven_seeds(mesh, count, pattern == "patch");
  return grid_seeds(mesh, count, pattern == "dyadic");
}

std::string device_phases(const DeviceSeconds& s) {
  std::string text;
  for (const double seconds : {s.transfer, s.grid, s.neighbours, s.owners, s.clip, s.sort, s.sum})
    text += fmt::format(",{:.3f}", seconds);
  return text;
}

// Prints the row of the first of each list, but for the memory.
void run_once(Options options) {
  const std::string& model = options.models.front();
  const Surface surface(read_mesh(model));
  const std::string& pattern = options.patterns.front();
  const std::vector<Vec3> seeds = seeds_of(surface.mesh, options.seeds, pattern);
  const std::string& rung = options.rungs.front();
  options.device.precision = rung == "double" ? Precision::double_ : Precision::single;
  options.device.double_rung = rung != "single-only";
  const std::unique_ptr<Backend> backend = make_device_backend(surface, options.device, NeighbourSource::nearest);
  Diagram diagram;
  const CellMoments& moments = diagram.moments;
  const Stopwatch cold_watch;
  EvaluationReport report = backend->evaluate(seeds, Want::triangles, diagram);
  const double cold = cold_watch.seconds();
  std::string warm = "-";
  if (seeds.size() < kMany) {
    backend->evaluate({seeds.begin(), seeds.end() - 1}, Want::triangles, diagram);
    const Stopwatch watch;
    report = backend->evaluate(seeds, Want::triangles, diagram);
    warm = fmt::format("{:.2f}", watch.seconds());
  }
  // After all that counts for the memory: the CPU needs less.
  Diagram reference;
  CpuBackend(surface, NeighbourSource::nearest).evaluate(seeds, Want::triangles, reference);
  const bool same = moments.triangles.offsets == reference.moments.triangles.offsets &&
                    moments.triangles.values == reference.moments.triangles.values;
  const Certification& c = report.certification;
  const double share = static_cast<double>(c.cpu) / static_cast<double>(c.pairs);
  const double missing = std::abs(moments.mass - surface.mass) / surface.mass;
  fmt::print("{},{},{},{},{},{},{},{},{},{:.5f} %,{},{:.1e},{:.2f},{}{}\n",
             std::filesystem::path(model).stem().string(), seeds.size(), pattern, rung, c.pairs, c.uncertain, c.wider,
             c.doubled, c.cpu, 100 * share, same ? "yes" : "NO", missing, cold, warm,
             device_phases(report.seconds.device));
}

// The row of run_once() in a new process, and its peak resident memory. Must come before the first loop of this
// process.
std::vector<std::string> row_of(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error("no pipe");
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], 1);
    close(ends[0]);
    execv("/proc/self/exe", pointers.data());
    _exit(127);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 4096> piece;
  for (ssize_t size; (size = read(ends[0], piece.data(), piece.size())) > 0;)
    text.append(piece.data(), static_cast<std::size_t>(size));
  close(ends[0]);
  int status = 0;
  rusage usage{};
  if (child < 0 || wait4(child, &status, 0, &usage) != child || status != 0 || text.empty() || text.back() != '\n')
    throw Error("a run in a process of its own failed");
  text.back() = ',';
  text += fmt::format("{},", usage.ru_maxrss / 1024);
  std::vector<std::string> cells;
  for (std::size_t begin = 0, end; (end = text.find(',', begin)) != std::string::npos; begin = end + 1)
    cells.push_back(text.substr(begin, end - begin));
  return cells;
}

void run(const Options& options) {
  if (options.once) return run_once(options);
  Table table{{"model",    "seeds", "pattern",          "precision",   "pairs",      "uncertain", "wider",
               "doubled",  "cpu",   "share on the CPU", "CPU's pairs", "mass error", "first",     "later",
               "transfer", "grid",  "neighbours",       "owners",      "clip",       "sort",      "sum",
               "memory"},
              {}};
  fmt::print("{}\ndevice: {}; memory in MiB, times in s\n\n", describe_machine(), describe_device(options.device));
  for (const std::string& model : options.models)
    for (const std::string& pattern : options.patterns)
      for (const std::string& rung : options.rungs) {
        table.rows.push_back(
            row_of({"bench_certification", model, "--once", "--seeds", std::to_string(options.seeds), "--patterns",
                    pattern, "--rungs", rung, "--device", word_of(options.device.device)}));
        std::fprintf(stderr, "%s, %s, %s: done\n", model.c_str(), pattern.c_str(), rung.c_str());
      }
  fmt::print("{}", table.markdown());
  if (!options.csv.empty()) write_file(options.csv, table.csv());
  if (!options.json.empty()) write_file(options.json, table.json());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.device.device.kind = DeviceRequest::Kind::vulkan;
  CLI::App app{"Counts the pairs that climb each rung of certification on a device, with time and memory."};
  app.add_option("MESH", options.models, "surfaces; default: examples/smooth.off");
  app.add_option("--seeds", options.seeds, "about how many")->check(CLI::Range(2, 100'000'000));
  app.add_option("--patterns", options.patterns, "random, graded, patch, grid, dyadic")
      ->delimiter(',')
      ->check(CLI::IsMember({"random", "graded", "patch", "grid", "dyadic"}));
  app.add_option("--rungs", options.rungs, "double; single; single-only, without the double rung")
      ->delimiter(',')
      ->check(CLI::IsMember({"double", "single", "single-only"}));
  add_device(app, options.device.device);
  app.add_option("--csv", options.csv, "also write the table to this file");
  app.add_option("--json", options.json, "the same as JSON");
  app.add_flag("--once", options.once)->group("");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_certification: %s\n", error.what());
    return 1;
  }
}
