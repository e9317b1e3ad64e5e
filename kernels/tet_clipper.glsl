// Clipping one tetrahedron to one Voronoi cell, the twin of TetClipper in src/voronoi/clip_tet.cpp: labels first,
// coordinates from labels by one formula, and with each vertex a bound of its error, the slack. What the bounds do not
// decide is not decided here: the pair gets a status and goes to exact arithmetic.
//
// To include: `tet_words`, `tet_meta`, `residual`, `ids`, seed(), and the constants kMostPlanes and kMostVertices.

#if BISECTOR_DOUBLE
const real kSquareError = 1e-12LF;   // relative, of |d|^2 with all that is compared with it
const real kTiny = 1e-280LF;         // no product this small is told from 0
const real kReachGrowth = 1e-5LF;    // lists may be in the order of distances in single precision
// Planes that meet at a smaller angle (sine, squared) are left to exact arithmetic, and below the second are met in two
// steps.
const real kSteep = 1e-12LF, kShallow = 1e-8LF;
#else
const real kSquareError = 16 * kUnit;
const real kTiny = 1e-25;
const real kReachGrowth = 1e-3;
const real kSteep = 1e-8;
#endif

// The tetrahedron, as seen from the seed.
uint at_tet;           // first word
uint bits;             // of its whole numbers
real3 local[4];
real largest;          // absolute coordinate of local
real tet_squared;      // upper bound of the squared distance of any point of the tetrahedron
uint own_slot;
Point own;
real absolute_error;   // single: of each coordinate of what is computed in pairs

// Planes n . p = k, the first four the facets'; those that were cut off stay until there is no more room.
real3 plane_n[kMostPlanes];
real plane_k[kMostPlanes];
real plane_squared[kMostPlanes];
uint plane_label[kMostPlanes];
uint plane_count;
bool was_cut, polyhedron_changed;  // ever, and by the last cut

// Vertices, the slack of their coordinates, and their planes, counter-clockwise seen from outside, a byte each.
real3 vertex_at[kMostVertices];
real vertex_slack[kMostVertices];
uint vertex_on[kMostVertices];
uint vertex_count;
real reach;            // upper bound of the polyhedron's squared distance

uvec2 row_of[kMostPlanes];   // of each plane a set of others
uint next_of[kMostPlanes];

uint order_of(uint place) { return (bits >> (2 * place)) & 3u; }
uint anchor_of(uint facet) { return (bits >> (kTetAnchorShift + 2 * facet)) & 3u; }
uint rank_of(uint corner) {
  uint rank = 0;
  for (uint place = 1; place < 4; ++place)
    if (order_of(place) == corner) rank = place;
  return rank;
}

uvec3 planes_of(uint on) { return uvec3(on & 255u, (on >> 8) & 255u, (on >> 16) & 255u); }
uint packed(uint a, uint b, uint c) { return a | b << 8 | c << 16; }
uvec2 bit_of(uint plane) { return plane < 32 ? uvec2(1u << plane, 0u) : uvec2(0u, 1u << (plane - 32)); }
bool in_set(uvec2 set, uint plane) { return ((plane < 32 ? set.x >> plane : set.y >> (plane - 32)) & 1u) != 0; }

// The order of labels: facets, by descending rank of the corner opposite, then seeds by the caller's index.
uint key_of(uint label) {
  return (label & kFacetLabel) != 0 ? 3u - rank_of(label & 3u) : 4u + ids[label].x;
}

void set_seed_plane(uint plane, uint label, real3 d, real squared) {
  plane_n[plane] = d;
  precise real half_squared = real(0.5) * squared;
  plane_k[plane] = half_squared;
  plane_squared[plane] = squared;
  plane_label[plane] = label;
}

