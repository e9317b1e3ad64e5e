#include "host/passes/owner_pass.h"

#include "host/passes/packing.h"

namespace bisector::host {
namespace {

struct OwnersPush {
  GridPush grid;
  float residual;
  std::uint32_t two, points, report;
};
static_assert(sizeof(OwnersPush) == 40);

}  // namespace

OwnerPass::OwnerPass(Device& device, bool is_double)
    : double_(is_double), points_(device), owners_(device), lost_(device), pokes_(device) {}

void OwnerPass::set_points(Commands& commands, const std::vector<Vec3>& points, double scale) {
  count_ = points.size();
  RealWords words(double_);
  words.reserve(count_ * 6);
  for (const Vec3& p : points) words.point(scale * p);
  upload(commands, points_, words);
  owners_.reserve(count_ * sizeof(Index));
  lost_.reserve(count_ * sizeof(Index));
  fresh_ = true;
}

void OwnerPass::record(Commands& commands, const DeviceSeeds& seeds, const SeedGrid& grid, const Buffer& counters,
                       bool report) {
  if (count_ == 0) return;
  commands.phase(Phase::owners);
  if (fresh_) commands.fill(owners_, 0, count_ * sizeof(Index), kNone);
  fresh_ = false;
  const OwnersPush push{grid.push(), seeds.residual, 2, static_cast<std::uint32_t>(count_), report};
  commands.dispatch(kernel("owners", double_),
                    {reads(seeds.words), reads(grid.ends()), reads(grid.slots()), reads(points_), updates(owners_),
                     updates(counters), writes(lost_)},
                    push, count_);
}

std::vector<Index> OwnerPass::lost(Commands& commands, std::size_t count) {
  std::vector<Index> points(count);
  commands.download(lost_, 0, points.data(), count * sizeof(Index));
  commands.run();
  return points;
}

void OwnerPass::settle(Commands& commands, const std::vector<Index>& points, const std::vector<Index>& slots) {
  std::vector<Index> pokes;
  for (std::size_t k = 0; k < points.size(); ++k) pokes.insert(pokes.end(), {points[k], slots[k]});
  upload(commands, pokes_, pokes);
  commands.dispatch({"poke", {}}, {reads(pokes_), updates(owners_)}, static_cast<std::uint32_t>(points.size()), points.size());
}

}  // namespace bisector::host
