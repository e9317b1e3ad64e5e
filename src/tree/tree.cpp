#include "bisector/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bisector/error.h"
#include "core/magnitude.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "tree/branches.h"
#include "tree/clusters.h"
#include "tree/complete.h"
#include "tree/frusta.h"
#include "tree/level_sections.h"
#include "tree/loft.h"
#include "tree/point_graph.h"
#include "tree/polyline.h"
#include "tree/refine.h"
#include "tree/scene.h"
#include "tree/skeleton.h"

namespace bisector {
namespace {

constexpr std::size_t kLeastPoints = 20;  // that a tree is made from
constexpr double kSliceSpacings = 3;      // thickness of the slices that clusters start from, in spacings of the points
constexpr double kLeastSlice = 0.006;     // their least thickness, in the unit cube
constexpr double kThicker = 1.3;        // ratio of the slices' thickness to the last, while there are too many clusters
constexpr double kSlender = 4;          // radius of a cluster over its rms from which on the rms is taken for the noise
constexpr double kAxisTolerance = 0.3;  // distance of fitted axes from the nodes, in the branch's median radius
constexpr double kLeastTip = 0.3;  // of the base radius: what tolerances of a pointed branch's mesh go by, at least

constexpr double kMostHidden = 0.1;  // of a tree's largest extent: what may be hidden of a trunk above the ground

constexpr double kTipRadius = 3e-4;  // of the thinnest twigs, in the unit cube: 3 mm of a tree of 10 m

// A plate of points at the bottom that is taken for ground: how low, how many of the points, how wide beside the tree.
constexpr double kPlateHeight = 0.02, kPlateWidth = 0.5;
constexpr std::size_t kPlateShare = 10;  // one point in so many

// The points that the tree is made from, in the unit cube.
struct Scan {
  std::vector<Vec3> points;     // distinct
  std::vector<Index> of_input;  // point of each input point, or kNone
  Vec3 origin;
  double unit = 1;  // length in the input of 1 here
};

void check_options(const std::vector<Vec3>& points, const TreeOptions& options) {
  if (!(options.delta > 0 && options.delta < 1))
    throw Error(fmt::format("delta is {}; give a number above 0 and below 1", options.delta));
  if (!(options.tip_radius >= 0 && std::isfinite(options.tip_radius)))
    throw Error(fmt::format("the tips' radius is {}; give a positive length, or 0", options.tip_radius));
  if (std::isnan(options.ground)) throw Error("the ground's height is not a number; give its z");
  if (!options.classes.empty() && options.classes.size() != points.size())
    throw Error(fmt::format("{} classes for {} points; give one for each", options.classes.size(), points.size()));
  if (options.scene && options.components == TreeComponents::separate)
    throw Error("the trees of a scene are told from each other; leave their components bridged");
  require_moderate_model(points, "point");
}

bool on_one_line(const std::vector<Vec3>& points) {
  Vec3 way;
  for (const Vec3& p : points)
    if (const Vec3 d = p - points.front(); norm2(d) > norm2(way)) way = d;
  const double tolerance = 1e-6 * norm2(way);
  return std::all_of(points.begin(), points.end(),
                     [&](const Vec3& p) { return norm(cross(p - points.front(), way)) <= tolerance; });
}

Scan prepare(const std::vector<Vec3>& input, const TreeOptions& options, TreeResult& result) {
  Scan scan;
  scan.of_input.assign(input.size(), kNone);
  std::vector<Index> order;
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (input[i].z < options.ground) ++result.ground_points;
    else order.push_back(static_cast<Index>(i));
  }
  if (order.empty() && result.ground_points > 0)
    throw Error(fmt::format("all {} points are below the ground ({}); lower it", input.size(), options.ground));
  const auto key = [&](Index i) { return std::tie(input[i].x, input[i].y, input[i].z); };
  sort_in_parallel(order, [&](Index a, Index b) {
    return std::tuple_cat(key(a), std::tie(a)) < std::tuple_cat(key(b), std::tie(b));
  });
  std::vector<Index> twin(input.size());
  for (std::size_t k = 0; k < order.size(); ++k)
    twin[order[k]] = k > 0 && key(order[k - 1]) == key(order[k]) ? twin[order[k - 1]] : order[k];
  std::sort(order.begin(), order.end());
  for (const Index i : order) {
    if (twin[i] == i) {
      scan.of_input[i] = static_cast<Index>(scan.points.size());
      scan.points.push_back(input[i]);
    } else {
      scan.of_input[i] = scan.of_input[twin[i]];
      ++result.duplicate_points;
    }
  }
  if (scan.points.size() < kLeastPoints)
    throw Error(fmt::format("{} distinct points{} are too few for a tree; give at least {}", scan.points.size(),
                            result.ground_points > 0 ? " above the ground" : "", kLeastPoints));
  if (on_one_line(scan.points)) throw Error("all points lie on one line; give the surface of a tree");