void begin_tet(uint tet, uint slot) {
  at_tet = tet * kTetWords;
  bits = tet_meta[tet * kTetMetaWords + kTetBitsAt];
  own_slot = slot;
  own = seed(slot);
  largest = real(0.0);
  tet_squared = real(0.0);
  for (uint m = 0; m < 4; ++m) {
    local[m] = difference(tet_point(at_tet + kPointWords * m), own);
    largest = max(largest, largest_of(local[m]));
    precise real squared = norm2(local[m]) * (real(1.0) + kReachGrowth);
    tet_squared = max(tet_squared, squared);
  }
#if BISECTOR_DOUBLE
  absolute_error = real(0.0);
#else
  precise real error = 4e-12 * largest + 4.0 * residual;
  absolute_error = error;
  precise real far = tet_squared + 8.0 * largest * residual;
  tet_squared = far;
#endif
  const uint corner_facets[4] = uint[4](packed(1, 3, 2), packed(0, 2, 3), packed(0, 3, 1), packed(0, 1, 2));
  for (uint k = 0; k < 4; ++k) {
    const Point normal = tet_point(at_tet + kNormalsAt + kPointWords * k);
    plane_n[k] = normal.high;
#if BISECTOR_DOUBLE
    plane_k[k] = dot3(normal.high, local[anchor_of(k)]);
    vertex_slack[k] = 8 * kUnit * largest;
#else
    plane_k[k] = pair_dot(normal, tet_point(at_tet + kPointWords * anchor_of(k)), own);
    precise real slack = 8 * kUnit * largest_of(local[k]) + absolute_error;
    vertex_slack[k] = slack;
#endif
    plane_squared[k] = real(1.0);
    plane_label[k] = kFacetLabel | k;
    vertex_at[k] = local[k];
    vertex_on[k] = corner_facets[k];
  }
  plane_count = 4;
  vertex_count = 4;
  was_cut = false;
}

// Sets vertex v, two facets and a bisector or one and two or three bisectors, in the order of their keys; false if that
// is not certain. In double it is where TetClipper has it, as is the slack.
//
// In single all terms are at the scale of the cell. With relative rounding errors u and p the vertex, a plane is off
// there by
//   e = u (|p| + 3.5 |n|) + 1.75 r (1 + |p| / |n|)   for a bisector, n reaching from seed to seed and r being what
//                                                    positions lack,
//   e = u (|p| + |k|) + a                            for a facet, from pairs, with a the absolute error of those.
// Cramer's rule adds 6.5 u (|k1 / n1| + |k2 / n2| + |k3 / n3| + |p|) to their sum, all of it over the sine of the
// planes' corner, |det| / (|n1| |n2| |n3|), and 5 u |p|; 6 u |p| is for the products that the vertex is tested in.
#if BISECTOR_DOUBLE
bool meet_on_edge(uint v, uint f, uint g, uint by) {
  const uint not_f = plane_label[f] & 3u, not_g = plane_label[g] & 3u;
  uint ends[2];
  uint n = 0;
  for (uint place = 0; place < 4; ++place) {
    const uint corner = order_of(place);
    if (corner != not_f && corner != not_g && n < 2) ends[n++] = corner;
  }
  precise real3 e = tet_vector(at_tet + 3 * ends[1]) - tet_vector(at_tet + 3 * ends[0]);
  const real slope = dot3(plane_n[by], e);
  precise real square = slope * slope;
  precise real steep = kSteep * (plane_squared[by] * norm2(e));
  if (!(square > steep)) return false;
  const real inverse = reciprocal(slope);
  precise real t = inverse * (plane_k[by] - dot3(plane_n[by], local[ends[0]]));
  precise real3 p = local[ends[0]] + t * e;
  vertex_at[v] = p;
  precise real slack = 200 * kUnit * largest *
                       (sqrt(plane_squared[by]) * (1.0LF + 1e-9LF) * (abs(e.x) + abs(e.y) + abs(e.z)) * abs(inverse));
  vertex_slack[v] = slack;
  return true;
}
#endif

