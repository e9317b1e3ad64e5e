// What a descent by L-BFGS does with all seeds at once, wherever their backend keeps them: in the host's memory, or on
// a device, from which only a few numbers come back. Every implementation does the same operations in the same order.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "bisector/device.h"
#include "core/geometry.h"
#include "features/placed_seeds.h"
#include "voronoi/diagram.h"

namespace bisector {

// Of a pair of L-BFGS: the step s of all seeds, or the change y of the gradient.
enum class PairPart { step, change };

// Vectors of one Vec3 for each seed: the gradient, the direction, and the pairs, by number. Beside each pair there is
// one coefficient.
class DescentVectors {
 public:
  // Numbers of pairs are below.
  static constexpr std::size_t kMostPairs = 16;

  virtual ~DescentVectors() = default;

  // direction := -gradient
  virtual void start_direction() = 0;
  // coefficient := -(before + rho (v . direction)), with the pair's part v; `before` is the coefficient if `onto`, or
  // 0.
  virtual void project(std::size_t pair, PairPart part, double rho, bool onto) = 0;
  // direction += coefficient v, with the pair's part v
  virtual void add(std::size_t pair, PairPart part) = 0;
  // direction_i *= gamma w_i, with w_i = 1 / (2 m_i) of the iterate's step masses, and gamma = sy / sum_j |y_j|^2 w_j
  // of the pair, or 1 if there is none.
  virtual void weigh(std::optional<std::size_t> pair, double sy) = 0;
};

// Products of vectors, summed over seeds by the one rule of sums (core/parallel.h).
struct StepProducts {
  double slope = 0;               // of the iterate's gradient along the direction
  double next_slope = 0;          // of the gradient after the step along it
  double gradient_square = 0;     // of the gradient after the step
  double sy = 0, ss = 0, yy = 0;  // of the pair

  StepProducts& operator+=(const StepProducts& b) {
    slope += b.slope;
    next_slope += b.next_slope;
    gradient_square += b.gradient_square;
    sy += b.sy;
    ss += b.ss;
    yy += b.yy;
    return *this;
  }
};

// What a step has led to.
struct StepResult {
  double mass = 0, energy = 0;  // of all cells
  StepProducts products;
  std::size_t empty = 0;      // cells without points of seeds on the surface or inside a solid
  bool out_of_reach = false;  // of a device: nothing else counts then, and the iterate has to be brought back
  EvaluationReport report;
};

class SeedDescent {
 public:
  virtual ~SeedDescent() = default;

  virtual DescentVectors& vectors() = 0;
  // Moves the iterate's seeds by length * direction, puts them back to where they are held, and evaluates them. The
  // number of the pair is where s and y are left.
  virtual StepResult step(double length, std::size_t pair) = 0;
  // What the last step led to is the iterate.
  virtual void accept() = 0;
};

// Where a descent on a device starts.
struct DescentStart {
  const PlacedSeeds& seeds;
  const FeatureCurves& curves;
  const CellMoments& moments;
  const std::vector<Vec3>& gradient;
  // Of the surface at each seed, if seeds are held on it; then `moments` have triangles.
  const std::vector<Vec3>* normals;
  std::size_t pairs;  // of L-BFGS, by number from 0
};

// A descent whose seeds stay on a device. All of it throws DeviceError, and is good for nothing afterwards.
class ResidentDescent : public SeedDescent {
 public:
  // The seeds of an iterate that the host has as well, and how many had been accepted by then.
  struct Kept {
    PlacedSeeds seeds;
    int accepted = 0;
  };
  // Steps after which accepted seeds are kept.
  static constexpr int kKeepEvery = 10;

  // Good after a DeviceError too.
  virtual const Kept& kept() const = 0;
  // The iterate. `normals` are set where seeds are held on the surface.
  virtual void bring_back(PlacedSeeds& seeds, CellMoments& moments, std::vector<Vec3>& gradient,
                          std::vector<Vec3>& normals) = 0;
};

}  // namespace bisector
