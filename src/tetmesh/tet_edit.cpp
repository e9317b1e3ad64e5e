#include "tetmesh/tet_edit.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "bisector/error.h"
#include "core/orientation.h"
#include "mesh/tet_adjacency.h"
#include "tetmesh/tet_shape.h"

namespace bisector {
namespace {

// Sorts the corners; true if that takes an odd permutation.
bool sort_corners(Triangle& f) {
  bool odd = false;
  const auto order = [&](int i, int j) {
    if (f[i] > f[j]) {
      std::swap(f[i], f[j]);
      odd = !odd;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return odd;
}

std::array<Index, 2> sorted_edge(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

void check_lists(const TetMesh& mesh) {
  const auto check_index = [&](Index v, const char* what, std::size_t i) {
    if (v >= mesh.vertices.size())
      throw Error(std::string(what) + " " + std::to_string(i) + " has vertex " + std::to_string(v) +
                  ", but there are " + std::to_string(mesh.vertices.size()) + " vertices");
  };
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (const Index v : mesh.tets[t]) check_index(v, "tetrahedron", t);
  for (std::size_t f = 0; f < mesh.boundary.size(); ++f)
    for (const Index v : mesh.boundary[f]) check_index(v, "marked triangle", f);
  for (std::size_t e = 0; e < mesh.feature_edges.size(); ++e)
    for (const Index v : mesh.feature_edges[e]) check_index(v, "feature edge", e);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(mesh.vertices[v][k])) throw Error("vertex " + std::to_string(v) + " is not finite");
  if (!mesh.regions.empty() && mesh.regions.size() != mesh.tets.size())
    throw Error("there are " + std::to_string(mesh.regions.size()) + " regions for " +
                std::to_string(mesh.tets.size()) + " tetrahedra: give one for each, or none");
}

}  // namespace

TetEdit::TetEdit(const TetMesh& mesh)
    : points_(mesh.vertices), tet_of_(mesh.vertices.size(), kNone), alive_(mesh.vertices.size(), 1),
      held_(mesh.vertices.size(), 0), on_boundary_(mesh.vertices.size(), 0), boundary_labels_(mesh.boundary_labels),
      has_regions_(!mesh.regions.empty()), marked_(mesh.boundary), feature_edges_(mesh.feature_edges) {
  check_lists(mesh);
  const auto adjacent = tet_adjacency(mesh.tets);
  std::vector<Triangle> marked = mesh.boundary;
  for (Triangle& f : marked) sort_corners(f);
  std::sort(marked.begin(), marked.end());

  const Index n = static_cast<Index>(mesh.tets.size());
  tets_.reserve(n + n / 4);
  std::vector<Index> uses(points_.size(), 0);
  std::vector<std::uint8_t> inside(points_.size(), 0);  // on something kept that is not the boundary
  std::vector<std::array<Index, 2>> edges;              // of what is kept
  for (Index t = 0; t < n; ++t) {
    const Tetrahedron& corners = mesh.tets[t];
    if (!positive(corners))
      throw Error("tetrahedron " + std::to_string(t) + " is flat or inverted: only valid meshes can be improved");
    Tet tet{corners, adjacent[t], shape_of(corners), has_regions_ ? mesh.regions[t] : 0, 0, true};
    for (int k = 0; k < 4; ++k) {
      const Index other = adjacent[t][k];
      const Triangle facet = facet_of(corners, k);
      bool keep = other == kNone || (has_regions_ && mesh.regions[other] != mesh.regions[t]);
      if (!keep && !marked.empty()) {
        Triangle key = facet;
        sort_corners(key);
        keep = std::binary_search(marked.begin(), marked.end(), key);
      }
      ++uses[corners[k]];
      tet_of_[corners[k]] = t;
      if (!keep) continue;
      tet.kept |= static_cast<std::uint8_t>(1 << k);
      for (int i = 0; i < 3; ++i) {
        held_[facet[i]] = 1;
        (other == kNone ? on_boundary_ : inside)[facet[i]] = 1;
        if (!mesh.feature_edges.empty()) edges.push_back(sorted_edge(facet[i], facet[(i + 1) % 3]));
      }
    }
    tets_.push_back(tet);
  }
  std::sort(edges.begin(), edges.end());
  for (const auto& e : mesh.feature_edges) {
    const auto edge = sorted_edge(e[0], e[1]);
    if (std::binary_search(edges.begin(), edges.end(), edge)) continue;
    kept_edges_.push_back(edge);
    for (const Index v : edge) held_[v] = inside[v] = 1;
  }
  std::sort(kept_edges_.begin(), kept_edges_.end());
  stamps_.assign(tets_.size(), 0);
  for (Index v = 0; v < points_.size(); ++v)
    if (on_boundary_[v]) on_boundary_[v] = !inside[v] && star(v).size() == uses[v];
}

double TetEdit::shape_of(const Tetrahedron& c) const {
  return dihedral_shape(points_[c[0]], points_[c[1]], points_[c[2]], points_[c[3]]);
}

bool TetEdit::positive(const Tetrahedron& c) const {
  return orientation(points_[c[0]], points_[c[1]], points_[c[2]], points_[c[3]]) > 0;
}

bool TetEdit::kept_edge(Index a, Index b) const {
  return !kept_edges_.empty() && std::binary_search(kept_edges_.begin(), kept_edges_.end(), sorted_edge(a, b));
}

const std::vector<Index>& TetEdit::star(Index v) {
  star_.clear();
  if (tet_of_[v] == kNone) return star_;
  ++stamp_;
  star_.push_back(tet_of_[v]);
  stamps_[tet_of_[v]] = stamp_;
  for (std::size_t k = 0; k < star_.size(); ++k) {
    const Tet& tet = tets_[star_[k]];
    for (int i = 0; i < 4; ++i) {
      const Index next = tet.across[i];
      if (tet.corners[i] == v || next == kNone || stamps_[next] == stamp_) continue;
      stamps_[next] = stamp_;
      star_.push_back(next);
    }
  }
  return star_;
}

bool TetEdit::ring(Index t, int i, int j, std::size_t most, std::vector<Index>& tets,
                   std::vector<Index>& vertices) const {
  tets.clear();
  vertices.clear();
  const Index a = tets_[t].corners[i], b = tets_[t].corners[j];
  // (i, j, k, l) is an even permutation of the corners, and so stays it for the next ones.
  int k = 0;
  while (k == i || k == j) ++k;
  int l = 6 - i - j - k;
  const int order[4] = {i, j, k, l};
  bool odd = false;
  for (int p = 0; p < 4; ++p)
    for (int q = p + 1; q < 4; ++q) odd ^= order[p] > order[q];
  if (odd) std::swap(k, l);

  Index at = t, from = tets_[t].corners[k], to = tets_[t].corners[l];
  do {
    if (tets.size() == most) return false;
    const Tet& tet = tets_[at];
    tets.push_back(at);
    vertices.push_back(from);
    int back = 0;
    while (tet.corners[back] != from) ++back;
    if (tet.kept >> back & 1) return false;
    at = tet.across[back];
    from = to;
    for (const Index v : tets_[at].corners)
      if (v != a && v != b && v != from) to = v;
  } while (at != t);
  return true;
}

bool TetEdit::collect_sides(std::span<const Index> old, std::span<const Tetrahedron> fresh) {
  sides_.clear();
  ++stamp_;
  for (const Index t : old) stamps_[t] = stamp_;
  for (const Index t : old) {
    const Tet& tet = tets_[t];
    if (tet.region != tets_[old[0]].region) return false;
    for (int k = 0; k < 4; ++k) {
      const Index other = tet.across[k];
      const std::uint8_t kept = tet.kept >> k & 1;
      int facet = 0;
      if (other != kNone) {
        if (stamps_[other] == stamp_) {
          if (kept) return false;
          continue;
        }
        while (tets_[other].across[facet] != t) ++facet;
      }
      Triangle corners = facet_of(tet.corners, k);
      const bool odd = sort_corners(corners);
      sides_.push_back({corners, odd, false, kept, other, facet});
    }
  }
  for (Index t = 0; t < fresh.size(); ++t)
    for (int k = 0; k < 4; ++k) {
      Triangle corners = facet_of(fresh[t], k);
      const bool odd = sort_corners(corners);
      sides_.push_back({corners, odd, true, 0, t, k});
    }
  std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.fresh < b.fresh;
  });
  return true;
}

bool TetEdit::sides_match() const {
  if (sides_.size() % 2) return false;
  for (std::size_t k = 0; k < sides_.size(); k += 2) {
    const Side &a = sides_[k], &b = sides_[k + 1];
    if (a.corners != b.corners || !b.fresh || (a.odd == b.odd) == a.fresh) return false;
    if (k && sides_[k - 1].corners == a.corners) return false;
  }
  return true;
}

bool TetEdit::loses_kept_edge(std::span<const Index> old, std::span<const Tetrahedron> fresh) const {
  if (kept_edges_.empty()) return false;
  const auto has_edge = [&](std::array<Index, 2> e) {
    return std::any_of(fresh.begin(), fresh.end(), [&](const Tetrahedron& c) {
      return std::find(c.begin(), c.end(), e[0]) != c.end() && std::find(c.begin(), c.end(), e[1]) != c.end();
    });
  };
  for (const Index t : old)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) {
        const auto e = sorted_edge(tets_[t].corners[i], tets_[t].corners[j]);
        if (kept_edge(e[0], e[1]) && !has_edge(e)) return true;
      }
  return false;
}

