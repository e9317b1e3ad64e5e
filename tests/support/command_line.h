// The program as a child process, in a folder of its own.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "bisector/io.h"
#include "support/models.h"

namespace bisector::test {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Result {
  int code = -1;  // -1: killed by a signal
  std::string out, err;
};

inline std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Whether the process has installed a handler for SIGINT.
inline bool catches_interrupts(pid_t process) {
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
    write_mesh(in("sphere.off"), icosphere(3));
  }
  // A daemon that a test started may be writing its last words there.
  ~Cli() override {
    std::error_code error;
    for (int k = 0; k < 50 && (fs::remove_all(folder_, error), error); ++k) ::usleep(100'000);
  }

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

}  // namespace bisector::test
