// From a mesh as it was read to the domain of remeshing: welded, with its features found and its density laid down.
#pragma once

#include <optional>
#include <vector>

#include "remesh/remesh.h"

namespace bisector {

struct PreparedInput {
  TriangleMesh mesh;            // the input's surface; edges are bisected where the density asks for it
  FeatureGraph features;        // of `mesh`
  std::vector<double> density;  // for Surface
  double unit_edge = 0;         // edge length where the density is 1
  std::size_t vertices = 0;     // wanted of the result
  WeldResult welded;            // without its mesh
  DetailResult detail;
  bool noisy = false;  // normals are noise, and Energy::automatic means restricted
};

// The input with its borders joined: within `tolerance`, or, without one, at the same point, if that closes borders and
// makes no edge non-manifold.
WeldResult join_borders(const TriangleMesh& input, const std::optional<double>& tolerance);

// Throws Error as remesh does.
PreparedInput prepare(const TriangleMesh& input, const RemeshOptions& options, const Context& context);

}  // namespace bisector
