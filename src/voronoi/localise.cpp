#include "voronoi/localise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/grouping.h"
#include "core/parallel.h"
#include "mesh/topology.h"
#include "voronoi/clip.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/polygons.h"
#include "voronoi/step_mass.h"

namespace bisector {
namespace {

// Pieces across a wall come to light one behind the other: where a wall is much thinner than the edges, as many as
// there are seeds nearer than the first on the right side. Every kRounds rounds it is looked at by how much fewer
// triangles were divided in the last than kRounds before. Where few cells have strays, no more than one in kManyLeft,
// the rounds end if that was not by half; where sheets cross there is no end to it, and all is given up if many have
// and it was not by a tenth, or when each triangle has been divided kDivisions times on average.
constexpr int kRounds = 16;
constexpr double kFewLess = 0.5, kManyLess = 0.9;
constexpr std::size_t kDivisions = 16, kManyLeft = 10;
// Distances from a seed that differ by less, in diagonals of the seeds' box, are the same.
constexpr double kSamePoint = 1e-9;
constexpr std::size_t kCellsAtOnce = 64, kTrianglesAtOnce = 8;  // of a parallel loop

using Triangles = std::vector<Index>;  // ascending

bool contains(std::span<const Index> values, Index value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

void sort_unique(std::vector<Index>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

using Slots = std::unordered_map<Index, std::vector<Index>>;  // of triangles

bool has_slot(const Slots& of, Index triangle, Index slot) {
  const auto at = of.find(triangle);
  return at != of.end() && contains(at->second, slot);
}

// Values for some of the items 0 to n - 1.
template <class T>
class Overlay {
 public:
  void reset(std::size_t n) {
    at_.assign(n, kNone);
    items.clear();
    values_.clear();
  }
  const T* find(Index item) const { return at_[item] == kNone ? nullptr : &values_[at_[item]]; }
  T& operator[](Index item) {
    if (at_[item] == kNone) {
      at_[item] = static_cast<Index>(items.size());
      items.push_back(item);
      values_.emplace_back();
    }
    return values_[at_[item]];
  }

  std::vector<Index> items;  // that have a value

 private:
  std::vector<Index> at_;
  std::vector<T> values_;
};

}  // namespace

struct Localiser::Work {
  const Surface& surface;
  // The half-edges by which a triangle's neighbours across its own half-edge are entered, if need be behind triangles
  // that are exactly collinear and have no polygons.
  Csr<std::size_t> across;
  std::vector<char> direct;  // of each half-edge: there is no such triangle between

  SortedSeeds seeds;
  Neighbours neighbours{ListLength{}, LongLists::all_seeds};
  ThreadLocal<Clipper> clippers;           // of these seeds
  ThreadLocal<std::vector<Index>> places;  // of triangles in the list of one cell; anything for others
  const RestrictedPolygons* raw = nullptr;
  const Csr<Index>* raw_triangles = nullptr;       // of each cell in `raw`
  std::vector<std::size_t> first;                  // polygon in `raw` of each triangle
  Overlay<RestrictedPolygons> clipped;             // triangles as they are divided now
  Overlay<Triangles> cell_triangles;               // of cells that changed
  std::map<Index, std::vector<Triangles>> strays;  // components of cells apart from their seeds
  Slots left_out, back;                            // without a cell on a triangle, and not again

  explicit Work(const Surface& s);

  // Both return how many cells have strays.
  std::size_t find_all_strays(const std::vector<Vec3>& given, const Diagram& diagram);
  std::optional<std::size_t> localise(const std::vector<Vec3>& given, Diagram& diagram);

 private:
  // The polygons on a triangle as they are now.
  struct Row {
    const RestrictedPolygons* polygons;
    std::size_t begin, end;
    // The polygon of a cell; `end` if there is none.
    std::size_t find(Index cell) const {
      std::size_t p = begin;
      while (p < end && polygons->pairs[p].cell != cell) ++p;
      return p;
    }
    bool has_label(std::size_t polygon, Index label) const {
      const auto& labels = polygons->labels;
      for (std::size_t e = polygons->offsets[polygon]; e < polygons->offsets[polygon + 1]; ++e)
        if (labels[e] == label) return true;
      return false;
    }
  };
  Row row(Index triangle) const {
    if (const RestrictedPolygons* anew = clipped.find(triangle)) return {anew, 0, anew->pairs.size()};
    return {raw, first[triangle], first[triangle + 1]};
  }
  std::span<const Index> triangles_of(Index cell) const;

  Clipper& clipper();
  void take(const Row& on, std::size_t polygon, Clipper& clipper) const;
  double squared_distance(Index triangle, Index cell, Clipper& clipper) const;
  std::vector<std::size_t> nearest_to_seed(Index cell, std::span<const Index> triangles);
  std::vector<Triangles> find_strays(Index cell);
  void find_strays(const std::vector<Index>& cells);
  bool is_own(Index triangle, Index cell) const;
  bool borders_on_own(Index cell, const Triangles& piece) const;
  bool is_left_out(Index triangle, Index cell) const;
  bool has_own_at(std::size_t half_edge) const;
  Triangles leave_out();
  Triangles put_back_torn(const Triangles& among);
  Triangles beside(const Triangles& triangles) const;
  std::vector<Index> clip_anew(const Triangles& triangles);
  RestrictedPolygons clip(Index triangle, Clipper& clipper) const;
  Index nearest_but(const Vec3& q, std::span<const Index> without, Clipper& clipper) const;
  RestrictedPolygons splice() const;
  void sum(Diagram& diagram);
};

Localiser::Work::Work(const Surface& s) : surface(s) {
  const std::vector<Triangle>& triangles = s.mesh.triangles;
  const EdgeTable table = edge_table(triangles, s.mesh.vertices.size());
  std::vector<std::size_t> edge_of(3 * triangles.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h) edge_of[*h] = e;
  const auto has_facet = [&](std::size_t half_edge) { return s.facet_of[half_edge / 3] != kNone; };
  direct.assign(3 * triangles.size(), 1);
  std::vector<std::size_t> behind;  // half-edges of collinear triangles
  across = group_into_rows<std::size_t>(3 * triangles.size(), [&](const auto& put) {
    for (std::size_t from = 0; from < 3 * triangles.size(); ++from) {
      if (!has_facet(from)) continue;
      behind.assign(1, from);
      for (std::size_t i = 0; i < behind.size(); ++i) {
        const std::size_t edge = edge_of[behind[i]];
        for (const std::size_t* h = table.half_edges.begin(edge); h != table.half_edges.end(edge); ++h) {
          if (*h / 3 == behind[i] / 3 || *h / 3 == from / 3) continue;
          if (has_facet(*h)) {
            put(from, *h);
            continue;
          }
          direct[from] = 0;
          for (std::size_t next = *h - *h % 3, k = 0; k < 3; ++k)
            if (next + k != *h && std::find(behind.begin(), behind.end(), next + k) == behind.end())
              behind.push_back(next + k);
        }
      }
    }
  });
}

// Until one is added to the cells that changed.
std::span<const Index> Localiser::Work::triangles_of(Index cell) const {
  if (const Triangles* changed = cell_triangles.find(cell)) return *changed;
  return {raw_triangles->begin(cell), raw_triangles->end(cell)};
}

Clipper& Localiser::Work::clipper() {
  bool known = false;
  Clipper& mine = clippers.local(known);
  if (!known) mine.reset(seeds);
  return mine;
}

// Has the clipper hold a polygon as its labels say, which is the same whatever computed them.
void Localiser::Work::take(const Row& on, std::size_t polygon, Clipper& clipper) const {
  const RestrictedPolygons& polygons = *on.polygons;
  const auto& [triangle, cell] = polygons.pairs[polygon];
  std::vector<Index> labels(polygons.labels.begin() + static_cast<std::ptrdiff_t>(polygons.offsets[polygon]),
                            polygons.labels.begin() + static_cast<std::ptrdiff_t>(polygons.offsets[polygon + 1]));
  for (Index& label : labels)
    if (!is_edge(label)) label = seeds.slot[label];
  clipper.begin(surface.facets[surface.facet_of[triangle]]);
  clipper.take(seeds.slot[cell], labels.data(), labels.size());
}

// Of a cell's seed from its polygon on a triangle.
double Localiser::Work::squared_distance(Index triangle, Index cell, Clipper& clipper) const {
  const Row on = row(triangle);
  take(on, on.find(cell), clipper);
  double least = norm2(clipper.vertex(0));
  for (std::size_t k = 1; k + 1 < clipper.size(); ++k)
    least =
        std::min(least, norm2(nearest_on_triangle({}, clipper.vertex(0), clipper.vertex(k), clipper.vertex(k + 1))));
  return least;
}

// Which of a cell's triangles hold the polygons nearest to its seed; several where it is on all of them. A polygon is
// no nearer than its triangle.
std::vector<std::size_t> Localiser::Work::nearest_to_seed(Index cell, std::span<const Index> triangles) {
  const Vec3& seed = seeds.x[seeds.slot[cell]];
  const double same = kSamePoint * seeds.extent;
  std::vector<double> bounds;
  for (const Index t : triangles) {
    const auto& corners = surface.facets[surface.facet_of[t]].corners;
    bounds.push_back(norm(nearest_on_triangle(seed, corners[0], corners[1], corners[2]) - seed));
  }
  std::vector<std::pair<double, std::size_t>> tried;
  double least = std::numeric_limits<double>::infinity();
  const auto attempt = [&](std::size_t i) {
    if (bounds[i] > least + same) return;
    tried.push_back({std::sqrt(squared_distance(triangles[i], cell, clipper())), i});
    least = std::min(least, tried.back().first);
  };
  const auto lowest = static_cast<std::size_t>(std::min_element(bounds.begin(), bounds.end()) - bounds.begin());
  attempt(lowest);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (i != lowest) attempt(i);
  std::vector<std::size_t> nearest;
  for (const auto& [distance, i] : tried)
    if (distance <= least + same) nearest.push_back(i);
  return nearest;
}

// The components of a cell but for that nearest to its seed, or those that it is on.
std::vector<Triangles> Localiser::Work::find_strays(Index cell) {
  const std::span<const Index> triangles = triangles_of(cell);
  const std::size_t count = triangles.size();
  if (count < 2) return {};
  std::vector<Index>& place = places.local();
  place.resize(surface.mesh.triangles.size());
  for (Index i = 0; i < count; ++i) place[triangles[i]] = i;
  DisjointSets<> parts(count);
  std::size_t components = count;
  for (std::size_t i = 0; i < count; ++i) {
    const Row on = row(triangles[i]);
    const std::size_t p = on.find(cell);
    for (std::size_t e = on.polygons->offsets[p]; e < on.polygons->offsets[p + 1]; ++e) {
      const Index label = on.polygons->labels[e];
      if (!is_edge(label)) continue;
      const std::size_t h = std::size_t{3} * triangles[i] + (label & ~kEdgeLabel);
      for (const std::size_t* other = across.begin(h); other != across.end(h); ++other) {
        const Index t = static_cast<Index>(*other / 3), at = place[t];
        if (at < count && triangles[at] == t) components -= parts.join(i, at);
      }
    }
  }
  if (components == 1) return {};
  const std::vector<std::size_t> nearest = nearest_to_seed(cell, triangles);
  for (const std::size_t i : nearest) parts.join(i, nearest[0]);
  const std::size_t own = parts.root(nearest[0]);
  std::vector<std::size_t> piece_of(count, count);
  std::vector<Triangles> pieces;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t root = parts.root(i);
    if (root == own) continue;
    if (piece_of[root] == count) {
      piece_of[root] = pieces.size();
      pieces.emplace_back();
    }
    pieces[piece_of[root]].push_back(triangles[i]);
  }
  return pieces;
}

void Localiser::Work::find_strays(const std::vector<Index>& cells) {
  std::vector<std::vector<Triangles>> found(cells.size());
  parallel_each(
      cells.size(), [&](std::size_t k) { found[k] = find_strays(cells[k]); }, kCellsAtOnce);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (found[k].empty()) strays.erase(cells[k]);
    else strays[cells[k]] = std::move(found[k]);
  }
}

bool Localiser::Work::is_own(Index triangle, Index cell) const {
  const auto at = strays.find(cell);
  return at == strays.end() || std::none_of(at->second.begin(), at->second.end(), [&](const Triangles& piece) {
           return std::binary_search(piece.begin(), piece.end(), triangle);
         });
}

// A sheet without a seed has pieces that border on none, and they stay. Beyond a mesh edge there may be another cell
// where this one is left out already.
bool Localiser::Work::borders_on_own(Index cell, const Triangles& piece) const {
  for (const Index t : piece) {
    const Row on = row(t);
    const std::size_t p = on.find(cell);
    for (std::size_t e = on.polygons->offsets[p]; e < on.polygons->offsets[p + 1]; ++e) {
      const Index label = on.polygons->labels[e];
      if (!is_edge(label)) {
        if (is_own(t, label)) return true;
        continue;
      }
      const std::size_t h = std::size_t{3} * t + (label & ~kEdgeLabel);
      for (const std::size_t* other = across.begin(h); other != across.end(h); ++other)
        if (is_left_out(static_cast<Index>(*other / 3), cell) && has_own_at(*other)) return true;
    }
  }
  return false;
}

bool Localiser::Work::is_left_out(Index triangle, Index cell) const {
  return has_slot(left_out, triangle, seeds.slot[cell]);
}

// Whether a cell's own part lies at a half-edge, in its triangle.
bool Localiser::Work::has_own_at(std::size_t half_edge) const {
  const auto triangle = static_cast<Index>(half_edge / 3);
  const Row on = row(triangle);
  for (std::size_t p = on.begin; p < on.end; ++p)
    if (on.has_label(p, kEdgeLabel | static_cast<Index>(half_edge % 3)) && is_own(triangle, on.polygons->pairs[p].cell))
      return true;
  return false;
}

// Leaves out seeds where they have stray pieces. Returns the triangles, ascending.
Triangles Localiser::Work::leave_out() {
  Triangles triangles;
  for (const auto& [cell, pieces] : strays)
    for (const Triangles& piece : pieces) {
      if (!borders_on_own(cell, piece)) continue;
      for (const Index t : piece) {
        const Index slot = seeds.slot[cell];
        if (has_slot(back, t, slot)) continue;
        left_out[t].push_back(slot);
        triangles.push_back(t);
      }
    }
  sort_unique(triangles);
  return triangles;
}

// Where a cell ends at a mesh edge because it is left out on one of these triangles beyond, it is put back there.
// Returns the triangles where one was.
Triangles Localiser::Work::put_back_torn(const Triangles& among) {
  Triangles triangles;
  std::vector<std::pair<Index, Index>> torn;
  for (const Index triangle : among) {
    const auto slots = left_out.find(triangle);
    if (slots == left_out.end()) continue;
    for (Index k = 0; k < 3; ++k) {
      const std::size_t h = std::size_t{3} * triangle + k;
      if (!direct[h]) continue;
      for (const std::size_t* other = across.begin(h); other != across.end(h); ++other) {
        const Row there = row(static_cast<Index>(*other / 3));
        for (const Index slot : slots->second)
          if (const std::size_t q = there.find(seeds.id[slot]);
              q < there.end && there.has_label(q, kEdgeLabel | static_cast<Index>(*other % 3)))
            torn.push_back({triangle, slot});
      }
    }
  }
  for (const auto& [triangle, slot] : torn) {
    std::erase(left_out[triangle], slot);
    if (!contains(back[triangle], slot)) back[triangle].push_back(slot);
    triangles.push_back(triangle);
  }
  sort_unique(triangles);
  return triangles;
}

// Those that have an edge with any of these.
Triangles Localiser::Work::beside(const Triangles& triangles) const {
  Triangles found;
  for (const Index t : triangles)
    for (std::size_t h = std::size_t{3} * t; h < std::size_t{3} * t + 3; ++h)
      for (const std::size_t* other = across.begin(h); other != across.end(h); ++other)
        found.push_back(static_cast<Index>(*other / 3));
  sort_unique(found);
  return found;
}

// A slot with a cell on the facet that the clipper is at, some being left out.
Index Localiser::Work::nearest_but(const Vec3& q, std::span<const Index> without, Clipper& clipper) const {
  double radius = norm(seeds.x[neighbours.nearest(q)] - q);
  for (std::size_t tried = 0; tried + without.size() < seeds.x.size(); radius = 1.5 * radius + 1e-6 * seeds.extent) {
    std::vector<Index> near = neighbours.around(q, radius);
    std::erase_if(near, [&](Index s) { return norm(seeds.x[s] - q) > radius || contains(without, s); });
    std::sort(near.begin(), near.end(), [&](Index a, Index b) {
      return std::pair(norm2(seeds.x[a] - q), seeds.id[a]) < std::pair(norm2(seeds.x[b] - q), seeds.id[b]);
    });
    for (; tried < near.size(); ++tried)
      if (clipper.clip(neighbours, near[tried])) return near[tried];
  }
  return kNone;
}

// The division of a triangle among the seeds that are not left out.
RestrictedPolygons Localiser::Work::clip(Index triangle, Clipper& clipper) const {
  const auto these = left_out.find(triangle);
  const std::span<const Index> without = these == left_out.end() ? std::span<const Index>{} : these->second;
  clipper.begin(surface.facets[surface.facet_of[triangle]], without);
  std::vector<Index> met;
  const auto meet = [&](Index slot) {
    if (slot != kNone && !contains(met, slot) && !contains(without, slot)) met.push_back(slot);
  };
  const Row before = row(triangle);
  for (std::size_t p = before.begin; p < before.end; ++p) meet(seeds.slot[before.polygons->pairs[p].cell]);
  if (const auto at = back.find(triangle); at != back.end())
    for (const Index slot : at->second) meet(slot);
  if (met.empty()) meet(nearest_but(surface.mesh.vertices[surface.mesh.triangles[triangle][0]], without, clipper));
  RestrictedPolygons found;
  found.offsets = {0};
  for (std::size_t k = 0; k < met.size(); ++k) {
    if (!clipper.clip(neighbours, met[k])) continue;
    append_polygon(clipper, seeds, triangle, met[k], found);
    for (std::size_t e = 0; e < clipper.size(); ++e)
      if (!is_edge(clipper.label(e))) meet(clipper.label(e));
  }
  std::vector<std::size_t> order(found.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return found.pairs[a].cell < found.pairs[b].cell; });
  RestrictedPolygons sorted;
  for (const std::size_t p : order) append_polygons(found, p, p + 1, sorted);
  return sorted;
}

