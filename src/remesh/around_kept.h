// Remeshing around triangles that stay as they are.
#pragma once

#include <functional>

#include "bisector/remesh.h"

namespace bisector {

// Remeshes a surface of which nothing is kept but vertices and edges.
using RemeshSurface = std::function<RemeshResult(const TriangleMesh&, const RemeshOptions&, const Context&)>;

// Takes the triangles out that are to be kept, remeshes the rest with the edges along them kept whole, and puts both
// together. Throws as remesh(), and Error if an index is none of a triangle or nothing is left to be remeshed.
RemeshResult remesh_around_kept(const TriangleMesh& input, const RemeshOptions& options, const Context& context,
                                const RemeshSurface& remesh_surface);

}  // namespace bisector
