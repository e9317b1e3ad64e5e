// The program as several processes of MPI.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "bisector/io.h"
#include "support/command_line.h"
#include "support/models.h"

namespace bisector {
namespace {

using test::read_text;

class CliRanks : public test::Cli {
 protected:
  void SetUp() override {
    if (std::string(BISECTOR_MPIRUN).empty()) GTEST_SKIP() << "built without MPI";
    // As many as the test asks for, on however few cores, by whoever runs it.
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  }
  int run_ranks(int count, const std::string& arguments) const {
    const std::string command = std::string(BISECTOR_MPIRUN) + " --oversubscribe -n " + std::to_string(count) + " " +
                                BISECTOR_PROGRAM + " " + arguments + " > " + in("out") + " 2> " + in("err") +
                                " < /dev/null";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
};

TEST_F(CliRanks, WriteTheBytesOfOneProcess) {
  ASSERT_EQ(run({"remesh", in("sphere.off"), "-o", in("one.off"), "-n", "400"}).code, 0);
  ASSERT_EQ(
      run_ranks(3, "remesh " + in("sphere.off") + " -o " + in("three.off") + " -n 400 --report " + in("three.json")), 0)
      << read_text(in("err"));
  EXPECT_EQ(read_text(in("three.off")), read_text(in("one.off")));
  EXPECT_NE(read_text(in("three.json")).find(", 3 ranks\""), std::string::npos);
  EXPECT_NE(read_text(in("out")).find(", 3 ranks, double precision\n"), std::string::npos) << read_text(in("out"));
}

// A surface in parts takes no MPI, either.
TEST_F(CliRanks, ReadASurfaceInParts) {
  write_mesh(in("torus.ply"), test::torus(60, 40));
  ASSERT_EQ(run({"remesh-parts", in("torus.ply"), "-o", in("one.off"), "-n", "150"}).code, 0);
  ASSERT_EQ(run_ranks(2, "remesh-parts " + in("torus.ply") + " -o " + in("two.off") + " -n 150"), 0)
      << read_text(in("err"));
  EXPECT_EQ(read_text(in("two.off")), read_text(in("one.off")));
}

TEST_F(CliRanks, ErrorsAreOneLineAndEndAll) {
  for (const std::string command : {"remesh", "remesh-parts"}) {
    EXPECT_EQ(run_ranks(2, command + " " + in("missing.ply") + " -o " + in("out.off") + " -n 400"), 1);
    const std::string error = read_text(in("err"));
    EXPECT_NE(error.find("missing.ply"), std::string::npos) << error;
    EXPECT_EQ(error.find("bisector: "), error.rfind("bisector: ")) << error;
    EXPECT_FALSE(std::filesystem::exists(in("out.off")));
  }
}

// Its jobs would be ranks of nothing.
TEST_F(CliRanks, BatchesAreRefused) {
  write_text("jobs.jsonl", "{\"command\": \"quality\", \"input\": \"" + in("sphere.off") + "\"}\n");
  EXPECT_EQ(run_ranks(2, "batch " + in("jobs.jsonl") + " -o " + in("results")), 255);
  EXPECT_NE(read_text(in("err")).find("start it without mpirun"), std::string::npos) << read_text(in("err"));
  EXPECT_FALSE(std::filesystem::exists(in("results")));
}

// Ranks that would all do the same, and write the same file.
TEST_F(CliRanks, WithoutTheProgramForThemNothingIsDone) {
  const std::string lonely = in("lonely");
  std::filesystem::copy_file(BISECTOR_PROGRAM, lonely);
  setenv("OMPI_COMM_WORLD_SIZE", "4", 1);
  const int status =
      std::system((lonely + " remesh " + in("sphere.off") + " -o " + in("out.off") + " -n 50 2> " + in("err")).c_str());
  unsetenv("OMPI_COMM_WORLD_SIZE");
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_NE(read_text(in("err")).find("bisector-mpi"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(in("out.off")));
}

}  // namespace
}  // namespace bisector
