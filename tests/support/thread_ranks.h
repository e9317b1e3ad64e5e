// Ranks of a run as threads of one process.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "distributed/communicator.h"
#include "distributed/distributed_backend.h"
#include "distributed/ranks.h"

namespace bisector::test {

// Where threads put messages for each other.
class Exchange {
 public:
  explicit Exchange(std::size_t size) : messages_(size) {}

  std::size_t size() const { return messages_.size(); }
  std::vector<std::string> pass(std::size_t rank, std::vector<std::string> to) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !handing_out_; });
    messages_[rank] = std::move(to);
    if (++arrived_ == size()) {
      handing_out_ = true;
      changed_.notify_all();
    }
    changed_.wait(lock, [&] { return handing_out_; });
    std::vector<std::string> received;
    for (std::vector<std::string>& from : messages_) received.push_back(std::move(from[rank]));
    if (--arrived_ == 0) {
      handing_out_ = false;
      changed_.notify_all();
    }
    return received;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::vector<std::string>> messages_;  // by sender
  std::size_t arrived_ = 0;
  bool handing_out_ = false;
};

class ThreadCommunicator : public Communicator {
 public:
  ThreadCommunicator(Exchange& exchange, std::size_t rank) : exchange_(exchange), rank_(rank) {}
  int rank() const override { return static_cast<int>(rank_); }
  int size() const override { return static_cast<int>(exchange_.size()); }
  std::vector<std::string> exchange(std::vector<std::string> to) override {
    return exchange_.pass(rank_, std::move(to));
  }

 private:
  Exchange& exchange_;
  std::size_t rank_;
};

// Rank 0 is the thread that owns it; the others serve it.
class ThreadRanks {
 public:
  explicit ThreadRanks(std::size_t size) : exchange_(size), communicator_(exchange_, 0), root_(communicator_) {
    for (std::size_t rank = 1; rank < size; ++rank)
      others_.emplace_back([this, rank] {
        ThreadCommunicator communicator(exchange_, rank);
        Ranks ranks(communicator);
        serve(ranks);
      });
  }
  ~ThreadRanks() {
    end_serving(root_);
    for (std::thread& other : others_) other.join();
  }

  Ranks& root() { return root_; }

 private:
  Exchange exchange_;
  ThreadCommunicator communicator_;
  Ranks root_;
  std::vector<std::thread> others_;
};

}  // namespace bisector::test