  const Box box = bounding_box(scan.points);
  scan.origin = box.lo;
  scan.unit = std::max({box.hi.x - box.lo.x, box.hi.y - box.lo.y, box.hi.z - box.lo.z});
  for (Vec3& p : scan.points) p = (1 / scan.unit) * (p - scan.origin);
  return scan;
}

// Points of the ground would become a branch; they are left out only below a height that the caller gives.
void warn_of_ground(const Scan& scan, const Context& context) {
  const Box box = bounding_box(scan.points);
  std::vector<Vec3> low;
  for (const Vec3& p : scan.points)
    if (p.z < kPlateHeight * box.hi.z) low.push_back(p);
  const Box plate = bounding_box(low);
  const double wide = std::min(plate.hi.x - plate.lo.x, plate.hi.y - plate.lo.y);
  if (kPlateShare * low.size() > scan.points.size() && wide > kPlateWidth * std::max(box.hi.x, box.hi.y))
    context.warn(
        fmt::format("the lowest 2 % of the height hold {} of {} points, as wide as the tree: if they are the "
                    "ground, have it found or give its height",
                    low.size(), scan.points.size()));
}

struct Network {
  PointGraph graph;
  Csr<Index> neighbours;      // with bridges, if wanted
  std::vector<Index> lowest;  // point of each tree
};

// The root is a point of the scan, kNone: the lowest.
Network connect(const Scan& scan, const TreeOptions& options, Index root, TreeResult& result) {
  Network network;
  network.graph = build_point_graph(scan.points);
  result.components = network.graph.components;
  network.neighbours = network.graph.neighbours;
  const std::vector<Index>& component = network.graph.component;
  std::vector<Index> lowest(network.graph.components, kNone);
  std::vector<std::size_t> size(network.graph.components, 0);
  for (std::size_t i = 0; i < component.size(); ++i) {
    Index& low = lowest[component[i]];
    if (low == kNone || scan.points[i].z < scan.points[low].z) low = static_cast<Index>(i);
    ++size[component[i]];
  }
  const auto higher = [&](Index a, Index b) { return scan.points[a].z < scan.points[b].z; };
  if (options.components == TreeComponents::bridge) {
    std::vector<std::array<Index, 2>> edges;
    for (const Bridge& b : shortest_bridges(scan.points, network.graph)) {
      edges.push_back({b.from, b.to});
      result.bridges.push_back(scan.unit * b.length);
    }
    network.neighbours = add_edges(network.neighbours, edges);
    network.lowest = {root != kNone ? root : *std::min_element(lowest.begin(), lowest.end(), higher)};
    return network;
  }
  for (std::size_t c = 0; c < size.size(); ++c) {
    if (size[c] >= kLeastPoints) network.lowest.push_back(lowest[c]);
    else result.small_component_points += size[c];
  }
  if (network.lowest.empty())
    throw Error(fmt::format("none of the {} components has {} points; bridge them", size.size(), kLeastPoints));
  return network;
}

// The component of each point that is large enough for a tree.
std::vector<Index> trees_of_points(const Network& network) {
  std::vector<Index> group(network.graph.component.size(), kNone);
  std::vector<char> is_tree(network.graph.components, 0);
  for (const Index i : network.lowest) is_tree[network.graph.component[i]] = 1;
  for (std::size_t i = 0; i < group.size(); ++i)
    if (is_tree[network.graph.component[i]]) group[i] = network.graph.component[i];
  return group;
}

Clusters make_clusters(const Scan& scan, const Network& network, const TreeOptions& options, const Context& context) {
  double width = std::max(kSliceSpacings * network.graph.spacing, kLeastSlice);
  LevelSections sections = level_sections(scan.points, network.neighbours, network.lowest, width);
  while (options.clusters > 0 && sections.count > options.clusters && width < 1) {
    width *= kThicker;
    sections = level_sections(scan.points, network.neighbours, network.lowest, width);
  }
  ClusterOptions cluster_options;
  cluster_options.most = options.clusters;
  cluster_options.delta = options.delta;
  cluster_options.max_points = options.max_cluster_points;
  return cluster_points(scan.points, network.neighbours, sections.section, sections.distance, cluster_options, context);
}

// Standard deviation of points off cylinders that are much thicker than it.
double measure_noise(const std::vector<BranchCylinder>& cylinders) {
  std::vector<double> rms;
  for (const BranchCylinder& c : cylinders)
    if (c.rms > 0 && c.radius > kSlender * c.rms) rms.push_back(c.rms);
  return rms.empty() ? 0 : upper_median(std::move(rms));
}

std::vector<Limb> rough_limbs(const Scan& scan, const Network& network, const Clusters& clusters,
                              const TreeOptions& options) {
  std::vector<ClusterLink> links = link_clusters(scan.points, network.neighbours, clusters.label, clusters.cylinders);
  if (options.components == TreeComponents::bridge)
    link_across_gaps(scan.points, clusters.label, network.graph.component, clusters.cylinders, links);
  weigh_links(clusters.cylinders, links);
  std::vector<Index> roots;
  for (const Index i : network.lowest) roots.push_back(clusters.label[i]);
  const std::vector<SkeletonNode> nodes = make_skeleton(links, clusters.cylinders, roots);
  const std::vector<SkeletonBranch> branches = find_branches(nodes);

  std::vector<Limb> limbs;
  std::vector<Index> limb_of(clusters.cylinders.size(), kNone);
  for (const SkeletonBranch& branch : branches) {
    Limb limb;
    limb.parent = branch.parent;
    for (std::size_t k = 0; k < branch.nodes.size(); ++k) {
      const SkeletonNode& node = nodes[branch.nodes[k]];
      limb.axis.push_back(node.position);
      if (node.cluster != kNone && (k > 0 || branch.parent == kNone))
        limb_of[node.cluster] = static_cast<Index>(limbs.size());
    }
    limbs.push_back(std::move(limb));
  }
  for (std::size_t i = 0; i < scan.points.size(); ++i)
    if (const Index c = clusters.label[i]; c != kNone && limb_of[c] != kNone)
      limbs[limb_of[c]].points.push_back(static_cast<Index>(i));
  return limbs;
}

// Cone frusta along the axis from where it leaves the parent.
void measure(const std::vector<Limb>& limbs, std::size_t b, TreeBranch& branch) {
  const Limb& limb = limbs[b];
  branch.length = polyline_length(limb.axis);
  branch.tip_radius = limb.radii.back();
  branch.base_radius = limb.radii.front();
  const std::vector<Frustum> frusta =
      limb.parent == kNone ? frusta_outside(limb.axis, limb.radii)
                           : frusta_outside(limb.axis, limb.radii, limbs[limb.parent].axis, limbs[limb.parent].radii);
  if (!frusta.empty()) branch.base_radius = frusta.front().start_radius;
  for (const Frustum& f : frusta) {
    branch.volume += f.volume();
    branch.area += f.lateral_area();
  }
}

void describe_branches(const std::vector<Limb>& limbs, TreeResult& result) {
  for (std::size_t b = 0; b < limbs.size(); ++b) {
    const Limb& limb = limbs[b];
    TreeBranch branch;
    branch.parent = limb.parent;
    branch.points = limb.points.size();
    Index previous = kNone;
    if (limb.parent != kNone) {
      const TreeBranch& parent = result.branches[limb.parent];
      branch.order = parent.order + 1;
      previous = parent.nodes[nearest_on_polyline(limbs[limb.parent].axis, limb.axis.front()).segment];
    }
    for (std::size_t k = 0; k < limb.axis.size(); ++k) {
      branch.nodes.push_back(static_cast<Index>(result.skeleton.size()));
      result.skeleton.push_back({limb.axis[k], limb.radii[k], previous, static_cast<Index>(b), limb.fitted[k] != 0});
      if (k > 0 && limb.fitted[k]) branch.fitted_length += norm(limb.axis[k] - limb.axis[k - 1]);
      previous = branch.nodes.back();
    }
    measure(limbs, b, branch);
    result.branches.push_back(std::move(branch));
  }
}

void loft(const std::vector<Limb>& limbs, TreeResult& result, const Context& context) {
  parallel_each(
      limbs.size(),
      [&](std::size_t b) {
        context.check();
        const double tolerance = kAxisTolerance * upper_median(limbs[b].radii);
        result.branches[b].surface = loft_branch(limbs[b].axis, limbs[b].radii, tolerance);
      },
      1);
}

// Where a tree stands.
struct Foot {
  Index root = kNone;                    // number of the point that it grows from; kNone: the lowest
  const SceneDivision* scene = nullptr;  // that knows the ground, or not
};

// Trunks begin at the ground: axes that were led on below it are cut, and trunks whose foot is not seen go straight
// down to it, by kMostHidden of the tree's height at most.
void plant_trunks(const SceneDivision& scene, double height, std::vector<Limb>& limbs) {
  for (Limb& limb : limbs) {
    if (limb.parent != kNone || std::isnan(scene.ground_at(limb.axis.front()))) continue;
    const auto above = [&](const Vec3& p) { return p.z - scene.ground_at(p); };
    std::size_t first = 0;
    while (first + 2 < limb.axis.size() && above(limb.axis[first + 1]) <= 0) ++first;
    const auto erased = static_cast<std::ptrdiff_t>(first);
    limb.axis.erase(limb.axis.begin(), limb.axis.begin() + erased);
    limb.radii.erase(limb.radii.begin(), limb.radii.begin() + erased);
    limb.fitted.erase(limb.fitted.begin(), limb.fitted.begin() + erased);
    const double low = above(limb.axis[0]), high = above(limb.axis[1]);
    if (low < 0 && high > 0) {
      const double t = low / (low - high);
      limb.axis[0] += t * (limb.axis[1] - limb.axis[0]);
      limb.radii[0] += t * (limb.radii[1] - limb.radii[0]);
    } else if (low > 0 && low <= kMostHidden * height) {
      limb.axis.insert(limb.axis.begin(), limb.axis[0] - Vec3{0, 0, low});
      limb.radii.insert(limb.radii.begin(), limb.radii[0]);
      limb.fitted.insert(limb.fitted.begin(), 0);
    }
  }
}

// All points as one tree, or its parts as one each.
TreeResult reconstruct(const std::vector<Vec3>& points, const TreeOptions& options, const Foot& foot,
                       const Context& context) {
  TreeResult result;
  Stopwatch watch;
  const auto phase = [&](const char* name, double fraction) {
    context.check();
    context.report({.phase = name, .fraction = fraction});
  };
  phase("connecting points", 0);
  const Scan scan = prepare(points, options, result);
  if (result.ground_points == 0 && foot.root == kNone) warn_of_ground(scan, context);
  const Network network = connect(scan, options, foot.root == kNone ? kNone : scan.of_input[foot.root], result);
  result.seconds.graph = watch.lap();

  phase("clusters", 0.15);
  const Clusters clusters = make_clusters(scan, network, options, context);
  result.clusters = clusters.cylinders.size();
  result.fixed_clusters = static_cast<std::size_t>(std::count(clusters.fixed.begin(), clusters.fixed.end(), 1));
  const double noise = measure_noise(clusters.cylinders);
  result.seconds.clusters = watch.lap();

  phase("skeleton", 0.5);
  std::vector<Limb> limbs = rough_limbs(scan, network, clusters, options);
  result.seconds.skeleton = watch.lap();

  phase("fitting branches", 0.55);
  limbs = refine_limbs(scan.points, network.neighbours, std::move(limbs), {.noise = noise}, context);
  CompletionOptions completion;
  completion.spacing = network.graph.spacing;
  completion.tip_radius = options.tip_radius > 0 ? options.tip_radius / scan.unit : kTipRadius;
  completion.leaves = options.leaves == TreeLeaves::apart;
  if (options.components == TreeComponents::separate) completion.group = trees_of_points(network);
  const Completion completed = complete_limbs(scan.points, completion, limbs, context);
  result.pipe_exponent = completed.pipe.exponent;
  result.pipe_fitted = completed.pipe.from_points;
  result.seconds.refine = watch.lap();

  phase("surfaces", 0.85);
  for (Limb& limb : limbs) {
    for (Vec3& p : limb.axis) p = scan.origin + scan.unit * p;
    for (double& r : limb.radii) r *= scan.unit;
  }
  if (foot.scene) plant_trunks(*foot.scene, scan.unit, limbs);
  describe_branches(limbs, result);
  loft(limbs, result, context);
  result.noise = scan.unit * noise;
  result.cluster.assign(points.size(), kNone);
  result.branch.assign(points.size(), kNone);
  if (completion.leaves) result.leaf.assign(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const Index p = scan.of_input[i]; p != kNone) {
      result.cluster[i] = clusters.label[p];
      result.branch[i] = completed.limb_of[p];
      const bool in_tree = completion.group.empty() || completion.group[p] != kNone;
      const bool is_leaf = in_tree && completion.leaves && completed.leaf[p];
      if (is_leaf) result.leaf[i] = 1;
      result.leaf_points += is_leaf;
      result.unexplained_points += in_tree && !is_leaf && completed.limb_of[p] == kNone;
    }
  result.seconds.surfaces = watch.lap();
  result.seconds.total = watch.seconds();
  return result;
}

void offset(std::vector<Index>& values, std::size_t by) {
  for (Index& v : values)
    if (v != kNone) v += static_cast<Index>(by);
}

// Adds the tree of the points `ids`.
void append(TreeResult tree, const std::vector<Index>& ids, TreeResult& result) {
  const auto branches = static_cast<Index>(result.branches.size()), nodes = static_cast<Index>(result.skeleton.size());
  offset(tree.cluster, result.clusters);
  offset(tree.branch, branches);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    result.cluster[ids[k]] = tree.cluster[k];
    result.branch[ids[k]] = tree.branch[k];
    if (!tree.leaf.empty()) result.leaf[ids[k]] = tree.leaf[k];
  }
  for (TreeNode& node : tree.skeleton) {
    if (node.parent != kNone) node.parent += nodes;
    node.branch += branches;
    result.skeleton.push_back(node);
  }
  for (TreeBranch& branch : tree.branches) {
    offset(branch.nodes, nodes);
    if (branch.parent != kNone) branch.parent += branches;
    result.branches.push_back(std::move(branch));
  }
  if (branches == 0) {
    result.pipe_exponent = tree.pipe_exponent;
    result.pipe_fitted = tree.pipe_fitted;
    result.noise = tree.noise;
  }
  result.bridges.insert(result.bridges.end(), tree.bridges.begin(), tree.bridges.end());
  for (const auto count :
       {&TreeResult::clusters, &TreeResult::fixed_clusters, &TreeResult::components, &TreeResult::duplicate_points,
        &TreeResult::small_component_points, &TreeResult::leaf_points, &TreeResult::unexplained_points})
    result.*count += tree.*count;
  for (const auto seconds : {&TreeSeconds::graph, &TreeSeconds::clusters, &TreeSeconds::skeleton, &TreeSeconds::refine,
                             &TreeSeconds::surfaces})
    result.seconds.*seconds += tree.seconds.*seconds;
}

