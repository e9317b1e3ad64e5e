// Seeds to start from, and from one level of seeds to the next finer one.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cvt/run.h"

namespace bisector {

// `count` random points, density-weighted by sqrt(rho) (thesis 4.4.1), at least four on each closed component of the
// surface where the count allows it.
std::vector<Vec3> initial_seeds(const Surface& surface, std::size_t count, std::uint64_t random_seed);

// Seeds per level, coarse to fine, the last being `count`: refining by edge midpoints turns V vertices into 4 V - 3 chi
// on a closed surface of Euler characteristic chi. `levels` 0 means as many as leave the coarsest enough seeds, at
// most 3.
std::vector<std::size_t> level_counts(std::size_t count, long long euler, std::size_t components, int levels);

// The seeds of a finer level: those on the surface of `coarse`, and the middle of every two seeds that share a
// restricted Voronoi edge, moved to that edge where it is far off. All that are held on features are replaced by
// `on_features`, and two that follow each other on a curve get no midpoint. To come near `count`, the shortest edges
// get none, or the cells of highest energy one more at a corner; the result may have fewer than `count` seeds if there
// are too few edges, never more unless there are more already. `diagram` is that of `coarse`, with polygons.
PlacedSeeds refine(const Diagram& diagram, const PlacedSeeds& coarse, const FeatureCurves& curves,
                   const PlacedSeeds& on_features, std::size_t count);

// Removes one end of the shortest dual edges, or adds seeds where the energy is highest, until there are `count` seeds
// or no more can be had. Only seeds on the surface are removed. Throws Cancelled.
void meet_count(CvtRun& run, std::size_t count);

// One round of that: as near to `count` as one seed per edge or cell allows. `diagram` is that of the seeds, with
// polygons.
void set_count(const Diagram& diagram, std::size_t count, PlacedSeeds& seeds);

// For seeds that were optimised for another density: adds some in cells with the energy of several, and removes as many
// ends of the shortest edges. Throws Cancelled.
void follow_density(CvtRun& run);

// Pairs of seeds that follow each other on a feature curve, corners included, lower first, sorted.
std::vector<std::array<Index, 2>> curve_neighbours(const FeatureCurves& curves, const std::vector<SeedPlace>& places);

// Up to `count` points to insert: corners of cells farthest from their seeds, cells of highest energy first, no two
// points from neighbouring cells before every cell had its turn. Only cells of seeds on the surface are used. `diagram`
// is that of the seeds, with polygons.
std::vector<Vec3> insertion_points(const Diagram& diagram, const PlacedSeeds& seeds, std::size_t count);

}  // namespace bisector
