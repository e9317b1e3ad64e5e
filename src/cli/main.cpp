// The program, which makes way for bisector-mpi where it is one of several ranks.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "console.h"
#include "program.h"

int main(int argc, char** argv) {
  const char* ranks = std::getenv("OMPI_COMM_WORLD_SIZE");  // Open MPI's launcher sets it
  if (!ranks || std::string(ranks) == "1") return bisector::cli::run_program(argc, argv);
  std::error_code error;
  const std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / "bisector-mpi";
  execv(program.c_str(), argv);
  bisector::cli::print_error("this is one of " + std::string(ranks) + " ranks, and there is no " + program.string() +
                             ", which divides work among them; install it, or start the program without mpirun");
  return bisector::cli::kFailure;
}