#if BISECTOR_DOUBLE
bool meet_on_facet(uint v, uint f, uint a, uint b) {
  const real3 n = plane_n[f];
  const real3 along_a = cross3(n, plane_n[a]), along_b = cross3(n, plane_n[b]);
  const real determinant = dot3(along_a, plane_n[b]);
  precise real square = determinant * determinant;
  precise real squares = plane_squared[a] * plane_squared[b];
  precise real steep = kSteep * squares;
  if (!(square > steep)) return false;
  const real inverse = reciprocal(determinant);
  precise real offset_a = plane_k[a] - plane_k[f] * dot3(n, plane_n[a]);
  precise real offset_b = plane_k[b] - plane_k[f] * dot3(n, plane_n[b]);
  precise real3 w = inverse * (offset_b * along_a - offset_a * along_b);
  precise real shallow = kShallow * squares;
  if (!(square > shallow)) {
    precise real left_a = offset_a - dot3(cross3(along_a, n), w);
    precise real left_b = offset_b - dot3(cross3(along_b, n), w);
    precise real3 correction = inverse * (left_b * along_a - left_a * along_b);
    w += correction;
  }
  precise real3 p = plane_k[f] * n + w;
  vertex_at[v] = p;
  precise real slack = 2000 * kUnit * largest * (sqrt(squares) * (1.0LF + 1e-9LF) * abs(inverse));
  vertex_slack[v] = slack;
  return true;
}
#endif

bool meet_planes(uint v, uint a, uint b, uint c) {
  const real3 bc = cross3(plane_n[b], plane_n[c]), ca = cross3(plane_n[c], plane_n[a]),
              ab = cross3(plane_n[a], plane_n[b]);
  const real determinant = dot3(plane_n[a], bc);
  precise real square = determinant * determinant;
  precise real squares = plane_squared[a] * plane_squared[b] * plane_squared[c];
  precise real steep = kSteep * squares;
  if (!(square > steep)) return false;
  const real inverse = reciprocal(determinant);
  precise real3 p = inverse * (plane_k[a] * bc + plane_k[b] * ca + plane_k[c] * ab);
#if BISECTOR_DOUBLE
  precise real shallow = kShallow * squares;
  if (!(square > shallow)) {
    precise real left_a = plane_k[a] - dot3(plane_n[a], p);
    precise real left_b = plane_k[b] - dot3(plane_n[b], p);
    precise real left_c = plane_k[c] - dot3(plane_n[c], p);
    precise real3 correction = inverse * (left_a * bc + left_b * ca + left_c * ab);
    p += correction;
  }
  precise real slack = 400 * kUnit * largest * (sqrt(squares) * (1.0LF + 1e-9LF) * abs(inverse));
#else
  precise real far = largest_of(p) * 1.7320509;
  precise real over_sine = sqrt(squares / square);
  precise real planes = 0.0;
  precise real distances = far;
  precise real vague = 0.0;
  const uint on[3] = uint[3](a, b, c);
  for (uint e = 0; e < 3; ++e) {
    const uint plane = on[e];
    const real size = sqrt(plane_squared[plane]);
    if ((plane_label[plane] & kFacetLabel) != 0) {
      planes += kUnit * (far + abs(plane_k[plane])) + absolute_error;
    } else {
      planes += kUnit * (far + 3.5 * size) + 1.75 * residual * (1.0 + far / size);
      vague += 1.75 * residual / size;
    }
    distances += abs(plane_k[plane]) / size;
  }
  // Where what positions lack turns a plane by over a hundredth of the corner, the first order is not enough.
  precise real turned = vague * over_sine;
  if (!(turned < 0.01)) return false;
  precise real slack = ((planes + 6.5 * kUnit * distances) * over_sine + 11.0 * kUnit * far) * 1.1;
#endif
  vertex_at[v] = p;
  vertex_slack[v] = slack;
  return true;
}

bool place_vertex(uint v) {
  const uvec3 on = planes_of(vertex_on[v]);
  uint a = on.x, b = on.y, c = on.z;
  uint key_a = key_of(plane_label[a]), key_b = key_of(plane_label[b]), key_c = key_of(plane_label[c]);
  if (key_b < key_a) { const uint t = a; a = b; b = t; const uint s = key_a; key_a = key_b; key_b = s; }
  if (key_c < key_b) { const uint t = b; b = c; c = t; const uint s = key_b; key_b = key_c; key_c = s; }
  if (key_b < key_a) { const uint t = a; a = b; b = t; }
#if BISECTOR_DOUBLE
  if (b < 4) return meet_on_edge(v, a, b, c);
  if (a < 4) return meet_on_facet(v, a, b, c);
#endif
  return meet_planes(v, a, b, c);
}

