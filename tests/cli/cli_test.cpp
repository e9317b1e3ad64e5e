// The program as scripts see it: exit codes, one-line errors, reports, and files that appear whole or not at all.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "bisector/quality.h"
#include "compute/compute.h"
#include "core/geometry.h"
#include "job/cells.h"
#include "job/words.h"
#include "mesh/tet_topology.h"
#include "mesh/topology.h"
#include "support/command_line.h"
#include "support/featured.h"
#include "support/models.h"
#include "support/scene_scan.h"
#include "support/solids.h"
#include "support/tree_model.h"
#include "tetmesh/tetgen.h"
#include "voronoi/clipped.h"

namespace bisector {
namespace {

using test::catches_interrupts;
using test::Cli;
using test::Json;
using test::read_text;
using test::Result;
namespace fs = std::filesystem;

// Without what may differ from run to run.
Json timeless(Json report) {
  report.erase("seconds");
  report.erase("arguments");
  return report;
}

TEST_F(Cli, HelpAndVersion) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{{"--help"},
                                                                                         {"remesh", "--help"},
                                                                                         {"tet", "--help"},
                                                                                         {"rvd", "--help"},
                                                                                         {"segment", "--help"},
                                                                                         {"quality", "-h"},
                                                                                         {"check", "--help"},
                                                                                         {"--version"}}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.code, 0);
    EXPECT_NE(result.out.find(arguments.size() > 1 ? arguments[0] : "isector"), std::string::npos);
    EXPECT_EQ(result.err, "");
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
  }
  const Result bare = run({});
  EXPECT_EQ(bare.code, 2);
  EXPECT_NE(bare.out.find("bisector remesh"), std::string::npos);
}

// What options choose between is listed by the help and by the error for another word.
TEST_F(Cli, HelpListsAllWords) {
  const auto expect_words = [&](const char* command, const char* option, const std::string& list) {
    const std::string help = run({command, "--help"}).out;
    const std::size_t begin = help.find(option);
    ASSERT_NE(begin, std::string::npos) << command << ' ' << option;
    const std::string about = help.substr(begin, help.find("\n  -", begin) - begin);
    std::istringstream words(list);
    for (std::string word; std::getline(words >> std::ws, word, ',');)
      EXPECT_NE(about.find(word), std::string::npos) << command << ' ' << option << ": " << word;
    expect_failure(2, {command, option, "no-such-word"}, "none of " + list);
  };
  for (const char* command : {"remesh", "rvd", "tet"}) {
    expect_words(command, "--precision", job::kPrecisionWords.list());
    expect_words(command, "--neighbors", job::kNeighbourWords.list());
  }
  expect_words("check", "--precision", job::kPrecisionWords.list());
  expect_words("remesh", "--topology", job::kTopologyWords.list());
  expect_words("remesh", "--energy", job::kEnergyWords.list());
  expect_words("remesh", "--detail", job::kDetailWords.list());
  expect_words("segment", "--surfaces", job::kSurfaceWords.list());
  expect_words("segment", "--start", job::kStartWords.list());
  expect_words("tree", "--components", job::kComponentWords.list());
  expect_words("tree", "--leaves", job::kLeafWords.list());
  expect_words("tree", "--unit", job::kUnitWords.list());
}

TEST_F(Cli, HelpListsAllFormats) {
  const auto expect_formats = [&](const char* command, const char* option, const std::vector<std::string>& extensions) {
    const std::string help = run({command, "--help"}).out;
    const std::size_t begin = help.find(option);
    ASSERT_NE(begin, std::string::npos) << command << ' ' << option;
    std::istringstream about(help.substr(begin, help.find("\n  -", begin) - begin));
    std::string words;
    for (std::string word; about >> word;) words += word + ' ';
    EXPECT_NE(words.find(": " + listed(extensions)), std::string::npos) << command << ' ' << words;
  };
  const std::vector<std::string> read = extensions_that(&FileFormat::reads_surfaces),
                                 written = extensions_that(&FileFormat::writes_surfaces);
  for (const char* command : {"remesh", "segment", "rvd", "tet"}) expect_formats(command, "  IN FILE", read);
  expect_formats("quality", "  MESH FILE", read);
  for (const char* command : {"remesh", "segment", "tree"}) expect_formats(command, "  -o FILE", written);
  expect_formats("tet", "  -o FILE", extensions_that(&FileFormat::writes_tets));
  expect_formats("tet", "  --boundary FILE", written);
  expect_formats("segment", "  --polygons FILE", extensions_that(&FileFormat::writes_polygons));
}

TEST_F(Cli, BadUsage) {
  const std::string sphere = in("sphere.off"), out = in("out.obj");
  write_text("points.xyz", "0 0 1\n0 1 0\n1 0 0\n-1 -1 -1\n");
  expect_failure(2, {"frobnicate"}, "frobnicate");
  expect_failure(2, {"remesh"}, "IN");
  expect_failure(2, {"remesh", sphere, "-n", "100"}, "-o");
  expect_failure(2, {"remesh", sphere, "-o", out}, "-n");
  for (const char* n : {"3", "0", "-5", "1e3", "010x", "12.5", "99999999999999999999", ""})
    expect_failure(2, {"remesh", sphere, "-o", out, "-n", n}, "-n");
  expect_failure(2, {"remesh", sphere, "-o", out, "-n"}, "-n");
  expect_failure(2, {"remesh", sphere, "-o", out, "-n", "10", "-n", "11"}, "-n");
  expect_failure(2, {"remesh", sphere, sphere, "-o", out, "-n", "10"}, "sphere.off");
  expect_failure(2, {"remesh", sphere, "-o", out, "-n", "10", "--bogus\nline"}, "bogus");
  for (const char* option : {"--device", "--precision", "--neighbors", "--topology", "--energy", "--iterations",
                             "--tolerance", "--levels", "--random-seed", "--threads"})
    for (const char* value : {"nonsense", "-1", "nan", ""})
      expect_failure(2, {"remesh", sphere, "-o", out, "-n", "10", option, value}, option);
  expect_failure(2, {"remesh", sphere, "-o", out, "--seeds", in("points.xyz"), "--levels", "2"}, "--levels");
  expect_failure(2, {"rvd", sphere}, "--seeds");
  expect_failure(2, {"rvd", sphere, "-n", "0"}, "-n");
  expect_failure(2, {"quality"}, "MESH");
  for (const char* option : {"--device", "--precision"})
    for (const char* value : {"nonsense", "gpu", ""}) expect_failure(2, {"check", option, value}, option);
  for (const char* device : {"vulkan:", "vulkan:x", "vulkan:-1", "cpu:0"})
    expect_failure(2, {"rvd", sphere, "-n", "10", "--device", device}, "vulkan:UUID");
  expect_failure(2, {"check", sphere}, "sphere.off");
}

TEST_F(Cli, BadInputAndOutput) {
  const std::string sphere = in("sphere.off"), out = in("out.obj");
  write_text("broken.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n");
  write_text("flat.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n");
  write_text("two.xyz", "0 0 1\n0 1 0\n");
  expect_failure(1, {"remesh", in("missing.off"), "-o", out, "-n", "10"}, "missing.off");
  expect_failure(1, {"remesh", in("broken.off"), "-o", out, "-n", "10"}, "broken.off:5");
  expect_failure(1, {"remesh", in("flat.off"), "-o", out, "-n", "10", "--quiet"}, "area");
  expect_failure(1, {"remesh", sphere, "-o", out, "--seeds", in("two.xyz")}, "4 seeds");
  expect_failure(1, {"remesh", sphere, "-o", out, "--seeds", in("two.xyz"), "-n", "5"}, "-n");
  for (const char* device : {"vulkan:9999", "vulkan:00000000-0000-0000-0000-00000000dead"}) {
    expect_failure(1, {"remesh", sphere, "-o", out, "-n", "10", "--device", device}, device);
    expect_failure(1, {"rvd", sphere, "-n", "10", "--device", device}, device);
    expect_failure(1, {"check", "--device", device, "--report", in("r.json")}, device);
  }
  expect_failure(1, {"remesh", sphere, "-o", out, "-n", "10", "--device", "cpu", "--precision", "single"},
                 "--precision");
  expect_failure(1, {"rvd", sphere, "-n", "10", "--device", "cpu", "--precision", "single"}, "--precision");
  for (const auto& [length, what] : {std::pair{"1e80", "beyond 1e+40"}, std::pair{"1e-41", "1e-40 or more"}}) {
    const std::string l = length;
    write_text("scaled.off", "OFF\n3 1 0\n0 0 0\n" + l + " 0 0\n0 " + l + " 0\n3 0 1 2\n");
    expect_failure(1, {"rvd", in("scaled.off"), "-n", "10"}, what);
  }
  expect_failure(1, {"check", "--device", "cpu", "--precision", "single"}, "--precision");
  expect_failure(1, {"quality", in("missing.off")}, "missing.off");
  expect_failure(1, {"quality", sphere, "--report", "/dev/full"}, "/dev/full");

  // Found before a run that would take far longer than the test may.
  const std::vector<std::string> forever{"remesh",       sphere,    "-n",          "100000",
                                         "--iterations", "1000000", "--tolerance", "0"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), forever.begin(), forever.end());
    return more;
  };
  expect_failure(1, with({"-o", in("out.xyz")}), "format");
  expect_failure(1, with({"-o", in("out")}), "format");
  expect_failure(1, with({"-o", in("missing/out.obj")}), "missing");
  expect_failure(1, with({"-o", "/proc/out.obj"}), "/proc");
  expect_failure(1, with({"-o", out, "--preview", in("out.jpg")}), "format");
  expect_failure(1, with({"-o", out, "--report", in("missing/r.json")}), "missing");
  expect_failure(1, with({"-o", out, "--report", in("out.obj")}), "two outputs");
  expect_failure(1, with({"-o", out, "--report", in("./sphere.off")}), "input");
  fs::create_directory(in("folder.obj"));
  expect_failure(1, with({"-o", in("folder.obj")}), "directory");
  expect_failure(1, {"rvd", sphere, "-n", "10", "-o", in("cells.obj")}, "format");
}

TEST_F(Cli, RemeshWritesWhatItSays) {
  const Result result = run({"remesh", in("sphere.off"), "-o", in("out.obj"), "-n", "200", "--report", in("r.json"),
                             "--preview", in("out.png"), "--verbose", "--device", "cpu"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("out.obj"), std::string::npos);
  EXPECT_EQ(files(), (std::set<std::string>{"sphere.off", "out.obj", "out.png", "r.json"}));

  const TriangleMesh mesh = read_mesh(in("out.obj"));
  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["command"], "remesh");
  EXPECT_EQ(report["input"]["vertices"], 642);
  EXPECT_EQ(report["input"]["faces"], 1280);
  EXPECT_EQ(report["output"]["vertices"], mesh.vertices.size());
  EXPECT_EQ(report["output"]["faces"], mesh.triangles.size());
  EXPECT_EQ(report["device"]["kind"], "cpu");
  EXPECT_EQ(report["device"]["precision"], "double");
  EXPECT_FALSE(report["device"].contains("fallback"));
  EXPECT_FALSE(report.contains("device_seconds"));
  for (const char* key : {"version", "iterations", "evaluations", "energy", "gradient_norm"})
    EXPECT_TRUE(report.contains(key)) << key;
  for (const char* key : {"total", "delaunay", "neighbors", "pairs", "clip", "lbfgs", "extract", "io"})
    EXPECT_GE(report["seconds"].value(key, -1.0), 0) << key;
  for (const char* key : {"pairs", "uncertain", "wider", "double", "cpu"})
    EXPECT_TRUE(report["certification"].contains(key)) << key;
  for (const char* key : {"q_min", "q_ave", "theta_min", "theta_min_ave", "theta_below_30", "theta_max", "q_min_free",
                          "theta_min_free", "theta_max_free", "theta_below_30_free", "valence6", "distance_mean",
                          "distance_rms", "distance_max", "self_intersections"})
    EXPECT_TRUE(report["quality"].contains(key)) << key;
  EXPECT_EQ(report["topology"]["manifold"], true);
  EXPECT_EQ(report["topology"]["closed"], true);
  EXPECT_EQ(report["topology"]["euler"], 2);
  EXPECT_EQ(report["topology"]["components"], 1);
}

TEST_F(Cli, RemeshMayReplaceItsInput) {
  ASSERT_EQ(run({"remesh", in("sphere.off"), "-o", in("sphere.off"), "-n", "100", "--quiet"}).code, 0);
  EXPECT_LE(read_mesh(in("sphere.off")).vertices.size(), 100u);
  EXPECT_EQ(files(), std::set<std::string>{"sphere.off"});
}

TEST_F(Cli, ReportOnStdoutIsNothingButJson) {
  const std::vector<std::string> remesh{"remesh", in("sphere.off"), "-o", in("out.ply"), "-n", "100", "--report", "-"};
  Result result = run(remesh);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(Json::parse(result.out)["command"], "remesh");
  EXPECT_NE(result.err.find("out.ply"), std::string::npos);
  std::vector<std::string> quiet = remesh;
  quiet.push_back("--quiet");
  result = run(quiet);
  EXPECT_EQ(Json::parse(result.out)["command"], "remesh");
  EXPECT_EQ(result.err, "");
  EXPECT_EQ(report_of({"rvd", in("sphere.off"), "-n", "5", "--report", "-"})["command"], "rvd");
  EXPECT_EQ(report_of({"quality", in("sphere.off"), "--report", "-"})["command"], "quality");
  EXPECT_EQ(report_of({"devices", "--report", "-"})["devices"][0]["kind"], "cpu");
}

// The pieces of cells are closed, turned outward, and have the volumes of their cells.
TEST_F(Cli, CellsOfASolidArePolyhedra) {
  TetMesh mesh = test::shaken(test::tet_box(3), 0.05, 2);
  const std::vector<Vec3> seeds = test::seeds_about(mesh, 40, 0.05, 3);
  const Solid solid(mesh);
  Diagram diagram;
  ClippedVoronoi(solid, SolidCells::clipped).evaluate(seeds, NeighbourSource::nearest, Want::polyhedra, diagram);
  const PolyhedronMesh pieces = job::polyhedra_of(diagram.polyhedra);
  std::vector<double> volumes(seeds.size(), 0);
  for (std::size_t i = 0; i < pieces.polyhedra.rows(); ++i) {
    std::multiset<std::array<Index, 2>> edges;
    double six_volume = 0;
    const Vec3 origin = pieces.vertices[*pieces.faces.begin(*pieces.polyhedra.begin(i))];
    for (const Index* f = pieces.polyhedra.begin(i); f != pieces.polyhedra.end(i); ++f) {
      const Index* corner = pieces.faces.begin(*f);
      const std::size_t n = pieces.faces.size(*f);
      for (std::size_t k = 0; k < n; ++k) edges.insert({corner[k], corner[(k + 1) % n]});
      for (std::size_t k = 2; k < n; ++k)
        six_volume += dot(pieces.vertices[corner[0]] - origin,
                          cross(pieces.vertices[corner[k - 1]] - origin, pieces.vertices[corner[k]] - origin));
    }
    for (const auto& [a, b] : edges) {
      EXPECT_EQ(edges.count({a, b}), 1u);
      EXPECT_EQ(edges.count({b, a}), 1u);
    }
    EXPECT_GE(six_volume, -1e-15);
    volumes[pieces.cells[i]] += six_volume / 6;
  }
  double sum = 0;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NEAR(volumes[i], diagram.moments.cells[i].mass, 1e-14);
    sum += volumes[i];
  }
  EXPECT_NEAR(sum, solid.volume, 1e-13);

  write_tet_mesh(in("solid.vtu"), mesh);
  const Json report = report_of(
      {"rvd", in("solid.vtu"), "-n", "30", "-o", in("cells.vtu"), "--pairs", in("pairs.txt"), "--report", "-"});
  EXPECT_NEAR(report["mass"].get<double>(), solid.volume, 1e-13);
  EXPECT_EQ(report["input"]["tets"], mesh.tets.size());
  EXPECT_FALSE(report["dual_tets"].empty());
  EXPECT_NE(read_text(in("cells.vtu")).find("faceoffsets"), std::string::npos);
  EXPECT_GE(std::ranges::count(read_text(in("pairs.txt")), '\n'), static_cast<long>(mesh.tets.size()));
  EXPECT_EQ(run({"rvd", in("solid.vtu"), "-n", "30", "-o", in("cells.ply"), "--report", in("cells.html")}).code, 0);
  expect_failure(1, {"rvd", in("sphere.off"), "-n", "10", "-o", in("cells.vtu")}, "cells on a surface are polygons");
}

