// Variational segmentation of a mesh into regions of planes, quadrics and tori (thesis chapter 2).
#pragma once

#include <cstdint>
#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "segment/primitive.h"

namespace bisector {

enum class SegmentSurfaces {
  planes,
  quadrics,  // planes and quadrics, as in the thesis
  all        // tori too
};

enum class SegmentStart {
  merging,    // small planar regions merged pairwise, the cheapest first; needs no luck
  insertion,  // one region, others inserted one by one where the error is largest (thesis 2.3.2)
  random      // all regions at once about random triangles (thesis 2.3.1), others inserted if need be
};

struct SegmentOptions {
  std::size_t proxies = 0;  // regions wanted, or 0: as many as `error` takes
  double error = 0.1;       // without `proxies`: root mean square distance to the proxies at most, percent of the diagonal of
                            // the vertices' bounding box
  SegmentSurfaces surfaces = SegmentSurfaces::all;
  SegmentStart start = SegmentStart::merging;
  int iterations = 30;      // Lloyd steps at most, each time
  double smooth = 1;        // lambda, weight of the borders' length (thesis 2.3.3); 0: borders are left as they are. Halved
                            // where the root mean square distance would grow by more than 5 percent
  int fuzzy_rings = 1;      // triangles so many steps from a border may change sides
  bool project = false;     // move the vertices onto the proxies
  std::uint64_t random_seed = 1;  // of the random start
};

struct SegmentRegion {
  Primitive proxy;
  std::size_t triangles = 0;
  double area = 0;
  double rms = 0;  // root mean square distance from vertices and barycentres to the proxy (thesis Eq. 2.3), a length
  double max = 0;  // the largest of these distances, triangles of no area left out
};

struct SegmentSeconds {
  double start = 0, lloyd = 0, improve = 0, smooth = 0, classify = 0, project = 0, total = 0;
};

struct SegmentResult {
  std::vector<Index> labels;           // region of each triangle, in descending order of area
  std::vector<SegmentRegion> regions;  // connected through edges, each of at least one triangle
  double rms = 0;                      // over the whole mesh, a length
  // Sum of Eq. 2.3 over the mesh, scaled to unit longest side, before and after each step of each Lloyd iteration.
  std::vector<std::vector<double>> energies;
  int iterations = 0;                  // Lloyd steps in all
  std::size_t insertions = 0, merges = 0, teleportations = 0, deletions = 0;
  std::size_t evaluations = 0;         // distances of a triangle to a proxy
  double border_before = 0, border_after = 0;  // length of the borders between regions before and after smoothing
  double rms_before = 0;               // before smoothing, a length
  double smooth = 0;                   // the weight that borders were smoothed with
  std::vector<Vec3> projected;         // the vertices on the proxies, with SegmentOptions::project; shared ones averaged
  SegmentSeconds seconds;
};

// Any mesh: open, non-manifold, of several components (each needs a region of its own), with triangles of no area.
// Throws Error for a mesh without area, fewer proxies than components, more than triangles, and options out of range.
SegmentResult segment(const TriangleMesh& mesh, const SegmentOptions& options, const Context& context = {});

}  // namespace bisector