// What follows from the branches of each trunk and their points.
std::vector<ScannedTree> describe_trees(const std::vector<Vec3>& points, const TreeResult& result) {
  std::vector<ScannedTree> trees;
  std::vector<std::size_t> tree_of(result.branches.size());
  for (std::size_t b = 0; b < result.branches.size(); ++b) {
    const TreeBranch& branch = result.branches[b];
    tree_of[b] = branch.parent == kNone ? trees.size() : tree_of[branch.parent];
    if (branch.parent == kNone) {
      trees.emplace_back();
      trees.back().trunk = static_cast<Index>(b);
      trees.back().base = result.skeleton[branch.nodes.front()].position;
      trees.back().noise = result.noise;
      trees.back().pipe_exponent = result.pipe_exponent;
      trees.back().pipe_fitted = result.pipe_fitted;
    }
    ScannedTree& tree = trees[tree_of[b]];
    ++tree.branches;
    tree.points += branch.points;
    tree.length += branch.length;
    tree.volume += branch.volume;
    tree.area += branch.area;
  }
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<double> low(trees.size(), kFar), high(trees.size(), -kFar);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (result.branch[i] == kNone) continue;
    const std::size_t t = tree_of[result.branch[i]];
    low[t] = std::min(low[t], points[i].z);
    high[t] = std::max(high[t], points[i].z);
  }
  for (std::size_t t = 0; t < trees.size(); ++t) trees[t].height = std::max(high[t] - low[t], 0.0);
  return trees;
}

