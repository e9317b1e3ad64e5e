// Axes and radii of grown limbs, by what their points and their radii say.
#pragma once

#include <vector>

#include "bisector/context.h"
#include "core/geometry.h"
#include "tree/limb.h"

namespace bisector {

// Of radii that rest on points as the noise lets them, those stay `fitted` that the pipe model confirms within a
// factor: of a cloud of twigs a tube can be fitted that looks right but is far too thick. `expected` are the same limbs
// with the model's radii.
void confirm_radii(const std::vector<Vec3>& points, double noise, const std::vector<Limb>& expected,
                   std::vector<Limb>& limbs);

// Fits a tube to the points near each limb, and takes it from the base up to the last place where its radius rests on
// points. Radii must be there, as a measure of how far points of a limb may be.
void refit_limbs(const std::vector<Vec3>& points, double tolerance, double noise, std::vector<Limb>& limbs,
                 const Context& context);

// Where no points carry the radius axes bend no more sharply than their radius, for ways along single points wind
// within the branch. Children start on their parent's axis again.
void straighten_limbs(const std::vector<Vec3>& points, double tolerance, std::vector<Limb>& limbs);

}  // namespace bisector
