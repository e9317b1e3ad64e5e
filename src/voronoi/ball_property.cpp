#include "voronoi/ball_property.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <span>
#include <tuple>
#include <utility>

#include "core/grouping.h"
#include "core/parallel.h"
#include "mesh/topology.h"
#include "voronoi/collinear_strips.h"
#include "voronoi/polygons.h"

namespace bisector {
namespace {

constexpr std::size_t kChunk = 64;  // cells
constexpr std::size_t kItemsAtOnce = 16384;

// Disjoint sets over indices of a shared array; a root is the lowest of its set.
Index root_of(std::vector<Index>& parent, Index i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void join(std::vector<Index>& parent, Index i, Index j) {
  i = root_of(parent, i);
  j = root_of(parent, j);
  parent[std::max(i, j)] = std::min(i, j);
}

std::vector<Index> singletons(std::size_t n) {
  std::vector<Index> parent(n);
  parallel_chunks(n, kItemsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) parent[i] = static_cast<Index>(i);
  });
  return parent;
}

// One more than the highest cell.
std::size_t count_cells(const RestrictedPolygons& polygons) {
  std::atomic<std::size_t> cells{0};
  parallel_chunks(polygons.pairs.size(), kItemsAtOnce, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::size_t highest = 0;
    for (std::size_t p = begin; p < end; ++p) highest = std::max<std::size_t>(highest, polygons.pairs[p].cell + 1);
    std::size_t known = cells;
    while (known < highest && !cells.compare_exchange_weak(known, highest)) {
    }
  });
  return cells;
}

// The polygons of each cell, ascending.
Csr<Index> polygons_of_cells(const RestrictedPolygons& polygons) {
  Csr<Index> of_cell = scatter_into_rows<Index>(
      count_cells(polygons), polygons.pairs.size(), [&](std::size_t p) { return polygons.pairs[p].cell; },
      [](std::size_t p) { return static_cast<Index>(p); });
  parallel_each(of_cell.rows(), [&](std::size_t cell) {
    std::sort(of_cell.values.begin() + static_cast<std::ptrdiff_t>(of_cell.offsets[cell]),
              of_cell.values.begin() + static_cast<std::ptrdiff_t>(of_cell.offsets[cell + 1]));
  });
  return of_cell;
}

// The diagram as a cell complex. Sets and first visits are kept in arrays over the whole diagram, but what one cell's
// examination touches belongs to that cell alone.
class Complex {
 public:
  Complex(const Surface& surface, const RestrictedPolygons& polygons)
      : triangles_(surface.mesh.triangles), diagram_(polygons), begin_(first_polygons(polygons, triangles_.size())),
        twin_(3 * triangles_.size(), kBorder) {
    polygon_at_.assign(surface.mesh.vertices.size(), kNone);
    piece_at_.assign(surface.mesh.vertices.size(), kNone);
    link_triangles();
    parts_ = singletons(polygons.pairs.size());
    lines_ = singletons(polygons.labels.size());
    of_cell_ = polygons_of_cells(diagram_);
  }

  BallReport check() {
    std::vector<BallReport> reports((of_cell_.rows() + kChunk - 1) / kChunk);
    parallel_chunks(of_cell_.rows(), kChunk, [&](std::size_t c, std::size_t begin, std::size_t end) {
      Scratch scratch;
      for (std::size_t i = begin; i < end; ++i)
        if (of_cell_.size(i)) check_cell(static_cast<Index>(i), scratch, reports[c]);
    });
    BallReport all;
    for (BallReport& r : reports) {
      all.cells_checked += r.cells_checked;
      all.edges_checked += r.edges_checked;
      all.vertices_checked += r.vertices_checked;
      all.euler += r.euler;
      std::move(r.cells.begin(), r.cells.end(), std::back_inserter(all.cells));
      std::move(r.edges.begin(), r.edges.end(), std::back_inserter(all.edges));
      std::move(r.vertices.begin(), r.vertices.end(), std::back_inserter(all.vertices));
    }
    all.manifold = several_.empty();
    forgive_singular_vertices(all);
    return all;
  }

