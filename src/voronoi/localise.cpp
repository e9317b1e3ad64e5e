#include "voronoi/localise.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <unordered_map>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/grouping.h"
#include "core/marks.h"
#include "core/parallel.h"
#include "mesh/topology.h"
#include "voronoi/clip.h"
#include "voronoi/fixed_tree_sum.h"
#include "voronoi/polygon_batch.h"
#include "voronoi/polygons.h"
#include "voronoi/step_mass.h"
#include "voronoi/totals.h"

namespace bisector {
namespace {

// Where the parts that win a region are apart from their seeds, there is another round: few triangles are left then.
// What is left when each triangle has been divided so many times on average stays.
constexpr std::size_t kDivisions = 16;
// Distances from a seed that differ by less, in diagonals of the seeds' box, are the same.
constexpr double kSamePoint = 1e-9;
// Relative; more than rounding makes of squared distances.
constexpr double kRounding = 1e-12;
constexpr std::size_t kCellsAtOnce = 64, kTrianglesAtOnce = 16, kTrianglesInARow = 4096;  // of a parallel loop

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

// The seeds that divide a triangle among them: those around its regions, and its own.
struct Among {
  std::vector<Index> left_out;  // that had stray pieces here
  std::vector<Index> own;       // with cells here that are no stray pieces
  std::vector<Index> regions;   // of stray pieces here, the last time that it was divided
};

// The regions of stray pieces of all rounds, and the seeds around each.
class Regions {
 public:
  void reset(std::size_t slots) {
    around_.clear();
    of_.assign(slots, kNone);
    links_.clear();
  }
  // Adds a region with these seeds around it.
  Index add(std::vector<Index> slots) {
    const auto region = static_cast<Index>(around_.size());
    for (const Index slot : slots) {
      links_.push_back({region, of_[slot]});
      of_[slot] = static_cast<Index>(links_.size() - 1);
    }
    around_.push_back(std::move(slots));
    return region;
  }
  const std::vector<Index>& around(Index region) const { return around_[region]; }
  bool admits(const Among& among, Index slot) const {
    if (contains(among.left_out, slot)) return false;
    if (contains(among.own, slot)) return true;
    for (Index k = of_[slot]; k != kNone; k = links_[k].next)
      if (contains(among.regions, links_[k].region)) return true;
    return false;
  }

 private:
  struct Link {
    Index region, next;
  };
  std::vector<std::vector<Index>> around_;
  std::vector<Index> of_;  // first link of each slot
  std::vector<Link> links_;
};

// Memory that loops over triangles or cells use.
struct Scratch {
  std::vector<Index> place;  // of triangles in the list of one cell; anything for others
  std::vector<Index> labels, slots, beside, kept;
  std::vector<std::array<double, 3>> squares;  // of the distances of slots from a triangle's corners
  std::vector<std::size_t> order;
  RestrictedPolygons found;
  PolygonBatches<std::size_t> batches;  // of polygons of some cells, by number
  std::vector<Moments> moments;         // of these
  std::vector<char> unknown;            // 1 where that may take exact arithmetic
};

// Half-edges that lie across others, mostly one.
class Across {
 public:
  void resize(std::size_t half_edges) { first_.assign(half_edges, kNone); }
  void set(std::size_t half_edge, std::span<const Index> others) {
    if (others.size() == 1) {
      first_[half_edge] = others[0];
    } else if (others.size() > 1) {
      first_[half_edge] = kSeveral | static_cast<Index>(several_.size());
      several_.emplace_back(others.begin(), others.end());
    }
  }
  std::span<const Index> of(std::size_t half_edge) const {
    const Index& first = first_[half_edge];
    if (first == kNone) return {};
    if (first & kSeveral) return several_[first & ~kSeveral];
    return {&first, 1};
  }

 private:
  static constexpr Index kSeveral = 0x80000000u;

  std::vector<Index> first_;  // of each half-edge, or kNone, or a place in several_
  std::vector<std::vector<Index>> several_;
};

}  // namespace

struct Localiser::Work {
  // Polygons of a triangle.
  struct Range {
    std::size_t begin, end;
  };

