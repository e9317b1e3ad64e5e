#include "features/wedges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/geometry.h"
#include "features/curves.h"
#include "mesh/edge_splitter.h"
#include "mesh/half_edges.h"
#include "spatial/kd_tree.h"

namespace bisector {
namespace {

// Gaps that are linked, in edge lengths.
constexpr double kGaps[] = {1.0 / 16, 1.0 / 8, 1.0 / 4, 1.0 / 2, 1};
// A wedge has a gap farther from its corner than so many times the gap: it is narrower than about 30 degrees. Those of
// less than a degree are curves beside each other.
constexpr double kNarrow = 2, kNarrowest = 60;
// So far from the corner, in edge lengths, the gap of a wedge that is linked is less than this part of the way. Seeds
// on wider ones stand at the same distances from the corner instead (remesh/feature_recovery), and only the tip keeps
// its angle.
constexpr double kTip = 1.0 / 8, kAcute = 0.2;
// Corners nearer to each other than this, in edge lengths, are taken for one.
constexpr double kSameCorner = 0.25;
// Steps along a curve, in gaps.
constexpr double kStep = 0.25;
// Vertices that are there are taken as near as this to where one is wanted: in gaps across the wedge, along it in ways
// from the corner.
constexpr double kNear = 0.3;
constexpr int kMostSteps = 100;  // across triangles

// A curve at one of its ends.
struct Arm {
  Index curve;
  int end;
};

class WedgeLinker {
 public:
  WedgeLinker(TriangleMesh& mesh, const FeatureGraph& features, const std::vector<double>& edge_length)
      : mesh_(mesh), curves_(features, mesh.vertices), edge_length_(edge_length) {}

  std::vector<EdgePoint> run() {
    const std::vector<Index>& corners = curves_.graph().corners;
    std::vector<std::vector<Arm>> arms(corners.size());
    for (Index c = 0; c < curves_.size(); ++c)
      for (const int end : {0, 1})
        if (!curves_.closed(c)) arms[curves_.ends(c)[end]].push_back({c, end});
    std::vector<Vec3> points;
    for (Index k = 0; k < corners.size(); ++k) points.push_back(curves_.corner(k));
    const PointSet set{points};
    const KdTree tree(3, set);
    std::vector<std::pair<Index, double>> near;
    for (Index k = 0; k < corners.size(); ++k) {
      const double query[3] = {points[k].x, points[k].y, points[k].z}, reach = kSameCorner * edge_length_[corners[k]];
      tree.radiusSearch(query, reach * reach, near, nanoflann::SearchParams(32, 0, true));
      for (const Arm& from : arms[k])
        for (const auto& [other, squared] : near)
          for (const Arm& to : arms[other])
            if (from.curve != to.curve && (is_crease(from) || is_crease(to)) && is_acute(from, to))
              for (const double gap : kGaps) link(from, to, gap);
    }
    return std::move(added_);
  }

 private:
  bool is_crease(const Arm& arm) const { return curves_.graph().curves[arm.curve].kind == FeatureKind::crease; }

  Index corner_of(const Arm& arm) const { return curves_.graph().corners[curves_.ends(arm.curve)[arm.end]]; }
  double position(const Arm& arm, double way) const { return arm.end == 0 ? way : curves_.length(arm.curve) - way; }

  // The point of an arm that is nearest to a point so far along another.
  double nearest(const Arm& arm, const Vec3& p, double way) const {
    const double reach = std::min(way + kSameCorner * edge_length_[corner_of(arm)], curves_.length(arm.curve));
    return curves_.nearest(arm.curve, p, position(arm, reach), reach);
  }

  double gap_at(const Arm& from, const Arm& to, double way) const {
    const Vec3 p = curves_.point(from.curve, position(from, way));
    return norm(curves_.point(to.curve, nearest(to, p, way)) - p);
  }

  bool is_acute(const Arm& from, const Arm& to) const {
    const double tip = kTip * edge_length_[corner_of(from)];
    return gap_at(from, to, tip) < kAcute * tip;
  }

  void link(const Arm& from, const Arm& to, double gap_in_edges) {
    const Index corner = corner_of(from);
    const double gap = gap_in_edges * edge_length_[corner], length = curves_.length(from.curve);
    const double most = std::min(length, kNarrowest * gap);
    if (kNarrow * gap >= most || gap_at(from, to, kNarrow * gap) >= gap) return;
    double way = kNarrow * gap;
    while (way < most && gap_at(from, to, way) < gap) way += kStep * gap;
    if (way >= most) return;
    begin();
    const double at = position(from, way);
    const Vec3 target = curves_.point(to.curve, nearest(to, curves_.point(from.curve, at), way));
    const Index start = vertex_at(from.curve, at, kNear * way);
    if (start != corner) walk(start, corner, from.curve, to.curve, target, gap);
  }

  // What is only needed if there is a wedge.
  void begin() {
    if (splitter_) return;
    splitter_.emplace(mesh_);
    for (Index c = 0; c < curves_.size(); ++c) {
      const std::vector<Index>& chain = curves_.graph().curves[c].vertices;
      for (std::size_t k = 0; k + (curves_.closed(c) ? 0 : 1) < chain.size(); ++k)
        curve_of_[ascending(chain[k], chain[(k + 1) % chain.size()])] = c;
    }
  }

