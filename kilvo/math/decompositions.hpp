// Decompositions compiled once, since each costs a source that instantiates it seconds. Give them matrices: an expression is one more.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace Eigen {
extern template SelfAdjointEigenSolver<Matrix3d>& SelfAdjointEigenSolver<Matrix3d>::compute(const EigenBase<Matrix3d>&, int);
extern template SelfAdjointEigenSolver<Matrix<double, 6, 6>>& SelfAdjointEigenSolver<Matrix<double, 6, 6>>::compute(
    const EigenBase<Matrix<double, 6, 6>>&, int);
extern template JacobiSVD<Matrix3d>& JacobiSVD<Matrix3d>::compute(const Matrix3d&, unsigned);
extern template JacobiSVD<Matrix<double, 2, 3>>& JacobiSVD<Matrix<double, 2, 3>>::compute(const Matrix<double, 2, 3>&, unsigned);
}  // namespace Eigen
