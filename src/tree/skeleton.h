// The skeleton of a clustered tree: junction points between clusters and shortest paths from the root (thesis 3.3).
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry.h"
#include "tree/cylinder.h"

namespace bisector {

// A vertex of a skeleton.
struct SkeletonNode {
  Vec3 position;
  double radius = 0;      // of the branch there
  Index parent = kNone;   // node; kNone: a root
  Index cluster = kNone;  // that it is the centre of; kNone: a junction point
};

struct ClusterLink {
  Index from = 0, to = 0;  // clusters, from < to
  Vec3 junction;           // mean of the boundary points: those with a neighbour in the other cluster
  double gap = 0;          // between nearest points; 0 where some are neighbours
  double length = 0;       // what paths sum up
};

// Pairs of clusters that neighbouring points belong to, ascending; their length is that from centre to centre through
// the junction (thesis 3.3.2). `label` is of each point, kNone for none.
std::vector<ClusterLink> link_clusters(const std::vector<Vec3>& points, const Csr<Index>& neighbours,
                                       const std::vector<Index>& label, const std::vector<BranchCylinder>& cylinders);

// Adds links between clusters near each other that belong to different components of the scan: where an occlusion has
// cut a branch, its ends need not be where the gap is shortest. `component` is of each point.
void link_across_gaps(const std::vector<Vec3>& points, const std::vector<Index>& label,
                      const std::vector<Index>& component, const std::vector<BranchCylinder>& cylinders,
                      std::vector<ClusterLink>& links);

// Makes links longer that turn off from the clusters' axes, and that cross gaps: where branches touch or a scan has
// gaps, paths go straight on.
void weigh_links(const std::vector<BranchCylinder>& cylinders, std::vector<ClusterLink>& links);

// The tree of shortest paths from the root clusters, every parent before its children: centres, junctions between them,
// and beyond the centre of each leaf and root the mirror image of its junction. Without loops by construction. Clusters
// that no link leads to a root are left out.
std::vector<SkeletonNode> make_skeleton(const std::vector<ClusterLink>& links,
                                        const std::vector<BranchCylinder>& cylinders, const std::vector<Index>& roots);

}  // namespace bisector
