#include "voronoi/localise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "voronoi/ball_property.h"
#include "voronoi/polygons.h"

namespace bisector {
namespace {

constexpr int kRounds = 4;  // pieces that lie among other pieces wait for these

// A piece of a cell apart from its seed.
struct Piece {
  std::vector<std::size_t> polygons;
  double area = 0;
  std::vector<Index> choices;  // cells that it could go to, the best last
  Index to() const { return choices.empty() ? kNone : choices.back(); }
};

// A polygon while its triangle is put together anew.
struct Polygon {
  Index cell;
  std::vector<Index> labels;
  std::vector<Vec3> vertices;
};

class Localiser {
 public:
  Localiser(const Surface& surface, const std::vector<Vec3>& seeds, RestrictedPolygons& polygons)
      : surface_(surface), seeds_(seeds), polygons_(polygons) {}

  struct Moves {
    std::size_t moved = 0, left = 0;  // pieces
  };
  Moves run() {
    const BallReport report = check_ball_property(surface_, polygons_);
    find_pieces(report);
    if (pieces_.empty()) return {};
    measure();
    for (std::size_t k = 0; k < pieces_.size(); ++k) choose(k);
    while (cancel_impossible()) {
    }
    Moves moves;
    for (const Piece& piece : pieces_) ++(piece.to() == kNone ? moves.left : moves.moved);
    if (moves.moved > 0) rebuild();
    return moves;
  }

 private:
  static constexpr std::size_t kOwn = static_cast<std::size_t>(-1);

  void find_pieces(const BallReport& report) {
    piece_.assign(polygons_.pairs.size(), kOwn);
    for (const BallReport::Cell& cell : report.cells) {
      if (cell.parts.size() < 2) continue;
      std::size_t own = 0;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < cell.parts.size(); ++k)
        for (const std::size_t p : cell.parts[k])
          if (const double d = norm2(nearest_on_polygon(polygons_, p, seeds_[cell.seed]) - seeds_[cell.seed]);
              d < least) {
            least = d;
            own = k;
          }
      for (std::size_t k = 0; k < cell.parts.size(); ++k) {
        if (k == own || cell.parts[k].empty()) continue;
        for (const std::size_t p : cell.parts[k]) piece_[p] = pieces_.size();
        pieces_.push_back({cell.parts[k], 0, {}});
      }
    }
  }

  void measure() {
    own_area_.assign(seeds_.size(), 0);
    for (std::size_t p = 0; p < polygons_.pairs.size(); ++p)
      (piece_[p] == kOwn ? own_area_[polygons_.pairs[p].cell] : pieces_[piece_[p]].area) += polygon_area(polygons_, p);
  }

  // The polygon of a cell on the triangle of another polygon.
  std::size_t beside(std::size_t polygon, Index cell) const {
    const auto& pairs = polygons_.pairs;
    const Index triangle = pairs[polygon].triangle;
    for (std::size_t p = polygon; p-- > 0 && pairs[p].triangle == triangle;)
      if (pairs[p].cell == cell) return p;
    for (std::size_t p = polygon + 1; p < pairs.size() && pairs[p].triangle == triangle; ++p)
      if (pairs[p].cell == cell) return p;
    return kOwn;
  }

  bool has_label(std::size_t polygon, Index label) const {
    const auto begin = polygons_.labels.begin() + static_cast<std::ptrdiff_t>(polygons_.offsets[polygon]);
    const auto end = polygons_.labels.begin() + static_cast<std::ptrdiff_t>(polygons_.offsets[polygon + 1]);
    return std::find(begin, end, label) != end;
  }

  void choose(std::size_t index) {
    Piece& piece = pieces_[index];
    std::map<Index, double> border;
    for (const std::size_t p : piece.polygons) {
      const std::size_t first = polygons_.offsets[p], size = polygons_.offsets[p + 1] - first;
      for (std::size_t e = 0; e < size; ++e) {
        const Index label = polygons_.labels[first + e];
        if (is_edge(label)) continue;
        const std::size_t other = beside(p, label);
        if (other == kOwn || piece_[other] != kOwn) continue;
        border[label] += norm(polygons_.vertices[first + (e + 1) % size] - polygons_.vertices[first + e]);
      }
    }
    std::vector<std::pair<double, Index>> order;
    for (const auto& [cell, length] : border) {
      const bool apart = std::any_of(piece.polygons.begin(), piece.polygons.end(),
                                     [&, c = cell](std::size_t p) { return beside(p, c) != kOwn && !has_label(p, c); });
      if (!apart && piece.area <= own_area_[cell]) order.push_back({length, cell});
    }
    std::sort(order.begin(), order.end());
    for (const auto& [length, cell] : order) piece.choices.push_back(cell);
  }

