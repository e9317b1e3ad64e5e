// Batches as scripts see them: what fails costs nothing but itself, and nothing is done twice.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "bisector/io.h"
#include "support/command_line.h"
#include "support/solids.h"

namespace bisector {
namespace {

namespace fs = std::filesystem;
using test::Json;
using test::read_text;
using test::Result;

class CliBatch : public test::Cli {
 protected:
  std::string line(const std::string& name, int vertices) const {
    return fmt::format("{{\"command\": \"remesh\", \"input\": \"{}\", \"output\": \"{}\", \"n\": {}}}\n",
                       in("sphere.off"), in(name + ".off"), vertices);
  }

  // A program that does what the name of its output says, or else what bisector does; it notes each call.
  std::string misbehaving() const {
    write_text("program.sh", fmt::format(R"(#!/bin/bash
echo "$4" >>{0}
case $4 in
*crash*) kill -SEGV $$ ;;
*hang*) trap '' TERM; while :; do sleep 0.05; done ;;
*eat*) exec tail /dev/zero ;;
*leave*) sleep 1000 & exit 3 ;;
*slow*) sleep 0.3 ;;
esac
exec {1} "$@"
)",
                                         in("calls"), BISECTOR_PROGRAM));
    fs::permissions(in("program.sh"), fs::perms::owner_all);
    return in("program.sh");
  }

  std::map<std::string, int> calls() const {
    std::map<std::string, int> counts;
    std::ifstream file(in("calls"));
    for (std::string name; std::getline(file, name);) ++counts[fs::path(name).stem()];
    return counts;
  }

  Json record(const std::string& name) const { return Json::parse(read_text(in("results/" + name + ".json"))); }
  Json summary() const { return Json::parse(read_text(in("results/summary.json"))); }
  static bool has_program(const std::string& name) {
    return std::system(("PATH=$PATH:/usr/sbin command -v " + name + " >/dev/null").c_str()) == 0;
  }

  // The exit code of a command in the folder of the files, with the program as $BISECTOR.
  int shell(const std::string& command) const {
    const int status = std::system(
        fmt::format("cd '{}' && export BISECTOR='{}' && {} >{} 2>&1", in(""), BISECTOR_PROGRAM, command, in("shell"))
            .c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string shard_jobs() const {
    std::string jobs;
    for (int k = 0; k < 5; ++k) jobs += line(fmt::format("{}", k), 60);
    return jobs;
  }

  std::vector<std::string> batch(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"batch", in("jobs.jsonl"), "-o", in("results")});
    return more;
  }
};

