#include "voronoi/restricted.h"

#include <algorithm>
#include <bit>
#include <span>
#include <utility>

#include "core/append_range.h"
#include "core/marks.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "voronoi/clip.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/known_polygons.h"
#include "voronoi/owner.h"
#include "voronoi/polygons.h"
#include "voronoi/step_mass.h"
#include "voronoi/totals.h"

namespace bisector {
namespace {

// Seeds changed one after the other beyond which another list of them is not related to the last; and places without
// relation, from which on nothing is.
constexpr std::size_t kMostChanges = 24, kMostLost = 64;
constexpr std::size_t kRanges = 8;                             // of triangles, in the sort by cells
constexpr std::size_t kMostFacets = 512, kFewestChunks = 256;  // of a chunk; and chunks, where facets are few and large
constexpr std::size_t kPointsAtOnce = 256, kCellsAtOnce = 256, kTrianglesAtOnce = 4096;  // of a parallel loop

// The moments of a pair whose cell holds all of the facet are left to the facet's summary.
constexpr Index kWhole = kNone;

struct Entry {
  Index slot;
  Index moments;  // index into the chunk's, or kWhole
};

// What one chunk of facets contributes, facet by facet.
struct Chunk {
  std::vector<Entry> entries;
  std::vector<Moments> moments;    // of the pairs whose cell does not hold all of the facet
  std::vector<Index> first_label;  // of each of these, in `labels`; and one past the last
  std::vector<Index> labels;       // bounding lines in cyclic order, the least first: slots or facet edges
  PairCounts counts;

  void clear() {
    entries.clear();
    moments.clear();
    first_label.clear();
    labels.clear();
    counts = {};
  }
  std::span<const Index> labels_of(const Entry& entry) const {
    return {labels.data() + first_label[entry.moments], labels.data() + first_label[entry.moments + 1]};
  }
  std::span<Index> labels_of(const Entry& entry) {
    return {labels.data() + first_label[entry.moments], labels.data() + first_label[entry.moments + 1]};
  }
  // Room for somewhat more than another chunk holds, and no more than somewhat more than this one does: as chunks are
  // kept between diagrams, spare room would be a third of all memory.
  void reserve_for(const Chunk& other);
  void trim();
  // Appends these entries of another chunk, which follow each other.
  void append(const Chunk& from, std::size_t begin, std::size_t end);
};

void Chunk::reserve_for(const Chunk& other) {
  const auto reserve = [](auto& room, std::size_t size) { room.reserve(size + size / 16 + 16); };
  reserve(entries, other.entries.size());
  reserve(moments, other.moments.size());
  reserve(first_label, other.first_label.size());
  reserve(labels, other.labels.size());
}

void Chunk::trim() {
  const auto trim_one = [](auto& room) {
    if (room.capacity() > room.size() + room.size() / 4 + 64) room.shrink_to_fit();
  };
  trim_one(entries);
  trim_one(moments);
  trim_one(first_label);
  trim_one(labels);
}

void Chunk::append(const Chunk& from, std::size_t begin, std::size_t end) {
  const Index before = static_cast<Index>(moments.size());
  Index first = kNone, stop = 0;  // their moments in `from`
  for (std::size_t k = begin; k < end; ++k) {
    Entry entry = from.entries[k];
    if (entry.moments != kWhole) {
      first = std::min(first, entry.moments);
      stop = entry.moments + 1;
      entry.moments = before + entry.moments - first;
    }
    entries.push_back(entry);
  }
  if (first == kNone) return;
  const Index label = from.first_label[first];
  for (Index m = first; m < stop; ++m)
    first_label.push_back(static_cast<Index>(labels.size()) + from.first_label[m] - label);
  append_range(labels, from.labels, label, from.first_label[stop]);
  append_range(moments, from.moments, first, stop);
}

// Per thread: a clipper, the cells that the current facet has met, and what serves a chunk that is brought up to date.
struct Walker {
  Clipper clipper;
  std::vector<Index> queue;
  Marks met;  // slots
  KnownPolygons known;
  std::vector<char> changed;  // of each facet of the chunk
  Chunk renewed;
  std::uint64_t generation = 0;  // of the seeds that the clipper knows

