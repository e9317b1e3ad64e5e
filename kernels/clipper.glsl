// Clipping one facet to one restricted Voronoi cell, the twin of Clipper in src/voronoi/clip.cpp: labels first,
// coordinates from labels by one formula, and with each corner a bound of its error, the slack. What the bounds do not
// decide is not decided here: the pair gets a status and goes to exact arithmetic.
//
// To include: `facet_words`, `facet_meta`, `element_base`, `residual`, `ids` and seed(), and the constant kMostCorners.

#if BISECTOR_DOUBLE
const real kSquareError = 1e-12LF;   // relative, of |d|^2 with all that is compared with it
const real kTiny = 1e-280LF;         // no product this small is told from 0
const real kReachGrowth = 1e-5LF;    // lists may be in the order of distances in single precision
// Lines that meet at a smaller angle (sine, squared) are left to exact arithmetic, and below the second are met in two
// steps.
const real kSteep = 1e-12LF, kShallow = 1e-8LF;
#else
const real kSquareError = 16 * kUnit;
const real kTiny = 1e-25;
const real kReachGrowth = 1e-3;
const real kSteep = 1e-8, kShallow = 1.0;
#endif

// A line on the facet: m . p = offset in its plane, with the seed's foot as origin.
struct Line {
  real3 m;
  real3 along;   // n x m
  real offset;
  real squared;  // |m|^2
};

// The facet, as seen from the seed.
uint at_facet;   // first word
uint bits;
real3 normal;
real3 local[3];
real largest;          // absolute coordinate of local
real facet_squared;    // upper bound of the squared distance of any point of the facet
real height;
real3 foot;
uint own_slot;
Point own;
real absolute_error;   // single: of each coordinate of what is computed in pairs

// The polygon: corners, their slack, and the label of the edge that starts there.
real3 corner_at[kMostCorners];
real corner_slack[kMostCorners];
uint corner_label[kMostCorners];
#if !BISECTOR_DOUBLE
real corner_shift[kMostCorners];  // by how much each of the lines that meet there may be off
#endif
uint corner_count;
real reach;            // upper bound of its squared distance
bool polygon_changed;  // by the last cut

void begin_facet(uint facet, uint slot) {
  at_facet = (facet - element_base) * kFacetWords;
  bits = facet_meta[kFacetMetaWords * (facet - element_base) + kFacetBitsAt];
  own_slot = slot;
  own = seed(slot);
  normal = facet_vector(at_facet + kNormalAt);
  largest = real(0.0);
  facet_squared = real(0.0);
  for (uint k = 0; k < 3; ++k) {
    local[k] = difference(facet_point(at_facet + kPointWords * k), own);
    largest = max(largest, largest_of(local[k]));
    precise real squared = norm2(local[k]) * (real(1.0) + kReachGrowth);
    facet_squared = max(facet_squared, squared);
  }
#if BISECTOR_DOUBLE
  height = dot3(normal, local[anchor_of(bits)]);
  absolute_error = real(0.0);
#else
  height = pair_dot(facet_point(at_facet + kNormalAt), facet_point(at_facet + kPointWords * anchor_of(bits)), own);
  precise real error = 4e-12 * largest + 4.0 * residual;
  absolute_error = error;
  precise real far = facet_squared + 8.0 * largest * residual;
  facet_squared = far;
#endif
  precise real3 f = height * normal;
  foot = f;
  corner_count = 3;
  for (uint k = 0; k < 3; ++k) {
    corner_at[k] = local[k];
    precise real slack = 8 * kUnit * largest_of(local[k]) + absolute_error;
#if BISECTOR_DOUBLE
    slack = 8 * kUnit * largest;
#else
    corner_shift[k] = slack;
#endif
    corner_slack[k] = slack;
    corner_label[k] = kEdgeLabel | k;
  }
}

Line edge_line(uint k) {
  Line line;
#if BISECTOR_DOUBLE
  const uint from = origin_of(bits, k), to = from == k ? (k + 1) % 3 : k;
  precise real3 along = facet_vector(at_facet + kPointWords * from) - facet_vector(at_facet + kPointWords * to);
  line.along = along;
  line.m = cross3(along, normal);
  line.squared = norm2(along);
  precise real offset = dot3(line.m, local[from]) - height * dot3(normal, line.m);
  line.offset = offset;
#else
  // Facets may be far larger than cells, and a seed far from the corner but near the edge.
  const Point outward = facet_point(at_facet + kEdgesAt + kPointWords * k);
  line.m = outward.high;
  line.along = cross3(normal, line.m);
  line.squared = 1.0;
  line.offset = pair_dot(outward, facet_point(at_facet + kPointWords * origin_of(bits, k)), own);
#endif
  return line;
}