 private:
  static constexpr Index kBorder = kNone, kSeveral = kNone - 1;

  void make_twins(std::size_t g, std::size_t h) {
    twin_[g] = static_cast<Index>(h);
    twin_[h] = static_cast<Index>(g);
  }

  void link_triangles() {
    std::mutex mutex;
    each_edge(edge_sides(triangles_, polygon_at_.size()), [&](std::span<const EdgeSide> sides) {
      if (sides.size() > 2) return link_several(sides, mutex);
      if (sides.size() < 2) return;
      const Index g = sides[0].half_edge, h = sides[1].half_edge;
      if (is_read(g / 3) && is_read(h / 3)) make_twins(g, h);
    });
  }

  // An edge of more than two triangles, some of which may have no polygons.
  void link_several(std::span<const EdgeSide> sides, std::mutex& mutex) {
    std::vector<std::size_t> around;
    for (const EdgeSide& side : sides)
      if (is_read(side.half_edge / 3)) around.push_back(side.half_edge);
    if (around.size() == 2) make_twins(around[0], around[1]);
    if (around.size() <= 2) return;
    const std::lock_guard lock(mutex);
    for (const std::size_t h : around) {
      twin_[h] = kSeveral;
      several_[h] = around;
    }
  }

  enum class Kind : unsigned char { piece, crossing, end, branching };
  // What lies on the boundary towards the cell `other`: an entry, or its crossing of a mesh edge of two, one or more
  // triangles.
  struct Contact {
    Index other;
    Kind kind;
    Index entry;
    int corners;  // of a piece: its ends in a third cell
    friend bool operator<(const Contact& a, const Contact& b) {
      return std::tie(a.other, a.kind, a.entry) < std::tie(b.other, b.kind, b.entry);
    }
  };
  struct Meeting {
    Index low, high, entry;  // the two other cells
    friend bool operator<(const Meeting& a, const Meeting& b) {
      return std::tie(a.low, a.high, a.entry) < std::tie(b.low, b.high, b.entry);
    }
  };
  struct Scratch {
    std::vector<Contact> contacts;
    std::vector<Meeting> meetings;
    std::vector<Index> border;  // entries on the surface's border
    std::vector<std::array<Index, 2>>
        closures;  // consecutive entries of the boundary that are joined for its loops only

    void clear() {
      contacts.clear();
      meetings.clear();
      border.clear();
      closures.clear();
    }
  };

  bool is_read(std::size_t triangle) const { return begin_[triangle] < begin_[triangle + 1]; }

  Index polygon_of(std::size_t triangle, Index cell) const {
    const auto from = diagram_.pairs.begin() + static_cast<std::ptrdiff_t>(begin_[triangle]);
    const auto to = diagram_.pairs.begin() + static_cast<std::ptrdiff_t>(begin_[triangle + 1]);
    const auto at = std::lower_bound(from, to, cell, [](const auto& pair, Index c) { return pair.cell < c; });
    return at == to || at->cell != cell ? kNone : static_cast<Index>(at - diagram_.pairs.begin());
  }

  // The entry before or after another in its polygon.
  std::size_t step(std::size_t p, std::size_t entry, bool forward) const {
    const std::size_t first = diagram_.offsets[p], last = diagram_.offsets[p + 1] - 1;
    if (forward) return entry == last ? first : entry + 1;
    return entry == first ? last : entry - 1;
  }

  // Glues polygon q to p along the mesh edge of half-edge h in p and h2 in q. The bisectors that end there go on.
  void glue(Index p, std::size_t entry, Index q, std::size_t h2) {
    join(parts_, p, q);
    const Index label = kEdgeLabel | static_cast<Index>(h2 % 3);
    for (std::size_t e = diagram_.offsets[q]; e < diagram_.offsets[q + 1]; ++e) {
      if (diagram_.labels[e] != label) continue;
      for (bool forward : {false, true}) {
        const std::size_t side = step(p, entry, forward);
        const Index other = diagram_.labels[side];
        if (is_edge(other)) continue;
        for (bool there : {false, true})
          if (diagram_.labels[step(q, e, there)] == other)
            join(lines_, static_cast<Index>(side), static_cast<Index>(step(q, e, there)));
      }
    }
  }