  void begin(std::size_t slots) {
    met.begin(slots);
    queue.clear();
  }
  void meet(Index slot) {
    if (met.mark(slot)) queue.push_back(slot);
  }
};

}  // namespace

struct RestrictedVoronoi::Work {
  const Surface& surface;
  SortedSeeds seeds;
  Neighbours neighbours;
  NeighbourSource built_source = NeighbourSource::nearest;
  std::vector<Index> owner;  // slot of each used vertex
  std::vector<Chunk> chunks;
  std::uint64_t generation = 0;  // of `seeds`
  ThreadLocal<Walker> walkers;
  unsigned chunk_bits = 0;         // a chunk has two to this power facets
  std::vector<Index> first_entry;  // of each facet, in its chunk
  bool followed = false;           // the slots are those of the last diagram
  std::vector<Index> slot_now;     // else, of each of the last slots; kNone where that is unknown
  struct Item {
    Index facet, moments;
  };
  std::vector<Item> items;  // by cell, then by triangle
  std::vector<std::size_t> cell_begin;
  std::vector<Index> cursor;  // by range of triangles and slot

  Work(const Surface& s, ListLength lists) : surface(s), neighbours(lists) {}

  void find_owners();
  Walker& local_walker();
  void clip_facets();
  void clip_facet(std::size_t facet, Walker& walker, Chunk& chunk) const;
  bool is_whole(std::size_t facet) const {
    const Index* vertex = surface.summaries[facet].vertex;
    return owner[vertex[0]] == owner[vertex[1]] && owner[vertex[0]] == owner[vertex[2]];
  }
  bool relabel(Entry& entry, Chunk& chunk) const;
  bool recall(std::size_t begin, std::size_t end, Chunk& chunk, Walker& walker) const;
  void renew(std::size_t begin, std::size_t end, Chunk& chunk, Walker& walker);
  void divide(std::size_t facet, Chunk& chunk, Walker& walker);
  std::size_t chunk_of(std::size_t facet) const { return facet >> chunk_bits; }
  // What has become of a slot of the last diagram.
  Index now(Index slot) const { return followed ? slot : slot < slot_now.size() ? slot_now[slot] : kNone; }
  std::size_t entries_end(std::size_t facet, const Chunk& chunk) const;
  void sort_items();
  PairCounts list_triangles(std::size_t seed_count, CellMoments& result);
  void sum_cells(std::size_t seed_count, CellMoments& result);
  Moments moments_of(Index slot, const Item& item) const;
  void set_polygons(RestrictedPolygons& polygons, bool with_vertices);
  void put_vertices(const Entry& entry, const Chunk& chunk, Clipper& clipper, Vec3* to) const;
  Index* put_labels(std::size_t facet, const Entry& entry, const Chunk& chunk, Index* to) const;
  bool follow(const std::vector<Vec3>& given, NeighbourSource source);
  void relate(const SortedSeeds& last, const std::vector<Vec3>& given);
  DiagramWork evaluate(const std::vector<Vec3>& given, NeighbourSource source, bool want_moments, Want want,
                       Diagram& diagram);
};

void RestrictedVoronoi::Work::find_owners() {
  const std::size_t n = surface.used_vertices.size();
  owner.resize(n, kNone);
  parallel_chunks(n, kPointsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    Index last = kNone;
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3& q = surface.mesh.vertices[surface.used_vertices[k]];
      Index guess = owner[k] == kNone ? kNone : now(owner[k]);
      if (guess == kNone) guess = last;
      if (guess == kNone) guess = neighbours.nearest(q);
      last = owner[k] = find_owner(seeds, neighbours, q, guess);
    }
  });
}

void RestrictedVoronoi::Work::clip_facet(std::size_t index, Walker& walker, Chunk& chunk) const {
  Clipper& clipper = walker.clipper;
  clipper.begin(surface, index);
  walker.begin(seeds.x.size());
  for (const Index vertex : surface.summaries[index].vertex) walker.meet(owner[vertex]);
  for (std::size_t head = 0; head < walker.queue.size(); ++head) {
    const Index slot = walker.queue[head];
    const bool found = clipper.clip(neighbours, slot);
    chunk.counts.add_doubts(clipper);
    if (!found) continue;
    chunk.first_label.push_back(static_cast<Index>(chunk.labels.size()));
    const std::size_t size = clipper.size();
    for (std::size_t e = 0, k = clipper.first_corner(); e < size; ++e, k = k + 1 == size ? 0 : k + 1)
      chunk.labels.push_back(clipper.label(k));
    for (std::size_t k = 0; k < size; ++k)
      if (!is_edge(clipper.label(k))) walker.meet(clipper.label(k));
    chunk.entries.push_back({slot, static_cast<Index>(chunk.moments.size())});
    chunk.moments.push_back(clipper.integrate());
  }
}

