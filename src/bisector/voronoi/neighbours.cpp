#include "bisector/voronoi/neighbours.h"

#include <nanoflann.hpp>

#include <algorithm>
#include <limits>
#include <mutex>
#include <optional>

#include "bisector/core/parallel.h"
#include "bisector/voronoi/delaunay.h"
#include "bisector/voronoi/morton.h"

namespace bisector {
namespace {

constexpr std::size_t kFirst = 20;   // a random planar cell has six neighbours and is certified by about 16 nearest
constexpr std::size_t kGrowth = 2;
constexpr int kRingLevel = 3;        // the rung at which `nearest` turns to the Delaunay triangulation
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Cloud {
  const std::vector<Vec3>& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t k) const { return points[i][static_cast<int>(k)]; }
  template <class BBox>
  bool kdtree_get_bbox(BBox&) const { return false; }
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, Index>;

// Distances are compared after rounding; this keeps what a list leaves out beyond its radius all the same.
double lower_bound_of_distance(double squared) { return std::sqrt(squared) * (1 - 1e-12); }

}  // namespace

SortedSeeds sort_seeds(const std::vector<Vec3>& seeds) {
  SortedSeeds sorted;
  sorted.id = morton_order(seeds);
  sorted.slot.assign(seeds.size(), kNone);
  sorted.x.reserve(seeds.size());
  // Equal seeds are neighbours in Morton order, the lowest index first.
  std::size_t n = 0;
  for (std::size_t k = 0; k < sorted.id.size(); ++k) {
    const Index i = sorted.id[k];
    if (n && sorted.x.back() == seeds[i]) continue;
    sorted.slot[i] = static_cast<Index>(n);
    sorted.id[n++] = i;
    sorted.x.push_back(seeds[i]);
  }
  sorted.id.resize(n);
  return sorted;
}

struct Neighbours::Tree {
  Cloud cloud;
  KdTree index;
  explicit Tree(const std::vector<Vec3>& points)
      : cloud{points}, index(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {
    index.buildIndex();
  }
};

struct Neighbours::Grown {
  std::vector<Index> values;
  double radius = 0;
  int level = 0;
  Grown* next = nullptr;
};

struct Neighbours::LastRung {
  std::once_flag once;
  std::optional<Csr<Index>> rings;  // by slot, ascending distance
};

Neighbours::Neighbours() = default;
Neighbours::~Neighbours() { drop_grown(); }

void Neighbours::drop_grown() {
  for (std::size_t i = 0; i < head_count_; ++i)
    for (Grown* g = heads_[i].load(std::memory_order_relaxed); g;) {
      Grown* next = g->next;
      delete g;
      g = next;
    }
  head_count_ = 0;
}

void Neighbours::build(const SortedSeeds& seeds, NeighbourSource source) {
  const std::size_t n = seeds.x.size();
  if (heads_ && grown_.load() == 0 && head_count_ == n) {
    // No list was grown, so the heads are all null still.
  } else {
    drop_grown();
    heads_ = std::make_unique<std::atomic<Grown*>[]>(n);
    head_count_ = n;
  }
  grown_ = 0;
  seeds_ = &seeds;
  last_rung_ = std::make_unique<LastRung>();
  tree_ = n ? std::make_unique<Tree>(seeds.x) : nullptr;
  use_rings_ = source == NeighbourSource::delaunay && last_rung().rings.has_value();
  if (use_rings_) return;

  stride_ = n ? std::min(kFirst, n - 1) : 0;
  first_.resize(n * stride_);
  radius_.resize(n);
  parallel_chunks(n, 512, [&](std::size_t, std::size_t begin, std::size_t end) {
    Index found[kFirst + 1];
    double squared[kFirst + 1];
    for (std::size_t i = begin; i < end; ++i) {
      tree_->index.knnSearch(&seeds.x[i].x, stride_ + 1, found, squared);
      Index* out = &first_[i * stride_];
      for (std::size_t k = 0, m = 0; k <= stride_ && m < stride_; ++k)
        if (found[k] != i) out[m++] = found[k];
      radius_[i] = stride_ + 1 == n ? kInfinity : lower_bound_of_distance(squared[stride_]);
    }
  });
}

NeighbourList Neighbours::list(Index slot) const {
  if (use_rings_) {
    const auto& rings = *last_rung_->rings;
    return {rings.begin(slot), rings.end(slot), kInfinity, kRingLevel};
  }
  const Index* begin = first_.data() + slot * stride_;
  return {begin, begin + stride_, radius_[slot], 0};
}

NeighbourList Neighbours::wider(Index slot, const NeighbourList& shorter) const {
  Grown* head = heads_[slot].load(std::memory_order_acquire);
  while (!head || head->level <= shorter.level) {
    std::unique_ptr<Grown> fresh = grow(slot, (head ? head->level : 0) + 1);
    fresh->next = head;
    if (heads_[slot].compare_exchange_strong(head, fresh.get(), std::memory_order_acq_rel)) {
      head = fresh.release();
      grown_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  return {head->values.data(), head->values.data() + head->values.size(), head->radius, head->level};
}

std::unique_ptr<Neighbours::Grown> Neighbours::grow(Index slot, int level) const {
  const std::size_t n = seeds_->x.size();
  auto grown = std::make_unique<Grown>();
  grown->level = level;
  if (level >= kRingLevel && last_rung().rings) {
    const auto& rings = *last_rung_->rings;
    grown->values.assign(rings.begin(slot), rings.end(slot));
    grown->radius = kInfinity;
    return grown;
  }
  std::size_t count = kFirst;
  for (int k = 0; k < level && count < n - 1; ++k) count *= kGrowth;
  count = std::min(count, n - 1);
  std::vector<Index> found(count + 1);
  std::vector<double> squared(count + 1);
  tree_->index.knnSearch(&seeds_->x[slot].x, count + 1, found.data(), squared.data());
  for (std::size_t k = 0; k <= count && grown->values.size() < count; ++k)
    if (found[k] != slot) grown->values.push_back(found[k]);
  grown->radius = count + 1 == n ? kInfinity : lower_bound_of_distance(squared[count]);
  return grown;
}

const Neighbours::LastRung& Neighbours::last_rung() const {
  std::call_once(last_rung_->once, [&] {
    last_rung_->rings = delaunay_neighbours(seeds_->x);
    if (!last_rung_->rings) return;
    // A parallel loop in here could run a body that waits for this very call.
    auto& rings = *last_rung_->rings;
    for (std::size_t i = 0; i < rings.rows(); ++i) {
      const Vec3 x = seeds_->x[i];
      std::sort(rings.values.begin() + static_cast<std::ptrdiff_t>(rings.offsets[i]),
                rings.values.begin() + static_cast<std::ptrdiff_t>(rings.offsets[i + 1]),
                [&](Index a, Index b) { return norm2(seeds_->x[a] - x) < norm2(seeds_->x[b] - x); });
    }
  });
  return *last_rung_;
}

Index Neighbours::nearest(const Vec3& q) const {
  Index found = 0;
  double squared = 0;
  tree_->index.knnSearch(&q.x, 1, &found, &squared);
  return found;
}

std::size_t Neighbours::nearest(const Vec3& q, std::size_t count, Index* slots) const {
  std::vector<double> squared(count);
  return tree_->index.knnSearch(&q.x, count, slots, squared.data());
}

std::vector<Index> Neighbours::within(const Vec3& q, double r2) const {
  std::vector<std::pair<Index, double>> found;
  tree_->index.radiusSearch(&q.x, r2 * (1 + 1e-9), found, nanoflann::SearchParams(0, 0, false));
  std::vector<Index> slots;
  for (const auto& f : found) slots.push_back(f.first);
  return slots;
}

}  // namespace bisector
