// Seconds per phase of the reconstruction of trees, beside those of the thesis (table 3.1).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "bisector/io.h"
#include "bisector/tree.h"
#include "core/parallel.h"

namespace {

using namespace bisector;

struct ThesisRow {
  const char* model;
  std::size_t points, clusters, branches;
  double segmentation, branching, modelling;
};
constexpr ThesisRow kThesis[]{{"hetre", 34542, 80, 26, 5.94, 0.015, 1.1},
                              {"apple tree", 60126, 356, 96, 26.5, 0.048, 6.6},
                              {"melgueil", 117601, 370, 103, 73.4, 0.078, 9.255},
                              {"walnut", 217187, 1394, 502, 215.2, 1.034, 114.4}};

void print_row(const std::string& model, std::size_t points, std::size_t clusters, std::size_t branches,
               double segmentation, double branching, double modelling) {
  fmt::print("| {} | {} | {} | {} | {:.3g} | {:.3g} | {:.3g} |\n", model, points, clusters, branches, segmentation,
             branching, modelling);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> scans;
  unsigned threads = 2;
  CLI::App app{"Seconds per phase of the reconstruction of trees; the thesis' first."};
  app.add_option("SCANS", scans, "files of points")->required();
  app.add_option("--threads", threads, "default 2");
  CLI11_PARSE(app, argc, argv);
  try {
    const ThreadLimit limit(threads);
    fmt::print(
        "| scan | points | clusters | branches | segmentation s | branching s | modelling s "
        "|\n|---|---|---|---|---|---|---|\n");
    for (const ThesisRow& r : kThesis)
      print_row(fmt::format("{} (thesis)", r.model), r.points, r.clusters, r.branches, r.segmentation, r.branching,
                r.modelling);
    for (const std::string& scan : scans) {
      const std::vector<Vec3> points = read_points(scan);
      const TreeResult tree = reconstruct_tree(points);
      const TreeSeconds& s = tree.seconds;
      print_row(scan, points.size(), tree.clusters, tree.branches.size(), s.graph + s.clusters, s.skeleton + s.refine,
                s.surfaces);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_tree: {}\n", error.what());
    return 1;
  }
  return 0;
}
