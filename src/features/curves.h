// Feature curves as places for seeds: points by arc length, tangents, nearest points (thesis 4.4.3, equation 4.8).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "core/geometry.h"

namespace bisector {

// The edges along curves, each once, as FeatureGraph::edges has them.
std::vector<std::array<Index, 2>> edges_of(const std::vector<FeatureCurve>& curves);

// A straight piece of a curve, with all that places on it are computed from. Quotients by lengths are products with
// reciprocals, as devices compute them.
struct CurveSegment {
  Vec3 from, to, along;  // along = to - from
  Vec3 tangent;          // of unit length
  double start, end;     // arc length of the curve at both ends
  double per_length;     // 1 / (end - start)
  double per_square;     // 1 / |along|^2
};

class FeatureCurves {
 public:
  FeatureCurves() = default;
  FeatureCurves(const FeatureGraph& graph, const std::vector<Vec3>& vertices);

  const FeatureGraph& graph() const { return graph_; }
  std::size_t size() const { return graph_.curves.size(); }
  double length(Index curve) const { return segments_[first_[curve + 1] - 1].end; }
  bool closed(Index curve) const { return graph_.curves[curve].closed; }
  // Arc length of vertex k of the curve; k = number of segments gives the length.
  double position_of(Index curve, std::size_t k) const { return k == 0 ? 0 : segments_[first_[curve] + k - 1].end; }
  // Number of segments.
  std::size_t segments(Index curve) const { return first_[curve + 1] - first_[curve]; }
  // Those of all curves one after the other, and where each curve's begin; after them, where the last one's end.
  const std::vector<CurveSegment>& all_segments() const { return segments_; }
  const std::vector<Index>& first_segments() const { return first_; }
  // Positions beyond an end are taken around a closed curve, and to the end of an open one.
  double wrap(Index curve, double position) const;
  std::size_t segment_at(Index curve, double position) const;
  Vec3 point(Index curve, double position) const;
  Vec3 tangent(Index curve, double position) const;  // unit length, of the segment there
  // Ends of segment k.
  const Vec3& point_of(Index curve, std::size_t k) const {
    return k == 0 ? segments_[first_[curve]].from : segments_[first_[curve] + k - 1].to;
  }
  Vec3 corner(Index corner) const { return corners_[corner]; }
  // The corners at the start and the end of an open curve; kNone of a closed one.
  std::array<Index, 2> ends(Index curve) const { return ends_[curve]; }
  // The position, no farther than `reach` along the curve from `from`, of the point nearest to p.
  double nearest(Index curve, const Vec3& p, double from, double reach) const;

 private:
  FeatureGraph graph_;
  std::vector<CurveSegment> segments_;
  std::vector<Index> first_{0};
  std::vector<Vec3> corners_;
  std::vector<std::array<Index, 2>> ends_;
};

}  // namespace bisector
