// What the ranks of a run need of whatever connects them.
#pragma once

#include <string>
#include <vector>

namespace bisector {

// One rank's end. Ranks are numbered from 0, and all call exchange() equally often.
class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  // Sends to[r] to rank r, for all ranks and itself. Returns what each rank has sent to this one.
  virtual std::vector<std::string> exchange(std::vector<std::string> to) = 0;
};

// The only rank of a run.
class OneRank : public Communicator {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }
  std::vector<std::string> exchange(std::vector<std::string> to) override { return to; }
};

}  // namespace bisector
