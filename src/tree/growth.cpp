#include "tree/growth.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <tuple>

#include "spatial/kd_tree.h"
#include "tree/near_axis.h"
#include "tree/point_graph.h"
#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr std::size_t kCheckEvery = 1024;  // points between two checks for cancellation
constexpr std::size_t kLeastGain = 2;      // points that a branch explains
constexpr double kGap = 3;                 // steps longer than so many tolerances, or median steps, cross a gap
constexpr double kLeaf = 2;                // what a step to a leaf costs, in that of a step to wood
constexpr double kTurn = 2;                // what a step across a gap costs more at a right angle, in its own cost
constexpr double kMostGaps = 0.5;          // of a branch's length
constexpr double kLeastLength = 2;         // of it, in tolerances
constexpr double kSimilar = 0.8;           // of the longest way's length: among ways so long the straightest goes on
constexpr double kDirection = 4;           // length that tells the direction of a way, in tolerances
constexpr double kStep = 1;                // between points of an axis, in tolerances
constexpr double kStiffness = 2;           // of an axis' second differences, beside the pull of the points on the way

double squared(double x) { return x * x; }

// The tree of shortest ways.
struct Ways {
  std::vector<Index> previous;  // of each point; a source's is itself
  std::vector<Index> order;     // points, sources first
  std::vector<double> beyond;   // length of the longest way on from each point
  std::vector<Index> next;      // point on it; kNone at ends
};

class Growth {
 public:
  Growth(const std::vector<Vec3>& points, const GrowthOptions& options, std::vector<Limb>& limbs,
         std::vector<Index>& limb_of)
      : points_(points), options_(options), tolerance_(options.tolerance), limbs_(limbs),
        limb_of_(limb_of), set_{points}, tree_(3, set_) {}

  void find_ways(const Context& context) {
    const Csr<Index> graph = ways_graph(points_);
    context.check();
    std::vector<double> shortest(points_.size(), std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < graph.rows(); ++i)
      for (const Index* j = graph.begin(i); j != graph.end(i); ++j)
        shortest[i] = std::min(shortest[i], norm(points_[*j] - points_[i]));
    gap_ = kGap * std::max(tolerance_, quantile(std::move(shortest), 0.5));
    walk(graph, find_sources(), context);
    choose_next();
  }

  // The branches, longest first.
  void grow(const Context& context) {
    std::vector<std::pair<double, Index>> starts;  // length, first point beyond the fork
    for (const Index i : ways_.order) {
      const Index from = ways_.previous[i];
      if (from == i || ways_.next[from] == i || !leads_to_wood(i)) continue;
      starts.emplace_back(ways_.beyond[i] + norm(points_[i] - points_[from]), i);
    }
    for (const Index i : ways_.order)  // the first of the ways that leave a source
      if (ways_.previous[i] == i && ways_.next[i] != kNone) starts.emplace_back(ways_.beyond[i], ways_.next[i]);
    std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    on_limb_ = limb_of_;
    for (std::size_t k = 0; k < starts.size(); ++k) {
      if (k % kCheckEvery == 0) context.check();
      if (starts[k].first < kLeastLength * tolerance_) break;
      try_branch(starts[k].second);
    }
  }