// A vertex far off that no face uses, as exports leave them, is no part of the model: lengths in diagonals and what
// counts as rounding do not follow it.
TEST_F(Cli, UnusedVerticesDoNotMakeAModelLarger) {
  TriangleMesh mesh = test::torn(test::box(6), 1e-7);
  write_mesh(in("plain.ply"), mesh);
  mesh.vertices.push_back({3e6, -2e6, 1e6});
  write_mesh(in("stray.ply"), mesh);
  const std::vector<std::vector<std::string>> commands{
      {"remesh", "--edge-length-relative", "0.06"},
      {"remesh", "-n", "400", "--density", "curvature", "--distance-max-relative", "0.01"},
      {"remesh", "-n", "200", "--wrap"},
      {"segment", "--error", "0.1"},
      {"rvd", "-n", "200"}};
  for (const std::vector<std::string>& words : commands) {
    std::vector<std::string> bytes;
    std::vector<Json> reports;
    for (const char* name : {"plain.ply", "stray.ply"}) {
      std::vector<std::string> arguments = words;
      arguments.insert(arguments.begin() + 1, in(name));
      arguments.insert(arguments.end(), {"-o", in("out.ply"), "--report", "-"});
      Json report = timeless(report_of(arguments));
      for (const char* key : {"input", "output", "warnings"}) report.erase(key);
      reports.push_back(std::move(report));
      bytes.push_back(read_text(in("out.ply")));
    }
    EXPECT_TRUE(reports[0] == reports[1]) << words[0] << ' ' << words[1] << Json::diff(reports[0], reports[1]);
    // Segmenting keeps the vertices of the input.
    const bool same = words[0] == "segment" || bytes[0] == bytes[1];
    EXPECT_TRUE(same) << words[0] << ' ' << words[1];
  }
}

// Not octal ones, as C has them.
TEST_F(Cli, WholeNumbersAreDecimal) {
  EXPECT_EQ(run({"remesh", in("sphere.off"), "-n", "0060", "-o", in("out.off")}).code, 0);
  EXPECT_EQ(read_mesh(in("out.off")).vertices.size(), 60u);
  EXPECT_EQ(run({"remesh", in("sphere.off"), "-n", "089", "-o", in("out.off"), "--random-seed", "08"}).code, 0);
  EXPECT_EQ(read_mesh(in("out.off")).vertices.size(), 89u);
  expect_failure(2, {"remesh", in("sphere.off"), "-n", "0x60", "-o", in("none.off")}, "whole number");
  expect_failure(1, {"remesh", in("sphere.off"), "-n", "60", "-o", in("one.off"), "--map", in("./one.off")},
                 "two outputs have this name");
}

TEST_F(Cli, SurfacesWithoutWidth) {
  const auto needle = [&](const char* height) {
    write_text("needle.off", std::string("OFF\n3 1 0\n0 0 0\n1 0 0\n0.5 ") + height + " 0\n3 0 1 2\n");
  };
  for (const char* height : {"1e-300", "1e-200"}) {
    needle(height);
    for (const std::vector<std::string>& words : {std::vector<std::string>{"remesh", "-n", "20"},
                                                  {"remesh", "-n", "20", "--wrap"},
                                                  {"rvd", "-n", "20"},
                                                  {"segment", "--proxies", "1"},
                                                  {"tet", "-n", "20", "--wrap"}}) {
      std::vector<std::string> arguments = words;
      arguments.insert(arguments.begin() + 1, {in("needle.off"), "-o", in(words[0] == "tet" ? "out.mesh" : "out.ply")});
      expect_failure(1, arguments, "needle.off: no triangle has an area");
    }
  }
  for (const char* height : {"1e-140", "1e-40", "1e-12"}) {
    needle(height);
    expect_failure(1, {"remesh", in("needle.off"), "-n", "20", "-o", in("out.off")}, "too narrow for triangles");
    EXPECT_EQ(run({"rvd", in("needle.off"), "-n", "20"}).code, 0) << height;
    EXPECT_EQ(run({"remesh", in("needle.off"), "-n", "50", "-o", in("out.off"), "--wrap"}).code, 0) << height;
    fs::remove(in("out.off"));
  }
  needle("1e-7");
  expect_failure(1, {"remesh", in("needle.off"), "-n", "20", "-o", in("out.off")}, "ask for some 23000000");
}

TEST_F(Cli, OutputDoesNotDependOnThreads) {
  std::vector<std::string> meshes, pictures;
  std::vector<Json> reports, diagrams;
  for (const char* threads : {"1", "2"}) {
    reports.push_back(timeless(report_of({"remesh", in("sphere.off"), "-o", in("out.off"), "-n", "300", "--threads",
                                          threads, "--report", "-", "--preview", in("out.png")})));
    meshes.push_back(read_text(in("out.off")));
    pictures.push_back(read_text(in("out.png")));
    diagrams.push_back(timeless(report_of({"rvd", in("sphere.off"), "-n", "300", "-o", in("cells.ply"), "--pairs",
                                           in("pairs"), "--threads", threads, "--report", "-"})));
    meshes.back() += read_text(in("cells.ply")) + read_text(in("pairs"));
  }
  EXPECT_EQ(reports[0], reports[1]);
  EXPECT_EQ(diagrams[0], diagrams[1]);
  EXPECT_TRUE(meshes[0] == meshes[1]);
  EXPECT_TRUE(pictures[0] == pictures[1]);
}

TEST_F(Cli, RandomSeedChoosesTheStart) {
  const auto energy = [&](const char* seed) {
    return report_of({"remesh", in("sphere.off"), "-o", in("out.off"), "-n", "50", "--random-seed", seed,
                      "--iterations", "2", "--report", "-"})["energy"]
        .get<double>();
  };
  EXPECT_EQ(energy("1"), energy("1"));
  EXPECT_NE(energy("1"), energy("2"));
}

TEST_F(Cli, SeedsFromAFileStayWithoutIterations) {
  write_text("tips.xyz", "1 0 0\n-1 0 0 # a comment\n0 1 0\n0 -1 0\n0 0 1\n0 0 -1\n");
  const Json report = report_of({"remesh", in("sphere.off"), "-o", in("out.off"), "--seeds", in("tips.xyz"),
                                 "--iterations", "0", "--report", "-"});
  EXPECT_EQ(report["output"]["vertices"], 6);
  EXPECT_EQ(report["output"]["faces"], 8);
}

TEST_F(Cli, DiagramOfACube) {
  // Quadrilaterals: pairs are counted by the file's faces.
  write_text("cube.off",
             "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
             "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  write_text("seeds.xyz", "0.5 0.5 -1\n0.5 0.5 2\n0.5 0.5 2\n0.5 -1 0.5\n");
  for (const char* source : {"nearest", "delaunay", "auto"}) {
    const Json report = report_of({"rvd", in("cube.off"), "--seeds", in("seeds.xyz"), "--pairs", in("pairs"),
                                   "--neighbors", source, "--quiet", "--report", "-", "-o", in("cells.ply")});
    EXPECT_EQ(report["input"]["faces"], 6);
    EXPECT_EQ(report["untiled"], 0);
    ASSERT_EQ(report["cells"].size(), 4u);
    EXPECT_EQ(report["cells"][2]["mass"], 0);
    EXPECT_TRUE(report["cells"][2]["centroid"].is_null());
    double mass = 0, energy = 0;
    for (const Json& cell : report["cells"]) {
      mass += cell["mass"].get<double>();
      energy += cell["energy"].get<double>();
    }
    EXPECT_NEAR(mass, 6, 1e-12);
    EXPECT_NEAR(energy, report["energy"].get<double>(), 1e-12 * energy);
    const auto rdt = report["rdt"].get<std::vector<std::array<int, 3>>>();
    for (std::size_t k = 0; k < rdt.size(); ++k) {
      EXPECT_TRUE(rdt[k][0] < rdt[k][1] && rdt[k][1] < rdt[k][2]);
      if (k) {
        EXPECT_LT(rdt[k - 1], rdt[k]);
      }
    }

    std::istringstream lines(read_text(in("pairs")));
    std::vector<std::pair<int, int>> pairs;
    for (int face, seed; lines >> face >> seed;) pairs.emplace_back(face, seed);
    EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
    EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
    std::set<int> faces;
    for (const auto& [face, seed] : pairs) {
      faces.insert(face);
      EXPECT_NE(seed, 2);
    }
    EXPECT_EQ(faces, (std::set<int>{0, 1, 2, 3, 4, 5}));
    EXPECT_EQ(std::count(pairs.begin(), pairs.end(), std::pair(0, 0)), 1);
    EXPECT_EQ(std::count(pairs.begin(), pairs.end(), std::pair(1, 1)), 1);
    EXPECT_EQ(std::count(pairs.begin(), pairs.end(), std::pair(2, 3)), 1);
    EXPECT_EQ(read_mesh(in("cells.ply")).vertices.empty(), false);
  }
}

TEST_F(Cli, QualityMeasuresDistance) {
  write_mesh(in("fine.off"), test::icosphere(4));
  const Json report = report_of({"quality", in("sphere.off"), "--reference", in("fine.off"), "--report", "-"});
  EXPECT_GT(report["quality"]["distance_rms"].get<double>(), 0);
  EXPECT_LT(report["quality"]["distance_max"].get<double>(), 1);
  EXPECT_EQ(report["quality"]["self_intersections"], 0);
  EXPECT_EQ(report["topology"]["euler"], 2);
  const Result table = run({"quality", in("sphere.off")});
  EXPECT_NE(table.out.find("q_min"), std::string::npos);
  EXPECT_NE(table.out.find("self_intersections"), std::string::npos);
}

TEST_F(Cli, QualityMeasuresTetrahedra) {
  // The cube's corner tetrahedra and the regular one between them, in two regions.
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
  mesh.tets = {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}};
  mesh.regions = {1, 1, 1, 1, 2};
  write_tet_mesh(in("cube.msh"), mesh);
  const Json report = report_of({"quality", in("cube.msh"), "--reference", in("cube.msh"), "--report", "-"});
  EXPECT_EQ(report["input"]["tets"], 5);
  EXPECT_EQ(report["reference"]["tets"], 5);
  const Json& quality = report["quality"];
  EXPECT_NEAR(quality["volume"].get<double>(), 1, 1e-14);
  EXPECT_NEAR(quality["area"].get<double>(), 6, 1e-14);
  EXPECT_NEAR(quality["dihedral_max"].get<double>(), 90, 1e-12);
  EXPECT_NEAR(quality["dihedral_min"].get<double>(), std::atan(std::sqrt(2)) * 45 / std::atan(1.0), 1e-12);
  EXPECT_NEAR(quality["theta_min"].get<double>(), 45, 1e-12);
  EXPECT_EQ(quality["inverted"], 0);
  EXPECT_EQ(quality["distance_max"], 0);
  EXPECT_EQ(report["topology"]["conforming"], true);
  EXPECT_EQ(report["topology"]["euler"], 2);
  const Result table = run({"quality", in("cube.msh")});
  EXPECT_EQ(table.code, 0) << table.err;
  EXPECT_NE(table.out.find("radius_ratio_min"), std::string::npos);
  // Triangles alone are a surface.
  mesh.boundary = boundary_facets(mesh.tets);
  mesh.tets.clear();
  mesh.regions.clear();
  write_tet_mesh(in("shell.mesh"), mesh);
  const Json shell = report_of({"quality", in("shell.mesh"), "--report", "-"});
  EXPECT_FALSE(shell["input"].contains("tets") || shell["quality"].contains("volume"));
  EXPECT_NEAR(shell["quality"]["area"].get<double>(), 6, 1e-14);
  expect_failure(1, {"quality", in("missing.msh")}, "missing.msh");
}

TEST_F(Cli, DevicesAreListed) {
  const DeviceList list = list_devices();
  const Json report = report_of({"devices", "--report", "-"});
  ASSERT_EQ(report["devices"].size(), 1 + list.devices.size());
  EXPECT_EQ(report["warnings"], Json::array());
  EXPECT_EQ(report["devices"][0]["kind"], "cpu");
  EXPECT_GE(report["devices"][0]["threads"].get<int>(), 1);
  const std::string table = run({"devices"}).out;
  EXPECT_TRUE(table.starts_with("cpu ")) << table;
  if (list.devices.empty()) {
    EXPECT_EQ(report["problem"], list.problem);
    EXPECT_NE(table.find(list.problem), std::string::npos) << table;
  }
  for (std::size_t k = 0; k < list.devices.size(); ++k) {
    const DeviceDescription& device = list.devices[k];
    const Json& entry = report["devices"][k + 1];
    EXPECT_EQ(entry["index"], device.index);
    EXPECT_EQ(entry["uuid"], device.uuid);
    EXPECT_EQ(entry["name"], device.name);
    EXPECT_EQ(entry["kind"], device.kind);
    EXPECT_EQ(entry["precision"], device.float64 ? "double" : "single");
    EXPECT_EQ(entry["features"].get<std::vector<std::string>>(), device.features);
    EXPECT_EQ(entry.value("rejected", ""), device.rejected);
    for (const char* key : {"driver", "api", "memory"}) EXPECT_TRUE(entry.contains(key)) << key;
    EXPECT_NE(table.find("vulkan:" + std::to_string(device.index)), std::string::npos) << table;
    EXPECT_NE(table.find(device.uuid), std::string::npos) << table;
    EXPECT_NE(table.find(device.rejected), std::string::npos) << table;
  }
}

TEST_F(Cli, CheckOfTheCpuAgainstItself) {
  const Result result = run({"check", "--device", "cpu", "--report", in("r.json")});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("passed"), std::string::npos) << result.out;
  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["command"], "check");
  EXPECT_EQ(report["warnings"], Json::array());
  EXPECT_EQ(report["device"]["kind"], "cpu");
  EXPECT_EQ(report["passed"], true);
  ASSERT_FALSE(report["rows"].empty());
  for (const Json& row : report["rows"]) {
    for (const char* key : {"passed", "same_pairs", "same_labels", "same_dual", "bitwise", "repeats"})
      EXPECT_EQ(row[key], true) << row;
    for (const char* key : {"mass_error", "centroid_error", "energy_error"}) EXPECT_EQ(row[key], 0.0) << row;
    EXPECT_LE(row["sum_error"].get<double>(), 1e-12) << row;
    EXPECT_GT(row["certification"]["pairs"].get<int>(), 0) << row;
  }
}

TEST_F(Cli, CheckWithoutAGpuSaysSo) {
  if (best_gpu(list_devices())) GTEST_SKIP() << "there is a GPU";
  expect_failure(1, {"check"}, "no GPU");
}

TEST_F(Cli, AutomaticDeviceIsTheCpuWithoutAGpu) {
  if (best_gpu(list_devices())) GTEST_SKIP() << "there is a GPU";
  const Json report = report_of({"rvd", in("sphere.off"), "-n", "50", "--report", "-"});
  EXPECT_EQ(report["device"]["kind"], "cpu");
  EXPECT_FALSE(report["device"].contains("fallback"));
  expect_failure(1, {"rvd", in("sphere.off"), "-n", "50", "--precision", "single"}, "--precision");
}

// --- options of remesh ---

