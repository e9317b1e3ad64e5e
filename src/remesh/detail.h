// A budget for detail: which features a mesh of so many vertices can show with good triangles, and how small these must
// be beside them.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/remesh.h"
#include "features/size_field.h"

namespace bisector {

struct DetailPlan {
  FeatureGraph features;  // what is left of the input's
  // Edges at these points should not be longer than these lengths, in the mesh's unit; empty if none are shorter than
  // the edges are anyway.
  std::vector<Vec3> points;
  std::vector<double> lengths;
  DetailResult result;
};

// Edge lengths grow away from details by at most this per length.
inline constexpr double kDetailGradation = 0.35;

// A strip between two curves of the length l at a distance w takes about 2 l / w vertices at good angles, and more
// where sizes grow from there to those of the plain faces. The least width is looked for from which on all details can
// be resolved with so many vertices, if the plain faces' edges become at most half as long again as in a mesh without
// details; details below it are merged or let go (features/simplify.h). Details are the gaps between curves
// (curve_gaps), the lengths of curves, quarters of the lengths of closed ones, and limbs that the edges could not run
// around (features/disk_radius.h). Curves that are no creases stay; gaps between them that are too narrow for the edges
// bound nothing, and short ones get edges as short as they are, whatever the width, unless the coarsest details do not
// fit beside them: edges that grow from one take some forty vertices for each doubling of their length. Where the
// corners of these curves alone are more than half of `vertices`, nothing is planned: all features stay.
// `edge_length` is the length aimed at without details, one value per vertex.
// With `all` everything is resolved that is not finer than a sixteenth of the mean edge length, and those short curves;
// throws Error where that takes far more vertices than there are.
DetailPlan plan_details(const TriangleMesh& mesh, const FeatureGraph& features, const std::vector<double>& edge_length,
                        std::size_t vertices, bool all);

}  // namespace bisector
