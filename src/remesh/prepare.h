// From a mesh as it was read to the domain of remeshing: welded, with its features found and its density laid down.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "mesh/touching.h"
#include "remesh/intersection_curves.h"
#include "remesh/kept.h"
#include "remesh/remesh.h"
#include "remesh/set_apart.h"
#include "remesh/size_bounds.h"
#include "remesh/sizing.h"

namespace bisector {

struct PreparedInput {
  TriangleMesh mesh;            // the input's surface, set apart; edges are bisected where the density asks for it
  FeatureGraph features;        // of `mesh`
  std::vector<double> density;  // for Surface
  double unit_edge = 0;         // edge length where the density is 1
  std::size_t vertices = 0;     // wanted of the result
  KeptFeatures kept;
  std::vector<char> whole;    // of each curve, whether it is to be one edge; empty: none is
  std::vector<Vec3> corners;  // of the features, before they were set apart
  DetailResult detail;
  bool noisy = false;  // normals are noise, and Energy::automatic means restricted
};

// The input with its borders joined: within `tolerance`, or, without one, as RemeshOptions::weld says. Triangles that
// are there twice are then taken once; not those of faces that several solids have in common (mesh/touching.h).
WeldResult join_borders(const TriangleMesh& input, const std::optional<double>& tolerance);

// The same, with triangles turned that run against most others, and warnings of what was done.
WeldResult weld_and_orient(const TriangleMesh& input, const std::optional<double>& tolerance, const Context& context);

// An input as a run takes it: in spatial order, so that what is near in space is near in memory, and the result does
// not depend on the order in which a file lists triangles and vertices, nor on vertices that no triangle uses.
struct OrderedInput {
  // Throws Error if labels or densities are not one for each triangle or vertex, or given edges are none of the mesh's.
  OrderedInput(const TriangleMesh& input, const RemeshOptions& options);

  TriangleMesh mesh;
  RemeshOptions options;         // with what they say of vertices by those of `mesh`
  std::vector<Index> vertex_of;  // of each vertex of the input; kNone: no triangle uses it
  Touching touching = Touching::solids;
};

// Welded, oriented, and mended where rounding spoilt it, unless that is told or parts are to be kept.
WeldResult weld_and_mend(const OrderedInput& input, const Context& context);

SizingTarget target_of(const RemeshOptions& options);

// What is done to an input before seeds are placed.
class Preparation {
 public:
  // Welds and orients the input, finds its features and plans their details. Where it branches on purpose, parts that
  // touch are neither separated nor set apart. Throws Error as remesh does.
  Preparation(OrderedInput input, const Context& context, bool branches = false);

  // The same, if there are intersections, but components that cross stay as they are and share no vertices.
  Preparation without_intersections() const;

  // Beside the bounds that there are already. Points may be those of what was set apart.
  void bound(const SizeBounds& bounds);
  // So many vertices, whatever was asked for.
  void ask_for(std::size_t vertices);
  // Components that share intersections get corners there for the edge lengths as they are now. Curves and corners are
  // others then than in domains before. False if there are none.
  bool divide_intersections_again();
  // The domain with its density as it stands.
  PreparedInput lay_down();
  const WeldResult& welded() const { return welded_; }
  // The input, welded and oriented.
  const TriangleMesh& mesh() const { return mesh_; }
  const SetApart& apart() const { return apart_; }
  // The curves along which components have the same vertices.
  const IntersectionCurves& intersections() const { return meeting_; }
  // Whether components that are set apart cross where the result has no room for the curve in which they do.
  bool lets_cross() const { return lets_cross_; }

 private:
  void find_noise(FeatureOptions& features);
  void add_corners_where_curves_touch();
  // Vertices of the input, and edges of mesh(); `original` is of each of its vertices the welded one, kNone: none.
  void keep(const std::vector<Index>& vertices, std::vector<std::array<Index, 2>> edges,
            const std::vector<Index>& original);
  std::vector<double> lay_down_plain();
  void add_wedges(std::vector<double>& lengths);
  void plan(std::vector<double> lengths);
  void plan_features(const std::vector<double>& lengths);
  // Of vertices that were put on edges.
  void add_values(const std::vector<EdgePoint>& added);
  bool plan_with_intersections();
  std::vector<std::array<Index, 2>> divide_intersection_curves();
  SizedMesh lay_down_bounded() const;
  KeptFeatures kept_features(const FeatureGraph& features) const;

  WeldResult welded_;  // without its mesh
  TriangleMesh mesh_;
  FeatureGraph features_;
  SizingOptions sizing_;
  SizingTarget target_;
  std::size_t given_seeds_;
  DetailResult detail_;
  bool resolves_all_ = false;
  bool noisy_ = false;
  std::optional<SizedMesh> unbounded_;  // laid down already, and still good
  SizeBounds bounds_;
  SetApart apart_;
  // Before the intersection curves were divided.
  struct Undivided {
    TriangleMesh mesh;
    FeatureGraph features;
    SizingOptions sizing;
    IntersectionCurves meeting;
  };
  IntersectionCurves meeting_;  // along which those that are set apart meet
  bool lets_cross_ = false;
  std::optional<Undivided> undivided_;
  std::shared_ptr<const Preparation> uncut_;      // before components were cut where they meet
  std::vector<Index> touching_;                   // vertices of mesh_ that were at the points of others
  std::vector<Index> keep_vertices_;              // of mesh_, ascending
  std::vector<Index> kept_as_;                    // of each of mesh_'s vertices before its details, the input's
  std::vector<std::array<Index, 2>> keep_edges_;  // of mesh_, sorted, lower vertex first
  SizeBounds kept_lengths_;                       // edges around what is kept, or shared, are so long
};

}  // namespace bisector