// Says which of several trees is at work.
Context context_of_tree(const Context& context, std::size_t tree, std::size_t trees) {
  constexpr double kBefore = 0.1;  // share of the run
  Context own = context;
  if (context.progress)
    own.progress = [&context, tree, trees](Progress p) {
      if (trees > 1) p.phase = fmt::format("tree {}/{}: {}", tree + 1, trees, p.phase);
      p.fraction = kBefore + (1 - kBefore) * (static_cast<double>(tree) + p.fraction) / static_cast<double>(trees);
      context.report(p);
    };
  return own;
}

// The trees of what the points show.
TreeResult reconstruct_scene(const std::vector<Vec3>& points, const TreeOptions& options, const Context& context) {
  TreeResult result;
  Stopwatch watch;
  context.check();
  context.report({.phase = options.scene ? "ground, walls and trees" : "ground", .fraction = 0});
  SceneDivision division = divide_scene(points, options, context);
  result.seconds.scene = watch.lap();
  result.cluster.assign(points.size(), kNone);
  result.branch.assign(points.size(), kNone);
  if (options.leaves == TreeLeaves::apart) result.leaf.assign(points.size(), 0);

  TreeOptions of_tree = options;
  of_tree.ground = -std::numeric_limits<double>::infinity();
  const std::size_t trees = division.base.size();
  std::vector<std::vector<Index>> ids(trees);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const Index t = division.tree[i]; t != kNone) ids[t].push_back(static_cast<Index>(i));
  for (std::size_t t = 0; t < trees; ++t) {
    std::vector<Vec3> own;
    for (const Index i : ids[t]) own.push_back(points[i]);
    Foot foot{kNone, &division};
    if (const Index base = division.base[t]; base != kNone)
      foot.root = static_cast<Index>(std::lower_bound(ids[t].begin(), ids[t].end(), base) - ids[t].begin());
    TreeResult tree = reconstruct(own, of_tree, foot, context_of_tree(context, t, trees));
    for (ScannedTree found : describe_trees(own, tree)) {
      found.trunk += static_cast<Index>(result.branches.size());
      found.ground = division.ground_at(found.base);
      if (!std::isnan(found.ground)) {
        double top = found.ground;
        for (const Vec3& p : own) top = std::max(top, p.z);
        found.height = top - found.ground;
      }
      result.trees.push_back(found);
    }
    append(std::move(tree), ids[t], result);
  }
  const auto count = [&](ScanPart part) {
    return static_cast<std::size_t>(std::count(division.part.begin(), division.part.end(), part));
  };
  result.ground_points = count(ScanPart::ground);
  result.walls = division.walls;
  result.wall_points = count(ScanPart::wall);
  result.low_plant_points = count(ScanPart::low_plant);
  result.stray_points = count(ScanPart::stray);
  result.ground_noise = division.ground_noise;
  result.part = std::move(division.part);
  if (options.scene) result.tree = std::move(division.tree);
  result.seconds.total = watch.seconds();
  return result;
}

}  // namespace

