// Curves of which simplify_features chooses, and what it asks of chains of vertices.
#pragma once

#include <cstddef>
#include <vector>

#include "bisector/features.h"
#include "core/geometry.h"

namespace bisector {

// A curve between corners that remain.
struct Candidate {
  FeatureCurve curve;
  double weight = 0;  // curve_weights
  double length = 0;
};

inline bool is_crease(const FeatureCurve& curve) { return curve.kind == FeatureKind::crease; }

// A closed curve, or one that ends where it begins.
bool is_loop(const FeatureCurve& curve);

std::vector<Index> reversed_vertices(std::vector<Index> vertices);

double length_of(const std::vector<Index>& chain, bool closed, const std::vector<Vec3>& vertices);

// Arc lengths from the start of a chain to each of its vertices.
std::vector<double> arc_lengths(const std::vector<Index>& chain, const std::vector<Vec3>& vertices);

// Divides a chain at some of its vertices, given by their ascending places in it.
std::vector<std::vector<Index>> divided(const std::vector<Index>& chain, const std::vector<std::size_t>& at);

// A point of a candidate.
struct Sample {
  Vec3 point;
  double position = 0;  // arc length
};

// Points `step` apart.
std::vector<Sample> samples_of(const Candidate& candidate, const std::vector<Vec3>& vertices, double step);

}  // namespace bisector