Line seed_line(real3 d, real squared) {
  Line line;
  line.m = d;
  line.along = cross3(normal, d);
  precise real offset = real(0.5) * squared - height * dot3(normal, d);
  line.offset = offset;
  line.squared = squared;
  return line;
}

Line line_of(uint label) {
  if ((label & kEdgeLabel) != 0) return edge_line(label & 3u);
  const real3 d = difference(seed(label), own);
  return seed_line(d, norm2(d));
}

// Whether m points out of the polygon, as that of a bisector does.
bool points_out(uint label) {
#if BISECTOR_DOUBLE
  return (label & kEdgeLabel) == 0 || origin_of(bits, label & 3u) != (label & 3u);
#else
  return true;
#endif
}

// Sets corner k to where the lines meet; false if that is not certain.
//
// The slack in double is that of the CPU. In single all terms are at the scale of the cell: with relative rounding
// errors u, h the height, c the offset, each line is off by
//   e = u (4 |m| + 10 |h|) + 2 a      for a bisector, in units of distance (|m| = |d| the distance of the seeds),
//   e = u |c| + 2 a                   for a facet edge, from pairs, with a the absolute error of those,
// and the corner w, seen from the foot, by
//   (e1 + e2 + 10 u (|c1| / |m1| + |c2| / |m2|) + 22 u |w|) / sine + 6 u |w|,
// to which come 6 u |h| + a of the foot, u |corner| of the sum, and 8 u |corner| for the products that the corner is
// tested in. What positions lack turns bisectors of seeds that are close together: by `vague` radians, so that (|w| +
// |h|) vague / sine comes to it. Where that turns the lines by over a hundredth of their angle, or u does, all is left
// to exact arithmetic.
bool meet(Line before, uint before_label, Line after, uint after_label, uint k) {
  precise real determinant = dot3(before.along, after.m);
  precise real squares = before.squared * after.squared;
  precise real square = determinant * determinant;
  precise real steep = kSteep * squares;
  if (!(square > steep)) return false;
  const real inverse = reciprocal(determinant);
  precise real3 numerator = after.offset * before.along - before.offset * after.along;
  precise real3 w = inverse * numerator;
  precise real shallow = kShallow * squares;
  if (!(square > shallow)) {
    // Where lines meet at a small angle the determinant's error takes w off both of them; what is left then is an error
    // along them, which hardly changes an area. Only the lines' normals in the plane will do for it: m times the error
    // of w across the plane may be far larger.
    precise real left_before = before.offset - dot3(cross3(before.along, normal), w);
    precise real left_after = after.offset - dot3(cross3(after.along, normal), w);
    precise real3 correction = left_after * before.along - left_before * after.along;
    w += inverse * correction;
  }
  precise real3 p = foot + w;
  corner_at[k] = p;
#if BISECTOR_DOUBLE
  precise real slack = 2000 * kUnit * largest * sqrt(squares / square) * (1.0LF + 1e-9LF);
#else
  const real size_before = sqrt(before.squared), size_after = sqrt(after.squared);
  const real distance_before = abs(before.offset) / size_before, distance_after = abs(after.offset) / size_after;
  const real h = abs(height), far = largest_of(w) * 1.7320509;
  real lines = 10.0 * (distance_before + distance_after);
  const bool before_is_edge = (before_label & kEdgeLabel) != 0, after_is_edge = (after_label & kEdgeLabel) != 0;
  lines += before_is_edge ? distance_before : 4.0 * size_before + 10.0 * h;
  lines += after_is_edge ? distance_after : 4.0 * size_after + 10.0 * h;
  const real wide_before = before_is_edge ? 0.0 : 1.75 / size_before,
             wide_after = after_is_edge ? 0.0 : 1.75 / size_after;
  precise real vague = residual * (wide_before + wide_after);
  precise real turned = vague * vague * squares;
  precise real hundredth = 1e-4 * square;
  if (!(turned < hundredth)) return false;
  precise real numerators = kUnit * (lines + 22.0 * far) + 4.0 * absolute_error + vague * (far + h);
  precise real rounding = kUnit * (6.0 * (far + h) + 10.0 * largest_of(p) * 1.7320509) + absolute_error;
  precise real slack = (numerators * sqrt(squares / square) + rounding) * 1.08;
  // The correction's own determinant is off by 9 u |m1| |m2| at most.
  precise real shift = numerators * (1.0 + (9.0 * kUnit + vague) * (squares / square)) + rounding;
  corner_shift[k] = shift;
#endif
  corner_slack[k] = slack;
  return (determinant > real(0.0)) == (points_out(before_label) == points_out(after_label));
}