TreeResult reconstruct_tree(const std::vector<Vec3>& points, const TreeOptions& options, const Context& context) {
  check_options(points, options);
  if (options.find_ground || options.scene) return reconstruct_scene(points, options, context);
  TreeResult result = reconstruct(points, options, {}, context);
  result.trees = describe_trees(points, result);
  return result;
}

TriangleMesh tree_mesh(const TreeResult& tree, double tolerance, const Context& context) {
  if (!(tolerance > 0)) throw Error(fmt::format("the tolerance is {}; give a positive number", tolerance));
  std::vector<TriangleMesh> parts(tree.branches.size());
  parallel_each(
      parts.size(),
      [&](std::size_t b) {
        context.check();
        const TreeBranch& branch = tree.branches[b];
        parts[b] = branch_mesh(branch.surface, tolerance * std::max(branch.tip_radius, kLeastTip * branch.base_radius));
      },
      1);
  TriangleMesh mesh;
  for (std::size_t b = 0; b < parts.size(); ++b) {
    const auto first = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), parts[b].vertices.begin(), parts[b].vertices.end());
    for (const Triangle& t : parts[b].triangles) {
      mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
      mesh.labels.push_back(static_cast<std::int32_t>(b));
    }
  }
  return mesh;
}

TriangleMesh tree_mesh(const TreeResult& tree, const Context& context) {
  return tree_mesh(tree, kTreeTolerance, context);
}

}  // namespace bisector
