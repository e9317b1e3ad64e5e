#include "support/scene_score.h"

#include <algorithm>

#include "support/tree_score.h"

namespace bisector::test {
namespace {

Shares shares_of(const SceneScan& scan, const TreeResult& result, ScenePoint kind, ScanPart part) {
  std::size_t both = 0, said = 0, truly = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    both += scan.kinds[i] == kind && result.part[i] == part;
    said += result.part[i] == part;
    truly += scan.kinds[i] == kind;
  }
  const auto share = [&](std::size_t all) { return all ? static_cast<double>(both) / static_cast<double>(all) : 1.0; };
  return {share(said), share(truly)};
}

}  // namespace

SceneScore score_scene(const SceneScan& scan, const TreeResult& result) {
  SceneScore score;
  score.ground = shares_of(scan, result, ScenePoint::ground, ScanPart::ground);
  score.wall = shares_of(scan, result, ScenePoint::wall, ScanPart::wall);
  score.trees = scan.branches.size();
  score.found_trees = result.trees.size();
  std::vector<std::vector<std::size_t>> count(score.trees, std::vector<std::size_t>(score.found_trees, 0));
  std::size_t all = 0, right = 0, bushes = 0, wrong = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    all += scan.trees[i] != kNone;
    bushes += scan.kinds[i] == ScenePoint::bush;
    wrong += scan.kinds[i] == ScenePoint::bush && result.tree[i] != kNone;
    if (scan.trees[i] != kNone && result.tree[i] != kNone) ++count[scan.trees[i]][result.tree[i]];
  }
  for (const std::vector<std::size_t>& found : count) {
    const auto most = std::max_element(found.begin(), found.end());
    score.match.push_back(most == found.end() || *most == 0 ? kNone : static_cast<Index>(most - found.begin()));
    if (score.match.back() != kNone) right += *most;
  }
  score.right_tree = static_cast<double>(right) / static_cast<double>(all);
  score.bushes_in_trees = bushes ? static_cast<double>(wrong) / static_cast<double>(bushes) : 0;
  return score;
}

std::vector<AxisBranch> axes_of_tree(const TreeResult& result, Index tree) {
  const std::vector<AxisBranch> all = axes_of(result);
  const std::size_t first = result.trees[tree].trunk, last = first + result.trees[tree].branches;
  std::vector<AxisBranch> axes(all.begin() + static_cast<std::ptrdiff_t>(first),
                               all.begin() + static_cast<std::ptrdiff_t>(last));
  for (AxisBranch& branch : axes)
    if (branch.parent != kNone) branch.parent -= static_cast<Index>(first);
  return axes;
}

}  // namespace bisector::test