void bound_polygon() {
  real squared = real(0.0), slack = real(0.0);
  [[dont_unroll]] for (uint k = 0; k < corner_count; ++k) {
    squared = max(squared, norm2(corner_at[k]));
    slack = max(slack, corner_slack[k]);
  }
  // (r + e)^2 <= r^2 (1 + a) + e^2 (1 + 1 / a), and e bounds a coordinate: the vector's error is at most sqrt 3 of it.
  precise real r = squared * (real(1.0) + kReachGrowth) + (real(4.0) / kReachGrowth) * (slack * slack);
  reach = min(facet_squared, r);
}

#include "ties.glsl"

#if BISECTOR_DOUBLE
// The only axis along which c lies apart from the reference, if the reference is level with the own seed there; else
// -1.
int layer_axis(Point reference, Point c) {
  int axis = -1;
  for (int a = 0; a < 3; ++a)
    if (c.high[a] != reference.high[a]) {
      if (axis >= 0) return -1;
      axis = a;
    }
  return axis >= 0 && reference.high[axis] == own.high[axis] ? axis : -1;
}

// The side of the corner with these labels with respect to the bisector of c, exactly, if c lies one layer of a grid
// from the own seed or from a reference on whose bisector the corner is, and if the corner's coordinate across the
// layers is known: for a corner of the facet, and where an edge or all of the facet has but one. Else 0. Models made by
// hand lie half way between layers. The row of c is that of the reference plus that of a seed across the layers, whose
// sign depends on this coordinate alone; where it is 0 the cofactors are -1 for c and +1 for the reference, times the
// corner's denominator.
int layer_side(uint before, uint after, uint c) {
  const bool on_after = (after & kEdgeLabel) != 0, on_before = (before & kEdgeLabel) != 0;
  const Point other = seed(c);
  uint reference = own_slot;
  int axis = layer_axis(own, other);
  if (axis < 0 && !on_after) {
    reference = after;
    axis = layer_axis(seed(after), other);
  }
  if (axis < 0 && !on_before) {
    reference = before;
    axis = layer_axis(seed(before), other);
  }
  if (axis < 0) return 0;
  const uint edge = on_after ? after & 3u : on_before ? before & 3u : 0u;
  const double at = facet_point(at_facet + kPointWords * edge).high[axis];
  if (!(on_after && on_before)) {
    if (facet_point(at_facet + kPointWords * ((edge + 1) % 3)).high[axis] != at) return 0;
    if (!on_after && !on_before && facet_point(at_facet + kPointWords * 2).high[axis] != at) return 0;
  }
  // The sum of both layers less twice the coordinate, the sum as two doubles.
  const double a = own.high[axis], b = other.high[axis];
  precise double sum = a + b;
  precise double t = sum - a;
  precise double lost = (a - (sum - t)) + (b - t);
  precise double twice = 2.0LF * at;
  precise double above = (sum - twice) + lost;
  if (above == 0.0LF) return ids[reference].x < ids[c].x ? 1 : -1;
  return (above > 0.0LF) == (b > a) ? 1 : -1;
}
#endif

// The side of the corner with these labels with respect to the bisector of c, where bounds do not tell but equal
// coordinates do; 0 if they do not either.
int tie_side(uint before, uint after, uint c) {
  int side = 0;
#if BISECTOR_DOUBLE
  side = layer_side(before, after, c);
#endif
  if (side == 0 && ((before | after) & kEdgeLabel) == 0) side = tie_of(own_slot, before, after, c);
  return side;
}

// The side of corner k with respect to the bisector of the own seed and that at d: +1 inside, -1 outside, 0 if the
// bounds do not tell.
int side_of(uint k, real3 d, real squared) {
  precise real taxicab = abs(d.x) + abs(d.y) + abs(d.z);
  precise real below = real(0.5) * squared * (real(1.0) - kSquareError) - kTiny;
  precise real above = real(0.5) * squared * (real(1.0) + kSquareError) + kTiny;
  precise real along = dot3(corner_at[k], d);
  precise real error = corner_slack[k] * taxicab;
#if !BISECTOR_DOUBLE
  error += residual * (taxicab + real(3.0) * largest_of(corner_at[k]));
#endif
  precise real high = along + error;
  precise real low = along - error;
  return high < below ? 1 : low > above ? -1 : 0;
}