  const Surface& surface;
  // The half-edges by which a triangle's neighbours across its own half-edge are entered, if need be behind triangles
  // that are exactly collinear and have no polygons.
  Across across;
  std::vector<char> direct;  // of each half-edge: there is no such triangle between

  SortedSeeds seeds;
  ThreadLocal<Clipper> clippers;  // of these seeds
  ThreadLocal<Scratch> scratches;
  const RestrictedPolygons* raw = nullptr;
  const Csr<Index>* raw_triangles = nullptr;       // of each cell in `raw`
  std::vector<std::size_t> first;                  // polygon in `raw` of each triangle
  RestrictedPolygons anew;                         // all that was clipped anew, some of it more than once
  Overlay<Range> clipped;                          // triangles as they are divided now, in `anew`
  Overlay<Triangles> cell_triangles;               // of cells that changed
  std::vector<Index> met;                          // cells on triangles that were clipped anew, changed or not
  std::map<Index, std::vector<Triangles>> strays;  // components of cells apart from their seeds
  Overlay<Among> among;                            // of triangles where seeds are left out
  Regions regions;
  Slots back;   // that are not left out of a triangle again
  Marks taken;  // cells

  explicit Work(const Surface& s);

  // Both return how many cells have strays.
  std::size_t find_all_strays(const std::vector<Vec3>& given, const Diagram& diagram);
  std::size_t localise(const std::vector<Vec3>& given, Diagram& diagram);

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
    std::span<const Index> labels_of(std::size_t polygon) const {
      return std::span(polygons->labels)
          .subspan(polygons->offsets[polygon], polygons->offsets[polygon + 1] - polygons->offsets[polygon]);
    }
    bool has_label(std::size_t polygon, Index label) const {
      const auto& labels = polygons->labels;
      for (std::size_t e = polygons->offsets[polygon]; e < polygons->offsets[polygon + 1]; ++e)
        if (labels[e] == label) return true;
      return false;
    }
  };
  Row row(Index triangle) const {
    if (const Range* now = clipped.find(triangle)) return {&anew, now->begin, now->end};
    return {raw, first[triangle], first[triangle + 1]};
  }
  std::span<const Index> triangles_of(Index cell) const;

  Clipper& clipper();
  std::span<const Index> slot_labels(const Row& on, std::size_t polygon);
  void take(const Row& on, std::size_t polygon, Clipper& clipper);
  double squared_distance(Index triangle, Index cell, Clipper& clipper);
  std::vector<std::size_t> nearest_to_seed(Index cell, std::span<const Index> triangles);
  std::vector<Triangles> find_strays(Index cell);
  std::vector<Triangles> apart_from_seed(Index cell, std::span<const Index> triangles, std::span<const Index> parts);
  template <class Find>
  void set_strays(const std::vector<Index>& cells, const Find& find);
  void find_first_strays();
  bool is_left_out(Index triangle, Index cell) const;
  template <class Body>
  void each_cell_beside(Index cell, const Triangles& piece, const Body& body) const;
  Triangles leave_out();
  Triangles put_back_torn(const Triangles& those);
  Triangles beside(const Triangles& triangles) const;
  std::vector<Index> clip_anew(const Triangles& triangles);
  void find_candidates(Index triangle, Scratch& scratch) const;
  void keep_polygons(Index triangle, Scratch& scratch) const;
  void clip(Index triangle, Clipper& clipper, RestrictedPolygons& out);
  void change(Index triangle, const Row& before, const Row& after, std::vector<Index>& cells);
  RestrictedPolygons splice() const;
  void sum_cells(std::span<const Index> cells, CellMoments& result);
  void sum(Diagram& diagram);
};

