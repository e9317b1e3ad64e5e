// Cubic B-spline curves fitted to points (thesis 3.4.1, Eq. 3.2; Piegl and Tiller, The NURBS Book, 2.2, 9.4).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bisector/tree.h"
#include "core/geometry.h"

namespace bisector {

// The degree + 1 basis functions that are not zero at a parameter, and their derivatives; entry k belongs to control
// point first + k.
struct BasisFunctions {
  std::size_t first = 0;
  std::array<double, 4> values{}, derivatives{}, second_derivatives{};
};

// By Cox and de Boor's recursion, for `degree` 1 to 3 and ascending `knots`, at least 2 degree + 2. `t` is clamped to
// the domain, [knots[degree], knots[size - degree - 1]]; at a knot the derivatives are those from the right, at the
// domain's end from the left.
BasisFunctions basis_functions(const std::vector<double>& knots, int degree, double t);

// The same curve as a cubic, from one of degree 3 or of degree 1 or 2 without inner knots.
BSplineCurve as_cubic(const BSplineCurve& curve);

// The same curve with one knot more, strictly between 0 and 1 (Boehm 1980).
BSplineCurve insert_knot(const BSplineCurve& curve, double t);

struct CurveFit {
  BSplineCurve curve;
  std::vector<double> parameters;  // of the points, ascending from 0 to 1
  double max_distance = 0;         // of a point from the curve at its parameter
};

// Least squares through points in order: chord-length parameters, moved towards foot points (Hoschek 1988), uniform
// knots, the ends kept. Numbers of control points are tried from 2 on, about a quarter more each time, up to
// `max_control`, and for each the smoothest curves first; the first that has every point within `tolerance` is taken,
// the nearest of all if there is none. Curves that swing out between points are left out. Consecutive equal points
// count once. Throws Error for fewer than two distinct points, coordinates or distances that are not finite, a
// tolerance that is not a number >= 0, and fewer than 2 control points.
CurveFit fit_curve(const std::vector<Vec3>& points, double tolerance, std::size_t max_control = 30);

// The same with a tolerance for each point, the squared distances weighed by its inverse square. Throws Error if there
// are not as many.
CurveFit fit_curve(const std::vector<Vec3>& points, const std::vector<double>& tolerances,
                   std::size_t max_control = 30);

}  // namespace bisector