void move_corner(uint from, uint to) {
  corner_at[to] = corner_at[from];
  corner_slack[to] = corner_slack[from];
#if !BISECTOR_DOUBLE
  corner_shift[to] = corner_shift[from];
#endif
  corner_label[to] = corner_label[from];
}

// Cuts by one bisector; the polygon may be empty then. Returns 0, or a status if it cannot tell.
uint cut(uint other, real3 d, real squared) {
  const uint n = corner_count;
  uint kept = 0, in_first = 0, changes = 0;
  bool before_inside = true, first_inside = true;
  [[dont_unroll]] for (uint k = 0; k < n; ++k) {
    int side = side_of(k, d, squared);
    if (side == 0) side = tie_side(corner_label[k == 0 ? n - 1 : k - 1], corner_label[k], other);
    if (side == 0) return kStatusUnsure;
    const bool inside = side > 0;
    if (k == 0) {
      first_inside = inside;
    } else if (inside != before_inside) {
      ++changes;
      if (inside) in_first = k;
    }
    before_inside = inside;
    if (inside) ++kept;
  }
  if (kept == n) return 0;
  if (kept == 0) {
    corner_count = 0;
    return 0;
  }
  if (first_inside != before_inside) ++changes;
  // A line leaves a convex polygon in one run; more would mean that a bound does not hold.
  if (changes != 2) return kStatusUnsure;
  if (kept + 2 > kMostCorners) return kStatusCrowded;

  // The corners that stay are `kept` from in_first on, cyclically; two new ones follow the last of them.
  const uint entering = corner_label[in_first == 0 ? n - 1 : in_first - 1];
  const uint leaving = corner_label[in_first + kept - 1 < n ? in_first + kept - 1 : in_first + kept - 1 - n];
  uint place = kept;
  if (in_first + kept <= n) {
    if (in_first > 0)
      [[dont_unroll]] for (uint k = 0; k < kept; ++k) move_corner(in_first + k, k);
  } else {
    place = in_first + kept - n;
    if (in_first > place + 2) {
      [[dont_unroll]] for (uint k = in_first; k < n; ++k) move_corner(k, k - in_first + place + 2);
    } else if (in_first < place + 2) {
      [[dont_unroll]] for (uint k = n; k > in_first; --k) move_corner(k - 1, k);
    }
  }
  polygon_changed = true;
  corner_count = kept + 2;
  corner_label[place] = other;
  corner_label[place + 1] = entering;
  const Line line = seed_line(d, squared);
  if (!meet(line_of(leaving), leaving, line, other, place)) return kStatusUnsure;
  if (!meet(line, other, line_of(entering), entering, place + 1)) return kStatusUnsure;
  return 0;
}

// Clips the facet to the cell of `slot` by a list of neighbours in ascending distance.
//
// To include: neighbour(k), the k-th slot of the list; `radius` bounds from below the squared distance of all seeds not
// listed.
uint clip(uint count, real radius) {
  bound_polygon();
  [[dont_unroll]] for (uint k = 0; k < count; ++k) {
    const uint other = neighbour(k);
    const real3 d = difference(seed(other), own);
    const real squared = norm2(d);
    // Security radius: all of the polygon is nearer to this seed than to any other from here on.
    precise real near = squared * (real(1.0) - kReachGrowth);
#if BISECTOR_DOUBLE
    near -= 16.0LF * real(residual) * sqrt(squared);
#else
    near -= 16.0 * absolute_error * sqrt(squared);
#endif
    precise real twice = real(4.0) * reach;
    if (twice < near) return kStatusClipped;
    polygon_changed = false;
    const uint status = cut(other, d, squared);
    if (status != 0) return status;
    if (corner_count == 0) return kStatusEmpty;
    if (polygon_changed) bound_polygon();
  }
  precise real twice = real(4.0) * reach;
  return radius >= kInfinity || twice < radius ? kStatusClipped : kStatusShortList;
}

#if !BISECTOR_DOUBLE
// What the polygon's mass may be off by, to first order: lines displaced by their errors, times the perimeter.
real mass_error() {
  real shift = 0.0, perimeter = 0.0;
  [[dont_unroll]] for (uint k = 0; k < corner_count; ++k) {
    shift = max(shift, corner_shift[k]);
    precise real3 edge = corner_at[k] - corner_at[k == 0 ? corner_count - 1 : k - 1];
    precise real longer = perimeter + 1.7320509 * largest_of(edge);
    perimeter = longer;
  }
  const real density = max(max(facet_words[at_facet + kDensityAt], facet_words[at_facet + kDensityAt + 1]),
                           facet_words[at_facet + kDensityAt + 2]);
  precise real error = shift * perimeter * density;
  return error;
}
#endif