Localiser::Work::Work(const Surface& s) : surface(s) {
  const std::vector<Triangle>& triangles = s.mesh.triangles;
  const EdgeTable table = edge_table(triangles, s.mesh.vertices.size());
  const std::size_t half_edges = 3 * triangles.size();
  std::vector<Index> edge_of(half_edges);
  for (std::size_t e = 0; e < table.edges.size(); ++e)
    for (const std::size_t* h = table.half_edges.begin(e); h != table.half_edges.end(e); ++h)
      edge_of[*h] = static_cast<Index>(e);
  const auto has_facet = [&](std::size_t half_edge) { return s.facet_of[half_edge / 3] != kNone; };
  // Collinear triangles that hang together, and the half-edges of facets around them.
  DisjointSets<Index> collinear(triangles.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const std::span at(table.half_edges.begin(e), table.half_edges.end(e));
    const auto flat = std::find_if_not(at.begin(), at.end(), has_facet);
    for (auto h = flat; h != at.end(); ++h)
      if (!has_facet(*h)) collinear.join(static_cast<Index>(*flat / 3), static_cast<Index>(*h / 3));
  }
  const auto around_collinear = group_into_rows<Index>(triangles.size(), [&](const auto& put) {
    for (std::size_t h = 0; h < half_edges; ++h) {
      if (has_facet(h)) continue;
      const Index edge = edge_of[h];
      for (const std::size_t* other = table.half_edges.begin(edge); other != table.half_edges.end(edge); ++other)
        if (has_facet(*other)) put(collinear.root(static_cast<Index>(h / 3)), static_cast<Index>(*other));
    }
  });
  direct.assign(half_edges, 1);
  across.resize(half_edges);
  std::vector<Index> others;
  for (std::size_t from = 0; from < half_edges; ++from) {
    if (!has_facet(from)) continue;
    others.clear();
    const Index edge = edge_of[from];
    for (const std::size_t* h = table.half_edges.begin(edge); h != table.half_edges.end(edge); ++h) {
      if (has_facet(*h)) {
        others.push_back(static_cast<Index>(*h));
        continue;
      }
      direct[from] = 0;
      const Index behind = collinear.root(static_cast<Index>(*h / 3));
      others.insert(others.end(), around_collinear.begin(behind), around_collinear.end(behind));
    }
    if (!direct[from]) {
      std::sort(others.begin(), others.end());
      others.erase(std::unique(others.begin(), others.end()), others.end());
    }
    std::erase_if(others, [&](Index h) { return h / 3 == from / 3; });
    across.set(from, others);
  }
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

// Of a polygon, with slots for cells.
std::span<const Index> Localiser::Work::slot_labels(const Row& on, std::size_t polygon) {
  std::vector<Index>& labels = scratches.local().labels;
  const std::span<const Index> given = on.labels_of(polygon);
  labels.assign(given.begin(), given.end());
  for (Index& label : labels)
    if (!is_edge(label)) label = seeds.slot[label];
  return labels;
}

// Has the clipper hold a polygon as its labels say, which is the same whatever computed them.
void Localiser::Work::take(const Row& on, std::size_t polygon, Clipper& clipper) {
  const auto& [triangle, cell] = on.polygons->pairs[polygon];
  const std::span<const Index> labels = slot_labels(on, polygon);
  clipper.begin(surface, surface.facet_of[triangle]);
  clipper.take(seeds.slot[cell], labels.data(), labels.size());
}

// Of a cell's seed from its polygon on a triangle.
double Localiser::Work::squared_distance(Index triangle, Index cell, Clipper& clipper) {
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

// The components of a cell but for that nearest to its seed, or those that it is on. `parts`: the component of each of
// its triangles.
std::vector<Triangles> Localiser::Work::apart_from_seed(Index cell, std::span<const Index> triangles,
                                                        std::span<const Index> parts) {
  if (std::ranges::all_of(parts, [&](Index part) { return part == parts[0]; })) return {};
  std::vector<Index> own;
  for (const std::size_t i : nearest_to_seed(cell, triangles)) own.push_back(parts[i]);
  std::vector<Index> piece_of;  // the component of each piece
  std::vector<Triangles> pieces;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (contains(own, parts[i])) continue;
    const auto piece = static_cast<std::size_t>(std::ranges::find(piece_of, parts[i]) - piece_of.begin());
    if (piece == pieces.size()) {
      piece_of.push_back(parts[i]);
      pieces.emplace_back();
    }
    pieces[piece].push_back(triangles[i]);
  }
  return pieces;
}

// The same of a cell as its triangles are divided now.
std::vector<Triangles> Localiser::Work::find_strays(Index cell) {
  const std::span<const Index> triangles = triangles_of(cell);
  const std::size_t count = triangles.size();
  if (count < 2) return {};
  std::vector<Index>& place = scratches.local().place;
  place.resize(surface.mesh.triangles.size());
  for (Index i = 0; i < count; ++i) place[triangles[i]] = i;
  DisjointSets<Index> sets(count);
  std::size_t components = count;
  for (Index i = 0; i < count; ++i) {
    const Row on = row(triangles[i]);
    for (const Index label : on.labels_of(on.find(cell))) {
      if (!is_edge(label)) continue;
      for (const Index other : across.of(std::size_t{3} * triangles[i] + (label & ~kEdgeLabel))) {
        const Index t = other / 3, at = place[t];
        if (at < count && triangles[at] == t) components -= sets.join(i, at);
      }
    }
  }
  if (components == 1) return {};
  std::vector<Index> parts(count);
  for (Index i = 0; i < count; ++i) parts[i] = sets.root(i);
  return apart_from_seed(cell, triangles, parts);
}

// To what `find(cell)` returns for each.
template <class Find>
void Localiser::Work::set_strays(const std::vector<Index>& cells, const Find& find) {
  std::vector<std::vector<Triangles>> found(cells.size());
  parallel_each(
      cells.size(), [&](std::size_t k) { found[k] = find(cells[k]); }, kCellsAtOnce);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (found[k].empty()) strays.erase(cells[k]);
    else strays[cells[k]] = std::move(found[k]);
  }
}

