#include "remesh/feature_trace.h"

#include <algorithm>
#include <map>

#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

struct Piece {
  Index cell;
  Index before, after;  // labels of the edges before and after the piece, counter-clockwise
  Vec3 from, to;
};

}  // namespace

FeatureTrace::FeatureTrace(const Surface& surface, const FeatureCurves& curves) : curves_(curves) {
  std::map<std::array<Index, 2>, std::array<Index, 3>>
      half_edges;  // of a feature edge: a triangle, edge number, triangles
  for (const std::array<Index, 2>& edge : curves.graph().edges) half_edges[edge] = {kNone, 0, 0};
  for (Index t = 0; t < surface.mesh.triangles.size(); ++t) {
    if (surface.facet_of[t] == kNone) continue;
    const Triangle& v = surface.mesh.triangles[t];
    for (Index k = 0; k < 3; ++k) {
      const auto found = half_edges.find({std::min(v[k], v[(k + 1) % 3]), std::max(v[k], v[(k + 1) % 3])});
      if (found == half_edges.end()) continue;
      if (found->second[0] == kNone) found->second = {t, k, 0};
      ++found->second[2];
    }
  }
  for (const FeatureCurve& curve : curves.graph().curves) {
    std::vector<Segment> segments;
    Index sheets = 0;
    const std::size_t count = curve.vertices.size() - (curve.closed ? 0 : 1);
    for (std::size_t k = 0; k < count; ++k) {
      const Index a = curve.vertices[k], b = curve.vertices[(k + 1) % curve.vertices.size()];
      const auto [triangle, edge, triangles] = half_edges.at({std::min(a, b), std::max(a, b)});
      if (sheets == 0) sheets = triangles;
      segments.push_back({triangle, static_cast<unsigned char>(edge),
                          triangle != kNone && surface.mesh.triangles[triangle][edge] != a});
    }
    segments_.push_back(std::move(segments));
    sheets_.push_back(sheets);
  }
}

std::vector<std::vector<CurveInterval>> FeatureTrace::trace(const RestrictedPolygons& polygons) const {
  std::vector<std::vector<CurveInterval>> result(segments_.size());
  const auto& pairs = polygons.pairs;
  parallel_each(
      segments_.size(),
      [&](std::size_t c) {
        const Index curve = static_cast<Index>(c);
        std::vector<CurveInterval>& intervals = result[c];
        std::vector<Piece> pieces;
        for (std::size_t s = 0; s < segments_[c].size(); ++s) {
          const Segment& segment = segments_[c][s];
          if (segment.triangle == kNone) continue;
          const Index label = kEdgeLabel | segment.edge;
          pieces.clear();
          auto pair = std::lower_bound(pairs.begin(), pairs.end(), segment.triangle,
                                       [](const RestrictedPolygons::Pair& p, Index t) { return p.triangle < t; });
          for (; pair != pairs.end() && pair->triangle == segment.triangle; ++pair) {
            const std::size_t k = static_cast<std::size_t>(pair - pairs.begin());
            const std::size_t first = polygons.offsets[k], size = polygons.offsets[k + 1] - first;
            for (std::size_t e = 0; e < size; ++e) {
              if (polygons.labels[first + e] != label) continue;
              const std::size_t next = first + (e + 1) % size;
              pieces.push_back({pair->cell, polygons.labels[first + (e + size - 1) % size], polygons.labels[next],
                                polygons.vertices[first + e], polygons.vertices[next]});
            }
          }
          // The pieces in order: each names the cell that follows it.
          const std::size_t begin = intervals.size();
          const Vec3 a = curves_.point_of(curve, s), b = curves_.point_of(curve, s + 1);
          const double length2 = norm2(b - a), start = curves_.position_of(curve, s),
                       end = curves_.position_of(curve, s + 1);
          const auto position = [&](const Vec3& p) {
            const double t = length2 > 0 ? std::clamp(dot(p - a, b - a) / length2, 0.0, 1.0) : 0;
            return start + t * (end - start);
          };
          auto piece = std::find_if(pieces.begin(), pieces.end(), [](const Piece& p) { return is_edge(p.before); });
          for (std::size_t count = 0; piece != pieces.end() && count < pieces.size(); ++count) {
            const double from = position(piece->from), to = position(piece->to);
            intervals.push_back({piece->cell, std::min(from, to), std::max(from, to)});
            const Index after = piece->after;
            piece = is_edge(after)
                        ? pieces.end()
                        : std::find_if(pieces.begin(), pieces.end(), [&](const Piece& p) { return p.cell == after; });
          }
          if (segment.reversed) std::reverse(intervals.begin() + static_cast<std::ptrdiff_t>(begin), intervals.end());
        }
        // One interval for each visit of a cell, over all segments.
        std::size_t kept = 0;
        for (const CurveInterval& interval : intervals) {
          if (kept && intervals[kept - 1].cell == interval.cell)
            intervals[kept - 1].to = std::max(intervals[kept - 1].to, interval.to);
          else intervals[kept++] = interval;
        }
        intervals.resize(kept);
      },
      1);
  return result;
}

}  // namespace bisector
