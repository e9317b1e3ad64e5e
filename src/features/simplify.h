// What is left of feature curves for a mesh that cannot show details below some width.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "core/geometry.h"

namespace bisector {

struct SimplifiedFeatures {
  FeatureGraph graph;
  std::size_t merged = 0;  // curves that another one stands for
  std::size_t let_go = 0;  // curves that nothing stands for
};

// How much a curve counts beside others: its length times the mean angle between the surface's normals on either side,
// one value per curve. `triangles` and `vertices` are the mesh that the graph is of.
std::vector<double> curve_weights(const FeatureGraph& graph, const std::vector<Triangle>& triangles,
                                  const std::vector<Vec3>& vertices);

// Leaves corners, and creases beside each other, at least `width` apart where that goes:
//   - Of corners that are nearer to each other along the curves one remains, those of many curves before turns; the
//     curves of the others are led there, along what lies between.
//   - Creases, the lighter first, go where they run within `width` of others or of themselves, though they are not led
//     there by a corner (curve_gaps): as a whole, or in stretches of at least two widths. So the two curves of a
//     chamfer become one. What is left of a curve is led to what stays along edges of the mesh.
//   - Closed creases shorter than 4 `width` go.
//   - What is left of open curves gets corners where it turns back, at acute angles between its arms of `width`; ends
//     of creases beyond such a corner that are shorter, and that no other curve meets, go.
// Curves that are not creases stay, and so do their branchings. A width of 0 changes nothing. `links` are ways from one
// corner to another that are no features: corners may be led along them, too (corner_links). `neighbours` are the
// vertices at the other ends of each vertex's edges; without them stretches stay that others would have to be led
// across.
SimplifiedFeatures simplify_features(const FeatureGraph& graph, const std::vector<Vec3>& vertices,
                                     const std::vector<double>& weights, double width,
                                     const std::vector<std::vector<Index>>& links = {},
                                     const Csr<Index>& neighbours = {});

// Edges of the mesh between two corners, and shortest ways of several no longer than `reach` over vertices that are on
// no curve, such as those between the ends of two curves that all but meet. Each from its lower corner to the higher.
std::vector<std::vector<Index>> corner_links(const FeatureGraph& graph, const std::vector<Vec3>& vertices,
                                             const Csr<Index>& neighbours, double reach);

}  // namespace bisector
