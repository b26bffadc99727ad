#include "kilvo/legs/dead_reckoning.hpp"

namespace kilvo {
namespace {

// Standard deviations that a careful description leaves: rad, a share, a share (the scale of the gyro, by data sheets).
constexpr double mount = 0.01, length = 0.01, gyro_scale = 0.003;

}  // namespace

void DeadReckoning::add(const State& x) {
  if (!x.p.allFinite() || !x.R.matrix().allFinite() || !x.g.allFinite()) return;  // a state that is thrown away
  if (last_) {
    const Eigen::Vector3d up_W = -x.g.normalized(), step = x.p - last_->p;
    turned_ += up_W.dot(last_->R * (last_->R.inverse() * x.R).Log());
    by_mount_ -= skew(step) * x.R.matrix();
    by_length_ += step;
    by_gyro_ += turned_ * up_W.cross(step);
  }
  last_ = x.pose();
}

PoseCovariance DeadReckoning::error(const State& x) const {
  PoseCovariance out = PoseCovariance::Zero();
  out.bottomRightCorner<3, 3>() = mount * mount * by_mount_ * by_mount_.transpose() + length * length * by_length_ * by_length_.transpose();
  Eigen::Matrix<double, 6, 1> by_gyro;
  by_gyro << turned_ * (x.R.inverse() * -x.g.normalized()), by_gyro_;
  out += gyro_scale * gyro_scale * by_gyro * by_gyro.transpose();
  return out;
}

}  // namespace kilvo
