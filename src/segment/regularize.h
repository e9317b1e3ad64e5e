// Parameters that several surfaces share, found from what the data leave uncertain.
#pragma once

#include <vector>

#include "bisector/segment.h"
#include "core/geometry.h"
#include "segment/segment_domain.h"

namespace bisector {

// Makes directions of planes, cylinders, cones and tori parallel and perpendicular, axes and planes coincident, radii
// and angles equal, in the order of GlobFit (Li et al. 2011): orientations, places, sizes, each fitted anew with what
// was made equal before held. Two values are made equal where that is likelier than that they lie so near each other by
// chance (a Bayes factor): their difference and its covariance, from the residuals of the fits, against values spread
// evenly over all that are possible, times the number of values there are to choose from. A region whose squared
// distances grow by more than noise may explain is left out. Changes `primitives`, in the domain's coordinates; other
// types stay. Lengths in the relations are in the mesh's unit.
std::vector<SegmentRelation> regularize(const SegmentDomain& domain, const std::vector<Index>& labels,
                                        std::vector<Primitive>& primitives);

}  // namespace bisector