class CliRemesh : public Cli {
 protected:
  // A unit square with a value rho(x) at each vertex.
  void write_square(const std::string& name, const std::function<double(double)>& rho) const {
    constexpr int n = 16;
    std::ostringstream text;
    text.precision(17);
    text << "ply\nformat ascii 1.0\nelement vertex " << (n + 1) * (n + 1)
         << "\nproperty double x\nproperty double y\nproperty double z\nproperty double rho\nelement face " << 2 * n * n
         << "\nproperty list uchar int vertex_indices\nend_header\n";
    const TriangleMesh patch = test::grid_patch(n, n);
    for (const Vec3& p : patch.vertices) text << p.x / n << ' ' << p.y / n << " 0 " << rho(p.x / n) << '\n';
    for (const Triangle& t : patch.triangles) text << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
    write_text(name, text.str());
  }

  // Report of a run on `input` with more options; the result is in `output`.
  Json remesh(const std::string& input, std::vector<std::string> more, const std::string& output = "out.ply") const {
    more.insert(more.begin(), {"remesh", in(input), "-o", in(output), "--quiet", "--report", "-"});
    return report_of(more);
  }

  TriangleMesh output(const std::string& name = "out.ply") const { return read_mesh(in(name)); }
};

// A plate too thin for its edges: its walls' curves are merged, or have the vertices that they take, or are left.
TEST_F(CliRemesh, DetailsAreMergedOrResolved) {
  write_mesh(in("plate.off"), test::prism({{0, 0}, {1, 0}, {1, 0.02}, {0, 0.02}}));
  const auto remeshed = [&](const char* detail) { return remesh("plate.off", {"-n", "200", "--detail", detail}); };
  const Json merged = remeshed("auto"), all = remeshed("all"), off = remeshed("off");
  EXPECT_GT(merged["detail"]["merged"], 0);
  EXPECT_LT(merged["detail"]["resolved"], 12);
  EXPECT_GT(merged["detail"]["width"], 0.02);
  EXPECT_GT(merged["detail"]["vertices"], 200);
  EXPECT_EQ(merged["output"]["vertices"], 200);
  EXPECT_EQ(all["detail"]["merged"], 0);
  EXPECT_EQ(all["features"]["curves"], 12);
  EXPECT_GT(all["output"]["vertices"], 200);
  EXPECT_EQ(off["features"]["curves"], 12);
  EXPECT_EQ(off["detail"]["width"], 0);
  EXPECT_LT(merged["quality"]["theta_below_30"], 0.5 * off["quality"]["theta_below_30"].get<double>());
}

double length(const TriangleMesh& mesh, const std::array<Index, 2>& e) {
  return norm(mesh.vertices[e[1]] - mesh.vertices[e[0]]);
}

std::set<std::array<Index, 2>> edges_of(const TriangleMesh& mesh) {
  std::set<std::array<Index, 2>> edges;
  for (const Triangle& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  return edges;
}

// Mean length of the edges whose middle has an x of that range.
double mean_edge(const TriangleMesh& mesh, double from, double to) {
  double sum = 0;
  int count = 0;
  for (const auto& e : edges_of(mesh)) {
    const double x = 0.5 * (mesh.vertices[e[0]].x + mesh.vertices[e[1]].x);
    if (x < from || x > to) continue;
    sum += length(mesh, e);
    ++count;
  }
  return sum / count;
}

std::map<int, double> area_of_labels(const TriangleMesh& mesh) {
  std::map<int, double> area;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto [a, b, c] = mesh.triangles[t];
    area[mesh.labels[t]] += 0.5 * norm(cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]));
  }
  return area;
}

TEST_F(CliRemesh, WhatAMeditFileRequiresStays) {
  const TriangleMesh ball = test::icosphere(3);
  write_mesh(in("ball.mesh"), ball);
  std::string text = read_text(in("ball.mesh"));
  text.erase(text.rfind("End"));
  write_text("ball.mesh", text + "RequiredVertices\n2\n5\n300\nRequiredTriangles\n2\n1\n2\nEnd\n");
  const Json report =
      report_of({"remesh", in("ball.mesh"), "-o", in("out.off"), "-n", "200", "--quiet", "--report", "-"});
  EXPECT_EQ(report["kept"]["faces"], 2);
  const std::vector<Vec3> found = read_mesh(in("out.off")).vertices;
  std::set<Index> kept{4, 299};
  for (const std::size_t t : {0u, 1u}) kept.insert(ball.triangles[t].begin(), ball.triangles[t].end());
  for (const Index v : kept) EXPECT_NE(std::find(found.begin(), found.end(), ball.vertices[v]), found.end()) << v;
}

TEST_F(CliRemesh, DistanceIsBounded) {
  const std::vector<std::string> run = {"remesh", in("sphere.off"), "-o", in("out.off"), "-n", "60", "--report", "-"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), run.begin(), run.end());
    more.push_back("--quiet");
    return report_of(more);
  };
  EXPECT_FALSE(with({}).contains("distance"));
  const Json reached = with({"--distance-max", "0.03"})["distance"];
  EXPECT_EQ(reached["wanted"], 0.03);
  EXPECT_LE(reached["lower"], reached["upper"]);
  EXPECT_LE(reached["upper"], 0.03);
  EXPECT_EQ(reached["vertices_max"], 600);
  EXPECT_GT(reached["runs"], 0);
  const Json missed = with({"--distance-max-relative", "1e-5", "--vertices-max", "80"});
  EXPECT_GT(missed["distance"]["upper"], missed["distance"]["wanted"]);
  ASSERT_EQ(missed["warnings"].size(), 1u);
  EXPECT_NE(missed["warnings"][0].get<std::string>().find("--vertices-max"), std::string::npos);
}

TEST_F(CliRemesh, OptionsThatContradictEachOther) {
  write_text("points.xyz", "1 0 0\n-1 0 0\n0 1 0\n0 -1 0\n0 0 1\n0 0 -1\n");
  const auto refused = [&](std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), {"remesh", in("sphere.off"), "-o", in("out.obj")});
    expect_failure(2, more, part);
  };
  for (const char* option : {"--edge-length", "--edge-length-relative"}) {
    refused({"-n", "100", option, "0.1"}, option);
    refused({"--seeds", in("points.xyz"), option, "0.1"}, option);
  }
  refused({"--edge-length", "0.1", "--edge-length-relative", "0.1"}, "--edge-length-relative");
  for (const char* option : {"--distance-max", "--distance-max-relative"}) {
    refused({"--seeds", in("points.xyz"), option, "0.1"}, option);
    refused({"-n", "100", option, "-1"}, option);
  }
  refused({"-n", "100", "--distance-max", "0.1", "--distance-max-relative", "0.1"}, "--distance-max-relative");
  refused({"-n", "100", "--vertices-max", "200"}, "--vertices-max");
  refused({"-n", "100", "--distance-max", "0.1", "--vertices-max", "50"}, "--vertices-max");
  for (const char* option : {"--gradation", "--edge-min", "--edge-max"}) {
    refused({"-n", "100", option, "0.1"}, option);
    refused({"-n", "100", "--density", "uniform", option, "0.1"}, option);
  }
  for (const char* option : {"--edge-min", "--edge-max"})
    refused({"--seeds", in("points.xyz"), "--density", "lfs", option, "0.1"}, option);
  refused({"--seeds", in("points.xyz"), "--random-seed", "2"}, "--random-seed");
  refused({"--seeds", in("points.xyz"), "--detail", "off"}, "--detail");
  expect_failure(2, {"rvd", in("sphere.off"), "--seeds", in("points.xyz"), "--random-seed", "2"}, "--random-seed");
  refused({"-n", "100", "--density", "lfs", "--edge-min", "0.2", "--edge-max", "0.1"}, "--edge-min");
  refused({"--edge-length", "0.1", "--density", "lfs", "--edge-min", "0.2"}, "--edge-min");
  refused({"--edge-length", "0.3", "--density", "lfs", "--edge-max", "0.2"}, "--edge-max");
  refused({"-n", "100", "--energy", "rcvt", "--min-angle", "30"}, "--min-angle");
}

TEST_F(CliRemesh, ValuesOutOfRange) {
  const auto refused = [&](const char* option, const std::vector<const char*>& values) {
    for (const char* value : values) {
      std::vector<std::string> words{"remesh", in("sphere.off"), "-o", in("out.obj"), option, value};
      if (!std::string(option).starts_with("--edge-length")) words.insert(words.end(), {"-n", "100"});
      expect_failure(2, words, option);
    }
  };
  for (const char* option : {"--edge-length", "--edge-length-relative", "--edge-min", "--edge-max"})
    refused(option, {"0", "-1", "inf", "nan", "1mm", ""});
  refused("--gradation", {"-0.1", "10", "inf", "nan", "x", ""});
  refused("--min-angle", {"-1", "60", "nan", "x", ""});
  refused("--weld", {"-1", "inf", "nan", "x", ""});
  refused("--features", {"0", "180", "-30", "nan", "all", "30deg", ""});
  refused("--density",
          {"size", "lfs:", "lfs:0", "lfs:9", "lfs:nan", "curvature:x", "uniform:2", "attribute", "attribute:", ""});
  for (const char* option : {"--feature-file", "--feature-output"}) refused(option, {""});
}

TEST_F(CliRemesh, WhatTheInputDoesNotAllow) {
  write_square("square.ply", [](double) { return 1.0; });
  write_square("zero.ply", [](double x) { return x; });
  write_text("far.txt", "# two corners\n0 1\n0 1000000\n");
  write_text("chord.txt", "\n0 1\n  0 288\n");
  write_text("half.txt", "0\n");
  const auto refused = [&](const char* input, std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), {"remesh", in(input), "-o", in("out.ply")});
    expect_failure(1, more, part);
  };
  refused("square.ply", {"-n", "100", "--density", "attribute:size"}, "one of x, y, z, rho");
  refused("sphere.off", {"-n", "100", "--density", "attribute:rho"}, ".ply");
  refused("zero.ply", {"-n", "100", "--density", "attribute:rho"}, "vertex 0");
  for (const char* option : {"--keep-vertices", "--keep-faces"}) {
    refused("square.ply", {"-n", "100", option, in("missing.txt")}, "missing.txt");
    refused("square.ply", {"-n", "100", option, in("far.txt")}, "far.txt:3");
  }
  refused("square.ply", {"-n", "100", "--feature-file", in("missing.txt")}, "missing.txt");
  refused("square.ply", {"-n", "100", "--feature-file", in("far.txt")}, "far.txt:3");
  refused("square.ply", {"-n", "100", "--feature-file", in("chord.txt")}, "chord.txt:3");
  refused("square.ply", {"-n", "100", "--feature-file", in("half.txt")}, "half.txt:1");
  // Bounds that no mesh of so many vertices meets, and lengths that no mesh has.
  refused("square.ply", {"-n", "100", "--density", "curvature", "--edge-min", "0.5"}, "100 vertices");
  refused("square.ply", {"-n", "100", "--density", "curvature", "--edge-max", "0.01"}, "100 vertices");
  refused("square.ply", {"--edge-length-relative", "3"}, "fewer than 4");
  for (const char* tiny : {"1e-5", "1e-12", "1e-300"}) {
    refused("square.ply", {"--edge-length", tiny}, "longer");
    refused("square.ply", {"--edge-length", tiny, "--density", "attribute:rho"}, "longer");
  }

  // Outputs, found before a run that would take far longer than the test may.
  const std::vector<std::string> forever{"-n", "100000", "--iterations", "1000000", "--tolerance", "0"};
  const auto late = [&](std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), forever.begin(), forever.end());
    more.insert(more.begin(), {"remesh", in("square.ply")});
    expect_failure(1, more, part);
  };
  late({"-o", "-"}, "stdout");
  late({"-o", in("out.ply"), "--preview", "-"}, "stdout");
  late({"-o", in("out.ply"), "--feature-output", "-"}, "stdout");
  late({"-o", in("out.ply"), "--feature-output", in("out.ply")}, "two outputs");
  late({"-o", in("out.ply"), "--feature-output", in("missing/f.txt")}, "missing");
  write_text("given.txt", "0 1\n");
  late({"-o", in("out.ply"), "--feature-file", in("given.txt"), "--feature-output", in("given.txt")}, "input");
}

TEST_F(CliRemesh, FeaturesOfABoxGoThroughAFile) {
  write_mesh(in("box.off"), test::box(2));
  const Json first =
      remesh("box.off", {"-n", "150", "--features", "30", "--feature-output", in("edges.txt")}, "out.off");
  EXPECT_EQ(first["features"]["curves"], 12);
  EXPECT_EQ(first["features"]["corners"], 8);
  EXPECT_EQ(first["features"]["broken"], 0);
  EXPECT_LT(first["features"]["distance_max"].get<double>(), 1e-9);
  const TriangleMesh mesh = output("out.off");
  const auto edges = read_feature_edges(in("edges.txt"), mesh);
  EXPECT_EQ(edges.size(), first["features"]["edges"]);
  double total = 0;
  for (const auto& e : edges) total += length(mesh, e);
  EXPECT_NEAR(total, 12, 1e-9);

  // An OFF file holds no feature edges: without the file there are none, with it they are those of the box.
  const Json none = remesh("out.off", {"-n", "150", "--features", "none"});
  EXPECT_EQ(none["features"]["curves"], 0);
  const Json again = remesh("out.off", {"-n", "200", "--features", "none", "--feature-file", in("edges.txt")});
  for (const char* key : {"curves", "corners", "broken"})
    EXPECT_EQ(again["features"][key], first["features"][key]) << key;
  double length_again = 0;
  const TriangleMesh mesh_again = output();
  for (const auto& e : mesh_again.feature_edges) length_again += length(mesh_again, e);
  EXPECT_NEAR(length_again, 12, 1e-9);
  EXPECT_NEAR(again["quality"]["area"].get<double>(), 6, 1e-9);
}

TEST_F(CliRemesh, FeaturesByAngle) {
  write_mesh(in("box.off"), test::box(2));
  const auto curves = [&](const char* features) {
    return remesh("box.off", {"-n", "100", "--iterations", "10", "--features", features})["features"]["curves"];
  };
  EXPECT_EQ(curves("89"), 12);
  EXPECT_EQ(curves("91"), 0);
  EXPECT_EQ(curves("auto"), 12);
  EXPECT_EQ(curves("none"), 0);
}

TEST_F(CliRemesh, EdgesFollowAnAttribute) {
  // Edges as long as rho^(-1/4), here (1 + x)^2.
  write_square("square.ply", [](double x) { return std::pow(1 + x, -8); });
  const auto lengths = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"-n", "400", "--density", "attribute:rho"});
    EXPECT_NEAR(remesh("square.ply", more)["output"]["vertices"].get<double>(), 400, 4);
    const TriangleMesh mesh = output();
    return std::array{mean_edge(mesh, 0, 0.25), mean_edge(mesh, 0.25, 0.75), mean_edge(mesh, 0.75, 1)};
  };
  const auto [fine, middle, coarse] = lengths({"--gradation", "0"});
  // Means over the ranges, edges being as dense as 1 / h^2.
  const auto mean = [](double a, double b) {
    return 3 * (1 / (1 + a) - 1 / (1 + b)) / (std::pow(1 + a, -3) - std::pow(1 + b, -3));
  };
  EXPECT_NEAR(coarse / fine, mean(0.75, 1) / mean(0, 0.25), 0.1 * coarse / fine);
  EXPECT_NEAR(middle / fine, mean(0.25, 0.75) / mean(0, 0.25), 0.1 * middle / fine);

  // |h(x) - h(y)| <= 0.03 |x - y|, the middles of the ranges being 0.75 apart.
  const auto slow = lengths({"--gradation", "0.03"});
  EXPECT_LT(slow[2] - slow[0], 0.03 * 0.75 + 0.05 * slow[2]);
  EXPECT_GT(slow[2] - slow[0], 0);

  ASSERT_LT(fine, 0.042);
  const auto no_shorter = lengths({"--gradation", "0", "--edge-min", "0.045"});
  EXPECT_NEAR(no_shorter[0], 0.045, 0.05 * 0.045);
  ASSERT_GT(coarse, 0.08);
  const auto no_longer = lengths({"--gradation", "0", "--edge-max", "0.07"});
  EXPECT_NEAR(no_longer[2], 0.07, 0.05 * 0.07);
}

