#include "tetmesh/tet_swap.h"

#include <algorithm>
#include <limits>

#include "mesh/tet_adjacency.h"
#include "tetmesh/tet_shape.h"

namespace bisector {
namespace {

constexpr std::size_t kRing = 10;  // tetrahedra around an edge that is removed, at most
constexpr int kDepth = 3;  // steps from the first facet that is removed to the last one removed with it, at most
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double shape(const TetEdit& mesh, Index a, Index b, Index c, Index d) {
  return dihedral_shape(mesh.point(a), mesh.point(b), mesh.point(c), mesh.point(d));
}

int corner_of(const Tetrahedron& corners, Index v) {
  return static_cast<int>(std::find(corners.begin(), corners.end(), v) - corners.begin());
}

// The tetrahedra of a and b with the triangulation of ring vertices i to j that the table of third corners describes.
void collect(const std::vector<Index>& ring, const int middle[kRing][kRing], int i, int j, Index a, Index b,
             std::vector<Tetrahedron>& fresh) {
  if (j == i + 1) return;
  const int k = middle[i][j];
  fresh.push_back({a, ring[i], ring[k], ring[j]});
  fresh.push_back({ring[i], ring[k], ring[j], b});
  collect(ring, middle, i, k, a, b, fresh);
  collect(ring, middle, k, j, a, b, fresh);
}

// Klincsek's dynamic programming: value[i][j] is the best least shape of the tetrahedra over a triangulation of ring
// vertices i to j, and middle[i][j] the third corner of its triangle at the edge from i to j.
bool remove_edge(const TetEdit& mesh, Index t, int corner_a, int corner_b, TetSwap& best) {
  static thread_local std::vector<Index> tets, ring;
  const Index a = mesh.tet(t).corners[corner_a], b = mesh.tet(t).corners[corner_b];
  if (mesh.kept_edge(a, b) || !mesh.ring(t, corner_a, corner_b, kRing, tets, ring)) return false;
  const int n = static_cast<int>(ring.size());
  if (n < 3) return false;
  double value[kRing][kRing];
  int middle[kRing][kRing];
  for (int i = n - 2; i >= 0; --i) {
    value[i][i + 1] = kInfinity;
    for (int j = i + 2; j < n; ++j) {
      value[i][j] = 0;
      for (int k = i + 1; k < j; ++k) {
        double q = std::min(value[i][k], value[k][j]);
        if (q <= std::max(best.shape, value[i][j])) continue;
        q = std::min(q, shape(mesh, a, ring[i], ring[k], ring[j]));
        if (q <= std::max(best.shape, value[i][j])) continue;
        q = std::min(q, shape(mesh, ring[i], ring[k], ring[j], b));
        if (q <= std::max(best.shape, value[i][j])) continue;
        value[i][j] = q;
        middle[i][j] = k;
      }
    }
  }
  if (!(value[0][n - 1] > best.shape)) return false;
  best.shape = value[0][n - 1];
  best.old = tets;
  best.fresh.clear();
  collect(ring, middle, 0, n - 1, a, b, best.fresh);
  return true;
}

// The facets sandwiched between a and b that the edge between the two is to pass through (Shewchuk 2002), found
// outwards from the first one.
struct Sandwich {
  const TetEdit& mesh;
  Index a, b;
  double beat;  // shape that everything new must exceed

  struct Part {
    std::vector<Index> old;                   // tetrahedra on either side of the facets
    std::vector<std::array<Index, 2>> edges;  // around the facets, in turn; each gives a tetrahedron with a and b
    double shape = kInfinity;
  };

