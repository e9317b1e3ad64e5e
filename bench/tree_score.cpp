// How well branches of trees are found in sparse scans: generated ones, whose branches are known, and files.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/io.h"
#include "bisector/tree.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "support/tree_score.h"

namespace {

using namespace bisector;

const std::map<std::string, test::ScanPath> kPaths{
    {"one-side", test::ScanPath::one_side}, {"street", test::ScanPath::street}, {"airborne", test::ScanPath::airborne}};

struct Row {
  double branches = 0, found = 0, right = 0, spurious = 0, radius = 0, thick = 0, volume = 0;
  test::SurfaceScore surface;
  double thicker = 0, seconds = 0;
  test::LeafScore leaves{1, 0};  // as if all were kept
};

const char* const kHead =
    "| scan | points | leaves | seed | branches | found | right parent | spurious | radius error | of thick ones | "
    "volume "
    "| within 1 % | bare area | / allometric | thicker | leaves: precision | recall | s "
    "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    "---|\n";

void print_row(const std::string& path, const std::string& points, double leaves, const std::string& seed,
               const Row& r) {
  fmt::print(
      "| {} | {} | {:.0f} % | {} | {:.3g} | {:.1f} % | {:.1f} % | {:.3g} | {:.1f} % | {:.1f} % | {:+.1f} % | "
      "{:.1f} % | {:.1f} % | {:.2f} | {:.3g} | {:.2f} | {:.2f} | {:.2f} |\n",
      path, points, 100 * leaves, seed, r.branches, 100 * r.found, 100 * r.right, r.spurious, 100 * r.radius,
      100 * r.thick, 100 * r.volume, 100 * r.surface.near_points, 100 * r.surface.bare_area, r.surface.allometric,
      r.thicker, r.leaves.precision, r.leaves.recall, r.seconds);
  std::fflush(stdout);
}

Row measure(const test::TreeScan& scan, const TreeOptions& options) {
  Stopwatch watch;
  const TreeResult tree = reconstruct_tree(scan.points, options);
  Row row;
  row.seconds = watch.seconds();
  const test::ScanScore score = test::score_scan(scan, test::axes_of(tree));
  const auto branches = static_cast<double>(score.branches);
  row.branches = branches;
  row.found = static_cast<double>(score.found) / branches;
  row.right = static_cast<double>(score.right_parent) / branches;
  row.spurious = static_cast<double>(score.spurious);
  row.radius = score.radius_error;
  row.thick = score.thick_radius_error;
  row.volume = score.volume_error;
  std::vector<Vec3> wood;
  for (std::size_t i = 0; i < scan.points.size(); ++i)
    if (scan.kinds[i] == test::PointKind::wood) wood.push_back(scan.points[i]);
  row.surface = test::score_surfaces(wood, tree);
  row.thicker = static_cast<double>(row.surface.thicker);
  if (!tree.leaf.empty()) row.leaves = test::score_leaves(scan, tree.leaf);
  return row;
}

// Of the volume's errors their sizes; errors of radii of the scans in which a branch was found.
Row mean(const std::vector<Row>& rows) {
  const auto over = [&](const auto& value) {
    double sum = 0, count = 0;
    for (const Row& r : rows)
      if (const double v = value(r); std::isfinite(v)) sum += v, ++count;
    return count > 0 ? sum / count : std::numeric_limits<double>::infinity();
  };
  Row result;
  for (const auto value : {&Row::branches, &Row::found, &Row::right, &Row::spurious, &Row::radius, &Row::thick,
                           &Row::thicker, &Row::seconds})
    result.*value = over([&](const Row& r) { return r.*value; });
  result.volume = over([](const Row& r) { return std::abs(r.volume); });
  for (const auto value :
       {&test::SurfaceScore::near_points, &test::SurfaceScore::bare_area, &test::SurfaceScore::allometric})
    result.surface.*value = over([&](const Row& r) { return r.surface.*value; });
  for (const auto value : {&test::LeafScore::precision, &test::LeafScore::recall})
    result.leaves.*value = over([&](const Row& r) { return r.leaves.*value; });
  return result;
}

// Noise of 5 to 15 mm and beams of 5 to 20 mm at the tree.
test::TreeScanOptions options_of(test::ScanPath path, std::size_t points, double leaves, std::uint64_t seed) {
  test::SplitMix64 random(seed ^ 0xb1005u);
  test::TreeScanOptions options{.path = path, .points = points, .leaves = leaves, .random_seed = seed};
  options.noise = random.range(0.005, 0.015);
  options.beam = random.range(0.003, 0.01);
  options.divergence = random.range(0.0002, 0.0003);
  return options;
}

void score_generated(const std::vector<std::string>& paths, const std::vector<std::size_t>& counts,
                     const std::vector<double>& leaves, const std::array<std::uint64_t, 2>& seeds,
                     const TreeOptions& options) {
  fmt::print("{}", kHead);
  std::map<double, std::vector<Row>> all;  // by leaves
  for (const std::string& path : paths)
    for (const std::size_t points : counts)
      for (const double share : leaves) {
        std::vector<Row> rows;
        for (std::uint64_t seed = seeds[0]; seed <= seeds[1]; ++seed) {
          const test::TreeScan scan = test::scan_tree(options_of(kPaths.at(path), points, share, seed));
          try {
            rows.push_back(measure(scan, options));
          } catch (const Error& error) {
            fmt::print(stderr, "bench_tree_score: {} of {} points, seed {}: {}\n", path, points, seed, error.what());
            continue;
          }
          print_row(path, std::to_string(scan.points.size()), share, std::to_string(seed), rows.back());
        }
        if (rows.empty()) continue;
        all[share].insert(all[share].end(), rows.begin(), rows.end());
        print_row(path, std::to_string(points), share, "mean", mean(rows));
      }
  for (const auto& [share, rows] : all) print_row("all", "all", share, "mean", mean(rows));
}

void score_files(const std::vector<std::string>& files, double metre) {
  fmt::print(
      "| scan | points | branches | within 1 % | bare area | / allometric | thicker | s |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const std::string& file : files) {
    const std::vector<Vec3> points = read_points(file);
    Stopwatch watch;
    const TreeResult tree = reconstruct_tree(points);
    const double seconds = watch.seconds();
    const test::SurfaceScore score = test::score_surfaces(points, tree, metre);
    fmt::print("| {} | {} | {} | {:.1f} % | {:.1f} % | {:.2f} | {} | {:.2f} |\n", file, points.size(),
               tree.branches.size(), 100 * score.near_points, 100 * score.bare_area, score.allometric, score.thicker,
               seconds);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> files, paths{"one-side", "street", "airborne"};
  std::vector<std::size_t> points{5'000, 20'000, 50'000};
  std::vector<double> leaves{0, 0.3};
  std::array<std::uint64_t, 2> seeds{1, 5};
  TreeOptions options;
  double metre = 1;
  unsigned threads = 2;
  CLI::App app{"How well branches of trees are found in sparse scans: generated ones, or files."};
  app.add_option("SCANS", files, "files of points, instead of generated scans");
  app.add_option("--paths", paths, "one-side, street, airborne")->delimiter(',')->check(CLI::IsMember(kPaths));
  app.add_option("--points", points, "of each scan")->delimiter(',');
  app.add_option("--leaves", leaves, "share of the points")->delimiter(',')->check(CLI::Range(0.0, 0.9));
  app.add_option("--seeds", seeds, "the first and the last one")->delimiter(',');
  app.add_flag_callback(
      "--leaves-apart", [&] { options.leaves = TreeLeaves::apart; }, "leaves are told from wood and left out");
  app.add_option("--metre", metre, "its length in the files' unit")->check(CLI::PositiveNumber);
  app.add_option("--threads", threads, "default 2");
  CLI11_PARSE(app, argc, argv);
  try {
    const ThreadLimit limit(threads);
    if (files.empty()) score_generated(paths, points, leaves, seeds, options);
    else score_files(files, metre);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_tree_score: {}\n", error.what());
    return 1;
  }
  return 0;
}
