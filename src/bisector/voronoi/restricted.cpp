#include "bisector/voronoi/restricted.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "bisector/core/parallel.h"
#include "bisector/voronoi/clip.h"

namespace bisector {
namespace {

constexpr std::size_t kSumBlock = 32;
constexpr std::size_t kStepNeighbours = 6;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Contribution {
  Index slot;
  Index triangle;
  Moments moments;
};

// What one chunk of facets contributes, and the polygons if they are wanted.
struct Chunk {
  std::vector<Contribution> contributions;
  RestrictedPolygons polygons;
  Certification certification;
};

// Per thread: a clipper, and the cells that the current facet has met.
struct Walker {
  Clipper clipper;
  std::vector<Index> queue;
  std::vector<Index> stamp;  // by slot: the last visit
  Index visit = 0;
  std::uint64_t generation = 0;  // of the seeds that the clipper knows

  void begin(std::size_t slots) {
    if (stamp.size() != slots || visit == kNone - 1) {
      stamp.assign(slots, 0);
      visit = 0;
    }
    ++visit;
    queue.clear();
  }
  void meet(Index slot) {
    if (stamp[slot] == visit) return;
    stamp[slot] = visit;
    queue.push_back(slot);
  }
};

// Whether q belongs to slot i rather than to slot j.
bool owns(const SortedSeeds& seeds, const Vec3& q, Index i, Index j) {
  const Vec3 d = seeds.x[j] - seeds.x[i], p = q - seeds.x[i];
  const double h = d.x * (d.x - 2 * p.x) + d.y * (d.y - 2 * p.y) + d.z * (d.z - 2 * p.z);
  const double largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const double scale = (std::abs(d.x) + std::abs(d.y) + std::abs(d.z)) *
                       (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) + 2 * largest);
  const double bound = 0x1p-50 * scale + 0x1p-1000;
  if (h > bound) return true;
  if (h < -bound) return false;
  return exact_side(q, seeds.x[i], seeds.id[i], seeds.x[j], seeds.id[j]) > 0;
}

// The cell that q belongs to. Walks from `guess` to ever better seeds; a seed is the owner when no seed within twice its
// distance is better. The answer does not depend on the guess.
Index find_owner(const SortedSeeds& seeds, const Neighbours& neighbours, const Vec3& q, Index guess) {
  Index owner = guess;
  for (;;) {
    const NeighbourList list = neighbours.list(owner);
    const double r2 = norm2(q - seeds.x[owner]);
    const double reach = 4 * r2 * (1 + 1e-9);
    Index better = kNone;
    double best = r2 * (1 - 1e-9);
    const Index* j = list.begin;
    for (; j != list.end; ++j) {
      if (norm2(seeds.x[*j] - seeds.x[owner]) > reach) break;
      const double s2 = norm2(q - seeds.x[*j]);
      if (s2 < best) {
        best = s2;
        better = *j;
      }
    }
    if (better != kNone) {
      owner = better;
      continue;
    }
    if (j == list.end && !(list.radius * list.radius > reach)) break;
    bool certain = true;
    for (const Index* k = list.begin; k != j; ++k)
      if (!owns(seeds, q, owner, *k)) {
        owner = *k;
        certain = false;
        break;
      }
    if (certain) return owner;
  }
  // The list is too short for a certificate: take the best of all seeds that are nearest up to rounding.
  owner = neighbours.nearest(q);
  for (Index k : neighbours.around(q, norm(q - seeds.x[owner]) * (1 + 1e-9)))
    if (k != owner && !owns(seeds, q, owner, k)) owner = k;
  return owner;
}

// The rule of all sums: in ascending triangle index, by blocks of 32, the blocks' sums likewise.
Moments fixed_tree_sum(std::vector<Moments>& terms) {
  if (terms.empty()) return {};
  for (std::size_t n = terms.size(); n > 1;) {
    std::size_t blocks = 0;
    for (std::size_t begin = 0; begin < n; begin += kSumBlock) {
      Moments sum = terms[begin];
      for (std::size_t k = begin + 1; k < std::min(n, begin + kSumBlock); ++k) sum += terms[k];
      terms[blocks++] = sum;
    }
    n = blocks;
  }
  return terms[0];
}

}  // namespace

struct RestrictedVoronoi::Work {
  const Surface& surface;
  SortedSeeds seeds;
  Neighbours neighbours;
  std::vector<Index> owner;   // slot of each site
  std::vector<Index> hint;    // owner's seed index in the last diagram
  std::vector<Chunk> chunks;
  std::uint64_t generation = 0;  // of `seeds`
  ThreadLocal<Walker> walkers;
  std::vector<std::size_t> cell_begin;
  struct Item {
    Index triangle, chunk, entry;
  };
  std::vector<Item> items;

