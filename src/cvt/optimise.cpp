#include "cvt/optimise.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "cvt/constrain.h"
#include "cvt/lbfgs.h"
#include "cvt/multilevel.h"

namespace bisector {
namespace {

constexpr double kArmijo = 1e-4;
constexpr double kFlatGradient = 1e-8;     // relative to the first; what is left is rounding
constexpr int kLineSearchTrials = 8;
constexpr std::size_t kDecreaseWindow = 5;
constexpr int kReseedTrials = 10;

using Kind = SeedPlace::Kind;

Kind kind_of(const CvtState& state, std::size_t i) { return state.places.empty() ? Kind::surface : state.places[i].kind; }

// The part of a seed's gradient along what it is held on (thesis 4.4.2 and 4.4.3, equations 4.7 and 4.8).
Vec3 held(const Vec3& g, const CvtState& state, std::size_t i, const OptimiseOptions& options) {
  switch (kind_of(state, i)) {
    case Kind::fixed: return {};
    case Kind::curve: {
      const Vec3 tangent = options.curves->tangent(state.places[i].curve, state.places[i].position);
      return dot(g, tangent) * tangent;
    }
    case Kind::interior: return g;
    case Kind::surface: break;
  }
  return options.constrained ? g - dot(g, state.normals[i]) * state.normals[i] : g;
}

// Puts the seeds back to where they are held; `cells` are the triangles of each cell before the seeds moved, `before` the
// seeds then.
void hold(const Surface& surface, const Csr<Index>& cells, const std::vector<Vec3>& before, const OptimiseOptions& options,
          CvtState& state) {
  if (options.constrained) project_to_cells(surface, cells, state.places, state.seeds, state.normals);
  for (std::size_t i = 0; i < state.places.size(); ++i) {
    SeedPlace& place = state.places[i];
    if (place.kind == Kind::fixed) state.seeds[i] = before[i];
    if (place.kind != Kind::curve) continue;
    const double reach = 2 * norm(state.seeds[i] - before[i]);
    place.position = options.curves->nearest(place.curve, state.seeds[i], place.position, reach);
    state.seeds[i] = options.curves->point(place.curve, place.position);
  }
}

void evaluate(Backend& backend, const OptimiseOptions& options, CvtState& state, OptimiseTotals& totals) {
  backend.evaluate(state.seeds, state.moments);
  totals.count(state.moments);
  const double total = backend.mass();
  // A diagram whose cells do not add up is never used.
  const bool covers = std::abs(state.moments.mass - total) <= backend.mass_tolerance() * total;
  state.energy = covers ? state.moments.energy : std::numeric_limits<double>::infinity();
  state.gradient.resize(state.seeds.size());
  parallel_each(state.seeds.size(), [&](std::size_t i) {
    state.gradient[i] = held(-2.0 * state.moments.cells[i].first, state, i, options);
  });
  state.gradient_norm = std::sqrt(inner(state.gradient, state.gradient));
}

bool is_lost(const CvtState& state, std::size_t i) {
  const Kind kind = kind_of(state, i);
  return state.moments.cells[i].mass <= 0 && (kind == Kind::surface || kind == Kind::interior);
}

bool has_empty_cell(const CvtState& state) {
  for (std::size_t i = 0; i < state.seeds.size(); ++i)
    if (is_lost(state, i)) return true;
  return false;
}

// Puts seeds inside a solid that own nothing into the cells of highest energy, half the root mean square distance of their
// points from the seed.
void reseed_interior(CvtState& state, const std::vector<Index>& empty) {
  const std::vector<Moments>& cells = state.moments.cells;
  std::vector<Index> order;
  for (Index i = 0; i < cells.size(); ++i)
    if (cells[i].mass > 0) order.push_back(i);
  const std::size_t count = std::min(empty.size(), order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(), [&](Index a, Index b) {
    return cells[a].second != cells[b].second ? cells[a].second > cells[b].second : a < b;
  });
  for (std::size_t k = 0; k < count; ++k) {
    const Moments& cell = cells[order[k]];
    const Vec3 towards = (1 / cell.mass) * cell.first;
    const double length = norm(towards), spread = 0.5 * std::sqrt(cell.second / cell.mass);
    const Vec3 step = length > 0.1 * spread ? (spread / length) * towards : Vec3{spread, 0, 0};
    state.seeds[empty[k]] = state.seeds[order[k]] + step;
  }
}

// Puts the seeds of empty cells at far corners of the cells of highest energy.
void reseed(Backend& backend, CvtState& state) {
  RestrictedPolygons polygons;
  backend.evaluate(state.seeds, state.moments, polygons);
  std::vector<Index> empty, inside;
  for (Index i = 0; i < state.seeds.size(); ++i)
    if (is_lost(state, i)) (kind_of(state, i) == Kind::interior ? inside : empty).push_back(i);
  reseed_interior(state, inside);
  const std::vector<Vec3> points = insertion_points(polygons, state.seeds, state.places, state.moments, empty.size());
  for (std::size_t k = 0; k < points.size(); ++k) state.seeds[empty[k]] = points[k];
}

void start(Backend& backend, CvtState& state, const OptimiseOptions& options, OptimiseTotals& totals,
           const Context& context) {
  for (int trial = 0;; ++trial) {
    context.check();
    if (options.constrained) {
      backend.evaluate(state.seeds, state.moments);
      totals.count(state.moments);
      state.normals.resize(state.seeds.size());
      hold(backend.surface(), state.moments.triangles, std::vector<Vec3>(state.seeds), options, state);
    }
    evaluate(backend, options, state, totals);
    if (trial == kReseedTrials || !has_empty_cell(state)) break;
    reseed(backend, state);
  }
  if (!std::isfinite(state.energy))
    throw Error("the diagram does not cover the domain; its coordinates may span too many magnitudes");
}

std::vector<double> preconditioner(const CellMoments& moments) {
  const double mean = moments.mass / static_cast<double>(moments.cells.size());
  std::vector<double> d(moments.step_mass.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = 2 * (moments.step_mass[i] > 0 ? moments.step_mass[i] : mean);
  return d;
}

// Whether a step lowers the energy enough; where rounding hides that, whether the slope says so: the approximate Wolfe
// condition (Hager and Zhang 2005, section 2).
bool is_descent(const Backend& backend, const CvtState& state, const CvtState& next, const std::vector<Vec3>& direction,
                double slope, double step) {
  if (next.energy <= state.energy + kArmijo * step * slope) return true;
  const double noise = backend.energy_noise() * state.energy;
  return noise > 0 && next.energy <= state.energy + noise &&
         inner(next.gradient, direction) <= (2 * kArmijo - 1) * slope;
}

// Backtracks along the direction until the energy falls enough, by interpolation. False if no step was found; then `next`
// is not to be used.
bool line_search(Backend& backend, const CvtState& state, const std::vector<Vec3>& direction,
                 const OptimiseOptions& options, CvtState& next, OptimiseTotals& totals) {
  const double slope = inner(state.gradient, direction);
  if (!(slope < 0)) return false;
  double step = 1;
  for (int trial = 0; trial < kLineSearchTrials; ++trial) {
    next.seeds = state.seeds;
    parallel_each(next.seeds.size(), [&](std::size_t i) { next.seeds[i] += step * direction[i]; });
    next.normals = state.normals;
    next.places = state.places;
    hold(backend.surface(), state.moments.triangles, state.seeds, options, next);
    evaluate(backend, options, next, totals);
    if (is_descent(backend, state, next, direction, slope, step)) return true;
    const double excess = next.energy - state.energy - step * slope;
    const double vertex = std::isfinite(excess) ? -0.5 * slope * step * step / excess : 0;
    step = std::clamp(vertex, 0.1 * step, 0.5 * step);
  }
  return false;
}

}  // namespace

void OptimiseTotals::count(const CellMoments& moments) {
  ++evaluations;
  seconds += moments.seconds;
}

void complete(Backend& backend, CvtState& state, const OptimiseOptions& options, OptimiseTotals& totals) {
  if (options.constrained) {
    backend.evaluate(state.seeds, state.moments);
    std::vector<Vec3> feet = state.seeds;
    state.normals.resize(feet.size());
    project_to_cells(backend.surface(), state.moments.triangles, state.places, feet, state.normals);
  }
  evaluate(backend, options, state, totals);
}

void optimise(Backend& backend, CvtState& state, const OptimiseOptions& options, OptimiseTotals& totals,
              const Context& context) {
  const auto begin = std::chrono::steady_clock::now();
  const DiagramSeconds before = totals.seconds;
  start(backend, state, options, totals, context);

  Lbfgs history;
  CvtState next;
  std::vector<double> energies{state.energy};
  const double first_norm = state.gradient_norm;
  bool restarted = false;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    context.check();
    if (state.gradient_norm <= kFlatGradient * first_norm) break;
    const std::vector<Vec3> direction = history.direction(state.gradient, preconditioner(state.moments));
    if (!line_search(backend, state, direction, options, next, totals)) {
      // Once from scratch along the gradient; if that finds nothing either, this is the minimum to rounding.
      if (restarted) break;
      restarted = true;
      history.clear();
      continue;
    }
    restarted = false;
    ++totals.iterations;
    if (has_empty_cell(next)) {
      std::swap(state, next);
      start(backend, state, options, totals, context);
      history.clear();
    } else {
      std::vector<Vec3> s = next.seeds, y = next.gradient;
      parallel_each(s.size(), [&](std::size_t i) {
        s[i] -= state.seeds[i];
        y[i] -= state.gradient[i];
      });
      history.push(std::move(s), std::move(y));
      std::swap(state, next);
    }
    energies.push_back(state.energy);
    context.report({options.phase, iteration + 1, options.iterations, state.energy, state.gradient_norm,
                    options.done + options.share * (iteration + 1) / options.iterations});
    const std::size_t n = energies.size();
    if (n > kDecreaseWindow &&
        energies[n - 1 - kDecreaseWindow] - energies[n - 1] < kDecreaseWindow * options.tolerance * energies[n - 1])
      break;
  }
  const double total = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const DiagramSeconds& after = totals.seconds;
  totals.seconds_lbfgs += total - (after.delaunay - before.delaunay) - (after.neighbours - before.neighbours) -
                          (after.pairs - before.pairs) - (after.clip - before.clip);
}

}  // namespace bisector