// Returns the cells that lost or won.
std::vector<Index> Localiser::Work::clip_anew(const Triangles& triangles) {
  std::vector<RestrictedPolygons> anew(triangles.size());
  parallel_each(
      triangles.size(), [&](std::size_t k) { anew[k] = clip(triangles[k], clipper()); }, kTrianglesAtOnce);
  std::vector<Index> cells;
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const Index t = triangles[k];
    const Row before = row(t);
    for (std::size_t p = before.begin; p < before.end; ++p) cells.push_back(before.polygons->pairs[p].cell);
    for (const auto& pair : anew[k].pairs) cells.push_back(pair.cell);
  }
  sort_unique(cells);
  for (const Index cell : cells)
    if (!cell_triangles.find(cell)) {
      const std::span<const Index> now = triangles_of(cell);
      cell_triangles[cell].assign(now.begin(), now.end());
    }
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const Index t = triangles[k];
    const Row before = row(t);
    for (std::size_t p = before.begin; p < before.end; ++p) {
      Triangles& of = cell_triangles[before.polygons->pairs[p].cell];
      of.erase(std::lower_bound(of.begin(), of.end(), t));
    }
    for (const auto& pair : anew[k].pairs) {
      Triangles& of = cell_triangles[pair.cell];
      of.insert(std::lower_bound(of.begin(), of.end(), t), t);
    }
    clipped[t] = std::move(anew[k]);
  }
  return cells;
}

