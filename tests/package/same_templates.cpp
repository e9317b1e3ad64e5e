// Instances of templates that the library uses as well, compiled with a user's flags. Where the linker takes these instead of
// the library's own, fused multiplications change results.
#include <Eigen/Dense>
#include <Eigen/Sparse>

#include <algorithm>
#include <numeric>
#include <vector>

namespace {

using Matrix9 = Eigen::Matrix<double, 9, 9>;
using Few = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12>;

template <class Matrix>
double decompose(const Matrix& a) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(a);
  const Eigen::SelfAdjointEigenSolver<Matrix> values(a, Eigen::EigenvaluesOnly);
  const Eigen::LDLT<Matrix> ldlt(a);
  const Eigen::ColPivHouseholderQR<Matrix> qr(a);
  return eigen.eigenvalues()[0] + values.eigenvalues()[0] + ldlt.vectorD()[0] + qr.maxPivot() + (a * a).trace();
}

}  // namespace

// Not called: that it is compiled is enough.
double same_templates(double x, std::vector<double> numbers) {
  double sum = decompose<Eigen::Matrix2d>(Eigen::Matrix2d::Constant(x)) + decompose<Eigen::Matrix3d>(Eigen::Matrix3d::Constant(x)) +
               decompose<Eigen::Matrix4d>(Eigen::Matrix4d::Constant(x)) + decompose<Matrix9>(Matrix9::Constant(x)) +
               decompose<Eigen::MatrixXd>(Eigen::MatrixXd::Constant(20, 20, x)) + decompose<Few>(Few::Constant(7, 7, x));
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix9> general(Matrix9::Constant(x), Matrix9::Identity());
  sum += general.eigenvalues()[0];
  Eigen::SparseMatrix<double> sparse(4, 4);
  sparse.insert(0, 0) = x;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(sparse);
  sum += factors.vectorD()[0];
  std::sort(numbers.begin(), numbers.end());
  std::nth_element(numbers.begin(), numbers.begin() + 1, numbers.end());
  numbers.push_back(sum);
  return std::accumulate(numbers.begin(), numbers.end(), 0.0) +
         std::inner_product(numbers.begin(), numbers.end(), numbers.begin(), 0.0);
}