Index TetEdit::new_slot() {
  if (free_.empty()) {
    tets_.emplace_back();
    stamps_.push_back(0);
    return static_cast<Index>(tets_.size() - 1);
  }
  const Index slot = free_.back();
  free_.pop_back();
  return slot;
}

void TetEdit::put_in_slots(std::span<const Index> old, std::span<const Tetrahedron> fresh,
                           const std::vector<Index>* slots) {
  const std::int32_t region = tets_[old[0]].region;
  for (const Index t : old) {
    tets_[t].alive = false;
    for (const Index v : tets_[t].corners) tet_of_[v] = kNone;
  }
  added_.clear();
  for (const Tetrahedron& corners : fresh) {
    const Index slot = slots ? (*slots)[added_.size()] : new_slot();
    tets_[slot] = {corners, {kNone, kNone, kNone, kNone}, shape_of(corners), region, 0, true};
    for (const Index v : corners) tet_of_[v] = slot;
    added_.push_back(slot);
  }
  for (const Index t : old)
    for (const Index v : tets_[t].corners) alive_[v] = tet_of_[v] != kNone;
  for (const Tetrahedron& corners : fresh)
    for (const Index v : corners) alive_[v] = 1;
  if (!slots) free_.insert(free_.end(), old.begin(), old.end());
}

