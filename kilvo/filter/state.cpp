#include "kilvo/filter/state.hpp"

#include <Eigen/Cholesky>

namespace kilvo {

State boxplus(const State& x, const ErrorVector& d) {
  State y;
  y.R = x.R * SO3::Exp(d.segment<3>(at::R));
  y.p = x.p + d.segment<3>(at::p);
  y.v = x.v + d.segment<3>(at::v);
  y.bg = x.bg + d.segment<3>(at::bg);
  y.ba = x.ba + d.segment<3>(at::ba);
  y.g = (x.g + d.segment<3>(at::g)).normalized() * x.g.norm();
  y.pc[0] = x.pc[0] + d.segment<3>(at::pcl);
  y.pc[1] = x.pc[1] + d.segment<3>(at::pcr);
  y.tau = x.tau + d[at::tau];
  return y;
}

ErrorVector boxminus(const State& a, const State& b) {
  ErrorVector d;
  d.segment<3>(at::R) = (b.R.inverse() * a.R).Log();
  d.segment<3>(at::p) = a.p - b.p;
  d.segment<3>(at::v) = a.v - b.v;
  d.segment<3>(at::bg) = a.bg - b.bg;
  d.segment<3>(at::ba) = a.ba - b.ba;
  // The tangent step t at b.g for which b.g + t points along a.g, so that boxplus undoes it exactly.
  const double squared = b.g.squaredNorm();
  d.segment<3>(at::g) = squared > 0 ? Eigen::Vector3d(a.g * (squared / a.g.dot(b.g)) - b.g) : Eigen::Vector3d(a.g - b.g);
  d.segment<3>(at::pcl) = a.pc[0] - b.pc[0];
  d.segment<3>(at::pcr) = a.pc[1] - b.pc[1];
  d[at::tau] = a.tau - b.tau;
  return d;
}

void begin_frame(Estimate& e) {
  const Eigen::Vector3d up_W = -e.x.g.normalized(), up_I = e.x.R.inverse() * up_W;
  // How the errors in the new frame depend on those in the old one: that of the heading turns the velocity and carries the feet along.
  Covariance T = Covariance::Identity();
  T.block<3, 3>(at::R, at::R) -= up_I * up_I.transpose();
  T.block<3, 3>(at::p, at::p).setZero();
  T.block<3, 3>(at::v, at::R) = -up_W.cross(e.x.v) * up_I.transpose();
  for (const int pc : {at::pcl, at::pcr}) {
    if (e.P.block<3, 3>(pc, pc).isZero(0)) continue;  // it does not stand
    T.block<3, 3>(pc, at::p) = -Eigen::Matrix3d::Identity();
    T.block<3, 3>(pc, at::R) = -up_W.cross(e.x.pc[pc == at::pcr ? 1 : 0] - e.x.p) * up_I.transpose();
  }
  e.P = (T * e.P * T.transpose()).eval();
  e.P = (0.5 * (e.P + e.P.transpose())).eval();
}

bool is_finite(const Estimate& e) {
  return e.x.R.matrix().allFinite() && e.x.p.allFinite() && e.x.v.allFinite() && e.x.bg.allFinite() && e.x.ba.allFinite() &&
         e.x.g.allFinite() && e.x.pc[0].allFinite() && e.x.pc[1].allFinite() && std::isfinite(e.x.tau) &&
         (0 * e.P).sum() == 0;  // zero times what is not finite is not a number
}

bool is_plausible(const Estimate& e) {
  constexpr double absurd_sigma = 1e4, rounding = 1e-12;  // m
  return is_finite(e) && e.x.v.norm() < absurd_speed && e.P.diagonal().minCoeff() > -rounding &&
         e.P.diagonal().segment<3>(at::p).maxCoeff() < absurd_sigma * absurd_sigma;
}

bool is_definite(const Covariance& P) {
  return P.ldlt().vectorD().minCoeff() > -1e-9;  // rounding
}

}  // namespace kilvo
