// A coarse mesh of polygons from the planar regions of a segmentation (Cohen-Steiner, Alliez and Desbrun 2004,
// "Variational shape approximation", ACM TOG 23(3), section 4).
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/export.h"
#include "bisector/mesh.h"
#include "bisector/segment.h"

namespace bisector {

struct PolygoniseOptions {
  // A border is divided where it strays from a chord by more than this share of the chord's length, the distance times
  // the sine of the angle between the two planes; above 0.
  double chord = 0.2;
};

struct PolygonisedMesh {
  std::vector<Vec3> vertices;
  Csr<Index> polygons;        // simple, oriented as the input
  std::vector<Index> labels;  // region of each polygon
  // The polygons divided into triangles, which are labelled by region. Further vertices follow those of the polygons
  // where two triangles would have had the same edge otherwise.
  TriangleMesh triangulated;
  std::size_t divided = 0;  // planar regions of several polygons: those with holes
  std::size_t folded = 0;   // planar regions that do not lie flat on their plane with their corners: left as triangles
  std::size_t self_intersections = 0;  // of `triangulated`, as count_self_intersections says
};

// Vertices are where three or more regions meet, or two and the border of the mesh, where borders stray from the chords
// between these, and as many more as it takes for edges to be edges of two polygons; each is placed nearest to the
// planes that meet there. Each planar region becomes a polygon, or several where it has holes or touches itself;
// regions of other surfaces keep their triangles. The result is a manifold where the input is, with the input's Euler
// characteristic and components; where polygons cross, their vertices go back towards the mesh, and some may still
// cross. Throws Error for options out of range and labels that are not those of the mesh.
BISECTOR_API PolygonisedMesh polygonise(const TriangleMesh& mesh, const SegmentResult& segmentation,
                                        const PolygoniseOptions& options = {});

}  // namespace bisector
