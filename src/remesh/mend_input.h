// What files leave in a surface that a mesh is not to follow: what rounding did, and parts that touch.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "bisector/context.h"
#include "bisector/mesh.h"
#include "bisector/repair.h"
#include "mesh/touching.h"

namespace bisector {

// Mends what is within rounding, 1e-5 of the diagonal: shorter edges are collapsed, and parts without an inside left
// out that are smaller than `edge`, the length of edges asked for (mesh/short_edges.h), lower caps flipped
// (mesh/caps.h), and with them triangles folded back that are lower than a twentieth of `edge`. `given` are edges of
// the mesh that was welded, which stay. Says in warnings what was done.
void mend_rounding(WeldResult& welded, std::vector<std::array<Index, 2>> given, double edge, const Context& context);

// Where parts of the surface touch in points, or solids along edges, they are meshed as if they did not: the surface is
// a manifold then.
class Separation {
 public:
  // Nothing is separated yet.
  explicit Separation(const TriangleMesh& mesh) : given_(mesh.vertices.size()), vertices_(given_) {}
  // Separates the parts of that mesh, with a warning.
  void separate(TriangleMesh& mesh, Touching touching, const Context& context);

  // Edges of the separated mesh that were `given` before.
  std::vector<std::array<Index, 2>> edges(const TriangleMesh& mesh,
                                          const std::vector<std::array<Index, 2>>& given) const;
  // Of each vertex of a mesh, the one that it was; kNone of middles of edges.
  std::vector<Index> originals(std::size_t vertices) const;
  // The vertices that were one with others, of the mesh that separate() left.
  std::vector<Index> parted() const;
  // Of each vertex, from those that were given.
  std::vector<double> values(std::vector<double> given) const;

 private:
  std::size_t given_;
  std::vector<std::array<Index, 2>> halved_;
  std::size_t vertices_;
  std::vector<Index> original_;
};

// Moves vertices at the same point apart, 1e-7 of the diagonal towards their triangles, with a warning: of two seeds at
// the same point one owns nothing. With `seams` also those of borders that coincide in edges, else where parts touch in
// single points alone. Returns them, ascending.
std::vector<Index> part_equal_points(TriangleMesh& mesh, bool seams, const Context& context);

// Moves faces apart in which components lie on each other (mesh/face_contacts.h), with a warning: triangles of two
// faces that coincide all intersect, and the more, the finer they are.
void open_contacts(TriangleMesh& mesh, const Context& context);

// Those that are left when vertices have become others.
void rename_edges(const std::vector<Index>& vertex_of, std::vector<std::array<Index, 2>>& edges);

// "1 edge", "2 edges".
std::string plural(std::size_t count, const char* word);

}  // namespace bisector
