#include "tetmesh/insert_points.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "bisector/error.h"
#include "core/geometry.h"
#include "core/orientation.h"
#include "mesh/tet_adjacency.h"
#include "spatial/hilbert.h"
#include "tetmesh/tet_edit.h"

namespace bisector {
namespace {

constexpr std::size_t kCheckEvery = 1024;  // points between two checks for cancellation

class Inserter {
 public:
  explicit Inserter(TetEdit& mesh) : mesh_(mesh) {}

  // The new vertex, or kNone if the point cannot become one.
  Index insert(const Vec3& p) {
    p_ = p;
    last_ = locate();
    if (last_ == kNone || !find_cavity(last_)) return kNone;
    std::vector<Tetrahedron> fresh;
    const Index v = static_cast<Index>(mesh_.points());
    for (const Index t : cavity_)
      for (int k = 0; k < 4; ++k)
        if (!inner(t, k)) {
          const Triangle f = facet_of(mesh_.tet(t).corners, k);
          fresh.push_back({v, f[0], f[1], f[2]});
        }
    mesh_.begin();
    mesh_.add_point(p);
    if (!mesh_.replace(cavity_, fresh)) {
      mesh_.undo();
      return kNone;
    }
    mesh_.keep();
    last_ = mesh_.added().front();
    return v;
  }

 private:
  // Positive if the point is on the tetrahedron's side of its facet k.
  int side(Index t, int k) const {
    const Triangle f = facet_of(mesh_.tet(t).corners, k);
    return orientation(p_, mesh_.point(f[0]), mesh_.point(f[1]), mesh_.point(f[2]));
  }

  bool holds(Index t) const {
    for (int k = 0; k < 4; ++k)
      if (side(t, k) < 0) return false;
    return true;
  }

  // A tetrahedron that holds the point. The walk ends at the boundary of a solid that is not convex; then all
  // tetrahedra are searched.
  Index locate() const {
    Index t = last_ != kNone && mesh_.tet(last_).alive ? last_ : kNone;
    for (std::size_t step = 0; t != kNone && step < mesh_.size(); ++step) {
      int out = -1;
      for (int k = 0; k < 4 && out < 0; ++k) {
        // Always beginning with the same facet, the walk could go in circles.
        const int facet = static_cast<int>((static_cast<std::size_t>(k) + step) & 3);
        if (side(t, facet) < 0) out = facet;
      }
      if (out < 0) return t;
      t = mesh_.tet(t).across[out];
    }
    for (t = 0; t < mesh_.size(); ++t)
      if (mesh_.tet(t).alive && holds(t)) return t;
    return kNone;
  }

  // Whether the tetrahedron is in the cavity.
  bool contains(Index t) const { return std::find(cavity_.begin(), cavity_.end(), t) != cavity_.end(); }
  // Whether facet k of a tetrahedron of the cavity lies between two of the cavity.
  bool inner(Index t, int k) const {
    const Index other = mesh_.tet(t).across[k];
    return other != kNone && !mesh_.kept(t, k) && contains(other);
  }

  // Whether the point is in the tetrahedron's circumscribed sphere. This is not exact: rounding may change which of
  // many valid cavities is taken.
  bool in_sphere(Index t) const {
    const Tetrahedron& c = mesh_.tet(t).corners;
    const Vec3 a = mesh_.point(c[0]) - p_, b = mesh_.point(c[1]) - p_;
    const Vec3 d = mesh_.point(c[2]) - p_, e = mesh_.point(c[3]) - p_;
    return norm2(a) * dot(cross(b, d), e) - norm2(b) * dot(cross(a, d), e) + norm2(d) * dot(cross(a, b), e) -
               norm2(e) * dot(cross(a, b), d) >
           0;
  }

  // The tetrahedra to be replaced around the point; `first` holds it. False if there are none.
  bool find_cavity(Index first) {
    std::size_t core = 0;
    if (!find_core(first, core)) return false;
    grow();
    return shrink(core);
  }

  // Starts the cavity with the tetrahedra that hold the point inside, or on a facet or an edge of theirs: `core` of
  // them. False if something kept holds the point.
  bool find_core(Index first, std::size_t& core) {
    cavity_.assign(1, first);
    core = 1;
    for (std::size_t i = 0; i < core; ++i)
      for (int k = 0; k < 4; ++k) {
        if (side(cavity_[i], k) != 0) continue;
        if (mesh_.kept(cavity_[i], k)) return false;
        const Index other = mesh_.tet(cavity_[i]).across[k];
        if (!contains(other)) cavity_.push_back(other), ++core;
      }
    return true;
  }

