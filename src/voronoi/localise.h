// Restricted cells without their stray parts.
//
// Near a fold of the surface, a thin wall or a thin limb a seed also owns pieces of the sheet across, apart from its
// own part of the surface. In the localised restricted Voronoi diagram (Yan, Bao, Zhang and Wonka 2014, "Low-resolution
// remeshing using the localized restricted Voronoi diagram") a cell is what its seed owns of the surface around itself:
// what stray pieces cover together is divided among the cells around it, until every cell is one piece. Its dual
// follows the surface with far fewer seeds, and its energy spreads the seeds over each sheet for itself.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "core/geometry.h"
#include "voronoi/diagram.h"
#include "voronoi/surface.h"

namespace bisector {

class Localiser {
 public:
  // The surface must outlive the object.
  explicit Localiser(const Surface& surface);
  ~Localiser();

  // Gives each component of a cell that is not the one nearest to the seed to the cells whose own components border on
  // it and on what it borders on of the kind; where there are none it stays. `diagram` is that of the seeds, with its
  // polygons; these and the moments become those of the localised cells. The result depends on seeds and labels alone,
  // and polygons tile the surface as before. Returns how many cells had such components.
  std::size_t localise(const std::vector<Vec3>& seeds, Diagram& diagram);
  // That number alone.
  std::size_t count_strays(const std::vector<Vec3>& seeds, const Diagram& diagram);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace bisector
