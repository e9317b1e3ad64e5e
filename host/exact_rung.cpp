#include "host/exact_rung.h"

#include "bisector/core/parallel.h"
#include "bisector/voronoi/owner.h"

namespace bisector::host {
namespace {

constexpr double kFirstRadius = 3;  // in typical spacings; the first growth multiplies it

}  // namespace

void ExactRung::begin(const SortedSeeds& seeds, const Neighbours* neighbours, double spacing) {
  seeds_ = &seeds;
  given_ = neighbours;
  spacing_ = spacing;
  built_ = false;
}

const Neighbours& ExactRung::neighbours() {
  if (given_) return *given_;
  if (!built_) own_.build_on_demand(*seeds_, kFirstRadius * spacing_);
  built_ = true;
  return own_;
}

std::vector<Index> ExactRung::owners(const std::vector<Index>& sites) {
  const Neighbours& near = neighbours();
  std::vector<Index> slots(sites.size());
  parallel_each(
      sites.size(),
      [&](std::size_t k) {
        const Vec3& q = surface_.mesh.vertices[surface_.sites[sites[k]]];
        slots[k] = find_owner(*seeds_, near, q, near.nearest(q));
      },
      64);
  return slots;
}

std::vector<ExactPolygon> ExactRung::clip(const std::vector<Item>& items) {
  const Neighbours& near = neighbours();
  std::vector<ExactPolygon> polygons(items.size());
  parallel_chunks(items.size(), 64, [&](std::size_t, std::size_t begin, std::size_t end) {
    Clipper clipper;
    clipper.reset(*seeds_);
    for (std::size_t k = begin; k < end; ++k) {
      clipper.begin(surface_.facets[items[k].facet]);
      if (!clipper.clip(near, items[k].slot)) continue;
      ExactPolygon& polygon = polygons[k];
      polygon.empty = false;
      polygon.moments = surface_.density.empty() ? clipper.integrate<true>() : clipper.integrate<false>();
      for (std::size_t e = 0; e < clipper.size(); ++e) polygon.labels.push_back(clipper.label(e));
    }
  });
  return polygons;
}

}  // namespace bisector::host