// Of all cells of the diagram given. What its polygons have in common across mesh edges joins them, and of a cell that
// is whole as many links join two sets as there are polygons but one.
void Localiser::Work::find_first_strays() {
  ConcurrentSets<Index> sets(raw->pairs.size());
  std::vector<Index> joined(raw_triangles->rows(), 0);
  parallel_chunks(surface.mesh.triangles.size(), kTrianglesInARow,
                  [&](std::size_t, std::size_t begin, std::size_t end) {
                    for (std::size_t p = first[begin]; p < first[end]; ++p) {
                      const auto& [triangle, cell] = raw->pairs[p];
                      for (const Index label : row(triangle).labels_of(p)) {
                        if (!is_edge(label)) continue;
                        const std::size_t h = std::size_t{3} * triangle + (label & ~kEdgeLabel);
                        for (const Index other : across.of(h)) {
                          if (direct[h] && other < h) continue;  // seen from there
                          const Row there = row(other / 3);
                          const std::size_t q = there.find(cell);
                          if (q < there.end && sets.join(static_cast<Index>(p), static_cast<Index>(q)))
                            std::atomic_ref<Index>(joined[cell]).fetch_add(1, std::memory_order_relaxed);
                        }
                      }
                    }
                  });
  std::vector<Index> cells;
  for (Index cell = 0; cell < joined.size(); ++cell)
    if (triangles_of(cell).size() > joined[cell] + 1) cells.push_back(cell);
  set_strays(cells, [&](Index cell) {
    const std::span<const Index> triangles = triangles_of(cell);
    std::vector<Index> parts;
    for (const Index t : triangles) parts.push_back(sets.root(static_cast<Index>(row(t).find(cell))));
    return apart_from_seed(cell, triangles, parts);
  });
}

bool Localiser::Work::is_left_out(Index triangle, Index cell) const {
  const Among* these = among.find(triangle);
  return these && !regions.admits(*these, seeds.slot[cell]);
}

// Calls body(triangle, other) for the cells that a piece of a cell borders on, on its own triangles, and beyond mesh
// edges where the cell is left out already.
template <class Body>
void Localiser::Work::each_cell_beside(Index cell, const Triangles& piece, const Body& body) const {
  for (const Index t : piece) {
    const Row on = row(t);
    const std::size_t p = on.find(cell);
    for (std::size_t e = on.polygons->offsets[p]; e < on.polygons->offsets[p + 1]; ++e) {
      const Index label = on.polygons->labels[e];
      if (!is_edge(label)) {
        body(t, label);
        continue;
      }
      const std::size_t h = std::size_t{3} * t + (label & ~kEdgeLabel);
      for (const Index other : across.of(h)) {
        const auto beyond = other / 3;
        if (!is_left_out(beyond, cell)) continue;
        const Row there = row(beyond);
        for (std::size_t q = there.begin; q < there.end; ++q)
          if (there.has_label(q, kEdgeLabel | other % 3)) body(beyond, there.polygons->pairs[q].cell);
      }
    }
  }
}

