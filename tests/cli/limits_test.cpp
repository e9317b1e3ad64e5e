// Runs that the system gives too little memory or disk, or whose reader goes away.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "bisector/error.h"
#include "job/outputs.h"
#include "support/command_line.h"

namespace bisector {
namespace {

namespace fs = std::filesystem;
using test::read_text;
using test::Result;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // whose own memory is without measure
#else
constexpr bool kSanitized = false;
#endif

class CliLimits : public test::Cli {
 protected:
  CliLimits() {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> turn(0, 6.283), up(0, 3);
    std::string points;
    for (int k = 0; k < 3000; ++k) {
      const double angle = turn(random);
      points += std::to_string(0.1 * std::cos(angle)) + ' ' + std::to_string(0.1 * std::sin(angle)) + ' ' +
                std::to_string(up(random)) + '\n';
    }
    write_text("stem.xyz", points);
  }

  // Runs that leave the file "out.*" that they name.
  struct Run {
    std::vector<std::string> words;
    std::string output;
  };
  std::vector<Run> runs() const {
    const std::string sphere = in("sphere.off");
    return {{{"remesh", sphere, "-n", "800", "-o", in("out.off")}, "out.off"},
            {{"rvd", sphere, "-n", "200", "-o", in("out.ply")}, "out.ply"},
            {{"tet", sphere, "-n", "400", "-o", in("out.mesh")}, "out.mesh"},
            {{"segment", sphere, "--proxies", "8", "-o", in("out.ply")}, "out.ply"},
            {{"tree", in("stem.xyz"), "-o", in("out.obj")}, "out.obj"},
            {{"quality", sphere, "--report", in("out.json")}, "out.json"}};
  }

  // One line of error, and of files only the old one.
  void expect_nothing_lost(const Result& result, const Run& run, const std::string& what) const {
    EXPECT_EQ(result.code, 1) << what;
    EXPECT_TRUE(result.err.starts_with("bisector: error: ")) << what << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << what << result.err;
    EXPECT_EQ(read_text(in(run.output)), "old") << what;
  }
};

TEST_F(CliLimits, TooLittleMemoryIsSaidAndNothingIsLost) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need more memory than that";
  for (const Run& one : runs()) {
    std::string whole;
    if (one.words.front() != "quality") {
      ASSERT_EQ(run(one.words).code, 0);
      whole = read_text(in(one.output));
    }
    int refused = 0, done = 0;
    std::vector<int> sizes{2, 1000};
    for (int mebibytes = 6; mebibytes < 30; mebibytes += 2) sizes.push_back(mebibytes);  // where it begins to be enough
    for (const int mebibytes : sizes) {
      write_text(one.output, "old");
      const std::set<std::string> before = files();
      std::vector<std::string> words = one.words;
      const std::string memory = std::to_string(mebibytes) + "MB";
      words.insert(words.end(), {"--threads", mebibytes % 4 ? "1" : "2", "--memory", memory});
      const std::string what = one.words.front() + " in " + memory + ": ";
      const Result result = run(words);
      EXPECT_EQ(files(), before) << what;
      (result.code == 0 ? done : refused)++;
      if (result.code != 0) {
        expect_nothing_lost(result, one, what);
      } else if (!whole.empty()) {
        EXPECT_EQ(read_text(in(one.output)), whole) << what;
      }
    }
    EXPECT_GT(refused, 0) << one.words.front();
    EXPECT_GT(done, 0) << one.words.front();
  }
}

TEST_F(CliLimits, MemoryIsASize) {
  for (const char* size : {"0", "0x", "-5MB", "much"})
    expect_failure(2, {"quality", in("sphere.off"), "--memory", size}, "--memory");
}

// The limit of files stands for a full disk.
TEST_F(CliLimits, AFullDiskIsSaidAndNothingIsLost) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small{600, limit.rlim_max};
  for (const Run& one : runs()) {
    write_text(one.output, "old");
    const std::set<std::string> before = files();
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const pid_t process = start(one.words);
    setrlimit(RLIMIT_FSIZE, &limit);
    const Result result = finish(process);
    expect_nothing_lost(result, one, one.words.front() + ": ");
    EXPECT_NE(result.err.find(in(one.output) + ": cannot be written"), std::string::npos) << result.err;
    EXPECT_EQ(files(), before) << one.words.front();
  }
}

TEST_F(CliLimits, StandardStreamsThatAreClosedAreNotTheOutputs) {
  const std::string whole = in("whole.off"), output = in("out.off"), report = in("out.json");
  ASSERT_EQ(run({"remesh", in("sphere.off"), "-n", "200", "-o", whole}).code, 0);
  const std::string words = std::string(BISECTOR_PROGRAM) + " remesh " + in("sphere.off") + " -n 200 --verbose -o " +
                            output + " --report " + report;
  for (const char* closed : {" >&-", " 2>&- >/dev/null", " <&- >&- 2>&-", " | true"}) {
    fs::remove(output);
    fs::remove(report);
    ASSERT_NE(std::system((words + closed).c_str()), -1);
    EXPECT_EQ(read_text(output), read_text(whole)) << closed;
    EXPECT_TRUE(test::Json::accept(read_text(report))) << closed;
  }
}