// Appends a facet's entries.
void RestrictedVoronoi::Work::divide(std::size_t facet, Chunk& chunk, Walker& walker) {
  first_entry[facet] = static_cast<Index>(chunk.entries.size());
  // A cell is convex: it holds the facet if it owns the corners.
  if (is_whole(facet)) chunk.entries.push_back({owner[surface.summaries[facet].vertex[0]], kWhole});
  else clip_facet(facet, walker, chunk);
}

// Puts today's slots in the place of those of the last diagram. False if one is not known. The least label stays first,
// for seeds that are related are in the same order.
bool RestrictedVoronoi::Work::relabel(Entry& entry, Chunk& chunk) const {
  entry.slot = now(entry.slot);
  if (entry.slot == kNone) return false;
  if (entry.moments == kWhole) return true;
  for (Index& label : chunk.labels_of(entry)) {
    if (!is_edge(label)) label = now(label);
    if (label == kNone) return false;
  }
  return true;
}

// Sets the moments of a chunk of the last diagram, and which facets are not divided as they were then. False if there
// are any.
bool RestrictedVoronoi::Work::recall(std::size_t begin, std::size_t end, Chunk& chunk, Walker& walker) const {
  chunk.counts = {};
  walker.changed.assign(end - begin, 0);
  walker.known.begin(surface, seeds, neighbours, owner.data(), walker.clipper.screens());
  for (std::size_t facet = begin; facet < end; ++facet) {
    char& changed = walker.changed[facet - begin];
    const std::size_t first = first_entry[facet], stop = entries_end(facet, chunk);
    if (!followed)
      for (std::size_t k = first; k < stop; ++k) changed |= !relabel(chunk.entries[k], chunk);
    const bool whole = is_whole(facet);
    changed |= whole != (chunk.entries[first].moments == kWhole);
    if (changed) continue;
    if (whole) {
      chunk.entries[first].slot = owner[surface.summaries[facet].vertex[0]];
      continue;
    }
    for (std::size_t k = first; k < stop; ++k) {
      const Entry& entry = chunk.entries[k];
      walker.known.add(static_cast<Index>(facet), entry.slot, chunk.labels_of(entry), chunk.moments[entry.moments],
                       changed);
    }
  }
  walker.known.finish();
  return std::find(walker.changed.begin(), walker.changed.end(), 1) == walker.changed.end();
}

// Divides the facets that have changed.
void RestrictedVoronoi::Work::renew(std::size_t begin, std::size_t end, Chunk& chunk, Walker& walker) {
  Chunk& renewed = walker.renewed;
  renewed.clear();
  renewed.reserve_for(chunk);
  for (std::size_t facet = begin; facet < end;) {
    if (walker.changed[facet - begin]) {
      divide(facet++, renewed, walker);
      continue;
    }
    std::size_t next = facet;
    while (next < end && !walker.changed[next - begin]) ++next;
    const Index first = first_entry[facet], before = static_cast<Index>(renewed.entries.size());
    renewed.append(chunk, first, entries_end(next - 1, chunk));
    for (; facet < next; ++facet) first_entry[facet] += before - first;
  }
  renewed.first_label.push_back(static_cast<Index>(renewed.labels.size()));
  renewed.trim();
  std::swap(chunk, renewed);
}

std::size_t RestrictedVoronoi::Work::entries_end(std::size_t facet, const Chunk& chunk) const {
  const bool last = facet + 1 == first_entry.size() || chunk_of(facet + 1) != chunk_of(facet);
  return last ? chunk.entries.size() : first_entry[facet + 1];
}

Walker& RestrictedVoronoi::Work::local_walker() {
  Walker& mine = walkers.local();
  if (mine.generation != generation) {
    mine.generation = generation;
    mine.clipper.reset(seeds);
  }
  return mine;
}

void RestrictedVoronoi::Work::clip_facets() {
  const std::size_t n = surface.facets.size();
  const bool remembers = followed || !slot_now.empty();
  const std::size_t chunk_size = std::bit_floor(std::clamp<std::size_t>(n / kFewestChunks, 1, kMostFacets));
  chunk_bits = static_cast<unsigned>(std::countr_zero(chunk_size));
  chunks.resize((n + chunk_size - 1) / chunk_size);
  first_entry.resize(n);
  ++generation;
  parallel_chunks(n, chunk_size, [&](std::size_t c, std::size_t begin, std::size_t end) {
    Chunk& chunk = chunks[c];
    Walker& walker = local_walker();
    if (remembers) {
      if (!recall(begin, end, chunk, walker)) renew(begin, end, chunk, walker);
      return;
    }
    Chunk& fresh = walker.renewed;
    fresh.clear();
    for (std::size_t k = begin; k < end; ++k) divide(k, fresh, walker);
    fresh.first_label.push_back(static_cast<Index>(fresh.labels.size()));
    chunk = fresh;
  });
}

