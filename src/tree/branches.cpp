#include "tree/branches.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "tree/polyline.h"

namespace bisector {
namespace {

constexpr double kSimilar = 0.85;  // of the longest path's length: among paths so long direction and radius decide
constexpr double kReach = 3;       // length in radii, ahead and back, that tells directions at a fork

class Forks {
 public:
  explicit Forks(const std::vector<SkeletonNode>& nodes) : nodes_(nodes) {
    const std::size_t n = nodes.size();
    children_.resize(n);
    height_.assign(n, 0);
    longest_.assign(n, kNone);
    for (std::size_t k = n; k-- > 0;) {
      const Index up = nodes[k].parent;
      if (up == kNone) continue;
      const double length = height_[k] + norm(nodes[k].position - nodes[up].position);
      if (longest_[up] == kNone || length >= height_[up]) {
        height_[up] = length;
        longest_[up] = static_cast<Index>(k);
      }
    }
    for (std::size_t k = 0; k < n; ++k)
      if (nodes[k].parent != kNone) children_[nodes[k].parent].push_back(static_cast<Index>(k));
  }

  const std::vector<Index>& children(Index k) const { return children_[k]; }

  // The child that the branch whose nodes so far end at k goes on with.
  Index next(const std::vector<Index>& so_far) const {
    const Index k = so_far.back();
    if (children_[k].size() < 2 || so_far.size() < 2) return longest_[k];
    const Vec3 here = nodes_[k].position;
    const double reach = kReach * nodes_[k].radius;
    std::size_t back = so_far.size() - 1;
    while (back > 0 && norm(nodes_[so_far[back]].position - here) < reach) --back;
    const Vec3 direction = unit(here - nodes_[so_far[back]].position);
    const double most = height_[k];
    Index best = longest_[k];
    double best_score = -2;
    for (const Index child : children_[k]) {
      const double length = height_[child] + norm(nodes_[child].position - here);
      if (length < kSimilar * most) continue;
      Index ahead = child;
      while (longest_[ahead] != kNone && norm(nodes_[ahead].position - here) < reach) ahead = longest_[ahead];
      const double ratio = std::min(1.0, nodes_[ahead].radius / std::max(nodes_[k].radius, 1e-300));
      const double score = dot(direction, unit(nodes_[ahead].position - here)) + ratio + length / most;
      if (score > best_score) {
        best_score = score;
        best = child;
      }
    }
    return best;
  }

 private:
  const std::vector<SkeletonNode>& nodes_;
  std::vector<std::vector<Index>> children_;
  std::vector<double> height_;  // longest path to a tip
  std::vector<Index> longest_;  // child on it
};

}  // namespace

std::vector<SkeletonBranch> find_branches(const std::vector<SkeletonNode>& nodes) {
  const Forks forks(nodes);
  struct Start {
    Index node, child, parent;
  };
  std::queue<Start> starts;
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (nodes[k].parent == kNone && !forks.children(static_cast<Index>(k)).empty())
      starts.push({static_cast<Index>(k), kNone, kNone});
  std::vector<SkeletonBranch> branches;
  while (!starts.empty()) {
    const Start start = starts.front();
    starts.pop();
    SkeletonBranch branch{{start.node}, start.parent};
    if (start.child != kNone) branch.nodes.push_back(start.child);
    for (Index next; (next = forks.next(branch.nodes)) != kNone;) branch.nodes.push_back(next);
    const auto name = static_cast<Index>(branches.size());
    // The first node of a branch belongs to its parent, whose other children are the parent's.
    for (std::size_t at = start.child == kNone ? 0 : 1; at + 1 < branch.nodes.size(); ++at)
      for (const Index child : forks.children(branch.nodes[at]))
        if (child != branch.nodes[at + 1]) starts.push({branch.nodes[at], child, name});
    branches.push_back(std::move(branch));
  }
  return branches;
}

}  // namespace bisector
