// Runs that are stopped or killed, and go on: as scripts and schedulers see them.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "support/command_line.h"

namespace bisector {
namespace {

namespace fs = std::filesystem;
using test::read_text;
using test::Result;

class CliCheckpoint : public test::Cli {
 protected:
  std::vector<std::string> remesh(const std::string& output, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"remesh", in("sphere.off"), "-o", in(output), "-n", "1500"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::vector<std::string> kept(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"--checkpoint", in("run.ckpt"), "--checkpoint-every", "0"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::string whole(const std::vector<std::string>& words, const std::string& output) const {
    const Result result = run(words);
    EXPECT_EQ(result.code, 0) << result.err;
    return read_text(in(output));
  }
  // Until more than the first line is in the file, or the process has ended.
  void wait_for_checkpoint(pid_t process) const {
    std::error_code error;
    siginfo_t ended{};
    for (;;) {
      const std::uintmax_t size = fs::file_size(in("run.ckpt"), error);
      if ((!error && size > 1000) ||
          (waitid(P_PID, static_cast<id_t>(process), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid != 0))
        return;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  // Kills the run after longer and longer times until it ends by itself.
  void kill_until_it_ends(const std::vector<std::string>& words, const std::string& output,
                          const std::string& result) const {
    const std::string old = read_text(in(output));
    int kills = 0;
    for (;; ++kills) {
      const pid_t process = start(words);
      if (kills % 2 == 0) wait_for_checkpoint(process);
      std::this_thread::sleep_for(std::chrono::milliseconds(7 * kills));
      kill(process, SIGKILL);
      const int code = finish(process).code;
      const std::string now = read_text(in(output));
      EXPECT_TRUE(now == (code == 0 ? result : old) || now == result) << "after " << kills << " kills";
      if (code == 0) break;
    }
    EXPECT_GT(kills, 2);
    EXPECT_FALSE(fs::exists(in("run.ckpt")));
  }
};

TEST_F(CliCheckpoint, SigtermWritesOneAndResumeGoesOn) {
  const std::vector<std::string> options{"--random-seed", "18446744073709551615", "--tolerance", "1e-7"};
  const std::string expected = whole(remesh("whole.off", options), "whole.off");
  const pid_t process = start(remesh("out.off", kept(options)));
  wait_for_checkpoint(process);
  kill(process, SIGTERM);
  const Result stopped = finish(process);
  ASSERT_EQ(stopped.code, 130) << stopped.err;
  EXPECT_NE(stopped.err.find("run.ckpt has what was done; --resume goes on from it"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(in("out.off")));

  // Of another run it is not taken, and not overwritten.
  expect_failure(1, remesh("out.off", kept(options)), "run.ckpt: is there already");
  // As doubles these two seeds are the same.
  expect_failure(1,
                 remesh("out.off", kept({"--resume", "--random-seed", "18446744073709551614", "--tolerance", "1e-7"})),
                 "other options");

  // A number may be written otherwise.
  const Result resumed = run(remesh("out.off", kept({"--resume", "--threads", "1", "--random-seed",
                                                     "018446744073709551615", "--tolerance", "0.0000001"})));
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_NE(resumed.err.find("run.ckpt has "), std::string::npos) << resumed.err;
  EXPECT_EQ(read_text(in("out.off")), expected);
  EXPECT_FALSE(fs::exists(in("run.ckpt")));
}

TEST_F(CliCheckpoint, KilledRemeshGoesOn) {
  const std::string expected = whole(remesh("whole.off"), "whole.off");
  write_text("out.off", "what was there before");
  kill_until_it_ends(remesh("out.off", kept({"--resume"})), "out.off", expected);
}

TEST_F(CliCheckpoint, KilledTetGoesOn) {
  const auto words = [&](const std::string& output) {
    return std::vector<std::string>{"tet", in("sphere.off"), "-o", in(output), "-n", "300"};
  };
  const std::string expected = whole(words("whole.mesh"), "whole.mesh");
  std::vector<std::string> resumed = words("out.mesh");
  for (const std::string& word : kept({"--resume"})) resumed.push_back(word);
  kill_until_it_ends(resumed, "out.mesh", expected);
}

TEST_F(CliCheckpoint, BadUsage) {
  expect_failure(2, remesh("out.off", {"--resume"}), "--resume: it is for --checkpoint");
  expect_failure(2, remesh("out.off", {"--checkpoint-every", "5"}), "--checkpoint-every: it is for --checkpoint");
  expect_failure(1, remesh("out.off", {"--checkpoint", in("none/run.ckpt")}), "run.ckpt: the folder");
  expect_failure(1, remesh("out.off", {"--checkpoint", in("sphere.off"), "--resume"}), "would replace an input");
  // It is removed in the end, and what has its name with it.
  expect_failure(1, remesh("out.off", {"--checkpoint", in("out.off")}), "two outputs have this name");
  expect_failure(1, remesh("out.off", {"--checkpoint", in("r.json"), "--report", in("r.json")}), "two outputs have");
  // Bad input leaves no file behind.
  expect_failure(1, {"remesh", in("none.off"), "-o", in("out.off"), "-n", "100", "--checkpoint", in("run.ckpt")},
                 "none.off");
}

}  // namespace
}  // namespace bisector
