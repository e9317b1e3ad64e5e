// Quality of tetrahedra: dihedral angles, radius ratios, volumes.
#pragma once

#include <array>

#include "core/geometry.h"

namespace bisector {

struct TetQualityReport {
  double dihedral_min = 0, dihedral_max = 0;           // of all six angles of all tetrahedra, degrees
  double dihedral_min_mean = 0;                        // mean over tetrahedra of their smallest, degrees
  std::array<std::size_t, 18> dihedral_counts{};       // angles in [0, 10), [10, 20), ... [170, 180] degrees
  double radius_ratio_min = 0, radius_ratio_mean = 0;  // 3 r_in / R_circum: 1 is regular
  double edge_min = 0, edge_ave = 0, edge_max = 0;     // lengths, in the mesh's unit
  double volume = 0, volume_min = 0;                   // signed, in the unit cubed
  // By exact signs. Both kinds count with dihedral angles 0 and 180 and radius ratio 0 and are left out of the two
  // means and of the counts.
  std::size_t inverted = 0, zero_volume = 0;
};

// All zeros if there are no tetrahedra.
TetQualityReport measure_tet_quality(const TetMesh& mesh);

// The six dihedral angles of a tetrahedron of positive volume in degrees, at the edges 01, 02, 03, 12, 13, 23.
std::array<double, 6> dihedral_angles(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// 3 r_in / R_circum with the sign of the volume; 0 where there is none.
double radius_ratio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

}  // namespace bisector