  // The best part beyond the edge from u to v, where `below` has the corners (a, u, v) and `above` (b, u, v).
  Part beyond(Index below, Index above, Index u, Index v, int depth) const {
    Part stop{{}, {{u, v}}, shape(mesh, a, b, u, v)};
    if (depth == 0) return stop;
    const auto across = [&](Index t) {  // the facet with u, v and a or b
      const Tetrahedron& corners = mesh.tet(t).corners;
      for (int k = 0; k < 4; ++k)
        if (corners[k] != u && corners[k] != v && corners[k] != a && corners[k] != b)
          return mesh.kept(t, k) ? kNone : mesh.tet(t).across[k];
      return kNone;
    };
    const Index t = across(below), s = across(above);
    if (t == kNone || s == kNone || t == s) return stop;
    const Tetrahedron& corners = mesh.tet(t).corners;
    const int at_a = corner_of(corners, a);
    if (mesh.kept(t, at_a) || mesh.tet(t).across[at_a] != s || mesh.kept_edge(u, v)) return stop;
    Index x = kNone;
    for (const Index c : corners)
      if (c != a && c != u && c != v) x = c;
    if (x == b) return stop;
    const double present = std::min(mesh.tet(t).shape, mesh.tet(s).shape);
    const double bound = std::max(beat, std::min(stop.shape, present));
    Part first = beyond(t, s, u, x, depth - 1);
    if (!(first.shape > bound)) return stop;
    const Part second = beyond(t, s, x, v, depth - 1);
    if (!(second.shape > bound)) return stop;
    first.shape = std::min(first.shape, second.shape);
    first.old.insert(first.old.end(), second.old.begin(), second.old.end());
    first.old.push_back(t);
    first.old.push_back(s);
    first.edges.insert(first.edges.end(), second.edges.begin(), second.edges.end());
    return first;
  }
};

bool remove_face(const TetEdit& mesh, Index t, int facet, TetSwap& best) {
  const TetEdit::Tet& tet = mesh.tet(t);
  if (mesh.kept(t, facet)) return false;
  const Index s = tet.across[facet];
  const Index a = tet.corners[facet];
  // Counter-clockwise seen from b, across the facet from a.
  const Triangle f = facet_of(tet.corners, facet);
  Index b = kNone;
  for (const Index c : mesh.tet(s).corners)
    if (c != f[0] && c != f[1] && c != f[2]) b = c;
  const Sandwich sandwich{mesh, a, b, best.shape};
  std::vector<Index> old{t, s};
  std::vector<Tetrahedron> fresh;
  double least = kInfinity;
  for (int k = 0; k < 3; ++k) {
    const Sandwich::Part part = sandwich.beyond(t, s, f[k], f[(k + 1) % 3], kDepth);
    least = std::min(least, part.shape);
    if (!(least > best.shape)) return false;
    old.insert(old.end(), part.old.begin(), part.old.end());
    for (const auto& [u, v] : part.edges) fresh.push_back({a, b, u, v});
  }
  std::vector<Index> sorted = old;
  std::sort(sorted.begin(), sorted.end());
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) return false;
  best = {std::move(old), std::move(fresh), least};
  return true;
}

}  // namespace

bool find_edge_removal(const TetEdit& mesh, Index t, TetSwap& best) {
  bool found = false;
  for (int i = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j) found |= remove_edge(mesh, t, i, j, best);
  return found;
}

bool find_face_removal(const TetEdit& mesh, Index t, TetSwap& best) {
  bool found = false;
  for (int k = 0; k < 4; ++k) found |= remove_face(mesh, t, k, best);
  return found;
}

bool find_contraction(TetEdit& mesh, Index t, TetSwap& best) {
  bool found = false;
  const Tetrahedron corners = mesh.tet(t).corners;
  for (const Index v : corners) {
    if (mesh.held(v)) continue;
    const std::vector<Index>& star = mesh.star(v);
    for (const Index w : corners) {
      if (w == v) continue;
      double least = kInfinity;
      std::vector<Tetrahedron> fresh;
      for (const Index s : star) {
        Tetrahedron moved = mesh.tet(s).corners;
        if (std::find(moved.begin(), moved.end(), w) != moved.end()) continue;
        moved[corner_of(moved, v)] = w;
        least = std::min(least, shape(mesh, moved[0], moved[1], moved[2], moved[3]));
        if (!(least > best.shape)) break;
        fresh.push_back(moved);
      }
      if (!(least > best.shape)) continue;
      best = {star, std::move(fresh), least};
      found = true;
    }
  }
  return found;
}

}  // namespace bisector