void bound_polyhedron() {
  real squared = real(0.0), slack = real(0.0);
  [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
    squared = max(squared, norm2(vertex_at[v]));
    slack = max(slack, vertex_slack[v]);
  }
  // (r + e)^2 <= r^2 (1 + a) + e^2 (1 + 1 / a), and e bounds a coordinate: the vector's error is at most sqrt 3 of it.
  precise real r = squared * (real(1.0) + kReachGrowth) + (real(4.0) / kReachGrowth) * (slack * slack);
  reach = min(tet_squared, r);
}

#include "ties.glsl"

// The side of vertex v with respect to the bisector of the own seed and that at d: +1 inside, -1 outside, 0 if neither
// the bounds nor equal coordinates tell.
int side_of(uint v, real3 d, real squared, uint other) {
  precise real taxicab = abs(d.x) + abs(d.y) + abs(d.z);
  precise real below = real(0.5) * squared * (real(1.0) - kSquareError) - kTiny;
  precise real above = real(0.5) * squared * (real(1.0) + kSquareError) + kTiny;
  precise real along = dot3(vertex_at[v], d);
  precise real error = vertex_slack[v] * taxicab;
#if !BISECTOR_DOUBLE
  error += residual * (taxicab + real(3.0) * largest_of(vertex_at[v]));
#endif
  precise real high = along + error;
  precise real low = along - error;
  if (high < below) return 1;
  if (low > above) return -1;
  const uvec3 on = planes_of(vertex_on[v]);
  int side = 0;
  [[dont_unroll]] for (uint e = 0; e < 3 && side == 0; ++e) {
    const uint a = plane_label[on[e]], b = plane_label[on[e == 2 ? 0 : e + 1]];
    if (((a | b) & kFacetLabel) == 0) side = tie_of(own_slot, a, b, other);
  }
  const uvec3 labels_on = uvec3(plane_label[on.x], plane_label[on.y], plane_label[on.z]);
  if (side == 0 && ((labels_on.x | labels_on.y | labels_on.z) & kFacetLabel) == 0)
    side = box_tie_of(own_slot, labels_on.x, labels_on.y, labels_on.z, other);
  return side;
}

// Forgets planes that no vertex is on any more. The facets stay.
void compact_planes() {
  uvec2 used = uvec2(15u, 0u);
  [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
    const uvec3 on = planes_of(vertex_on[v]);
    used |= bit_of(on.x) | bit_of(on.y) | bit_of(on.z);
  }
  uint kept = 0;
  [[dont_unroll]] for (uint plane = 0; plane < plane_count; ++plane) {
    if (!in_set(used, plane)) continue;
    next_of[plane] = kept;
    plane_n[kept] = plane_n[plane];
    plane_k[kept] = plane_k[plane];
    plane_squared[kept] = plane_squared[plane];
    plane_label[kept] = plane_label[plane];
    ++kept;
  }
  plane_count = kept;
  [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
    const uvec3 on = planes_of(vertex_on[v]);
    vertex_on[v] = packed(next_of[on.x], next_of[on.y], next_of[on.z]);
  }
}