// Brings the entries into the order of cells and, in each, of triangles: a stable counting sort over the triangles in
// their order, in a fixed number of ranges.
void RestrictedVoronoi::Work::sort_items() {
  const std::size_t slots = seeds.x.size(), triangles = surface.facet_of.size();
  const std::size_t range = (triangles + kRanges - 1) / kRanges;
  const auto for_each_entry = [&](std::size_t begin, std::size_t end, const auto& visit) {
    for (std::size_t t = begin; t < end; ++t) {
      const Index facet = surface.facet_of[t];
      if (facet == kNone) continue;
      const Chunk& chunk = chunks[chunk_of(facet)];
      const std::size_t stop = entries_end(facet, chunk);
      for (std::size_t k = first_entry[facet]; k < stop; ++k) visit(facet, chunk.entries[k]);
    }
  };
  cursor.assign(kRanges * slots, 0);
  parallel_chunks(triangles, range, [&](std::size_t r, std::size_t begin, std::size_t end) {
    Index* count = cursor.data() + r * slots;
    for_each_entry(begin, end, [&](Index, const Entry& entry) { ++count[entry.slot]; });
  });
  cell_begin.resize(slots + 1);
  std::size_t total = 0;
  for (std::size_t s = 0; s < slots; ++s) {
    cell_begin[s] = total;
    for (std::size_t r = 0; r < kRanges; ++r) {
      const Index count = cursor[r * slots + s];
      cursor[r * slots + s] = static_cast<Index>(total);
      total += count;
    }
  }
  cell_begin[slots] = total;
  items.resize(total);
  parallel_chunks(triangles, range, [&](std::size_t r, std::size_t begin, std::size_t end) {
    Index* next = cursor.data() + r * slots;
    for_each_entry(begin, end, [&](Index facet, const Entry& entry) {
      items[next[entry.slot]++] = {facet, entry.moments};
    });
  });
}

// Sets the incident triangles of each cell. Returns the counts of all pairs.
PairCounts RestrictedVoronoi::Work::list_triangles(std::size_t seed_count, CellMoments& result) {
  sort_items();
  const std::size_t slots = seeds.x.size();
  result.triangles.offsets.assign(seed_count + 1, 0);
  for (std::size_t i = 0; i < seed_count; ++i) {
    const Index s = seeds.slot[i];
    result.triangles.offsets[i + 1] =
        result.triangles.offsets[i] + (s == kNone ? 0 : cell_begin[s + 1] - cell_begin[s]);
  }
  result.triangles.values.resize(items.size());
  parallel_chunks(slots, kCellsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      Index* triangles = result.triangles.values.data() + result.triangles.offsets[seeds.id[s]];
      for (std::size_t k = cell_begin[s]; k < cell_begin[s + 1]; ++k)
        *triangles++ = surface.summaries[items[k].facet].triangle;
    }
  });
  PairCounts counts;
  for (const Chunk& chunk : chunks) counts += chunk.counts;
  counts.pairs = items.size();
  return counts;
}

// About the slot's seed.
inline Moments RestrictedVoronoi::Work::moments_of(Index slot, const Item& item) const {
  const FacetSummary& summary = surface.summaries[item.facet];
  return item.moments == kWhole ? moved(summary.moments, summary.anchor - seeds.x[slot])
                                : chunks[chunk_of(item.facet)].moments[item.moments];
}

void RestrictedVoronoi::Work::sum_cells(std::size_t seed_count, CellMoments& result) {
  result.cells.assign(seed_count, Moments{});
  parallel_chunks(seeds.x.size(), kCellsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    FixedTreeSum sum;
    for (std::size_t s = begin; s < end; ++s) {
      for (std::size_t k = cell_begin[s]; k < cell_begin[s + 1]; ++k)
        sum.add(moments_of(static_cast<Index>(s), items[k]));
      result.cells[seeds.id[s]] = sum.finish();
    }
  });
  set_step_masses(seeds, neighbours, result);
  set_totals(result);
}