void TetEdit::link_sides() {
  for (std::size_t k = 0; k < sides_.size(); k += 2) {
    const Side &a = sides_[k], &b = sides_[k + 1];
    const Index inner = added_[b.tet], outer = a.fresh ? added_[a.tet] : a.tet;
    tets_[inner].across[b.facet] = outer;
    if (outer != kNone) tets_[outer].across[a.facet] = inner;
    if (a.kept) tets_[inner].kept |= static_cast<std::uint8_t>(1 << b.facet);
  }
}

bool TetEdit::exchange(std::span<const Index> old, std::span<const Tetrahedron> fresh,
                       const std::vector<Index>* slots) {
  if (!slots && !std::all_of(fresh.begin(), fresh.end(), [&](const Tetrahedron& t) { return positive(t); }))
    return false;
  if (!collect_sides(old, fresh) || !sides_match() || loses_kept_edge(old, fresh)) return false;
  Change change{Change::replaced};
  if (recording_) {
    change.slots = tets_.size();
    change.freed.assign(old.begin(), old.end());
    for (const Index t : old) change.removed.push_back(tets_[t].corners);
  }
  put_in_slots(old, fresh, slots);
  link_sides();
  if (recording_) {
    change.added = added_;
    changes_.push_back(std::move(change));
  }
  return true;
}