  // What is counted of one cell while its polygons are read.
  struct CellCounts {
    long long vertices = 0, edges = 0, border_vertices = 0;
    bool plain = true;  // meets no mesh edge of more than two triangles
  };

  void check_cell(Index cell, Scratch& s, BallReport& report) {
    s.clear();
    CellCounts counts;
    for (const Index* p = of_cell_.begin(cell); p != of_cell_.end(cell); ++p)
      for (std::size_t e = diagram_.offsets[*p]; e < diagram_.offsets[*p + 1]; ++e) {
        if (is_edge(diagram_.labels[e])) read_mesh_edge(cell, *p, e, s, counts);
        else read_bisector(*p, e, s, counts);
      }
    check_edges(cell, s, report);
    check_vertices(cell, s, report);
    conclude_cell(cell, counts, s, report);
  }

  // A side of polygon p towards another cell, and the vertex where it starts.
  void read_bisector(Index p, std::size_t e, Scratch& s, CellCounts& counts) const {
    const Index entry = static_cast<Index>(e), label = diagram_.labels[e];
    const std::size_t previous = step(p, e, false);
    const Index before = diagram_.labels[previous];
    ++counts.edges;
    const bool ends = !is_edge(diagram_.labels[step(p, e, true)]);
    s.contacts.push_back({label, Kind::piece, entry, (ends ? 1 : 0) + (is_edge(before) ? 0 : 1)});
    if (is_edge(before)) return;
    ++counts.vertices;
    s.meetings.push_back({std::min(label, before), std::max(label, before), entry});
    s.closures.push_back({static_cast<Index>(previous), entry});
  }

  // A side of polygon p on a mesh edge, and the mesh vertex where it starts if it starts in one.
  void read_mesh_edge(Index cell, Index p, std::size_t e, Scratch& s, CellCounts& counts) {
    const Index triangle = diagram_.pairs[p].triangle, k = diagram_.labels[e] & ~kEdgeLabel;
    if (is_edge(diagram_.labels[step(p, e, false)])) read_mesh_vertex(triangles_[triangle][k], p, counts);
    // The lowest half-edge counts for all on the mesh edge.
    const std::size_t h = 3 * static_cast<std::size_t>(triangle) + k;
    const Index twin = twin_[h];
    const bool on_border = twin == kBorder, branches = twin == kSeveral;
    if (branches ? several_.at(h).front() != h : twin < h) return;
    ++counts.edges;
    counts.plain = counts.plain && !branches;
    if (on_border) s.border.push_back(static_cast<Index>(e));
    for (const bool forward : {false, true}) read_end(p, e, forward, twin, s, counts);
    if (branches) {
      for (const std::size_t other : several_.at(h))
        if (other != h) glue_across(cell, p, e, other);
    } else if (!on_border) {
      glue_across(cell, p, e, twin);
    }
  }

  void read_mesh_vertex(Index vertex, Index p, CellCounts& counts) {
    if (polygon_at_[vertex] == kNone) {
      polygon_at_[vertex] = p;
      ++counts.vertices;
    } else {
      join(parts_, polygon_at_[vertex], p);
    }
  }

  // An end of the side e of polygon p on a mesh edge: another cell's bisector crosses the mesh edge there, or a piece
  // of the border meets the next in a mesh vertex.
  void read_end(Index p, std::size_t e, bool forward, Index twin, Scratch& s, CellCounts& counts) {
    const Index entry = static_cast<Index>(e);
    const bool on_border = twin == kBorder;
    const std::size_t side = step(p, e, forward);
    const Index other = diagram_.labels[side];
    if (!is_edge(other)) {
      ++counts.vertices;
      s.contacts.push_back({other,
                            on_border          ? Kind::end
                            : twin == kSeveral ? Kind::branching
                                               : Kind::crossing,
                            entry, 0});
      if (!on_border) return;
      ++counts.border_vertices;
      s.closures.push_back({entry, static_cast<Index>(side)});
    } else if (on_border) {
      const Index k = diagram_.labels[e] & ~kEdgeLabel;
      Index& piece = piece_at_[triangles_[diagram_.pairs[p].triangle][forward ? (k + 1) % 3 : k]];
      if (piece == kNone) {
        piece = entry;
        ++counts.border_vertices;
      } else {
        join(lines_, piece, entry);
      }
    }
  }

