// Sharp features of a mesh: creases, borders and non-manifold edges as curves between corners (thesis 4.4.3).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

// Why an edge is a feature; where several reasons hold, the first.
enum class FeatureKind : std::uint8_t {
  non_manifold,  // more than two triangles
  border,        // one triangle
  given,         // marked in the mesh or by the caller
  label,         // between different face labels
  crease,        // sharp
  intersection   // where another component meets this one: found by remesh, which cuts both there
};

// A maximal chain of feature edges without a corner inside.
struct FeatureCurve {
  std::vector<Index> vertices;             // mesh vertices in order; a closed curve does not repeat its first
  bool closed = false;                     // if not, both ends are corners, perhaps the same one
  FeatureKind kind = FeatureKind::crease;  // of all its edges
};

struct FeatureGraph {
  std::vector<std::array<Index, 2>> edges;  // ascending, lower vertex first
  std::vector<Index> corners;               // mesh vertices, ascending; some may be on no edge
  std::vector<FeatureCurve> curves;         // every edge is in exactly one
};

enum class FeatureMode {
  none,       // borders, non-manifold edges and FeatureOptions::given only
  automatic,  // creases where the surface is folded along a line, as in parts made by CAD; hardly any on scans
  degrees     // creases are all edges whose triangles' normals deviate by more than FeatureOptions::angle
};

struct FeatureOptions {
  FeatureMode mode = FeatureMode::automatic;
  double angle = 40;                        // degrees, in (0, 180); with FeatureMode::degrees
  double corner_angle = 50;                 // degrees, in (0, 180): a curve that turns by more has a corner there
  std::vector<std::array<Index, 2>> given;  // edges to take whatever the mode; either vertex first
};

// Finds the features of a mesh. Any soup is allowed, but duplicated vertices make borders: weld first (repair.h).
// Whether two triangles are oriented alike does not matter. Exactly collinear triangles, and slivers that are thinner
// than 1e-4 of the bounding box's diagonal and 0.02 of their length, have no normal of their own: an edge beside one is
// compared with what lies beyond it.
//
// Borders and edges of more than two triangles are features in every mode, since borders of a result must lie on those
// of the input. Edges between labels and TriangleMesh::feature_edges count in all modes but `none`.
//
// Creases in mode `automatic`: a seed is an edge of more than 40 degrees beside which the surface bends less than half
// as much about that edge, other edges of more than 40 degrees not counted. Chains of seeds are followed beyond their
// ends, straight on, along edges of more than 10 degrees that bend more than what is beside them, to where a crease
// fades out. What hangs together is kept if its angle, on average, exceeds 30 degrees by five times its disorder, which
// is the median angle of the edges around it, or, along chains of many edges, the change of angle from edge to edge, if
// that is less; and if it is longer than some edges of the mesh or joined to other features.
// Edges and triangles are those of the mesh without the vertices that lie flat or on straight edges, up to the rounding
// of coordinates to six digits, so that dividing triangles makes no creases.
//
// Corners: vertices with one or with more than two feature edges; turns of a curve by more than the corner angle,
// measured across edges that are tiny beside their neighbours; where the kind of a curve or the pair of labels beside
// it changes; vertices whose triangles make several fans; and, except in mode `none`, the tips of cones, which lie on
// no edge.
//
// Throws Error if an option is out of range, a given edge is not an edge of the mesh, or labels are not one per
// triangle.
BISECTOR_API FeatureGraph detect_features(const TriangleMesh& mesh, const FeatureOptions& options = {});

// Where a seed may be.
struct SeedPlace {
  enum class Kind : unsigned char {
    surface,   // anywhere on the surface
    curve,     // on one feature curve
    fixed,     // where it is
    interior,  // anywhere: the inside of a solid
  };
  Kind kind = Kind::surface;
  Index curve = kNone;   // the feature curve it lies on, if one alone
  Index corner = kNone;  // index in FeatureGraph::corners of the corner it lies at, if any
  double position = 0;   // arc length along `curve`, if there is one
};

}  // namespace bisector
