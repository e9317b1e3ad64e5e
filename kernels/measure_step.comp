#version 460
#extension GL_GOOGLE_include_directive : require
// What a step has led to: each seed's gradient and weight, the pair of L-BFGS, and sums over blocks of kSumBlock seeds
// (twin of HostDescent::step and gradient_of in src/cvt/host_descent.cpp).
#include "common.glsl"
#include "double.glsl"
#include "block_sum.glsl"

layout(constant_id = 0) const bool kOnTriangles = false;  // seeds are held on the surface
layout(constant_id = 1) const bool kSingleCells = false;  // cells are in single precision

layout(std430, binding = 0) readonly buffer Cells { uint cells[]; };  // kCellWords reals of each seed's cell
layout(std430, binding = 1) readonly buffer Places { uint places[]; };
layout(std430, binding = 2) readonly buffer Positions { double positions[]; };  // along each seed's curve
layout(std430, binding = 3) readonly buffer Curves { uint curves[]; };
layout(std430, binding = 4) readonly buffer Segments { double segments[]; };
layout(std430, binding = 5) readonly buffer Normals { double normals[]; };
layout(std430, binding = 6) readonly buffer Seeds { double seeds[]; };
layout(std430, binding = 7) readonly buffer Moved { double moved[]; };
layout(std430, binding = 8) readonly buffer Gradient { double gradient[]; };
layout(std430, binding = 9) readonly buffer Direction { double direction[]; };
layout(std430, binding = 10) writeonly buffer MovedGradient { double moved_gradient[]; };
layout(std430, binding = 11) writeonly buffer Weights { double weights[]; };
layout(std430, binding = 12) writeonly buffer Step { double steps[]; };
layout(std430, binding = 13) writeonly buffer Change { double changes[]; };
layout(std430, binding = 14) writeonly buffer Sums { double sums[]; };  // of each block, then of the next kind
#define PUSH_MEASURE
#include "layout/push.h"
#include "curves.glsl"

shared double terms[kStepSums * kGroupSize];
BLOCK_SUM(sum_of_terms, terms)

double cell_number(uint i, uint k) {
  const uint at = kCellWords * i + k;
  if (kSingleCells) return double(uintBitsToFloat(cells[at]));
  return packDouble2x32(uvec2(cells[2 * at], cells[2 * at + 1]));
}

dvec3 held(dvec3 g, uint i) {
  const uint place = places[i];
  if (place == kFixed) return dvec3(0.0LF);
  if (place != kOnSurface) {
    const dvec3 tangent = curve_tangent(place, positions[i]);
    precise dvec3 along = dot3(g, tangent) * tangent;
    return along;
  }
  if (!kOnTriangles) return g;
  const dvec3 normal = dvec3(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
  precise dvec3 tangential = g - dot3(g, normal) * normal;
  return tangential;
}

void main() {
  const uint i = invocation(), lane = lane_of_workgroup();
  if (i < count) {
    const uint at = 3 * i;
    const double mass = cell_number(i, 0);
    precise dvec3 full = -2.0LF * dvec3(cell_number(i, 1), cell_number(i, 2), cell_number(i, 3));
    const dvec3 next = held(full, i), last = dvec3(gradient[at], gradient[at + 1], gradient[at + 2]);
    const dvec3 way = dvec3(direction[at], direction[at + 1], direction[at + 2]);
    precise dvec3 s = dvec3(moved[at], moved[at + 1], moved[at + 2]) - dvec3(seeds[at], seeds[at + 1], seeds[at + 2]);
    precise dvec3 y = next - last;
    for (uint k = 0; k < 3; ++k) {
      moved_gradient[at + k] = next[k];
      steps[at + k] = s[k];
      changes[at + k] = y[k];
    }
    const double step_mass = cell_number(i, kCellStepMassAt);
    precise double diagonal = 2.0LF * (step_mass > 0.0LF ? step_mass : mean_mass);
    weights[i] = reciprocal(diagonal);
    terms[kMassSum * kGroupSize + lane] = mass;
    terms[kEnergySum * kGroupSize + lane] = cell_number(i, kSecondMomentAt);
    terms[kSlopeSum * kGroupSize + lane] = dot3(last, way);
    terms[kNextSlopeSum * kGroupSize + lane] = dot3(next, way);
    terms[kGradientSum * kGroupSize + lane] = norm2(next);
    terms[kSySum * kGroupSize + lane] = dot3(s, y);
    terms[kSsSum * kGroupSize + lane] = norm2(s);
    terms[kYySum * kGroupSize + lane] = norm2(y);
    terms[kEmptySum * kGroupSize + lane] = mass <= 0.0LF && places[i] == kOnSurface ? 1.0LF : 0.0LF;
  }
  barrier();
  const uint kBlocks = kGroupSize / kSumBlock;
  if (lane >= kStepSums * kBlocks) return;
  const uint kind = lane / kBlocks, block = lane % kBlocks;
  const uint first = i - lane + block * kSumBlock;
  if (first >= count) return;
  sums[kind * block_count + first / kSumBlock] =
      sum_of_terms(kind * kGroupSize + block * kSumBlock, min(kSumBlock, count - first));
}
