// Points and directions for OpenCASCADE.
#pragma once

#include <gp_Dir.hxx>
#include <gp_Pnt.hxx>

#include "core/geometry.h"

namespace bisector::step {

inline gp_Pnt point(const Vec3& p) { return {p.x, p.y, p.z}; }
inline gp_Dir direction(const Vec3& v) { return {v.x, v.y, v.z}; }
inline Vec3 vector(const gp_Pnt& p) { return {p.X(), p.Y(), p.Z()}; }

}  // namespace bisector::step