  // The vertex of a curve at a position, or within `near` of it; there is one afterwards.
  Index vertex_at(Index curve, double at, double near) {
    const std::vector<Index>& chain = curves_.graph().curves[curve].vertices;
    const std::size_t k = curves_.segment_at(curve, at);
    Index a = chain[k], b = chain[(k + 1) % chain.size()];
    const Vec3 p = curves_.point(curve, at), along = curves_.tangent(curve, at);
    for (auto part = part_.find(ascending(a, b)); part != part_.end(); part = part_.find(ascending(a, b)))
      (dot(p - mesh_.vertices[part->second], along) > 0 ? a : b) = part->second;
    const double to_a = norm(p - mesh_.vertices[a]), to_b = norm(p - mesh_.vertices[b]);
    if (std::min(to_a, to_b) <= near) return to_a < to_b ? a : b;
    return split(a, b, to_a / (to_a + to_b));
  }

  Index split(Index a, Index b, double t) {
    const Index middle = splitter_->split(a, b, t);
    added_.push_back({a, b, t});
    part_[ascending(a, b)] = middle;
    if (const auto on = curve_of_.find(ascending(a, b)); on != curve_of_.end()) {
      const Index curve = on->second;
      curve_of_[ascending(a, middle)] = curve_of_[ascending(middle, b)] = curve;
    }
    return middle;
  }

  bool is_on(Index vertex, Index curve) const {
    for (const Index t : splitter_->triangles_at(vertex))
      for (const Index other : mesh_.triangles[t])
        if (const auto on = curve_of_.find(ascending(vertex, other)); on != curve_of_.end() && on->second == curve)
          return true;
    return false;
  }

  // Straight across triangles to the other curve, or to one in between. Ends where the surface leads elsewhere.
  void walk(Index start, Index corner, Index from, Index to, const Vec3& target, double gap) {
    const Vec3 origin = mesh_.vertices[start], across = target - origin, back = origin - mesh_.vertices[corner];
    if (norm2(across) == 0) return;
    // Perpendicular to the way, in the plane of the wedge.
    const Vec3 aside = unit(back - (dot(back, across) / norm2(across)) * across);
    const auto side = [&](Index v) { return dot(mesh_.vertices[v] - origin, aside); };
    const auto progress = [&](const Vec3& p) { return dot(p - origin, across) / norm2(across); };
    Index at = start;
    for (int step = 0; step < kMostSteps; ++step) {
      if (at != start && is_on(at, to)) return;
      // The crossing of an opposite edge that lies nearest to the straight way.
      Index a = kNone, b = kNone;
      double best = gap, best_t = 0;
      for (const Index t : splitter_->triangles_at(at)) {
        const Triangle& corners = mesh_.triangles[t];
        const std::size_t k = corners[0] == at ? 0 : corners[1] == at ? 1 : 2;
        const Index u = corners[(k + 1) % 3], v = corners[(k + 2) % 3];
        const double su = side(u), sv = side(v);
        if ((su > 0) == (sv > 0)) continue;
        const double s = su / (su - sv);
        const Vec3 p = mesh_.vertices[u] + s * (mesh_.vertices[v] - mesh_.vertices[u]);
        if (progress(p) <= progress(mesh_.vertices[at])) continue;
        const double off = norm(p - origin - progress(p) * across);
        if (off >= best) continue;
        best = off;
        a = u;
        b = v;
        best_t = s;
      }
      if (a == kNone) return;
      const auto on = curve_of_.find(ascending(a, b));
      if (on != curve_of_.end() && on->second == from) return;
      const double length = norm(mesh_.vertices[b] - mesh_.vertices[a]), near = kNear * gap;
      if (std::min(best_t, 1 - best_t) * length <= near) at = best_t < 0.5 ? a : b;
      else at = split(a, b, best_t);
      if (at == corner || is_on(at, from)) return;
      if (on != curve_of_.end()) return;
    }
  }

  TriangleMesh& mesh_;
  const FeatureCurves curves_;  // as they were, which they are geometrically
  const std::vector<double>& edge_length_;
  std::optional<EdgeSplitter> splitter_;
  std::map<std::array<Index, 2>, Index> curve_of_;  // of edges along curves
  std::map<std::array<Index, 2>, Index> part_;      // the vertex that was put on an edge
  std::vector<EdgePoint> added_;
};

}  // namespace

std::vector<EdgePoint> link_wedges(TriangleMesh& mesh, const FeatureGraph& features,
                                   const std::vector<double>& edge_length) {
  return WedgeLinker(mesh, features, edge_length).run();
}

EdgeSplits splits_of(const std::vector<EdgePoint>& points, std::size_t first) {
  EdgeSplits splits;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto [low, high] = ascending(points[k].a, points[k].b);
    splits.push_back({low, high, static_cast<Index>(first + k)});
  }
  std::sort(splits.begin(), splits.end());
  return splits;
}

}  // namespace bisector
