// The cylinders of a tree in the columns of TreeQSM (Raumonen et al., Fast Automatic Precision Tree Models from
// Terrestrial Laser Scanner Data, Remote Sensing 5, 2013).
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "bisector/tree.h"
#include "core/geometry.h"
#include "io/files.h"
#include "io/text.h"
#include "tree/frusta.h"

namespace bisector {
namespace {

struct Cylinder {
  Frustum frustum;
  std::size_t parent = 0, extension = 0;  // from 1; 0: none
  std::size_t position = 0;               // in the branch, from 1
  Index branch = 0;
};

struct AxisWithRadii {
  std::vector<Vec3> axis;
  std::vector<double> radii;
};

AxisWithRadii axis_of(const TreeResult& tree, Index branch) {
  AxisWithRadii axis;
  for (const Index n : tree.branches[branch].nodes) {
    axis.axis.push_back(tree.skeleton[n].position);
    axis.radii.push_back(tree.skeleton[n].radius);
  }
  return axis;
}

std::vector<Frustum> frusta_of(const TreeResult& tree, Index branch) {
  const AxisWithRadii axis = axis_of(tree, branch);
  const Index up = tree.branches[branch].parent;
  const AxisWithRadii parent = up == kNone ? AxisWithRadii{} : axis_of(tree, up);
  std::vector<Frustum> frusta = frusta_outside(axis.axis, axis.radii, parent.axis, parent.radii);
  std::erase_if(frusta, [](const Frustum& f) { return !(f.height > 0) || f.start == f.end; });
  return frusta;
}

class Cylinders {
 public:
  explicit Cylinders(const TreeResult& tree) : tree_(tree), of_node_(tree.skeleton.size(), 0) {
    for (Index b = 0; b < tree.branches.size(); ++b) add_branch(b);
  }

  const std::vector<Cylinder>& all() const { return all_; }

 private:
  void add_branch(Index b) {
    const TreeBranch& branch = tree_.branches[b];
    // What has no cylinder of its own, inside the parent, stands for the last one before or, at the root, for the one
    // that the branch grows from.
    const Index root = tree_.skeleton[branch.nodes.front()].parent;
    std::size_t last = root == kNone ? 0 : of_node_[root], position = 0;
    const std::vector<Frustum> frusta = frusta_of(tree_, b);
    auto next = frusta.begin();
    for (std::size_t k = 0; k < branch.nodes.size(); ++k) {
      if (next != frusta.end() && next->segment == k) {
        all_.push_back({*next++, last, 0, ++position, b});
        if (position > 1) all_[last - 1].extension = all_.size();
        last = all_.size();
      }
      of_node_[branch.nodes[k]] = last;
    }
  }

  const TreeResult& tree_;
  std::vector<std::size_t> of_node_;  // the cylinder that begins there; at a tip, that ends there
  std::vector<Cylinder> all_;
};

// A frustum's length and volume.
double radius_of(const Frustum& f) {
  const double r = f.start_radius, q = f.end_radius;
  return std::sqrt((r * r + r * q + q * q) / 3);
}

// `trees`: of each branch, from 1; empty: not told.
void append_row(std::string& out, const TreeResult& tree, const std::vector<std::size_t>& trees,
                const Cylinder& cylinder) {
  const Frustum& f = cylinder.frustum;
  const Vec3 axis = unit(f.end - f.start);
  for (const double x : {radius_of(f), f.height, f.start.x, f.start.y, f.start.z, axis.x, axis.y, axis.z}) {
    io::append_number(out, x);
    out += ',';
  }
  const auto order = static_cast<std::size_t>(tree.branches[cylinder.branch].order);
  for (const std::size_t n :
       {cylinder.parent, cylinder.extension, std::size_t{cylinder.branch} + 1, order, cylinder.position}) {
    io::append_index(out, n);
    out += ',';
  }
  out += '0';
  if (!trees.empty()) {
    out += ',';
    io::append_index(out, trees[cylinder.branch]);
  }
  out += '\n';
}

std::vector<std::size_t> trees_of_branches(const TreeResult& tree) {
  std::vector<std::size_t> trees;
  for (const TreeBranch& branch : tree.branches)
    trees.push_back(branch.parent != kNone ? trees[branch.parent] : trees.empty() ? 1 : trees.back() + 1);
  return trees;
}

}  // namespace

void write_cylinders(const std::string& path, const TreeResult& tree) {
  std::string out =
      "radius,length,start_x,start_y,start_z,axis_x,axis_y,axis_z,parent,extension,branch,branch_order,"
      "position_in_branch,added";
  const bool is_scene = !tree.tree.empty();
  out += is_scene ? ",tree\n" : "\n";
  const std::vector<std::size_t> trees = is_scene ? trees_of_branches(tree) : std::vector<std::size_t>{};
  const Cylinders cylinders(tree);
  for (const Cylinder& cylinder : cylinders.all()) append_row(out, tree, trees, cylinder);
  write_file(path, out);
}

}  // namespace bisector
