#include "host/passes/seed_stage.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/stopwatch.h"
#include "host/passes/packing.h"
#include "voronoi/step_mass.h"

namespace bisector::host {
namespace {

constexpr double kFarthest = 1e12;  // coordinate on the device; beyond, squares of singles would overflow

}  // namespace

Precisions choose_precisions(const Device& device, Precision asked, bool double_rung) {
  const DeviceDescription& description = device.description();
  if (asked == Precision::double_ && !description.float64)
    throw DeviceError(description.name + " does not compute in double precision", Reason::no_double_precision);
  const bool is_double = asked == Precision::double_ || (asked == Precision::automatic && description.float64);
  return {is_double, !is_double && double_rung && description.float64};
}

SeedStage::SeedStage(std::shared_ptr<Device> opened, const Precisions& precisions, NeighbourSource source, double scale,
                     const Box& box, bool in_solid)
    : device_(std::move(opened)), double_(precisions.is_double), double_rung_(precisions.double_rung),
      in_solid_(in_solid), source_(source), box_(box), commands(*device_), scan(*device_), counters(*device_),
      seeds(*device_), neighbours(*device_, double_, in_solid ? kSolidLists : kSurfaceLists) {
  counters.reserve(kCounters * sizeof(std::uint32_t));
  seeds.scale = scale;
}

bool SeedStage::within_reach(const std::vector<Vec3>& given) const {
  return std::all_of(given.begin(), given.end(), [&](const Vec3& p) {
    const double most = kFarthest / seeds.scale;
    return std::abs(p.x) < most && std::abs(p.y) < most && std::abs(p.z) < most;
  });
}

void SeedStage::sort(const std::vector<Vec3>& given) {
  seeds.sorted = sort_seeds(given);
  followed_ = false;
}

void SeedStage::begin(const std::vector<Vec3>& given) {
  const Stopwatch watch;
  SortedSeeds& sorted = seeds.sorted;
  followed_ = !delaunay() && given.size() == sorted.x.size() && given.size() == sorted.slot.size();
  if (followed_) {
    parallel_each(given.size(), [&](std::size_t i) { sorted.x[sorted.slot[i]] = given[i]; });
    sorted.extent = bounding_box(sorted.x).diagonal();
  } else {
    sort(given);
  }
  if (delaunay()) rings_.build(sorted, NeighbourSource::delaunay);
  lists_seconds_ = watch.seconds();
  spacing_ = typical_spacing(given, in_solid_);
}

void SeedStage::record() {
  upload_seeds();
  exact.begin(seeds.sorted, delaunay() ? &rings_ : nullptr, spacing_);
  commands.fill(counters, 0, kCounters * sizeof(std::uint32_t), 0);
  neighbours.begin(commands, seeds, spacing_, scan);
  if (delaunay()) neighbours.upload_lists(commands, seeds, rings_);
  else neighbours.list_nearest(commands, seeds, counters);
}

bool SeedStage::keeps_slots(const std::vector<Vec3>& given, const Counters& counted) {
  if (!followed_ || !counted[kCoincident]) return true;
  sort(given);
  return false;
}

void SeedStage::upload_seeds() {
  RealWords words(double_), wide(true);
  words.reserve(point_words(double_) * seeds.count());
  std::vector<SeedId> ids;
  ids.reserve(seeds.count());
  double largest = 0;
  for (std::size_t slot = 0; slot < seeds.count(); ++slot) {
    const Vec3& x = seeds.sorted.x[slot];
    const auto low = [&](double coordinate) { return low_word(coordinate, seeds.scale, slot); };
    ids.push_back({seeds.sorted.id[slot], {low(x.x), low(x.y), low(x.z)}});
    words.point(seeds.scale * x);
    if (double_rung_) wide.point(seeds.scale * x);
    largest = std::max({largest, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  }
  for (const Vec3& corner : {box_.lo, box_.hi})
    largest = std::max({largest, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
  seeds.residual = double_ ? 0 : residual_of(largest * seeds.scale);
  commands.phase(&DeviceSeconds::transfer);
  upload(commands, seeds.words, words);
  if (double_rung_) upload(commands, seeds.doubles, wide);
  upload(commands, seeds.ids, ids);
}

Counters SeedStage::run_counted() {
  Counters counted{};
  commands.download(counters, 0, counted.data(), sizeof counted);
  commands.run();
  return counted;
}

BackendDescription SeedStage::description() const {
  const DeviceDescription& device = device_->description();
  return {device.name, device.kind, double_ ? "double" : "single", ""};
}

void SeedStage::set_step_masses(CellMoments& moments) {
  if (delaunay()) return bisector::set_step_masses(seeds.sorted, rings_, moments);
  complete_step_masses(
      seeds.sorted, [&]() -> const Neighbours& { return exact.neighbours(); }, moments);
}

}  // namespace bisector::host
