// A small software renderer for previews: shaded, anti-aliased, with mesh edges drawn, written as PNG.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/geometry.h"

namespace bisector {

struct PreviewOptions {
  int width = 1200, height = 900;         // pixels
  double azimuth = 30, elevation = 20;    // of the camera about the model's centre, degrees; y is up
  bool edges = true;                      // draw polygon edges
  bool outlines = false;                  // draw the lines where the colour changes
  std::vector<std::array<unsigned char, 3>> colours;  // per polygon; empty: one neutral colour
};

// Renders polygons (each convex and planar or nearly so). Throws Error if the file cannot be written.
void write_preview(const std::string& path, const std::vector<Vec3>& vertices, const Csr<Index>& polygons,
                   const PreviewOptions& options = {});
void write_preview(const std::string& path, const TriangleMesh& mesh, const PreviewOptions& options = {});

}  // namespace bisector
