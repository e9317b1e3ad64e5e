#include "remesh/feature_seeds.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/geometry.h"
#include "core/parallel.h"
#include "mesh/topology.h"

namespace bisector {
namespace {

// Position k / n of the way along the measures of a curve's seeds, linear in between.
double interpolate(const std::vector<double>& measures, double fraction) {
  const double at = fraction * static_cast<double>(measures.size() - 1);
  const std::size_t k = std::min(static_cast<std::size_t>(at), measures.size() - 2);
  return measures[k] + (at - static_cast<double>(k)) * (measures[k + 1] - measures[k]);
}

void append_corners(const FeatureCurves& curves, PlacedSeeds& placed) {
  for (Index c = 0; c < curves.graph().corners.size(); ++c) {
    placed.add(curves.corner(c), {SeedPlace::Kind::fixed, kNone, c, 0});
  }
}

}  // namespace

CurveMeasure::CurveMeasure(const Surface& surface, const FeatureCurves& curves) : curves_(curves) {
  const std::vector<double>& density = surface.density;
  const auto fourth_root = [&](Index v) { return density.empty() ? 1.0 : std::sqrt(std::sqrt(density[v])); };
  for (Index c = 0; c < curves.size(); ++c) {
    const FeatureCurve& curve = curves.graph().curves[c];
    std::vector<double> sums{0};
    for (std::size_t k = 0; k < curves.segments(c); ++k) {
      const double a = fourth_root(curve.vertices[k]), b = fourth_root(curve.vertices[(k + 1) % curve.vertices.size()]);
      sums.push_back(sums.back() + 0.5 * (a + b) * (curves.position_of(c, k + 1) - curves.position_of(c, k)));
    }
    sums_.push_back(std::move(sums));
  }
  surface_ = fixed_sum(surface.facets.size(), [&](std::size_t k) {
    const Facet& f = surface.facets[k];
    const double area = 0.5 * dot(f.normal, cross(f.corners[1] - f.corners[0], f.corners[2] - f.corners[0]));
    const FacetDensity* of_facet = surface.density_of(k);
    if (!of_facet) return area;
    const auto& r = of_facet->at;
    return area * (std::sqrt(r[0]) + std::sqrt(r[1]) + std::sqrt(r[2])) / 3;
  });
  const EdgeTable table = edge_table(surface.mesh.triangles, surface.mesh.vertices.size());
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    if (table.half_edges.size(e) != 1) continue;
    const auto [a, b] = table.edges[e];
    border_ += 0.5 * (fourth_root(a) + fourth_root(b)) * norm(surface.mesh.vertices[b] - surface.mesh.vertices[a]);
  }
}

double CurveMeasure::scale(std::size_t vertices) const {
  // N c^2 - border / 2 c - (2 / sqrt 3) surface = 0
  const double n = static_cast<double>(vertices), half = border_ / 4;
  return (half + std::sqrt(half * half + n * (2 / std::numbers::sqrt3) * surface_)) / n;
}

double CurveMeasure::at(Index curve, double position) const {
  const std::size_t k = curves_.segment_at(curve, position);
  const double from = curves_.position_of(curve, k), to = curves_.position_of(curve, k + 1);
  const double t = to > from ? std::clamp((position - from) / (to - from), 0.0, 1.0) : 0;
  return sums_[curve][k] + t * (sums_[curve][k + 1] - sums_[curve][k]);
}

double CurveMeasure::position(Index curve, double measure) const {
  const std::vector<double>& sums = sums_[curve];
  const auto above = std::upper_bound(sums.begin() + 1, sums.end() - 1, measure);
  const std::size_t k = static_cast<std::size_t>(above - sums.begin()) - 1;
  const double t = sums[k + 1] > sums[k] ? std::clamp((measure - sums[k]) / (sums[k + 1] - sums[k]), 0.0, 1.0) : 0;
  const double from = curves_.position_of(curve, k), to = curves_.position_of(curve, k + 1);
  return from + t * (to - from);
}

double CurveMeasure::edge_length(Index curve, double position, double c) const {
  const std::size_t k = curves_.segment_at(curve, position);
  const double length = curves_.position_of(curve, k + 1) - curves_.position_of(curve, k);
  const double measure = sums_[curve][k + 1] - sums_[curve][k];
  return measure > 0 ? c * length / measure : c;
}

std::size_t CurveMeasure::edges(Index curve, double c) const {
  const auto [first, last] = curves_.ends(curve);
  const std::size_t least = first == last ? 3 : 1;
  return std::max(least, static_cast<std::size_t>(std::lround(whole(curve) / c)));
}

PlacedSeeds seeds_on_features(const FeatureCurves& curves, const CurveMeasure& measure, double c) {
  return seeds_on_features(curves, measure, c, {});
}

PlacedSeeds seeds_on_features(const FeatureCurves& curves, const CurveMeasure& measure, double c,
                              const std::vector<SeedPlace>& coarse) {
  std::vector<std::vector<double>> on(curves.size());
  for (const SeedPlace& place : coarse)
    if (place.curve != kNone) on[place.curve].push_back(measure.at(place.curve, place.position));
  PlacedSeeds placed;
  append_corners(curves, placed);
  for (Index curve = 0; curve < curves.size(); ++curve) {
    std::vector<double>& rows = on[curve];
    std::sort(rows.begin(), rows.end());
    const double whole = measure.whole(curve);
    if (!curves.closed(curve)) rows.insert(rows.begin(), 0.0);
    else if (rows.empty()) rows.push_back(0.0);
    rows.push_back(curves.closed(curve) ? rows.front() + whole : whole);
    const std::size_t count = measure.edges(curve, c);
    for (std::size_t k = curves.closed(curve) ? 0 : 1; k < count; ++k) {
      double at = interpolate(rows, static_cast<double>(k) / static_cast<double>(count));
      if (at >= whole) at -= whole;
      const double position = measure.position(curve, at);
      placed.add(curves.point(curve, position), {SeedPlace::Kind::curve, curve, kNone, position});
    }
  }
  return placed;
}

}  // namespace bisector