TEST_F(CliBatch, RunsEachJobOnce) {
  write_text("jobs.jsonl", line("a", 100) + "\n" + line("b", 200) +
                               fmt::format("{{\"name\": \"measured\", \"command\": \"quality\", \"input\": \"{}\"}}\n",
                                           in("sphere.off")));
  const Result first = run(batch({"--jobs", "2"}));
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(first.err, "");
  EXPECT_EQ(record("a")["status"], "done");
  EXPECT_EQ(record("b")["report"]["output"]["vertices"], 200);
  EXPECT_EQ(record("measured")["report"]["command"], "quality");
  const Json table = summary();
  ASSERT_EQ(table["rows"].size(), 3u);
  EXPECT_EQ(table["statuses"], (Json{{"done", 3}}));
  EXPECT_EQ(table["rows"][0]["name"], "a");
  EXPECT_EQ(table["rows"][1]["vertices"], 200);
  EXPECT_GT(table["rows"][1]["theta_min"], 30);
  EXPECT_GT(table["rows"][1]["memory_mib"], 1);

  // The same result as the command's, and again the same summary, byte for byte, for nothing is run.
  EXPECT_EQ(run({"remesh", in("sphere.off"), "-o", in("b-alone.off"), "-n", "200"}).code, 0);
  EXPECT_EQ(read_text(in("b.off")), read_text(in("b-alone.off")));
  const std::string before = read_text(in("results/summary.json"));
  const Result second = run(batch());
  EXPECT_EQ(second.code, 0);
  EXPECT_NE(second.out.find("3 of them before"), std::string::npos) << second.out;
  EXPECT_EQ(read_text(in("results/summary.json")), before);

  // A changed line, a missing output and a changed input are done again, and nothing else.
  write_text("jobs.jsonl", line("a", 101) + line("b", 200) + line("c", 100));
  EXPECT_NE(run(batch()).out.find("1 of them before"), std::string::npos);
  fs::remove(in("b.off"));
  EXPECT_NE(run(batch()).out.find("2 of them before"), std::string::npos);
  // Older than the record, as a file is that has been moved here, and still another one.
  fs::last_write_time(in("sphere.off"), fs::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_NE(run(batch()).out.find("0 of them before"), std::string::npos);
  EXPECT_NE(run(batch()).out.find("3 of them before"), std::string::npos);
}

TEST_F(CliBatch, NoticesChangesOfAllFilesOfAJob) {
  write_text("kept.txt", "0\n");
  write_text("jobs.jsonl",
             line("a", 100).insert(1, fmt::format("\"keep_vertices\": \"{}\", ", in("kept.txt"))) + line("b", 100));
  EXPECT_EQ(run(batch()).code, 0);
  EXPECT_NE(run(batch()).out.find("2 of them before"), std::string::npos);
  write_text("kept.txt", "0\n1\n");
  EXPECT_NE(run(batch()).out.find("1 of them before"), std::string::npos);
}

// Numbers beside a Medit file are read with it; a job that replaces its own input does not run again for that.
TEST_F(CliBatch, KnowsWhatBelongsToAnInput) {
  const TetMesh solid = test::tet_box(3);
  write_tet_mesh(in("cube.mesh"), solid);
  const auto write_sizes = [&](double size) {
    std::string text =
        "MeshVersionFormatted 2\nDimension 3\nSolAtVertices " + std::to_string(solid.vertices.size()) + "\n1 1\n";
    for (std::size_t v = 0; v < solid.vertices.size(); ++v) text += std::to_string(size) + "\n";
    write_text("cube.sol", text + "End\n");
  };
  write_sizes(1);
  fs::copy_file(in("sphere.off"), in("own.off"));
  fs::create_symlink(in("own.off"), in("link.off"));
  write_text(
      "jobs.jsonl",
      fmt::format(
          "{{\"command\": \"tet\", \"input\": \"{0}\", \"output\": \"{1}\", \"n\": 50, \"density\": \"attribute:x\"}}\n"
          "{{\"command\": \"remesh\", \"input\": \"{2}\", \"output\": \"{3}\", \"n\": 50}}\n",
          in("cube.mesh"), in("out.mesh"), in("link.off"), in("own.off")));
  EXPECT_EQ(run(batch()).code, 0);
  EXPECT_NE(run(batch()).out.find("2 of them before"), std::string::npos);
  write_sizes(2.5);
  EXPECT_NE(run(batch()).out.find("1 of them before"), std::string::npos);
}

TEST_F(CliBatch, NamesOfJobsAreNoFilesOfOthers) {
  write_text("jobs.jsonl", line("a", 100).insert(1, "\"name\": \"x.report\", ") +
                               line("b", 100).insert(1, "\"name\": \"x\", ") +
                               line("c", 100).insert(1, "\"name\": \"x.json\", "));
  EXPECT_EQ(run(batch()).code, 0);
  for (const char* name : {"x.report", "x", "x.json"}) EXPECT_EQ(record(name)["status"], "done");
  EXPECT_NE(run(batch()).out.find("3 of 3 jobs done, 3 of them before"), std::string::npos);
}

TEST_F(CliBatch, CountsWhatWasDoneBefore) {
  write_text("jobs.jsonl", line("a", 100) + line("b", 100) + line("crash", 100));
  EXPECT_EQ(run(batch({"--program", misbehaving()})).code, 1);
  EXPECT_NE(run(batch({"--program", misbehaving()})).out.find("2 of 3 jobs done, 2 of them before"), std::string::npos);
  EXPECT_NE(run(batch({"--retry", "--program", misbehaving()})).out.find("2 of 3 jobs done, 2 of them before"),
            std::string::npos);
  EXPECT_NE(run(batch({"--retry"})).out.find("3 of 3 jobs done, 2 of them before"), std::string::npos);
}

TEST_F(CliBatch, TellsOfEachJobAtOnceAndKeepsTheSummary) {
  write_text("jobs.jsonl", line("a", 100) + line("hang", 100));
  const pid_t process = start(batch({"--program", misbehaving()}));
  while (!fs::exists(in("results/summary.html"))) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  kill(process, SIGKILL);
  EXPECT_NE(finish(process).out.find("done"), std::string::npos);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 1}, {"waiting", 1}}));
}

