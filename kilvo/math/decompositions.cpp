#include "kilvo/math/decompositions.hpp"

namespace Eigen {
template SelfAdjointEigenSolver<Matrix3d>& SelfAdjointEigenSolver<Matrix3d>::compute(const EigenBase<Matrix3d>&, int);
template SelfAdjointEigenSolver<Matrix<double, 6, 6>>& SelfAdjointEigenSolver<Matrix<double, 6, 6>>::compute(
    const EigenBase<Matrix<double, 6, 6>>&, int);
template JacobiSVD<Matrix3d>& JacobiSVD<Matrix3d>::compute(const Matrix3d&, unsigned);
template JacobiSVD<Matrix<double, 2, 3>>& JacobiSVD<Matrix<double, 2, 3>>::compute(const Matrix<double, 2, 3>&, unsigned);
}  // namespace Eigen
