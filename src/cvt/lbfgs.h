// The limited-memory BFGS direction with a scaled diagonal initial Hessian (Nocedal and Wright, algorithm 7.4; Liu et
// al. 2009, "On centroidal Voronoi tessellation").
#pragma once

#include <deque>
#include <vector>

#include "core/geometry.h"

namespace bisector {

class Lbfgs {
 public:
  // Keeps the last `memory` pairs.
  explicit Lbfgs(std::size_t memory = 7) : memory_(memory) {}

  void clear() { pairs_.clear(); }
  // Adds the step s = x_new - x_old and the change of gradient y. Pairs without positive curvature are dropped.
  void push(std::vector<Vec3> s, std::vector<Vec3> y);
  // -H g, with the initial inverse Hessian gamma diag(1 / d_i), gamma = s'y / (y' diag(1 / d_i) y) of the last pair,
  // or 1.
  std::vector<Vec3> direction(const std::vector<Vec3>& g, const std::vector<double>& d) const;

 private:
  struct Pair {
    std::vector<Vec3> s, y;
    double sy;
  };
  std::size_t memory_;
  std::deque<Pair> pairs_;
};

// Sum of a_i . b_i by the fixed tree of parallel.h.
double inner(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

}  // namespace bisector
