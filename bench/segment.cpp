// Segmentations of surfaces: seconds, errors, their spread over random starts, and CGAL's planar regions beside them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/polygonise.h"
#include "bisector/quality.h"
#include "bisector/segment.h"
#include "common.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/random.h"
#include "io/files.h"
#include "segment/proxy.h"
#include "segment/quadric_fit.h"
#include "segment/segment_domain.h"
#include "vsa.h"

namespace {

using namespace bisector;
using namespace bisector::bench;

struct Options {
  std::vector<std::string> models;
  std::vector<std::size_t> proxies{22};
  std::string csv, json;
  SegmentOptions segment;
  PolygoniseOptions polygonise;
  std::size_t repeat = 3, spread = 0, peer_iterations = 100;
  unsigned threads = 1;
  bool peers = false, polygons = false;
};

std::string percent(double length, double diagonal) { return fmt::format("{:.5f}", 100 * length / diagonal); }

double diagonal_of(const TriangleMesh& mesh) { return bounding_box(mesh.vertices).diagonal(); }

// Root mean square distance of the regions to their best planes, integrated exactly.
double planar_rms(const TriangleMesh& mesh, const std::vector<Index>& labels) {
  std::map<Index, SurfaceMoments> regions;
  const Vec3 origin = mesh.vertices[mesh.triangles[0][0]];
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const SurfaceMoments moments = triangle_moments(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], origin);
    const auto [at, is_new] = regions.try_emplace(labels[t], moments);
    if (!is_new) at->second = merged(at->second, moments);
  }
  double sum = 0, area = 0;
  for (const auto& [label, moments] : regions) {
    sum += fit_plane(moments).squared_distance;
    area += moments.area();
  }
  return std::sqrt(std::max(0.0, sum / area));
}

// Seconds that one evaluation of a triangle's distance to a quadric takes.
double evaluation_seconds(const TriangleMesh& mesh) {
  const SegmentDomain domain = make_segment_domain(mesh);
  Quadric quadric;
  quadric.c = {-0.1, 0.3, -0.2, 0.5, 1, 0.1, 0.2, 0.8, -0.1, 0.6};
  const Proxy proxy = Proxy::of(quadric);
  const std::size_t n = mesh.triangles.size(), rounds = 1 + 2'000'000 / n;
  double sum = 0;
  const Stopwatch watch;
  for (std::size_t round = 0; round < rounds; ++round)
    for (Index t = 0; t < n; ++t) sum += distance_to(domain, t, proxy);
  const double seconds = watch.seconds();
  if (!(sum >= 0)) throw Error("the sum of distances is not a number");
  return seconds / static_cast<double>(rounds * n);
}