// Divides each region of stray pieces that border on each other anew, among the cells that border on it with their own
// parts: all seeds of a sheet across leave it at once. A sheet without a seed is a region that borders on none, and its
// pieces stay. Returns the triangles, ascending.
Triangles Localiser::Work::leave_out() {
  struct Piece {
    Index cell;
    const Triangles* triangles;
  };
  std::vector<Piece> pieces;
  std::vector<std::size_t> first_of(seeds.slot.size(), std::numeric_limits<std::size_t>::max());  // piece of each cell
  for (const auto& [cell, of] : strays) {
    first_of[cell] = pieces.size();
    for (const Triangles& piece : of) pieces.push_back({cell, &piece});
  }
  // Where a triangle holds no piece of the cell, it is the cell's own.
  const auto piece_at = [&](Index triangle, Index cell) {
    for (std::size_t k = first_of[cell]; k < pieces.size() && pieces[k].cell == cell; ++k)
      if (std::binary_search(pieces[k].triangles->begin(), pieces[k].triangles->end(), triangle)) return k;
    return pieces.size();
  };
  DisjointSets<> together(pieces.size());
  std::vector<std::pair<std::size_t, Index>> around;  // slots of own parts around each piece, later each region
  for (std::size_t k = 0; k < pieces.size(); ++k)
    each_cell_beside(pieces[k].cell, *pieces[k].triangles, [&](Index triangle, Index other) {
      const std::size_t piece = piece_at(triangle, other);
      if (piece == pieces.size()) around.push_back({k, seeds.slot[other]});
      else together.join(k, piece);
    });
  for (auto& piece : around) piece.first = together.root(piece.first);
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  std::vector<Index> region_of(pieces.size(), kNone);  // of the pieces that are the lowest of their regions
  for (auto at = around.begin(); at != around.end();) {
    const std::size_t root = at->first;
    std::vector<Index> slots;
    for (; at != around.end() && at->first == root; ++at) slots.push_back(at->second);
    region_of[root] = regions.add(std::move(slots));
  }

  std::vector<std::pair<Index, Index>> regions_at;  // of triangles
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const Index region = region_of[together.root(k)];
    if (region == kNone) continue;
    const Index slot = seeds.slot[pieces[k].cell];
    for (const Index t : *pieces[k].triangles) {
      if (has_slot(back, t, slot)) continue;
      among[t].left_out.push_back(slot);
      regions_at.push_back({t, region});
    }
  }
  std::sort(regions_at.begin(), regions_at.end());
  regions_at.erase(std::unique(regions_at.begin(), regions_at.end()), regions_at.end());
  Triangles triangles;
  for (auto at = regions_at.begin(); at != regions_at.end();) {
    const Index t = at->first;
    Among& these = among[t];
    these.own.clear();
    these.regions.clear();
    for (; at != regions_at.end() && at->first == t; ++at) these.regions.push_back(at->second);
    const auto left = [&](Index slot) { return !contains(these.left_out, slot); };
    const Row on = row(t);
    for (std::size_t p = on.begin; p < on.end; ++p)
      if (const Index slot = seeds.slot[on.polygons->pairs[p].cell]; left(slot)) these.own.push_back(slot);
    if (these.own.empty() && std::none_of(these.regions.begin(), these.regions.end(), [&](Index region) {
          return std::any_of(regions.around(region).begin(), regions.around(region).end(), left);
        })) {
      // All that could have the triangle have left it before.
      for (std::size_t p = on.begin; p < on.end; ++p) {
        const Index slot = seeds.slot[on.polygons->pairs[p].cell];
        std::erase(these.left_out, slot);
        these.own.push_back(slot);
        back[t].push_back(slot);
      }
      continue;
    }
    triangles.push_back(t);
  }
  return triangles;
}

