#include "voronoi/dual.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/parallel.h"

namespace bisector {
namespace {

constexpr std::size_t kPairsAtOnce = 8192;  // of a parallel loop

struct Triple {
  Triangle ascending;
  Index mesh_triangle;
  bool flipped;  // the oriented triple is an odd permutation of `ascending`
  Index multiplicity = 1;
};

// What list(k, found) appends for all k below n, in the order of k.
template <class T, class List>
std::vector<T> collect(std::size_t n, const List& list) {
  std::vector<std::vector<T>> of_chunk((n + kPairsAtOnce - 1) / kPairsAtOnce);
  parallel_chunks(n, kPairsAtOnce, [&](std::size_t c, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) list(k, of_chunk[c]);
  });
  std::vector<T> all;
  for (const std::vector<T>& found : of_chunk) all.insert(all.end(), found.begin(), found.end());
  return all;
}

bool operator<(const Triple& a, const Triple& b) {
  return a.ascending != b.ascending ? a.ascending < b.ascending : a.mesh_triangle < b.mesh_triangle;
}

Dual dual_of(std::vector<Triple> triples) {
  sort_in_parallel(triples, [](const Triple& a, const Triple& b) { return a < b; });
  Dual dual;
  for (std::size_t k = 0; k < triples.size(); ++k) {
    const Triangle& t = triples[k].ascending;
    if (k && triples[k - 1].ascending == t) {
      dual.multiplicity.back() += triples[k].multiplicity;
      continue;
    }
    dual.triangles.push_back(triples[k].flipped ? Triangle{t[0], t[2], t[1]} : t);
    dual.multiplicity.push_back(triples[k].multiplicity);
    dual.mesh_triangle.push_back(triples[k].mesh_triangle);
  }
  return dual;
}

}  // namespace

Dual extract_dual(const RestrictedPolygons& polygons) {
  std::vector<Triple> triples = collect<Triple>(polygons.pairs.size(), [&](std::size_t k, std::vector<Triple>& found) {
    const auto [triangle, cell] = polygons.pairs[k];
    const std::size_t first = polygons.offsets[k], end = polygons.offsets[k + 1];
    Index b = polygons.labels[end - 1];
    for (std::size_t e = first; e < end; ++e) {
      const Index c = polygons.labels[e];
      // Each vertex is seen from its three cells; the lowest reports it. Walking around the cell, the neighbour before
      // the vertex precedes the one after it.
      if (!is_edge(b) && !is_edge(c) && b > cell && c > cell)
        found.push_back({{cell, std::min(b, c), std::max(b, c)}, triangle, b > c});
      b = c;
    }
  });
  return dual_of(std::move(triples));
}

Dual merge_duals(const std::vector<Dual>& parts) {
  std::vector<Triple> triples;
  for (const Dual& part : parts)
    for (std::size_t k = 0; k < part.triangles.size(); ++k) {
      // Those of a dual begin with the lowest.
      const auto [a, b, c] = part.triangles[k];
      triples.push_back({{a, std::min(b, c), std::max(b, c)}, part.mesh_triangle[k], b > c, part.multiplicity[k]});
    }
  return dual_of(std::move(triples));
}

std::vector<Index> dual_vertices(const Dual& dual, std::size_t seeds) {
  std::vector<Index> number(seeds, kNone);
  for (const Triangle& t : dual.triangles)
    for (Index v : t) number[v] = 0;
  Index count = 0;
  for (Index& n : number)
    if (n != kNone) n = count++;
  return number;
}

std::vector<DualEdge> extract_dual_edges(const RestrictedPolygons& polygons, const std::vector<Vec3>& seeds) {
  struct Piece {
    DualEdge edge;
    double squared;  // from the middle of the seeds
  };
  std::vector<Piece> pieces = collect<Piece>(polygons.pairs.size(), [&](std::size_t k, std::vector<Piece>& found) {
    const Index cell = polygons.pairs[k].cell;
    const std::size_t first = polygons.offsets[k], size = polygons.offsets[k + 1] - first;
    for (std::size_t e = 0; e < size; ++e) {
      const Index label = polygons.labels[first + e];
      if (is_edge(label) || label < cell) continue;
      const Vec3 &p = polygons.vertices[first + e], &q = polygons.vertices[first + (e + 1) % size];
      const Vec3 along = q - p, middle = 0.5 * (seeds[cell] + seeds[label]);
      const double length2 = norm2(along);
      if (length2 == 0) continue;
      const Vec3 nearest = p + std::clamp(dot(middle - p, along) / length2, 0.0, 1.0) * along;
      found.push_back({{cell, label, nearest}, norm2(nearest - middle)});
    }
  });
  sort_in_parallel(pieces, [](const Piece& x, const Piece& y) {
    const auto key = [](const Piece& p) {
      return std::tie(p.edge.a, p.edge.b, p.squared, p.edge.crossing.x, p.edge.crossing.y, p.edge.crossing.z);
    };
    return key(x) < key(y);
  });
  std::vector<DualEdge> edges;
  for (const Piece& p : pieces)
    if (edges.empty() || edges.back().a != p.edge.a || edges.back().b != p.edge.b) edges.push_back(p.edge);
  return edges;
}

void mark_neighbours(const std::vector<DualEdge>& edges, std::vector<char>& marked) {
  const std::vector<char> before = marked;
  for (const DualEdge& e : edges)
    if (before[e.a] || before[e.b]) marked[e.a] = marked[e.b] = 1;
}

}  // namespace bisector
