// A uniform grid over the seeds, hashed into buckets: cells are as fine as the seeds lie close, and memory is that of
// the seeds. A bucket may hold seeds of several cells; each is asked for its own cell before it counts. The order
// within a bucket depends on a race, so nothing may depend on it.
//
// To include: a push constant block with `grid_lower`, `grid_inverse` and `bucket_mask`.

// The place of a position in units of cells, off by 2^-22 of itself: it is rounded twice.
vec3 place_at(Point p) {
  Point lower;
  lower.high = real3(grid_lower);
#if !BISECTOR_DOUBLE
  lower.low = real3(0.0);
#endif
  precise vec3 r = vec3(difference(p, lower)) * grid_inverse;
  return clamp(r, vec3(-1e6), vec3(1e6));
}

ivec3 cell_at(Point p) { return ivec3(floor(place_at(p))); }

// What lies in none of the cells up to `ring` cells from that of p is at least so far from p.
real ring_distance(Point p, int ring, float lacking) {
  const vec3 place = abs(place_at(p));
  precise float doubt = 9.5367432e-7 * (max(max(place.x, place.y), place.z) + float(ring) + 2.0);  // 2^-20
  precise float cells = float(ring) - doubt;
  precise float distance = cells * 0.9999 / grid_inverse - 4.0 * lacking;
  return real(max(distance, 0.0));
}

uint bucket_of(ivec3 cell) {
  const uvec3 c = uvec3(cell);
  uint h = c.x * 73856093u ^ c.y * 19349663u ^ c.z * 83492791u;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 13;
  return h & bucket_mask;
}
