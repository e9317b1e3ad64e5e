#include "remesh/detail.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "bisector/error.h"
#include "core/degenerate.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "features/candidates.h"
#include "features/curve_network.h"
#include "features/curves.h"
#include "features/disk_radius.h"
#include "features/simplify.h"
#include "mesh/sampling.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What details may make of the edges of plain faces, in lengths without details.
constexpr double kCoarsening = 1.5;
// Edge lengths in a gap, and along a closed curve: equilateral triangles have 1.15 times their height as edges.
constexpr double kPerGap = 1.15, kPerLoop = 0.25;
// Of the mean edge length: what is never resolved, and what is let go at most.
constexpr double kFinest = 1.0 / 16, kCoarsest = 4;
// Where curves run beside each other for a short while only, edges may be shorter than the width by this.
constexpr double kBelowWidth = 0.5;
// Cells are disks if the surface is one in balls of about this radius, in edge lengths: twice what reaches a hexagon's
// corners. Where it is not, edges are so long in radii up to which it is: five or six run around a limb then.
constexpr double kDiskReach = 1.15, kPerDisk = 0.6;
// Points where that is looked at, for each vertex wanted of so many.
constexpr double kLimbSamples = 6, kMostLimbVertices = 50'000;
constexpr int kBisections = 7;
constexpr double kBudgetSpent = 0.97;         // of the vertices, at which no finer width need be looked for
constexpr std::size_t kMostPoints = 100'000;  // of the curves
// Triangles are halved until they are no longer than so many edges, for integrals.
constexpr double kPiece = 1;
constexpr int kDepth = 24;
// Vertices that a piece may take at most for its middle to stand for all of it: needles would take thousands of pieces.
constexpr double kFewVertices = 0.01;
// Vertices, in those wanted, beyond which nobody needs to know how many it would be.
constexpr double kFarTooMany = 50;
// Of the vertices wanted, what the corners of curves that stay may take at most for details to be planned.
constexpr double kMostCorners = 0.5;

class Planner {
 public:
  Planner(const TriangleMesh& mesh, const FeatureGraph& features, const std::vector<double>& edge_length,
          std::size_t vertices)
      : mesh_(mesh), features_(features), edge_length_(edge_length), vertices_(static_cast<double>(vertices)),
        weights_(curve_weights(features, mesh.triangles, mesh.vertices)),
        neighbours_(vertex_neighbours(mesh.triangles, mesh.vertices.size())) {
    double sum = 0;
    for (const double h : edge_length) sum += h;
    mean_ = sum / static_cast<double>(edge_length.size());
    links_ = corner_links(features, mesh.vertices, neighbours_, mean_);
    find_limbs();
  }

  struct Trial {
    double width = 0;
    bool resolves_short = true;  // curves that are no creases have edges as short as they are, whatever the width
    SimplifiedFeatures simplified;
    std::vector<Vec3> points;
    std::vector<double> lengths;
    double vertices = 0;  // that it takes; infinity if these are more than need be told
  };

  // `most`: more vertices need not be told from one another.
  Trial trial(double width, bool resolves_short, double coarsening, double most) const {
    Trial t;
    t.width = width;
    t.resolves_short = resolves_short;
    t.simplified = simplify_features(features_, mesh_.vertices, weights_, width, links_, neighbours_);
    find_sizes(t, coarsening);
    t.vertices = count(t, coarsening, most);
    return t;
  }

  // What resolves all details.
  Trial finest(double coarsening) const { return trial(kFinest * mean_, true, coarsening, kFarTooMany * vertices_); }

  // The least width that there are vertices for. `all` is what resolves all details.
  Trial within_budget(Trial all) const {
    if (all.vertices <= vertices_) return all;
    double fine = kFinest * mean_, coarse = kCoarsest * mean_;
    const auto attempt = [&](double width, bool resolves_short) {
      return trial(width, resolves_short, kCoarsening, vertices_);
    };
    Trial best = attempt(coarse, true);
    const bool resolves_short = best.vertices <= vertices_;
    if (!resolves_short) {
      best = attempt(fine, false);
      if (best.vertices <= vertices_) return best;
      best = attempt(coarse, false);
    }
    const auto spends_all = [&] { return best.vertices > kBudgetSpent * vertices_ && best.vertices <= vertices_; };
    for (int k = 0; k < kBisections && !spends_all(); ++k) {
      const double middle = std::sqrt(fine * coarse);
      Trial t = attempt(middle, resolves_short);
      if (t.vertices <= vertices_) {
        coarse = middle;
        best = std::move(t);
      } else {
        fine = middle;
      }
    }
    return best;
  }

