#include "voronoi/neighbours.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>

#include "core/parallel.h"
#include "spatial/hilbert.h"
#include "voronoi/delaunay.h"

namespace bisector {
namespace {

constexpr std::size_t kFirstLeast = 6;  // else the search is repeated with a larger radius
constexpr std::uint64_t kPlaceMask = 1023;
constexpr std::size_t kCandidates = kPlaceMask + 1;  // and with a smaller one beyond these
constexpr int kTrials = 12;
constexpr double kGrowth = 1.6;  // of the radius, from level to level
constexpr int kRingLevel = 6;    // from this rung on `nearest` may turn to the Delaunay triangulation
// Entries of all lists from that rung on, per seed, before it does: they take about as long as the triangulation then.
constexpr std::size_t kLongEntriesPerSeed = 32;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kSeedsAtOnce = 4096;

// Distances are compared after rounding; this keeps what a list leaves out beyond its radius all the same.
constexpr double kBelow = 1 - 1e-9;
constexpr double kMostLost = 0.3;  // of a radius, before lists are built again

// Distance and place in one key: squared distances are positive, so their bits sort like them; the last ten give way.
std::uint64_t sort_key(double squared, std::size_t place) {
  return (std::bit_cast<std::uint64_t>(squared) & ~kPlaceMask) | place;
}

}  // namespace

SortedSeeds sort_seeds(const std::vector<Vec3>& seeds) {
  const std::vector<Index> order = hilbert_order(seeds);
  // Equal seeds are neighbours in Hilbert order, the lowest index first.
  const auto is_first = [&](std::size_t k) { return k == 0 || !(seeds[order[k]] == seeds[order[k - 1]]); };
  std::vector<std::size_t> slot((order.size() + kSeedsAtOnce - 1) / kSeedsAtOnce + 1, 0);  // the first of each chunk
  parallel_chunks(order.size(), kSeedsAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) slot[c + 1] += is_first(k);
  });
  std::partial_sum(slot.begin(), slot.end(), slot.begin());
  SortedSeeds sorted;
  sorted.id.resize(slot.back());
  sorted.x.resize(slot.back());
  sorted.slot.assign(seeds.size(), kNone);
  parallel_chunks(order.size(), kSeedsAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    std::size_t n = slot[c];
    for (std::size_t k = begin; k < end; ++k) {
      if (!is_first(k)) continue;
      const Index i = order[k];
      sorted.slot[i] = static_cast<Index>(n);
      sorted.id[n] = i;
      sorted.x[n++] = seeds[i];
    }
  });
  sorted.extent = bounding_box(sorted.x).diagonal();
  return sorted;
}

struct Neighbours::Candidate {
  double squared;
  Index slot;
  bool operator<(const Candidate& b) const { return squared < b.squared; }
};

struct Neighbours::Search {
  double radius = 0;  // carried along, for seeds nearby need similar ones
  std::vector<Index> found;
  std::vector<double> px, py, pz, squared;  // of the seeds found
  std::vector<std::uint64_t> keys, spread;

  void sort_keys(std::size_t n, double limit);
  void resize(std::size_t n) {
    if (px.size() >= n) return;
    for (auto* array : {&px, &py, &pz, &squared}) array->resize(2 * n);
    keys.resize(2 * n);
    spread.resize(2 * n);
  }
};

// Sorts the first n keys, all of squared distances below `limit`: spread over buckets, what is left is a step or two
// each.
void Neighbours::Search::sort_keys(std::size_t n, double limit) {
  constexpr std::size_t kBuckets = 64, kFew = 16;
  if (!(limit > 1e-290 && limit < kInfinity)) return std::sort(keys.data(), keys.data() + n);
  const double scale = kBuckets / limit;
  const auto bucket = [&](std::uint64_t key) {
    return std::min(kBuckets - 1, static_cast<std::size_t>(std::bit_cast<double>(key) * scale));
  };
  unsigned end[kBuckets + 1] = {};  // of each bucket, once it is filled; before that its begin
  for (std::size_t k = 0; k < n; ++k) ++end[bucket(keys[k]) + 1];
  for (std::size_t b = 0; b < kBuckets; ++b) end[b + 1] += end[b];
  for (std::size_t k = 0; k < n; ++k) spread[end[bucket(keys[k])]++] = keys[k];
  for (std::size_t b = 0, begin = 0; b < kBuckets; begin = end[b++])
    if (end[b] - begin > kFew) std::sort(spread.data() + begin, spread.data() + end[b]);
  for (std::size_t k = 0; k < n; ++k) {
    const std::uint64_t key = spread[k];
    std::size_t m = k;
    for (; m > 0 && keys[m - 1] > key; --m) keys[m] = keys[m - 1];
    keys[m] = key;
  }
}

