// The program as scripts see it: exit codes, one-line errors, reports, and files that appear whole or not at all.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bisector/cvt/compute.h"
#include "bisector/mesh/io.h"
#include "models.h"

namespace bisector {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Result {
  int code = -1;  // -1: killed by a signal
  std::string out, err;
};

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Whether the process has installed a handler for SIGINT.
bool catches_interrupts(pid_t process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("SigCgt:")) return std::stoull(line.substr(7), nullptr, 16) >> (SIGINT - 1) & 1;
  return false;
}

class Cli : public testing::Test {
 protected:
  Cli() {
    std::string name = (fs::temp_directory_path() / "bisector-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    work_ = folder_ / "work";
    fs::create_directory(work_);
    write_mesh(in("sphere.off"), test::icosphere(3));
  }
  ~Cli() override { fs::remove_all(folder_); }

  std::string in(const std::string& name) const { return (work_ / name).string(); }

  void write_text(const std::string& name, const std::string& text) const { std::ofstream(in(name)) << text; }

  pid_t start(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), BISECTOR_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    const std::string out = (folder_ / "out").string(), err = (folder_ / "err").string();
    posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t process = -1;
    EXPECT_EQ(posix_spawn(&process, BISECTOR_PROGRAM, &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    return process;
  }

  Result finish(pid_t process) const {
    int status = 0;
    EXPECT_EQ(waitpid(process, &status, 0), process);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(folder_ / "out"), read_text(folder_ / "err")};
  }

  Result run(std::vector<std::string> arguments) const { return finish(start(std::move(arguments))); }

  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(work_)) names.insert(entry.path().filename());
    return names;
  }

  // Expects one error line with `part` in it, nothing on stdout and no new file.
  void expect_failure(int code, const std::vector<std::string>& arguments, const std::string& part) const {
    const std::set<std::string> before = files();
    const Result result = run(arguments);
    std::string command;
    for (const std::string& argument : arguments) command += ' ' + argument;
    EXPECT_EQ(result.code, code) << command << '\n' << result.err;
    EXPECT_EQ(result.out, "") << command;
    EXPECT_TRUE(result.err.starts_with("bisector: error: ")) << command << '\n' << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << command << '\n' << result.err;
    EXPECT_TRUE(result.err.ends_with('\n')) << command;
    EXPECT_NE(result.err.find(part), std::string::npos) << command << '\n' << result.err;
    EXPECT_EQ(files(), before) << command;
  }

  Json report_of(const std::vector<std::string>& arguments) const {
    const Result result = run(arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    return Json::parse(result.out, nullptr, false);
  }

  fs::path folder_, work_;
};

// Without what may differ from run to run.
Json timeless(Json report) {
  report.erase("seconds");
  return report;
}

TEST_F(Cli, HelpAndVersion) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"--help"}, {"remesh", "--help"}, {"rvd", "--help"}, {"quality", "-h"}, {"check", "--help"}, {"--version"}}) {
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
  for (const char* device : {"vulkan:9999", "vulkan:00000000-0000-0000-0000-00000000dead", "vulkan:", "vulkan:x"}) {
    expect_failure(1, {"remesh", sphere, "-o", out, "-n", "10", "--device", device}, device);
    expect_failure(1, {"rvd", sphere, "-n", "10", "--device", device}, device);
    expect_failure(1, {"check", "--device", device, "--report", in("r.json")}, device);
  }
  expect_failure(1, {"remesh", sphere, "-o", out, "-n", "10", "--device", "cpu", "--precision", "single"}, "--precision");
  expect_failure(1, {"rvd", sphere, "-n", "10", "--device", "cpu", "--precision", "single"}, "--precision");
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
  for (const char* key : {"q_min", "q_ave", "theta_min", "theta_min_ave", "theta_below_30", "theta_max", "valence6",
                          "distance_mean", "distance_rms", "distance_max", "self_intersections"})
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
                      "--iterations", "2", "--report", "-"})["energy"].get<double>();
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

TEST_F(Cli, DevicesAreListed) {
  const DeviceList list = list_devices();
  const Json report = report_of({"devices", "--report", "-"});
  ASSERT_EQ(report["devices"].size(), 1 + list.devices.size());
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
  if (!best_gpu(list_devices()).empty()) GTEST_SKIP() << "there is a GPU";
  expect_failure(1, {"check"}, "no GPU");
}

TEST_F(Cli, AutomaticDeviceIsTheCpuWithoutAGpu) {
  if (!best_gpu(list_devices()).empty()) GTEST_SKIP() << "there is a GPU";
  const Json report = report_of({"rvd", in("sphere.off"), "-n", "50", "--report", "-"});
  EXPECT_EQ(report["device"]["kind"], "cpu");
  EXPECT_FALSE(report["device"].contains("fallback"));
  expect_failure(1, {"rvd", in("sphere.off"), "-n", "50", "--precision", "single"}, "--precision");
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
    reports.push_back(report_of({"rvd", in("sphere.off"), "-n", "300", "--device", word, "--pairs", in("pairs"),
                                 "--report", "-"}));
    pairs.push_back(read_text(in("pairs")));
  }
  EXPECT_NE(reports[1]["device"]["kind"], "cpu");
  EXPECT_EQ(reports[0]["rdt"], reports[1]["rdt"]);
  EXPECT_TRUE(pairs[0] == pairs[1]);
  for (const char* phase : {"transfer", "grid", "neighbours", "owners", "clip", "sort", "sum"})
    EXPECT_GE(reports[1]["device_seconds"].value(phase, -1.0), 0) << phase;
}

TEST_F(Cli, ADamagedPipelineCacheDoesNoHarm) {
  const std::string device = usable_device();
  if (device.empty()) GTEST_SKIP() << "no Vulkan device";
  const Variable cache("BISECTOR_CACHE", in("cache"));
  const auto pairs = [&] {
    const Result result = run({"rvd", in("sphere.off"), "-n", "50", "--device", device, "--pairs", in("pairs"), "--quiet"});
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

}  // namespace
}  // namespace bisector
