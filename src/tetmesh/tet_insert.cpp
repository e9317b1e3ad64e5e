#include "tetmesh/tet_insert.h"

#include <algorithm>
#include <limits>

#include "mesh/tet_adjacency.h"
#include "tetmesh/tet_shape.h"

namespace bisector {
namespace {

constexpr std::size_t kMostInCavity = 40;  // tetrahedra

// A facet around a cavity.
struct Facet {
  Index tet;     // inside
  int corner;    // of it, opposite the facet
  double shape;  // of the tetrahedron that the facet makes with the point
};

// Tetrahedra around a point that is to become a vertex.
class Cavity {
 public:
  Cavity(const TetEdit& mesh, const Vec3& p) : mesh_(mesh), p_(p) {}

  // False if something kept lies between the tetrahedra.
  bool start(const std::vector<Index>& tets) {
    tets_ = tets;
    for (const Index t : tets_)
      for (int k = 0; k < 4; ++k) {
        const Index other = mesh_.tet(t).across[k];
        if (other != kNone && contains(other)) {
          if (mesh_.kept(t, k)) return false;
          continue;
        }
        facets_.push_back({t, k, shape(t, k)});
      }
    return true;
  }

  // Adds the tetrahedron beyond the worst facet as long as that helps.
  void grow() {
    while (tets_.size() < kMostInCavity) {
      const auto worst = std::min_element(facets_.begin(), facets_.end(), [](const Facet& a, const Facet& b) {
        return a.shape != b.shape ? a.shape < b.shape : a.tet != b.tet ? a.tet < b.tet : a.corner < b.corner;
      });
      if (worst->shape >= 1 || !take(*worst)) return;
    }
  }

  // The least shape of the tetrahedra that the facets make with the point.
  double least() const {
    double value = std::numeric_limits<double>::infinity();
    for (const Facet& f : facets_) value = std::min(value, f.shape);
    return value;
  }

  TetInsertion result() const {
    TetInsertion insertion{p_, tets_, {}, least()};
    for (const Facet& f : facets_) insertion.facets.push_back(facet_of(mesh_.tet(f.tet).corners, f.corner));
    return insertion;
  }

 private:
  bool contains(Index t) const { return std::find(tets_.begin(), tets_.end(), t) != tets_.end(); }

  double shape(Index t, int k) const {
    const Triangle f = facet_of(mesh_.tet(t).corners, k);
    return dihedral_shape(p_, mesh_.point(f[0]), mesh_.point(f[1]), mesh_.point(f[2]));
  }

  bool has_vertex(Index v) const {
    return std::any_of(facets_.begin(), facets_.end(), [&](const Facet& f) {
      const Triangle g = facet_of(mesh_.tet(f.tet).corners, f.corner);
      return g[0] == v || g[1] == v || g[2] == v;
    });
  }

  // Adds the tetrahedron beyond a facet if its other facets all make better tetrahedra with the point, and if the
  // cavity then neither encloses a vertex nor touches itself at one.
  bool take(const Facet& facet) {
    if (mesh_.kept(facet.tet, facet.corner)) return false;
    const Index next = mesh_.tet(facet.tet).across[facet.corner];
    const TetEdit::Tet& tet = mesh_.tet(next);
    int shared = 0;
    Index apex = kNone;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 4; ++k) {
      if (tet.across[k] != kNone && contains(tet.across[k])) {
        if (mesh_.kept(next, k)) return false;
        ++shared;
        apex = tet.corners[k];
      } else {
        least = std::min(least, shape(next, k));
      }
    }
    if (shared > 2 || !(least > facet.shape) || (shared == 1 && has_vertex(apex))) return false;
    tets_.push_back(next);
    std::erase_if(facets_, [&](const Facet& f) { return mesh_.tet(f.tet).across[f.corner] == next; });
    for (int k = 0; k < 4; ++k)
      if (tet.across[k] == kNone || !contains(tet.across[k])) facets_.push_back({next, k, shape(next, k)});
    return true;
  }

  const TetEdit& mesh_;
  Vec3 p_;
  std::vector<Index> tets_;
  std::vector<Facet> facets_;
};

}  // namespace

std::vector<TetInsertion> find_insertions(TetEdit& mesh, Index t) {
  std::vector<TetInsertion> found;
  const auto attempt = [&](const Vec3& p, const std::vector<Index>& tets) {
    Cavity cavity(mesh, p);
    if (!cavity.start(tets)) return;
    cavity.grow();
    if (cavity.least() > 0) found.push_back(cavity.result());
  };
  const TetEdit::Tet& tet = mesh.tet(t);
  const auto at = [&](int k) { return mesh.point(tet.corners[k]); };
  attempt(0.25 * (at(0) + at(1) + at(2) + at(3)), {t});
  for (int k = 0; k < 4; ++k)
    if (!mesh.kept(t, k)) {
      const Triangle f = facet_of(tet.corners, k);
      attempt((1.0 / 3) * (mesh.point(f[0]) + mesh.point(f[1]) + mesh.point(f[2])), {t, tet.across[k]});
    }
  std::vector<Index> tets, ring;
  for (int i = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j)
      if (!mesh.kept_edge(tet.corners[i], tet.corners[j]) && mesh.ring(t, i, j, kMostInCavity, tets, ring))
        attempt(0.5 * (at(i) + at(j)), tets);
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.shape > b.shape; });
  return found;
}

}  // namespace bisector
