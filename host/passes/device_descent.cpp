#include "host/passes/device_descent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "host/passes/packing.h"
#include "kernels/layout/descent.h"
#include "kernels/layout/push.h"
#include "kernels/layout/sizes.h"
#include "voronoi/totals.h"

namespace bisector::host {
namespace {

static_assert(DescentVectors::kMostPairs == kMostPairs);

constexpr std::size_t kWord = sizeof(std::uint32_t);
constexpr std::size_t kVector = sizeof(Vec3);
// Seeds may go as far from the origin as this times the largest coordinate at the start and of the surface.
constexpr double kRoom = 2;
constexpr double kShareOfMemory = 0.5;  // of the device's, for the vectors
// Of the exponent of the scale: energies times areas, six powers of a length, stay within range of doubles.
constexpr int kMostExponent = 120;
// Seeds below which some lists do not have the neighbours that step masses are computed from.
constexpr std::size_t kLeastSeeds = 64;

uint word(std::size_t n) { return static_cast<uint>(n); }

std::size_t bytes_of(const DescentStart& start) {
  const std::size_t vectors = 2 * start.pairs + 5 + (start.normals ? 2 : 0);
  return start.seeds.size() * (vectors * kVector + 2 * kCellWords * sizeof(double) + 8 * sizeof(double));
}

uint place_word(const SeedPlace& place) {
  switch (place.kind) {
    case SeedPlace::Kind::curve: return place.curve;
    case SeedPlace::Kind::fixed: return kFixed;
    case SeedPlace::Kind::surface:
    case SeedPlace::Kind::interior: break;
  }
  return kOnSurface;
}

}  // namespace

bool DeviceDescent::is_possible(SeedStage& stage, SurfaceStage& surface, const DescentStart& start) {
  const Device& device = stage.device();
  const std::size_t n = start.seeds.size();
  if (!(stage.is_double() || stage.has_double_rung()) || stage.delaunay() || n < kLeastSeeds) return false;
  if (std::abs(std::ilogb(stage.seeds.scale)) > kMostExponent) return false;
  if (n * kVector > device.limits().storage_range) return false;
  const std::uint64_t memory = device.description().memory;
  if (static_cast<double>(bytes_of(start)) > kShareOfMemory * static_cast<double>(memory)) return false;
  if (start.normals && (surface.double_facets().size() != 1 ||
                        start.moments.triangles.values.size() * kWord > device.limits().storage_range))
    return false;
  return stage.within_reach(start.seeds.positions());
}

DeviceDescent::DeviceDescent(SeedStage& stage, SurfaceStage& surface, CellPass& cells, const DescentStart& start,
                             EvaluateResident evaluate)
    : stage_(stage), surface_(surface), cells_(cells), evaluate_(std::move(evaluate)), commands_(stage.commands),
      n_(start.seeds.size()), on_triangles_(start.normals != nullptr),
      mean_mass_(surface.surface().mass * stage.seeds.scale * stage.seeds.scale / static_cast<double>(n_)),
      seeds_(stage.device()), place_words_(stage.device()), curves_(stage.device()), segments_(stage.device()),
      facet_of_(stage.device()), direction_(stage.device()), numbers_(stage.device()),
      beyond_(stage.device()), block_sums_{Buffer(stage.device()), Buffer(stage.device())}, now_(stage.device()),
      next_(stage.device()), kept_{start.seeds, 0} {
  Device& device = stage_.device();
  for (std::size_t k = 0; k < start.pairs; ++k) {
    steps_.emplace_back(device).reserve(n_ * kVector);
    changes_.emplace_back(device).reserve(n_ * kVector);
  }
  seeds_.reserve(n_ * kVector);
  direction_.reserve(n_ * kVector);
  place_words_.reserve(n_ * kWord);
  numbers_.reserve(kNumbers * sizeof(double));
  beyond_.reserve(kWord);
  segments_.reserve(start.curves.all_segments().size() * kSegmentWords * sizeof(double));
  curves_.reserve(start.curves.size() * kCurveWords * kWord);
  facet_of_.reserve(on_triangles_ ? surface.surface().facet_of.size() * kWord : kWord);
  const std::size_t blocks = (n_ + kSumBlock - 1) / kSumBlock;
  block_sums_[0].reserve(kStepSums * blocks * sizeof(double));
  block_sums_[1].reserve(kStepSums * ((blocks + kSumBlock - 1) / kSumBlock) * sizeof(double));
  for (Point* point : {&now_, &next_}) {
    point->gradient.reserve(n_ * kVector);
    point->weights.reserve(n_ * sizeof(double));
    point->positions.reserve(n_ * sizeof(double));
    point->cells.reserve(n_ * kCellWords * (stage.is_double() ? sizeof(double) : sizeof(float)));
    point->normals.reserve(on_triangles_ ? n_ * kVector : kVector);
    point->ranges.reserve(on_triangles_ ? n_ * 2 * kWord : kWord);
    point->triangles.reserve(on_triangles_ ? start.moments.triangles.values.size() * kWord : kWord);
  }
}

void DeviceDescent::begin(const DescentStart& start) {
  stage_.seeds.largest *= kRoom;
  stage_.renew_slots(kept_.seeds.positions());
  upload_start(start);
  upload_curves(start.curves);
  commands_.run();
}

void DeviceDescent::upload_start(const DescentStart& start) {
  const double scale = stage_.seeds.scale;
  const auto upload_vectors = [&](const Buffer& to, const std::vector<Vec3>& vectors, double factor) {
    commands_.upload_items(to, kVector, n_, [&](std::byte* at, std::size_t first, std::size_t count) {
      for (std::size_t i = first; i < first + count; ++i, at += kVector) {
        const Vec3 v = factor * vectors[i];
        std::memcpy(at, &v, sizeof v);
      }
    });
  };
  commands_.phase(&DeviceSeconds::transfer);
  upload_vectors(seeds_, start.seeds.positions(), scale);
  upload_vectors(now_.gradient, start.gradient, scale * scale * scale);
  std::vector<double> weights(n_), positions(n_);
  std::vector<uint> words(n_);
  for (std::size_t i = 0; i < n_; ++i) {
    const double mass = start.moments.step_mass[i] * scale * scale;
    weights[i] = 1 / (2 * (mass > 0 ? mass : mean_mass_));
    positions[i] = scale * start.seeds.place(i).position;
    words[i] = place_word(start.seeds.place(i));
  }
  upload(commands_, now_.weights, weights);
  upload(commands_, now_.positions, positions);
  commands_.copy(now_.positions, 0, next_.positions, 0, n_ * sizeof(double));
  upload(commands_, place_words_, words);
  if (!on_triangles_) return;
  upload_vectors(now_.normals, *start.normals, 1);
  upload(commands_, facet_of_, surface_.surface().facet_of);
  std::vector<std::array<uint, 2>> ranges(n_);
  const Csr<Index>& triangles = start.moments.triangles;
  for (std::size_t i = 0; i < n_; ++i) ranges[i] = {word(triangles.offsets[i]), word(triangles.offsets[i + 1])};
  upload(commands_, now_.ranges, ranges);
  upload(commands_, now_.triangles, triangles.values);
}

void DeviceDescent::upload_curves(const FeatureCurves& curves) {
  const double scale = stage_.seeds.scale, per_scale = 1 / scale;
  std::vector<double> words;
  const auto put = [&](const Vec3& v, double factor) {
    const Vec3 scaled = factor * v;
    words.insert(words.end(), {scaled.x, scaled.y, scaled.z});
  };
  for (const CurveSegment& segment : curves.all_segments()) {
    put(segment.from, scale);
    put(segment.to, scale);
    put(segment.along, scale);
    put(segment.tangent, 1);
    words.insert(words.end(), {scale * segment.start, scale * segment.end, per_scale * segment.per_length,
                               per_scale * per_scale * segment.per_square});
  }
  std::vector<uint> of_curves;
  for (Index c = 0; c < curves.size(); ++c)
    of_curves.insert(of_curves.end(),
                     {curves.first_segments()[c], curves.first_segments()[c + 1], uint{curves.closed(c)}});
  upload(commands_, segments_, words);
  upload(commands_, curves_, of_curves);
}

double DeviceDescent::to_caller(double value, int power) const {
  return std::scalbn(value, -power * std::ilogb(stage_.seeds.scale));
}

// --- The direction ---

// Records what was left to do, and takes the next.
void DeviceDescent::update(const Update& next) {
  if (update_) direct(kNoProduct, numbers_);
  update_ = next;
}

// Records the update that is left, and the product if one is asked for.
void DeviceDescent::direct(uint product, const Buffer& factor) {
  const Update update = update_.value_or(Update{kNoUpdate, &numbers_, 0});
  update_.reset();
  commands_.phase(&DeviceSeconds::descent);
  commands_.dispatch({"direct", {update.kind, product}},
                     {updates(direction_), reads(numbers_), reads(now_.weights), reads(*update.by), reads(factor),
                      writes(block_sums_[0])},
                     DirectPush{word(n_), update.coefficient}, n_);
}

// Makes numbers of the sums of blocks.
void DeviceDescent::sum_up(uint use, std::size_t kinds, const FinishPush& push) {
  std::size_t count = (n_ + kSumBlock - 1) / kSumBlock;
  unsigned level = 0;
  for (; count > kMostToFinish; ++level) {
    const std::size_t blocks = (count + kSumBlock - 1) / kSumBlock;
    commands_.dispatch({"sum_blocks", {}}, {reads(block_sums_[level % 2]), writes(block_sums_[1 - level % 2])},
                       SumsPush{word(count), word(kinds)}, kinds * blocks);
    count = blocks;
  }
  FinishPush whole = push;
  whole.count = word(count);
  whole.kinds = word(kinds);
  commands_.dispatch({"finish_sums", {use}}, {reads(block_sums_[level % 2]), updates(numbers_)}, whole, 1);
}

void DeviceDescent::start_direction() { update({kNegateUpdate, &now_.gradient, 0}); }

void DeviceDescent::project(std::size_t pair, PairPart which, double rho, bool onto) {
  direct(kDotProduct, part(pair, which));
  FinishPush push{};
  push.multiplier = to_caller(rho, 4);
  push.place = word(pair);
  push.onto = onto;
  sum_up(kCoefficientSum, 1, push);
}

void DeviceDescent::add(std::size_t pair, PairPart which) { update({kAddUpdate, &part(pair, which), word(pair)}); }

void DeviceDescent::weigh(std::optional<std::size_t> pair, double sy) {
  if (pair) {
    direct(kWeighedSquare, part(*pair, PairPart::change));
    FinishPush push{};
    push.multiplier = to_caller(sy, -4);
    sum_up(kGammaSum, 1, push);
  }
  update({pair ? kScaleUpdate : kWeighUpdate, &numbers_, 0});
}

// --- Steps ---

StepResult DeviceDescent::step(double length, std::size_t pair) {
  if (update_) direct(kNoProduct, numbers_);
  std::array<double, kStepSums> sums{};
  uint beyond = 0;
  std::vector<Vec3> at;
  std::vector<double> positions;
  const bool keeps = accepted_ - kept_.accepted >= kKeepEvery;
  if (keeps) {
    download(seeds_, at, 1 / stage_.seeds.scale);
    download_positions(positions);
  }
  const auto begin = [&] {
    move(length);
    stage_.begin_resident([this] {
      std::vector<Vec3> seeds;
      download(stage_.seeds.given, seeds, 1 / stage_.seeds.scale);
      commands_.run();
      return seeds;
    });
  };
  const auto read = [&]() -> std::optional<double> {
    measure(pair);
    commands_.phase(&DeviceSeconds::transfer);
    commands_.download(numbers_, kSumsAt * sizeof(double), sums.data(), sizeof sums);
    commands_.download(beyond_, 0, &beyond, sizeof beyond);
    if (!cells_.check(stage_, stage_.run_counted())) return {};
    return to_caller(sums[kMassSum], 2);
  };
  StepResult result;
  result.report = evaluate_(begin, read);
  result.mass = to_caller(sums[kMassSum], 2);
  result.energy = to_caller(sums[kEnergySum], 4);
  result.products = {to_caller(sums[kSlopeSum], 4), to_caller(sums[kNextSlopeSum], 4), to_caller(sums[kGradientSum], 6),
                     to_caller(sums[kSySum], 4),    to_caller(sums[kSsSum], 2),        to_caller(sums[kYySum], 6)};
  result.empty = static_cast<std::size_t>(sums[kEmptySum]);
  result.out_of_reach = beyond != 0;
  if (keeps) {
    kept_ = {placed(std::move(at), positions), accepted_};
    stage_.renew_slots(kept_.seeds.positions());
  }
  return result;
}

// Records the move of the seeds to where they are evaluated.
void DeviceDescent::move(double length) {
  const Buffer& moved = stage_.seeds.given;
  const FacetChunk& facets = surface_.double_facets().front();
  commands_.phase(&DeviceSeconds::descent);
  commands_.fill(beyond_, 0, kWord, 0);
  const MovePush push{length, stage_.seeds.largest, word(n_), kTwo};
  commands_.dispatch(
      {"move_seeds", {on_triangles_}},
      {reads(seeds_), reads(direction_), writes(moved), reads(place_words_), reads(now_.positions),
       writes(next_.positions), reads(curves_), reads(segments_), updates(beyond_), reads(now_.ranges),
       reads(now_.triangles), reads(facet_of_), reads(facets.words), reads(now_.normals), writes(next_.normals)},
      push, n_);
}

// Records what the step has led to.
void DeviceDescent::measure(std::size_t pair) {
  const std::size_t blocks = (n_ + kSumBlock - 1) / kSumBlock;
  commands_.phase(&DeviceSeconds::descent);
  commands_.dispatch({"measure_step", {on_triangles_, !stage_.is_double()}},
                     {reads(cells_.cells()), reads(place_words_), reads(next_.positions), reads(curves_),
                      reads(segments_), reads(next_.normals), reads(seeds_), reads(stage_.seeds.given),
                      reads(now_.gradient), reads(direction_), writes(next_.gradient), writes(next_.weights),
                      writes(steps_[pair]), writes(changes_[pair]), writes(block_sums_[0])},
                     MeasurePush{mean_mass_, word(n_), word(blocks)}, n_);
  FinishPush push{};
  push.place = kSumsAt;
  sum_up(kStoreSums, kStepSums, push);
  if (!on_triangles_) return;
  // Seeds without a slot have no triangles.
  if (stage_.seeds.count() < n_) commands_.fill(next_.ranges, 0, n_ * 2 * kWord, 0);
  commands_.dispatch({"place_lists", {}}, {reads(cells_.begins()), reads(stage_.seeds.order), updates(next_.ranges)},
                     CountPush{word(stage_.seeds.count())}, stage_.seeds.count());
}

void DeviceDescent::accept() {
  std::swap(seeds_, stage_.seeds.given);
  cells_.exchange(next_.cells);
  if (on_triangles_) cells_.exchange_places(next_.triangles);
  std::swap(now_, next_);
  ++accepted_;
}

// --- To the host ---

// Records the download of a vector to `to`, in the caller's lengths if `scale` is the power of two that makes them.
void DeviceDescent::download(const Buffer& from, std::vector<Vec3>& to, double scale) {
  to.resize(n_);
  commands_.phase(&DeviceSeconds::transfer);
  commands_.download_items(from, kVector, n_, [&to, scale](const std::byte* at, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i, at += kVector) {
      std::memcpy(&to[i], at, kVector);
      to[i] *= scale;
    }
  });
}