struct Neighbours::Grown {
  std::vector<Index> values;
  double radius = 0;
  int level = 0;
  Grown* next = nullptr;
};

struct Neighbours::LastRung {
  std::once_flag once;
  std::optional<Csr<Index>> rings;                  // by slot, ascending distance
  std::atomic<std::size_t> entries_without_it = 0;  // of lists
};

Neighbours::Neighbours(ListLength length) : length_(length) {}
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

void Neighbours::start(const SortedSeeds& seeds) {
  const std::size_t n = seeds.x.size();
  drop_grown();
  heads_ = std::make_unique<std::atomic<Grown*>[]>(n);
  head_count_ = n;
  seeds_ = &seeds;
  last_rung_ = std::make_unique<LastRung>();
  if (n) tree_.build(seeds.x);
}

void Neighbours::build_on_demand(const SortedSeeds& seeds, double radius) {
  start(seeds);
  use_rings_ = false;
  built_x_.clear();
  on_demand_ = true;
  first_radius_ = radius > 0 ? radius : 1e-3 * seeds.extent;
}

void Neighbours::build(const SortedSeeds& seeds, NeighbourSource source) {
  const std::size_t n = seeds.x.size();
  start(seeds);
  on_demand_ = false;
  use_rings_ = source == NeighbourSource::delaunay && last_rung().rings.has_value();
  built_x_.clear();
  if (use_rings_) return;

  first_.resize(n * length_.most);
  count_.assign(n, 0);
  radius_.assign(n, 0);
  parallel_chunks(tree_.leaves(), 64, [&](std::size_t, std::size_t begin, std::size_t end) {
    Search search;
    search.radius = tree_.leaf_box(begin).diagonal();
    for (std::size_t leaf = begin; leaf < end; ++leaf) {
      const std::size_t first = leaf * SeedTree::kLeaf, last = std::min(n, first + SeedTree::kLeaf);
      if (list_run(first, last, tree_.leaf_box(leaf), search)) continue;
      // The leaf spans a jump of the spatial order.
      for (std::size_t i = first; i < last; ++i) list_run(i, i + 1, {seeds.x[i], seeds.x[i]}, search);
    }
  });
  built_x_ = seeds.x;
  built_tree_.build(built_x_);
  built_radius_ = radius_;
  built_count_ = count_;
}

bool Neighbours::update() {
  const std::vector<Vec3>& x = seeds_->x;
  const std::size_t n = x.size();
  if (use_rings_ || built_x_.size() != n) return false;
  std::vector<double> moved(n);
  parallel_each(n, [&](std::size_t i) { moved[i] = norm(x[i] - built_x_[i]) * (1 + 1e-9); });
  built_tree_.set_values(moved);
  std::atomic<bool> worth_it = true;
  parallel_chunks(n, 64 * SeedTree::kLeaf, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::uint64_t keys[ListLength::kMost];
    Index sorted[ListLength::kMost];
    double others = 0;  // how far any seed that is not listed may have come nearer to the leaf's
    for (std::size_t i = begin; i < end && worth_it.load(std::memory_order_relaxed); ++i) {
      const auto lost_to = [&](const Box& box, double radius) {
        return built_tree_.largest_within(box, radius) * (1 + 1e-9);
      };
      if (i % SeedTree::kLeaf == 0) {
        const auto first = built_radius_.begin() + static_cast<std::ptrdiff_t>(i);
        const double radius = *std::max_element(first, first + std::min<std::ptrdiff_t>(SeedTree::kLeaf, n - i));
        others = lost_to(built_tree_.leaf_box(i / SeedTree::kLeaf), radius);
      }
      double lost = moved[i] + others;
      // A leaf may span a jump of the spatial order.
      if (!(lost <= kMostLost * built_radius_[i]))
        lost = moved[i] + lost_to({built_x_[i], built_x_[i]}, built_radius_[i]);
      if (!(lost <= kMostLost * built_radius_[i])) {
        worth_it.store(false, std::memory_order_relaxed);
        return;
      }
      radius_[i] = (built_radius_[i] - lost) * kBelow;
      // Beyond the radius others may be missing, so what is listed there does not count for now.
      const double squared = radius_[i] * radius_[i];
      std::size_t within = 0;
      Index* list = &first_[i * length_.most];
      for (std::size_t k = 0; k < built_count_[i]; ++k) {
        const double d = norm2(x[list[k]] - x[i]);
        const std::uint64_t key = sort_key(d, k);
        within += d < squared;
        // Seeds that met: only a new build tells which of them keeps its cell.
        if (d == 0) worth_it.store(false, std::memory_order_relaxed);
        std::size_t m = k;
        for (; m > 0 && keys[m - 1] > key; --m) keys[m] = keys[m - 1];
        keys[m] = key;
      }
      for (std::size_t k = 0; k < built_count_[i]; ++k) sorted[k] = list[keys[k] & kPlaceMask];
      std::copy(sorted, sorted + built_count_[i], list);
      count_[i] = static_cast<unsigned char>(within);
    }
  });
  if (!worth_it) return false;
  drop_grown();
  heads_ = std::make_unique<std::atomic<Grown*>[]>(n);
  head_count_ = n;
  last_rung_ = std::make_unique<LastRung>();
  tree_.build(x);
  return true;
}