 private:
  std::vector<Index> find_sources() const {
    std::vector<Index> sources;
    std::map<Index, Index> lowest;  // point of each group without a limb; kNone: it has one
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const auto i = static_cast<Index>(k);
      const Index group = group_of(i);
      if (group == kNone) continue;
      Index& low = lowest.try_emplace(group, i).first->second;
      if (limb_of_[i] != kNone) {
        sources.push_back(i);
        low = kNone;
      } else if (low != kNone && points_[i].z < points_[low].z) {
        low = i;
      }
    }
    for (const auto& [group, low] : lowest)
      if (low != kNone) sources.push_back(low);
    return sources;
  }

  // Dijkstra's algorithm, where a step across a gap costs more the more it turns off the way that leads to it.
  void walk(const Csr<Index>& graph, const std::vector<Index>& sources, const Context& context) {
    using Entry = std::tuple<double, Index, Index>;  // cost, point, the one before
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (const Index s : sources) queue.emplace(0.0, s, s);
    ways_.previous.assign(points_.size(), kNone);
    while (!queue.empty()) {
      const auto [cost, i, from] = queue.top();
      queue.pop();
      if (ways_.previous[i] != kNone) continue;
      ways_.previous[i] = from;
      ways_.order.push_back(i);
      if (ways_.order.size() % kCheckEvery == 0) context.check();
      const Vec3 direction = direction_at(i);
      for (const Index* j = graph.begin(i); j != graph.end(i); ++j) {
        if (ways_.previous[*j] != kNone || group_of(*j) != group_of(i)) continue;
        const Vec3 step = points_[*j] - points_[i];
        const double length = norm(step);
        const double turn = length > gap_ ? kTurn * (1 - dot(direction, step) / length) : 0;
        queue.emplace(cost + length * length * (1 + turn) * (is_wood(*j) ? 1 : kLeaf), *j, i);
      }
    }
  }

  // Of the limb that a point lies on, or of the way that leads to it.
  Vec3 direction_at(Index i) const {
    if (limb_of_[i] != kNone) {
      const std::vector<Vec3>& axis = limbs_[limb_of_[i]].axis;
      const std::size_t k = nearest_on_polyline(axis, points_[i]).segment;
      return unit(axis[k + 1] - axis[k]);
    }
    const Vec3 way = points_[i] - points_[far_back(i)];
    return norm2(way) > 0 ? unit(way) : Vec3{};
  }

  void choose_next() {
    const std::size_t n = points_.size();
    ways_.beyond.assign(n, 0);
    ways_.next.assign(n, kNone);
    for (std::size_t k = ways_.order.size(); k-- > 0;) {
      const Index i = ways_.order[k], from = ways_.previous[i];
      if (from == i || !leads_to_wood(i)) continue;
      const double length = ways_.beyond[i] + norm(points_[i] - points_[from]);
      if (ways_.next[from] == kNone || length > ways_.beyond[from]) {
        ways_.beyond[from] = length;
        ways_.next[from] = i;
      }
    }
    // Straight on where another way is nearly as long.
    std::vector<Index> straight = ways_.next;
    std::vector<double> best(n, -2);
    for (const Index i : ways_.order) {
      const Index from = ways_.previous[i];
      if (from == i || !leads_to_wood(i)) continue;
      const double length = ways_.beyond[i] + norm(points_[i] - points_[from]);
      if (length < kSimilar * ways_.beyond[from]) continue;
      const Vec3 ahead = points_[far_along(i, from)] - points_[from], back = points_[from] - points_[far_back(from)];
      const double score = norm2(back) > 0 && norm2(ahead) > 0
                               ? dot(ahead, back) / (norm(ahead) * norm(back)) + length / ways_.beyond[from]
                               : length / ways_.beyond[from];
      if (score > best[from]) {
        best[from] = score;
        straight[from] = i;
      }
    }
    ways_.next = std::move(straight);
    for (std::size_t k = ways_.order.size(); k-- > 0;) {  // lengths along the ways that were chosen
      const Index i = ways_.order[k], on = ways_.next[i];
      ways_.beyond[i] = on == kNone ? 0 : ways_.beyond[on] + norm(points_[on] - points_[i]);
    }
  }

  Index far_along(Index i, Index from) const {
    while (ways_.next[i] != kNone && norm2(points_[i] - points_[from]) < squared(kDirection * tolerance_))
      i = ways_.next[i];
    return i;
  }

  Index far_back(Index from) const {
    Index i = from;
    while (ways_.previous[i] != i && norm2(points_[i] - points_[from]) < squared(kDirection * tolerance_))
      i = ways_.previous[i];
    return i;
  }

  void try_branch(Index start) {
    Index tip = start;
    while (ways_.next[tip] != kNone) tip = ways_.next[tip];
    if (on_limb_[tip] != kNone) return;
    std::vector<Index> way{tip};
    while (on_limb_[way.back()] == kNone && ways_.previous[way.back()] != way.back())
      way.push_back(ways_.previous[way.back()]);
    std::reverse(way.begin(), way.end());
    if (way.size() < 2) return;
    const Index parent = on_limb_[way.front()];
    std::vector<Vec3> axis;
    if (parent != kNone) axis.push_back(nearest_on_polyline(limbs_[parent].axis, points_[way.front()]).point);
    for (const Index i : way)
      if (parent == kNone || i != way.front()) axis.push_back(points_[i]);
    if (axis.size() < 2) return;
    axis = smooth(axis);

    const std::vector<Index> near = around(way);
    std::size_t gain = 0;
    for (const Index i : near) gain += limb_of_[i] == kNone && is_wood(i);
    if ((gain < kLeastGain || gaps(way) > kMostGaps) && parent != kNone) return;
    if (parent != kNone && ends_at(limbs_[parent], axis.front())) {
      go_on(axis, limbs_[parent]);
      claim(way, near, parent);
      return;
    }
    const auto name = static_cast<Index>(limbs_.size());
    Limb limb;
    limb.parent = parent;
    limb.radii.assign(axis.size(), 0);
    limb.fitted.assign(axis.size(), 0);
    limb.axis = std::move(axis);
    limbs_.push_back(std::move(limb));
    claim(way, near, name);
  }

  void claim(const std::vector<Index>& way, const std::vector<Index>& near, Index limb) {
    for (const Index i : way)
      if (on_limb_[i] == kNone) on_limb_[i] = limb;
    for (const Index i : near)
      if (limb_of_[i] == kNone) limb_of_[i] = limb;
  }

  // Whether a limb, not yet led on from, ends where another begins.
  static bool ends_at(const Limb& limb, const Vec3& p) {
    return limb.fitted.back() && norm(limb.axis.back() - p) <= limb.radii.back();
  }

  static void go_on(const std::vector<Vec3>& axis, Limb& limb) {
    limb.axis.insert(limb.axis.end(), axis.begin() + 1, axis.end());
    limb.radii.resize(limb.axis.size(), 0);
    limb.fitted.resize(limb.axis.size(), 0);
  }

  // The share of a way that no points show.
  double gaps(const std::vector<Index>& way) const {
    double length = 0, crossed = 0;
    for (std::size_t k = 1; k < way.size(); ++k) {
      const double step = norm(points_[way[k]] - points_[way[k - 1]]);
      length += step;
      if (step > gap_) crossed += step - gap_;
    }
    return crossed / length;
  }

  // Points that a branch along a way explains.
  std::vector<Index> around(const std::vector<Index>& way) const {
    std::vector<Vec3> line;
    for (const Index i : way) line.push_back(points_[i]);
    std::vector<Index> result;
    const auto reach = [&](std::size_t k) {
      return tolerance_ + 2 * std::max(radius_of(way[k]), radius_of(way[k + 1]));
    };
    visit_near(tree_, points_, line, reach, [&](Index i, const PolylineFoot&) {
      if (group_of(i) == group_of(way.front())) result.push_back(i);
    });
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  bool is_wood(Index i) const { return options_.wood.empty() || options_.wood[i]; }
  bool leads_to_wood(Index i) const { return ways_.next[i] != kNone || is_wood(i); }
  double radius_of(Index i) const { return options_.radius.empty() ? 0 : options_.radius[i]; }
  Index group_of(Index i) const { return options_.group.empty() ? 0 : options_.group[i]; }

  // Even steps along a way, whose points lie off the branch's middle by its thickness and the noise: a line that bends
  // little and stays near them. The ends are kept.
  std::vector<Vec3> smooth(const std::vector<Vec3>& way) const {
    const double length = polyline_length(way);
    const auto count = std::max<std::size_t>(2, static_cast<std::size_t>(length / (kStep * tolerance_)) + 1);
    std::vector<Vec3> line = resample_polyline(way, count);
    const auto m = static_cast<Eigen::Index>(line.size());
    if (m < 3) return line;
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index k = 0; k < m; ++k) entries.emplace_back(k, k, k == 0 || k + 1 == m ? 1e6 : 1.0);
    for (Eigen::Index k = 1; k + 1 < m; ++k)
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
          entries.emplace_back(k + i, k + j, kStiffness * (i == 0 ? -2 : 1) * (j == 0 ? -2 : 1));
    Eigen::SparseMatrix<double> matrix(m, m);
    matrix.setFromTriplets(entries.begin(), entries.end());
    Eigen::MatrixXd right(m, 3);
    for (Eigen::Index k = 0; k < m; ++k)
      for (int c = 0; c < 3; ++c)
        right(k, c) = (k == 0 || k + 1 == m ? 1e6 : 1.0) * line[static_cast<std::size_t>(k)][c];
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    const Eigen::MatrixXd x = solver.solve(right);
    for (Eigen::Index k = 0; k < m; ++k)
      for (int c = 0; c < 3; ++c) line[static_cast<std::size_t>(k)][c] = x(k, c);
    return line;
  }

  const std::vector<Vec3>& points_;
  const GrowthOptions& options_;
  double tolerance_, gap_ = 0;
  std::vector<Limb>& limbs_;
  std::vector<Index>& limb_of_;  // that explains each point
  std::vector<Index> on_limb_;   // whose way each point is on
  PointSet set_;
  KdTree tree_;
  Ways ways_;
};

}  // namespace

void grow_limbs(const std::vector<Vec3>& points, const GrowthOptions& options, std::vector<Limb>& limbs,
                std::vector<Index>& limb_of, const Context& context) {
  Growth growth(points, options, limbs, limb_of);
  growth.find_ways(context);
  growth.grow(context);
}

}  // namespace bisector
