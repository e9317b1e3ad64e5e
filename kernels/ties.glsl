// What equal coordinates decide where bounds do not tell.
//
// To include: `ids` and seed().

// Whether c and o are opposite corners of a rectangle with sides along the axes, p and q being the others: exactly, for
// it is a matter of equal coordinates.
bool is_rectangle(uint c, uint o, uint p, uint q) {
  const uvec3 low_c = ids[c].yzw, low_o = ids[o].yzw, low_p = ids[p].yzw, low_q = ids[q].yzw;
  const Point at_c = seed(c), at_o = seed(o), at_p = seed(p), at_q = seed(q);
  for (int k = 0; k < 3; ++k) {
    const bool with_p = same_coordinate(at_c, low_c, at_p, low_p, k) && same_coordinate(at_o, low_o, at_q, low_q, k);
    const bool with_q = same_coordinate(at_c, low_c, at_q, low_q, k) && same_coordinate(at_o, low_o, at_p, low_p, k);
    if (!with_p && !with_q) return false;
  }
  return true;
}

// The side of a vertex where the bisectors of seeds a and b meet (and those of others, or facets), with respect to that
// of c, if the four seeds are the corners of such a rectangle, else 0. Grids of seeds are full of them. The bisector's
// row of the corner opposite the cell's own seed is the sum of the other two, so the determinant is 0, and each of the
// four weights has the cofactor +1 or -1 times the corner's denominator, -1 for c and the seed opposite it
// (src/voronoi/exact.h): the lowest index decides.
int tie_of(uint slot, uint a, uint b, uint c) {
  uint opposite;
  if (is_rectangle(c, slot, a, b)) opposite = slot;
  else if (is_rectangle(c, a, slot, b)) opposite = a;
  else if (is_rectangle(c, b, slot, a)) opposite = b;
  else return 0;
  const uint lowest = min(min(ids[slot].x, ids[a].x), min(ids[b].x, ids[c].x));
  return lowest == ids[c].x || lowest == ids[opposite].x ? -1 : 1;
}

// The bits of a corner of a box along the axes: 1 where its coordinate is not that of the corner `from`. Along each
// axis all that differ must agree with the first that did, `apart`.
bool box_corner(uint from, uint corner, inout uvec3 apart, out ivec3 bits_of_corner) {
  const uvec3 low_from = ids[from].yzw, low_corner = ids[corner].yzw;
  const Point at_from = seed(from), at_corner = seed(corner);
  bits_of_corner = ivec3(0);
  for (int k = 0; k < 3; ++k) {
    if (same_coordinate(at_from, low_from, at_corner, low_corner, k)) continue;
    bits_of_corner[k] = 1;
    if (apart[k] == kNone) apart[k] = corner;
    else if (!same_coordinate(seed(apart[k]), ids[apart[k]].yzw, at_corner, low_corner, k)) return false;
  }
  return true;
}

int determinant_of(ivec3 a, ivec3 b, ivec3 c) {
  return a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
}

// The side of the vertex where the bisectors of seeds a, b and e meet, with respect to that of c, if the five seeds are
// corners of one box along the axes, else 0. Rows of corners are sums of the rows of the three corners next to the
// cell's own seed, so the row of c is a combination of those of a, b and e, the determinant is 0, and the weights have
// the combination's coefficients, times the vertex's denominator, for cofactors: the lowest index that has one decides.
int box_tie_of(uint slot, uint a, uint b, uint e, uint c) {
  uvec3 apart = uvec3(kNone);
  ivec3 at_a, at_b, at_e, at_c;
  if (!box_corner(slot, a, apart, at_a) || !box_corner(slot, b, apart, at_b) || !box_corner(slot, e, apart, at_e) ||
      !box_corner(slot, c, apart, at_c))
    return 0;
  const int determinant = determinant_of(at_a, at_b, at_e), sense = determinant < 0 ? -1 : 1;
  if (determinant == 0) return 0;
  const int of_a = sense * determinant_of(at_c, at_b, at_e), of_b = sense * determinant_of(at_a, at_c, at_e),
            of_e = sense * determinant_of(at_a, at_b, at_c), of_c = -sense * determinant;
  const int cofactors[5] = int[5](of_a, of_b, of_e, of_c, -of_a - of_b - of_e - of_c);
  const uint indices[5] = uint[5](ids[a].x, ids[b].x, ids[e].x, ids[c].x, ids[slot].x);
  uint lowest = kNone;
  int side = 0;
  for (uint k = 0; k < 5; ++k)
    if (cofactors[k] != 0 && indices[k] < lowest) {
      lowest = indices[k];
      side = cofactors[k] > 0 ? 1 : -1;
    }
  return side;
}