  // Adds the tetrahedra around with the point in their circumscribed sphere.
  void grow() {
    for (std::size_t i = 0; i < cavity_.size(); ++i)
      for (int k = 0; k < 4; ++k) {
        if (mesh_.kept(cavity_[i], k)) continue;
        const Index other = mesh_.tet(cavity_[i]).across[k];
        if (!contains(other) && in_sphere(other)) cavity_.push_back(other);
      }
  }

  // Takes out tetrahedra until the point sees every facet around the cavity from inside and nothing kept and no vertex
  // is enclosed. False if one of the core would have to go.
  bool shrink(std::size_t core) {
    while (true) {
      std::size_t bad = unseen();
      if (bad == cavity_.size()) bad = enclosing();
      if (bad == cavity_.size()) return true;
      if (bad < core) return false;
      cavity_.erase(cavity_.begin() + static_cast<std::ptrdiff_t>(bad));
      drop_loose(core);
    }
  }

  // The last tetrahedron with an outer facet that the point does not see; the cavity's size if there is none.
  std::size_t unseen() const {
    for (std::size_t i = cavity_.size(); i-- > 0;)
      for (int k = 0; k < 4; ++k)
        if (!inner(cavity_[i], k) && side(cavity_[i], k) <= 0) return i;
    return cavity_.size();
  }

  // The last tetrahedron with a vertex that no facet around the cavity has, or with a kept facet inside the cavity;
  // the cavity's size if there is none.
  std::size_t enclosing() const {
    std::vector<Index> outer;
    for (const Index t : cavity_)
      for (int k = 0; k < 4; ++k)
        if (!inner(t, k)) {
          const Triangle f = facet_of(mesh_.tet(t).corners, k);
          outer.insert(outer.end(), f.begin(), f.end());
        }
    for (std::size_t i = cavity_.size(); i-- > 0;) {
      const TetEdit::Tet& tet = mesh_.tet(cavity_[i]);
      for (int k = 0; k < 4; ++k)
        if (std::find(outer.begin(), outer.end(), tet.corners[k]) == outer.end() ||
            (mesh_.kept(cavity_[i], k) && tet.across[k] != kNone && contains(tet.across[k])))
          return i;
    }
    return cavity_.size();
  }

  // Takes out the tetrahedra that are no longer joined to the core by facets.
  void drop_loose(std::size_t core) {
    std::vector<Index> joined(cavity_.begin(), cavity_.begin() + static_cast<std::ptrdiff_t>(core));
    for (std::size_t i = 0; i < joined.size(); ++i)
      for (int k = 0; k < 4; ++k) {
        const Index other = mesh_.tet(joined[i]).across[k];
        if (inner(joined[i], k) && std::find(joined.begin(), joined.end(), other) == joined.end())
          joined.push_back(other);
      }
    cavity_ = std::move(joined);
  }

  TetEdit& mesh_;
  Vec3 p_;
  Index last_ = 0;  // the tetrahedron from which the next walk starts
  std::vector<Index> cavity_;
};

}  // namespace

TetMesh insert_points(const TetMesh& mesh, const std::vector<Vec3>& points, std::vector<Index>& vertices,
                      const Context& context) {
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int k = 0; k < 3; ++k)
      if (!std::isfinite(points[i][k])) throw Error("point " + std::to_string(i) + " is not finite");
  TetEdit edit(mesh);
  Inserter inserter(edit);
  vertices.assign(points.size(), kNone);
  std::size_t done = 0;
  for (const Index i : hilbert_order(points)) {
    if (done++ % kCheckEvery == 0) context.check();
    vertices[i] = inserter.insert(points[i]);
  }

  std::vector<Index> slots;
  TetMesh result = edit.mesh(slots);
  std::vector<Index> place(edit.points());
  const Index first = static_cast<Index>(mesh.vertices.size());
  for (Index v = 0; v < first; ++v) place[v] = v;
  Index next = first;
  for (Index& v : vertices)
    if (v != kNone) {
      place[v] = next;
      v = next++;
    }
  const std::vector<Vec3> positions = result.vertices;
  for (std::size_t v = 0; v < slots.size(); ++v) result.vertices[place[slots[v]]] = positions[v];
  for (Tetrahedron& corners : result.tets)
    for (Index& v : corners) v = place[slots[v]];
  return result;
}

}  // namespace bisector