 private:
  // Where the surface is no disk as far as the edges around a vertex reach, edges are to be shorter.
  void find_limbs() {
    const std::vector<SurfaceSample> samples =
        sample_surface(mesh_, static_cast<std::size_t>(kLimbSamples * std::min(vertices_, kMostLimbVertices)), 1);
    std::vector<double> plain, radii;
    for (const SurfaceSample& sample : samples) {
      double h = 0;
      for (const Index v : mesh_.triangles[sample.triangle]) h += edge_length_[v] / 3;
      plain.push_back(h);
      radii.push_back(kDiskReach * h);
    }
    const std::vector<double> disks = disk_radii(mesh_, samples, radii, kFinest);
    for (std::size_t k = 0; k < samples.size(); ++k)
      if (disks[k] < radii[k]) limbs_.push_back({samples[k].point, kPerDisk * disks[k], plain[k]});
  }

  // The edge length without details, at the nearest vertex of a curve.
  double length_at(const FeatureCurves& curves, Index curve, double position) const {
    return edge_length_[curves.graph().curves[curve].vertices[curves.segment_at(curve, position)]];
  }

  // Marks the points of a network that are on curves that are no creases.
  static std::vector<char> on_curves_that_stay(const FeatureCurves& curves, const CurveNetwork& network) {
    std::vector<char> marks(network.points().size(), 0);
    for (std::size_t p = curves.graph().corners.size(); p < marks.size(); ++p)
      marks[p] = !is_crease(curves.graph().curves[network.curve(static_cast<Index>(p))]);
    for (Index c = 0; c < curves.size(); ++c)
      for (const Index end : curves.ends(c))
        if (end != kNone && !is_crease(curves.graph().curves[c])) marks[end] = 1;
    return marks;
  }

  void find_sizes(Trial& t, double coarsening) const {
    const FeatureCurves curves(t.simplified.graph, mesh_.vertices);
    double total = 0;
    for (Index c = 0; c < curves.size(); ++c) total += curves.length(c);
    const double spacing = std::max(0.5 * t.width, total / static_cast<double>(kMostPoints));
    const CurveNetwork network(curves, spacing);
    const std::size_t corners = curves.graph().corners.size();
    std::vector<double> plain(network.points().size(), kInfinity), bound(network.points().size(), kInfinity);
    for (Index p = 0; p < corners; ++p) plain[p] = coarsening * edge_length_[curves.graph().corners[p]];
    for (auto p = static_cast<Index>(corners); p < plain.size(); ++p) {
      const Index c = network.curve(p);
      plain[p] = coarsening * length_at(curves, c, network.position(p));
      bound[p] = curves.closed(c) ? kPerLoop * curves.length(c) : curves.length(c);
    }
    for (Index c = 0; c < curves.size(); ++c)
      for (const Index end : curves.ends(c))
        if (end != kNone) bound[end] = std::min(bound[end], curves.length(c));
    std::vector<double> reach(plain.size());
    for (std::size_t p = 0; p < reach.size(); ++p) reach[p] = plain[p] / kPerGap;
    std::vector<double> gaps = curve_gaps(network, reach);
    const std::vector<char> stays = on_curves_that_stay(curves, network);
    for (std::size_t p = 0; p < plain.size(); ++p) {
      // Curves that are no creases stay however near to each other they are. Where the shortest edges to be had are
      // still too long for the gap, they would leave slivers in it all the same.
      if (stays[p] && kPerGap * gaps[p] < kBelowWidth * t.width) gaps[p] = kInfinity;
      double length = std::max(std::min(bound[p], kPerGap * gaps[p]), kBelowWidth * t.width);
      if (stays[p] && t.resolves_short) length = std::min(length, bound[p]);
      if (length >= plain[p]) continue;
      t.points.push_back(network.points()[p]);
      t.lengths.push_back(length);
    }
    for (const Limb& limb : limbs_) {
      const double length = std::max(limb.length, kBelowWidth * t.width);
      if (length >= coarsening * limb.plain) continue;
      t.points.push_back(limb.point);
      t.lengths.push_back(length);
    }
  }