// Where a cell ends at a mesh edge because it is left out on one of these triangles beyond, it is put back there.
// Returns the triangles where one was.
Triangles Localiser::Work::put_back_torn(const Triangles& those) {
  Triangles triangles;
  std::vector<std::pair<Index, Index>> torn;
  for (const Index triangle : those) {
    const Among* these = among.find(triangle);
    if (!these) continue;
    for (Index k = 0; k < 3; ++k) {
      const std::size_t h = std::size_t{3} * triangle + k;
      if (!direct[h]) continue;
      for (const Index other : across.of(h)) {
        const Row there = row(other / 3);
        for (std::size_t q = there.begin; q < there.end; ++q) {
          const Index slot = seeds.slot[there.polygons->pairs[q].cell];
          if (there.has_label(q, kEdgeLabel | other % 3) && !regions.admits(*these, slot))
            torn.push_back({triangle, slot});
        }
      }
    }
  }
  for (const auto& [triangle, slot] : torn) {
    Among& these = among[triangle];
    std::erase(these.left_out, slot);
    if (!contains(these.own, slot)) these.own.push_back(slot);
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
      for (const Index other : across.of(h)) found.push_back(other / 3);
  sort_unique(found);
  return found;
}

// Sets the slots of the seeds that are not left out of a triangle and may own a part of it. One that is nearer to all
// three corners than another leaves that nothing.
void Localiser::Work::find_candidates(Index triangle, Scratch& scratch) const {
  const Among& these = *among.find(triangle);
  const auto& corners = surface.facets[surface.facet_of[triangle]].corners;
  std::vector<Index>& slots = scratch.slots;
  slots.clear();
  const auto append = [&](Index slot) {
    if (!contains(these.left_out, slot)) slots.push_back(slot);
  };
  std::for_each(these.own.begin(), these.own.end(), append);
  for (const Index region : these.regions)
    std::for_each(regions.around(region).begin(), regions.around(region).end(), append);
  sort_unique(slots);
  std::vector<std::array<double, 3>>& squares = scratch.squares;
  squares.clear();
  std::size_t near = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const Vec3& x = seeds.x[slots[k]];
    squares.push_back({norm2(x - corners[0]), norm2(x - corners[1]), norm2(x - corners[2])});
    const double farthest = std::max({squares[k][0], squares[k][1], squares[k][2]});
    if (farthest >= least) continue;
    least = farthest;
    near = k;
  }
  const auto nearer = [](double a, double b) { return a < b * (1 - kRounding); };
  std::size_t kept = 0;
  for (std::size_t k = 0; k < slots.size(); ++k)
    if (!std::equal(squares[near].begin(), squares[near].end(), squares[k].begin(), nearer)) slots[kept++] = slots[k];
  slots.resize(kept);
}

// Where a triangle is divided anew for the first time, only the cells that border on those left out can win of it, for
// on it they are convex: what the others have is kept, and they are candidates no more.
void Localiser::Work::keep_polygons(Index triangle, Scratch& scratch) const {
  if (clipped.find(triangle) || back.contains(triangle)) return;
  const std::vector<Index>& left_out = among.find(triangle)->left_out;
  const Row on = row(triangle);
  std::vector<Index>& beside = scratch.beside;  // cells
  beside.clear();
  for (std::size_t p = on.begin; p < on.end; ++p) {
    if (!contains(left_out, seeds.slot[raw->pairs[p].cell])) continue;
    for (std::size_t e = raw->offsets[p]; e < raw->offsets[p + 1]; ++e)
      if (!is_edge(raw->labels[e])) beside.push_back(raw->labels[e]);
  }
  sort_unique(beside);
  for (std::size_t p = on.begin; p < on.end; ++p) {
    const Index cell = raw->pairs[p].cell, slot = seeds.slot[cell];
    if (contains(left_out, slot) || std::binary_search(beside.begin(), beside.end(), cell)) continue;
    append_polygons(*raw, p, p + 1, scratch.found);
    scratch.kept.push_back(slot);
  }
}