// Whichever of them fails, and whether it is written first or last.
TEST_F(CliLimits, OutputsAppearTogether) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const std::vector<std::string> words{"remesh",      in("sphere.off"), "-n",          "100",      "-o",
                                       in("out.off"), "--preview",      in("out.png"), "--report", in("out.json")};
  ASSERT_EQ(run(words).code, 0);
  std::set<std::uintmax_t> sizes;
  for (const char* name : {"out.off", "out.png", "out.json"}) {
    sizes.insert(fs::file_size(in(name)));
    write_text(name, "old");
  }
  ASSERT_EQ(sizes.size(), 3u);
  sizes.erase(*sizes.rbegin());
  const std::set<std::string> before = files();
  for (const std::uintmax_t size : sizes) {  // room for one of the three, and for two
    const rlimit small{size, limit.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const pid_t process = start(words);
    setrlimit(RLIMIT_FSIZE, &limit);
    EXPECT_EQ(finish(process).code, 1);
    for (const char* name : {"out.off", "out.png", "out.json"}) EXPECT_EQ(read_text(in(name)), "old") << name << size;
    EXPECT_EQ(files(), before);
  }
  std::vector<std::string> to_stdout(words.begin(), words.end() - 1);
  to_stdout.push_back("-");
  std::string command = BISECTOR_PROGRAM;
  for (const std::string& word : to_stdout) command += ' ' + word;
  EXPECT_EQ(WEXITSTATUS(std::system((command + " > /dev/full 2> " + in("err")).c_str())), 1);
  EXPECT_EQ(read_text(in("out.off")), "old");
  EXPECT_NE(read_text(in("err")).find("the report cannot be written to stdout"), std::string::npos);
}

// Where what is printed is all that there is.
TEST_F(CliLimits, TextThatCannotBePrintedIsAnError) {
  const std::string program = BISECTOR_PROGRAM, sphere = in("sphere.off"), full = " > /dev/full 2> " + in("err");
  for (const std::string& words : {"quality " + sphere, std::string("devices"), std::string("--version"),
                                   std::string("remesh --help"), "rvd " + sphere + " -n 20"}) {
    EXPECT_EQ(WEXITSTATUS(std::system((program + ' ' + words + full).c_str())), 1) << words;
    EXPECT_NE(read_text(in("err")).find("bisector: error: what is printed cannot be written to stdout"),
              std::string::npos)
        << words << read_text(in("err"));
  }
  EXPECT_EQ(WEXITSTATUS(std::system((program + " quality " + sphere + " --report " + in("q.json") + full).c_str())), 0);
  EXPECT_EQ(WEXITSTATUS(std::system((program + " quality " + sphere + " --quiet" + full).c_str())), 0);
}

// Nobody opens the other end.
TEST_F(CliLimits, APipeThatDoesNotOpenIsGivenUpAtOnce) {
  ASSERT_EQ(mkfifo(in("pipe.off").c_str(), 0600), 0);
  const pid_t process = start({"quality", in("pipe.off")});
  while (!test::catches_interrupts(process)) ::usleep(1000);
  ::usleep(100'000);
  kill(process, SIGTERM);
  const Result result = finish(process);
  EXPECT_EQ(result.code, 130);
  EXPECT_EQ(result.err, "bisector: cancelled\n");
}

// As do machines of a cluster, or threads that use the C interface.
TEST_F(CliLimits, RunsThatWriteToOneFolderDoNotMeet) {
  std::vector<std::thread> threads;
  std::atomic<int> refused = 0;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, path = in(std::to_string(t) + ".off")] {
      for (int k = 0; k < 500; ++k) try {
          job::check_outputs({{path, {}}}, {});
        } catch (const Error&) {
          ++refused;
        }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(refused, 0);
}

// Warnings, the summary and errors are lost there, nothing else.
TEST_F(CliLimits, FullDiskBehindStderrStopsNoRun) {
  const std::string full = " --report - 2> /dev/full > /dev/null", program = BISECTOR_PROGRAM, output = in("out.off");
  const std::string warned = program + " remesh " + in("cube.off") + " -n 50 -o " + output;
  write_mesh(in("cube.off"), test::box(1));
  ASSERT_NE(run({"remesh", in("cube.off"), "-n", "50", "-o", output}).err.find("warning"), std::string::npos);
  fs::remove(output);
  EXPECT_EQ(WEXITSTATUS(std::system((warned + full).c_str())), 0);
  EXPECT_TRUE(fs::exists(output));
  EXPECT_EQ(WEXITSTATUS(std::system((program + " quality " + in("missing.off") + full).c_str())), 1);
}

}  // namespace
}  // namespace bisector