TEST_F(CliRemesh, DensityFollowsTheShape) {
  // An ellipsoid of radii 3, 1 and 1: at its tips the curvature is 3 and the local feature size 1/3, about its waist
  // both are 1.
  TriangleMesh ellipsoid = test::icosphere(4);
  for (Vec3& v : ellipsoid.vertices) v.x *= 3;
  write_mesh(in("ellipsoid.off"), ellipsoid);
  const auto tip_by_waist = [&](const char* density) {
    std::vector<std::string> words{"-n", "500", "--iterations", "50", "--density", density};
    if (words.back() != "uniform") words.insert(words.end(), {"--gradation", "0"});
    remesh("ellipsoid.off", words);
    const TriangleMesh mesh = output();
    return mean_edge(mesh, 2.5, 3) / mean_edge(mesh, -1, 1);
  };
  EXPECT_NEAR(tip_by_waist("uniform"), 1, 0.1);
  const double lfs = tip_by_waist("lfs"), lfs4 = tip_by_waist("lfs:4"), curvature = tip_by_waist("curvature"),
               curvature3 = tip_by_waist("curvature:3");
  EXPECT_LT(lfs, 0.85);
  EXPECT_LT(lfs4, 0.9 * lfs);
  EXPECT_LT(curvature, 0.92);
  EXPECT_LT(curvature3, 0.9 * curvature);
}

TEST_F(CliRemesh, EdgeLengthInsteadOfACount) {
  const Json report = remesh("sphere.off", {"--edge-length", "0.2"});
  EXPECT_EQ(report["sizing"]["edge_length"], 0.2);
  EXPECT_EQ(report["sizing"]["wanted"], report["output"]["vertices"]);
  EXPECT_NEAR(report["quality"]["edge_ave"].get<double>(), 0.2, 0.05 * 0.2);
  const double share = 0.2 / bounding_box(read_mesh(in("sphere.off")).vertices).diagonal();
  const Json relative = remesh("sphere.off", {"--edge-length-relative", std::to_string(share)});
  EXPECT_NEAR(relative["sizing"]["edge_length"].get<double>(), 0.2, 1e-4);
  EXPECT_NEAR(relative["output"]["vertices"].get<double>(), report["output"]["vertices"].get<double>(), 2);
}

TEST_F(CliRemesh, LabelsStay) {
  TriangleMesh plane = test::grid_patch(8, 8);
  for (const Triangle& t : plane.triangles)
    plane.labels.push_back((plane.vertices[t[0]].x + plane.vertices[t[1]].x + plane.vertices[t[2]].x) / 3 < 3 ? 7 : -2);
  const std::map<int, double> areas{{7, 24}, {-2, 40}};
  ASSERT_EQ(area_of_labels(plane), areas);
  for (const char* name : {"plane.ply", "plane.obj"}) {
    write_mesh(in(name), plane);
    for (const char* out : {"out.ply", "out.obj"}) {
      EXPECT_EQ(remesh(name, {"-n", "120", "--feature-output", in("edges.txt")}, out)["features"]["broken"], 0);
      const TriangleMesh mesh = output(out);
      ASSERT_EQ(mesh.labels.size(), mesh.triangles.size()) << out;
      const auto found = area_of_labels(mesh);
      ASSERT_EQ(found.size(), 2u);
      for (const auto& [label, area] : areas) EXPECT_NEAR(found.at(label), area, 1e-9) << name << ' ' << out;
      // The square's four sides, and the line between the labels.
      double between = 0, total = 0;
      for (const auto& e : mesh.feature_edges) {
        total += length(mesh, e);
        if (std::abs(mesh.vertices[e[0]].x - 3) < 1e-9 && std::abs(mesh.vertices[e[1]].x - 3) < 1e-9)
          between += length(mesh, e);
      }
      EXPECT_NEAR(total, 40, 1e-9);
      EXPECT_NEAR(between, 8, 1e-9);
    }
  }
  const TriangleMesh ply = output("out.ply"), obj = output("out.obj");
  EXPECT_EQ(ply.triangles, obj.triangles);
  EXPECT_EQ(ply.labels, obj.labels);
  EXPECT_EQ(ply.feature_edges, obj.feature_edges);
  // Lines, which some readers refuse, are in an OBJ file only if edges are asked for.
  EXPECT_GT(remesh("plane.ply", {"-n", "120"}, "out.obj")["features"]["edges"].get<int>(), 0);
  EXPECT_EQ(read_text(in("out.obj")).find("\nl "), std::string::npos);

  // Formats without labels say so, and borders between labels are no features where none are wanted.
  const std::vector<std::string> words{"remesh", in("plane.ply"), "-o",           in("out.off"),
                                       "-n",     "120",           "--iterations", "5"};
  const Result lost = run(words);
  EXPECT_EQ(lost.code, 0);
  EXPECT_TRUE(lost.err.starts_with("bisector: warning: ")) << lost.err;
  EXPECT_NE(lost.err.find("labels"), std::string::npos) << lost.err;
  EXPECT_EQ(remesh("plane.ply", {"-n", "120", "--iterations", "5", "--features", "none"})["features"]["curves"], 4);
}

TEST_F(CliRemesh, NamesAndUnitsComeThrough) {
  TriangleMesh box = test::box(4);
  for (const Triangle& t : box.triangles)
    box.labels.push_back(box.vertices[t[0]].z + box.vertices[t[1]].z + box.vertices[t[2]].z > 1.5 ? 4 : 9);
  box.label_names = {{4, "lid"}, {9, "rim & base"}};
  box.unit = 0.0254;
  const auto names_of = [](const TriangleMesh& mesh) {
    std::set<std::string> names;
    for (const std::int32_t label : mesh.labels) names.insert(mesh.label_names.at(label));
    return names;
  };
  for (const std::string from : {".3mf", ".msh", ".stl", ".obj"}) {
    write_mesh(in("box" + from), box);
    for (const std::string to : {".3mf", ".msh", ".stl", ".obj"}) {
      const Result result = run({"remesh", in("box" + from), "-o", in("out" + to), "-n", "200", "--iterations", "3"});
      ASSERT_EQ(result.code, 0) << result.err;
      EXPECT_EQ(result.err, "") << from << to;
      const TriangleMesh mesh = read_mesh(in("out" + to));
      EXPECT_EQ(names_of(mesh), (std::set<std::string>{"lid", "rim & base"})) << from << to;
      const double unit = to != ".3mf" ? 0 : from == ".3mf" ? 0.0254 : 1e-3;
      EXPECT_EQ(mesh.unit, unit) << from << to;
    }
  }
  // A surface in a format of tetrahedra is one for every command.
  for (const char* name : {"box.mesh", "box.meshb", "box.vtu", "box.vtp"}) {
    write_mesh(in(name), box);
    EXPECT_EQ(run({"segment", in(name), "-o", in("regions.glb"), "--proxies", "6"}).err, "");
    EXPECT_EQ(report_of({"quality", in(name), "--report", "-", "--quiet"})["topology"]["closed"], true);
  }
}

TEST_F(CliRemesh, CutsAreWelded) {
  // The halves of a cube, with vertices of their own along the cut and `gap` apart.
  const auto write_halves = [&](const char* name, double gap) {
    const TriangleMesh cube = test::box(4);
    TriangleMesh halves;
    for (const bool upper : {false, true}) {
      std::map<Index, Index> copy;
      for (const Triangle& t : cube.triangles) {
        if ((cube.vertices[t[0]].z + cube.vertices[t[1]].z + cube.vertices[t[2]].z > 1.5) != upper) continue;
        Triangle& added = halves.triangles.emplace_back();
        for (int k = 0; k < 3; ++k) {
          const auto [at, fresh] = copy.try_emplace(t[k], static_cast<Index>(halves.vertices.size()));
          if (fresh) halves.vertices.push_back(cube.vertices[t[k]] + (upper ? Vec3{0, 0, gap} : Vec3{0, 0, 0}));
          added[k] = at->second;
        }
      }
    }
    write_mesh(in(name), halves);
  };
  write_halves("touching.off", 0);
  write_halves("apart.off", 0.2);
  const std::vector<std::string> few{"-n", "200", "--iterations", "20"};
  const auto joined = [&](const char* name, std::vector<std::string> more) {
    more.insert(more.begin(), few.begin(), few.end());
    const Json report = remesh(name, more);
    const Json& weld = report["weld"];
    const bool closed = report["topology"]["closed"];
    EXPECT_EQ(weld["border_edges_before"], 32);
    EXPECT_EQ(weld["border_edges_after"], closed ? 0 : 32);
    EXPECT_EQ(weld["merged_vertices"], closed ? 16 : 0);
    EXPECT_EQ(weld["removed_triangles"], 0);
    EXPECT_EQ(report["topology"]["components"], closed ? 1 : 2);
    EXPECT_EQ(report["topology"]["matches_input"], true);
    return closed;
  };
  EXPECT_TRUE(joined("touching.off", {}));
  EXPECT_FALSE(joined("apart.off", {}));
  EXPECT_FALSE(joined("apart.off", {"--weld", "0.1"}));
  EXPECT_TRUE(joined("apart.off", {"--weld", "0.21"}));
  const Result said =
      run({"remesh", in("apart.off"), "-o", in("out.off"), "-n", "200", "--iterations", "5", "--weld", "0.21"});
  EXPECT_NE(said.err.find("welded 16 vertices"), std::string::npos) << said.err;
}

TEST_F(CliRemesh, EnergyFitAndQualityPass) {
  const auto radius = [&] {
    double sum = 0;
    const TriangleMesh mesh = output();
    for (const Vec3& v : mesh.vertices) sum += norm(v);
    return sum / static_cast<double>(mesh.vertices.size());
  };
  const Json on = remesh("sphere.off", {"-n", "100"});
  const double on_surface = radius();
  EXPECT_EQ(on["noisy"], false);
  EXPECT_FALSE(on.contains("fit"));
  EXPECT_EQ(remesh("sphere.off", {"-n", "100", "--energy", "ccvt"})["energy"], on["energy"]);
  const Json off = remesh("sphere.off", {"-n", "100", "--energy", "rcvt"});
  EXPECT_LT(radius(), 0.999 * on_surface);  // centroids of cells of a convex surface
  EXPECT_FALSE(off.contains("improved"));

  // Triangles that cut off less on either side.
  for (const char* energy : {"ccvt", "rcvt"}) {
    const double before = (energy == std::string("ccvt") ? on : off)["quality"]["distance_rms"];
    const Json fitted = remesh("sphere.off", {"-n", "100", "--energy", energy, "--fit"});
    EXPECT_LT(fitted["quality"]["distance_rms"].get<double>(), 0.8 * before) << energy;
    EXPECT_GT(fitted["fit"]["iterations"], 0);
  }

  const Json unimproved = remesh("sphere.off", {"-n", "100", "--iterations", "3", "--min-angle", "0"});
  EXPECT_FALSE(unimproved.contains("improved"));
  const Json improved = remesh("sphere.off", {"-n", "100", "--iterations", "3"});
  EXPECT_GT(improved["quality"]["theta_min"], unimproved["quality"]["theta_min"]);
}

TEST_F(CliRemesh, NoiseHasGoodTriangles) {
  TriangleMesh rough = test::icosphere(4);
  test::SplitMix64 numbers(1);
  for (Vec3& v : rough.vertices) v = numbers.range(0.96, 1.04) * v;
  write_mesh(in("rough.off"), rough);
  const std::vector<std::string> words{"-n", "300", "--iterations", "10"};
  const Json report = remesh("rough.off", words);
  EXPECT_EQ(report["noisy"], true);
  EXPECT_EQ(report["topology"]["matches_input"], true);
  EXPECT_GE(report["quality"]["theta_min"], 39.999);  // the default of --min-angle, which free seeds do not reach
  EXPECT_GT(report["fit"]["iterations"], 0);
  std::vector<std::string> constrained = words;
  constrained.insert(constrained.end(), {"--energy", "ccvt"});
  EXPECT_EQ(remesh("rough.off", constrained)["noisy"], false);
}

// A ball with a hole and a sheet through it.
TEST_F(CliRemesh, SoupIsWrapped) {
  TriangleMesh soup = test::icosphere(3);
  std::erase_if(soup.triangles, [&](const Triangle& t) { return soup.vertices[t[0]].z > 0.9; });
  const auto first = static_cast<Index>(soup.vertices.size());
  soup.vertices.insert(soup.vertices.end(), {{-1.5, -0.3, 0}, {1.5, -0.3, 0}, {0, 0.6, 0.2}});
  soup.triangles.push_back({first, first + 1, first + 2});
  soup.labels.assign(soup.triangles.size(), 1);
  write_mesh(in("soup.ply"), soup);
  write_mesh(in("ball.ply"), test::icosphere(3));
  const Json report = remesh("soup.ply", {"-n", "400", "--wrap", "1", "--iterations", "20"});
  EXPECT_EQ(report["wrap"]["alpha"], 1);
  EXPECT_GT(report["wrap"]["faces"], 10);
  EXPECT_EQ(report["topology"]["manifold"], true);
  EXPECT_EQ(report["topology"]["closed"], true);
  EXPECT_EQ(report["topology"]["euler"], 2);
  EXPECT_EQ(report["topology"]["matches_input"], true);
  EXPECT_EQ(report["quality"]["self_intersections"], 0);
  EXPECT_NE(report["warnings"].dump().find("labels"), std::string::npos);
  // Without a radius it follows the edges, and the option may end the line.
  const Json by_length = remesh("ball.ply", {"--edge-length", "0.3", "--iterations", "5", "--levels", "1", "--wrap"});
  EXPECT_NEAR(by_length["wrap"]["alpha"].get<double>(), 0.05 * std::sqrt(12), 0.01);
  const auto refused = [&](int code, std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), {"remesh", in("soup.ply"), "-o", in("out.obj"), "-n", "200"});
    expect_failure(code, more, part);
  };
  for (const char* word : {"0", "-1", "nan", "far"}) refused(2, {"--wrap", word}, "--wrap");
  expect_failure(1, {"remesh", in("ball.ply"), "-o", in("out.obj"), "-n", "200", "--wrap", "1e-6"}, "at least");
  refused(2, {"--wrap", "0.1", "--weld", "0.1"}, "--weld");
  refused(2, {"--wrap", "0.1", "--density", "attribute:rho"}, "--density");
  write_text("edges.txt", "0 1\n");
  refused(2, {"--wrap", "0.1", "--feature-file", in("edges.txt")}, "--feature-file");
  refused(2, {"--wrap", "0.1", "--keep-faces", in("edges.txt")}, "--keep-faces");
}