// Moves the seeds of the last diagram in place if these are as many and not far off.
bool RestrictedVoronoi::Work::follow(const std::vector<Vec3>& given, NeighbourSource source) {
  if (given.size() != seeds.x.size() || given.size() != seeds.slot.size() || source != built_source) return false;
  parallel_each(given.size(), [&](std::size_t i) { seeds.x[seeds.slot[i]] = given[i]; });
  seeds.extent = bounding_box(seeds.x).diagonal();
  return neighbours.update();
}

// Finds out which slots the seeds of the last diagram have now: between those that are where they were, some may have
// been removed, added or moved. Where all moved, they are those of the same indices, if their number is the same.
void RestrictedVoronoi::Work::relate(const SortedSeeds& last, const std::vector<Vec3>& given) {
  const std::size_t before = last.slot.size(), count = given.size();
  slot_now.assign(last.x.size(), kNone);
  const auto pair = [&](std::size_t i, std::size_t j) {
    if (last.slot[i] != kNone) slot_now[last.slot[i]] = seeds.slot[j];
  };
  const auto same = [&](std::size_t i, std::size_t j) {
    return i < before && j < count && last.slot[i] != kNone && last.x[last.slot[i]] == given[j];
  };
  // How many seeds to skip in each list to the nearest place where both go on alike; one in each if there is none.
  struct Skip {
    std::size_t last, now;
    bool found;
  };
  const auto skip_changes = [&](std::size_t i, std::size_t j) -> Skip {
    for (std::size_t both = 1; both <= kMostChanges; ++both)
      for (std::size_t k = 0; k <= both; ++k)
        if (same(i + k, j + both - k)) return {k, both - k, true};
    return {1, 1, false};
  };
  std::size_t lost = 0;
  for (std::size_t i = 0, j = 0; i < before && j < count && lost <= kMostLost;) {
    if (same(i, j)) {
      pair(i++, j++);
      continue;
    }
    const Skip skip = skip_changes(i, j);
    lost += !skip.found;
    for (std::size_t k = 0; k < std::min(skip.last, skip.now); ++k) pair(i + k, j + k);
    i += skip.last;
    j += skip.now;
  }
  if (lost <= kMostLost) return;
  slot_now.assign(before == count ? last.x.size() : 0, kNone);
  if (before == count)
    for (std::size_t k = 0; k < count; ++k) pair(k, k);
}

DiagramWork RestrictedVoronoi::Work::evaluate(const std::vector<Vec3>& given, NeighbourSource source, bool want_moments,
                                              Want want, Diagram& diagram) {
  DiagramWork work;
  Stopwatch watch;
  followed = follow(given, source);
  if (!followed) {
    const SortedSeeds last = std::exchange(seeds, sort_seeds(given));
    relate(last, given);
    neighbours.build(seeds, source);
    built_source = source;
  }
  (source == NeighbourSource::delaunay ? work.delaunay : work.neighbours) = watch.lap();
  find_owners();
  work.owners = watch.lap();
  clip_facets();
  work.counts = list_triangles(given.size(), diagram.moments);
  if (want_moments) sum_cells(given.size(), diagram.moments);
  work.clip = watch.lap();
  if (includes(want, Want::labels)) set_polygons(diagram.polygons, includes(want, Want::polygons));
  return work;
}

// Writes the labels of a polygon as the caller knows them. Returns where they end.
Index* RestrictedVoronoi::Work::put_labels(std::size_t facet, const Entry& entry, const Chunk& chunk, Index* to) const {
  if (entry.moments == kWhole) {
    const unsigned char* rank = surface.facets[facet].rank;
    for (Index k = 0, edge = rank[0] == 0 ? 0 : rank[1] == 0 ? 1 : 2; k < 3; ++k, edge = edge == 2 ? 0 : edge + 1)
      *to++ = kEdgeLabel | edge;
    return to;
  }
  for (const Index label : chunk.labels_of(entry)) *to++ = is_edge(label) ? label : seeds.id[label];
  return to;
}

// Writes the vertices of a polygon on the facet that the clipper is at, in the order of its labels.
void RestrictedVoronoi::Work::put_vertices(const Entry& entry, const Chunk& chunk, Clipper& clipper, Vec3* to) const {
  if (entry.moments == kWhole) {
    clipper.take(entry.slot);
  } else {
    const std::span<const Index> labels = chunk.labels_of(entry);
    clipper.take(entry.slot, labels.data(), labels.size());
  }
  const std::size_t size = clipper.size();
  for (std::size_t e = 0, k = clipper.first_corner(); e < size; ++e, k = k + 1 == size ? 0 : k + 1)
    to[e] = seeds.x[entry.slot] + clipper.vertex(k);
}

