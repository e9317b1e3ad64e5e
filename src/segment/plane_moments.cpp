#include "segment/plane_moments.h"

#include <Eigen/Dense>
#include <algorithm>

namespace bisector {

void PlaneMoments::add(const PlaneMoments& b) {
  area += b.area;
  first += b.first;
  for (std::size_t k = 0; k < 6; ++k) second[k] += b.second[k];
}

double PlaneMoments::squared_distance() const {
  if (!(area > 0)) return 0;
  const Vec3 c = (1 / area) * first;
  Eigen::Matrix3d m;
  const double xx = second[0] - first.x * c.x, xy = second[1] - first.x * c.y, xz = second[2] - first.x * c.z,
               yy = second[3] - first.y * c.y, yz = second[4] - first.y * c.z, zz = second[5] - first.z * c.z;
  m << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(m, Eigen::EigenvaluesOnly);
  return std::max(0.0, solver.eigenvalues()(0));
}

PlaneMoments plane_moments(const SegmentDomain& domain, Index triangle) {
  PlaneMoments m;
  m.area = domain.areas[triangle];
  if (!domain.clusters.empty()) {
    const SurfaceMoments moments = moved(domain.clusters[triangle], Vec3{});
    m.first = {moments.m[1], moments.m[2], moments.m[3]};
    std::copy_n(moments.m.begin() + 4, 6, m.second.begin());
    return m;
  }
  const Triangle& v = domain.triangles[triangle];
  const Vec3 &a = domain.vertices[v[0]], &b = domain.vertices[v[1]], &c = domain.vertices[v[2]], s = a + b + c;
  m.first = (m.area / 3) * s;
  std::size_t k = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j) m.second[k++] = m.area / 12 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
  return m;
}

}  // namespace bisector