// Lists for the seeds [begin, end) from one search around their box; a failing search is repeated with another radius.
// False if the box is too large to be worth it.
bool Neighbours::list_run(std::size_t begin, std::size_t end, const Box& box, Search& search) {
  const std::vector<Vec3>& x = seeds_->x;
  if (!(search.radius > 0)) search.radius = std::max(box.diagonal(), 1e-6 * seeds_->extent);
  if (box.diagonal() > length_.longest * search.radius) return false;
  for (int trial = 0;; ++trial) {
    search.found.clear();
    tree_.near(box, search.radius, search.found);
    const bool all = search.found.size() == x.size();
    const bool last = all || trial == kTrials;
    if (search.found.size() > kCandidates) {
      if (last) return false;
      search.radius *= 0.6;
      continue;
    }
    const double squared = all ? kInfinity : search.radius * search.radius;
    const std::size_t n = search.found.size();
    search.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const Vec3 p = x[search.found[k]];
      search.px[k] = p.x;
      search.py[k] = p.y;
      search.pz[k] = p.z;
    }
    std::size_t least = x.size(), total = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = x[i];
      const double *px = search.px.data(), *py = search.py.data(), *pz = search.pz.data();
      double* d = search.squared.data();
      const Index* found = search.found.data();
      for (std::size_t k = 0; k < n; ++k) {
        const double dx = px[k] - p.x, dy = py[k] - p.y, dz = pz[k] - p.z;
        d[k] = dx * dx + dy * dy + dz * dz;
      }
      std::uint64_t* out = search.keys.data();
      for (std::size_t k = 0; k < n; ++k) {
        *out = sort_key(d[k], k);
        out += static_cast<int>(d[k] < squared) & static_cast<int>(found[k] != i);
      }
      std::size_t kept = static_cast<std::size_t>(out - search.keys.data());
      least = std::min(least, kept);
      total += kept;
      search.sort_keys(kept, squared);
      radius_[i] = all ? kInfinity : search.radius * kBelow;
      if (kept > length_.most) {
        radius_[i] = std::sqrt(d[search.keys[length_.most] & kPlaceMask]) * kBelow;
        kept = length_.most;
      }
      count_[i] = static_cast<unsigned char>(kept);
      for (std::size_t k = 0; k < kept; ++k) first_[i * length_.most + k] = search.found[search.keys[k] & kPlaceMask];
    }
    const double mean = static_cast<double>(total) / static_cast<double>(end - begin);
    const double factor = std::clamp(std::pow(length_.mean / std::max(mean, 1.0), length_.power), 0.5, 2.0);
    if (last || least >= kFirstLeast) {
      search.radius *= factor;
      return true;
    }
    search.radius *= std::max(factor, 1.3);
  }
}

NeighbourList Neighbours::list(Index slot) const {
  if (use_rings_) {
    const auto& rings = *last_rung_->rings;
    return {rings.begin(slot), rings.end(slot), kInfinity, kRingLevel};
  }
  if (on_demand_) return {};
  const Index* begin = first_.data() + slot * length_.most;
  return {begin, begin + count_[slot], radius_[slot], 0};
}

NeighbourList Neighbours::wider(Index slot, const NeighbourList& shorter) const {
  Grown* head = heads_[slot].load(std::memory_order_acquire);
  while (!head || head->level <= shorter.level) {
    std::unique_ptr<Grown> fresh =
        head ? grow(slot, head->level + 1, head->radius) : grow(slot, 1, on_demand_ ? first_radius_ : radius_[slot]);
    fresh->next = head;
    if (heads_[slot].compare_exchange_strong(head, fresh.get(), std::memory_order_acq_rel)) head = fresh.release();
  }
  return {head->values.data(), head->values.data() + head->values.size(), head->radius, head->level};
}