// Coordinates are their own attributes, and the map puts the vertices together from the input's.
TEST_F(CliRemesh, AttributesComeThrough) {
  TriangleMesh ball = test::icosphere(4);
  Attribute xyz{"place", Attribute::Site::vertex, Attribute::Type::float64, 3};
  for (const Vec3& p : ball.vertices) xyz.values.insert(xyz.values.end(), {p.x, p.y, p.z});
  Attribute half{"half", Attribute::Site::element, Attribute::Type::int32, 1};
  for (const Triangle& t : ball.triangles) half.values.push_back(ball.vertices[t[0]].z > 0 ? 1 : 0);
  ball.attributes = {xyz, half};
  write_mesh(in("ball.ply"), ball);
  const Json report = remesh("ball.ply", {"-n", "300", "--map", in("map.txt")});
  ASSERT_EQ(report["attributes"].size(), 2u);
  EXPECT_EQ(report["attributes"][0]["name"], "place");
  EXPECT_EQ(report["attributes"][0]["of"], "vertices");
  EXPECT_EQ(report["attributes"][1]["of"], "elements");
  EXPECT_TRUE(report["seconds"]["attributes"].is_number());
  const TriangleMesh result = output();
  ASSERT_EQ(result.attributes.size(), 2u);
  std::ifstream map(in("map.txt"));
  std::string line;
  std::getline(map, line);
  EXPECT_TRUE(line.starts_with('#'));
  for (std::size_t v = 0; v < result.vertices.size(); ++v) {
    const Vec3& p = result.vertices[v];
    std::size_t face = 0;
    std::array<std::size_t, 3> corners{};
    std::array<double, 3> weights{};
    map >> face >> corners[0] >> corners[1] >> corners[2] >> weights[0] >> weights[1] >> weights[2];
    ASSERT_TRUE(map) << v;
    const Triangle& t = ball.triangles.at(face);
    Vec3 q;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(t[k], corners[k]);
      q += weights[k] * ball.vertices[t[k]];
    }
    EXPECT_LT(norm(q - p), 1e-12);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(result.attributes[0].values[3 * v + static_cast<std::size_t>(k)], p[k], 1e-12);
  }
  for (std::size_t t = 0; t < result.triangles.size(); ++t) {
    double z = 0;
    for (const Index v : result.triangles[t]) z += result.vertices[v].z / 3;
    if (std::abs(z) > 0.1) {
      EXPECT_EQ(result.attributes[1].values[t], z > 0 ? 1 : 0);
    }
  }

  const Result lost = run({"remesh", in("ball.ply"), "-o", in("ball.stl"), "-n", "300"});
  EXPECT_EQ(lost.code, 0);
  EXPECT_NE(lost.err.find("no place for place, half, which are lost; write .ply, .vtp or .vtu"), std::string::npos)
      << lost.err;
  const Result solid = run({"tet", in("ball.ply"), "-o", in("ball.vtu"), "-n", "200"});
  EXPECT_EQ(solid.code, 0);
  EXPECT_NE(solid.err.find("half is lost"), std::string::npos) << solid.err;
  const TetMesh filled = read_tet_mesh(in("ball.vtu"));
  ASSERT_EQ(filled.attributes.size(), 1u);
  std::size_t inside = 0;
  for (std::size_t v = 0; v < filled.vertices.size(); ++v) {
    const double* at = filled.attributes[0].values.data() + 3 * v;
    const Vec3 place{at[0], at[1], at[2]}, p = filled.vertices[v];
    EXPECT_NEAR(norm(place), 1, 0.01);
    EXPECT_NEAR(norm(place - p), 1 - norm(p), 0.02);
    inside += norm(p) < 0.9;
  }
  EXPECT_GT(inside, 0u);
}

TEST_F(CliRemesh, TetrahedraOfSecondOrder) {
  write_mesh(in("torus.off"), test::torus(48, 24));
  const Json report =
      report_of({"tet", in("torus.off"), "-o", in("out.vtu"), "-n", "300", "--order", "2", "--quiet", "--report", "-"});
  const Json& order = report["second_order"];
  EXPECT_GT(order["jacobian_min"].get<double>(), 0);
  EXPECT_EQ(order["boundary_nodes"].get<int>(), 3 * report["output"]["faces"].get<int>() / 2);
  EXPECT_LT(order["node_distance_mean"].get<double>(), 0.3 * order["middle_distance_mean"].get<double>());
  EXPECT_TRUE(report["seconds"]["second_order"].is_number());
  const TetMesh mesh = read_tet_mesh(in("out.vtu"));
  EXPECT_EQ(mesh.vertices.size(), report["output"]["vertices"].get<std::size_t>() + order["nodes"].get<std::size_t>());
  expect_failure(1, {"tet", in("torus.off"), "-o", in("out.mesh"), "-n", "300", "--order", "2"}, "write .msh or .vtu");
  expect_failure(2, {"tet", in("torus.off"), "-o", in("out.vtu"), "-n", "300", "--order", "3"}, "--order");
}

TEST_F(CliRemesh, ReportHasWhatIsDocumented) {
  write_mesh(in("box.off"), test::box(2));
  const Json report = remesh("box.off", {"-n", "100", "--fit"});
  const auto at = [&](const char* key) {
    const Json::json_pointer pointer(key);
    return report.contains(pointer) ? report.at(pointer) : Json();
  };
  for (const char* key : {"/output/vertices",
                          "/sizing/wanted",
                          "/topology/divided",
                          "/features/curves",
                          "/features/corners",
                          "/features/broken",
                          "/features/edges",
                          "/weld/merged_vertices",
                          "/weld/split_edges",
                          "/weld/removed_triangles",
                          "/weld/border_edges_before",
                          "/weld/border_edges_after",
                          "/improved/made",
                          "/improved/inserted",
                          "/improved/removed",
                          "/improved/missed",
                          "/mended/bad",
                          "/mended/made",
                          "/mended/inserted",
                          "/mended/removed",
                          "/fit/iterations",
                          "/fit/damped",
                          "/fit/restored"}) {
    ASSERT_TRUE(at(key).is_number_integer()) << key;
    EXPECT_GE(at(key).get<long>(), 0) << key;
  }
  for (const char* key : {"/sizing/edge_length", "/features/distance_vertices", "/features/distance_max",
                          "/seconds/prepare", "/seconds/features", "/seconds/topology", "/seconds/improve",
                          "/seconds/fit", "/seconds/remesh", "/seconds/quality", "/seconds/preview"}) {
    ASSERT_TRUE(at(key).is_number()) << key;
    EXPECT_GE(at(key).get<double>(), 0) << key;
  }
  for (const char* key : {"/noisy", "/topology/ball_property", "/topology/matches_input"})
    EXPECT_TRUE(at(key).is_boolean()) << key;
  EXPECT_TRUE(at("/topology/faults").is_array());

  // With two or three cells around the tube, some meet twice: faults name them.
  write_mesh(in("torus.off"), test::torus(24, 12));
  const Json few = remesh("torus.off", {"-n", "20", "--topology", "off"});
  EXPECT_EQ(few["topology"]["ball_property"], false);
  ASSERT_FALSE(few["topology"]["faults"].empty());
  for (const Json& fault : few["topology"]["faults"]) {
    EXPECT_FALSE(fault["what"].get<std::string>().empty());
    EXPECT_EQ(fault["position"].size(), 3u);
    ASSERT_FALSE(fault["vertices"].empty());
    for (const Json& v : fault["vertices"])
      EXPECT_TRUE(v.is_null() || v.get<std::size_t>() < few["output"]["vertices"].get<std::size_t>()) << v;
  }
}

// An environment variable for as long as it lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Variable() {
    if (before_) setenv(name_, before_->c_str(), 1);
    else unsetenv(name_);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

// --- tet ---

class CliTet : public Cli {
 protected:
  CliTet() { write_tet_mesh(in("cube.mesh"), test::tet_box(2)); }

  // Report of a short run on `input` with more options; the result is in `output`.
  Json tet(const std::string& input, std::vector<std::string> more, const std::string& output = "out.mesh") const {
    more.insert(more.begin(), {"tet", in(input), "-o", in(output), "--iterations", "20", "--quiet", "--report", "-"});
    return report_of(more);
  }

  // A solid with a number h(x) at each vertex.
  void write_field(const std::string& name, const TetMesh& mesh, const std::function<double(double)>& h) const {
    std::ostringstream text;
    text.precision(17);
    text << "# vtk DataFile Version 3.0\nsolid\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " << mesh.vertices.size()
         << " double\n";
    for (const Vec3& p : mesh.vertices) text << p.x << ' ' << p.y << ' ' << p.z << '\n';
    text << "CELLS " << mesh.tets.size() << ' ' << 5 * mesh.tets.size() << '\n';
    for (const Tetrahedron& t : mesh.tets) text << "4 " << t[0] << ' ' << t[1] << ' ' << t[2] << ' ' << t[3] << '\n';
    text << "CELL_TYPES " << mesh.tets.size() << '\n';
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) text << "10\n";
    text << "POINT_DATA " << mesh.vertices.size() << "\nSCALARS h double 1\nLOOKUP_TABLE default\n";
    for (const Vec3& p : mesh.vertices) text << h(p.x) << '\n';
    write_text(name, text.str());
  }

  // Mean length of the edges with their middle at x < 0.25 and at x > 0.75, the latter over the former.
  double growth(const std::string& name) const {
    const TetMesh mesh = read_tet_mesh(in(name));
    std::set<std::array<Index, 2>> edges;
    for (const Tetrahedron& t : mesh.tets)
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j) edges.insert({std::min(t[i], t[j]), std::max(t[i], t[j])});
    double sum[2] = {0, 0}, count[2] = {0, 0};
    for (const auto& e : edges) {
      const double x = 0.5 * (mesh.vertices[e[0]].x + mesh.vertices[e[1]].x);
      if (x > 0.25 && x < 0.75) continue;
      sum[x > 0.5] += norm(mesh.vertices[e[0]] - mesh.vertices[e[1]]);
      ++count[x > 0.5];
    }
    return sum[1] / count[1] / (sum[0] / count[0]);
  }

  // What `quality` says of a file must be a mesh of the cube that conforms.
  void expect_cube(const std::string& name) const {
    const Json report = report_of({"quality", in(name), "--quiet", "--report", "-"});
    EXPECT_EQ(report["topology"]["conforming"], true) << name;
    EXPECT_EQ(report["topology"]["euler"], 2) << name;
    EXPECT_EQ(report["quality"]["inverted"], 0) << name;
    EXPECT_EQ(report["quality"]["zero_volume"], 0) << name;
    EXPECT_NEAR(report["quality"]["volume"].get<double>(), 1, 1e-12) << name;
  }
};

TEST_F(CliTet, FillsASurface) {
  if (find_tetgen().empty()) GTEST_SKIP() << "built without TetGen";
  const Result result = run({"tet", in("sphere.off"), "-o", in("out.msh"), "-n", "300", "--boundary", in("skin.ply"),
                             "--preview", in("p.png"), "--report", in("r.json")});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  for (const char* line : {"input ", "output ", "quality ", "boundary ", "topology ", "volume ", "time ", "written "})
    EXPECT_NE(("\n" + result.out).find(std::string("\n") + line), std::string::npos) << line;
  EXPECT_TRUE(read_text(in("p.png")).starts_with("\x89PNG"));
  const TetMesh mesh = read_tet_mesh(in("out.msh"));
  const TriangleMesh skin = read_mesh(in("skin.ply"));
  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["output"]["vertices"], mesh.vertices.size());
  EXPECT_EQ(report["output"]["tets"], mesh.tets.size());
  EXPECT_EQ(report["output"]["faces"], skin.triangles.size());
  EXPECT_EQ(report["sizing"]["boundary_vertices"], skin.vertices.size());
  EXPECT_EQ(boundary_facets(mesh.tets).size(), skin.triangles.size());
  EXPECT_EQ(analyse_topology(skin.triangles, skin.vertices.size()).euler, 2);
  EXPECT_TRUE(analyse_tet_topology(mesh).conforming);
}

TEST_F(CliTet, TheExamplePart) {
  if (find_tetgen().empty()) GTEST_SKIP() << "built without TetGen";
  const Result result = run({"tet", BISECTOR_SOURCE_DIR "/examples/part.off", "-o", in("out.vtu"), "-n", "1500",
                             "--iterations", "4", "--report", in("r.json")});
  ASSERT_EQ(result.code, 0) << result.err;
  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["topology"]["matches_input"], true);
  EXPECT_EQ(report["topology"]["conforming"], true);
  EXPECT_EQ(report["quality"]["inverted"], 0);
  EXPECT_NEAR(report["output"]["vertices"].get<double>(), 1500, 75);
  EXPECT_GE(report["quality"]["dihedral_min"].get<double>(), 10);
}

TEST_F(CliTet, ReportHasWhatIsDocumented) {
  const Json report = tet("cube.mesh", {"-n", "100"});
  const auto at = [&](const char* key) {
    const Json::json_pointer pointer(key);
    return report.contains(pointer) ? report.at(pointer) : Json();
  };
  for (const char* key : {"/input/tets",
                          "/output/tets",
                          "/output/vertices",
                          "/output/faces",
                          "/background/tets",
                          "/iterations",
                          "/evaluations",
                          "/certification/pairs",
                          "/sizing/wanted",
                          "/sizing/boundary_vertices",
                          "/conform/steiner_points",
                          "/conform/refused_sites",
                          "/improved/rounds",
                          "/improved/edge_removals",
                          "/improved/face_removals",
                          "/improved/contractions",
                          "/improved/insertions",
                          "/improved/moves",
                          "/improved/before/below_goal",
                          "/improved/after/below_goal",
                          "/quality/inverted",
                          "/quality/zero_volume",
                          "/topology/tet_components",
                          "/topology/unused_vertices",
                          "/features/curves",
                          "/features/broken"}) {
    ASSERT_TRUE(at(key).is_number_integer()) << key;
    EXPECT_GE(at(key).get<long>(), 0) << key;
  }
  for (const char* key :
       {"/energy", "/gradient_norm", "/sizing/edge_length", "/quality/volume", "/quality/volume_input",
        "/quality/dihedral_min", "/quality/dihedral_max", "/quality/radius_ratio_mean", "/quality/theta_min",
        "/quality/distance_rms", "/improved/before/dihedral_min", "/improved/after/radius_ratio_mean", "/seconds/total",
        "/seconds/background", "/seconds/boundary", "/seconds/improve", "/seconds/extract", "/seconds/tet",
        "/seconds/io"}) {
    ASSERT_TRUE(at(key).is_number()) << key;
    EXPECT_GE(at(key).get<double>(), 0) << key;
  }
  for (const char* key : {"/conform/delaunay", "/topology/conforming", "/topology/matches_input"})
    EXPECT_TRUE(at(key).is_boolean()) << key;
  EXPECT_EQ(at("/input/tets"), 48);
  EXPECT_EQ(at("/features/curves"), 12);
  EXPECT_GE(at("/improved/after/dihedral_min"), at("/improved/before/dihedral_min"));
  const Json slivers = tet("cube.mesh", {"-n", "100", "--min-dihedral", "0"});
  EXPECT_FALSE(slivers.contains("improved"));
  EXPECT_LE(slivers["quality"]["dihedral_min"], report["quality"]["dihedral_min"]);
}

TEST_F(CliTet, EveryFormatHoldsTheSameMesh) {
  std::optional<TetMesh> first;
  for (const char* name : {"out.mesh", "out.msh", "out.vtu"}) {
    tet("cube.mesh", {"-n", "80"}, name);
    expect_cube(name);
    const TetMesh mesh = read_tet_mesh(in(name));
    if (!first) first = mesh;
    EXPECT_EQ(mesh.vertices, first->vertices) << name;
    EXPECT_EQ(mesh.tets, first->tets) << name;
  }
  // Each can be meshed again.
  for (const char* name : {"out.mesh", "out.msh", "out.vtu"}) {
    tet(name, {"-n", "40"}, "again.mesh");
    expect_cube("again.mesh");
  }
}

TEST_F(CliTet, OutputDoesNotDependOnThreads) {
  std::set<std::string> results, reports;
  for (const char* threads : {"1", "2", "5"}) {
    Json report = timeless(tet("cube.mesh", {"-n", "120", "--threads", threads}));
    reports.insert(report.dump());
    results.insert(read_text(in("out.mesh")));
  }
  EXPECT_EQ(results.size(), 1u);
  EXPECT_EQ(reports.size(), 1u);
  tet("cube.mesh", {"-n", "120", "--random-seed", "2"});
  EXPECT_FALSE(results.contains(read_text(in("out.mesh"))));
}

TEST_F(CliTet, EdgeLengths) {
  // The length that -n reports gives about as many vertices, in the unit or as a share of the diagonal.
  const double length = tet("cube.mesh", {"-n", "120"})["sizing"]["edge_length"];
  for (const auto& [option, value] :
       {std::pair("--edge-length", length), std::pair("--edge-length-relative", length / std::sqrt(3.0))}) {
    const Json report = tet("cube.mesh", {option, std::to_string(value)});
    EXPECT_NEAR(report["output"]["vertices"].get<double>(), 120, 6) << option;
    expect_cube("out.mesh");
  }
}

