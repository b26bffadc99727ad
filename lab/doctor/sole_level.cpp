#include "lab/doctor/sole_level.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace kilvo::lab {
namespace {

// A window in which the accelerometer's mean is gravity, and the soles' mean normal belongs to one heading, s.
constexpr double window = 2;
constexpr std::size_t fewest_windows = 6;

/// Of one window, in the level frame of the link.
struct Tilt {
  Eigen::Vector2d turn;
  double heading = 0;
};

std::optional<Eigen::Vector3d> normal_of(const FootPose& foot) {
  if (foot.corners < 3) return std::nullopt;
  const Eigen::Vector3d normal = (foot.p[1] - foot.p[0]).cross(foot.p[2] - foot.p[0]);
  constexpr double least_area = 1e-4;  // m^2
  if (!(normal.norm() > least_area)) return std::nullopt;
  return normal.normalized();
}

double height_of(const FootPose& foot, const Eigen::Vector3d& up) {
  double sum = 0;
  for (int k = 0; k < foot.corners; ++k) sum += up.dot(foot.p[static_cast<std::size_t>(k)]);
  return sum / foot.corners;
}

// Of the lower foot, or of both where they are as low. `up`: about, in the frame of the link.
Eigen::Vector3d normal_of_standing(const LegPose& pose, const Eigen::Vector3d& up) {
  constexpr double as_low = 0.02;  // m
  const std::array<double, 2> height = {height_of(pose.foot[0], up), height_of(pose.foot[1], up)};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t side = 0; side < 2; ++side) {
    if (height[side] > height[1 - side] + as_low) continue;
    const Eigen::Vector3d normal = *normal_of(pose.foot[side]);
    sum += normal.dot(up) > 0 ? normal : -normal;
  }
  return sum.normalized();
}

// Constant in the link and constant in the world: the mount and the slope.
std::optional<SoleLevel> fit(const std::vector<Tilt>& tilts, const Eigen::Matrix<double, 3, 2>& level) {
  constexpr double of_zeros = 0.026, usual_slope = 0.087;  // rad: encoders, compliance; 5 degrees
  const auto slope_under = [](double heading) { return Eigen::Rotation2Dd(-heading).toRotationMatrix(); };
  double variance = of_zeros * of_zeros;
  Eigen::Vector4d x = Eigen::Vector4d::Zero();
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  for (int pass = 0; pass < 2; ++pass) {
    information.setZero();
    information.diagonal().tail<2>().setConstant(1 / (usual_slope * usual_slope));
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const Tilt& tilt : tilts) {
      Eigen::Matrix<double, 2, 4> H;
      H << Eigen::Matrix2d::Identity(), slope_under(tilt.heading);
      information += H.transpose() * H / variance;
      right += H.transpose() * tilt.turn / variance;
    }
    x = information.ldlt().solve(right);
    double squares = 0;
    for (const Tilt& tilt : tilts) squares += (tilt.turn - x.head<2>() - slope_under(tilt.heading) * x.tail<2>()).squaredNorm();
    variance = std::max(variance, squares / (2 * static_cast<double>(tilts.size())));
  }
  // Ground that changes, and soles that roll, are alike for many windows: their scatter counts as if only four were independent.
  const Eigen::Matrix2d of_fit = information.inverse().topLeftCorner<2, 2>();
  constexpr double independent = 4;
  const double of_mean = of_fit.trace() / 2 + variance / independent;
  SoleLevel out;
  out.sigma = std::sqrt(of_mean + of_zeros * of_zeros);
  out.turn = level * x.head<2>();
  out.information = level * level.transpose() / (out.sigma * out.sigma);
  return out;
}

}  // namespace

std::optional<SoleLevel> sole_level(const std::vector<LegPose>& path, const std::vector<InertialSample>& imu, const GyroPath& gyro,
                                    const SO3& R_link_imu, double offset, const std::function<bool(double)>& walks) {
  if (path.empty() || imu.empty() || !normal_of(path.front().foot[0]) || !normal_of(path.front().foot[1])) return std::nullopt;
  const Eigen::Matrix3d R = R_link_imu.matrix();
  Eigen::Matrix<double, 3, 2> level = Eigen::Matrix<double, 3, 2>::Zero();  // a basis of the horizontal plane, in the link
  std::vector<Tilt> tilts;
  std::optional<Eigen::Quaterniond> first;
  Eigen::Vector3d up_first = Eigen::Vector3d::Zero();
  auto sample = imu.begin();
  auto pose = path.begin();
  for (double begin = std::max(imu.front().t, path.front().t + offset); gyro.covers(begin, begin + window); begin += window) {
    const double middle = begin + window / 2;
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    int samples = 0;
    for (; sample != imu.end() && sample->t < begin + window; ++sample) {
      if (sample->t >= begin) force += gyro.between(middle, sample->t) * sample->accel, ++samples;
    }
    if (samples == 0 || !walks(middle)) continue;
    force /= samples;
    constexpr double gravity = 9.81, near_gravity = 0.1;
    if (std::abs(force.norm() / gravity - 1) > near_gravity) continue;
    const Eigen::Vector3d up = force.normalized();
    for (; pose != path.end() && pose->t + offset < begin + window; ++pose) {
      const double t = pose->t + offset;
      if (t < begin) continue;
      const Eigen::Quaterniond turned = gyro.between(middle, t);
      normal += turned * (R.transpose() * normal_of_standing(*pose, R * (turned.conjugate() * up)));
    }
    if (!(normal.norm() > 0)) continue;
    const Eigen::Vector3d up_link = R * up;
    if (!first) {
      first = gyro.at(middle);
      up_first = *first * up;
      level.col(0) = up_link.unitOrthogonal();
      level.col(1) = up_link.cross(level.col(0));
    }
    const Eigen::Vector3d turn = R * up.cross(normal.normalized());
    // About the vertical, of what turned since the first window.
    const Eigen::Quaterniond since = gyro.at(middle) * first->conjugate();
    tilts.push_back({level.transpose() * turn, 2 * std::atan2(up_first.dot(since.vec()), since.w())});
  }
  if (tilts.size() < fewest_windows) return std::nullopt;
  return fit(tilts, level);
}

}  // namespace kilvo::lab