std::unique_ptr<Neighbours::Grown> Neighbours::grow(Index slot, int level, double radius) const {
  auto grown = std::make_unique<Grown>();
  grown->level = level;
  const bool is_long = level >= kRingLevel;
  if (is_long && last_rung_->entries_without_it > kLongEntriesPerSeed * seeds_->x.size() && last_rung().rings) {
    const auto& rings = *last_rung_->rings;
    grown->values.assign(rings.begin(slot), rings.end(slot));
    grown->radius = kInfinity;
    return grown;
  }
  const Vec3 p = seeds_->x[slot];
  grown->radius = std::max(kGrowth * radius, 1e-9 * seeds_->extent);
  std::vector<Candidate> candidates;
  const std::vector<Index> found = around(p, grown->radius);
  const double squared = grown->radius * grown->radius;
  for (const Index j : found)
    if (j != slot) candidates.push_back({norm2(seeds_->x[j] - p), j});
  if (found.size() == seeds_->x.size()) {
    grown->radius = kInfinity;
  } else {
    std::erase_if(candidates, [&](const Candidate& c) { return !(c.squared < squared); });
    grown->radius *= kBelow;
  }
  std::sort(candidates.begin(), candidates.end());
  for (const Candidate& c : candidates) grown->values.push_back(c.slot);
  if (is_long) last_rung_->entries_without_it += candidates.size();
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

// A distance within which there are `count` seeds, of those that are near in their order; or fewer, if these are few.
double Neighbours::distance_in_order(Index slot, std::size_t count) const {
  const std::vector<Vec3>& x = seeds_->x;
  const std::size_t near = std::min(count, ListLength::kMost);
  const std::size_t first = slot - std::min<std::size_t>(slot, near), end = std::min(x.size(), slot + near + 1);
  if (end - first <= near) return seeds_->extent;
  std::array<double, 2 * ListLength::kMost> squared{};
  auto last = squared.begin();
  for (std::size_t k = first; k < end; ++k)
    if (k != slot) *last++ = norm2(x[k] - x[slot]);
  const auto nth = squared.begin() + static_cast<std::ptrdiff_t>(near - 1);
  std::nth_element(squared.begin(), nth, last);
  return std::sqrt(*nth);
}

std::size_t Neighbours::nearest_to(Index slot, std::size_t count, Index* slots) const {
  const Vec3 p = seeds_->x[slot];
  const NeighbourList known = list(slot);
  const std::size_t listed = static_cast<std::size_t>(known.end - known.begin);
  struct Near {
    double squared;
    Index id;  // the caller's
    bool operator<(const Near& other) const { return std::tie(squared, id) < std::tie(other.squared, other.id); }
  };
  const auto take = [&](Near* first, std::size_t size) {
    const std::size_t taken = std::min(count, size);
    std::partial_sort(first, first + taken, first + size);
    for (std::size_t k = 0; k < taken; ++k) slots[k] = seeds_->slot[first[k].id];
    return taken;
  };
  // The nearest listed seeds bound the distance of the nearest of all, and so do those that are near in their order.
  double radius = listed >= count ? norm(seeds_->x[known.begin[count - 1]] - p) : distance_in_order(slot, count);
  radius *= 1 + 1e-9;
  if (!use_rings_ && listed >= count && radius < known.radius) {
    std::array<Near, ListLength::kMost> nearest;  // not initialised, which would take as long as the search
    std::size_t size = 0;
    for (const Index* j = known.begin; j != known.end; ++j) {
      const double squared = norm2(seeds_->x[*j] - p);
      if (squared > radius * radius) break;
      nearest[size++] = {squared, seeds_->id[*j]};
    }
    return take(nearest.data(), size);
  }
  for (std::vector<Near> nearest;; radius *= kGrowth) {
    const std::vector<Index> found = around(p, radius);
    nearest.clear();
    for (const Index j : found)
      if (j != slot) nearest.push_back({norm2(seeds_->x[j] - p), seeds_->id[j]});
    std::sort(nearest.begin(), nearest.end());
    const bool complete = nearest.size() >= count && nearest[count - 1].squared <= radius * radius;
    if (complete || found.size() == seeds_->x.size()) return take(nearest.data(), nearest.size());
  }
}

std::vector<Index> Neighbours::around(const Vec3& q, double radius) const {
  std::vector<Index> slots;
  tree_.near({q, q}, radius, slots);
  return slots;
}

}  // namespace bisector
