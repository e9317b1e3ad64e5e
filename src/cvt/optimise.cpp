#include "cvt/optimise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "core/parallel.h"
#include "core/stopwatch.h"
#include "cvt/constrain.h"
#include "cvt/lbfgs.h"
#include "cvt/multilevel.h"

namespace bisector {
namespace {

constexpr double kArmijo = 1e-4;            // share of the slope's promise that a step must keep
constexpr double kFlatGradient = 1e-8;      // relative to the first; what is left is rounding
constexpr int kLineSearchTrials = 8;        // evaluations per step at most
constexpr std::size_t kDecreaseWindow = 5;  // steps over which the energy's fall is judged
constexpr std::size_t kMemory = 8;          // energies that a step is measured against if diagrams are localised
constexpr int kReseedTrials = 10;           // rounds of giving empty cells another place

using Kind = SeedPlace::Kind;

// Seeds with all that is known about them.
struct Iterate {
  PlacedSeeds seeds;
  DiagramOfSeeds known;
  std::vector<Vec3> gradient;
  std::vector<Vec3> normals;  // of the surface at each seed, if constrained
  double energy = 0;
  double gradient_norm = 0;

  const CellMoments& moments() const { return known.diagram.moments; }
};

// The part of a seed's gradient along what it is held on (thesis 4.4.2 and 4.4.3, equations 4.7 and 4.8).
Vec3 held(const Vec3& g, const SeedPlace& place, const FeatureCurves& curves, const Vec3* normal) {
  switch (place.kind) {
    case Kind::fixed: return {};
    case Kind::curve: {
      const Vec3 tangent = curves.tangent(place.curve, place.position);
      return dot(g, tangent) * tangent;
    }
    case Kind::interior: return g;
    case Kind::surface: break;
  }
  return normal ? g - dot(g, *normal) * *normal : g;
}

std::vector<Vec3> gradient_of(const std::vector<Moments>& cells, const PlacedSeeds& seeds, const FeatureCurves& curves,
                              const std::vector<Vec3>* normals) {
  std::vector<Vec3> gradient(seeds.size());
  parallel_each(seeds.size(), [&](std::size_t i) {
    gradient[i] = held(-2.0 * cells[i].first, seeds.place(i), curves, normals ? &(*normals)[i] : nullptr);
  });
  return gradient;
}

double length_of(const std::vector<Vec3>& gradient) { return std::sqrt(inner(gradient, gradient)); }

bool is_lost(const Iterate& now, std::size_t i) {
  const Kind kind = now.seeds.kind(i);
  return now.moments().cells[i].mass <= 0 && (kind == Kind::surface || kind == Kind::interior);
}

bool has_empty_cell(const Iterate& now) {
  for (std::size_t i = 0; i < now.seeds.size(); ++i)
    if (is_lost(now, i)) return true;
  return false;
}

// Puts seeds inside a solid that own nothing into the cells of highest energy, half the root mean square distance of
// their points from the seed.
void reseed_interior(const std::vector<Moments>& cells, const std::vector<Index>& empty, std::span<Vec3> positions) {
  std::vector<Index> order;
  for (Index i = 0; i < cells.size(); ++i)
    if (cells[i].mass > 0) order.push_back(i);
  const std::size_t count = std::min(empty.size(), order.size());
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
      [&](Index a, Index b) { return cells[a].second != cells[b].second ? cells[a].second > cells[b].second : a < b; });
  for (std::size_t k = 0; k < count; ++k) {
    const Moments& cell = cells[order[k]];
    const Vec3 towards = (1 / cell.mass) * cell.first;
    const double length = norm(towards), spread = 0.5 * std::sqrt(cell.second / cell.mass);
    const Vec3 step = length > 0.1 * spread ? (spread / length) * towards : Vec3{spread, 0, 0};
    positions[empty[k]] = positions[order[k]] + step;
  }
}

std::vector<double> preconditioner(const CellMoments& moments) {
  const double mean = moments.mass / static_cast<double>(moments.cells.size());
  std::vector<double> d(moments.step_mass.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = 2 * (moments.step_mass[i] > 0 ? moments.step_mass[i] : mean);
  return d;
}

}  // namespace

// The iterates of one optimisation, with the run's seeds, diagram and normals while it lasts.
class Descent {
 public:
  Descent(CvtRun& run, const OptimiseOptions& options) : run_(run), options_(options) {
    now_.seeds = std::move(run.seeds);
    now_.known = std::move(run.diagram_);
    now_.normals = std::move(run.normals_);
  }

