#include "host/passes/owner_pass.h"

#include <utility>

#include "host/passes/packing.h"
#include "kernels/layout/pairs.h"
#include "kernels/layout/push.h"

namespace bisector::host {

OwnerPass::OwnerPass(Device& device, bool is_double)
    : double_(is_double), positions_(device), owners_(device, Lifetime::kept), uncertain_(device), found_(device) {}

void OwnerPass::set_points(Commands& commands, std::vector<Vec3> points, double scale) {
  points_ = std::move(points);
  RealWords words(double_);
  words.reserve(points_.size() * point_words(double_));
  for (const Vec3& p : points_) words.point(scale * p);
  upload(commands, positions_, words);
  owners_.reserve(points_.size() * sizeof(Index));
  uncertain_.reserve(points_.size() * sizeof(Index));
  from_scratch_ = true;
}

void OwnerPass::record(Commands& commands, const DeviceSeeds& seeds, const SeedTree& tree, const Buffer& counters,
                       bool report) {
  const std::size_t count = points_.size();
  if (count == 0) return;
  commands.phase(&DeviceSeconds::owners);
  if (from_scratch_) commands.fill(owners_, 0, count * sizeof(Index), kNone);
  from_scratch_ = false;
  OwnersPush push = tree.push<OwnersPush>(seeds);
  push.point_count = static_cast<uint>(count);
  push.report_uncertain = report;
  commands.dispatch(kernel("owners", double_),
                    {reads(seeds.words), reads(tree.boxes()), reads(positions_), updates(owners_), updates(counters),
                     writes(uncertain_)},
                    push, count);
}

void OwnerPass::complete(Commands& commands, std::size_t uncertain, ExactRung& exact) {
  if (uncertain == 0) return;
  std::vector<Index> listed(uncertain);
  commands.download(uncertain_, 0, listed.data(), uncertain * sizeof(Index));
  commands.run();
  std::vector<Vec3> positions;
  for (const Index k : listed) positions.push_back(points_[k]);
  const std::vector<Index> slots = exact.owners(positions);
  std::vector<PointOwner> found;
  for (std::size_t k = 0; k < uncertain; ++k) found.push_back({listed[k], slots[k]});
  upload(commands, found_, found);
  commands.dispatch({"set_owners", {}}, {reads(found_), updates(owners_)}, CountPush{static_cast<uint>(uncertain)},
                    uncertain);
}

}  // namespace bisector::host
