#include "host/passes/device_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/passes/packing.h"
#include "kernels/layout/pairs.h"

namespace bisector::host {
namespace {

constexpr double kCellsPerSample = 8;  // area of a large facet that one sample stands for, in areas of a cell

// The outward unit normal of edge k within the facet's plane.
Vec3 edge_normal(const Facet& f, int k) {
  const Vec3 outward = cross(f.corners[(k + 1) % 3] - f.corners[k], f.normal);
  const double length = norm(outward);
  return (1 / length) * outward;
}

// `density`: null where it is 1.
void pack(const Facet& f, const FacetDensity* density, double scale, bool is_double, RealWords& words) {
  const FacetLayout layout = facet_layout(is_double);
  const std::size_t begin = words.count();
  for (const Vec3& corner : f.corners) words.point(scale * corner);
  words.expect_at(begin + layout.normal);
  words.point(f.normal);
  if (!is_double) {
    words.expect_at(begin + layout.edges);
    for (int k = 0; k < 3; ++k) words.point(edge_normal(f, k));
  }
  words.expect_at(begin + layout.density);
  for (int k = 0; k < 3; ++k) words.number(density ? density->at[k] : 1);
  words.expect_at(begin + layout.gradient);
  words.vector(density ? (1 / scale) * density->gradient : Vec3{});
  words.expect_at(begin + layout.words);
}

FacetMeta meta_of(const Facet& f, const FacetSummary& summary) {
  uint bits = f.anchor;
  for (unsigned k = 0; k < 3; ++k) {
    bits |= uint{f.origin[k]} << (kOriginShift + 2 * k);
    bits |= uint{f.rank[k]} << (kRankShift + 2 * k);
  }
  return {{summary.vertex[0], summary.vertex[1], summary.vertex[2]}, summary.triangle, bits};
}

}  // namespace

double device_scale(const Surface& surface) { return std::ldexp(1.0, 24 - std::ilogb(surface.box.diagonal())); }

std::vector<FacetChunk> upload_facets(Device& device, Commands& commands, const Surface& surface, double scale,
                                      bool is_double) {
  constexpr std::size_t kBytes = std::max(kSingleFacetWords * sizeof(float), kDoubleFacetWords * sizeof(double));
  const std::size_t most = device.limits().storage_range / kBytes, n = surface.facets.size();
  std::vector<FacetChunk> chunks;
  for (std::size_t first = 0; first < n; first += most) {
    const std::size_t count = std::min(most, n - first);
    RealWords words(is_double), wholes(is_double);
    words.reserve(count * facet_layout(is_double).words);
    wholes.reserve(count * kMomentWords);
    std::vector<FacetMeta> meta;
    meta.reserve(count);
    for (std::size_t k = first; k < first + count; ++k) {
      pack(surface.facets[k], surface.density_of(k), scale, is_double, words);
      meta.push_back(meta_of(surface.facets[k], surface.summaries[k]));
      wholes.moments(scaled(surface.summaries[k].moments, scale));
    }
    chunks.push_back({first, count, Buffer(device), Buffer(device), Buffer(device)});
    upload(commands, chunks.back().words, words);
    upload(commands, chunks.back().meta, meta);
    upload(commands, chunks.back().wholes, wholes);
    commands.run();
  }
  return chunks;
}

FacetSamples plan_batches(const Surface& surface, const std::vector<FacetChunk>& chunks, std::size_t seeds,
                          double batch_pairs) {
  FacetSamples plan;
  const double density = static_cast<double>(seeds) / surface.area;
  std::size_t chunk = 0;
  double batch = 0;
  plan.batches.push_back({0, 0, 0, 0});
  for (std::size_t k = 0; k < surface.facets.size(); ++k) {
    const Facet& f = surface.facets[k];
    const Vec3 u = f.corners[1] - f.corners[0], v = f.corners[2] - f.corners[0];
    const double area = 0.5 * dot(f.normal, cross(u, v));
    const double perimeter = norm(u) + norm(v) + norm(v - u);
    // Cells that a random triangle meets: those of its area, those that cross its border (Santalo, integral geometry; a
    // random planar Voronoi diagram has edges of length 2 per unit of area at density 1), and one.
    const double cells = 1 + area * density + 2 / std::numbers::pi * perimeter * std::sqrt(density);
    plan.expected_pairs += cells;
    const bool next_chunk = k == chunks[chunk].first + chunks[chunk].count;
    if (next_chunk) ++chunk;
    if (next_chunk || (batch + cells > batch_pairs && batch > 0)) {
      plan.batches.push_back({k, 0, plan.points.size(), 0});
      batch = 0;
    }
    batch += cells;
    FacetBatch& current = plan.batches.back();
    ++current.count;
    const int rows = static_cast<int>(std::sqrt(2 * area * density / kCellsPerSample));
    if (rows < 2) continue;
    for (int i = 0; i < rows; ++i)
      for (int j = 0; i + j < rows; ++j) {
        const double a = (i + 1.0 / 3) / rows, b = (j + 1.0 / 3) / rows;
        plan.points.push_back(f.corners[0] + a * u + b * v);
        plan.facets.push_back(static_cast<Index>(k));
        ++current.sample_count;
      }
  }
  return plan;
}

}  // namespace bisector::host