// Cuts by one bisector; the polyhedron may be empty then. Returns 0, or a status if it cannot tell.
uint cut(uint other, real3 d, real squared) {
  uvec4 outside = uvec4(0u);
  uint removed = 0;
  [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
    const int side = side_of(v, d, squared, other);
    if (side == 0) return kStatusUnsure;
    if (side > 0) continue;
    outside[v >> 5] |= 1u << (v & 31u);
    ++removed;
  }
  if (removed == 0) return 0;
  if (removed == vertex_count) {
    vertex_count = 0;
    return 0;
  }
  if (plane_count == kMostPlanes) compact_planes();
  if (plane_count == kMostPlanes) return kStatusCrowded;
  was_cut = polyhedron_changed = true;

  // Directed edges of what is cut off: of (a, b, c) the vertex has a b, b c and c a, and the vertices across them have
  // the reverse. Sorting the vertices puts those that stay first; what was cut off is then in the places `kept` and
  // beyond.
  [[dont_unroll]] for (uint plane = 0; plane < plane_count; ++plane) row_of[plane] = uvec2(0u);
  uint kept = 0, last = vertex_count;
  [[dont_unroll]] while (kept < last) {
    if ((outside[kept >> 5] >> (kept & 31u) & 1u) == 0) {
      ++kept;
      continue;
    }
    const uvec3 on = planes_of(vertex_on[kept]);
    row_of[on.x] |= bit_of(on.y);
    row_of[on.y] |= bit_of(on.z);
    row_of[on.z] |= bit_of(on.x);
    --last;
    const uint removed_on = vertex_on[kept];
    vertex_at[kept] = vertex_at[last];
    vertex_slack[kept] = vertex_slack[last];
    vertex_on[kept] = vertex_on[last];
    vertex_on[last] = removed_on;
    const uint bit = outside[last >> 5] >> (last & 31u) & 1u;
    outside[kept >> 5] = (outside[kept >> 5] & ~(1u << (kept & 31u))) | bit << (kept & 31u);
  }
  const uint by = plane_count++;
  set_seed_plane(by, other, d, squared);
  // The hole's border must be one cycle: each plane once.
  uint fresh = 0, start = 0;
  uvec2 seen = uvec2(0u);
  [[dont_unroll]] for (uint a = 0; a < by; ++a) {
    [[dont_unroll]] for (uint half_word = 0; half_word < 2; ++half_word) {
      [[dont_unroll]] for (uint set = row_of[a][half_word]; set != 0; set &= set - 1) {
        const uint b = 32 * half_word + uint(findLSB(set));
        if (in_set(row_of[b], a)) continue;
        if (in_set(seen, a)) return kStatusUnsure;
        seen |= bit_of(a);
        next_of[a] = b;
        start = a;
        ++fresh;
      }
    }
  }
  if (fresh < 3 || kept + fresh > kMostVertices) return fresh < 3 ? kStatusUnsure : kStatusCrowded;
  uint a = start;
  [[dont_unroll]] for (uint k = 0; k < fresh; ++k) {
    if (!in_set(seen, a)) return kStatusUnsure;
    const uint b = next_of[a];
    const uint v = kept + k;
    vertex_on[v] = packed(a, b, by);
    vertex_count = v + 1;
    a = b;
    if (a == start && k + 1 < fresh) return kStatusUnsure;
  }
  if (a != start) return kStatusUnsure;
  vertex_count = kept + fresh;
  [[dont_unroll]] for (uint v = kept; v < vertex_count; ++v)
    if (!place_vertex(v)) return kStatusUnsure;
  return 0;
}

// Clips the tetrahedron to the cell of `slot` by a list of neighbours in ascending distance.
//
// To include: neighbour(k), the k-th slot of the list; `radius` bounds from below the squared distance of all seeds not
// listed.
uint clip(uint count, real radius) {
  bound_polyhedron();
  [[dont_unroll]] for (uint k = 0; k < count; ++k) {
    const uint other = neighbour(k);
    const real3 d = difference(seed(other), own);
    const real squared = norm2(d);
    // Security radius: all of the polyhedron is nearer to this seed than to any other from here on.
    precise real near = squared * (real(1.0) - kReachGrowth);
#if BISECTOR_DOUBLE
    near -= 16.0LF * real(residual) * sqrt(squared);
#else
    near -= 16.0 * absolute_error * sqrt(squared);
#endif
    precise real twice = real(4.0) * reach;
    if (twice < near) return kStatusClipped;
    polyhedron_changed = false;
    const uint status = cut(other, d, squared);
    if (status != 0) return status;
    if (vertex_count == 0) return kStatusEmpty;
    if (polyhedron_changed) bound_polyhedron();
  }
  precise real twice = real(4.0) * reach;
  return radius >= kInfinity || twice < radius ? kStatusClipped : kStatusShortList;
}

#include "moments.glsl"