  Index new_cell(std::size_t polygon) const {
    const std::size_t k = piece_[polygon];
    return k == kOwn || pieces_[k].to() == kNone ? polygons_.pairs[polygon].cell : pieces_[k].to();
  }

  std::size_t end_of_triangle(std::size_t begin) const {
    std::size_t end = begin;
    while (end < polygons_.pairs.size() && polygons_.pairs[end].triangle == polygons_.pairs[begin].triangle) ++end;
    return end;
  }

  // Makes one polygon of two that share an edge, each having its own cell as the label there.
  static bool join(Polygon& a, const Polygon& b) {
    const auto own = [](const Polygon& p) {
      return static_cast<std::size_t>(std::find(p.labels.begin(), p.labels.end(), p.cell) - p.labels.begin());
    };
    const std::size_t e = own(a), f = own(b);
    if (e == a.labels.size() || f == b.labels.size()) return false;
    Polygon joined{a.cell, {}, {}};
    for (const auto& [polygon, shared] : {std::pair<const Polygon*, std::size_t>{&a, e}, {&b, f}})
      for (std::size_t k = 1; k < polygon->labels.size(); ++k) {
        const std::size_t at = (shared + k) % polygon->labels.size();
        joined.labels.push_back(polygon->labels[at]);
        joined.vertices.push_back(polygon->vertices[at]);
      }
    a = std::move(joined);
    return true;
  }

  // Leaves out corners between edges of the same label.
  static void simplify(Polygon& polygon) {
    Polygon left{polygon.cell, {}, {}};
    const std::size_t size = polygon.labels.size();
    for (std::size_t k = 0; k < size; ++k) {
      if (polygon.labels[k] == polygon.labels[(k + size - 1) % size]) continue;
      left.labels.push_back(polygon.labels[k]);
      left.vertices.push_back(polygon.vertices[k]);
    }
    if (!left.labels.empty()) polygon = std::move(left);
  }

  // Two cells share one edge on a triangle at most, or corners could not be told apart by their labels.
  static void add_repeated(const Polygon& polygon, std::vector<Index>& spoilt) {
    std::vector<Index> labels = polygon.labels;
    labels.push_back(polygon.cell);
    std::sort(labels.begin(), labels.end());
    for (std::size_t k = 1; k < labels.size(); ++k)
      if (labels[k] == labels[k - 1]) spoilt.insert(spoilt.end(), {polygon.cell, labels[k]});
  }

  struct Changed {
    std::vector<Polygon> polygons;  // by ascending cell
    std::vector<Index> spoilt;      // cells that are in several polygons, or share several edges with another
  };
  // A triangle after its pieces have changed hands.
  Changed changed(std::size_t begin, std::size_t end) const {
    std::map<Index, Index> renamed;
    for (std::size_t p = begin; p < end; ++p) renamed[polygons_.pairs[p].cell] = new_cell(p);
    Changed result;
    std::vector<Polygon>& left = result.polygons;
    for (std::size_t p = begin; p < end; ++p) {
      Polygon polygon{new_cell(p), {}, {}};
      for (std::size_t e = polygons_.offsets[p]; e < polygons_.offsets[p + 1]; ++e) {
        const Index label = polygons_.labels[e];
        const auto other = is_edge(label) ? renamed.end() : renamed.find(label);
        polygon.labels.push_back(other == renamed.end() ? label : other->second);
        polygon.vertices.push_back(polygons_.vertices[e]);
      }
      simplify(polygon);
      left.push_back(std::move(polygon));
    }
    for (bool joined = true; joined;) {
      joined = false;
      for (std::size_t a = 0; a < left.size() && !joined; ++a)
        for (std::size_t b = a + 1; b < left.size() && !joined; ++b) {
          if (left[a].cell != left[b].cell || !join(left[a], left[b])) continue;
          simplify(left[a]);
          left.erase(left.begin() + static_cast<std::ptrdiff_t>(b));
          joined = true;
        }
    }
    std::sort(left.begin(), left.end(), [](const Polygon& a, const Polygon& b) { return a.cell < b.cell; });
    for (std::size_t k = 0; k < left.size(); ++k) {
      if (k > 0 && left[k].cell == left[k - 1].cell) result.spoilt.push_back(left[k].cell);
      add_repeated(left[k], result.spoilt);
    }
    return result;
  }

