#include "host/passes/boundary_pass.h"

#include <algorithm>

#include "core/grouping.h"
#include "kernels/layout/pairs.h"

namespace bisector::host {

BoundaryPass::BoundaryPass(const Solid& solid, const TetFrame& enclosure)
    : surface_(solid.boundary), cells_(solid.boundary, enclosure),
      polygons_of_([this](Index slot, std::vector<CellPolygon>& found) { polygons_of(slot, found); }) {}

void BoundaryPass::run(const SortedSeeds& seeds, const Neighbours& neighbours, const RestrictedPolygons& polygons,
                       bool want_polyhedra) {
  ++generation_;
  seeds_ = &seeds;
  polygons_ = &polygons;
  group(polygons);
  moments_.assign(seeds.slot.size(), Moments{});
  cells_.evaluate(seeds, neighbours, slots_, polygons_of_, want_polyhedra, moments_);
  list_inside();
}

bool BoundaryPass::settle(const std::vector<Index>& marks) {
  for (const Index slot : cells_.open())
    if (marks[slot] & kMarkMet && cells_.is_open(slot)) cells_.settle_inside(slot);
  list_inside();
  if (std::any_of(inside_.begin(), inside_.end(), [&](Index slot) { return !(marks[slot] & kMarkMet); })) return false;
  cells_.settle_others_outside();
  return true;
}

void BoundaryPass::group(const RestrictedPolygons& polygons) {
  labels_.resize(polygons.labels.size());
  parallel_each(labels_.size(), [&](std::size_t k) {
    const Index label = polygons.labels[k];
    labels_[k] = is_edge(label) ? label : seeds_->slot[label];
  });
  // In order of triangles, as the polygons are.
  of_cell_ = group_into_rows<std::size_t>(seeds_->slot.size(), [&](const auto& put) {
    for (std::size_t p = 0; p < polygons.pairs.size(); ++p) put(polygons.pairs[p].cell, p);
  });
  triangles_.offsets = of_cell_.offsets;
  triangles_.values.resize(of_cell_.values.size());
  for (std::size_t k = 0; k < of_cell_.values.size(); ++k)
    triangles_.values[k] = polygons.pairs[of_cell_.values[k]].triangle;
  slots_.clear();
  marks_.assign(seeds_->x.size(), 0);
  for (Index s = 0; s < seeds_->x.size(); ++s)
    if (triangles_.size(seeds_->id[s])) {
      slots_.push_back(s);
      marks_[s] = kMarkBoundary;
    }
}

void BoundaryPass::polygons_of(Index slot, std::vector<CellPolygon>& found) {
  Worker& worker = workers_.local();
  Clipper& clipper = worker.clipper;
  if (worker.generation != generation_) {
    worker.generation = generation_;
    clipper.reset(*seeds_);
  }
  found.clear();
  const Index cell = seeds_->id[slot];
  for (const std::size_t* p = of_cell_.begin(cell); p != of_cell_.end(cell); ++p) {
    const Index facet = surface_.facet_of[polygons_->pairs[*p].triangle];
    const Index* first = labels_.data() + polygons_->offsets[*p];
    const Index* last = labels_.data() + polygons_->offsets[*p + 1];
    if (std::all_of(first, last, is_edge)) {
      const FacetSummary& summary = surface_.summaries[facet];
      found.push_back({facet, {}, moved(summary.moments, summary.anchor - seeds_->x[slot])});
      continue;
    }
    clipper.begin(surface_, facet);
    clipper.take(slot, first, static_cast<std::size_t>(last - first));
    found.push_back({facet, {first, last}, clipper.integrate()});
  }
}

void BoundaryPass::list_inside() {
  inside_ = cells_.reached();
  std::erase_if(inside_, [&](Index slot) { return marks_[slot] & kMarkBoundary; });
  std::sort(inside_.begin(), inside_.end());
  inside_.erase(std::unique(inside_.begin(), inside_.end()), inside_.end());
}

void BoundaryPass::put_moments(std::vector<Moments>& cells) const {
  for (const Index slot : slots_) cells[seeds_->id[slot]] = moments_[seeds_->id[slot]];
}

double BoundaryPass::mass() const {
  return fixed_sum(slots_.size(), [&](std::size_t k) { return moments_[seeds_->id[slots_[k]]].mass; });
}

}  // namespace bisector::host
