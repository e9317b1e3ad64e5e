#include "host/vulkan_backend.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bisector/core/parallel.h"
#include "bisector/cvt/cpu_backend.h"
#include "bisector/voronoi/step_mass.h"
#include "host/cell_pass.h"
#include "host/packing.h"
#include "host/polygon_pass.h"

namespace bisector::host {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kFarthest = 1e12;      // coordinate on the device; beyond, squares of singles would overflow
constexpr double kReplan = 1.5;         // change of the number of seeds

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

class VulkanBackend : public Backend {
 public:
  VulkanBackend(const Surface& surface, std::unique_ptr<Device> device, const VulkanOptions& options, bool is_double);

  const Surface& surface() const override { return surface_; }
  BackendDescription description() const override;
  double mass_tolerance() const override { return double_ ? 1e-12 : 1e-6; }
  // Energies are sums of terms that are off by a few units of 2^-24 each, mostly at random.
  double energy_noise() const override { return double_ ? 0 : 1e-7; }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override { run(seeds, moments, nullptr); }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override {
    run(seeds, moments, &polygons);
  }

 private:
  void run(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons* polygons);
  bool within_reach(const std::vector<Vec3>& seeds) const;
  void sort(const std::vector<Vec3>& seeds);
  bool follow(const std::vector<Vec3>& seeds);
  void upload_seeds();
  void plan();
  // False if seeds that were followed have met.
  bool find_owners(bool followed, double spacing);
  void set_step_masses(CellMoments& moments);

