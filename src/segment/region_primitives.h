// The surfaces that finished regions are reported with (thesis 2.3.3, "Quadric surface classification").
#pragma once

#include <vector>

#include "bisector/context.h"
#include "bisector/segment.h"
#include "core/geometry.h"
#include "segment/proxy.h"
#include "segment/segment_domain.h"

namespace bisector {

// For each region, in the domain's coordinates: the simplest of plane, sphere, circular cylinder, circular cone and
// torus that fits its vertices as well as the best of them and the general quadric, up to what noise may explain; else
// that quadric. Vertices shared with other regions are left out where enough others remain.
std::vector<Primitive> region_primitives(const SegmentDomain& domain, const std::vector<Index>& labels,
                                         std::size_t count, const std::vector<Proxy>& proxies, SegmentSurfaces surfaces,
                                         const Context& context);

// Tries simpler types with the borders moved to where they then belong: a few triangles of another surface, across a
// border without a crease, may bend what was fitted to them. Kept where the sum of squared distances grows by no more
// than noise may explain. Adds the distances it takes to `evaluations`.
void simplify_primitives(const SegmentDomain& domain, SegmentSurfaces surfaces, std::vector<Index>& labels,
                         std::vector<Primitive>& primitives, std::size_t& evaluations, const Context& context);

// Exchanges primitives for the proxies they came from, those first that gain most by it, until the sum of squared
// distances is at most `most`.
void take_proxies(const SegmentDomain& domain, const std::vector<Index>& labels, const std::vector<Proxy>& proxies,
                  double most, std::vector<Primitive>& primitives);

// The same surfaces fitted anew to regions that have changed a little.
void refine_primitives(const SegmentDomain& domain, const std::vector<Index>& labels,
                       std::vector<Primitive>& primitives, const Context& context);

}  // namespace bisector