  explicit Work(const Surface& s) : surface(s) {}

  void find_owners(std::size_t seed_count);
  void clip_facets(bool want_polygons);
  void clip_facet(const Facet& facet, Walker& walker, Chunk& chunk, bool want_polygons) const;
  void emit(const Clipper& clipper, const Facet& facet, Index slot, Chunk& chunk) const;
  void sum_cells(std::size_t seed_count, CellMoments& result);
  void set_step_masses(CellMoments& result) const;
  void evaluate(const std::vector<Vec3>& given, NeighbourSource source, CellMoments& result, bool want_polygons);
};

void RestrictedVoronoi::Work::find_owners(std::size_t seed_count) {
  const std::size_t n = surface.sites.size();
  owner.resize(n);
  hint.resize(n, kNone);
  parallel_chunks(n, 256, [&](std::size_t, std::size_t begin, std::size_t end) {
    Index last = kNone;
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3& q = surface.mesh.vertices[surface.sites[k]];
      Index guess = hint[k] < seed_count ? seeds.slot[hint[k]] : kNone;
      if (guess == kNone) guess = last;
      if (guess == kNone) guess = neighbours.nearest(q);
      last = owner[k] = find_owner(seeds, neighbours, q, guess);
      hint[k] = seeds.id[last];
    }
  });
}

void RestrictedVoronoi::Work::emit(const Clipper& clipper, const Facet& facet, Index slot, Chunk& chunk) const {
  RestrictedPolygons& out = chunk.polygons;
  out.pairs.push_back({facet.triangle, seeds.id[slot]});
  for (std::size_t k = 0; k < clipper.size(); ++k) {
    const Index label = clipper.label(k);
    out.labels.push_back(is_edge(label) ? label : seeds.id[label]);
    out.vertices.push_back(seeds.x[slot] + clipper.vertex(k));
  }
  out.offsets.push_back(out.labels.size());
}

void RestrictedVoronoi::Work::clip_facet(const Facet& facet, Walker& walker, Chunk& chunk, bool want_polygons) const {
  Clipper& clipper = walker.clipper;
  const bool uniform = surface.density.empty();
  const Index first = owner[facet.site[0]];
  // A cell is convex: it holds the facet if it owns the corners.
  if (first == owner[facet.site[1]] && first == owner[facet.site[2]]) {
    chunk.contributions.push_back(
        {first, facet.triangle, moved(facet.moments, facet.corners[facet.anchor] - seeds.x[first])});
    if (want_polygons) {
      clipper.begin(facet);
      clipper.take(first);
      emit(clipper, facet, first, chunk);
    }
    return;
  }
  clipper.begin(facet);
  walker.begin(seeds.x.size());
  for (Index site : facet.site) walker.meet(owner[site]);
  for (std::size_t head = 0; head < walker.queue.size(); ++head) {
    const Index slot = walker.queue[head];
    const bool found = clipper.clip(neighbours, slot);
    chunk.certification.uncertain += clipper.uncertain();
    chunk.certification.wider += clipper.wider();
    if (!found) continue;
    for (std::size_t k = 0; k < clipper.size(); ++k)
      if (!is_edge(clipper.label(k))) walker.meet(clipper.label(k));
    chunk.contributions.push_back(
        {slot, facet.triangle, uniform ? clipper.integrate<true>() : clipper.integrate<false>()});
    if (want_polygons) emit(clipper, facet, slot, chunk);
  }
}

void RestrictedVoronoi::Work::clip_facets(bool want_polygons) {
  const std::size_t n = surface.facets.size();
  // Small chunks where facets are few and large.
  const std::size_t size = std::clamp<std::size_t>(n / 256, 1, 512);
  chunks.resize((n + size - 1) / size);
  ++generation;
  parallel_chunks(n, size, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Chunk& chunk = chunks[c];
    chunk.contributions.clear();
    chunk.polygons = {};
    chunk.certification = {};
    Walker& walker = walkers.local();
    if (walker.generation != generation) {
      walker.generation = generation;
      walker.clipper.reset(seeds);
    }
    for (std::size_t k = begin; k < end; ++k) clip_facet(surface.facets[k], walker, chunk, want_polygons);
  });
}

