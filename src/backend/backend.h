// The contract between the pipelines and whatever computes Voronoi diagrams.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "backend/seed_descent.h"
#include "bisector/device.h"
#include "bisector/error.h"
#include "core/geometry.h"
#include "voronoi/diagram.h"
#include "voronoi/solid.h"
#include "voronoi/surface.h"

namespace bisector {

DeviceSeconds& operator+=(DeviceSeconds& a, const DeviceSeconds& b);
DiagramSeconds& operator+=(DiagramSeconds& a, const DiagramSeconds& b);
DeviceWork& operator+=(DeviceWork& a, const DeviceWork& b);

// A backend holds one domain, which must outlive it: a surface, or a solid. Every backend returns the same pairs and
// labels for the same seeds; moments agree to rounding, and runs repeat bit for bit.
class Backend {
 public:
  virtual ~Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;

  // The surface, or the boundary of the solid. A backend whose surface is in no one place has none: std::logic_error.
  const Surface& surface() const;
  // Of that surface; 0 if there is none.
  std::size_t facet_count() const { return surface_ ? surface_->facets.size() : 0; }
  // Integral of the density over the domain.
  double mass() const { return mass_; }
  virtual BackendDescription description() const = 0;
  // By how much, relative to the whole, rounding may make the sum of all masses miss the domain's.
  virtual double mass_tolerance() const = 0;
  // Energies nearer than this, relative, may compare wrongly because of rounding; 0 if comparing them is good enough.
  virtual double energy_noise() const { return 0; }

  // Computes the diagram of the seeds: its moments and the parts of it that are wanted. Other parts are emptied; memory
  // is used again. Wanting the dual includes the polygons. Only a backend of a solid has polyhedra. Throws Error if
  // there are no seeds; after a DeviceError neither diagram nor backend are good for anything.
  EvaluationReport evaluate(const std::vector<Vec3>& seeds, Want want, Diagram& diagram);
  // A descent whose seeds stay where the backend computes; null if they are to be on the host. The backend and the
  // curves must outlive it, and it may not be used any more once the backend has evaluated other seeds.
  virtual std::unique_ptr<ResidentDescent> descend(const DescentStart&) { return nullptr; }
  // Moves seeds to the nearest points of the triangles of their cells, as project_to_cells() does. The cells are those
  // of a diagram that had the parts of projected(): of the last one, or of the one that the last call was about.
  virtual void project(const CellMoments& cells, std::span<const SeedPlace> places, std::span<Vec3> seeds,
                       std::vector<Vec3>& normals);
  virtual Want projected() const { return Want::triangles; }
  // Goes on without the device after an error of it outside evaluate(); throws the error if there is no way to.
  virtual void give_up(const DeviceError& error) { throw error; }

 protected:
  explicit Backend(const Surface& surface) : Backend(surface, surface.mass, Want::polygons) {}
  // `offers`: of the dual, polygons and polyhedra what compute() sets.
  Backend(const Surface& boundary, double mass, Want offers) : surface_(&boundary), mass_(mass), offers_(offers) {}
  // Without a surface.
  Backend(double mass, Want offers) : mass_(mass), offers_(offers) {}

  // Sets the moments and, of what the backend offers, those that are wanted. There are seeds.
  virtual EvaluationReport compute(const std::vector<Vec3>& seeds, Want want, Diagram& diagram) = 0;

 private:
  const Surface* surface_ = nullptr;
  double mass_;
  Want offers_;  // parts that compute() can set
};

// A backend whose cells are those of a solid: masses, centroids and energies are integrals over volumes, and triangles
// and polygons those of the solid's boundary.
class SolidBackend : public Backend {
 public:
  const Solid& solid() const { return solid_; }

 protected:
  explicit SolidBackend(const Solid& solid)
      : Backend(solid.boundary, solid.mass, Want::polygons | Want::polyhedra), solid_(solid) {}

 private:
  const Solid& solid_;
};

}  // namespace bisector
