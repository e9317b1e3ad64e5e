#include "cvt/host_descent.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "core/parallel.h"
#include "cvt/multilevel.h"

namespace bisector {
namespace {

constexpr int kReseedTrials = 10;  // rounds of giving empty cells another place

using Kind = SeedPlace::Kind;

// `normal`: of the surface there, if the seed is held on it; or null.
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

bool is_lost(const Iterate& iterate, std::size_t i) {
  const Kind kind = iterate.seeds.kind(i);
  return iterate.moments().cells[i].mass <= 0 && (kind == Kind::surface || kind == Kind::interior);
}

std::size_t count_lost(const Iterate& iterate) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < iterate.seeds.size(); ++i) count += is_lost(iterate, i);
  return count;
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

}  // namespace

std::vector<Vec3> gradient_of(const std::vector<Moments>& cells, const PlacedSeeds& seeds, const FeatureCurves& curves,
                              const std::vector<Vec3>* normals) {
  std::vector<Vec3> gradient(seeds.size());
  parallel_each(seeds.size(), [&](std::size_t i) {
    gradient[i] = held(-2.0 * cells[i].first, seeds.place(i), curves, normals ? &(*normals)[i] : nullptr);
  });
  return gradient;
}

double square_of(const std::vector<Vec3>& gradient) {
  return fixed_sum(gradient.size(), [&](std::size_t i) { return norm2(gradient[i]); });
}

void HostVectors::start_direction() {
  direction.resize(gradient_.size());
  parallel_each(
      gradient_.size(), [&](std::size_t i) { direction[i] = -gradient_[i]; }, 4096);
}

void HostVectors::project(std::size_t pair, PairPart part, double rho, bool onto) {
  const std::vector<Vec3>& v = pairs[pair].part(part);
  const double along = fixed_sum(v.size(), [&](std::size_t i) { return dot(v[i], direction[i]); });
  pairs[pair].coefficient = -((onto ? pairs[pair].coefficient : 0) + rho * along);
}

void HostVectors::add(std::size_t pair, PairPart part) {
  const std::vector<Vec3>& v = pairs[pair].part(part);
  const double coefficient = pairs[pair].coefficient;
  parallel_each(
      v.size(), [&](std::size_t i) { direction[i] += coefficient * v[i]; }, 4096);
}

void HostVectors::weigh(std::optional<std::size_t> pair, double sy) {
  double gamma = 1;
  if (pair) {
    const std::vector<Vec3>& y = pairs[*pair].change;
    gamma = sy * (1 / fixed_sum(y.size(), [&](std::size_t i) { return norm2(y[i]) * weights_[i]; }));
  }
  parallel_each(
      direction.size(), [&](std::size_t i) { direction[i] *= gamma * weights_[i]; }, 4096);
}

// Puts the seeds back to where they are held. `moments` are those of the cells before the seeds moved, `before` where
// they were then.
void HostDescent::hold(const CellMoments& moments, const std::vector<Vec3>& before, Iterate& next) const {
  const std::span<Vec3> positions = next.seeds.edit_positions();
  const std::span<SeedPlace> places = next.seeds.edit_places();
  if (constrained_) run_.backend().project(moments, places, positions, next.normals);
  parallel_each(places.size(), [&](std::size_t i) {
    SeedPlace& place = places[i];
    if (place.kind == Kind::fixed) positions[i] = before[i];
    if (place.kind != Kind::curve) return;
    // A bound of twice the step that takes no root.
    const Vec3 moved = positions[i] - before[i];
    const double reach = 2 * (std::abs(moved.x) + std::abs(moved.y) + std::abs(moved.z));
    place.position = run_.curves().nearest(place.curve, positions[i], place.position, reach);
    positions[i] = run_.curves().point(place.curve, place.position);
  });
}

