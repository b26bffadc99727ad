#include "kilvo/legs/unobservable.hpp"

#include "kilvo/filter/measurement_rows.hpp"
#include "kilvo/filter/update.hpp"

namespace kilvo {

Heading heading_of(const State& x) {
  const Eigen::Vector3d up_I = x.R.matrix().transpose() * -x.g.normalized();
  Heading out = Heading::Zero();
  out.block<3, 1>(at::R, 0) = up_I;
  out.block<3, 1>(at::bg, 1) = up_I;
  return out;
}

void keep_heading_apart(const State& from, Estimate& e) {
  constexpr double small_angle = 0.5;  // rad
  const State& to = e.x;
  const Eigen::Vector3d up = -from.g.normalized(), up_I = from.R.inverse() * up;
  const ErrorVector with_heading = e.P.middleCols<3>(at::R) * up_I;
  const double variance = up_I.dot(with_heading.segment<3>(at::R));
  if (variance < small_angle * small_angle) return;
  ErrorVector change = ErrorVector::Zero();  // of the errors that an error of the heading by 1 rad makes
  change.segment<3>(at::R) = to.R.inverse() * up - up_I;
  change.segment<3>(at::p) = up.cross(to.p - from.p);
  change.segment<3>(at::v) = up.cross(to.v - from.v);
  change.segment<3>(at::g) = up.cross(to.g - from.g);
  change.segment<3>(at::pcl) = up.cross(to.pc[0] - from.pc[0]);
  change.segment<3>(at::pcr) = up.cross(to.pc[1] - from.pc[1]);
  const ErrorVector half = with_heading + 0.5 * variance * change;
  e.P += change * half.transpose() + half * change.transpose();
  e.P.triangularView<Eigen::StrictlyUpper>() = e.P.transpose();
}

Estimate with_gyro_bias(const Estimate& e, const GyroBiasReading& reading) {
  const auto rows_of = [&reading](const State& x, const Covariance&) {
    Rows<6> rows;
    rows.r = x.bg - reading.bias;
    rows.H.setZero(3, at::size);
    rows.H.block<3, 3>(0, at::bg).setIdentity();
    rows.R = reading.sigma * reading.sigma * Eigen::Matrix3d::Identity();
    return rows;
  };
  UpdateConfig once;
  once.max_iterations = 1;
  return update(e, rows_of, once).posterior;
}

}  // namespace kilvo
