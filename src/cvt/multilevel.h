// Seeds to start from, and from one level of seeds to the next finer one.
#pragma once

#include <cstdint>
#include <vector>

#include "backend/backend.h"
#include "features/curves.h"

namespace bisector {

// `count` random points, density-weighted by sqrt(rho) (thesis 4.4.1), at least four on each closed component of the
// surface where the count allows it.
std::vector<Vec3> initial_seeds(const Surface& surface, std::size_t count, std::uint64_t random_seed);

// Seeds per level, coarse to fine, the last being `count`: refining by edge midpoints turns V vertices into 4 V - 3 chi on
// a closed surface of Euler characteristic chi. `levels` 0 means as many as leave the coarsest enough seeds, at most 3.
std::vector<std::size_t> level_counts(std::size_t count, long long euler, std::size_t components, int levels);

// The seeds, and the middle of every two of them that share a restricted Voronoi edge, moved to that edge where it is far off.
// To come near `count`, the shortest edges get none, or the cells of highest energy one more at a corner; the result may have
// fewer than `count` seeds if there are too few edges, never more unless there are more seeds already.
std::vector<Vec3> refine(const RestrictedPolygons& polygons, const CellMoments& moments, const std::vector<Vec3>& seeds,
                         std::size_t count);

// The same where seeds are held on features: all that are not on the surface are replaced by `features`, and two that follow
// each other on a curve get no midpoint.
PlacedSeeds refine(const RestrictedPolygons& polygons, const CellMoments& moments, const PlacedSeeds& coarse,
                   const FeatureCurves& curves, const PlacedSeeds& features, std::size_t count);

// Removes one end of the shortest dual edges, or adds seeds where the energy is highest, to come as near to `count` as one
// seed per edge or cell allows. `polygons` and `moments` are those of the seeds given. Only seeds on the surface are removed;
// `places` is parallel to the seeds, or empty.
void set_count(const RestrictedPolygons& polygons, const CellMoments& moments, std::size_t count,
               std::vector<Vec3>& seeds, std::vector<SeedPlace>& places);

// Pairs of seeds that follow each other on a feature curve, corners included, lower first, sorted.
std::vector<std::array<Index, 2>> curve_neighbours(const FeatureCurves& curves, const std::vector<SeedPlace>& places);

// Up to `count` points to insert: corners of cells farthest from their seeds, cells of highest energy first, no two points
// from neighbouring cells before every cell had its turn. Only cells of seeds on the surface are used.
std::vector<Vec3> insertion_points(const RestrictedPolygons& polygons, const std::vector<Vec3>& seeds,
                                   const std::vector<SeedPlace>& places, const CellMoments& moments, std::size_t count);

}  // namespace bisector
