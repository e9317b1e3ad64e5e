// Instances of templates that the library uses as well, compiled with a user's flags. Where the linker takes these
// instead of the library's own, fused multiplications change results.
#include <Eigen/Dense>

#include <algorithm>
#include <numeric>
#include <vector>

// Not called: that they are compiled is enough. The sizes are those of quadrics' fits and of quadratic forms.
double eigenvalues(const Eigen::Matrix<double, 9, 9>& a) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>>(a).eigenvalues()[0];
}
double eigenvalues(const Eigen::Matrix3d& a) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(a).eigenvalues()[0];
}

double statistics(std::vector<double>& numbers) {
  std::sort(numbers.begin(), numbers.end());
  std::nth_element(numbers.begin(), numbers.begin() + 1, numbers.end());
  return std::accumulate(numbers.begin(), numbers.end(), 0.0);
}
