// Where components of a surface cross or touch: curves along which they get the same vertices and edges.
//
// Components are remeshed each for itself (remesh/set_apart.h), so triangles of one would cross those of another, in
// the more pairs, the finer the result. Where both have the same vertices along the curves in which they meet, and the
// same edges between these, they only touch. So the mesh is cut along these curves (mesh/corefine.h), which become
// features and get corners an edge length apart, at the same points on all components; what is between two of them is
// to be one edge of the result.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "features/edge_splits.h"
#include "features/wedges.h"
#include "mesh/corefine.h"
#include "remesh/sizing.h"

namespace bisector {

class IntersectionCurves {
 public:
  // None.
  IntersectionCurves() = default;
  // Those of a mesh whose components have been cut along them, but for the edges `left_out`. Its features get them:
  // other curves end where they meet them.
  IntersectionCurves(const Corefinement& cut, const std::vector<std::array<Index, 2>>& left_out,
                     FeatureGraph& features);

  bool empty() const { return curves_.empty(); }
  std::size_t size() const { return curves_.size(); }
  // On the mesh as it was cut, all components together.
  double length(const TriangleMesh& mesh) const;

  // To be told of features that were simplified for a coarse mesh (features/simplify.h), which get these curves as they
  // are, with their corners.
  void put_into(FeatureGraph& simplified) const;

  // To be told of edges of the mesh that were divided.
  void follow(const EdgeSplits& splits);

  struct Division {
    std::vector<EdgePoint> added;  // vertices, in order, of edges as they were when each was put in
    std::vector<Vec3> middles;     // of the edges that the result is to have
    std::vector<double> lengths;   // of these edges
    // Edges of the curves before that the result has no room for: corners of a component would be too near to an edge
    // that does not end there, or two edges at too small an angle.
    std::vector<std::array<Index, 2>> crowded;
  };
  // Puts vertices into the mesh where the curves are to have corners: as far from each other as the least edge length
  // of the components there, which `sized`, a refinement of the mesh, has. A closed curve gets three at least, and two
  // that join the same corners one each. The features get these corners.
  Division divide(TriangleMesh& mesh, FeatureGraph& features, const SizedMesh& sized);

  // Of each curve of a graph on the mesh, or on one with divided edges, whether it leads along one of these from corner
  // to corner.
  std::vector<char> among(const FeatureGraph& features) const;

 private:
  // One vertex after the other, as each of the components has them, at the same points.
  struct Curve {
    std::vector<std::vector<Index>> copies;
    bool closed = false;

    std::size_t edges() const { return copies[0].size() - (closed ? 0 : 1); }
  };

  // What is to be an edge of the result.
  struct Piece {
    const Curve* curve;
    std::vector<std::array<Index, 2>> ends;  // on each of the components
    double first, last;                      // along the polyline, in its edges
    Vec3 from, to;
  };

  // A place along a polyline, in its edges, and how long edges are to be there.
  struct Station {
    double place, length;
  };

  // `splits` are of all edges of the mesh as it was cut, down to those of `sized`.
  static std::vector<Station> stations(const Curve& curve, const SizedMesh& sized, const EdgeSplits& splits);
  static std::vector<double> corner_places(const Curve& curve, const SizedMesh& sized, const EdgeSplits& splits,
                                           std::size_t least);
  std::vector<std::array<Index, 2>> crowded_edges(const TriangleMesh& mesh, const FeatureGraph& features,
                                                  const std::vector<Piece>& pieces) const;
  // The curves as they are in features.
  std::vector<FeatureCurve> copies() const;
  void drop_doubled(FeatureGraph& features) const;

  std::vector<Curve> curves_;
  std::vector<std::array<Index, 2>> edges_;  // along the curves, sorted, lower vertex first
  EdgeSplits splits_;                        // of edges since the mesh was cut
  std::size_t vertices_ = 0;                 // of the mesh
};

}  // namespace bisector
