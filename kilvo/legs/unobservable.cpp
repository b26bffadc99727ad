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
