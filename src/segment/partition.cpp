#include "segment/partition.h"

#include <algorithm>
#include <utility>

namespace bisector {
namespace {

// Regions of more than one in so many of all triangles together are listed by going through all labels: that is
// quicker than to sort.
constexpr std::size_t kSortBelow = 8;

void make_unique(std::vector<Index>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

void insert_sorted(std::vector<Index>& values, Index value) {
  const auto at = std::lower_bound(values.begin(), values.end(), value);
  if (at == values.end() || *at != value) values.insert(at, value);
}

void erase_sorted(std::vector<Index>& values, Index value) {
  const auto at = std::lower_bound(values.begin(), values.end(), value);
  if (at != values.end() && *at == value) values.erase(at);
}

}  // namespace

double Partition::energy() const {
  double sum = 0;
  for (const RegionFit& fit : fits) sum += fit.energy;
  return sum;
}

void Partition::resize(std::size_t count) {
  triangles.resize(count);
  neighbours.resize(count);
  proxies.resize(count);
  fits.resize(count);
  changed.resize(count, 1);
}

std::vector<Index> Partition::triangles_of(const std::vector<Index>& regions) const {
  std::size_t size = 0;
  for (const Index r : regions) size += triangles[r].size();
  std::vector<Index> result;
  result.reserve(size);
  if (kSortBelow * size > labels.size()) {
    std::vector<Index> owner(labels.size(), kNone);
    for (const Index r : regions)
      for (const Index t : triangles[r]) owner[t] = r;
    for (Index t = 0; t < owner.size(); ++t)
      if (owner[t] != kNone) result.push_back(t);
  } else {
    for (const Index r : regions) result.insert(result.end(), triangles[r].begin(), triangles[r].end());
    std::sort(result.begin(), result.end());
  }
  return result;
}

void Partition::relist(const std::vector<Index>& regions, const std::vector<Index>& among) {
  for (const Index r : regions) triangles[r].clear();
  for (const Index t : among) triangles[labels[t]].push_back(t);
}

void Partition::disconnect(const std::vector<Index>& regions) {
  for (const Index r : regions) {
    for (const Index n : neighbours[r]) erase_sorted(neighbours[n], r);
    neighbours[r].clear();
  }
}

void Partition::connect(const SegmentDomain& domain, const std::vector<Index>& regions) {
  std::vector<Index> around;
  for (const Index r : regions) {
    around.clear();
    for (const Index t : triangles[r])
      for (const Index* n = domain.graph.neighbours.begin(t); n != domain.graph.neighbours.end(t); ++n)
        if (labels[*n] != r && (around.empty() || around.back() != labels[*n])) around.push_back(labels[*n]);
    make_unique(around);
    for (const Index n : around) insert_sorted(neighbours[n], r);
    neighbours[r] = around;
  }
}

void PartitionUndo::keep(const Partition& partition, Index region) {
  if (region >= count_) return;
  if (at_.empty()) at_.assign(count_, kNone);
  if (at_[region] != kNone) return;
  at_[region] = static_cast<Index>(kept_.size());
  kept_.push_back({region, partition.proxies[region], partition.fits[region], partition.triangles[region], {}});
  Kept& kept = kept_.back();
  kept.distances.reserve(kept.triangles.size());
  for (const Index t : kept.triangles) kept.distances.push_back(partition.distances[t]);
}

void PartitionUndo::keep(const Partition& partition, const std::vector<Index>& regions) {
  for (const Index r : regions) keep(partition, r);
}

void PartitionUndo::add(PartitionUndo&& later) {
  if (at_.empty()) at_.assign(count_, kNone);
  for (Kept& kept : later.kept_) {
    if (kept.region >= count_ || at_[kept.region] != kNone) continue;
    at_[kept.region] = static_cast<Index>(kept_.size());
    kept_.push_back(std::move(kept));
  }
}

double PartitionUndo::growth(const Partition& partition) const {
  double sum = 0;
  for (const Kept& kept : kept_)
    for (std::size_t k = 0; k < kept.triangles.size(); ++k)
      sum += partition.distances[kept.triangles[k]] - kept.distances[k];
  return sum;
}

void PartitionUndo::restore_labels(Partition& partition) const {
  for (const Kept& kept : kept_)
    for (std::size_t k = 0; k < kept.triangles.size(); ++k) {
      partition.labels[kept.triangles[k]] = kept.region;
      partition.distances[kept.triangles[k]] = kept.distances[k];
    }
}

void PartitionUndo::restore(const SegmentDomain& domain, Partition& partition) {
  std::vector<Index> regions;
  for (const Kept& kept : kept_)
    if (kept.region < partition.count()) regions.push_back(kept.region);
  for (auto r = static_cast<Index>(count_); r < partition.count(); ++r) regions.push_back(r);
  partition.disconnect(regions);
  partition.resize(count_);
  restore_labels(partition);
  regions.clear();
  for (Kept& kept : kept_) {
    partition.triangles[kept.region] = std::move(kept.triangles);
    partition.proxies[kept.region] = kept.proxy;
    partition.fits[kept.region] = kept.fit;
    regions.push_back(kept.region);
  }
  partition.changed = changed_;
  partition.connect(domain, regions);
}

}  // namespace bisector
