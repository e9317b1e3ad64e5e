#include "mpi/mpi_communicator.h"

#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <utility>

namespace bisector::mpi {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 29;  // MPI counts in int

// Others may compute for minutes. MPI would keep this core busy until they are done, which whoever computes on it would
// feel.
void wait_for(std::vector<MPI_Request>& requests) {
  using std::chrono::microseconds;
  constexpr int kAttempts = 1000;
  constexpr microseconds kLongest(200);
  microseconds nap(10);
  for (int attempt = 0;; ++attempt) {
    int done = 0;
    MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    if (done) return;
    if (attempt < kAttempts) {
      std::this_thread::yield();
      continue;
    }
    std::this_thread::sleep_for(nap);
    nap = std::min(kLongest, 2 * nap);
  }
}

template <class Start>
void for_each_piece(std::size_t size, const Start& start) {
  for (std::size_t begin = 0; begin < size; begin += kPiece)
    start(begin, static_cast<int>(std::min(kPiece, size - begin)));
}

}  // namespace

MpiCommunicator::MpiCommunicator() {
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiCommunicator::~MpiCommunicator() { MPI_Finalize(); }

std::vector<std::string> MpiCommunicator::exchange(std::vector<std::string> to) {
  const std::size_t ranks = to.size();
  std::vector<std::uint64_t> sent(ranks), coming(ranks);
  for (std::size_t r = 0; r < ranks; ++r) sent[r] = to[r].size();
  std::vector<MPI_Request> requests(1);
  MPI_Ialltoall(sent.data(), 1, MPI_UINT64_T, coming.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD, requests.data());
  wait_for(requests);

  requests.clear();
  const auto self = static_cast<std::size_t>(rank_);
  std::vector<std::string> received(ranks);
  for (std::size_t r = 0; r < ranks; ++r) {
    if (r == self) continue;
    received[r].resize(coming[r]);
    for_each_piece(coming[r], [&](std::size_t begin, int size) {
      MPI_Irecv(received[r].data() + begin, size, MPI_BYTE, static_cast<int>(r), 0, MPI_COMM_WORLD,
                &requests.emplace_back());
    });
  }
  for (std::size_t r = 0; r < ranks; ++r) {
    if (r == self) continue;
    for_each_piece(sent[r], [&](std::size_t begin, int size) {
      MPI_Isend(to[r].data() + begin, size, MPI_BYTE, static_cast<int>(r), 0, MPI_COMM_WORLD, &requests.emplace_back());
    });
  }
  received[self] = std::move(to[self]);
  wait_for(requests);
  return received;
}

}  // namespace bisector::mpi