  void glue_across(Index cell, Index p, std::size_t e, std::size_t half_edge) {
    const Index q = polygon_of(half_edge / 3, cell);
    if (q != kNone) glue(p, e, q, half_edge);
  }

  void conclude_cell(Index cell, const CellCounts& counts, const Scratch& s, BallReport& report) {
    const Index *begin = of_cell_.begin(cell), *end = of_cell_.end(cell);
    BallReport::Cell found{
        cell, counts.vertices - counts.edges + static_cast<long long>(of_cell_.size(cell)), 0, 0, 0, 0, {}, {}};
    found.components = count_roots(parts_, begin, end);
    found.border_parts = count_roots(lines_, s.border.data(), s.border.data() + s.border.size());
    found.border_euler = counts.border_vertices - static_cast<long long>(s.border.size());
    for (const auto& [a, b] : s.closures) join(lines_, a, b);
    std::vector<Index> boundary = s.border;
    for (const Contact& c : s.contacts)
      if (c.kind == Kind::piece) boundary.push_back(c.entry);
    found.loops = count_roots(lines_, boundary.data(), boundary.data() + boundary.size());
    ++report.cells_checked;
    report.euler += found.euler;
    const bool connected = found.components == 1 && found.euler == 1;
    const bool border = found.border_parts == 0 || (found.border_parts == 1 && found.border_euler == 1);
    if (connected && (!counts.plain || (found.loops == 1 && border))) return;
    found.parts = groups(parts_, begin, end);
    found.loop_parts = groups(lines_, boundary.data(), boundary.data() + boundary.size());
    report.cells.push_back(std::move(found));
  }

  void check_edges(Index cell, Scratch& s, BallReport& report) {
    std::sort(s.contacts.begin(), s.contacts.end());
    std::vector<Index> pieces;
    for (std::size_t k = 0, end = 0; k < s.contacts.size(); k = end) {
      const Index other = s.contacts[k].other;
      for (end = k; end < s.contacts.size() && s.contacts[end].other == other;) ++end;
      if (other < cell) continue;
      BallReport::Edge edge{cell, other, 0, 0, 0, 0, {}};
      bool plain = true;
      pieces.clear();
      for (std::size_t c = k; c < end; ++c) {
        const auto [label, kind, entry, corners] = s.contacts[c];
        if (kind == Kind::piece) {
          pieces.push_back(entry);
          edge.euler += corners - 1;
          edge.ends += static_cast<std::size_t>(corners);
          continue;
        }
        ++edge.euler;
        plain = plain && kind != Kind::branching;
        if (kind == Kind::end) {
          ++edge.ends;
          ++edge.border_points;
        }
      }
      edge.components = count_roots(lines_, pieces.data(), pieces.data() + pieces.size());
      ++report.edges_checked;
      report.euler -= edge.euler;
      if (edge.components == 1 && edge.euler == 1 && (!plain || (edge.ends == 2 && edge.border_points <= 1))) continue;
      edge.parts = groups(lines_, pieces.data(), pieces.data() + pieces.size());
      report.edges.push_back(std::move(edge));
    }
  }

  void check_vertices(Index cell, Scratch& s, BallReport& report) const {
    std::sort(s.meetings.begin(), s.meetings.end());
    for (std::size_t k = 0, end = 0; k < s.meetings.size(); k = end) {
      const auto [low, high, entry] = s.meetings[k];
      for (end = k; end < s.meetings.size() && s.meetings[end].low == low && s.meetings[end].high == high;) ++end;
      if (low < cell) continue;
      ++report.vertices_checked;
      report.euler += static_cast<long long>(end - k);
      if (end - k == 1) continue;
      report.vertices.push_back({{cell, low, high}, {}});
      for (std::size_t m = k; m < end; ++m) report.vertices.back().places.push_back(s.meetings[m].entry);
    }
  }