// The same mesh to a segmentation: triangles in another order, corners turned, rigidly moved.
TriangleMesh shuffled(const TriangleMesh& mesh, std::uint64_t seed) {
  Random random(seed);
  TriangleMesh result = mesh;
  const double angle = 2 * std::numbers::pi * random.uniform();
  Vec3 axis{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
  axis *= 1 / norm(axis);
  const Vec3 shift = diagonal_of(mesh) * Vec3{random.uniform(), random.uniform(), random.uniform()};
  for (Vec3& p : result.vertices)
    p = std::cos(angle) * p + std::sin(angle) * cross(axis, p) + (1 - std::cos(angle)) * dot(axis, p) * axis + shift;
  for (std::size_t i = result.triangles.size(); i > 1; --i)
    std::swap(result.triangles[i - 1],
              result.triangles[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
  for (Triangle& t : result.triangles)
    std::rotate(t.begin(), t.begin() + static_cast<int>(3 * random.uniform()), t.end());
  result.face_of_triangle.clear();
  result.labels.clear();
  result.feature_edges.clear();
  return result;
}

std::string surfaces_word(const Options& options) {
  return std::string(job::kSurfaceWords.word_of(options.segment.surfaces));
}

std::string start_word(const Options& options) { return std::string(job::kStartWords.word_of(options.segment.start)); }

SegmentOptions options_of(const Options& options, std::size_t proxies) {
  SegmentOptions segment = options.segment;
  segment.proxies = proxies;
  return segment;
}

void add_run(Table& table, const Options& options, const std::string& name, const TriangleMesh& mesh,
             std::size_t proxies) {
  SegmentOptions wanted = options_of(options, proxies);
  wanted.project = true;
  std::vector<double> totals;
  SegmentResult result;
  for (std::size_t r = 0; r < options.repeat; ++r) {
    result = segment(mesh, wanted);
    totals.push_back(result.seconds.total);
  }
  const double diagonal = diagonal_of(mesh), total = median(totals);
  TriangleMesh projected{result.projected, mesh.triangles};
  const double share = evaluation_seconds(mesh) * static_cast<double>(result.evaluations) / total;
  const SegmentSeconds& s = result.seconds;
  table.rows.push_back(
      {name, std::to_string(mesh.triangles.size()), surfaces_word(options), start_word(options),
       std::to_string(result.regions.size()), fmt::format("{:.2f}", total), fmt::format("{:.2f}", s.start),
       fmt::format("{:.2f}", s.lloyd + s.improve), fmt::format("{:.3f}", s.smooth + s.classify + s.project),
       percent(result.rms_before, diagonal), percent(result.rms, diagonal),
       fmt::format("{:.4f}", measure_distance(projected, mesh).rms),
       options.segment.surfaces == SegmentSurfaces::planes ? percent(planar_rms(mesh, result.labels), diagonal) : "",
       fmt::format("{:.2f}", result.border_after / result.border_before), std::to_string(result.iterations),
       fmt::format("{:.2f}", share)});
}

void add_peers(Table& table, const Options& options, const std::string& name, const TriangleMesh& mesh,
               std::size_t proxies) {
  for (const bool l21 : {false, true}) {
    std::vector<double> totals;
    std::vector<Index> labels;
    for (std::size_t r = 0; r < options.repeat; ++r) {
      const Stopwatch watch;
      labels = cgal_regions(mesh, proxies, options.peer_iterations, l21);
      totals.push_back(watch.seconds());
    }
    std::vector<std::string> row(table.columns.size());
    row[0] = name;
    row[1] = std::to_string(mesh.triangles.size());
    row[2] = "planes";
    row[3] = l21 ? "CGAL L2,1" : "CGAL L2";
    row[4] = std::to_string(1 + *std::max_element(labels.begin(), labels.end()));
    row[5] = fmt::format("{:.2f}", median(totals));
    row[12] = percent(planar_rms(mesh, labels), diagonal_of(mesh));
    row[14] = std::to_string(options.peer_iterations);
    table.rows.push_back(std::move(row));
  }
}

// The region's best planes.
SegmentResult with_best_planes(const TriangleMesh& mesh, std::vector<Index> labels) {
  SegmentResult result;
  std::map<Index, SurfaceMoments> regions;
  for (std::size_t t = 0; t < labels.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const SurfaceMoments moments = triangle_moments(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], {});
    const auto [at, is_new] = regions.try_emplace(labels[t], moments);
    if (!is_new) at->second = merged(at->second, moments);
  }
  std::map<Index, Index> number;
  for (const auto& [label, moments] : regions) {
    number.try_emplace(label, static_cast<Index>(result.regions.size()));
    const PlaneFit fit = fit_plane(moments);
    result.regions.push_back({Plane{fit.normal, fit.offset}});
    result.regions.back().rms = std::sqrt(std::max(0.0, fit.squared_distance) / moments.area());
  }
  for (Index& label : labels) label = number[label];
  result.labels = std::move(labels);
  return result;
}

void add_polygon_row(Table& table, const std::string& name, const char* method, std::size_t polygons,
                     const TriangleMesh& made, const TriangleMesh& mesh, double seconds) {
  const DistanceReport distance = measure_distance(made, mesh);
  const MeshTopology before = analyse_topology(mesh.triangles, mesh.vertices.size());
  const MeshTopology after = analyse_topology(made.triangles, made.vertices.size());
  table.rows.push_back({name, method, std::to_string(polygons), std::to_string(made.vertices.size()),
                        std::to_string(made.triangles.size()), fmt::format("{:.4f}", distance.rms_to_reference),
                        fmt::format("{:.4f}", distance.rms_from_reference), fmt::format("{:.3f}", distance.max),
                        after.manifold ? "yes" : "no", fmt::format("{} ({})", after.euler, before.euler),
                        std::to_string(count_self_intersections(made)), fmt::format("{:.2f}", seconds)});
}

// Coarse meshes of planar regions: of this segmentation, of CGAL's regions, and CGAL's own of these.
void add_polygons(Table& table, const Options& options, const std::string& name, const TriangleMesh& mesh,
                  std::size_t proxies) {
  SegmentOptions wanted = options_of(options, proxies);
  wanted.surfaces = SegmentSurfaces::planes;
  const SegmentResult own = segment(mesh, wanted);
  const auto add_own = [&](const char* method, const SegmentResult& regions) {
    const Stopwatch watch;
    const PolygonisedMesh made = polygonise(mesh, regions, options.polygonise);
    add_polygon_row(table, name, method, made.polygons.rows(), made.triangulated, mesh, watch.seconds());
  };
  add_own("Bisector", own);
  for (const double chord : {0.0, options.polygonise.chord}) {
    const Stopwatch watch;
    const CgalPolygons made = cgal_polygons(mesh, proxies, options.peer_iterations, chord);
    add_polygon_row(table, name, chord > 0 ? "CGAL L2, chords" : "CGAL L2", made.polygons, made.mesh, mesh,
                    watch.seconds());
    if (chord > 0) add_own("Bisector on CGAL's regions", with_best_planes(mesh, made.labels));
  }
}

// Least, middle and largest error over random starts, or over equal meshes.
void add_spread(Table& table, const Options& options, const std::string& name, const TriangleMesh& mesh,
                std::size_t proxies) {
  SegmentOptions wanted = options_of(options, proxies);
  std::vector<double> errors, totals, regions;
  for (std::size_t k = 0; k < options.spread; ++k) {
    wanted.random_seed = k + 1;
    const SegmentResult result =
        wanted.start == SegmentStart::random ? segment(mesh, wanted) : segment(shuffled(mesh, k + 1), wanted);
    errors.push_back(result.rms);
    totals.push_back(result.seconds.total);
    std::fprintf(stderr, "%s, %s: %zu of %zu\n", name.c_str(), start_word(options).c_str(), k + 1, options.spread);
  }
  const double diagonal = diagonal_of(mesh);
  table.rows.push_back(
      {name, surfaces_word(options), start_word(options), std::to_string(proxies), std::to_string(options.spread),
       percent(*std::min_element(errors.begin(), errors.end()), diagonal), percent(median(errors), diagonal),
       percent(*std::max_element(errors.begin(), errors.end()), diagonal), fmt::format("{:.2f}", median(totals))});
}

void run(const Options& options) {
  const ThreadLimit limit(options.threads);
  fmt::print("{}\nthreads: {}; times in s, lengths in % of the diagonal\n\n", describe_machine(), options.threads);
  Table table;
  if (options.spread > 0)
    table.columns = {"model", "surfaces", "start", "proxies", "runs", "rms least", "rms median", "rms most", "total"};
  else if (options.polygons)
    table.columns = {"model",    "method",  "polygons", "vertices",      "triangles",          "rms to",
                     "rms from", "largest", "manifold", "Euler (input)", "self-intersections", "seconds"};
  else
    table.columns = {"model",     "triangles", "surfaces",   "start",           "regions", "total",
                     "starting",  "Lloyd",     "post",       "rms unsmoothed",  "rms",     "projected",
                     "to planes", "border",    "iterations", "evaluation share"};
  for (std::size_t k = 0; k < options.models.size(); ++k) {
    const TriangleMesh mesh = read_mesh(options.models[k]);
    const std::string name = std::filesystem::path(options.models[k]).stem();
    const std::size_t proxies = options.proxies[std::min(k, options.proxies.size() - 1)];
    if (options.spread > 0) {
      add_spread(table, options, name, mesh, proxies);
      continue;
    }
    if (options.polygons) {
      add_polygons(table, options, name, mesh, proxies);
      continue;
    }
    add_run(table, options, name, mesh, proxies);
    if (options.peers) add_peers(table, options, name, mesh, proxies);
  }
  fmt::print("{}", table.markdown());
  if (!options.csv.empty()) write_file(options.csv, table.csv());
  if (!options.json.empty()) write_file(options.json, table.json());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.models = {BISECTOR_DEFAULT_MODEL};
  CLI::App app{"Times segmentations and measures their errors."};
  app.add_option("MESH", options.models, "surfaces; default: examples/smooth.off");
  app.add_option("--proxies", options.proxies, "regions, of each mesh or of all; default 22")->delimiter(',');
  job::add_words(&app, "--surfaces", options.segment.surfaces, job::kSurfaceWords, job::kSurfaceWords.list().c_str());
  job::add_words(&app, "--start", options.segment.start, job::kStartWords, job::kStartWords.list().c_str());
  app.add_option("--iterations", options.segment.iterations, "Lloyd steps at most")->check(CLI::Range(0, 100'000));
  app.add_option("--smooth", options.segment.smooth, "weight of the borders' length")->check(CLI::Range(0.0, 1e6));
  app.add_option("--fuzzy-rings", options.segment.fuzzy_rings, "width of the strip; 0: as it takes")
      ->check(CLI::Range(0, 1000));
  app.add_option("--repeat", options.repeat, "runs of each; times are medians")->check(CLI::Range(1, 1000));
  app.add_flag("--peers", options.peers, "also CGAL's planar regions, L2 and L2,1; for edge-manifold meshes");
  app.add_flag("--polygons", options.polygons, "instead: coarse meshes of planar regions, CGAL's beside them");
  app.add_option("--chord", options.polygonise.chord, "with --polygons: where borders are divided")
      ->check(CLI::PositiveNumber);
  app.add_option("--peer-iterations", options.peer_iterations, "of CGAL's")->check(CLI::Range(1, 100'000));
  app.add_option("--spread", options.spread,
                 "instead: errors over so many random seeds (random), or renumbered and moved meshes (merging)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "0: all cores")->check(CLI::Range(0, 1024));
  app.add_option("--csv", options.csv, "also write the table to this file");
  app.add_option("--json", options.json, "the same as JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_segment: %s\n", error.what());
    return 1;
  }
}
