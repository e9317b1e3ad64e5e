#include "cvt/saved_step.h"

#include <cmath>
#include <utility>
#include <vector>

#include "bisector/error.h"
#include "core/magnitude.h"

namespace bisector {
void write_seeds(const PlacedSeeds& seeds, ByteWriter& out) {
  out.put_all(seeds.positions());
  for (const SeedPlace& place : seeds.places())
    out.put(place.kind).put(place.curve).put(place.corner).put(place.position);
}

PlacedSeeds read_seeds(const FeatureCurves& curves, ByteReader& in) {
  std::vector<Vec3> positions;
  in.get_all(positions);
  require_moderate(positions, "the checkpoint's seed");
  std::vector<SeedPlace> places(positions.size());
  for (SeedPlace& place : places) {
    in.get(place.kind);
    in.get(place.curve);
    in.get(place.corner);
    in.get(place.position);
    const bool on_curve = place.kind == SeedPlace::Kind::curve;
    if (static_cast<unsigned>(place.kind) > static_cast<unsigned>(SeedPlace::Kind::interior) ||
        !std::isfinite(place.position) || (place.curve == kNone ? on_curve : place.curve >= curves.size()) ||
        (place.corner != kNone && place.corner >= curves.graph().corners.size()))
      throw Error("a seed of the checkpoint is on a curve or corner that is not there");
  }
  return PlacedSeeds(std::move(positions), std::move(places));
}

Fingerprint SavedStep::start_of(const CvtRun& run) {
  Fingerprint start;
  start.add_all(run.seeds.positions());
  for (const SeedPlace& place : run.seeds.places())
    start.add(place.kind).add(place.curve).add(place.corner).add(place.position);
  const Backend& backend = run.backend();
  start.add_all(run.normals_).add(run.surface().facets.size()).add(backend.mass());
  return start.add(backend.mass_tolerance()).add(backend.energy_noise()).add(run.localises());
}

void SavedStep::write_counts(ByteWriter& out) const {
  out.put(run_.totals.iterations - totals_.iterations).put(run_.totals.evaluations - totals_.evaluations);
}

void SavedStep::read_counts(ByteReader& in) {
  run_.totals.iterations = totals_.iterations + in.get<int>();
  run_.totals.evaluations = totals_.evaluations + in.get<int>();
}

std::optional<std::string> SavedStep::restore() {
  const std::optional<std::string> kept = store_ ? store_->result(key_) : std::nullopt;
  if (!kept) return {};
  ByteReader in(*kept);
  PlacedSeeds seeds = read_seeds(run_.curves(), in);
  std::vector<Vec3> normals;
  in.get_all(normals);
  in.get(run_.energy);
  in.get(run_.gradient_norm);
  read_counts(in);
  std::vector<char> outcome;
  in.get_all(outcome);
  in.end();
  run_.adopt(std::move(seeds), {});
  run_.normals_ = std::move(normals);
  return std::string(outcome.begin(), outcome.end());
}

void SavedStep::keep(const std::string& outcome) {
  if (!store_) return;
  ByteWriter out;
  write_seeds(run_.seeds, out);
  out.put_all(run_.normals_).put(run_.energy).put(run_.gradient_norm);
  write_counts(out);
  out.put_all(std::vector<char>(outcome.begin(), outcome.end()));
  store_->keep_result(key_, out.take(), watch_.seconds(), run_.context());
}

std::optional<std::string> SavedStep::state() const { return store_ ? store_->state(key_) : std::nullopt; }

void SavedStep::keep_state(const std::string& bytes) {
  if (store_) store_->keep_state(key_, bytes, run_.context());
}

}  // namespace bisector