void RestrictedVoronoi::Work::sum_cells(std::size_t seed_count, CellMoments& result) {
  const std::size_t slots = seeds.x.size();
  std::unique_ptr<std::atomic<std::size_t>[]> cursor(new std::atomic<std::size_t>[slots + 1]{});
  parallel_chunks(chunks.size(), 4, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      for (const Contribution& k : chunks[c].contributions) cursor[k.slot].fetch_add(1, std::memory_order_relaxed);
  });
  cell_begin.resize(slots + 1);
  std::size_t total = 0;
  for (std::size_t s = 0; s < slots; ++s) {
    cell_begin[s] = total;
    total += cursor[s].load(std::memory_order_relaxed);
    cursor[s].store(cell_begin[s], std::memory_order_relaxed);
  }
  cell_begin[slots] = total;
  items.resize(total);
  parallel_chunks(chunks.size(), 4, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c)
      for (std::size_t k = 0; k < chunks[c].contributions.size(); ++k) {
        const Contribution& item = chunks[c].contributions[k];
        items[cursor[item.slot].fetch_add(1, std::memory_order_relaxed)] = {
            item.triangle, static_cast<Index>(c), static_cast<Index>(k)};
      }
  });

  result.cells.assign(seed_count, Moments{});
  result.triangles.offsets.assign(seed_count + 1, 0);
  for (std::size_t i = 0; i < seed_count; ++i) {
    const Index s = seeds.slot[i];
    result.triangles.offsets[i + 1] = result.triangles.offsets[i] + (s == kNone ? 0 : cell_begin[s + 1] - cell_begin[s]);
  }
  result.triangles.values.resize(total);
  parallel_chunks(slots, 256, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::vector<Moments> terms;
    for (std::size_t s = begin; s < end; ++s) {
      Item* first = items.data() + cell_begin[s];
      Item* last = items.data() + cell_begin[s + 1];
      std::sort(first, last, [](const Item& a, const Item& b) { return a.triangle < b.triangle; });
      Index* triangles = result.triangles.values.data() + result.triangles.offsets[seeds.id[s]];
      terms.clear();
      for (Item* k = first; k != last; ++k) {
        terms.push_back(chunks[k->chunk].contributions[k->entry].moments);
        *triangles++ = k->triangle;
      }
      result.cells[seeds.id[s]] = fixed_tree_sum(terms);
    }
  });
  set_step_masses(result);
  result.mass = fixed_sum(seed_count, [&](std::size_t i) { return result.cells[i].mass; });
  result.energy = fixed_sum(seed_count, [&](std::size_t i) { return result.cells[i].second; });
  result.certification = {};
  result.certification.pairs = total;
  for (const Chunk& chunk : chunks) {
    result.certification.uncertain += chunk.certification.uncertain;
    result.certification.wider += chunk.certification.wider;
  }
}

void RestrictedVoronoi::Work::set_step_masses(CellMoments& result) const {
  const std::size_t n = result.cells.size();
  double largest = 0;
  for (const Moments& cell : result.cells) largest = std::max(largest, cell.mass);
  result.step_mass.resize(n);
  parallel_each(n, [&](std::size_t i) { result.step_mass[i] = result.cells[i].mass; });
  parallel_each(seeds.x.size(), [&](std::size_t s) {
    double& step_mass = result.step_mass[seeds.id[s]];
    if (step_mass >= 0.25 * largest) return;
    const NeighbourList list = neighbours.list(static_cast<Index>(s));
    std::array<double, kStepNeighbours> around;  // sorted
    std::size_t count = 0;
    for (const Index* j = list.begin; j != list.end && count < kStepNeighbours; ++j) {
      const double mass = result.cells[seeds.id[*j]].mass;
      std::size_t k = count++;
      for (; k > 0 && around[k - 1] > mass; --k) around[k] = around[k - 1];
      around[k] = mass;
    }
    if (count) step_mass = std::max(step_mass, 0.25 * around[count / 2]);
  });
}

void RestrictedVoronoi::Work::evaluate(const std::vector<Vec3>& given, NeighbourSource source, CellMoments& result,
                                       bool want_polygons) {
  const auto t0 = std::chrono::steady_clock::now();
  seeds = sort_seeds(given);
  neighbours.build(seeds, source);
  const auto t1 = std::chrono::steady_clock::now();
  find_owners(given.size());
  const auto t2 = std::chrono::steady_clock::now();
  clip_facets(want_polygons);
  sum_cells(given.size(), result);
  const double building = std::chrono::duration<double>(t1 - t0).count();
  const bool delaunay = source == NeighbourSource::delaunay;
  result.seconds = {delaunay ? building : 0, delaunay ? 0 : building, std::chrono::duration<double>(t2 - t1).count(),
                    seconds_since(t2)};
}

RestrictedVoronoi::RestrictedVoronoi(const Surface& surface) : work_(std::make_unique<Work>(surface)) {}
RestrictedVoronoi::~RestrictedVoronoi() = default;

void RestrictedVoronoi::evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result) {
  work_->evaluate(seeds, source, result, false);
}