void HostDescent::measure(Iterate& iterate) const {
  const Want want = constrained_ ? run_.backend().projected() : Want::moments;
  run_.evaluate(iterate.seeds.positions(), want, iterate.known);
  iterate.gradient =
      gradient_of(iterate.moments().cells, iterate.seeds, run_.curves(), constrained_ ? &iterate.normals : nullptr);
}

// Puts the seeds of empty cells at far corners of the cells of highest energy.
void HostDescent::reseed() {
  run_.evaluate(now.seeds.positions(), Want::polygons, now.known);
  std::vector<Index> empty, inside;
  for (Index i = 0; i < now.seeds.size(); ++i)
    if (is_lost(now, i)) (now.seeds.kind(i) == Kind::interior ? inside : empty).push_back(i);
  const std::span<Vec3> positions = now.seeds.edit_positions();
  reseed_interior(now.moments().cells, inside, positions);
  const std::vector<Vec3> points = insertion_points(now.known.diagram, now.seeds, empty.size());
  for (std::size_t k = 0; k < points.size(); ++k) positions[empty[k]] = points[k];
}

void HostDescent::start() {
  for (int trial = 0;; ++trial) {
    run_.context().check();
    if (constrained_) {
      run_.evaluate(now.seeds.positions(), run_.backend().projected(), now.known);
      now.normals.resize(now.seeds.size());
      hold(now.moments(), std::vector<Vec3>(now.seeds.positions()), now);
    }
    measure(now);
    if (trial == kReseedTrials || count_lost(now) == 0) break;
    reseed();
  }
  if (!run_.covers(now.moments().mass))
    throw Error("the diagram does not cover the domain; its coordinates may span too many magnitudes");
  set_weights();
}

void HostDescent::go_on() {
  now.known = {};
  measure(now);
  set_weights();
}

void HostDescent::write_pairs(const Lbfgs& history, ByteWriter& out) const {
  for (const std::size_t number : history.numbers())
    out.put_all(vectors_.pairs[number].step).put_all(vectors_.pairs[number].change);
}

void HostDescent::read_pairs(const Lbfgs& history, ByteReader& in) {
  for (const std::size_t number : history.numbers()) {
    in.get_all(vectors_.pairs[number].step);
    in.get_all(vectors_.pairs[number].change);
  }
}

// From masses that do not vanish with the cell, or all steps of a neighbourhood without any from the mean.
void HostDescent::set_weights() {
  const std::vector<double>& masses = now.moments().step_mass;
  const double mean = run_.backend().mass() / static_cast<double>(masses.size());
  weights_.resize(masses.size());
  parallel_each(
      masses.size(), [&](std::size_t i) { weights_[i] = 1 / (2 * (masses[i] > 0 ? masses[i] : mean)); }, 4096);
}

StepResult HostDescent::step(double length, std::size_t number) {
  const std::vector<Vec3>& direction = vectors_.direction;
  next_.seeds = now.seeds;
  const std::span<Vec3> positions = next_.seeds.edit_positions();
  parallel_each(positions.size(), [&](std::size_t i) { positions[i] += length * direction[i]; });
  next_.normals = now.normals;
  hold(now.moments(), now.seeds.positions(), next_);
  measure(next_);

  HostVectors::Pair& pair = vectors_.pairs[number];
  pair.step.resize(positions.size());
  pair.change.resize(positions.size());
  StepResult result;
  result.products = fixed_sum<StepProducts>(positions.size(), [&](std::size_t i) {
    const Vec3 &g = now.gradient[i], &next = next_.gradient[i];
    const Vec3 s = next_.seeds.position(i) - now.seeds.position(i), y = next - g;
    pair.step[i] = s;
    pair.change[i] = y;
    return StepProducts{dot(g, direction[i]), dot(next, direction[i]), norm2(next), dot(s, y), norm2(s), norm2(y)};
  });
  result.mass = next_.moments().mass;
  result.energy = next_.moments().energy;
  result.empty = count_lost(next_);
  result.report = next_.known.report;
  return result;
}

void HostDescent::accept() {
  std::swap(now, next_);
  set_weights();
}

}  // namespace bisector
