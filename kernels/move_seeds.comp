#version 460
#extension GL_GOOGLE_include_directive : require
// A step of all seeds along the direction, and back to where they are held: the nearest point of their cell's
// triangles, or of their curve near where they were (twin of HostDescent::step and hold in src/cvt/host_descent.cpp).
#include "common.glsl"
#include "double.glsl"

layout(constant_id = 0) const bool kOnTriangles = false;  // seeds are held on the surface

layout(std430, binding = 0) readonly buffer Seeds { double seeds[]; };
layout(std430, binding = 1) readonly buffer Direction { double direction[]; };
layout(std430, binding = 2) writeonly buffer Moved { double moved[]; };
layout(std430, binding = 3) readonly buffer Places { uint places[]; };
layout(std430, binding = 4) readonly buffer Positions { double positions[]; };  // along each seed's curve
layout(std430, binding = 5) writeonly buffer MovedPositions { double moved_positions[]; };
layout(std430, binding = 6) readonly buffer Curves { uint curves[]; };
layout(std430, binding = 7) readonly buffer Segments { double segments[]; };
layout(std430, binding = 8) buffer Beyond { uint beyond[]; };                   // bits kFarSeeds, ...
layout(std430, binding = 9) readonly buffer Ranges { uvec2 ranges[]; };         // of each seed's triangles
layout(std430, binding = 10) readonly buffer Triangles { uint triangles[]; };
layout(std430, binding = 11) readonly buffer FacetOf { uint facet_of[]; };      // each triangle
layout(std430, binding = 12) readonly buffer Facets { double facet_words[]; };
layout(std430, binding = 13) readonly buffer Normals { double normals[]; };
layout(std430, binding = 14) writeonly buffer MovedNormals { double moved_normals[]; };
#define PUSH_MOVE
#include "layout/push.h"
#include "curves.glsl"

dvec3 corner(uint triangle, uint k) {
  const uint at = kDoubleFacetWords * facet_of[triangle] + 3 * k;
  return dvec3(facet_words[at], facet_words[at + 1], facet_words[at + 2]);
}

// Twin of nearest_on_triangle() in src/core/geometry.cpp.
dvec3 nearest_on_triangle(dvec3 p, uint triangle) {
  const dvec3 a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
  precise dvec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot3(ab, ap), d2 = dot3(ac, ap);
  if (d1 <= 0.0LF && d2 <= 0.0LF) return a;
  precise dvec3 bp = p - b;
  const double d3 = dot3(ab, bp), d4 = dot3(ac, bp);
  if (d3 >= 0.0LF && d4 <= d3) return b;
  precise dvec3 q;
  precise double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0LF && d1 >= 0.0LF && d3 <= 0.0LF) {
    precise double whole = d1 - d3;
    q = a + (d1 * reciprocal(whole)) * ab;
    return q;
  }
  precise dvec3 cp = p - c;
  const double d5 = dot3(ab, cp), d6 = dot3(ac, cp);
  if (d6 >= 0.0LF && d5 <= d6) return c;
  precise double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0LF && d2 >= 0.0LF && d6 <= 0.0LF) {
    precise double whole = d2 - d6;
    q = a + (d2 * reciprocal(whole)) * ac;
    return q;
  }
  precise double va = d3 * d6 - d5 * d4;
  precise double from_b = d4 - d3, from_c = d5 - d6;
  if (va <= 0.0LF && from_b >= 0.0LF && from_c >= 0.0LF) {
    precise double whole = from_b + from_c;
    precise dvec3 bc = c - b;
    q = b + (from_b * reciprocal(whole)) * bc;
    return q;
  }
  precise double whole = va + vb + vc;
  const double scale = reciprocal(whole);
  q = a + (vb * scale) * ab + (vc * scale) * ac;
  return q;
}

double squared_distance(dvec3 a, dvec3 b) {
  precise dvec3 d = a - b;
  return norm2(d);
}

// Twin of nearest_on_triangles() in src/cvt/constrain.cpp. The triangle, or kNone if the seed has none.
uint nearest_triangle(uvec2 range, dvec3 p, out dvec3 at) {
  uint likely = kNone, found = kNone;
  double nearest = 0.0LF;
  [[dont_unroll]] for (uint k = range.x; k < range.y; ++k) {
    const double squared = squared_distance(corner(triangles[k], 0), p);
    if (likely != kNone && squared >= nearest) continue;
    nearest = squared;
    likely = triangles[k];
  }
  if (likely == kNone) return kNone;
  const double limit = squared_distance(nearest_on_triangle(p, likely), p);
  double best = 0.0LF;
  [[dont_unroll]] for (uint k = range.x; k < range.y; ++k) {
    const uint t = triangles[k];
    const dvec3 a = corner(t, 0);
    const double side = max(squared_distance(corner(t, 1), a), squared_distance(corner(t, 2), a));
    precise double reach = 2.0LF * (1.0LF + 1e-9LF) * (limit + side);
    if (squared_distance(a, p) > reach) continue;
    const dvec3 q = nearest_on_triangle(p, t);
    const double squared = squared_distance(q, p);
    if (found != kNone && squared >= best) continue;
    best = squared;
    at = q;
    found = t;
  }
  return found;
}

void main() {
  const uint i = invocation();
  if (i >= count) return;
  const dvec3 before = dvec3(seeds[3 * i], seeds[3 * i + 1], seeds[3 * i + 2]);
  const dvec3 way = dvec3(direction[3 * i], direction[3 * i + 1], direction[3 * i + 2]);
  precise dvec3 p = before + step_length * way;
  if (kOnTriangles) {
    dvec3 at;
    const uint t = nearest_triangle(ranges[i], p, at);
    for (uint k = 0; k < 3; ++k)
      moved_normals[3 * i + k] =
          t == kNone ? normals[3 * i + k] : facet_words[kDoubleFacetWords * facet_of[t] + kDoubleFacetNormalAt + k];
    if (t != kNone) p = at;
  }
  const uint place = places[i];
  if (place == kFixed) {
    p = before;
  } else if (place != kOnSurface) {
    precise dvec3 moved_by = p - before;
    precise double reach = 2.0LF * (abs(moved_by.x) + abs(moved_by.y) + abs(moved_by.z));
    const double position = nearest_on_curve(place, p, positions[i], reach);
    moved_positions[i] = position;
    p = curve_point(place, position);
  }
  for (uint k = 0; k < 3; ++k) moved[3 * i + k] = p[k];
  // A number that is none is far, too.
  if (!(largest_of(p) <= farthest)) atomicOr(beyond[0], kFarSeeds);
  if (!loops_complete(two)) atomicOr(beyond[0], kLongLoops);
}
