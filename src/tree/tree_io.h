// Files and pictures of reconstructed trees.
#pragma once

#include <string>
#include <vector>

#include "core/geometry.h"
#include "tree/iges.h"
#include "tree/tree.h"

namespace bisector {

// The surfaces as .obj (a group branch_K for each branch K), .ply (face property `label`), .off, .stl or, as B-spline
// surfaces named branch_K, .igs and .iges, where `unit` is that of the coordinates. Throws Error.
void write_tree(const std::string& path, const TreeResult& tree, const TriangleMesh& mesh,
                IgesUnit unit = IgesUnit::metre);

// The skeleton as binary PLY: vertices with `radius`, `branch` and `order`, and the element `edge`. Throws Error.
void write_skeleton(const std::string& path, const TreeResult& tree);

// The points as binary PLY with `label`, their branch (-1: none), and its colour. Throws Error.
void write_tree_labels(const std::string& path, const std::vector<Vec3>& points, const TreeResult& tree);

// Points and surfaces side by side, seen from the side, as PNG; branches have the same colours in both. Throws Error.
void write_tree_preview(const std::string& path, const std::vector<Vec3>& points, const TreeResult& tree,
                        const TriangleMesh& mesh);

}  // namespace bisector
