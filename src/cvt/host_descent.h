// Descents in the host's memory, and what starts every descent.
#pragma once

#include <array>
#include <vector>

#include "backend/seed_descent.h"
#include "checkpoint/bytes.h"
#include "cvt/lbfgs.h"
#include "cvt/run.h"

namespace bisector {

class HostVectors : public DescentVectors {
 public:
  struct Pair {
    std::vector<Vec3> step, change;
    double coefficient = 0;

    const std::vector<Vec3>& part(PairPart which) const { return which == PairPart::step ? step : change; }
  };

  // Of the iterate, of which they stay true: the gradient, and weights 1 / (2 m_i).
  HostVectors(const std::vector<Vec3>& gradient, const std::vector<double>& weights)
      : gradient_(gradient), weights_(weights) {}

  void start_direction() override;
  void project(std::size_t pair, PairPart part, double rho, bool onto) override;
  void add(std::size_t pair, PairPart part) override;
  void weigh(std::optional<std::size_t> pair, double sy) override;

  std::vector<Vec3> direction;
  std::array<Pair, kMostPairs> pairs;

 private:
  const std::vector<Vec3>& gradient_;
  const std::vector<double>& weights_;
};

// Seeds with all that is known about them.
struct Iterate {
  PlacedSeeds seeds;
  DiagramOfSeeds known;
  std::vector<Vec3> gradient;
  std::vector<Vec3> normals;  // of the surface at each seed, if constrained

  const CellMoments& moments() const { return known.diagram.moments; }
};

// The part of a seed's gradient dF/dx_i = 2 m_i (x_i - c_i) along what it is held on (thesis 4.4.2 and 4.4.3, equations
// 4.7 and 4.8). `normals` of the surface at each seed, or null if seeds may leave it.
std::vector<Vec3> gradient_of(const std::vector<Moments>& cells, const PlacedSeeds& seeds, const FeatureCurves& curves,
                              const std::vector<Vec3>* normals);
// sum |g_i|^2
double square_of(const std::vector<Vec3>& gradient);

class HostDescent : public SeedDescent {
 public:
  // `constrained`: seeds are held on the surface.
  HostDescent(CvtRun& run, bool constrained) : run_(run), constrained_(constrained) {}
  HostDescent(const HostDescent&) = delete;
  HostDescent& operator=(const HostDescent&) = delete;

  // Makes `now` the iterate: puts its seeds to where they are held, and evaluates them; those of empty cells are put
  // where the energy is highest. Throws Error if the diagram does not cover the domain.
  void start();
  // The same for seeds that an earlier descent left where they are held, with the normals of `now`.
  void go_on();
  // The pairs that take part in the next direction.
  void write_pairs(const Lbfgs& history, ByteWriter& out) const;
  void read_pairs(const Lbfgs& history, ByteReader& in);
  DescentVectors& vectors() override { return vectors_; }
  StepResult step(double length, std::size_t pair) override;
  void accept() override;

  Iterate now;

 private:
  void hold(const CellMoments& moments, const std::vector<Vec3>& before, Iterate& next) const;
  void measure(Iterate& iterate) const;
  void reseed();
  void set_weights();

  CvtRun& run_;
  bool constrained_;
  Iterate next_;
  std::vector<double> weights_;
  HostVectors vectors_{now.gradient, weights_};
};

}  // namespace bisector
