// The program as the ranks of a run: rank 0 is the program, the others compute for it.
#include <csignal>
#include <cstdlib>

#include "cli/program.h"
#include "compute/compute.h"
#include "distributed/distributed_backend.h"
#include "distributed/ranks.h"
#include "mpi/mpi_communicator.h"

int main(int argc, char** argv) {
  bisector::mpi::MpiCommunicator communicator;
  unsetenv("OMPI_COMM_WORLD_SIZE");  // programs that this one starts are no ranks
  bisector::Ranks ranks(communicator);
  if (!ranks.is_root()) {
    // Rank 0 decides when to stop, for it may have a checkpoint to write.
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_IGN);
    bisector::serve(ranks);
    return 0;
  }
  bisector::set_ranks(&ranks);
  const int code = bisector::cli::run_program(argc, argv);
  bisector::set_ranks(nullptr);
  bisector::end_serving(ranks);
  return code;
}
