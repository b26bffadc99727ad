#include "kilvo/math/so3.hpp"

#include <Eigen/LU>
#include <cmath>

#include "kilvo/math/decompositions.hpp"

namespace kilvo {
namespace {

// Below this angle the Taylor series is exact to rounding: its next term is below 1e-17.
constexpr double small_angle_squared = 1e-6;

}  // namespace

SO3 SO3::nearest(const Eigen::Matrix3d& m) {
  // Within rounding already: one Newton step of the polar decomposition squares what is left, and takes a tenth of the time.
  constexpr double close = 1e-7;
  const Eigen::Matrix3d square = m.transpose() * m;
  if ((square - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < close && m.determinant() > 0)
    return SO3(Eigen::Matrix3d(m * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * square)));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0;
  return SO3(svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose());
}

SO3 SO3::Exp(const Eigen::Vector3d& theta) {
  const double a2 = theta.squaredNorm();
  double s, c;  // sin(a)/a, (1-cos(a))/a^2
  if (a2 < small_angle_squared) {
    s = 1.0 - a2 / 6.0 + a2 * a2 / 120.0;
    c = 0.5 - a2 / 24.0 + a2 * a2 / 720.0;
  } else {
    const double a = std::sqrt(a2);
    const double half = std::sin(0.5 * a);
    s = std::sin(a) / a;
    c = 2.0 * half * half / a2;
  }
  const Eigen::Matrix3d K = skew(theta);
  return SO3(Eigen::Matrix3d(Eigen::Matrix3d::Identity() + s * K + c * K * K));
}

Eigen::Vector3d SO3::Log() const {
  // The quaternion has no loss of precision near pi, where the matrix's trace has; its sign selects the shorter rotation.
  Eigen::Quaterniond q = Eigen::Quaterniond(R_).normalized();
  if (q.w() < 0) q.coeffs() *= -1.0;
  const double n2 = q.vec().squaredNorm();
  if (n2 < small_angle_squared) {
    // 2 atan(n/w)/n as a series in n/w.
    const double r2 = n2 / (q.w() * q.w());
    return q.vec() * (2.0 / q.w() * (1.0 - r2 / 3.0 + r2 * r2 / 5.0));
  }
  const double n = std::sqrt(n2);
  return q.vec() * (2.0 * std::atan2(n, q.w()) / n);
}

SO3 SO3::operator*(const SO3& o) const {
  const Eigen::Matrix3d m = R_ * o.R_;
  // One Newton step of the polar decomposition: rounding does not grow over any number of products.
  return SO3(Eigen::Matrix3d(m * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * (m.transpose() * m))));
}

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& theta) {
  const double a2 = theta.squaredNorm();
  double b, c;  // (1-cos(a))/a^2, (a-sin(a))/a^3
  if (a2 < small_angle_squared) {
    b = 0.5 - a2 / 24.0 + a2 * a2 / 720.0;
    c = 1.0 / 6.0 - a2 / 120.0 + a2 * a2 / 5040.0;
  } else {
    const double a = std::sqrt(a2);
    const double half = std::sin(0.5 * a);
    b = 2.0 * half * half / a2;
    c = (a - std::sin(a)) / (a2 * a);
  }
  const Eigen::Matrix3d K = skew(theta);
  return Eigen::Matrix3d::Identity() - b * K + c * K * K;
}

}  // namespace kilvo