  void minimise();

 private:
  void hold(const CellMoments& moments, const std::vector<Vec3>& before, Iterate& next) const;
  void measure(Iterate& iterate) const;
  void reseed();
  void start();
  bool is_descent(const std::vector<Vec3>& direction, double slope, double step) const;
  bool line_search(const std::vector<Vec3>& direction);
  void accept();
  void hand_back();

  CvtRun& run_;
  const OptimiseOptions& options_;
  Lbfgs history_;
  Iterate now_, next_;
  std::vector<double> energies_;  // of all iterates
};

// Puts the seeds back to where they are held. `moments` are those of the cells before the seeds moved, `before` where
// they were then.
void Descent::hold(const CellMoments& moments, const std::vector<Vec3>& before, Iterate& next) const {
  const std::span<Vec3> positions = next.seeds.edit_positions();
  const std::span<SeedPlace> places = next.seeds.edit_places();
  if (options_.constrained) project_to_cells(run_.surface(), moments.triangles, places, positions, next.normals);
  for (std::size_t i = 0; i < places.size(); ++i) {
    SeedPlace& place = places[i];
    if (place.kind == Kind::fixed) positions[i] = before[i];
    if (place.kind != Kind::curve) continue;
    const double reach = 2 * norm(positions[i] - before[i]);
    place.position = run_.curves().nearest(place.curve, positions[i], place.position, reach);
    positions[i] = run_.curves().point(place.curve, place.position);
  }
}

void Descent::measure(Iterate& iterate) const {
  const Want want = options_.constrained ? Want::triangles : Want::moments;
  run_.evaluate(iterate.seeds.positions(), want, iterate.known);
  const CellMoments& moments = iterate.moments();
  iterate.energy = run_.covers(iterate.known.diagram) ? moments.energy : std::numeric_limits<double>::infinity();
  iterate.gradient =
      gradient_of(moments.cells, iterate.seeds, run_.curves(), options_.constrained ? &iterate.normals : nullptr);
  iterate.gradient_norm = length_of(iterate.gradient);
}

// Puts the seeds of empty cells at far corners of the cells of highest energy.
void Descent::reseed() {
  run_.evaluate(now_.seeds.positions(), Want::polygons, now_.known);
  std::vector<Index> empty, inside;
  for (Index i = 0; i < now_.seeds.size(); ++i)
    if (is_lost(now_, i)) (now_.seeds.kind(i) == Kind::interior ? inside : empty).push_back(i);
  const std::span<Vec3> positions = now_.seeds.edit_positions();
  reseed_interior(now_.moments().cells, inside, positions);
  const std::vector<Vec3> points = insertion_points(now_.known.diagram, now_.seeds, empty.size());
  for (std::size_t k = 0; k < points.size(); ++k) positions[empty[k]] = points[k];
}

void Descent::start() {
  for (int trial = 0;; ++trial) {
    run_.context().check();
    if (options_.constrained) {
      run_.evaluate(now_.seeds.positions(), Want::triangles, now_.known);
      now_.normals.resize(now_.seeds.size());
      hold(now_.moments(), std::vector<Vec3>(now_.seeds.positions()), now_);
    }
    measure(now_);
    if (trial == kReseedTrials || !has_empty_cell(now_)) break;
    reseed();
  }
  if (!std::isfinite(now_.energy))
    throw Error("the diagram does not cover the domain; its coordinates may span too many magnitudes");
}

// Whether a step lowers the energy enough, of localised cells below the largest of the last (Grippo, Lampariello and
// Lucidi 1986); where rounding hides that, whether the slope says so: the approximate Wolfe
// condition (Hager and Zhang 2005, section 2).
bool Descent::is_descent(const std::vector<Vec3>& direction, double slope, double step) const {
  // Where a stray part meets its cell or comes off, the energy of localised cells jumps.
  double before = now_.energy;
  if (run_.localises())
    before = *std::max_element(energies_.end() - static_cast<std::ptrdiff_t>(std::min(energies_.size(), kMemory)),
                               energies_.end());
  if (next_.energy <= before + kArmijo * step * slope) return true;
  const double noise = run_.backend().energy_noise() * now_.energy;
  return noise > 0 && next_.energy <= now_.energy + noise &&
         inner(next_.gradient, direction) <= (2 * kArmijo - 1) * slope;
}

// Backtracks along the direction until the energy falls enough, by interpolation. False if no step was found; then
// `next_` is not to be used.
bool Descent::line_search(const std::vector<Vec3>& direction) {
  const double slope = inner(now_.gradient, direction);
  if (!(slope < 0)) return false;
  double step = 1;
  for (int trial = 0; trial < kLineSearchTrials; ++trial) {
    next_.seeds = now_.seeds;
    const std::span<Vec3> positions = next_.seeds.edit_positions();
    parallel_each(positions.size(), [&](std::size_t i) { positions[i] += step * direction[i]; });
    next_.normals = now_.normals;
    hold(now_.moments(), now_.seeds.positions(), next_);
    measure(next_);
    if (is_descent(direction, slope, step)) return true;
    const double excess = next_.energy - now_.energy - step * slope;
    const double vertex = std::isfinite(excess) ? -0.5 * slope * step * step / excess : 0;
    step = std::clamp(vertex, 0.1 * step, 0.5 * step);
  }
  return false;
}

// Goes to the point that the line search found. Where a cell has become empty there, its seed is put elsewhere, and the
// history says nothing about that.
void Descent::accept() {
  ++run_.totals.iterations;
  if (has_empty_cell(next_)) {
    std::swap(now_, next_);
    start();
    history_.clear();
    return;
  }
  std::vector<Vec3> s = next_.seeds.positions(), y = next_.gradient;
  parallel_each(s.size(), [&](std::size_t i) {
    s[i] -= now_.seeds.position(i);
    y[i] -= now_.gradient[i];
  });
  history_.push(std::move(s), std::move(y));
  std::swap(now_, next_);
}

void Descent::hand_back() {
  run_.adopt(std::move(now_.seeds), std::move(now_.known));
  run_.normals_ = std::move(now_.normals);
  run_.energy = now_.energy;
  run_.gradient_norm = now_.gradient_norm;
}

void Descent::minimise() {
  start();
  energies_.assign(1, now_.energy);
  const double first_norm = now_.gradient_norm;
  bool restarted = false;
  for (int iteration = 0; iteration < options_.iterations; ++iteration) {
    run_.context().check();
    if (now_.gradient_norm <= kFlatGradient * first_norm) break;
    const std::vector<Vec3> direction = history_.direction(now_.gradient, preconditioner(now_.moments()));
    if (!line_search(direction)) {
      // Once from scratch along the gradient; if that finds nothing either, this is the minimum to rounding.
      if (restarted) break;
      restarted = true;
      history_.clear();
      continue;
    }
    restarted = false;
    accept();
    energies_.push_back(now_.energy);
    run_.context().report({options_.phase, iteration + 1, options_.iterations, now_.energy, now_.gradient_norm,
                           options_.done + options_.share * (iteration + 1) / options_.iterations});
    const std::size_t n = energies_.size();
    if (n > kDecreaseWindow &&
        energies_[n - 1 - kDecreaseWindow] - energies_[n - 1] < kDecreaseWindow * options_.tolerance * energies_[n - 1])
      break;
  }
  hand_back();
}

void optimise(CvtRun& run, const OptimiseOptions& options) {
  const Stopwatch watch;
  const DiagramSeconds before = run.totals.seconds;
  Descent(run, options).minimise();
  const DiagramSeconds& after = run.totals.seconds;
  run.totals.seconds_lbfgs += watch.seconds() - (after.delaunay - before.delaunay) -
                              (after.neighbours - before.neighbours) - (after.pairs - before.pairs) -
                              (after.clip - before.clip);
}

CvtGradient complete(CvtRun& run, bool constrained) {
  const Diagram& diagram = run.diagram(constrained ? Want::triangles : Want::moments);
  if (constrained) {
    std::vector<Vec3> feet = run.seeds.positions();
    run.normals_.resize(feet.size());
    project_to_cells(run.surface(), diagram.moments.triangles, run.seeds.places(), feet, run.normals_);
  }
  CvtGradient gradient;
  gradient.vectors = gradient_of(diagram.moments.cells, run.seeds, run.curves(), constrained ? &run.normals_ : nullptr);
  if (constrained) gradient.normals = run.normals_;
  run.energy = run.covers(diagram) ? diagram.moments.energy : std::numeric_limits<double>::infinity();
  run.gradient_norm = length_of(gradient.vectors);
  return gradient;
}

}  // namespace bisector
