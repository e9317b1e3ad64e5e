// Cold evaluations of clipped Voronoi diagrams, in the shape of the thesis' Table 5.1, beside CGAL's Delaunay
// triangulation of the same seeds.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "common.h"
#include "compute/compute.h"
#include "core/parallel.h"
#include "core/random.h"
#include "delaunay_time.h"
#include "io/files.h"
#include "tetmesh/check_surface.h"
#include "tetmesh/tetgen.h"

namespace {

using namespace bisector;
using namespace bisector::bench;

struct Options {
  std::vector<std::string> models;
  std::vector<std::size_t> seeds{1'000, 3'000, 10'000, 30'000, 100'000};
  std::string csv, plot;
  NeighbourSource source = NeighbourSource::nearest;
  unsigned threads = 1;
  std::size_t repeat = 3;
  DeviceOptions device;
};

// Uniform in the solid, the same for the same count.
std::vector<Vec3> random_sites(const Solid& solid, std::size_t count) {
  std::vector<double> below;
  double total = 0;
  for (const double volume : solid.six_volumes) below.push_back(total += volume);
  Random random(1);
  std::vector<Vec3> sites(count);
  for (Vec3& x : sites) {
    const double at = random.uniform() * total;
    const std::size_t t = std::min<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(below.begin(), below.end(), at) - below.begin()), below.size() - 1);
    double u[3] = {random.uniform(), random.uniform(), random.uniform()};
    std::sort(u, u + 3);
    const auto& q = solid.mesh.vertices;
    const Tetrahedron& v = solid.mesh.tets[t];
    x = u[0] * q[v[0]] + (u[1] - u[0]) * q[v[1]] + (u[2] - u[1]) * q[v[2]] + (1 - u[2]) * q[v[3]];
  }
  return sites;
}

struct Line {
  std::string model;
  std::vector<double> seeds, total, delaunay;
};

// Log-log: a line per model, and dashed the Delaunay triangulation of its seeds.
std::string svg(const std::vector<Line>& lines) {
  double lo[2] = {1e300, 1e300}, hi[2] = {0, 0};
  for (const Line& line : lines)
    for (std::size_t k = 0; k < line.seeds.size(); ++k)
      for (const double y : {line.total[k], line.delaunay[k]}) {
        lo[0] = std::min(lo[0], line.seeds[k]);
        hi[0] = std::max(hi[0], line.seeds[k]);
        lo[1] = std::min(lo[1], y);
        hi[1] = std::max(hi[1], y);
      }
  for (int k = 0; k < 2; ++k) {
    lo[k] = std::pow(10, std::floor(std::log10(lo[k])));
    hi[k] = std::max(10 * lo[k], std::pow(10, std::ceil(std::log10(hi[k]))));
  }
  constexpr double kLeft = 70, kTop = 20, kWidth = 480, kHeight = 360;
  const auto x = [&](double seeds) { return kLeft + kWidth * std::log(seeds / lo[0]) / std::log(hi[0] / lo[0]); };
  const auto y = [&](double seconds) {
    return kTop + kHeight * (1 - std::log(seconds / lo[1]) / std::log(hi[1] / lo[1]));
  };
  std::string out =
      "<svg xmlns='http://www.w3.org/2000/svg' width='720' height='440' font-family='sans-serif' font-size='12'>\n"
      "<rect width='720' height='440' fill='white'/>\n";
  for (double at = lo[0]; at <= hi[0] * 1.001; at *= 10)
    out += fmt::format(
        "<path d='M{:.1f} {} v{}' stroke='#ddd'/><text x='{:.1f}' y='{}' text-anchor='middle'>{:.0f}</text>\n", x(at),
        kTop, kHeight, x(at), kTop + kHeight + 18, at);
  for (double at = lo[1]; at <= hi[1] * 1.001; at *= 10)
    out +=
        fmt::format("<path d='M{} {:.1f} h{}' stroke='#ddd'/><text x='{}' y='{:.1f}' text-anchor='end'>{:g} s</text>\n",
                    kLeft, y(at), kWidth, kLeft - 6, y(at) + 4, at);
  const char* colours[] = {"#1b6ca8", "#c8553d", "#3a7d44", "#8e5ea2", "#b8860b", "#444444"};
  for (std::size_t l = 0; l < lines.size(); ++l) {
    const char* colour = colours[l % std::size(colours)];
    const auto polyline = [&](const std::vector<double>& values, const char* style) {
      out += fmt::format("<polyline fill='none' stroke='{}' stroke-width='1.5' {} points='", colour, style);
      for (std::size_t k = 0; k < values.size(); ++k)
        out += fmt::format("{:.1f},{:.1f} ", x(lines[l].seeds[k]), y(values[k]));
      out += "'/>\n";
    };
    polyline(lines[l].total, "");
    polyline(lines[l].delaunay, "stroke-dasharray='4 3'");
    out += fmt::format("<text x='{}' y='{}' fill='{}'>{}</text>\n", kLeft + kWidth + 14,
                       kTop + 14 + 18 * static_cast<double>(l), colour, lines[l].model);
  }
  return out +
         fmt::format(
             "<text x='{}' y='{}' text-anchor='middle'>sites (dashed: CGAL's Delaunay triangulation)</text>\n</svg>\n",
             kLeft + kWidth / 2, kTop + kHeight + 40);
}