TEST_F(CliTet, SizesFromAnotherMeshOrAnAttribute) {
  const auto h = [](double x) { return 0.2 + 0.3 * x; };
  write_field("sizes.vtk", test::tet_grid(1, 1, 1), h);
  tet("cube.mesh", {"-n", "300", "--sizes", in("sizes.vtk:h"), "--gradation", "1"});
  expect_cube("out.mesh");
  const double from_file = growth("out.mesh");
  // The same density by h = rho^(-1/5), at the vertices of the input.
  write_field("graded.vtk", test::tet_box(4), [&](double x) { return std::pow(h(x), -5); });
  const std::vector<std::string> density{"-n", "300", "--density", "attribute:h", "--gradation", "1"};
  tet("graded.vtk", density);
  expect_cube("out.mesh");
  EXPECT_NEAR(growth("out.mesh"), from_file, 0.1 * from_file);
  // Edges are as dense as 1 / h^3: their mean length over x in (a, b) is that of h with this weight.
  const auto mean = [&](double a, double b) {
    return 2 * (1 / h(a) - 1 / h(b)) / (1 / (h(a) * h(a)) - 1 / (h(b) * h(b)));
  };
  const double expected = mean(0.75, 1) / mean(0, 0.25);
  EXPECT_NEAR(from_file, expected, 0.15 * expected);
  // The .sol beside a .mesh says the same as point data.
  const std::string vtk_result = read_text(in("out.mesh"));
  const TetMesh solid = read_tet_mesh(in("graded.vtk"));
  write_tet_mesh(in("graded.mesh"), solid);
  std::ostringstream sol;
  sol.precision(17);
  sol << "MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n" << solid.vertices.size() << "\n1 1\n";
  for (const Vec3& p : solid.vertices) sol << std::pow(h(p.x), -5) << '\n';
  write_text("graded.sol", sol.str() + "End\n");
  tet("graded.mesh", density);
  EXPECT_EQ(read_text(in("out.mesh")), vtk_result);
}

TEST_F(CliTet, RegionsAndLabelsStay) {
  TetMesh solid = test::tet_grid(2, 1, 1);
  for (const Tetrahedron& t : solid.tets) {
    double x = 0;
    for (const Index v : t) x += 0.25 * solid.vertices[v].x;
    solid.regions.push_back(x < 1 ? 7 : 3);
  }
  solid.boundary = boundary_facets(solid.tets);
  for (const Triangle& t : solid.boundary) {
    int label = 9;
    for (int k = 0; k < 3; ++k)
      if (solid.vertices[t[0]][k] == solid.vertices[t[1]][k] && solid.vertices[t[0]][k] == solid.vertices[t[2]][k])
        label = 1 + k;
    solid.boundary_labels.push_back(label);
  }
  write_tet_mesh(in("bar.msh"), solid);
  const Json report = tet("bar.msh", {"-n", "250"}, "out.msh");
  const TetMesh mesh = read_tet_mesh(in("out.msh"));
  ASSERT_EQ(mesh.regions.size(), mesh.tets.size());
  for (std::size_t i = 0; i < mesh.tets.size(); ++i)
    for (const Index v : mesh.tets[i])
      EXPECT_TRUE(mesh.regions[i] == 7 ? mesh.vertices[v].x <= 1 : mesh.vertices[v].x >= 1);
  const Json& list = report["regions"]["list"];
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0]["region"], 3);
  EXPECT_EQ(list[1]["region"], 7);
  for (const Json& region : list) {
    EXPECT_NEAR(region["volume"].get<double>(), 1, 1e-12);
    EXPECT_NEAR(region["volume_input"].get<double>(), 1, 1e-12);
    EXPECT_GT(region["tets"], 0);
  }
  EXPECT_NEAR(report["quality"]["distance_max"].get<double>(), 0, 1e-9);
  TriangleMesh skin = surface_of_marks(mesh);
  ASSERT_EQ(skin.labels.size(), skin.triangles.size());
  EXPECT_EQ(report["regions"]["interface_triangles"], std::count(skin.labels.begin(), skin.labels.end(), 0));
  std::map<int, double> area = area_of_labels(skin);
  EXPECT_EQ(area.size(), 4u);
  EXPECT_NEAR(area[0], 1, 1e-9);
  EXPECT_NEAR(area[1], 2, 1e-9);
  EXPECT_NEAR(area[2], 4, 1e-9);
  EXPECT_NEAR(area[3], 4, 1e-9);
}

TEST_F(CliTet, RegionsThatASurfaceEncloses) {
  const TetMesh bar = test::tet_grid(2, 1, 1);
  TetMesh halves = bar;
  for (std::size_t t = 0; t < bar.tets.size(); ++t) halves.regions.push_back(t < 6 ? 1 : 2);
  TriangleMesh walls;
  walls.vertices = bar.vertices;
  walls.triangles = wall_facets(halves);
  write_mesh(in("walls.off"), walls);
  expect_failure(1, {"tet", in("cube.mesh"), "-o", in("out.msh"), "-n", "100", "--regions"}, "--regions");
  expect_failure(2, {"tet", in("walls.off"), "-o", in("out.msh"), "-n", "100", "--regions", "--wrap"}, "--regions");
  if (find_tetgen().empty()) GTEST_SKIP() << "built without TetGen";
  expect_failure(1, {"tet", in("walls.off"), "-o", in("out.msh"), "-n", "100"}, "mesh them as regions");
  const Json report = tet("walls.off", {"-n", "200", "--regions"}, "out.vtu");
  ASSERT_EQ(report["regions"]["list"].size(), 2u);
  const TetMesh mesh = read_tet_mesh(in("out.vtu"));
  EXPECT_EQ(std::set<int>(mesh.regions.begin(), mesh.regions.end()), (std::set<int>{1, 2}));
}

TEST_F(CliTet, SeedsFromAFile) {
  test::SplitMix64 random(4);
  std::ostringstream seeds;
  seeds.precision(17);
  for (int i = 0; i < 150; ++i) seeds << random.unit() << ' ' << random.unit() << ' ' << random.unit() << '\n';
  write_text("seeds.xyz", seeds.str());
  const Json report = tet("cube.mesh", {"--seeds", in("seeds.xyz")});
  EXPECT_EQ(report["sizing"]["wanted"], 150);
  EXPECT_NEAR(report["output"]["vertices"].get<double>(), 150, 8);
  expect_cube("out.mesh");
}

TEST_F(CliTet, OptionsThatContradictEachOther) {
  write_text("points.xyz", "0.5 0.5 0.5\n");
  const auto refused = [&](std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), {"tet", in("cube.mesh"), "-o", in("out.msh")});
    expect_failure(2, more, part);
  };
  refused({}, "how many vertices");
  refused({"-n", "100", "--edge-length", "0.1"}, "give one of them");
  refused({"--edge-length", "0.1", "--edge-length-relative", "0.1"}, "give one of them");
  refused({"--seeds", in("points.xyz"), "--edge-length", "0.1"}, "--edge-length");
  refused({"--seeds", in("points.xyz"), "--random-seed", "3"}, "--random-seed");
  refused({"-n", "100", "--sizes", in("points.xyz"), "--density", "lfs"}, "--density");
  refused({"-n", "100", "--gradation", "0.1"}, "--gradation");
  refused({"-n", "100", "--density", "lfs", "--gradation", "0"}, "--gradation");
  refused({"-n", "100", "--density", "lfs", "--edge-min", "0.2", "--edge-max", "0.1"}, "--edge-min");
  for (const char* n : {"7", "0", "-5", "many", "1.5", ""}) refused({"-n", n}, "-n");
  for (const char* length : {"0", "-1", "nan", "inf"}) refused({"--edge-length", length}, "--edge-length");
  for (const char* angle : {"55", "-1", "nan"}) refused({"-n", "100", "--min-dihedral", angle}, "--min-dihedral");
  refused({"-n", "100", "--min-angle", "60"}, "--min-angle");
}

TEST_F(CliTet, BadInputIsOneLine) {
  const auto refused = [&](const std::string& input, std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), {"tet", in(input), "-o", in("out.msh"), "-n", "100"});
    expect_failure(1, more, part);
  };
  refused("missing.off", {}, "missing.off");
  refused("missing.mesh", {}, "missing.mesh");
  write_text("cube.txt", "nothing");
  refused("cube.txt", {}, "cube.txt");
  for (const char* name : {"out.off", "out.vtk", "out.txt", "out"})
    expect_failure(1, {"tet", in("cube.mesh"), "-o", in(name), "-n", "100"}, "can be written here");
  expect_failure(1, {"tet", in("cube.mesh"), "-o", in("nowhere/out.msh"), "-n", "100"}, "does not exist");
  refused("cube.mesh", {"--boundary", in("skin.xyz")}, "skin.xyz");
  refused("cube.mesh", {"--preview", in("p.jpg")}, "p.jpg");
  refused("cube.mesh", {"--boundary", in("cube.off"), "--report", in("cube.off")}, "cube.off");

  TriangleMesh open = test::icosphere(2);
  open.triangles.pop_back();
  write_mesh(in("open.off"), open);
  refused("open.off", {}, "edges have one triangle");
  refused("open.off", {}, "--wrap");
  TriangleMesh crossing = test::box(1);
  for (const Triangle& t : test::box(1).triangles) crossing.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  for (const Vec3& p : test::box(1).vertices) crossing.vertices.push_back(p + Vec3{0.5, 0.25, 0.125});
  write_mesh(in("crossing.off"), crossing);
  refused("crossing.off", {}, "intersects itself");
  refused("crossing.off", {}, "--wrap");
  write_text("empty.off", "OFF\n0 0 0\n");
  refused("empty.off", {}, "");
  refused("cube.mesh", {"--sizes", in("absent.vtk")}, "absent.vtk");
  refused("cube.mesh", {"--sizes", in("absent.vtk:h")}, "absent.vtk");
  write_field("sizes.vtk", test::tet_box(1), [](double) { return 0.25; });
  refused("cube.mesh", {"--sizes", in("sizes.vtk:other")}, "other");
  refused("sizes.vtk", {"--density", "attribute:other"}, "other");
  refused("cube.mesh", {"--density", "attribute:h"}, "cube.sol");
  for (const double bad : {std::nan(""), 0.0, -1.0}) {
    write_field("bad.vtk", test::tet_box(1), [&](double x) { return x < 0.5 ? 0.25 : bad; });
    refused("cube.mesh", {"--sizes", in("bad.vtk:h")}, "");
    refused("bad.vtk", {"--density", "attribute:h"}, "");
  }
  write_text("few.xyz", "0.5 0.5 0.5\n");
  expect_failure(1, {"tet", in("cube.mesh"), "-o", in("out.msh"), "--seeds", in("few.xyz")}, "8 seeds");
}

TEST_F(CliTet, WhatBoundsNoSolidIsWrapped) {
  TriangleMesh bowl = test::icosphere(3);
  std::erase_if(bowl.triangles, [&](const Triangle& t) { return bowl.vertices[t[0]].z > 0.8; });
  write_mesh(in("bowl.off"), bowl);
  const Json report =
      report_of({"tet", in("bowl.off"), "-o", in("out.mesh"), "-n", "600", "--wrap=1.5", "--quiet", "--report", "-"});
  EXPECT_EQ(report["wrap"]["alpha"], 1.5);
  EXPECT_EQ(report["topology"]["closed"], true);
  EXPECT_GT(report["quality"]["volume"], 0.7 * 4.18879);
  EXPECT_GT(report["quality"]["dihedral_min"], 8);
}

TEST_F(CliTet, WithoutTetgenSaysSo) {
  const Variable nowhere("BISECTOR_TETGEN", in("no-such-program"));
  expect_failure(1, {"tet", in("sphere.off"), "-o", in("out.msh"), "-n", "100"}, "BISECTOR_TETGEN");
  tet("cube.mesh", {"-n", "60"});  // needs none
  expect_cube("out.mesh");
}

TEST_F(CliTet, InterruptLeavesNothing) {
  const std::set<std::string> before = files();
  const pid_t process = start({"tet", in("cube.mesh"), "-o", in("out.msh"), "-n", "20000", "--iterations", "1000000",
                               "--tolerance", "0", "--report", in("r.json"), "--boundary", in("skin.off")});
  for (int k = 0; k < 1000 && !catches_interrupts(process); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  kill(process, SIGINT);
  const Result result = finish(process);
  EXPECT_EQ(result.code, 130);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "bisector: cancelled\n");
  EXPECT_EQ(files(), before);
}

class CliSegment : public Cli {
 protected:
  CliSegment() { write_mesh(in("box.ply"), test::box(4)); }

  std::vector<std::string> segment(std::vector<std::string> more) const {
    more.insert(more.begin(), {"segment", in("box.ply"), "-o", in("out.ply")});
    return more;
  }
};

TEST_F(CliSegment, FindsTheSidesOfABox) {
  const Result result =
      run(segment({"--proxies", "6", "--report", in("r.json"), "--preview", in("out.png"), "--verbose"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("6 planes"), std::string::npos);
  EXPECT_NE(result.out.find("out.ply"), std::string::npos);
  EXPECT_EQ(files(), (std::set<std::string>{"sphere.off", "box.ply", "out.ply", "out.png", "r.json"}));

  const TriangleMesh input = read_mesh(in("box.ply")), mesh = read_mesh(in("out.ply"));
  EXPECT_EQ(mesh.vertices, input.vertices);
  EXPECT_EQ(mesh.triangles, input.triangles);
  ASSERT_EQ(mesh.labels.size(), 192u);
  std::map<std::int32_t, Vec3> normals;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 n = cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a]);
    EXPECT_EQ(normals.try_emplace(mesh.labels[t], n).first->second, n) << "triangle " << t;
  }
  EXPECT_EQ(normals.size(), 6u);

  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["command"], "segment");
  EXPECT_EQ(report["input"]["faces"], 192);
  EXPECT_EQ(report["output"]["faces"], 192);
  EXPECT_FALSE(report.contains("quality"));
  for (const char* key :
       {"total", "start", "lloyd", "improve", "classify", "smooth", "project", "segment", "quality", "preview", "io"})
    EXPECT_GE(report["seconds"].value(key, -1.0), 0) << key;
  const Json& segmentation = report["segmentation"];
  for (const char* key :
       {"iterations", "insertions", "merges", "teleportations", "deletions", "evaluations", "energies"})
    EXPECT_TRUE(segmentation.contains(key)) << key;
  EXPECT_NEAR(segmentation["border_before"].get<double>(), 12, 1e-12);
  EXPECT_NEAR(segmentation["border_after"].get<double>(), 12, 1e-12);
  for (const char* key : {"rms", "rms_percent", "rms_before"})
    EXPECT_NEAR(segmentation[key].get<double>(), 0, 1e-9) << key;
  ASSERT_EQ(segmentation["regions"].size(), 6u);
  for (const Json& region : segmentation["regions"]) {
    EXPECT_EQ(region["type"], "plane");
    EXPECT_EQ(region["triangles"], 32);
    EXPECT_NEAR(region["area"].get<double>(), 1, 1e-12);
    EXPECT_NEAR(region["max"].get<double>(), 0, 1e-9);
    const auto normal = region["normal"].get<std::vector<double>>();
    EXPECT_NEAR(std::max({std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])}), 1, 1e-9);
    const double offset = std::abs(region["offset"].get<double>());
    EXPECT_NEAR(std::min(offset, std::abs(1 - offset)), 0, 1e-9);
    EXPECT_EQ(region["coefficients"].size(), 10u);
    for (const char* key : {"radius", "axis", "angle", "axes"}) EXPECT_FALSE(region.contains(key)) << key;
  }
}

TEST_F(CliSegment, EveryFormatHoldsTheSameRegions) {
  TriangleMesh box = test::box(4);
  box.feature_edges = {{box.triangles[0][0], box.triangles[0][1]}};
  if (box.feature_edges[0][0] > box.feature_edges[0][1]) std::swap(box.feature_edges[0][0], box.feature_edges[0][1]);
  write_mesh(in("box.ply"), box);
  for (const char* name : {"out.ply", "out.obj"})
    ASSERT_EQ(run({"segment", in("box.ply"), "-o", in(name), "--proxies", "6", "--quiet"}).code, 0);
  const TriangleMesh ply = read_mesh(in("out.ply")), obj = read_mesh(in("out.obj"));
  EXPECT_EQ(obj.labels, ply.labels);
  EXPECT_EQ(obj.triangles, ply.triangles);
  EXPECT_TRUE(obj.feature_edges.empty());
  EXPECT_EQ(ply.feature_edges, box.feature_edges);
  EXPECT_NE(read_text(in("out.obj")).find("g region_3_plane\n"), std::string::npos);
  EXPECT_NE(read_text(in("out.ply")).find("property uchar red\n"), std::string::npos);
  for (const char* name : {"out.off", "out.stl"}) {
    const Result result = run({"segment", in("box.ply"), "-o", in(name), "--proxies", "6", "--quiet"});
    EXPECT_EQ(result.code, 0);
    const Result loud = run({"segment", in("box.ply"), "-o", in(name), "--proxies", "6"});
    EXPECT_NE(loud.err.find("warning"), std::string::npos);
    EXPECT_EQ(std::count(loud.err.begin(), loud.err.end(), '\n'), 1);
  }
}

