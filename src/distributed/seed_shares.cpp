#include "distributed/seed_shares.h"

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "checkpoint/bytes.h"
#include "core/parallel.h"

namespace bisector {
namespace {

constexpr std::size_t kSeedsAtOnce = 4096;
constexpr double kSpare = 1.3;  // of the halo: seeds move, and those that are sent serve for some diagrams

bool is_within(const Vec3& p, const Box& box, double halo) {
  for (int k = 0; k < 3; ++k)
    if (p[k] < box.lo[k] - halo || p[k] > box.hi[k] + halo) return false;
  return true;
}

}  // namespace

std::string SeedShares::share(int rank, const Box& box, double halo, const std::vector<Vec3>& seeds) {
  shares_.resize(std::max(shares_.size(), static_cast<std::size_t>(rank) + 1));
  Share& share = shares_[static_cast<std::size_t>(rank)];
  const auto mark = [&](double reach) {
    std::vector<char> within(seeds.size());
    parallel_each(
        seeds.size(), [&](std::size_t i) { within[i] = is_within(seeds[i], box, reach); }, kSeedsAtOnce);
    return within;
  };
  const std::vector<char> needed = mark(halo);
  const bool as_many = share.has.size() == seeds.size();
  std::atomic<std::size_t> count = 0, missing = 0;
  parallel_chunks(seeds.size(), kSeedsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::size_t found = 0, without = 0;
    for (std::size_t i = begin; i < end; ++i) {
      found += needed[i];
      without += as_many && needed[i] > share.has[i];
    }
    count += found;
    missing += without;
  });
  const bool serves = as_many && missing == 0 && share.seeds.size() <= 2 * count + kSeedsAtOnce;
  if (!serves) {
    share.has = mark(kSpare * halo);
    share.seeds.clear();
    for (Index i = 0; i < seeds.size(); ++i)
      if (share.has[i]) share.seeds.push_back(i);
  }
  std::vector<Vec3> positions(share.seeds.size());
  parallel_each(positions.size(), [&](std::size_t k) { positions[k] = seeds[share.seeds[k]]; });
  ByteWriter message;
  message.put(!serves);
  if (!serves) message.put_all(share.seeds);
  return message.put_all(positions).take();
}

std::vector<std::vector<Index>> SeedShares::all() const {
  std::vector<std::vector<Index>> all;
  for (const Share& share : shares_) all.push_back(share.seeds);
  return all;
}

}  // namespace bisector