  bool is_touched(std::size_t begin, std::size_t end) const {
    for (std::size_t p = begin; p < end; ++p)
      if (new_cell(p) != polygons_.pairs[p].cell) return true;
    return false;
  }

  // Where a piece would not make one polygon with its new cell's on some triangle, it goes to the next best cell.
  bool cancel_impossible() {
    bool any = false;
    for (std::size_t begin = 0, end = 0; begin < polygons_.pairs.size(); begin = end) {
      end = end_of_triangle(begin);
      if (!is_touched(begin, end)) continue;
      const std::vector<Index> spoilt = changed(begin, end).spoilt;
      if (spoilt.empty()) continue;
      any = true;
      if (!pass_on(begin, end,
                   [&](Index cell) { return std::find(spoilt.begin(), spoilt.end(), cell) != spoilt.end(); }))
        pass_on(begin, end, [](Index) { return true; });
    }
    return any;
  }

  // Has the pieces of a triangle that go to some cells go elsewhere; false if there are none.
  template <class Some>
  bool pass_on(std::size_t begin, std::size_t end, const Some& some) {
    bool any = false;
    for (std::size_t p = begin; p < end; ++p) {
      if (piece_[p] == kOwn || pieces_[piece_[p]].choices.empty() || !some(pieces_[piece_[p]].to())) continue;
      pieces_[piece_[p]].choices.pop_back();
      any = true;
    }
    return any;
  }

  void rebuild() {
    RestrictedPolygons built;
    built.offsets = {0};
    const auto close = [&](Index triangle, Index cell) {
      built.pairs.push_back({triangle, cell});
      built.offsets.push_back(built.labels.size());
    };
    for (std::size_t begin = 0, end = 0; begin < polygons_.pairs.size(); begin = end) {
      end = end_of_triangle(begin);
      if (is_touched(begin, end)) {
        const std::vector<Polygon> anew = changed(begin, end).polygons;
        for (const Polygon& polygon : anew) {
          built.labels.insert(built.labels.end(), polygon.labels.begin(), polygon.labels.end());
          built.vertices.insert(built.vertices.end(), polygon.vertices.begin(), polygon.vertices.end());
          close(polygons_.pairs[begin].triangle, polygon.cell);
        }
        continue;
      }
      for (std::size_t p = begin; p < end; ++p) {
        const auto first = static_cast<std::ptrdiff_t>(polygons_.offsets[p]);
        const auto last = static_cast<std::ptrdiff_t>(polygons_.offsets[p + 1]);
        built.labels.insert(built.labels.end(), polygons_.labels.begin() + first, polygons_.labels.begin() + last);
        built.vertices.insert(built.vertices.end(), polygons_.vertices.begin() + first,
                              polygons_.vertices.begin() + last);
        close(polygons_.pairs[p].triangle, polygons_.pairs[p].cell);
      }
    }
    polygons_ = std::move(built);
  }

  const Surface& surface_;
  const std::vector<Vec3>& seeds_;
  RestrictedPolygons& polygons_;
  std::vector<Piece> pieces_;
  std::vector<std::size_t> piece_;  // of each polygon; kOwn if it is part of the cell around the seed
  std::vector<double> own_area_;    // of each cell
};

}  // namespace

std::size_t localise_cells(const Surface& surface, const std::vector<Vec3>& seeds, RestrictedPolygons& polygons) {
  std::size_t all = 0;
  for (int round = 0; round < kRounds; ++round) {
    const Localiser::Moves moves = Localiser(surface, seeds, polygons).run();
    all += moves.moved;
    if (moves.moved == 0 || moves.left == 0) break;
  }
  return all;
}

}  // namespace bisector