// Twin of moved() in src/voronoi/moments.h.
Moments moved(Moments m, real3 origin) {
  Moments r;
  precise real3 first = m.mass * origin + m.first;
  precise real second = m.mass * norm2(origin) + real(2.0) * dot3(origin, m.first) + m.second;
  r.mass = m.mass;
  r.first = first;
  r.second = second;
  return r;
}

Moments whole_moments() {
  Moments m;
  m.mass = tet_words[at_tet + kWholeAt];
  m.first = tet_vector(at_tet + kWholeAt + 1);
  m.second = tet_words[at_tet + kWholeAt + kSecondMomentAt];
  return moved(m, local[order_of(0)]);
}

real density_at(uint v) {
  const uvec3 on = planes_of(vertex_on[v]);
  const uint at = at_tet + kDensityAt;
  if (on.x < 4 && on.y < 4 && on.z < 4) return tet_words[at + 6 - on.x - on.y - on.z];
  const uint first = order_of(0);
  const real r0 = tet_words[at], r1 = tet_words[at + 1], r2 = tet_words[at + 2], r3 = tet_words[at + 3];
  precise real3 from_first = vertex_at[v] - local[first];
  precise real value = tet_words[at + first] + dot3(tet_vector(at_tet + kGradientAt), from_first);
  return min(max(value, min(min(r0, r1), min(r2, r3))), max(max(r0, r1), max(r2, r3)));
}

const real kSixth = real(1.0LF / 6.0LF), kTwentyFourth = real(1.0LF / 24.0LF),
           kOneHundredTwentieth = real(1.0LF / 120.0LF), kThreeHundredSixtieth = real(1.0LF / 360.0LF);

// Twins of tet_terms() in src/voronoi/moments.h: added to what `sum` holds.
void add_uniform(inout Moments sum, real3 a, real3 b, real3 c, real six_volume) {
  precise real3 total = a + b + c;
  precise real mass = sum.mass + six_volume;
  precise real3 first = sum.first + six_volume * total;
  precise real second = sum.second + six_volume * (norm2(total) + (norm2(a) + norm2(b) + norm2(c)));
  sum.mass = mass;
  sum.first = first;
  sum.second = second;
}

void add_linear(inout Moments sum, real3 a, real3 b, real3 c, real r0, real ra, real rb, real rc, real six_volume) {
  precise real s = ((r0 + ra) + rb) + rc;
  precise real3 weighted = (s + ra) * a + (s + rb) * b + (s + rc) * c;
  precise real squares = (s + ra + ra) * norm2(a) + (s + rb + rb) * norm2(b) + (s + rc + rc) * norm2(c);
  precise real products = (s + ra + rb) * dot3(a, b) + (s + rb + rc) * dot3(b, c) + (s + rc + ra) * dot3(c, a);
  precise real mass = sum.mass + six_volume * s;
  precise real3 first = sum.first + six_volume * weighted;
  precise real second = sum.second + six_volume * (squares + products);
  sum.mass = mass;
  sum.first = first;
  sum.second = second;
}

// The planes that bound the polyhedron, in order of their keys.
uint bounding[kMostPlanes];
uint bounding_count;

void collect() {
  uvec2 used = uvec2(0u);
  [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
    const uvec3 on = planes_of(vertex_on[v]);
    used |= bit_of(on.x) | bit_of(on.y) | bit_of(on.z);
  }
  bounding_count = 0;
  [[dont_unroll]] for (uint plane = 0; plane < plane_count; ++plane) {
    if (!in_set(used, plane)) continue;
    const uint key = key_of(plane_label[plane]);
    uint k = bounding_count++;
    [[dont_unroll]] for (; k > 0 && key_of(plane_label[bounding[k - 1]]) > key; --k) bounding[k] = bounding[k - 1];
    bounding[k] = plane;
  }
}

bool is_on(uint v, uint plane) {
  const uvec3 on = planes_of(vertex_on[v]);
  return on.x == plane || on.y == plane || on.z == plane;
}

