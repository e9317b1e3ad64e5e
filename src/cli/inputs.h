// Inputs that several commands read.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "bisector/mesh.h"
#include "console.h"
#include "options.h"
#include "report.h"

namespace bisector::cli {

// `count`: how many the command line asks for, or 0. Throws Error if the file has another number.
std::vector<Vec3> read_seeds(const std::string& path, std::size_t count);

// Folds of a wrap are those of its own triangles: creases are not looked for by themselves there.
void leave_out_folds(const WrapOption& wrap, FeatureOptions& features);

// Wraps a mesh if that is asked for, so that tetrahedra fit into it if they are wanted; without a radius it is about
// the edge length of a mesh of so many vertices, or `edge_length` if that is positive. Warns if labels are lost.
// Returns what the report says about it, null if there is no wrap.
Json wrap_if_asked(const WrapOption& option, const TriangleMesh& mesh, std::size_t vertices, double edge_length,
                   bool tetrahedra, Console& console, TriangleMesh& wrapped);

}  // namespace bisector::cli
