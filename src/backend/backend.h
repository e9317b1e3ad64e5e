// The contract between the optimiser and whatever computes restricted Voronoi diagrams.
#pragma once

#include <string>
#include <vector>

#include "bisector/device.h"
#include "core/geometry.h"
#include "voronoi/restricted.h"

namespace bisector {

// A backend holds one domain: a surface, or a solid (cvt/solid_backend.h). Every backend returns the same pairs and labels for the same seeds; moments agree to
// rounding, and runs repeat bit for bit.
class Backend {
 public:
  virtual ~Backend() = default;

  // The surface, or the boundary of the solid.
  virtual const Surface& surface() const = 0;
  // Integral of the density over the domain.
  virtual double mass() const { return surface().mass; }
  virtual BackendDescription description() const = 0;
  // By how much, relative to the whole, rounding may make the sum of all masses miss the surface's.
  virtual double mass_tolerance() const = 0;
  // Energies nearer than this, relative, may compare wrongly because of rounding; 0 if comparing them is good enough.
  virtual double energy_noise() const { return 0; }
  // Moments of all cells of the seeds' diagram. After a DeviceError neither results nor backend are good for anything.
  virtual void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) = 0;
  // The same, and the polygons of cells and surface.
  virtual void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) = 0;
};

}  // namespace bisector