TEST_F(CliSegment, WritesPolygonsOfPlanes) {
  for (const char* name : {"p.ply", "p.obj", "p.vtp", "p.off"}) {
    const Result result = run(segment({"--proxies", "6", "--surfaces", "planes", "--polygons", in(name)}));
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    EXPECT_NE(result.out.find(name), std::string::npos);
    const TriangleMesh mesh = read_mesh(in(name));
    EXPECT_EQ(mesh.vertices.size(), 8u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    EXPECT_EQ(mesh.face_of_triangle.back(), 5u);  // six polygons
    EXPECT_EQ(mesh.labels.empty(), std::string(name) == "p.off");
  }
  EXPECT_NE(read_text(in("p.obj")).find("g region_3_plane\n"), std::string::npos);
  ASSERT_EQ(run(segment({"--proxies", "6", "--polygons", in("p.off"), "--chord", "0.1", "--triangulate"})).code, 0);
  EXPECT_TRUE(read_mesh(in("p.off")).face_of_triangle.empty());
  const Json report = report_of(segment({"--proxies", "6", "--polygons", in("p.off"), "--report", "-", "--quiet"}));
  EXPECT_EQ(
      report["polygons"],
      (Json{
          {"vertices", 8}, {"faces", 6}, {"triangles", 12}, {"divided", 0}, {"folded", 0}, {"self_intersections", 0}}));
  EXPECT_GT(report["seconds"].value("polygons", 0.0), 0);
  // A ball of one region has no polygon.
  const Result ball =
      run({"segment", in("sphere.off"), "-o", in("out.ply"), "--proxies", "1", "--polygons", in("b.ply")});
  EXPECT_EQ(ball.code, 0);
  EXPECT_NE(ball.err.find("--surfaces planes"), std::string::npos) << ball.err;
}

TEST_F(CliSegment, WritesRegionsAsJson) {
  const Result result = run(segment({"--proxies", "6", "--json", in("regions.json"), "--quiet"}));
  ASSERT_EQ(result.code, 0) << result.err;
  const Json json = Json::parse(read_text(in("regions.json")));
  EXPECT_EQ(json["command"], "segment");
  EXPECT_EQ(json["input"], in("box.ply"));
  EXPECT_TRUE(json["warnings"].empty());
  EXPECT_NEAR(json["diagonal"].get<double>(), std::sqrt(3.0), 1e-12);
  const std::vector<Vec3> vertices = read_mesh(in("out.ply")).vertices;
  const auto expect_points = [&](const Json& path) {
    ASSERT_EQ(path["points"].size(), path["vertices"].size());
    for (std::size_t i = 0; i < path["points"].size(); ++i) {
      const Vec3& p = vertices[path["vertices"][i].get<std::size_t>()];
      EXPECT_EQ(path["points"][i], Json::array({p.x, p.y, p.z}));
    }
  };
  ASSERT_EQ(json["regions"].size(), 6u);
  for (const Json& region : json["regions"]) {
    EXPECT_EQ(region["type"], "plane");
    EXPECT_EQ(region["euler"], 1);
    EXPECT_EQ(region["has_outer"], true);
    ASSERT_EQ(region["loops"].size(), 1u);
    EXPECT_EQ(region["loops"][0]["chains"].size(), 4u);
    EXPECT_NEAR(region["loops"][0]["length"].get<double>(), 4, 1e-12);
    expect_points(region["loops"][0]);
    // The box is in [0, 1], so that a face's plane is behind the middle if its normal points outward.
    double middle = 0;
    for (const Json& x : region["normal"]) middle += 0.5 * x.get<double>();
    EXPECT_EQ(region["same_sense"].get<bool>(), middle < region["offset"].get<double>());
  }
  ASSERT_EQ(json["chains"].size(), 12u);
  for (const Json& chain : json["chains"]) {
    EXPECT_EQ(chain["kind"], "sharp");
    EXPECT_EQ(chain["closed"], false);
    EXPECT_NEAR(chain["length"].get<double>(), 1, 1e-12);
    EXPECT_NEAR(chain["surface_angle"].get<double>(), 90, 1e-6);
    EXPECT_NEAR(chain["mesh_angle"].get<double>(), 90, 1e-9);
    EXPECT_LT(chain["left"].get<int>(), chain["right"].get<int>());
    expect_points(chain);
  }
  ASSERT_EQ(json["adjacency"].size(), 12u);
  for (const Json& meeting : json["adjacency"]) {
    EXPECT_EQ(meeting["kind"], "sharp");
    EXPECT_EQ(meeting["chains"].size(), 1u);
  }
}

TEST_F(CliSegment, ProjectsOntoTheSurfaces) {
  TriangleMesh ball = test::icosphere(3);
  test::SplitMix64 random(1);
  for (Vec3& v : ball.vertices) v *= random.range(0.999, 1.001);
  write_mesh(in("ball.ply"), ball);
  const Json report = report_of(
      {"segment", in("ball.ply"), "-o", in("out.ply"), "--proxies", "1", "--project", "--report", "-", "--quiet"});
  const Json& region = report["segmentation"]["regions"][0];
  ASSERT_EQ(region["type"], "sphere");
  EXPECT_NEAR(region["radius"].get<double>(), 1, 1e-3);
  const double radius = region["radius"].get<double>();
  const auto centre = region["centre"].get<std::vector<double>>();
  for (const Vec3& v : read_mesh(in("out.ply")).vertices)
    EXPECT_NEAR(norm(v - Vec3{centre[0], centre[1], centre[2]}), radius, 1e-9);
  EXPECT_GT(report["quality"]["distance_rms"].get<double>(), 0);
  EXPECT_LT(report["quality"]["distance_max"].get<double>(), 0.1);
}

TEST_F(CliSegment, PolygonsAreDivided) {
  write_text("cube.off",
             "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
             "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  const Json report = report_of({"segment", in("cube.off"), "-o", in("out.ply"), "--proxies", "6", "--report", "-"});
  EXPECT_EQ(report["input"]["faces"], 6);
  EXPECT_EQ(report["output"]["faces"], 12);
  const std::vector<std::int32_t> labels = read_mesh(in("out.ply")).labels;
  EXPECT_EQ(std::set(labels.begin(), labels.end()).size(), 6u);
}

TEST_F(CliSegment, OutputDoesNotDependOnThreads) {
  std::vector<std::string> files;
  std::vector<Json> reports;
  for (const char* threads : {"1", "2"}) {
    reports.push_back(timeless(report_of(
        {"segment",   in("sphere.off"), "-o",        in("out.ply"), "--proxies", "5",        "--surfaces",
         "quadrics",  "--start",        "insertion", "--threads",   threads,     "--report", "-",
         "--preview", in("out.png"),    "--project", "--polygons",  in("p.ply"), "--json",   in("regions.json")})));
    files.push_back(read_text(in("out.ply")) + read_text(in("out.png")) + read_text(in("p.ply")) +
                    read_text(in("regions.json")));
  }
  EXPECT_EQ(reports[0], reports[1]);
  EXPECT_TRUE(files[0] == files[1]);
}

TEST_F(CliSegment, BadUsage) {
  for (const char* n : {"0", "-1", "x", "1.5", ""}) expect_failure(2, segment({"--proxies", n}), "--proxies");
  for (const char* e : {"0", "-1", "nan", "inf", "x", ""}) expect_failure(2, segment({"--error", e}), "--error");
  for (const char* option : {"--surfaces", "--start", "--iterations", "--smooth", "--fuzzy-rings", "--threads"})
    for (const char* value : {"nonsense", "-1", "nan", ""}) expect_failure(2, segment({option, value}), option);
  expect_failure(2, segment({"--fuzzy-rings", "0"}), "--fuzzy-rings");
  expect_failure(2, segment({"--proxies", "6", "--error", "1"}), "--error");
  expect_failure(2, segment({"--random-seed", "3"}), "--random-seed");
  expect_failure(2, segment({"--random-seed", "-3", "--start", "insertion"}), "--random-seed");
  expect_failure(2, segment({"--smooth", "0", "--fuzzy-rings", "2"}), "--fuzzy-rings");
  expect_failure(2, segment({"--triangulate"}), "--polygons");
  expect_failure(2, segment({"--chord", "0.1"}), "--polygons");
  for (const char* r : {"0", "-1", "nan", "x"})
    expect_failure(2, segment({"--polygons", in("p.ply"), "--chord", r}), "--chord");
  expect_failure(2, {"segment", in("box.ply")}, "-o");
  expect_failure(2, {"segment"}, "IN");
}

TEST_F(CliSegment, NumbersOfRegionsThatCannotBeAreWarnings) {
  write_mesh(in("two.off"), test::two_spheres());
  const Result most = run(segment({"--proxies", "193"}));
  EXPECT_EQ(most.code, 0);
  EXPECT_NE(most.err.find("192 triangles"), std::string::npos) << most.err;
  const Result fewest = run({"segment", in("two.off"), "-o", in("out.ply"), "--proxies", "1"});
  EXPECT_EQ(fewest.code, 0);
  EXPECT_NE(fewest.err.find("2 components"), std::string::npos) << fewest.err;
}

TEST_F(CliSegment, BadInputIsOneLine) {
  write_text("flat.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n");
  expect_failure(1, {"segment", in("flat.off"), "-o", in("out.ply"), "--quiet"}, "area");
  expect_failure(1, {"segment", in("missing.off"), "-o", in("out.ply")}, "missing.off");
  expect_failure(1, {"segment", in("box.ply"), "-o", in("out.xyz")}, "format");
  expect_failure(1, segment({"--preview", in("out.jpg")}), "format");
  expect_failure(1, segment({"--polygons", in("p.stl")}), "format");
  expect_failure(1, segment({"--json", in("regions.txt")}), "format");
  expect_failure(1, segment({"--report", in("out.ply")}), "two outputs");
}

TEST_F(CliSegment, InterruptLeavesNothing) {
  write_mesh(in("large.ply"), test::icosphere(6));
  const std::set<std::string> before = files();
  const pid_t process = start({"segment", in("large.ply"), "-o", in("out.ply"), "--proxies", "500", "--start",
                               "insertion", "--report", in("r.json")});
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!catches_interrupts(process) && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // into the loop
  kill(process, SIGINT);
  const Result result = finish(process);
  EXPECT_EQ(result.code, 130);
  EXPECT_EQ(result.err, "bisector: cancelled\n");
  EXPECT_EQ(files(), before);
}

TEST_F(Cli, WithoutALoaderOrADriverTheCpuComputes) {
  const std::string nothing = in("nothing");
  const auto check = [&] {
    for (const char* command : {"rvd", "remesh"}) {
      std::vector<std::string> words{command, in("sphere.off"), "-n", "50", "--quiet", "--report", "-"};
      if (words[0] == "remesh") words.insert(words.end(), {"-o", in("out.off")});
      const Result result = run(words);
      EXPECT_EQ(result.code, 0) << result.err;
      EXPECT_EQ(result.err, "");
      EXPECT_EQ(Json::parse(result.out, nullptr, false)["device"]["kind"], "cpu");
      for (const char* device : {"vulkan", "vulkan:0"}) {
        std::vector<std::string> exact = words;
        exact.insert(exact.end(), {"--device", device});
        expect_failure(1, exact, "Vulkan");
        expect_failure(1, exact, "use --device cpu");
      }
    }
    expect_failure(1, {"check", "--device", "vulkan"}, "Vulkan");
    EXPECT_EQ(run({"devices"}).code, 0);
  };
  {
    SCOPED_TRACE("no loader");
    const Variable loader("BISECTOR_VULKAN_LOADER", nothing);
    check();
  }
  SCOPED_TRACE("no driver");
  const Variable files("VK_DRIVER_FILES", nothing), old_files("VK_ICD_FILENAMES", nothing);
  check();
}

// The first device that can be used, as `--device` takes it.
std::string usable_device() {
  for (const DeviceDescription& device : list_devices().devices)
    if (device.rejected.empty()) return "vulkan:" + std::to_string(device.index);
  return {};
}

TEST_F(Cli, DeviceGivesTheCpusDiagram) {
  const std::string device = usable_device();
  if (device.empty()) GTEST_SKIP() << "no Vulkan device";
  std::vector<Json> reports;
  std::vector<std::string> pairs;
  for (const std::string& word : {std::string("cpu"), device}) {
    reports.push_back(
        report_of({"rvd", in("sphere.off"), "-n", "300", "--device", word, "--pairs", in("pairs"), "--report", "-"}));
    pairs.push_back(read_text(in("pairs")));
  }
  EXPECT_NE(reports[1]["device"]["kind"], "cpu");
  EXPECT_EQ(reports[0]["rdt"], reports[1]["rdt"]);
  EXPECT_TRUE(pairs[0] == pairs[1]);
  for (const char* phase : {"transfer", "grid", "neighbours", "owners", "clip", "sort", "sum", "descent"})
    EXPECT_GE(reports[1]["device_seconds"].value(phase, -1.0), 0) << phase;
  EXPECT_FALSE(reports[0].contains("device_work"));
  for (const char* key : {"submits", "dispatches", "bytes_up", "bytes_down", "host_seconds"})
    EXPECT_GT(reports[1]["device_work"].value(key, -1.0), 0) << key;
}

TEST_F(Cli, ADamagedPipelineCacheDoesNoHarm) {
  const std::string device = usable_device();
  if (device.empty()) GTEST_SKIP() << "no Vulkan device";
  const Variable cache("BISECTOR_CACHE", in("cache"));
  const auto pairs = [&] {
    const Result result =
        run({"rvd", in("sphere.off"), "-n", "50", "--device", device, "--pairs", in("pairs"), "--quiet"});
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.err, "");
    return read_text(in("pairs"));
  };
  const std::string expected = pairs(), good = read_text(in("cache"));
  ASSERT_FALSE(good.empty());
  std::string flipped = good;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 1);
  for (const std::string& bad : {std::string(), good.substr(0, good.size() / 2), flipped, std::string(1000, 'x')}) {
    write_text("cache", bad);
    EXPECT_TRUE(pairs() == expected);
    EXPECT_EQ(read_text(in("cache")).size(), good.size());
  }
}

TEST_F(Cli, DevicePassesItsCheck) {
  const std::string device = usable_device();
  if (device.empty()) GTEST_SKIP() << "no Vulkan device";
  const Result result = run({"check", "--device", device, "--precision", "single"});
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  EXPECT_EQ(result.err, "");
}

TEST_F(Cli, DeviceRemeshes) {
  const std::string device = usable_device();
  if (device.empty()) GTEST_SKIP() << "no Vulkan device";
  for (const char* precision : {"single", "auto"}) {
    const Json report = report_of({"remesh", in("sphere.off"), "-o", in("out.off"), "-n", "300", "--device", device,
                                   "--precision", precision, "--report", "-"});
    EXPECT_NE(report["device"]["kind"], "cpu");
    EXPECT_TRUE(report.contains("device_seconds"));
    EXPECT_EQ(report["topology"]["matches_input"], true);
    EXPECT_GT(report["quality"]["q_ave"].get<double>(), 0.9);
  }
}

TEST_F(Cli, WarningsAreLinesOnStderr) {
  write_text("loose.off", "OFF\n5 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n9 9 9\n3 0 1 2\n3 1 3 2\n");
  const Result result = run({"quality", in("loose.off")});
  EXPECT_EQ(result.code, 0);
  EXPECT_TRUE(result.err.starts_with("bisector: warning: ")) << result.err;
  EXPECT_EQ(run({"quality", in("loose.off"), "--quiet"}).err, "");
}

