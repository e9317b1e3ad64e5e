// Optimising seeds on a surface by centroidal Voronoi tessellation (thesis 4.4.2), without the rest of remeshing.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "bisector/device.h"
#include "bisector/export.h"
#include "bisector/mesh.h"

namespace bisector {

struct CvtOptions {
  int iterations = 100;     // accepted steps of L-BFGS at most
  double tolerance = 1e-6;  // ends when the energy falls by less than this share per step, over five steps
  bool constrained = true;  // seeds end on the surface (CCVT); otherwise they may leave it (RCVT)
  ComputeOptions compute;
  unsigned threads = 0;  // 0: all cores
};

struct CvtResult {
  std::vector<Vec3> seeds;   // as many as were given, in their order
  double energy = 0;         // sum over the cells of the integral of density times squared distance to the seed
  double gradient_norm = 0;  // Euclidean norm over all seeds, of the tangential part where constrained
  int iterations = 0;
  int evaluations = 0;  // diagrams computed
  BackendDescription device;
};

// Moves seeds to a local minimum of the CVT energy. `density`: one positive value per vertex, linear on each triangle;
// empty means 1. Seeds whose cells are empty are put where the energy is highest. No features are kept and topology is
// not looked at: remesh() does both. The same bits for any number of threads. Throws Error for a mesh without area, a
// density that is not positive and finite, and no seeds; DeviceError if the device asked for is missing or fails;
// Cancelled.
BISECTOR_API CvtResult optimise_seeds(const TriangleMesh& surface, const std::vector<double>& density,
                                      const std::vector<Vec3>& seeds, const CvtOptions& options = {},
                                      const Context& context = {});

}  // namespace bisector
