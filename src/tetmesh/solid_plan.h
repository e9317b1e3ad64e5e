// Edge lengths of a solid, and what becomes of the features of its surface, before sites are placed.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "bisector/tetmesh.h"
#include "features/size_field.h"
#include "tetmesh/tet_sizing.h"

namespace bisector {

inline constexpr std::size_t kFewest = 8;  // vertices or seeds that a result can be made of

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

}  // namespace bisector
