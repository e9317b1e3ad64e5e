// How well scans of several trees with ground, walls and low plants are divided, and their trees made: generated
// scenes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "bisector/error.h"
#include "bisector/tree.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "io/files.h"
#include "support/scene_score.h"
#include "support/tree_score.h"

namespace {

using namespace bisector;

struct Row {
  double trees = 0, found = 0, right_tree = 0, bushes = 0;
  test::Shares ground, wall;
  double right = 0, alone = 0;               // share of branches with the right parent; made from its points alone
  std::vector<double> volume, alone_volume;  // sizes of the trees' relative errors
  double base = 0;                           // mean distance of the bases' heights from the true ones, m
  double scene_seconds = 0, seconds = 0;
};

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

const char* const kHead =
    "| scene | points | trees | found | right tree | ground P | R | wall P | R | bushes in trees | right parent | "
    "alone "
    "| volume | alone | base | s of the division | s "
    "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

void print_row(const std::string& name, std::size_t points, const Row& r) {
  fmt::print(
      "| {} | {} | {:.3g} | {:.3g} | {:.1f} % | {:.1f} % | {:.1f} % | {:.1f} % | {:.1f} % | {:.1f} % | {:.1f} % | "
      "{:.1f} % | {:.1f} % | {:.1f} % | {:.3f} m | {:.2f} | {:.2f} |\n",
      name, points, r.trees, r.found, 100 * r.right_tree, 100 * r.ground.precision, 100 * r.ground.recall,
      100 * r.wall.precision, 100 * r.wall.recall, 100 * r.bushes, 100 * r.right, 100 * r.alone, 100 * median(r.volume),
      100 * median(r.alone_volume), r.base, r.scene_seconds, r.seconds);
  std::fflush(stdout);
}

// 2 to 5 trees 3 to 6 m apart, slopes to 0.4, bumps to 0.2 m; every other seed has a wall.
test::SceneScanOptions options_of(std::size_t points, std::size_t leaves, std::uint64_t seed) {
  test::SplitMix64 random(seed ^ 0x5ce7e5u);
  test::SceneScanOptions options;
  options.trees = 2 + random.below(4);
  options.apart = random.range(3.75, 5);
  options.points = points;
  options.slope = random.range(0, 0.4);
  options.bumps = random.range(0, 0.2);
  options.wall = seed % 2 == 0;
  options.leaves = leaves;
  options.bushes = random.below(5);
  options.noise = random.range(0.005, 0.015);
  options.random_seed = seed;
  return options;
}

Row measure(const test::SceneScan& scan, const TreeOptions& options) {
  Row row;
  Stopwatch watch;
  const TreeResult result = reconstruct_tree(scan.points, options);
  row.seconds = watch.seconds();
  row.scene_seconds = result.seconds.scene;
  const test::SceneScore score = test::score_scene(scan, result);
  row.trees = static_cast<double>(score.trees);
  row.found = static_cast<double>(score.found_trees);
  row.right_tree = score.right_tree;
  row.bushes = score.bushes_in_trees;
  row.ground = score.ground;
  row.wall = score.wall;
  double branches = 0, right = 0, alone = 0;
  for (std::size_t t = 0; t < score.trees; ++t) {
    const test::TreeScan truth = scan.tree_alone(static_cast<Index>(t));
    TreeOptions plain = options;
    plain.scene = false;
    const TreeResult single = reconstruct_tree(truth.points, plain);
    const test::ScanScore best = test::score_scan(truth, test::axes_of(single));
    branches += static_cast<double>(best.branches);
    alone += static_cast<double>(best.right_parent);
    row.alone_volume.push_back(std::abs(best.volume_error));
    if (score.match[t] == kNone) {
      row.volume.push_back(1);
      continue;
    }
    const test::ScanScore own = test::score_scan(truth, test::axes_of_tree(result, score.match[t]));
    right += static_cast<double>(own.right_parent);
    row.volume.push_back(std::abs(own.volume_error));
    row.base += std::abs(result.trees[score.match[t]].ground - scan.branches[t][0].axis[0].z) / row.trees;
  }
  row.right = right / branches;
  row.alone = alone / branches;
  return row;
}

Row mean(const std::vector<Row>& rows) {
  Row result;
  result.ground = result.wall = {0, 0};
  const double share = 1 / static_cast<double>(rows.size());
  for (const Row& r : rows) {
    for (const auto value : {&Row::trees, &Row::found, &Row::right_tree, &Row::bushes, &Row::right, &Row::alone,
                             &Row::base, &Row::scene_seconds, &Row::seconds})
      result.*value += share * (r.*value);
    result.volume.insert(result.volume.end(), r.volume.begin(), r.volume.end());
    result.alone_volume.insert(result.alone_volume.end(), r.alone_volume.begin(), r.alone_volume.end());
    for (const auto part : {&Row::ground, &Row::wall}) {
      (result.*part).precision += share * (r.*part).precision;
      (result.*part).recall += share * (r.*part).recall;
    }
  }
  return result;
}

void write_scan(const std::string& path, const test::SceneScan& scan) {
  std::string text;
  for (const Vec3& p : scan.points) text += fmt::format("{:.4f} {:.4f} {:.4f}\n", p.x, p.y, p.z);
  write_file(path, text);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::size_t> points{30'000, 120'000}, leaves{0};
  std::array<std::uint64_t, 2> seeds{1, 5};
  std::string folder;
  unsigned threads = 2;
  CLI::App app{"How well scans of several trees are divided: generated scenes."};
  app.add_option("--points", points, "of each scan")->delimiter(',');
  app.add_option("--leaves", leaves, "on each tree")->delimiter(',');
  app.add_option("--seeds", seeds, "the first and the last one")->delimiter(',');
  app.add_option("--write", folder, "write the scans there, as .xyz");
  app.add_option("--threads", threads, "default 2");
  CLI11_PARSE(app, argc, argv);
  try {
    const ThreadLimit limit(threads);
    fmt::print("{}", kHead);
    for (const std::size_t leaf_count : leaves)
      for (const std::size_t count : points) {
        std::vector<Row> rows;
        for (std::uint64_t seed = seeds[0]; seed <= seeds[1]; ++seed) {
          const test::SceneScan scan = test::scan_scene(options_of(count, leaf_count, seed));
          if (!folder.empty()) write_scan(fmt::format("{}/scene_{}_{}_{}.xyz", folder, seed, count, leaf_count), scan);
          TreeOptions options;
          options.scene = true;
          if (leaf_count > 0) options.leaves = TreeLeaves::apart;
          try {
            rows.push_back(measure(scan, options));
          } catch (const Error& error) {
            fmt::print(stderr, "bench_tree_scene: {} points, seed {}: {}\n", count, seed, error.what());
            continue;
          }
          print_row(fmt::format("{}, {} leaves", seed, leaf_count), scan.points.size(), rows.back());
        }
        if (!rows.empty()) print_row(fmt::format("mean, {} leaves", leaf_count), count, mean(rows));
      }
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_tree_scene: {}\n", error.what());
    return 1;
  }
  return 0;
}
