#include "segment/quadric.h"

namespace bisector {

Quadric to_local(const Quadric& quadric, const Vec3& origin, double scale) {
  const Vec3 gradient = gradient_of(quadric, origin);
  Quadric local;
  local.c[0] = value_of(quadric, origin);
  for (int k = 0; k < 3; ++k) local.c[static_cast<std::size_t>(k) + 1] = scale * gradient[k];
  for (std::size_t k = 4; k < 10; ++k) local.c[k] = scale * scale * quadric.c[k];
  return local;
}

Quadric from_local(const Quadric& local, const Vec3& origin, double scale) {
  return to_local(local, (-1 / scale) * origin, 1 / scale);
}

}  // namespace bisector