// Of each command that can warn; the reports of the others have an empty list.
TEST_F(Cli, ReportsHaveTheWarnings) {
  write_text("loose.off", "OFF\n5 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n9 9 9\n3 0 1 2\n3 1 3 2\n");
  TriangleMesh ball = test::icosphere(2);
  ball.vertices.push_back({9, 9, 9});
  write_mesh(in("ball.off"), ball);
  std::string points;
  for (const Vec3& p : test::make_tree({.points = 6'000, .boughs = 3, .random_seed = 1}).points)
    points += std::to_string(p.x) + ' ' + std::to_string(p.y) + ' ' + std::to_string(p.z) + '\n';
  for (int k = 0; k < 12; ++k) points += fmt::format("1000 {} {}\n", 1000 + 0.001 * k, 0.001 * (k % 3));
  write_text("tree.xyz", points);

  std::vector<std::vector<std::string>> commands{
      {"remesh", in("loose.off"), "-o", in("out.off"), "-n", "30"},
      {"rvd", in("loose.off"), "-n", "4"},
      {"segment", in("loose.off"), "-o", in("out.off"), "--proxies", "1"},
      {"tree", in("tree.xyz"), "-o", in("out.off"), "--components", "separate"},
      {"quality", in("loose.off")}};
  if (!find_tetgen().empty()) commands.push_back({"tet", in("ball.off"), "-o", in("out.msh"), "-n", "60"});
  for (std::vector<std::string> words : commands) {
    words.insert(words.end(), {"--report", in("r.json")});
    const Result loud = run(words);
    ASSERT_EQ(loud.code, 0) << words[0] << ": " << loud.err;
    const Json warnings = Json::parse(read_text(in("r.json")))["warnings"];
    ASSERT_GE(warnings.size(), 1u) << words[0];
    std::string lines;
    for (const std::string line : warnings) lines += "bisector: warning: " + line + '\n';
    EXPECT_EQ(loud.err, lines) << words[0];
    words.push_back("--quiet");
    const Result quiet = run(words);
    EXPECT_EQ(quiet.err, "") << words[0];
    EXPECT_EQ(Json::parse(read_text(in("r.json")))["warnings"], warnings) << words[0];
  }
  EXPECT_EQ(report_of({"quality", in("sphere.off"), "--report", "-"})["warnings"], Json::array());
}

TEST_F(Cli, InterruptLeavesNothing) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::set<std::string> before = files();
    const pid_t process = start({"remesh", in("sphere.off"), "-o", in("out.obj"), "-n", "20000", "--iterations",
                                 "1000000", "--tolerance", "0", "--report", in("r.json"), "--preview", in("p.png")});
    for (int k = 0; k < 1000 && !catches_interrupts(process); ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    kill(process, signal);
    const Result result = finish(process);
    EXPECT_EQ(result.code, 130);
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(result.err, "bisector: cancelled\n");
    EXPECT_EQ(files(), before);
  }
}

// ---- tree

class CliTree : public Cli {
 protected:
  CliTree() {
    points_ = test::make_tree({.points = 6'000, .boughs = 3, .random_seed = 1}).points;
    std::string text = "# a tree\n";
    for (const Vec3& p : points_)
      text += std::to_string(p.x) + ' ' + std::to_string(p.y) + ' ' + std::to_string(p.z) + " 9 9\n";
    write_text("tree.xyz", text);
  }
  std::vector<Vec3> points_;
};

TEST_F(CliTree, WritesWhatItSays) {
  const Result result = run({"tree", in("tree.xyz"), "-o", in("out.obj"), "--skeleton", in("s.ply"), "--labels",
                             in("l.ply"), "--preview", in("p.png"), "--report", in("r.json")});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("points"), std::string::npos);
  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["input"]["points"], points_.size());
  EXPECT_EQ(report["input"]["unassigned_points"], report["input"]["unexplained_points"]);
  EXPECT_EQ(report["tree"]["trunks"], 1);
  const std::size_t branches = report["tree"]["branches"];
  ASSERT_EQ(report["branches"].size(), branches);
  EXPECT_TRUE(report["branches"][0]["parent"].is_null());
  double length = 0, volume = 0;
  std::size_t points = 0;
  for (const Json& branch : report["branches"]) {
    length += branch["length"].get<double>();
    volume += branch["volume"].get<double>();
    points += branch["points"].get<std::size_t>();
  }
  EXPECT_NEAR(report["tree"]["length"], length, 1e-9 * length);
  EXPECT_NEAR(report["tree"]["volume"], volume, 1e-9 * volume);
  EXPECT_EQ(points + report["input"]["unexplained_points"].get<std::size_t>(), points_.size());
  EXPECT_GT(report["coverage"]["within_1_percent_of_height"], 0.9);
  EXPECT_GE(report["coverage"]["within_2_radii"], report["coverage"]["within_1_radius"].get<double>());
  for (const char* phase :
       {"scene", "graph", "clusters", "skeleton", "refine", "surfaces", "tree", "mesh", "quality", "io", "total"})
    EXPECT_GE(report["seconds"][phase], 0) << phase;
  const TriangleMesh mesh = read_mesh(in("out.obj"));
  EXPECT_EQ(std::set<std::int32_t>(mesh.labels.begin(), mesh.labels.end()).size(), branches);
  EXPECT_EQ(read_points(in("l.ply")).size(), points_.size());
  EXPECT_EQ(read_points(in("s.ply")).size(), report["tree"]["nodes"]);
  EXPECT_TRUE(read_text(in("p.png")).starts_with("\x89PNG"));
}

TEST_F(CliTree, ReadsPlyAndWritesIges) {
  ASSERT_EQ(run({"tree", in("tree.xyz"), "-o", in("a.ply"), "--labels", in("l.ply"), "--quiet"}).code, 0);
  ASSERT_EQ(run({"tree", in("l.ply"), "-o", in("b.ply"), "--threads", "1", "--quiet"}).code, 0);
  EXPECT_EQ(read_text(in("a.ply")), read_text(in("b.ply")));
  ASSERT_EQ(run({"tree", in("l.ply"), "-o", in("t.igs"), "--unit", "mm", "--quiet"}).code, 0);
  EXPECT_NE(read_text(in("t.igs")).find("branch_0"), std::string::npos);
}

// As LAS 1.2 whose unit is a GeoTIFF code.
std::string las_of(const std::vector<Vec3>& points, std::uint16_t unit) {
  std::string out(227, '\0');
  const auto put = [&](std::size_t at, const auto& value) { std::memcpy(out.data() + at, &value, sizeof(value)); };
  out.replace(0, 4, "LASF");
  out[24] = 1;
  out[25] = 2;
  put(94, std::uint16_t{227});
  put(100, std::uint32_t{1});
  put(105, std::uint16_t{20});
  put(107, static_cast<std::uint32_t>(points.size()));
  for (std::size_t k = 0; k < 3; ++k) put(131 + 8 * k, 1e-6);
  std::string record(54, '\0');
  record.replace(2, 15, "LASF_Projection");
  const std::array<std::uint16_t, 8> keys{1, 1, 0, 1, 3076, 0, 1, unit};
  const std::uint16_t id = 34735, length = sizeof(keys);
  std::memcpy(record.data() + 18, &id, 2);
  std::memcpy(record.data() + 20, &length, 2);
  out += record;
  out.append(reinterpret_cast<const char*>(keys.data()), sizeof(keys));
  put(96, static_cast<std::uint32_t>(out.size()));
  for (const Vec3& p : points) {
    std::array<std::int32_t, 5> point{};
    for (int k = 0; k < 3; ++k) point[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(std::lround(1e6 * p[k]));
    out.append(reinterpret_cast<const char*>(point.data()), sizeof(point));
  }
  return out;
}

TEST_F(CliTree, ReadsLasInItsUnit) {
  write_text("feet.las", las_of(points_, 9002));
  ASSERT_EQ(run({"tree", in("feet.las"), "-o", in("t.igs"), "--report", in("r.json"), "--quiet"}).code, 0);
  EXPECT_EQ(Json::parse(read_text(in("r.json")))["input"]["unit"], 0.3048);
  EXPECT_EQ(Json::parse(read_text(in("r.json")))["input"]["points"], points_.size());
  EXPECT_NE(read_text(in("t.igs")).find(",4,2HFT,"), std::string::npos);
  ASSERT_EQ(run({"tree", in("feet.las"), "-o", in("t.igs"), "--unit", "mm", "--quiet"}).code, 0);
  EXPECT_NE(read_text(in("t.igs")).find(",2,2HMM,"), std::string::npos);
  ASSERT_EQ(run({"tree", in("tree.xyz"), "-o", in("t.igs"), "--report", in("r.json"), "--quiet"}).code, 0);
  EXPECT_TRUE(Json::parse(read_text(in("r.json")))["input"]["unit"].is_null());
  EXPECT_NE(read_text(in("t.igs")).find(",6,1HM,"), std::string::npos);

  write_text("km.las", las_of(points_, 9036));
  ASSERT_EQ(run({"tree", in("km.las"), "-o", in("t.igs"), "--report", in("r.json"), "--quiet"}).code, 0);
  const Json report = Json::parse(read_text(in("r.json")));
  EXPECT_EQ(report["input"]["unit"], 1000);
  ASSERT_FALSE(report["warnings"].empty());
  EXPECT_NE(report["warnings"].back().get<std::string>().find("IGES has no unit"), std::string::npos);

  std::string packed = las_of(points_, 9001);
  packed[104] = '\x80';
  write_text("tree.laz", packed);
  expect_failure(1, {"tree", in("tree.laz"), "-o", in("t.obj")}, "laszip");
}

TEST_F(CliTree, WritesCylinders) {
  ASSERT_EQ(
      run({"tree", in("tree.xyz"), "-o", in("t.obj"), "--cylinders", in("c.csv"), "--report", in("r.json"), "--quiet"})
          .code,
      0);
  std::istringstream table(read_text(in("c.csv")));
  std::string line;
  std::getline(table, line);
  EXPECT_TRUE(line.starts_with("radius,length,start_x,")) << line;
  double volume = 0;
  while (std::getline(table, line)) {
    double radius = 0, length = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,", &radius, &length), 2) << line;
    volume += std::numbers::pi * radius * radius * length;
  }
  EXPECT_NEAR(volume, Json::parse(read_text(in("r.json")))["tree"]["volume"], 1e-9 * volume);
  expect_failure(1, {"tree", in("tree.xyz"), "-o", in("t.obj"), "--cylinders", in("c.txt")}, "c.txt");
}

TEST_F(CliTree, LeavesOutTheGround) {
  double low = points_[0].z, high = low;
  for (const Vec3& p : points_) {
    low = std::min(low, p.z);
    high = std::max(high, p.z);
  }
  const double ground = low + 0.1 * (high - low);
  ASSERT_EQ(run({"tree", in("tree.xyz"), "-o", in("t.obj"), "--ground", std::to_string(ground), "--report",
                 in("r.json"), "--quiet"})
                .code,
            0);
  EXPECT_GT(Json::parse(read_text(in("r.json")))["input"]["ground_points"], 0);
}

TEST_F(CliTree, TellsTheTreesOfAScene) {
  const test::SceneScan scan = test::scan_scene({.trees = 2, .points = 12'000, .bushes = 1, .random_seed = 3});
  std::string text;
  for (const Vec3& p : scan.points)
    text += std::to_string(p.x) + ' ' + std::to_string(p.y) + ' ' + std::to_string(p.z) + '\n';
  write_text("scene.xyz", text);
  const Result result = run({"tree", in("scene.xyz"), "-o", in("out.obj"), "--scene", "--cylinders", in("c.csv"),
                             "--labels", in("l.ply"), "--preview", in("p.png"), "--report", in("r.json")});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("of the ground"), std::string::npos);
  EXPECT_NE(result.out.find("tree 1"), std::string::npos);
  const Json report = Json::parse(read_text(in("r.json")));
  const Json& input = report["input"];
  ASSERT_EQ(report["trees"].size(), 2u);
  std::size_t points = 0, branches = 0;
  for (const Json& tree : report["trees"]) {
    EXPECT_EQ(tree["trunk"], branches);
    points += tree["points"].get<std::size_t>();
    branches += tree["branches"].get<std::size_t>();
    EXPECT_NEAR(tree["base"][2], tree["ground"].get<double>(), 0.5);
  }
  EXPECT_EQ(report["branches"].size(), branches);
  for (const char* part : {"ground_points", "wall_points", "low_plant_points", "stray_points", "unexplained_points"})
    points += input[part].get<std::size_t>();
  EXPECT_EQ(points, scan.points.size());
  EXPECT_EQ(input["walls"], 0);
  const std::vector<double> labels = read_vertex_attribute(in("l.ply"), "label"),
                            trees = read_vertex_attribute(in("l.ply"), "tree");
  EXPECT_EQ(std::count(labels.begin(), labels.end(), -3), input["ground_points"]);
  EXPECT_EQ(*std::max_element(trees.begin(), trees.end()), 1);
  EXPECT_NE(read_text(in("out.obj")).find("g branch_0_tree_0\n"), std::string::npos);
  const TriangleMesh mesh = read_mesh(in("out.obj"));
  EXPECT_EQ(std::set<std::int32_t>(mesh.labels.begin(), mesh.labels.end()).size(), branches);
  std::istringstream table(read_text(in("c.csv")));
  std::string line, last;
  std::getline(table, line);
  EXPECT_TRUE(line.ends_with(",added,tree")) << line;
  while (std::getline(table, line)) last = line;
  EXPECT_TRUE(last.ends_with(",0,2")) << last;

  ASSERT_EQ(
      run({"tree", in("scene.xyz"), "-o", in("out.ply"), "--ground", "auto", "--report", in("r.json"), "--quiet"}).code,
      0);
  EXPECT_EQ(Json::parse(read_text(in("r.json")))["input"]["ground_points"], input["ground_points"]);
  expect_failure(2, {"tree", in("scene.xyz"), "-o", in("t.obj"), "--scene", "--ground", "auto"}, "leave out auto");
  expect_failure(2, {"tree", in("scene.xyz"), "-o", in("t.obj"), "--scene", "--components", "separate"}, "--scene");
  expect_failure(2, {"tree", in("scene.xyz"), "-o", in("t.obj"), "--ground", "low"}, "neither a height nor auto");
  write_text("bush.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0.1\n");
  expect_failure(1, {"tree", in("bush.xyz"), "-o", in("t.obj"), "--scene"}, "no tree found");
}

TEST_F(CliTree, BadUsageAndInput) {
  const std::string tree = in("tree.xyz"), out = in("t.obj");
  expect_failure(2, {"tree", tree}, "-o is required");
  expect_failure(2, {"tree", tree, "-o", out, "--components", "some"}, "none of bridge, separate");
  expect_failure(2, {"tree", tree, "-o", out, "--unit", "mm"}, "only .igs");
  expect_failure(2, {"tree", tree, "-o", out, "--clusters", "0"}, "whole number");
  expect_failure(2, {"tree", tree, "-o", out, "--max-cluster-points", "3"}, "whole number");
  expect_failure(1, {"tree", tree, "-o", out, "--delta", "2"}, "delta");
  expect_failure(1, {"tree", tree, "-o", in("t.xyz")}, "t.xyz");
  expect_failure(1, {"tree", tree, "-o", out, "--skeleton", in("s.obj")}, "s.obj");
  expect_failure(1, {"tree", tree, "-o", out, "--ground", "1e9"}, "below the ground");
  expect_failure(1, {"tree", in("none.xyz"), "-o", out}, "none.xyz");
  write_text("few.xyz", "1 2 3\n4 5 6\n");
  expect_failure(1, {"tree", in("few.xyz"), "-o", out}, "too few");
  write_text("nan.xyz", "1 2 3\n4 nan 6\n");
  expect_failure(1, {"tree", in("nan.xyz"), "-o", out}, "nan.xyz");
}

}  // namespace
}  // namespace bisector
