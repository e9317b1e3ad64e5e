// Nearest points by nanoflann's kd-tree.
#pragma once

#include <cstddef>
#include <nanoflann.hpp>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct PointSet {
  const std::vector<Vec3>& points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(Index i, std::size_t axis) const { return points[i][static_cast<int>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointSet, double>, PointSet, 3, Index>;

}  // namespace bisector
