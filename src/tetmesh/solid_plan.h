// Edge lengths of a solid, and what becomes of the features of its surface, before sites are placed.
#pragma once

#include <functional>
#include <optional>

#include "bisector/tetmesh.h"
#include "features/size_field.h"
#include "tetmesh/tet_sizing.h"

namespace bisector {

struct SolidPlan {
  SizedSolid sized;
  FeatureGraph features;           // of the surface
  std::optional<SizeField> bound;  // of edge lengths, where details of the surface are finer
  DetailResult detail;

  const SizeField* bounds() const { return bound ? &*bound : nullptr; }
};

// The surface of a solid refined from the one given, on its vertices.
using SurfaceOf = std::function<TriangleMesh(const TetMesh&)>;

// `surface` is what features and details are those of, on the solid's vertices. Throws Error as refine_for_sizes does,
// and if the result would have too few vertices.
SolidPlan plan_solid(const TetMesh& mesh, const TriangleMesh& surface, const SurfaceOf& surface_of,
                     const TetOptions& options);

// Throws Error unless the options ask for one thing, and enough of it.
void check_options(const TetOptions& options);

}  // namespace bisector