TEST_F(CliBatch, WhatFailsCostsNothingButItself) {
  std::string jobs;
  for (const char* name : {"a", "crash", "b", "hang", "c", "eat", "leave", "d"}) jobs += line(name, 100);
  jobs += fmt::format("{{\"command\": \"remesh\", \"input\": \"{}\", \"output\": \"{}\", \"n\": 100}}\n",
                      in("missing.off"), in("e.off"));
  write_text("jobs.jsonl", jobs);
  const Result result = run(batch({"--jobs", "3", "--timeout", "8", "--memory", "300MB", "--program", misbehaving()}));
  EXPECT_EQ(result.code, 5) << result.err;
  EXPECT_NE(result.err.find("5 of 9 jobs failed: crash, hang, eat, leave, e;"), std::string::npos) << result.err;
  for (const char* name : {"a", "b", "c", "d"}) {
    EXPECT_EQ(record(name)["status"], "done") << name;
    EXPECT_TRUE(fs::exists(in(std::string(name) + ".off"))) << name;
  }
  EXPECT_EQ(record("crash")["status"], "crashed");
  EXPECT_EQ(record("crash")["signal"], SIGSEGV);
  EXPECT_EQ(record("hang")["status"], "timeout");
  EXPECT_EQ(record("eat")["status"], "memory");
  EXPECT_EQ(record("leave")["exit_code"], 3);
  EXPECT_EQ(record("e")["status"], "failed");
  EXPECT_NE(record("e")["message"].get<std::string>().find("missing.off"), std::string::npos);
  ASSERT_EQ(summary()["failed"].size(), 5u);
  EXPECT_EQ(summary()["failed"][1]["name"], "hang");
  EXPECT_EQ(summary()["failed"][1]["message"], "took longer than 8 s");
  // What a job left behind is gone.
  std::size_t sleeping = 0;
  for (const auto& process : fs::directory_iterator("/proc"))
    sleeping += read_text(process.path() / "cmdline") == std::string("sleep\0001000\0", 11);
  EXPECT_EQ(sleeping, 0u);

  std::istringstream csv(read_text(in("results/summary.csv")));
  std::size_t lines = 0;
  for (std::string text; std::getline(csv, text);) ++lines;
  EXPECT_EQ(lines, 10u);
  EXPECT_TRUE(fs::exists(in("results/summary.html")));

  // What failed counts as done, unless it is to be tried again.
  const std::map<std::string, int> before = calls();
  EXPECT_EQ(run(batch({"--program", misbehaving()})).code, 5);
  EXPECT_EQ(calls(), before);
  write_text("jobs.jsonl", line("a", 100) + line("crash", 100));
  EXPECT_EQ(run(batch({"--retry"})).code, 0);
  EXPECT_EQ(record("crash")["status"], "done");
}