// Appends the division of a triangle among the seeds that are not left out.
void Localiser::Work::clip(Index triangle, Clipper& clipper, RestrictedPolygons& out) {
  Scratch& scratch = scratches.local();
  find_candidates(triangle, scratch);
  RestrictedPolygons& found = scratch.found;
  found.pairs.clear();
  found.offsets.assign(1, 0);
  found.labels.clear();
  found.vertices.clear();
  scratch.kept.clear();
  keep_polygons(triangle, scratch);
  std::sort(scratch.kept.begin(), scratch.kept.end());
  const bool has_vertices = !raw->vertices.empty();
  clipper.begin(surface, surface.facet_of[triangle]);
  for (const Index slot : scratch.slots) {
    if (std::binary_search(scratch.kept.begin(), scratch.kept.end(), slot)) continue;
    if (clipper.clip(scratch.slots, slot)) append_polygon(clipper, seeds, triangle, slot, found);
    if (!has_vertices) found.vertices.clear();
  }
  std::vector<std::size_t>& order = scratch.order;
  order.resize(found.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return found.pairs[a].cell < found.pairs[b].cell; });
  for (const std::size_t p : order) append_polygons(found, p, p + 1, out);
}

// Keeps the lists of triangles of cells that lose or win one, and adds those and cells with another polygon to `cells`.
void Localiser::Work::change(Index triangle, const Row& before, const Row& after, std::vector<Index>& cells) {
  const auto list = [&](Index cell) -> Triangles& {
    if (taken.mark(cell)) cells.push_back(cell);
    if (!cell_triangles.find(cell)) {
      const std::span<const Index> now = triangles_of(cell);
      cell_triangles[cell].assign(now.begin(), now.end());
    }
    return cell_triangles[cell];
  };
  std::size_t p = before.begin, q = after.begin;
  while (p < before.end || q < after.end) {
    const Index old_cell = p < before.end ? before.polygons->pairs[p].cell : kNone;
    const Index new_cell = q < after.end ? after.polygons->pairs[q].cell : kNone;
    const Index cell = std::min(old_cell, new_cell);
    met.push_back(cell);
    if (old_cell != new_cell) {
      Triangles& of = list(cell);
      if (cell == old_cell) of.erase(std::lower_bound(of.begin(), of.end(), triangle));
      else of.insert(std::lower_bound(of.begin(), of.end(), triangle), triangle);
    } else if (!std::ranges::equal(before.labels_of(p), after.labels_of(q))) {
      list(cell);
    }
    p += old_cell == cell;
    q += new_cell == cell;
  }
}

// Returns the cells that lost or won, or have another polygon.
std::vector<Index> Localiser::Work::clip_anew(const Triangles& triangles) {
  std::vector<RestrictedPolygons> parts((triangles.size() + kTrianglesAtOnce - 1) / kTrianglesAtOnce);
  parallel_chunks(triangles.size(), kTrianglesAtOnce, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) clip(triangles[k], clipper(), parts[chunk]);
  });
  std::size_t at = anew.pairs.size();
  for (const RestrictedPolygons& part : parts) append_polygons(part, 0, part.pairs.size(), anew);
  std::vector<Index> cells;
  taken.begin(seeds.slot.size());
  for (const Index t : triangles) {
    const Row before = row(t);
    Row after{&anew, at, at};
    while (after.end < anew.pairs.size() && anew.pairs[after.end].triangle == t) ++after.end;
    change(t, before, after, cells);
    clipped[t] = {after.begin, after.end};
    at = after.end;
  }
  std::sort(cells.begin(), cells.end());
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
    const Row now = row(t);
    append_polygons(*raw, kept, first[t], all);
    append_polygons(*now.polygons, now.begin, now.end, all);
    kept = first[t + 1];
  }
  append_polygons(*raw, kept, raw->pairs.size(), all);
  if (raw->vertices.empty()) all.vertices.clear();
  return all;
}

