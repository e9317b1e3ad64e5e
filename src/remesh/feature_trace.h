// Which restricted cells a feature curve runs through, in order, read off the labels of the diagram.
#pragma once

#include <vector>

#include "features/curves.h"
#include "voronoi/restricted.h"
#include "voronoi/surface.h"

namespace bisector {

struct CurveInterval {
  Index cell;
  double from, to;  // arc length
};

class FeatureTrace {
 public:
  // The curves are those of the surface's mesh; both must outlive the object.
  FeatureTrace(const Surface& surface, const FeatureCurves& curves);

  // The intervals of each curve from its start to its end. Consecutive ones are of different cells, except that those
  // of a closed curve may begin and end in the same.
  std::vector<std::vector<CurveInterval>> trace(const RestrictedPolygons& polygons) const;

  // Triangles that meet at each edge of the curve: 1 at a border, 2 at a crease, more where the mesh is not manifold.
  Index sheets(Index curve) const { return sheets_[curve]; }

 private:
  struct Segment {
    Index triangle = kNone;  // one that has the segment as its edge; kNone if all of them are without area
    unsigned char edge = 0;
    bool reversed = false;  // the curve runs against the triangle's orientation
  };
  const FeatureCurves& curves_;
  std::vector<std::vector<Segment>> segments_;
  std::vector<Index> sheets_;
};

}  // namespace bisector