// Of a vertex on the plane, those before (x) and after (y) it among the vertex's planes.
uvec2 around(uint v, uint plane) {
  const uvec3 on = planes_of(vertex_on[v]);
  return on.x == plane ? on.zy : on.y == plane ? on.xz : on.yx;
}

#if !BISECTOR_DOUBLE
// What the polyhedron's volume may be off by, to first order: its surface, displaced by the vertices' errors, and the
// rounding of products.
real volume_error;

void add_volume_error(real3 p, real3 q, real3 r, real slack) {
  precise real3 to_q = q - p;
  precise real3 to_r = r - p;
  const real3 twice_area = cross3(to_q, to_r);
  precise real error = volume_error + 1.52 * slack * largest_of(twice_area) +
                       6.0 * kUnit * largest_of(p) * largest_of(q) * largest_of(r);
  volume_error = error;
}

real mass_error() {
  const uint at = at_tet + kDensityAt;
  const real density = max(max(tet_words[at], tet_words[at + 1]), max(tet_words[at + 2], tet_words[at + 3]));
  precise real error = 1.1 * volume_error * density;
  return error;
}
#endif

// Moments of the polyhedron about the seed: tetrahedra from one vertex, the apex, to the triangles that each facet is
// fanned into from where its edge with the least key starts; the apex is where the first facet's fan starts. To be
// called after collect().
Moments integrate(bool uniform_density) {
  if (!was_cut) return whole_moments();
  Moments sum;
  sum.mass = real(0.0);
  sum.first = real3(0.0);
  sum.second = real(0.0);
  uint apex = kNone;
  real3 origin = real3(0.0);
#if !BISECTOR_DOUBLE
  volume_error = 0.0;
#endif
  real density_0 = real(1.0);
  [[dont_unroll]] for (uint f = 0; f < bounding_count; ++f) {
    const uint plane = bounding[f];
#if BISECTOR_DOUBLE
    if (apex != kNone && is_on(apex, plane)) continue;
#endif
    // From the vertex (plane, x, y) the polygon goes on to that of the form (plane, y, z).
    uint least = kNone, start = 0, count = 0;
    [[dont_unroll]] for (uint v = 0; v < vertex_count; ++v) {
      if (!is_on(v, plane)) continue;
      const uvec2 beside = around(v, plane);
      next_of[beside.y] = v;
      const uint key = key_of(plane_label[beside.x]);
      if (key < least) {
        least = key;
        start = v;
      }
      ++count;
    }
    if (apex == kNone) {
      apex = start;
      origin = vertex_at[apex];
      if (!uniform_density) density_0 = density_at(apex);
#if BISECTOR_DOUBLE
      continue;
#endif
    }
    const bool has_volume = !is_on(apex, plane);
    uint b = next_of[around(start, plane).x];
    precise real3 p = vertex_at[start] - origin;
    precise real3 q = vertex_at[b] - origin;
    const real density_p = uniform_density ? real(1.0) : density_at(start);
    real density_q = uniform_density ? real(1.0) : density_at(b);
    [[dont_unroll]] for (uint k = 2; k < count; ++k) {
      const uint c = next_of[around(b, plane).x];
      precise real3 r = vertex_at[c] - origin;
      const real six_volume = dot3(p, cross3(q, r));
#if !BISECTOR_DOUBLE
      add_volume_error(p, q, r, max(max(vertex_slack[start], vertex_slack[b]), vertex_slack[c]));
#endif
      if (uniform_density) {
        if (has_volume) add_uniform(sum, p, q, r, six_volume);
      } else {
        const real density_r = density_at(c);
        if (has_volume) add_linear(sum, p, q, r, density_0, density_p, density_q, density_r, six_volume);
        density_q = density_r;
      }
      b = c;
      q = r;
    }
  }
  Moments m;
  precise real mass = (uniform_density ? kSixth : kTwentyFourth) * sum.mass;
  precise real3 first = (uniform_density ? kTwentyFourth : kOneHundredTwentieth) * sum.first;
  precise real second = (uniform_density ? kOneHundredTwentieth : kThreeHundredSixtieth) * sum.second;
  m.mass = mass;
  m.first = first;
  m.second = second;
  return moved(m, origin);
}