// Sets the moments of these cells, which changed.
void Localiser::Work::sum_cells(std::span<const Index> cells, CellMoments& result) {
  Scratch& scratch = scratches.local();
  std::size_t count = 0;
  for (const Index cell : cells) count += triangles_of(cell).size();
  scratch.moments.resize(count);
  scratch.unknown.assign(count, 1);
  scratch.batches.begin(surface, seeds);
  const auto take_moments = [&](const PolygonBatches<std::size_t>::Batch& batch) {
    for (std::size_t lane = 0; lane < batch.filled; ++lane) {
      scratch.moments[batch.items[lane]] = batch.numbers.moments(lane);
      scratch.unknown[batch.items[lane]] = !(batch.numbers.fits[lane] > 0);
    }
  };
  std::size_t k = 0;
  for (const Index cell : cells)
    for (const Index t : triangles_of(cell)) {
      const Row on = row(t);
      const std::span<const Index> labels = slot_labels(on, on.find(cell));
      if (scratch.batches.takes(labels.size()))
        scratch.batches.add(surface.facet_of[t], seeds.slot[cell], labels, k, take_moments);
      ++k;
    }
  scratch.batches.finish(take_moments);
  FixedTreeSum sum;
  k = 0;
  for (const Index cell : cells) {
    for (const Index t : triangles_of(cell)) {
      if (scratch.unknown[k]) {
        Clipper& mine = clipper();
        const Row on = row(t);
        take(on, on.find(cell), mine);
        scratch.moments[k] = mine.integrate();
      }
      sum.add(scratch.moments[k++]);
    }
    result.cells[cell] = sum.finish();
  }
}

// Sets the moments of the cells that changed, and the triangles of all.
void Localiser::Work::sum(Diagram& diagram) {
  CellMoments& moments = diagram.moments;
  const std::vector<Index>& cells = cell_triangles.items;
  parallel_chunks(cells.size(), kCellsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    sum_cells({cells.data() + begin, cells.data() + end}, moments);
  });
  for (const Index cell : met) moments.step_mass[cell] = -1;
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
  Neighbours neighbours;
  const auto around_seeds = [&]() -> const Neighbours& {
    neighbours.build_on_demand(seeds, 0);
    return neighbours;
  };
  complete_step_masses(seeds, around_seeds, moments);
  set_totals(moments);
}

std::size_t Localiser::Work::find_all_strays(const std::vector<Vec3>& given, const Diagram& diagram) {
  raw = &diagram.polygons;
  raw_triangles = &diagram.moments.triangles;
  first = first_polygons(*raw, surface.mesh.triangles.size());
  seeds = sort_seeds(given);
  clippers.clear();
  anew = {};
  clipped.reset(surface.mesh.triangles.size());
  cell_triangles.reset(given.size());
  met.clear();
  strays.clear();
  among.reset(surface.mesh.triangles.size());
  regions.reset(seeds.x.size());
  back.clear();
  find_first_strays();
  return strays.size();
}

std::size_t Localiser::Work::localise(const std::vector<Vec3>& given, Diagram& diagram) {
  const std::size_t count = find_all_strays(given, diagram);
  if (count == 0) return 0;
  std::size_t divided = 0;
  for (;;) {
    const Triangles triangles = leave_out();
    divided += triangles.size();
    if (triangles.empty() || divided > kDivisions * surface.facets.size()) break;
    set_strays(clip_anew(triangles), [&](Index cell) { return find_strays(cell); });
  }
  // What else is torn then lies beside what is clipped anew.
  for (Triangles torn = put_back_torn(among.items); !torn.empty(); torn = put_back_torn(beside(torn))) clip_anew(torn);
  if (clipped.items.empty()) return 0;
  sum(diagram);
  diagram.polygons = splice();
  return count;
}

Localiser::Localiser(const Surface& surface) : work_(std::make_unique<Work>(surface)) {}
Localiser::~Localiser() = default;

std::size_t Localiser::localise(const std::vector<Vec3>& seeds, Diagram& diagram) {
  return work_->localise(seeds, diagram);
}

std::size_t Localiser::count_strays(const std::vector<Vec3>& seeds, const Diagram& diagram) {
  return work_->find_all_strays(seeds, diagram);
}

}  // namespace bisector