// Sets the polygons from their labels, in order of triangles, then cells. Blocks of triangles are counted first, so
// that each has its place.
void RestrictedVoronoi::Work::set_polygons(RestrictedPolygons& polygons, bool with_vertices) {
  struct Place {
    std::size_t pair = 0, corner = 0;
  };
  const std::size_t triangles = surface.facet_of.size();
  std::vector<Place> places(triangles / kTrianglesAtOnce + 2);
  parallel_chunks(triangles, kTrianglesAtOnce, [&](std::size_t block, std::size_t begin, std::size_t end) {
    Place& count = places[block + 1];
    for (std::size_t t = begin; t < end; ++t) {
      const Index facet = surface.facet_of[t];
      if (facet == kNone) continue;
      const Chunk& chunk = chunks[chunk_of(facet)];
      const std::size_t first = first_entry[facet], stop = entries_end(facet, chunk);
      count.pair += stop - first;
      for (std::size_t k = first; k < stop; ++k)
        count.corner += chunk.entries[k].moments == kWhole ? 3 : chunk.labels_of(chunk.entries[k]).size();
    }
  });
  for (std::size_t block = 1; block < places.size(); ++block) {
    places[block].pair += places[block - 1].pair;
    places[block].corner += places[block - 1].corner;
  }
  polygons.pairs.resize(places.back().pair);
  polygons.offsets.resize(places.back().pair + 1);
  polygons.offsets[0] = 0;
  polygons.labels.resize(places.back().corner);
  if (with_vertices) polygons.vertices.resize(places.back().corner);
  else polygons.vertices = {};
  parallel_chunks(triangles, kTrianglesAtOnce, [&](std::size_t block, std::size_t begin, std::size_t end) {
    Place at = places[block];
    Clipper& clipper = local_walker().clipper;
    std::vector<Entry> entries;
    for (std::size_t t = begin; t < end; ++t) {
      const Index facet = surface.facet_of[t];
      if (facet == kNone) continue;
      const Chunk& chunk = chunks[chunk_of(facet)];
      const Entry* all = chunk.entries.data();
      entries.assign(all + first_entry[facet], all + entries_end(facet, chunk));
      std::sort(entries.begin(), entries.end(),
                [&](const Entry& a, const Entry& b) { return seeds.id[a.slot] < seeds.id[b.slot]; });
      if (with_vertices) clipper.begin(surface, facet);
      for (const Entry& entry : entries) {
        Index* labels = polygons.labels.data() + at.corner;
        if (with_vertices) put_vertices(entry, chunk, clipper, polygons.vertices.data() + at.corner);
        at.corner += static_cast<std::size_t>(put_labels(facet, entry, chunk, labels) - labels);
        polygons.pairs[at.pair++] = {static_cast<Index>(t), seeds.id[entry.slot]};
        polygons.offsets[at.pair] = at.corner;
      }
    }
  });
}

RestrictedVoronoi::RestrictedVoronoi(const Surface& surface, ListLength lists)
    : work_(std::make_unique<Work>(surface, lists)) {}
RestrictedVoronoi::~RestrictedVoronoi() = default;

DiagramWork RestrictedVoronoi::evaluate(const std::vector<Vec3>& seeds, NeighbourSource source, Want want,
                                        Diagram& diagram) {
  return work_->evaluate(seeds, source, true, want, diagram);
}

DiagramWork RestrictedVoronoi::trace(const std::vector<Vec3>& seeds, NeighbourSource source, Want want,
                                     Diagram& diagram) {
  return work_->evaluate(seeds, source, false, want, diagram);
}

void RestrictedVoronoi::polygons_of(Index slot, std::vector<CellPolygon>& polygons) const {
  polygons.clear();
  for (std::size_t k = work_->cell_begin[slot]; k < work_->cell_begin[slot + 1]; ++k) {
    const Work::Item& item = work_->items[k];
    std::span<const Index> labels;
    if (item.moments != kWhole)
      labels = std::as_const(work_->chunks[work_->chunk_of(item.facet)]).labels_of(Entry{slot, item.moments});
    polygons.push_back({item.facet, labels, work_->moments_of(slot, item)});
  }
}

const SortedSeeds& RestrictedVoronoi::seeds() const { return work_->seeds; }
const Neighbours& RestrictedVoronoi::neighbours() const { return work_->neighbours; }

}  // namespace bisector