RestrictedPolygons Localiser::Work::splice() const {
  RestrictedPolygons all;
  all.pairs.reserve(raw->pairs.size());
  all.offsets.reserve(raw->offsets.size());
  all.labels.reserve(raw->labels.size());
  all.vertices.reserve(raw->vertices.size());
  Triangles triangles = clipped.items;
  std::sort(triangles.begin(), triangles.end());
  std::size_t kept = 0;
  for (const Index t : triangles) {
    const RestrictedPolygons& polygons = *clipped.find(t);
    append_polygons(*raw, kept, first[t], all);
    append_polygons(polygons, 0, polygons.pairs.size(), all);
    kept = first[t + 1];
  }
  append_polygons(*raw, kept, raw->pairs.size(), all);
  return all;
}

// Sets the moments of the cells that changed, and the triangles of all.
void Localiser::Work::sum(Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  const std::vector<Index>& cells = cell_triangles.items;
  const bool uniform = surface.density.empty();
  parallel_each(
      cells.size(),
      [&](std::size_t k) {
        const Index cell = cells[k];
        Clipper& mine = clipper();
        FixedTreeSum sum;
        for (const Index t : *cell_triangles.find(cell)) {
          const Row on = row(t);
          take(on, on.find(cell), mine);
          sum.add(uniform ? mine.integrate<true>() : mine.integrate<false>());
        }
        moments.cells[cell] = sum.finish();
        moments.step_mass[cell] = -1;
      },
      kCellsAtOnce);
  Csr<Index>& triangles = moments.triangles;
  std::vector<Index> values;
  std::vector<std::size_t> offsets{0};
  for (Index cell = 0; cell < moments.cells.size(); ++cell) {
    if (const Triangles* changed = cell_triangles.find(cell))
      values.insert(values.end(), changed->begin(), changed->end());
    else values.insert(values.end(), triangles.begin(cell), triangles.end(cell));
    offsets.push_back(values.size());
  }
  triangles.values = std::move(values);
  triangles.offsets = std::move(offsets);
  complete_step_masses(
      seeds, [&]() -> const Neighbours& { return neighbours; }, moments);
  moments.mass = fixed_sum(moments.cells.size(), [&](std::size_t i) { return moments.cells[i].mass; });
  moments.energy = fixed_sum(moments.cells.size(), [&](std::size_t i) { return moments.cells[i].second; });
}