  // The vertices of equilateral triangles of the lengths wanted, as in estimate_mesh; infinity if they are more than
  // `most`.
  double count(const Trial& t, double coarsening, double most) const {
    std::optional<SizeField> field;
    if (!t.points.empty()) field.emplace(t.points, t.lengths, kDetailGradation);
    double shortest = kInfinity;
    for (const double length : t.lengths) shortest = std::min(shortest, length);
    for (const double length : edge_length_) shortest = std::min(shortest, coarsening * length);
    constexpr std::size_t kChunk = 256;
    std::vector<double> sums((mesh_.triangles.size() + kChunk - 1) / kChunk, 0);
    // All chunks end once they have too many together: whether they do does not depend on who is first.
    constexpr double kParts = 1024;  // of a vertex, counted down to
    const double enough = kParts * (most + 1);
    std::atomic<std::uint64_t> parts{0};
    parallel_chunks(mesh_.triangles.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      Counter counter{field, shortest, most};
      for (std::size_t k = begin; k < end; ++k) {
        const Triangle& v = mesh_.triangles[k];
        const double plain = coarsening * (edge_length_[v[0]] + edge_length_[v[1]] + edge_length_[v[2]]) / 3;
        const double before = counter.sum;
        counter.add({mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]}, plain);
        const auto more = static_cast<std::uint64_t>(kParts * std::min(counter.sum - before, most + 1));
        if (static_cast<double>(parts.fetch_add(more, std::memory_order_relaxed) + more) > enough) {
          counter.sum = kInfinity;
          break;
        }
      }
      sums[chunk] = counter.sum;
    });
    double sum = 0;
    for (const double s : sums) sum += s;
    return sum <= most ? sum : kInfinity;
  }

  // Sums up vertices over pieces of triangles in which the lengths wanted change little.
  struct Counter {
    const std::optional<SizeField>& field;
    double shortest;  // length wanted
    double most;
    double sum = 0;
    Index near = 0;

    void add(const std::array<Vec3, 3>& p, double plain, int depth = 0) {
      if (sum > most) return;
      const std::array<double, 3> squares{norm2(p[2] - p[1]), norm2(p[0] - p[2]), norm2(p[1] - p[0])};
      const auto opposite =
          static_cast<std::size_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
      const double longest = std::sqrt(squares[opposite]), plain_all_over = plain + kDetailGradation * longest;
      const Vec3 middle = (1.0 / 3) * (p[0] + p[1] + p[2]);
      const double bound = field ? field->at_most(middle, plain_all_over, near) : kInfinity;
      const double h = std::min(plain, bound);
      const double share = 2 / std::sqrt(3.0) * triangle_area(p[0], p[1], p[2]),
                   least = std::max(h - kDetailGradation * longest, shortest);
      if (depth < kDepth && longest > kPiece * h && bound < plain_all_over && share > kFewVertices * least * least) {
        const Vec3 &a = p[opposite], &b = p[(opposite + 1) % 3], &c = p[(opposite + 2) % 3], m = 0.5 * (b + c);
        add({a, b, m}, plain, depth + 1);
        add({a, m, c}, plain, depth + 1);
        return;
      }
      sum += share / (h * h);
    }
  };

  struct Limb {
    Vec3 point;
    double length, plain;  // of edges there: what it takes, and what they are without details
  };

  const TriangleMesh& mesh_;
  const FeatureGraph& features_;
  const std::vector<double>& edge_length_;
  double vertices_;
  double mean_ = 0;
  std::vector<double> weights_;
  std::vector<std::vector<Index>> links_;
  Csr<Index> neighbours_;
  std::vector<Limb> limbs_;
};

// The corners of curves that are no creases. Each takes a vertex, whatever the width.
std::size_t corners_that_stay(const FeatureGraph& features) {
  std::vector<Index> corners;
  for (const FeatureCurve& curve : features.curves)
    if (!curve.closed && !is_crease(curve))
      corners.insert(corners.end(), {curve.vertices.front(), curve.vertices.back()});
  std::sort(corners.begin(), corners.end());
  return static_cast<std::size_t>(std::unique(corners.begin(), corners.end()) - corners.begin());
}

}  // namespace

DetailPlan plan_details(const TriangleMesh& mesh, const FeatureGraph& features, const std::vector<double>& edge_length,
                        std::size_t vertices, bool all) {
  DetailPlan plan;
  // Corners of a soup, where all facets meet others in their edges, leave no vertices for details, and looking for
  // gaps between so many curves would take longer than the run.
  if (!all && static_cast<double>(corners_that_stay(features)) > kMostCorners * static_cast<double>(vertices)) {
    plan.features = features;
    return plan;
  }
  const Planner planner(mesh, features, edge_length, vertices);
  Planner::Trial best = planner.finest(all ? 1 : kCoarsening);
  const double needed = best.vertices;
  if (!all) best = planner.within_budget(std::move(best));
  else if (std::isinf(needed))
    throw Error(
        fmt::format("all details take more than {:.0f} times the vertices asked for; ask for more of them, or "
                    "let finer details go",
                    kFarTooMany));
  plan.features = std::move(best.simplified.graph);
  plan.points = std::move(best.points);
  plan.lengths = std::move(best.lengths);
  plan.result.merged = best.simplified.merged;
  plan.result.let_go = best.simplified.let_go;
  if (plan.result.merged + plan.result.let_go > 0) plan.result.width = best.width;
  if (std::isfinite(needed)) plan.result.vertices = static_cast<std::size_t>(needed);
  return plan;
}

}  // namespace bisector