  const Surface& surface_;
  std::unique_ptr<Device> device_;
  VulkanOptions options_;
  bool double_;
  Commands commands_;
  Scan scan_;
  Buffer counters_;
  SurfaceBuffers buffers_;
  DeviceSeeds seeds_;
  NeighbourPass neighbours_;
  OwnerPass sites_, samples_;
  FacetSamples plan_;
  std::size_t planned_for_ = 0;
  Neighbours rings_;
  ExactRung exact_;
  PairPass pairs_;
  PairStore store_;
  CellPass cells_;
  PolygonPass polygons_;
  CpuBackend cpu_;
};

VulkanBackend::VulkanBackend(const Surface& surface, std::unique_ptr<Device> device, const VulkanOptions& options,
                             bool is_double)
    : surface_(surface), device_(std::move(device)), options_(options), double_(is_double), commands_(*device_),
      scan_(*device_), counters_(*device_), seeds_(*device_), neighbours_(*device_, is_double), sites_(*device_, is_double),
      samples_(*device_, is_double), exact_(surface), pairs_(*device_, is_double, options.rooms), store_(*device_),
      cells_(*device_, is_double), polygons_(*device_), cpu_(surface, options.neighbours) {
  counters_.reserve(kCounters * sizeof(std::uint32_t));
  buffers_.surface = &surface_;
  seeds_.scale = device_scale(surface_);
  buffers_.facets = upload_facets(*device_, commands_, surface_, seeds_.scale, double_);
  if (!double_ && options_.double_rung && device_->description().float64)
    buffers_.double_facets = upload_facets(*device_, commands_, surface_, seeds_.scale, true);
  std::vector<Vec3> points;
  for (const Index v : surface_.sites) points.push_back(surface_.mesh.vertices[v]);
  sites_.set_points(commands_, points, seeds_.scale);
  cells_.set_surface(commands_, surface_);
  commands_.run();
}

BackendDescription VulkanBackend::description() const {
  const DeviceDescription& device = device_->description();
  return {device.name, device.kind, double_ ? "double" : "single", ""};
}

// Whether all seeds have coordinates that single precision can square.
bool VulkanBackend::within_reach(const std::vector<Vec3>& seeds) const {
  return std::all_of(seeds.begin(), seeds.end(), [&](const Vec3& p) {
    const double most = kFarthest / seeds_.scale;
    return std::abs(p.x) < most && std::abs(p.y) < most && std::abs(p.z) < most;
  });
}

void VulkanBackend::sort(const std::vector<Vec3>& given) {
  seeds_.sorted = sort_seeds(given);
  sites_.forget();
  samples_.forget();
}

// Keeps the slots of the last evaluation if there were as many seeds; their order in space is then good enough.
bool VulkanBackend::follow(const std::vector<Vec3>& given) {
  SortedSeeds& sorted = seeds_.sorted;
  if (options_.neighbours == NeighbourSource::delaunay || given.size() != sorted.x.size() ||
      given.size() != sorted.slot.size())
    return false;
  parallel_each(given.size(), [&](std::size_t i) { sorted.x[sorted.slot[i]] = given[i]; });
  sorted.extent = bounding_box(sorted.x).diagonal();
  return true;
}

void VulkanBackend::upload_seeds() {
  const bool doubles = !buffers_.double_facets.empty();
  RealWords words(double_), wide(true);
  words.reserve(6 * seeds_.count());
  std::vector<std::uint32_t> ids;
  ids.reserve(4 * seeds_.count());
  double largest = 0;
  for (std::size_t slot = 0; slot < seeds_.count(); ++slot) {
    const Vec3& x = seeds_.sorted.x[slot];
    ids.push_back(seeds_.sorted.id[slot]);
    for (int k = 0; k < 3; ++k) ids.push_back(low_word(x[k], seeds_.scale, slot));
    words.point(seeds_.scale * x);
    if (doubles) wide.point(seeds_.scale * x);
    largest = std::max({largest, std::abs(x.x), std::abs(x.y), std::abs(x.z)});
  }
  for (const Vec3& corner : {surface_.box.lo, surface_.box.hi})
    largest = std::max({largest, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
  seeds_.residual = double_ ? 0 : residual_of(largest * seeds_.scale);
  commands_.phase(Phase::transfer);
  upload(commands_, seeds_.words, words);
  if (doubles) upload(commands_, seeds_.doubles, wide);
  upload(commands_, seeds_.ids, ids);
}

// Batches and samples follow the number of seeds.
void VulkanBackend::plan() {
  const auto n = static_cast<double>(seeds_.count()), last = static_cast<double>(planned_for_);
  if (planned_for_ != 0 && n < kReplan * last && last < kReplan * n) return;
  planned_for_ = seeds_.count();
  plan_ = plan_batches(surface_, buffers_.facets, planned_for_, options_.rooms.batch_pairs);
  pairs_.set_plan(commands_, plan_);
  samples_.set_points(commands_, plan_.points, seeds_.scale);
}

bool VulkanBackend::find_owners(bool followed, double spacing) {
  commands_.fill(counters_, 0, kCounters * sizeof(std::uint32_t), 0);
  neighbours_.begin(commands_, seeds_, spacing, scan_);
  if (options_.neighbours == NeighbourSource::delaunay) neighbours_.upload_lists(commands_, seeds_, rings_);
  else neighbours_.list_nearest(commands_, seeds_, counters_);
  sites_.record(commands_, seeds_, neighbours_.grid(), counters_, true);
  samples_.record(commands_, seeds_, neighbours_.grid(), counters_, false);
  Counters counters{};
  commands_.download(counters_, 0, counters.data(), sizeof counters);
  commands_.run();
  if (followed && counters[kMet]) return false;
  if (counters[kLostSites]) {
    const std::vector<Index> lost = sites_.lost(commands_, counters[kLostSites]);
    sites_.settle(commands_, lost, exact_.owners(lost));
  }
  return true;
}

void VulkanBackend::set_step_masses(CellMoments& moments) {
  if (options_.neighbours == NeighbourSource::delaunay) return bisector::set_step_masses(seeds_.sorted, rings_, moments);
  complete_step_masses(seeds_.sorted, [&]() -> const Neighbours& { return exact_.neighbours(); }, moments);
}

void VulkanBackend::run(const std::vector<Vec3>& given, CellMoments& moments, RestrictedPolygons* polygons) {
  if (given.empty() || !within_reach(given)) {
    if (polygons) cpu_.evaluate(given, moments, *polygons);
    else cpu_.evaluate(given, moments);
    moments.certification.cpu = moments.certification.pairs;
    return;
  }
  const Clock::time_point begin = Clock::now();
  const bool delaunay = options_.neighbours == NeighbourSource::delaunay;
  bool followed = follow(given);
  if (!followed) sort(given);
  if (delaunay) rings_.build(seeds_.sorted, NeighbourSource::delaunay);
  const double host_lists = seconds_since(begin);
  const Clock::time_point searching = Clock::now();
  const double spacing = typical_spacing(given);
  for (;;) {
    upload_seeds();
    plan();
    exact_.begin(seeds_.sorted, delaunay ? &rings_ : nullptr, spacing);
    if (find_owners(followed, spacing)) break;
    followed = false;
    sort(given);
  }
  const double searched = seconds_since(searching);
  const Clock::time_point clipping = Clock::now();

  Certification certification;
  const PairJob job{commands_, buffers_, seeds_, neighbours_, sites_, samples_, plan_, exact_, scan_, counters_, store_};
  pairs_.run(job, certification);
  cells_.sort(commands_, seeds_.count(), scan_, store_);
  const auto sum = [&] { cells_.sum(commands_, seeds_, neighbours_, !delaunay, scan_, counters_, store_, moments); };
  sum();
  if (!double_) {
    // If all masses still do not add up, what is left to doubt climbs too, and in the end everything.
    for (const float share : {1.0f, 0.05f, 0.0f}) {
      if (pairs_.refine(job, cells_.cells(), share, certification) > 0) sum();
      if (std::abs(moments.mass - surface_.mass) <= mass_tolerance() * surface_.mass) break;
    }
  }
  set_step_masses(moments);
  certification.pairs = moments.triangles.values.size();
  moments.certification = certification;
  moments.seconds = {};
  moments.seconds.delaunay = delaunay ? host_lists : 0;
  moments.seconds.neighbours = searched + (delaunay ? 0 : host_lists);
  moments.seconds.clip = seconds_since(clipping);
  if (polygons) polygons_.run(pairs_, job, *polygons);
  const std::array<double, kPhases> seconds = commands_.take_seconds();
  moments.seconds.device = {seconds[0], seconds[1], seconds[2], seconds[3], seconds[4], seconds[5], seconds[6]};
}

}  // namespace

std::unique_ptr<Backend> make_vulkan_backend(const Surface& surface, std::unique_ptr<Device> device,
                                             const VulkanOptions& options) {
  const DeviceDescription& description = device->description();
  if (options.precision == Precision::double_ && !description.float64)
    throw DeviceError(description.name + " does not compute in double precision; use --precision single");
  const bool is_double = options.precision == Precision::double_ ||
                         (options.precision == Precision::automatic && description.float64);
  return std::make_unique<VulkanBackend>(surface, std::move(device), options, is_double);
}

}  // namespace bisector::host