std::size_t Localiser::Work::find_all_strays(const std::vector<Vec3>& given, const Diagram& diagram) {
  raw = &diagram.polygons;
  raw_triangles = &diagram.moments.triangles;
  first = first_polygons(*raw, surface.mesh.triangles.size());
  seeds = sort_seeds(given);
  clippers.clear();
  clipped.reset(surface.mesh.triangles.size());
  cell_triangles.reset(given.size());
  strays.clear();
  left_out.clear();
  back.clear();
  std::vector<Index> cells(given.size());
  std::iota(cells.begin(), cells.end(), Index{0});
  find_strays(cells);
  return strays.size();
}

std::optional<std::size_t> Localiser::Work::localise(const std::vector<Vec3>& given, Diagram& diagram) {
  const std::size_t count = find_all_strays(given, diagram);
  if (count == 0) return 0;
  neighbours.build(seeds, NeighbourSource::nearest);
  std::size_t divided = 0, before = std::numeric_limits<std::size_t>::max();
  for (int round = 0;; ++round) {
    const Triangles triangles = leave_out();
    if (triangles.empty()) break;
    if (round % kRounds == 0) {
      const bool many = strays.size() * kManyLeft > given.size();
      const double less = (many ? kManyLess : kFewLess) * static_cast<double>(std::exchange(before, triangles.size()));
      if (static_cast<double>(triangles.size()) > less) {
        if (many) return {};
        break;
      }
    }
    divided += triangles.size();
    if (divided > kDivisions * surface.facets.size()) return {};
    find_strays(clip_anew(triangles));
  }
  Triangles changed;
  for (const auto& at : left_out) changed.push_back(at.first);
  // What else is torn then lies beside what is clipped anew.
  for (Triangles torn = put_back_torn(changed); !torn.empty(); torn = put_back_torn(beside(torn))) clip_anew(torn);
  if (clipped.items.empty()) return 0;
  sum(diagram);
  diagram.polygons = splice();
  return count;
}

Localiser::Localiser(const Surface& surface) : work_(std::make_unique<Work>(surface)) {}
Localiser::~Localiser() = default;

std::optional<std::size_t> Localiser::localise(const std::vector<Vec3>& seeds, Diagram& diagram) {
  return work_->localise(seeds, diagram);
}

std::size_t Localiser::count_strays(const std::vector<Vec3>& seeds, const Diagram& diagram) {
  return work_->find_all_strays(seeds, diagram);
}

}  // namespace bisector
