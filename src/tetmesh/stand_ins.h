// Solids with fewer tetrahedra that stand in for the whole one while sites move, when the boundary's details do not
// matter, or a density between the sites not yet.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "backend/backend.h"
#include "bisector/tetmesh.h"
#include "compute/compute.h"
#include "features/size_field.h"

namespace bisector {

class StandIns {
 public:
  // `mesh` and `surface` are the solid's as given, `boundary` and `features` those of the solid as refined for its
  // sizes. Everything must outlive the object.
  StandIns(const TetMesh& mesh, const TriangleMesh& surface, Backend& boundary, const FeatureGraph& features,
           const TetOptions& options, const SizeField* bound, Compute& compute, const Context& context);
  ~StandIns();

  // The stand-in for `whole` with `count` of `final_count` sites, with which edges will be so long; null if the solid
  // itself will do. It lasts until the next call.
  SolidBackend* choose(std::size_t count, std::size_t final_count, double edge_length, const SolidBackend& whole);
  // The inside of the coarser boundary that stood in last, for sites on the boundary and inside; null if none did.
  SolidBackend* coarse();
  // What a finished boundary of the result bounds, for `count` sites of which it has the first; null if `whole` itself
  // will do. It lasts until the next call.
  SolidBackend* within(const TriangleMesh& boundary, std::size_t count, const SolidBackend& whole);

 private:
  struct Domain;

  std::unique_ptr<Domain> make_sized(std::size_t count) const;
  std::unique_ptr<Domain> make_coarse(double edge_length) const;
  std::unique_ptr<Domain> make_within(const TriangleMesh& boundary) const;

  const TetMesh& mesh_;
  const TriangleMesh& surface_;
  Backend& boundary_;
  const FeatureGraph& features_;
  const TetOptions& options_;
  const SizeField* bound_;
  Compute& compute_;
  const Context& context_;
  std::unique_ptr<Domain> domain_, within_;
  bool tried_ = false;  // to make a coarse one
};

}  // namespace bisector