  static std::size_t count_roots(const std::vector<Index>& parent, const Index* begin, const Index* end) {
    return static_cast<std::size_t>(std::count_if(begin, end, [&](Index i) { return parent[i] == i; }));
  }

  // The sets among the items, by their roots.
  static BallReport::Groups groups(std::vector<Index>& parent, const Index* begin, const Index* end) {
    std::map<Index, std::vector<std::size_t>> sets;
    for (const Index* i = begin; i != end; ++i) sets[root_of(parent, *i)].push_back(*i);
    BallReport::Groups result;
    for (auto& [root, items] : sets) result.push_back(std::move(items));
    return result;
  }

  // Disks that touch in a mesh vertex are contractible, but have a loop each.
  void forgive_singular_vertices(BallReport& report) const {
    const auto suspect = [](const BallReport::Cell& c) { return c.components == 1 && c.euler == 1 && c.loops != 1; };
    if (std::none_of(report.cells.begin(), report.cells.end(), suspect)) return;
    const std::vector<char> singular = split_vertices(triangles_, polygon_at_.size());
    std::vector<char> touched(of_cell_.rows(), 0);
    for (std::size_t v = 0; v < singular.size(); ++v)
      if (singular[v] && polygon_at_[v] != kNone) touched[diagram_.pairs[polygon_at_[v]].cell] = 1;
    std::erase_if(report.cells, [&](const BallReport::Cell& c) { return suspect(c) && touched[c.seed]; });
  }

  const std::vector<Triangle>& triangles_;
  const RestrictedPolygons& diagram_;
  std::vector<std::size_t> begin_;  // first polygon of each triangle
  std::vector<Index> twin_;         // of each half-edge of a triangle with polygons
  std::map<std::size_t, std::vector<std::size_t>>
      several_;                    // all half-edges on the same mesh edge, where more than two
  Csr<Index> of_cell_;             // polygons of each cell
  std::vector<Index> polygon_at_;  // of each mesh vertex
  std::vector<Index> piece_at_;    // of each mesh vertex: a piece of the border
  std::vector<Index> parts_;       // sets of polygons
  std::vector<Index> lines_;       // sets of entries
};

// Back from polygons and entries of the diagram with strips to those of the diagram given.
void restore_indices(const RestrictedPolygons& merged, const std::vector<Index>& source,
                     const RestrictedPolygons& given, BallReport& report) {
  const auto restore = [&](std::vector<std::size_t>& items, bool entries) {
    std::size_t n = 0;
    for (const std::size_t item : items) {
      std::size_t polygon = item;
      if (entries) {
        const auto after = std::upper_bound(merged.offsets.begin(), merged.offsets.end(), item);
        polygon = static_cast<std::size_t>(after - merged.offsets.begin()) - 1;
      }
      if (source[polygon] == kNone) continue;
      items[n++] = entries ? item - merged.offsets[polygon] + given.offsets[source[polygon]] : source[polygon];
    }
    items.resize(n);
  };
  for (BallReport::Cell& c : report.cells) {
    for (auto& items : c.parts) restore(items, false);
    for (auto& items : c.loop_parts) restore(items, true);
  }
  for (BallReport::Edge& e : report.edges)
    for (auto& items : e.parts) restore(items, true);
  for (BallReport::Vertex& v : report.vertices) restore(v.places, true);
}

}  // namespace

BallReport check_ball_property(const Surface& surface, const RestrictedPolygons& polygons) {
  const CollinearStrips strips(surface, polygons);
  BallReport report;
  if (strips.empty()) {
    report = Complex(surface, polygons).check();
  } else {
    std::vector<Index> source;
    const RestrictedPolygons merged = strips.merged(source);
    report = Complex(surface, merged).check();
    restore_indices(merged, source, polygons, report);
  }
  report.unread = strips.unread();
  report.holds = report.failures() == 0;
  return report;
}

}  // namespace bisector