void RestrictedVoronoi::evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, CellMoments& result,
                                 RestrictedPolygons& polygons) {
  work_->evaluate(seeds, source, result, true);
  // Chunks are in spatial order; the result is in order of triangles, then cells.
  struct Entry {
    Index triangle, cell, chunk, piece;
  };
  std::vector<Entry> order;
  order.reserve(result.certification.pairs);
  const auto& chunks = work_->chunks;
  for (Index c = 0; c < chunks.size(); ++c)
    for (Index k = 0; k < chunks[c].polygons.pairs.size(); ++k)
      order.push_back({chunks[c].polygons.pairs[k].triangle, chunks[c].polygons.pairs[k].cell, c, k});
  sort_in_parallel(order, [](const Entry& a, const Entry& b) {
    return a.triangle != b.triangle ? a.triangle < b.triangle : a.cell < b.cell;
  });
  polygons = {};
  polygons.pairs.reserve(order.size());
  polygons.offsets.reserve(order.size() + 1);
  for (const Entry& e : order) {
    const RestrictedPolygons& from = chunks[e.chunk].polygons;
    polygons.pairs.push_back({e.triangle, e.cell});
    const auto begin = static_cast<std::ptrdiff_t>(from.offsets[e.piece]);
    const auto end = static_cast<std::ptrdiff_t>(from.offsets[e.piece + 1]);
    polygons.labels.insert(polygons.labels.end(), from.labels.begin() + begin, from.labels.begin() + end);
    polygons.vertices.insert(polygons.vertices.end(), from.vertices.begin() + begin, from.vertices.begin() + end);
    polygons.offsets.push_back(polygons.labels.size());
  }
}

namespace {

// One edge of a polygon with the labels of the edges before and after it: its ends.
struct Side {
  Index cell, label, before, after;
};

bool tiles(const std::vector<Side>& sides) {
  std::vector<Side> sorted = sides;
  const auto less = [](const Side& a, const Side& b) { return a.cell != b.cell ? a.cell < b.cell : a.label < b.label; };
  std::sort(sorted.begin(), sorted.end(), less);
  const auto find = [&](Index cell, Index label) -> const Side* {
    const auto range = std::equal_range(sorted.begin(), sorted.end(), Side{cell, label, 0, 0}, less);
    return range.second - range.first == 1 ? &*range.first : nullptr;
  };
  std::size_t on_edges = 0;
  for (const Side& s : sorted) {
    if (is_edge(s.label)) {
      ++on_edges;
      continue;
    }
    const Side* other = find(s.label, s.cell);
    if (!other || other->before != s.after || other->after != s.before) return false;
  }
  // Along each facet edge from corner to corner: every side continues in the cell that its last vertex names.
  std::size_t covered = 0;
  for (Index k = 0; k < 3; ++k) {
    const Index edge = kEdgeLabel | k, previous = kEdgeLabel | (k + 2) % 3, next = kEdgeLabel | (k + 1) % 3;
    const Side* side = nullptr;
    for (const Side& s : sorted)
      if (s.label == edge && s.before == previous) side = &s;
    for (std::size_t guard = 0; side && guard < sorted.size(); ++guard) {
      ++covered;
      if (is_edge(side->after)) {
        if (side->after != next) return false;
        break;
      }
      const Side* following = find(side->after, edge);
      if (!following || following->before != side->cell) return false;
      side = following;
    }
    if (!side) return false;
  }
  return covered == on_edges;
}

}  // namespace

std::size_t count_untiled(const Surface& surface, const RestrictedPolygons& polygons) {
  // First polygon of each triangle; triangles without area have none and are not asked about.
  const std::size_t n = surface.mesh.triangles.size();
  std::vector<std::size_t> begin(n + 1, 0);
  for (const auto& pair : polygons.pairs) ++begin[pair.triangle + 1];
  for (std::size_t t = 0; t < n; ++t) begin[t + 1] += begin[t];
  std::atomic<std::size_t> failed{0};
  parallel_chunks(n, 512, [&](std::size_t, std::size_t from, std::size_t to) {
    std::vector<Side> sides;
    for (std::size_t t = from; t < to; ++t) {
      if (surface.facet_of[t] == kNone) continue;
      sides.clear();
      for (std::size_t k = begin[t]; k < begin[t + 1]; ++k) {
        const std::size_t first = polygons.offsets[k], size = polygons.offsets[k + 1] - first;
        for (std::size_t e = 0; e < size; ++e)
          sides.push_back({polygons.pairs[k].cell, polygons.labels[first + e], polygons.labels[first + (e + size - 1) % size],
                           polygons.labels[first + (e + 1) % size]});
      }
      if (!tiles(sides)) failed.fetch_add(1, std::memory_order_relaxed);
    }
  });
  return failed.load();
}

}  // namespace bisector
