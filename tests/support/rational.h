// Rational arithmetic on points.
#pragma once

#include <gmpxx.h>

#include "core/geometry.h"

namespace bisector::test {

inline mpq_class exact_squared_distance(const Vec3& p, const Vec3& q) {
  mpq_class sum = 0;
  for (int k = 0; k < 3; ++k) {
    const mpq_class d = mpq_class(p[k]) - mpq_class(q[k]);
    sum += d * d;
  }
  return sum;
}

}  // namespace bisector::test
