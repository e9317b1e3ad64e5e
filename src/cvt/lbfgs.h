// The limited-memory BFGS direction with a scaled diagonal initial Hessian (Nocedal and Wright, algorithm 7.4; Liu et
// al. 2009, "On centroidal Voronoi tessellation").
#pragma once

#include <deque>
#include <vector>

#include "backend/seed_descent.h"
#include "checkpoint/bytes.h"

namespace bisector {

class Lbfgs {
 public:
  // Keeps the last `memory` pairs, fewer than DescentVectors::kMostPairs.
  explicit Lbfgs(std::size_t memory = 7) : memory_(memory) {}

  void clear() { pairs_.clear(); }
  // How many pairs take part, the free one among them.
  std::size_t pairs() const { return memory_ + 1; }
  // The pair that is free for the next step.
  std::size_t free_pair() const { return next_; }
  // Keeps the free pair, whose products these are. It is dropped if it has no positive curvature.
  void push(double sy, double ss, double yy);
  // Numbers of the pairs that take part in the next direction.
  std::vector<std::size_t> numbers() const;
  // All but the vectors of the pairs.
  void write(ByteWriter& out) const;
  void read(ByteReader& in);
  // direction := -H gradient, with the initial inverse Hessian gamma diag(w), gamma = s'y / (y' diag(w) y) of the last
  // pair, or 1.
  void set_direction(DescentVectors& vectors) const;

 private:
  struct Pair {
    std::size_t number;
    double sy, rho;  // rho = 1 / s'y
  };
  std::size_t memory_;
  std::size_t next_ = 0;
  std::deque<Pair> pairs_;
};

}  // namespace bisector