bool TetEdit::replace(std::span<const Index> old, std::span<const Tetrahedron> fresh) {
  return exchange(old, fresh, nullptr);
}

Index TetEdit::add_point(const Vec3& p) {
  const Index v = static_cast<Index>(points_.size());
  points_.push_back(p);
  tet_of_.push_back(kNone);
  alive_.push_back(0);
  held_.push_back(0);
  on_boundary_.push_back(0);
  if (recording_) changes_.push_back({Change::inserted, v});
  return v;
}

bool TetEdit::move(Index v, const Vec3& p) {
  const Vec3 before = points_[v];
  points_[v] = p;
  const std::vector<Index>& tets = star(v);
  if (!std::all_of(tets.begin(), tets.end(), [&](Index t) { return positive(tets_[t].corners); })) {
    points_[v] = before;
    return false;
  }
  for (const Index t : tets) tets_[t].shape = shape_of(tets_[t].corners);
  if (recording_) changes_.push_back({Change::moved, v, before});
  return true;
}

void TetEdit::begin() {
  changes_.clear();
  recording_ = true;
}

void TetEdit::undo() {
  recording_ = false;
  for (; !changes_.empty(); changes_.pop_back()) {
    Change& change = changes_.back();
    if (change.kind == Change::replaced) {
      exchange(change.added, change.removed, &change.freed);
      free_.resize(free_.size() - change.freed.size());
      for (std::size_t k = change.added.size(); k-- > 0;)
        if (change.added[k] < change.slots) free_.push_back(change.added[k]);
      tets_.resize(change.slots);
      stamps_.resize(change.slots);
    } else if (change.kind == Change::moved) {
      points_[change.vertex] = change.position;
      for (const Index t : star(change.vertex)) tets_[t].shape = shape_of(tets_[t].corners);
    } else {
      points_.pop_back();
      tet_of_.pop_back();
      alive_.pop_back();
      held_.pop_back();
      on_boundary_.pop_back();
    }
  }
}

void TetEdit::keep() {
  recording_ = false;
  changes_.clear();
}

std::vector<Index> TetEdit::changed() {
  std::vector<Index> tets;
  for (const Change& change : changes_) {
    tets.insert(tets.end(), change.added.begin(), change.added.end());
    if (change.kind == Change::moved && alive_[change.vertex]) {
      const std::vector<Index>& around = star(change.vertex);
      tets.insert(tets.end(), around.begin(), around.end());
    }
  }
  std::sort(tets.begin(), tets.end());
  tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
  std::erase_if(tets, [&](Index t) { return !tets_[t].alive; });
  return tets;
}

TetMesh TetEdit::mesh(std::vector<Index>& slots) const {
  TetMesh result;
  slots.clear();
  std::vector<Index> place(points_.size(), kNone);
  for (Index v = 0; v < points_.size(); ++v)
    if (alive_[v]) {
      place[v] = static_cast<Index>(slots.size());
      slots.push_back(v);
      result.vertices.push_back(points_[v]);
    }
  for (const Tet& tet : tets_) {
    if (!tet.alive) continue;
    Tetrahedron corners;
    for (int k = 0; k < 4; ++k) corners[k] = place[tet.corners[k]];
    result.tets.push_back(corners);
    if (has_regions_) result.regions.push_back(tet.region);
  }
  for (const Triangle& f : marked_) result.boundary.push_back({place[f[0]], place[f[1]], place[f[2]]});
  result.boundary_labels = boundary_labels_;
  for (const auto& e : feature_edges_) result.feature_edges.push_back({place[e[0]], place[e[1]]});
  return result;
}

}  // namespace bisector