// The order in which the fan of moments starts: facet edges by their vertices' indices, then seeds by the caller's
// index.
uint label_key(uint label) { return (label & kEdgeLabel) != 0 ? rank_of(bits, label & 3u) : 3u + ids[label].x; }

uint first_corner() {
  uint first = 0;
  uint least = label_key(corner_label[0]);
  [[dont_unroll]] for (uint k = 1; k < corner_count; ++k) {
    const uint key = label_key(corner_label[k]);
    if (key < least) {
      least = key;
      first = k;
    }
  }
  return first;
}

#include "moments.glsl"

real density_at(uint k) {
  const uint after = corner_label[k], before = corner_label[k == 0 ? corner_count - 1 : k - 1];
  if ((after & kEdgeLabel) != 0 && (before & kEdgeLabel) != 0) return facet_words[at_facet + kDensityAt + (after & 3u)];
  const real r0 = facet_words[at_facet + kDensityAt], r1 = facet_words[at_facet + kDensityAt + 1],
             r2 = facet_words[at_facet + kDensityAt + 2];
  const uint anchor = anchor_of(bits);
  precise real3 from_anchor = corner_at[k] - local[anchor];
  precise real value =
      facet_words[at_facet + kDensityAt + anchor] + dot3(facet_vector(at_facet + kGradientAt), from_anchor);
  return min(max(value, min(min(r0, r1), r2)), max(max(r0, r1), r2));
}

const real kThird = real(1.0LF / 3.0LF), kTwelfth = real(1.0LF / 12.0LF), kThirtieth = real(1.0LF / 30.0LF);

// Twins of triangle_moments() in src/voronoi/moments.h.
Moments uniform_moments(real3 sum, real squares, real area) {
  Moments m;
  precise real third = kThird * area;
  precise real3 first = third * sum;
  precise real second = (kTwelfth * area) * (norm2(sum) + squares);
  m.mass = area;
  m.first = first;
  m.second = second;
  return m;
}

Moments linear_moments(real3 a, real3 b, real3 c, real ra, real rb, real rc, real area) {
  Moments m;
  precise real s = ra + rb + rc;
  precise real3 first = (s + ra) * a + (s + rb) * b + (s + rc) * c;
  precise real squares = (s + ra + ra) * norm2(a) + (s + rb + rb) * norm2(b) + (s + rc + rc) * norm2(c);
  precise real products = (s + ra + rb) * dot3(a, b) + (s + rb + rc) * dot3(b, c) + (s + rc + ra) * dot3(c, a);
  precise real mass = (kThird * area) * s;
  precise real3 scaled = (kTwelfth * area) * first;
  precise real second = (kThirtieth * area) * (squares + products);
  m.mass = mass;
  m.first = scaled;
  m.second = second;
  return m;
}

void add_moments(inout Moments sum, Moments term) {
  precise real mass = sum.mass + term.mass;
  precise real3 first = sum.first + term.first;
  precise real second = sum.second + term.second;
  sum.mass = mass;
  sum.first = first;
  sum.second = second;
}

// Moments of the polygon about the seed.
Moments integrate(bool uniform_density) {
  Moments sum;
  sum.mass = real(0.0);
  sum.first = real3(0.0);
  sum.second = real(0.0);
  const uint n = corner_count, apex = first_corner();
  const real3 a = corner_at[apex];
  const real squared_a = norm2(a);
  const real density_a = uniform_density ? real(1.0) : density_at(apex);
  uint b = apex + 1 == n ? 0 : apex + 1;
  real squared_b = norm2(corner_at[b]);
  real density_b = uniform_density ? real(1.0) : density_at(b);
  [[dont_unroll]] for (uint k = 2; k < n; ++k) {
    const uint c = b + 1 == n ? 0 : b + 1;
    precise real3 to_b = corner_at[b] - a;
    precise real3 to_c = corner_at[c] - a;
    precise real area = real(0.5) * dot3(normal, cross3(to_b, to_c));
    if (uniform_density) {
      const real squared_c = norm2(corner_at[c]);
      precise real3 corners = a + corner_at[b] + corner_at[c];
      precise real squares = squared_a + squared_b + squared_c;
      add_moments(sum, uniform_moments(corners, squares, area));
      squared_b = squared_c;
    } else {
      const real density_c = density_at(c);
      add_moments(sum, linear_moments(a, corner_at[b], corner_at[c], density_a, density_b, density_c, area));
      density_b = density_c;
    }
    b = c;
  }
  return sum;
}
