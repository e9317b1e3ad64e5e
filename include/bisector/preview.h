// Pictures of meshes as PNG, by a small software renderer: shaded, anti-aliased, with mesh edges drawn.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

struct PreviewOptions {
  int width = 1200, height = 900;                     // pixels
  double azimuth = 30, elevation = 20;                // of the camera about the model's centre, degrees; y is up
  bool edges = true;                                  // draw polygon edges
  bool outlines = false;                              // draw the lines where the colour changes
  std::vector<std::array<unsigned char, 3>> colours;  // per polygon; empty: one neutral colour
};

// Renders polygons (each convex and planar or nearly so). Throws Error if the file cannot be written.
BISECTOR_API void write_preview(const std::string& path, const std::vector<Vec3>& vertices, const Csr<Index>& polygons,
                                const PreviewOptions& options = {});
BISECTOR_API void write_preview(const std::string& path, const TriangleMesh& mesh, const PreviewOptions& options = {});

// Renders the mesh without the tetrahedra of the half that faces the camera, the cut in the colours of regions, or, of
// one region, in another than the boundary. Throws Error if the file cannot be written.
BISECTOR_API void write_tet_preview(const std::string& path, const TetMesh& mesh);

}  // namespace bisector