TEST_F(CliBatch, GoesOnWhereItWasKilled) {
  std::string jobs;
  for (int k = 0; k < 12; ++k) jobs += line(fmt::format("slow-{}", k), 50 + k);
  write_text("jobs.jsonl", jobs);
  const std::string program = misbehaving();
  const auto records = [&] {
    std::size_t count = 0;
    for (int k = 0; k < 12; ++k) count += fs::exists(in(fmt::format("results/slow-{}.json", k)));
    return count;
  };
  for (const int signal : {SIGKILL, SIGTERM}) {
    const pid_t process = start(batch({"--jobs", "2", "--program", program}));
    const std::size_t before = records();
    while (records() < before + 3) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    kill(process, signal);
    const Result result = finish(process);
    EXPECT_EQ(result.code, signal == SIGTERM ? 130 : -1) << result.err;
  }
  EXPECT_LT(records(), 12u);
  EXPECT_EQ(run(batch({"--jobs", "2", "--program", program})).code, 0);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 12}}));
  // At most those that ran when it was killed were begun a second time.
  int again = 0;
  for (const auto& [name, count] : calls()) again += count - 1;
  EXPECT_LE(again, 4);
}

TEST_F(CliBatch, ShardsMakeOneTable) {
  write_text("jobs.jsonl", shard_jobs());
  EXPECT_EQ(run(batch({"--shard", "1/2"})).code, 0);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 2}, {"waiting", 3}}));
  EXPECT_EQ(run(batch({"--shard", "0/2"})).code, 0);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 5}}));

  // Whoever ends last has the others' records, though they came while it ran.
  fs::remove_all(in("results"));
  std::vector<pid_t> shards;
  for (int k = 0; k < 3; ++k) shards.push_back(start(batch({"--shard", fmt::format("{}/3", k)})));
  for (const pid_t shard : shards) EXPECT_EQ(finish(shard).code, 0);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 5}}));
}

TEST_F(CliBatch, OneProcessRunsAShard) {
  write_text("jobs.jsonl", line("slow-a", 60) + line("slow-b", 60));
  const std::string program = misbehaving();
  const pid_t first = start(batch({"--program", program}));
  while (!fs::exists(in("calls"))) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  expect_failure(255, batch(), "are being run by another process");
  expect_failure(255, batch({"--shard", "1/2"}), "are being run by another process");
  EXPECT_EQ(finish(first).code, 0);

  // Shards that have a job in common, and such that have none.
  fs::remove_all(in("results"));
  fs::remove(in("calls"));
  const pid_t odd = start(batch({"--program", program, "--shard", "1/2"}));
  while (!fs::exists(in("calls"))) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  for (const char* shard : {"0/1", "3/4", "0/3"})
    expect_failure(255, batch({"--shard", shard}), "are being run by another process");
  EXPECT_EQ(run(batch({"--shard", "2/4"})).code, 0);
  EXPECT_EQ(finish(odd).code, 0);
}

// The recipes of cli.md.
TEST_F(CliBatch, GnuParallelRunsShards) {
  if (!has_program("parallel")) GTEST_SKIP() << "GNU parallel is not installed";
  write_text("jobs.jsonl", shard_jobs());
  EXPECT_EQ(shell("parallel --will-cite --jobs 2 $BISECTOR batch jobs.jsonl -o results --quiet --shard {}/3 ::: 0 1 2"),
            0);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 5}}));
  // Its exit code is the number of shards in which a job failed.
  write_text("jobs.jsonl", shard_jobs() + line("missing", 60).replace(0, 1, "{\"keep_vertices\": \"no.txt\", "));
  EXPECT_EQ(shell("parallel --will-cite --jobs 2 $BISECTOR batch jobs.jsonl -o results --quiet --shard {}/3 ::: 0 1 2"),
            1);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 5}, {"failed", 1}}));
}

TEST_F(CliBatch, SlurmRunsShards) {
  if (!has_program("slurmctld") || !has_program("munged")) GTEST_SKIP() << "Slurm is not installed";
  write_text("jobs.jsonl", shard_jobs());
  write_text("array.sh", R"(#!/bin/bash
$BISECTOR batch jobs.jsonl -o results --shard $SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT --jobs $SLURM_CPUS_ON_NODE
)");
  fs::create_directory(in("slurm"));
  const int code = shell(BISECTOR_SOURCE_DIR "/tests/cli/with_slurm slurm sbatch --quiet --wait --array=0-2 array.sh");
  if (code == 77) GTEST_SKIP() << "Slurm's daemons do not start here";
  EXPECT_EQ(code, 0);
  EXPECT_EQ(summary()["statuses"], (Json{{"done", 5}}));
}

