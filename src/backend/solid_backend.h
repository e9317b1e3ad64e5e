// The contract between the optimiser and whatever computes clipped Voronoi diagrams of solids.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backend/backend.h"
#include "bisector/device.h"
#include "voronoi/clipped.h"

namespace bisector {

// A backend whose cells are those of a solid: masses, centroids and energies are integrals over volumes, and triangles and
// polygons those of the solid's boundary.
class SolidBackend : public Backend {
 public:
  virtual const Solid& solid() const = 0;
  const Surface& surface() const override { return solid().boundary; }
  double mass() const override { return solid().mass; }

  using Backend::evaluate;
  // The same, and the polyhedra.
  virtual void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons,
                        ClippedPolyhedra& polyhedra) = 0;
};

class CpuSolidBackend : public SolidBackend {
 public:
  // The solid must outlive the backend.
  CpuSolidBackend(const Solid& solid, NeighbourSource source, InnerCells inner = InnerCells::whole, std::string fallback = {});

  const Solid& solid() const override { return solid_; }
  BackendDescription description() const override;
  double mass_tolerance() const override { return 1e-12; }
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments) override;
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons) override;
  void evaluate(const std::vector<Vec3>& seeds, CellMoments& moments, RestrictedPolygons& polygons,
                ClippedPolyhedra& polyhedra) override;

 private:
  const Solid& solid_;
  NeighbourSource source_;
  std::string fallback_;
  ClippedVoronoi diagram_;
};

}  // namespace bisector