// Records the download of where the seeds of the iterate are along their curves.
void DeviceDescent::download_positions(std::vector<double>& to) {
  to.resize(n_);
  commands_.download(now_.positions, 0, to.data(), n_ * sizeof(double));
}

PlacedSeeds DeviceDescent::placed(std::vector<Vec3> seeds, const std::vector<double>& positions) const {
  std::vector<SeedPlace> places = kept_.seeds.places();
  for (std::size_t i = 0; i < n_; ++i)
    if (places[i].kind == SeedPlace::Kind::curve) places[i].position = positions[i] * (1 / stage_.seeds.scale);
  return {std::move(seeds), std::move(places)};
}

void DeviceDescent::bring_back(PlacedSeeds& seeds, CellMoments& moments, std::vector<Vec3>& gradient,
                               std::vector<Vec3>& normals) {
  const double per_scale = 1 / stage_.seeds.scale;
  std::vector<Vec3> at;
  std::vector<double> positions;
  std::vector<std::array<uint, 2>> ranges(on_triangles_ ? n_ : 0);
  download(seeds_, at, per_scale);
  download(now_.gradient, gradient, per_scale * per_scale * per_scale);
  download_positions(positions);
  download_cells(stage_, now_.cells, n_, false, moments);
  if (on_triangles_) {
    download(now_.normals, normals, 1);
    commands_.download(now_.ranges, 0, ranges.data(), ranges.size() * sizeof ranges[0]);
  }
  commands_.run();
  set_totals(moments);
  seeds = placed(std::move(at), positions);
  moments.triangles = {};
  if (!on_triangles_) return;
  uint count = 0;
  for (const auto& [begin, end] : ranges) count = std::max(count, end);
  std::vector<Index> by_slot(count);
  commands_.download(now_.triangles, 0, by_slot.data(), count * kWord);
  commands_.run();
  Csr<Index>& triangles = moments.triangles;
  triangles.offsets.assign(1, 0);
  for (const auto& [begin, end] : ranges) {
    triangles.values.insert(triangles.values.end(), by_slot.begin() + begin, by_slot.begin() + end);
    triangles.offsets.push_back(triangles.values.size());
  }
}

}  // namespace bisector::host
