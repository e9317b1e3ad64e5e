// Distances of seeds from one of them, in single precision, which is enough to tell nearly all of them apart.
//
// To include: seed_tree.glsl, the function `seed` and the buffer `ids`.

const float kFarthest = 3e38;

float narrow_square(real3 d) {
  const vec3 narrow = vec3(d);
  precise float squared = narrow.x * narrow.x + narrow.y * narrow.y + narrow.z * narrow.z;
  return squared;
}

// Whether two squares, of which the second is not less, may be in the wrong order.
bool in_doubt(float square_before, float square) {
  precise float doubtful = square_before * 1.00001;
  return square <= doubtful;
}

// By distance, and equal ones by the caller's index.
bool farther(uint a, uint b, Point own) {
  const real square_a = norm2(difference(seed(a), own)), square_b = norm2(difference(seed(b), own));
  return square_a > square_b || (square_a == square_b && ids[a].x > ids[b].x);
}

// What the squared distances of seeds beyond this one are at least, although it was rounded.
float certain_square(float farthest) {
  precise float error = 64.0 * 1.1920929e-7 * farthest + 16.0 * residual * sqrt(farthest);
  precise float certain = farthest * 0.99999 - error;
  return max(certain, 0.0);
}
