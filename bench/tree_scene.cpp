// scratch
#pragma GCC diagnostic ignored "-Wconversion"
#include <fmt/format.h>
#include <cmath>
#include <cstdlib>
#include "bisector/io.h"
#include "core/stopwatch.h"
#include "support/scene_scan.h"
#include "tree/ground.h"
#include "tree/walls.h"
#include "tree/part_trees.h"
#include <map>
#include <fstream>
using namespace bisector;
int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]).find('.') != std::string::npos) {
    for (int k = 1; k < argc; ++k) {
      const auto points = read_points(argv[k]);
      const Ground g = find_ground(points, {});
      fmt::print("{}: found {} noise {} cell {} ground {} of {}\n", argv[k], g.found, g.noise, g.surface.cell, std::count(g.is_ground.begin(), g.is_ground.end(), 1), points.size());
    }
    return 0;
  }
  if (argc > 1 && std::string(argv[1]) == "part") {
    double sum = 0; int cnt = 0;
    for (std::uint64_t seed = std::atoi(argv[2]); seed <= (std::uint64_t)std::atoi(argv[3]); ++seed)
    for (std::size_t n : {30000, 120000}) for (int ground = 1; ground >= (argc > 4); --ground) {
        const auto scan = test::scan_scene({.trees = 2 + seed % 4, .apart = 3.0 + (seed % 3) * 1.5, .points = n, .ground = ground == 1, .slope = 0.1 * (seed % 4), .bumps = 0.03 + 0.05 * (seed % 3), .wall = seed % 2 == 0, .bushes = 3, .random_seed = seed});
        Stopwatch w;
        const Ground g = find_ground(scan.points, {});
        double tg = w.lap();
        std::vector<Vec3> rest; std::vector<Index> id; double top = 0, lowest = 1e300;
        for (std::size_t i = 0; i < scan.points.size(); ++i) if (!g.is_ground[i]) { rest.push_back(scan.points[i]); id.push_back(i); lowest = std::min(lowest, scan.points[i].z); }
        std::vector<double> h;
        for (auto& p : rest) { h.push_back(p.z - (g.found ? g.surface.at(p.x, p.y) : lowest)); top = std::max(top, h.back()); }
        const Walls walls = find_walls(rest, top);
        double tw = w.lap();
        std::vector<Vec3> pts; std::vector<double> hh; std::vector<Index> id2;
        std::size_t wall_ok = 0, wall_said = 0, wall_true = 0;
        for (std::size_t k = 0; k < rest.size(); ++k) {
          const bool is = scan.kinds[id[k]] == test::ScenePoint::wall;
          wall_ok += is && walls.wall[k] != kNone; wall_said += walls.wall[k] != kNone; wall_true += is;
          if (walls.wall[k] == kNone) { pts.push_back(rest[k]); hh.push_back(h[k]); id2.push_back(id[k]); }
        }
        const PartedTrees parted = part_trees(pts, hh, g.found);
        double tp = w.lap();
        // matching: tree -> true tree by base
        std::map<std::pair<Index, Index>, std::size_t> count; std::size_t trees = 0, lowtree = 0, straytree = 0, bushes = 0, bushtree = 0;
        for (std::size_t k = 0; k < pts.size(); ++k) {
          const Index t = scan.trees[id2[k]];
          if (scan.kinds[id2[k]] == test::ScenePoint::bush) { ++bushes; bushtree += parted.tree[k] != kNone; }
        if (t == kNone) continue;
          ++trees;
          if (parted.tree[k] == kNone) { (parted.low[k] ? lowtree : straytree)++; continue; }
          ++count[{parted.tree[k], t}];
        }
        std::size_t right = 0;
        std::map<Index, std::pair<std::size_t, Index>> best;
        for (auto& [key, c] : count) if (c > best[key.second].first) best[key.second] = {c, key.first};
        for (auto& [t, b] : best) right += b.first;
        std::size_t alltrees = 0; for (Index t : scan.trees) alltrees += t != kNone;
        sum += double(right) / alltrees; ++cnt;
        fmt::print("seed {} n {} ground {} ({}) trees {} found {} right {:.4f} low {} stray {} of {}; bushes {} as tree {}; walls {} P {:.4f} R {:.4f}; s {:.2f} {:.2f} {:.2f}\n", seed, scan.points.size(), ground, g.found, scan.branches.size(), parted.base.size(), double(right) / alltrees, lowtree, straytree, trees, bushes, bushtree, walls.count, wall_said ? double(wall_ok) / wall_said : 1, wall_true ? double(wall_ok) / wall_true : 1, tg, tw, tp);
        std::fflush(stdout);
        if (const char* out = std::getenv("DUMP")) { std::ofstream o(fmt::format("{}/{}_{}_{}.txt", out, seed, n, ground));
          for (std::size_t i = 0; i < scan.points.size(); ++i) o << fmt::format("{:.3f} {:.3f} {:.3f} {} {} {}\n", scan.points[i].x, scan.points[i].y, scan.points[i].z, (int)scan.kinds[i], (int)scan.trees[i], 0);
          std::ofstream p(fmt::format("{}/{}_{}_{}.part", out, seed, n, ground));
          for (std::size_t k = 0; k < pts.size(); ++k) p << fmt::format("{:.3f} {:.3f} {:.3f} {} {} {}\n", pts[k].x, pts[k].y, pts[k].z, (int)parted.tree[k], (int)parted.low[k], (int)scan.trees[id2[k]]);
        }
    }
    fmt::print("mean {:.4f}\n", sum / cnt);
    return 0;
  }
  for (int ground = 1; ground >= 0; --ground)
  for (double slope : {0.0, 0.2, 0.5})
    for (double bumps : {0.02, 0.15})
      for (std::size_t n : {15000, 60000}) 
      for (std::uint64_t seed = 1; seed <= 2; ++seed) {
        const auto scan = test::scan_scene({.trees = 1 + seed, .points = n, .ground = ground == 1, .slope = slope, .bumps = bumps, .wall = seed == 2, .bushes = 3, .random_seed = seed});
        Stopwatch w;
        const Ground g = find_ground(scan.points, {});
        std::size_t both = 0, said = 0, truly = 0, tree = 0, trees = 0, wall = 0, bush = 0;
        for (std::size_t i = 0; i < scan.points.size(); ++i) {
          const bool is = scan.kinds[i] == test::ScenePoint::ground;
          both += is && g.is_ground[i]; said += g.is_ground[i]; truly += is;
          tree += scan.kinds[i] == test::ScenePoint::tree && g.is_ground[i];
          trees += scan.kinds[i] == test::ScenePoint::tree;
          wall += scan.kinds[i] == test::ScenePoint::wall && g.is_ground[i];
          bush += scan.kinds[i] == test::ScenePoint::bush && g.is_ground[i];
        }
        fmt::print("ground {} slope {} bumps {} n {} seed {}: found {} cell {:.3f} noise {:.4f} P {:.4f} R {:.4f} of {} ({}); tree {}/{} wall {} bush {}  {:.2f} s\n", ground, slope, bumps, scan.points.size(), seed, g.found, g.surface.cell, g.noise, said ? double(both) / said : 1, truly ? double(both) / truly : 1, truly, said, tree, trees, wall, bush, w.seconds());
      }
}