TEST_F(CliBatch, BadJobsAreOneLineAndNothingIsRun) {
  const std::string good = line("a", 100);
  const auto expect = [&](const std::string& text, const std::string& part) {
    write_text("jobs.jsonl", text);
    expect_failure(255, batch(), part);
  };
  expect("", "has no jobs");
  expect(good + "remesh in.off\n", "line 2: is not JSON");
  expect("[1]\n", "line 1: is no JSON object");
  expect("{\"command\": \"mesh\", \"input\": \"a.off\"}\n", "line 1: there is no command \"mesh\"");
  expect("{\"command\": \"me\\nsh\", \"input\": \"a.off\"}\n", "line 1: there is no command \"me sh\"");
  expect("{\"command\": \"remesh\", \"input\": \"a.off\", \"output\": \"\"}\n", "is to be the name of a file");
  expect(line("a", 100).insert(1, "\"features\": [[30]], "), "\"features\" has lists in a list");
  expect("{\"command\": \"remesh\", \"output\": \"a.off\"}\n", "line 1: \"input\" is missing");
  expect(good + "\n" + line("b", 100).insert(1, "\"vertecis\": 5, "), "line 3: The following argument");
  expect(line("a", 100).insert(1, "\"report\": \"r.json\", "), "\"report\" cannot be given");
  expect(good + good, "line 2: " + in("a.off") + " is written by line 1, too");
  expect(line("a", 100).insert(1, "\"name\": \"x/y\", "), "\"x/y\" cannot be the name");
  expect(line("a", 100).insert(1, "\"name\": \"x\", ") + line("b", 100).insert(1, "\"name\": \"x\", "),
         "line 2: the name \"x\" is that of line 1");
  expect(line("a", 100).insert(1, "\"n\": 50, "), "line 1: \"n\" is given twice");
  expect(line("a", 100).insert(1, fmt::format("\"name\": \"{}\", ", std::string(260, 'x'))), "is too long for a file");
  expect(line(std::string(240, 'x'), 100), "is too long for a file");
  expect(good + fmt::format("{{\"command\": \"quality\", \"input\": \"{}\"}}\n", in("a.off")),
         "line 2: " + in("a.off") + " is written by line 1; jobs run in any order");
  expect(line("b", 100).insert(1, fmt::format("\"keep_vertices\": \"{}\", ", in("a.off"))) + good,
         "line 1: " + in("a.off") + " is written by line 2; jobs run in any order");
  expect(line("a", 100).insert(1, fmt::format("\"map\": \"{}\", ", in("results/a.json"))),
         "is a file of the batch itself");
  expect(line("a", 100).insert(1, fmt::format("\"map\": \"{}\", ", in("jobs.jsonl"))), "is a file of the batch itself");
  expect(line("a", 100).insert(1, fmt::format("\"map\": \"{}\", ", in("./results/.start.lock"))),
         "is a file of the batch itself");
  expect(line("a", 100) + fmt::format("{{\"command\": \"quality\", \"input\": \"{}\"}}\n", in("./a.off")),
         "written by line 1");
  write_text("jobs.jsonl", good);
  for (const char* size : {"8GX", "-1GB", "0", "GB", "1e30", "8 G B", "nan"})
    expect_failure(255, batch({std::string("--memory=") + size}), "is no size; give a number of bytes");
  expect_failure(255, batch({"--shard", "2/2"}), "--shard 2/2 is not INDEX/COUNT");
  expect_failure(255, {"batch", in("none.jsonl"), "-o", in("results")}, "none.jsonl: cannot be opened");
  expect_failure(255, {"batch", in("jobs.jsonl")}, "-o is required");
}

}  // namespace
}  // namespace bisector
