// Ranks as processes of MPI.
#pragma once

#include <string>
#include <vector>

#include "distributed/communicator.h"

namespace bisector::mpi {

// MPI for as long as the object lives; one in a process. What MPI finds wrong ends all ranks.
class MpiCommunicator : public Communicator {
 public:
  MpiCommunicator();
  ~MpiCommunicator() override;
  MpiCommunicator(const MpiCommunicator&) = delete;
  MpiCommunicator& operator=(const MpiCommunicator&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  std::vector<std::string> exchange(std::vector<std::string> to) override;

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace bisector::mpi