std::unique_ptr<SolidBackend> backend_of(const Solid& solid, const Options& options) {
  ComputeOptions compute;
  compute.device = options.device.device;
  compute.precision = options.device.precision;
  compute.neighbours = options.source;
  return make_backend(solid, compute);
}

std::string milliseconds(double seconds) { return fmt::format("{:.{}f}", 1e3 * seconds, seconds < 0.1 ? 2 : 0); }

void measure(const std::string& path, const Options& options, Table& table, std::vector<Line>& lines) {
  const std::string name = std::filesystem::path(path).stem().string();
  const Solid solid(is_tet_format(path) ? read_tet_mesh(path) : tetgen_tets(check_surface(read_mesh(path))).mesh);
  lines.push_back({name, {}, {}, {}});
  for (const std::size_t count : options.seeds) {
    const std::vector<Vec3> sites = random_sites(solid, count);
    std::vector<double> total, neighbours, surface, clip, delaunay, ratio;
    Diagram diagram;
    const CellMoments& moments = diagram.moments;
    Certification certification;
    std::string on;
    for (std::size_t r = 0; r < options.repeat; ++r) {
      // Its own triangulation right before each: what slows one of the two slows the other.
      delaunay.push_back(delaunay_seconds(sites));
      const std::unique_ptr<SolidBackend> backend = backend_of(solid, options);
      on = backend->description().kind;
      // A device has its kernels compiled and its memory allocated by a diagram of other seeds.
      if (on != "cpu" && count > 1) backend->evaluate({sites.begin(), sites.end() - 1}, Want::moments, diagram);
      const Stopwatch watch;
      const EvaluationReport report = backend->evaluate(sites, Want::moments, diagram);
      total.push_back(watch.seconds());
      ratio.push_back(total.back() / delaunay.back());
      certification = report.certification;
      neighbours.push_back(report.seconds.delaunay + report.seconds.neighbours);
      surface.push_back(report.seconds.pairs);
      clip.push_back(report.seconds.clip);
      const double missing = std::abs(moments.mass - solid.mass);
      if (!(missing <= backend->mass_tolerance() * solid.mass))
        throw Error(fmt::format("{}, {} sites: the masses sum to {:.17g}, the volume is {:.17g}", path, count,
                                moments.mass, solid.mass));
      std::fprintf(stderr, "%s, %zu sites: round %zu of %zu\n", name.c_str(), count, r + 1, options.repeat);
    }
    std::size_t boundary_sites = 0;
    for (std::size_t i = 0; i < count; ++i) boundary_sites += moments.triangles.size(i) > 0;
    lines.back().seeds.push_back(static_cast<double>(count));
    lines.back().total.push_back(median(total));
    lines.back().delaunay.push_back(median(delaunay));
    table.rows.push_back(
        {name, std::to_string(solid.mesh.tets.size()), std::to_string(solid.boundary.mesh.triangles.size()),
         std::to_string(count), std::to_string(boundary_sites), on, milliseconds(median(total)),
         milliseconds(median(neighbours)), milliseconds(median(surface)), milliseconds(median(clip)),
         milliseconds(median(delaunay)), fmt::format("{:.2f}", median(ratio)), std::to_string(certification.pairs),
         std::to_string(certification.uncertain), std::to_string(certification.wider),
         fmt::format("{:.1e}", std::abs(moments.mass - solid.mass) / solid.mass)});
  }
}

void run(const Options& options) {
  const ThreadLimit limit(options.threads);
  fmt::print("{}\n", describe_machine());
  if (!is_cpu(options.device.device)) fmt::print("device: {}\n", describe_device(options.device));
  fmt::print("{} threads; solids prepared once, not counted; times in ms\n\n", options.threads);
  Table table{{"model", "|T|", "|S|", "|X|", "|X_b|", "backend", "total", "neighbours", "surface", "clip", "CGAL",
               "ratio", "pairs", "uncertain", "wider", "mass error"},
              {}};
  std::vector<Line> lines;
  for (const std::string& model : options.models) measure(model, options, table, lines);
  fmt::print("{}", table.markdown());
  if (!options.csv.empty()) write_file(options.csv, table.csv());
  if (!options.plot.empty()) write_file(options.plot, svg(lines));
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Times cold evaluations of clipped Voronoi diagrams beside CGAL's Delaunay triangulation."};
  app.add_option("MESHES", options.models, "closed surfaces or tetrahedral meshes")->required();
  app.add_option("--seeds", options.seeds, "counts of sites, uniform in the solid")->delimiter(',');
  app.add_option("--repeat", options.repeat, "runs of each")->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "number of threads")->check(CLI::Range(1, 1024));
  job::add_words(&app, "--source", options.source, job::kNeighbourWords, job::kNeighbourWords.list().c_str());
  add_device_options(app, options.device);
  app.add_option("--csv", options.csv, "also write the table to this file");
  app.add_option("--plot", options.plot, "also plot total times to this file, as SVG");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_clipped: %s\n", error.what());
    return 1;
  }
}
