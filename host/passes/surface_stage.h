// Incident pairs of a surface on a device: what backends of surfaces and of solids share.
#pragma once

#include "host/passes/facet_pairs.h"
#include "host/passes/polygon_pass.h"
#include "host/passes/seed_stage.h"

namespace bisector::host {

class SurfaceStage {
 public:
  SurfaceStage(SeedStage& seeds, const Surface& surface, const Capacities& capacities);

  // Uploads the seeds that the seed stage has begun with, and finds their lists and the owners of sites and samples.
  void find_owners();
  void find_pairs(Certification& certification) { pairs_.run(job(), certification); }
  std::size_t refine(const Buffer& cells, float share, Certification& certification) {
    return pairs_.refine(job(), cells, share, certification);
  }
  void polygons(bool with_vertices, RestrictedPolygons& polygons) {
    polygon_pass_.run(pairs_, job(), domain_, with_vertices, polygons);
  }

  void learn_speed(std::size_t pairs, double seconds) { pairs_.learn_speed(pairs, seconds); }

  const Surface& surface() const { return surface_; }
  const PairStore& store() const { return store_; }
  // The facets in double precision, where some kernels compute in it.
  const std::vector<FacetChunk>& double_facets() const {
    return seeds_.is_double() ? buffers_.facets : buffers_.double_facets;
  }

 private:
  void record_owners();
  PairJob job() { return {seeds_.commands, seeds_.seeds, seeds_.neighbours, seeds_.counters, store_, domain_}; }

  SeedStage& seeds_;
  const Surface& surface_;
  SurfaceBuffers buffers_;
  OwnerPass sites_, samples_;
  FacetPairs domain_;
  PairPass pairs_;
  PairStore store_;
  PolygonPass polygon_pass_;
  double batch_pairs_;
  std::size_t planned_for_ = 0;
};

}  // namespace bisector::host
